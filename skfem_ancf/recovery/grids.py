"""Members of a deformed configuration as points and cells, for plots and files."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..beam.beam import Beam
from ..core.errors import InputError, require_flag, require_integer, require_like, shown
from ..core.quadrature import tensor
from ..core.types import Array
from .fields import DomainValues, Values, values_on_grid

#: VTK cell numbers by meshio's names.
CELL_TYPES = {"triangle": 5, "polygon": 7, "quad": 9, "VTK_LAGRANGE_QUADRILATERAL": 70}

#: Largest degree of Lagrange cells in VTK.
MAX_LAGRANGE_DEGREE = 10

#: Distance of points from a jump, relative to the height of a layer.
BESIDE = 1e-9

#: Largest number of subdivisions of an element, and of points of a body.
MAX_SUBDIVISION, MAX_POINTS = 1000, 10**8


class Grid(NamedTuple):
    """One member as points and cells.

    ``x`` and ``u`` are reference positions and displacements, (2, n). ``kind`` is meshio's name of
    the cells: "quad", "triangle", "VTK_LAGRANGE_QUADRILATERAL" or "polygon"; ``cells`` (nc, k) are
    point numbers, ``elements`` (nc,) their elements. ``rows`` points across a section are
    consecutive. ``values`` are those of a beam or domain, None for a rigid body. ``between`` (2, k)
    are numbers of coincident points of neighbouring elements.
    """

    name: str
    x: Array
    u: Array
    kind: str
    cells: Array
    elements: Array
    rows: int
    values: Values | DomainValues | None
    between: Array = np.zeros((2, 0), dtype=int)

    def points(self, undeformed: bool = False) -> Array:
        """Positions with a zero third component, shape (n, 3)."""
        return in_space(self.x if undeformed else self.x + self.u)


def grids(state: Any, subdivide: Any = (8, 4), lagrange: bool = False,
          recover: bool = True) -> list[Grid]:
    """The :class:`Grid` of each beam, rigid body and domain of a state.

    ``subdivide`` is the number of quads along and across an element; with ``lagrange`` an element
    is one Lagrange cell.
    """
    require_like("state", state, "State", "beams", "u_of")
    m, n = subdivision(subdivide)
    lagrange, recover = require_flag("lagrange", lagrange), require_flag("recover", recover)
    total = sum(b.mesh.nelements for b in state.beams) * (m + 1) * (n + 1)
    if total > MAX_POINTS and not lagrange:
        raise InputError(f"subdivide={(m, n)} makes {total} points, more than {MAX_POINTS}")
    out = []
    for k, beam in enumerate(state.beams):
        X, local = lagrange_cell(beam) if lagrange else layout(beam, m, n)
        values, ne = values_on_grid(state, beam, X, recover), beam.mesh.nelements
        start = X.shape[-1] * np.arange(ne)
        rows = X.shape[-1] // (1 + m) if not lagrange else round(X.shape[-1] ** 0.5)
        out.append(Grid(f"beam {k}" if beam.name is None else beam.name, values.x, values.u,
                        "VTK_LAGRANGE_QUADRILATERAL" if lagrange else "quad",
                        (start[:, None, None] + local).reshape(-1, local.shape[1]),
                        np.repeat(np.arange(ne), len(local)), rows, values,
                        _between(beam.mesh, X.shape[-1], rows)))
    for k, body in enumerate(getattr(state, "bodies", ())):
        x = body.outline_at(np.zeros(4))
        out.append(Grid(f"body {k}" if body.name is None else body.name, x,
                        body.outline_at(state.u_of(body)) - x, "polygon",
                        np.arange(x.shape[1])[None], np.zeros(1, dtype=int), 1, None))
    for k, domain in enumerate(getattr(getattr(state, "system", None), "domains", ())):
        x, u, gradient, cells = domain.drawn(state.u_of(domain))
        number = domain.basis.mesh.nelements
        out.append(Grid(f"domain {k}" if domain.name is None else domain.name, x, u,
                        "triangle" if cells.shape[1] == 3 else "quad", cells,
                        np.repeat(np.arange(number), len(cells) // number), 1,
                        DomainValues(x, u, gradient)))
    return out


def _between(mesh, n, rows):
    """Last points of elements and first points of the next ones, (2, k); n points each."""
    e = np.flatnonzero(mesh.t[1, :-1] == mesh.t[0, 1:])[:, None]
    first = n * (e + 1) + np.arange(rows)
    return np.array([first - rows, first]).reshape(2, -1)


def subdivision(subdivide: Any) -> tuple[int, int]:
    """Checked numbers of intervals along and across an element."""
    try:
        m, n = subdivide
    except (TypeError, ValueError):
        m = n = None
    try:
        m, n = (require_integer("subdivide", k, 1, MAX_SUBDIVISION) for k in (m, n))
        return m, n
    except InputError:
        raise InputError(f"subdivide must be two positive integers up to {MAX_SUBDIVISION}, along "
                         f"and across an element, got {shown(subdivide)}") from None


def in_space(x: Array) -> Array:
    """Plane vectors (2, ...) as rows with a zero third component, shape (n, 3)."""
    out = np.zeros((x[0].size, 3))
    out[:, :2] = x.reshape(2, -1).T
    return out


def grid(m: int, n: int) -> Array:
    """(m + 1) (n + 1) points of the reference cell, eta fastest; shape (2, npoints)."""
    xi, eta = np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1)
    return tensor((xi, xi), (eta, eta))[0]


def quads(m: int, n: int) -> Array:
    """The m n quads of :func:`grid` as rows of 4 points, counterclockwise."""
    k = np.arange((m + 1) * (n + 1)).reshape(m + 1, n + 1)
    return np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)


def layout(beam: Beam, m: int, n: int) -> tuple[Array, Array]:
    """Points and quads of an element with m and n intervals along and across.

    Each interval of the section has at least one cell, with points on both sides of jumps. Points
    are (2, npoints), or (2, nelements, npoints) if the intervals vary along the axis.
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
    """Points of an element's Lagrange cell, and their VTK order.

    The order is corners, edges (bottom, right, top, left, in the direction of increasing xi and
    eta), interior with xi fastest.
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
