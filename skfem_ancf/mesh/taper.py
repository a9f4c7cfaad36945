"""Heights that vary along the axis: a cubic polynomial of xi in each element."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.errors import MeshError, ask_array, require_function, require_positive
from ..core.quadrature import lagrange
from ..core.types import Array

#: Axial coordinates of the heights of an element, and points between at which the fit is checked.
PLACES, BETWEEN = np.arange(4) / 3.0, (1.0 + 2.0 * np.arange(3)) / 6.0

#: Largest relative error of the fit.
FITS = 0.02


def scaled(function: Callable[[Array], Any], factor: float, s: Array) -> Array:
    """``factor`` times a function of parameters (n,)."""
    return factor * np.asarray(function(s))


def heights_of(height: Any, s: Array, t: Array) -> tuple[float, Array | None, Any]:
    """Largest height, heights (4, ne) in the elements, and the function; None for a number.

    ``s`` are the parameters of the nodes, ``t`` the nodes of the elements. Raises MeshError if a
    cubic does not fit the function in an element.
    """
    if not callable(height):
        return require_positive("height", height), None, None
    require_function("height", height, "of parameters (n,) that returns heights (n,)")
    a, b = s[t]
    at = a + np.append(PLACES, BETWEEN)[:, None] * (b - a)
    found = ask_array("height(x)", (at.size,), height, at.ravel(), number=True)
    found = found.reshape(at.shape)
    if not np.all(found > 0.0):
        k = np.unravel_index(np.argmin(found), found.shape)
        raise MeshError(f"the height of a beam is positive, the function returns {found[k]:.6g} "
                        f"at {at[k]:.6g}: end the mesh before it gets thin there")
    heights, between = found[:4].copy(), found[4:]
    gap = np.abs(lagrange(PLACES, BETWEEN) @ heights - between) / between
    if np.max(gap) > FITS:
        e = int(np.argmax(np.max(gap, axis=0)))
        raise MeshError(
            f"the height is not smooth in element {e}, from {a[e]:.6g} to {b[e]:.6g}: a cubic "
            f"polynomial differs by {np.max(gap):.1%}. Put a node at a kink, weld two beams at "
            "a jump, or use more elements")
    return float(np.max(heights)), heights, height


def powers(heights: Array) -> Array:
    """Coefficients of 1, xi, xi^2, xi^3 from heights; both of shape (4, nelements)."""
    return np.linalg.solve(np.vander(PLACES, increasing=True), heights)


def halved(heights: Array, marked: Array) -> Array:
    """Heights (4, nelements) after halving the ``marked`` elements."""
    left, right = (lagrange(PLACES, a + 0.5 * PLACES) @ heights[:, marked] for a in (0.0, 0.5))
    out = np.repeat(heights, 1 + marked, axis=1)
    first = np.flatnonzero(marked) + np.arange(np.sum(marked))
    out[:, first], out[:, first + 1] = left, right
    return out
