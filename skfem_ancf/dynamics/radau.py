"""The Radau IIA method."""

from __future__ import annotations

import numpy as np

from ..core.immutable import read_only
from ..core.types import Array
from .collocation import Collocation


POINTS = read_only(np.array([0.4 - 0.1 * np.sqrt(6.0), 0.4 + 0.1 * np.sqrt(6.0), 1.0]))


class Radau(Collocation):
    """Radau IIA with three points: order 5, L-stable.

    Vibrations that a step does not resolve are damped at once: for stiff beams and large steps.

    Examples
    --------
    >>> from skfem_ancf.dynamics import Radau
    >>> Radau().points.round(4).tolist()
    [0.1551, 0.6449, 1.0]

    References
    ----------
    Hairer, Wanner: "Solving Ordinary Differential Equations II", IV.5, table 5.6.
    """

    name = "radau"
    order = 5
    error_constant = 1.0 / 7200.0
    safety = 0.8

    @property
    def points(self) -> Array:
        return POINTS
