"""Grids of points over a deformed body, for pictures and files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, require_integer, shown
from ..core.quadrature import tensor

if TYPE_CHECKING:
    from ..beam.beam import Beam
    from ..core.types import Array

#: VTK evaluates Lagrange cells up to this degree.
MAX_LAGRANGE_DEGREE = 10

#: Of the height of a layer, how far points beside a jump are from it.
BESIDE = 1e-9

#: Subdivisions of an element along or across, at most.
MAX_SUBDIVISION = 1000


def subdivision(subdivide: Any) -> tuple[int, ...]:
    """Intervals along and across an element, checked."""
    try:
        m, n = subdivide
    except (TypeError, ValueError):
        m = n = None
    try:
        return tuple(require_integer("subdivide", k, 1, MAX_SUBDIVISION) for k in (m, n))
    except InputError:
        raise InputError(f"subdivide must be two positive integers up to {MAX_SUBDIVISION}, along "
                         f"and across an element, got {shown(subdivide)}") from None


def in_space(x: Array) -> Array:
    """Vectors (2, ...) of the plane as rows with a third component of zero, shape (n, 3)."""
    out = np.zeros((x[0].size, 3))
    out[:, :2] = x.reshape(2, -1).T
    return out


def grid(m: int, n: int) -> Array:
    """A grid of (m + 1) (n + 1) points of the reference cell, eta fastest; shape (2, npoints).

    Parameters
    ----------
    m, n
        Intervals along and across.
    """
    xi, eta = np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1)
    return tensor((xi, xi), (eta, eta))[0]


def quads(m: int, n: int) -> Array:
    """The m n quads of :func:`grid` as rows of 4 points, counterclockwise.

    Parameters
    ----------
    m, n
        Intervals along and across.
    """
    k = np.arange((m + 1) * (n + 1)).reshape(m + 1, n + 1)
    return np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)


def layout(beam: Beam, m: int, n: int) -> tuple[Array, Array]:
    """Points and quads of an element; where fields jump across it has points on both sides.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    m, n
        Intervals along and across, of these at least one for each piece of the section.

    Returns
    -------
    X, quads
        Points of the reference cell, shape (2, npoints), or (2, nelements, npoints) where pieces
        have other parts of the height from place to place, and rows of 4 points.
    """
    sizes = np.diff(beam.across.ends())
    if len(sizes) == 1:
        return grid(m, n), quads(m, n)
    xi, last = np.linspace(0, 1, m + 1), len(sizes) - 1
    at = beam.across.ends(xi)[..., None]
    rows = [low + (high - low) * np.linspace(BESIDE * (k > 0), 1 - BESIDE * (k < last),
                                             max(1, round(n * size)) + 1)
            for k, (low, high, size) in enumerate(zip(at[:-1], at[1:], sizes))]
    eta = np.concatenate(rows, axis=-1)
    X = np.array(np.broadcast_arrays(xi[:, None], eta))
    between = np.cumsum([row.shape[-1] for row in rows])[:-1] - 1
    cells = quads(m, eta.shape[-1] - 1).reshape(m, -1, 4)
    return X.reshape(X.shape[:-2] + (-1,)), np.delete(cells, between, axis=1).reshape(-1, 4)


def lagrange_cell(beam: Beam) -> tuple[Array, Array]:
    """Points of the Lagrange cell that holds an element, and their order in VTK.

    VTK numbers the corners, then the inner points of the edges bottom, right, top, left (in the
    directions of rising xi and eta), then the inside with xi fastest. An axis of a degree beyond
    those of VTK is interpolated by the highest there is.
    """
    p = max(min(beam.element.axis_degree, MAX_LAGRANGE_DEGREE), beam.element.order)
    if p > MAX_LAGRANGE_DEGREE:
        raise InputError(f"VTK evaluates Lagrange cells up to degree {MAX_LAGRANGE_DEGREE}, this "
                         f"element has {p}: use subdivide= instead of lagrange=True")
    k = np.arange((p + 1) ** 2).reshape(p + 1, p + 1)  # [xi, eta]
    inner = slice(1, -1)
    order = np.concatenate([
        [k[0, 0], k[-1, 0], k[-1, -1], k[0, -1]],
        k[inner, 0], k[-1, inner], k[inner, -1], k[0, inner], k[inner, inner].T.ravel()])
    return grid(p, p), order[None]
