"""Types for annotations."""

import os
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from numpy.typing import ArrayLike, NDArray

#: An array of numbers.
Array: TypeAlias = NDArray[Any]

#: An argument of :func:`skfem_ancf.mesh.places.facets_of`.
Place: TypeAlias = str | ArrayLike | Callable[[Array], Array]

#: The amplitude of a force: a function of time, or None.
TimeFunction: TypeAlias = Callable[[float], float] | None

#: The name of a file.
StrPath: TypeAlias = str | os.PathLike[str]

#: Points and weights of a rule on [0, 1].
Rule: TypeAlias = tuple[Array, Array]


class Law(Protocol):
    """A constitutive law: functions of the strain (3, ...)."""

    def energy(self, strain: Array) -> Array:
        """Energy per volume, shape (...)."""

    def stress(self, strain: Array) -> Array:
        """Second Piola-Kirchhoff stress, shape (3, ...)."""

    def moduli(self, strain: Array) -> Array:
        """Derivative of the stress, shape (3, 3, ...)."""
