"""Heights that vary along the axis: a cubic polynomial of xi in each element."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.errors import MeshError, ask_array, require_function, require_positive
from ..core.quadrature import lagrange
from ..core.types import Array

#: Where the heights of an element are given, and between them, where a cubic has to fit.
PLACES, BETWEEN = np.arange(4) / 3.0, (1.0 + 2.0 * np.arange(3)) / 6.0

#: Largest relative error of the cubic there.
FITS = 0.02


def scaled(function: Callable[[Array], Any], factor: float, s: Array) -> Array:
    """A function of parameters (n,) times a number."""
    return factor * np.asarray(function(s))


def heights_of(height: Any, s: Array, t: Array) -> tuple[float, Array | None, Any]:
    """Largest height, heights (4, ne) in the elements and their function; None of a number.

    ``s`` are the parameters of the nodes, ``t`` the nodes of the elements. Raises MeshError if the
    function is no cubic in an element.
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
            f"the height is no smooth function in element {e}, from {a[e]:.6g} to {b[e]:.6g}: a "
            f"cubic polynomial misses it by {np.max(gap):.1%}. Put a node at a kink, weld two "
            "beams where it jumps, or take more elements")
    return float(np.max(heights)), heights, height


def powers(heights: Array) -> Array:
    """Coefficients of 1, xi, xi^2, xi^3 from heights; both of shape (4, nelements)."""
    return np.linalg.solve(np.vander(PLACES, increasing=True), heights)


def halved(heights: Array, marked: Array) -> Array:
    """The heights (4, nelements) of elements of which those that are ``marked`` are halved."""
    left, right = (lagrange(PLACES, a + 0.5 * PLACES) @ heights[:, marked] for a in (0.0, 0.5))
    out = np.repeat(heights, 1 + marked, axis=1)
    first = np.flatnonzero(marked) + np.arange(np.sum(marked))
    out[:, first], out[:, first + 1] = left, right
    return out
