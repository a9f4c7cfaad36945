"""A smooth axis through points from an array or a text file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import (FileError, MeshError, require_finite, require_finite_scalar,
                           require_integer, require_path)
from ..core.types import Array

#: Chords per interval between two points for its length.
PIECES = 32
#: Smallest distance of adjacent points, relative to the largest.
CLOSE = 1e-6


def axis_of(points: Any, elements: int | None, noise: float) -> tuple[Any, Array]:
    """A cubic spline r(s) and parameters of the nodes, see :meth:`MeshBeam.from_points`."""
    from scipy.interpolate import BSpline, splprep

    x = _table(points) if isinstance(points, str) or hasattr(points, "__fspath__") else points
    x = require_finite("points", x, (None, 2))
    noise, n = require_finite_scalar("noise", noise), len(x)
    if n < 2 or noise < 0:
        raise MeshError(f"an axis needs at least two points, got {n}" if n < 2 else
                        f"noise must not be negative, got {noise!r}")
    steps = np.hypot(*np.diff(x, axis=0).T)
    k = int(np.argmin(steps))
    if not steps[k] > CLOSE * np.max(steps):  # the spline would turn between them
        raise MeshError(f"the points {k} and {k + 1} are both at {x[k].tolist()}: leave one out")
    s = np.append(0.0, np.cumsum(steps))
    (t, c, k), _ = splprep(x.T, u=s, s=n * noise**2, k=min(3, n - 1))
    curve = BSpline(t, np.array(c), k, axis=1)
    if elements is None:
        return curve, s
    elements = require_integer("elements", elements, 1)
    fine = np.interp(np.arange(PIECES * (n - 1) + 1) / PIECES, np.arange(n), s)
    length = np.append(0.0, np.cumsum(np.hypot(*np.diff(curve(fine)))))
    return curve, np.interp(np.linspace(0.0, length[-1], elements + 1), length, fine)


def _table(filename):
    """Rows x, y of a file, separated by commas, blanks or semicolons, with an optional header."""
    path = require_path("points", filename)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{path} cannot be read: {error}") from error
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if any(";" in line for line in lines):  # maybe with decimal commas
        lines = [line.replace(",", ".").replace(";", ",") for line in lines]
    if lines and any(letter.isalpha() and letter not in "eE" for letter in lines[0]):
        lines = lines[1:]
    try:
        rows = np.loadtxt(lines, delimiter="," if lines and "," in lines[0] else None, ndmin=2,
                          quotechar='"')
    except ValueError as error:
        raise MeshError(f"{path} must hold rows of two numbers, x and y: {error}") from None
    if rows.shape[1] != 2:
        raise MeshError(f"{path} must hold rows of two numbers, x and y; it has {rows.shape[1]} "
                        "columns")
    return rows
