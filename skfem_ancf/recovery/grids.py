"""Members of a deformed configuration as points, cells and arrays, for plots and files."""

import logging
import re
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from ..beam import Beam, drawn
from ..core import (Array, InputError, refuse, require_flag, require_integer, require_like, retold,
                    tensor)
from .fields import DomainValues, Field, Values, values_on_grid

#: VTK cell numbers by meshio's names.
CELL_TYPES = {"triangle": 5, "polygon": 7, "quad": 9, "VTK_LAGRANGE_QUADRILATERAL": 70}

#: Largest degree of Lagrange cells in VTK.
MAX_LAGRANGE_DEGREE = 10

#: Distance of points from a jump, relative to the height of a layer.
BESIDE = 1e-9

#: Largest number of subdivisions of an element, and of points of a body.
MAX_SUBDIVISION, MAX_POINTS = 1000, 10**8


class Grid(NamedTuple):
    """One member as points and cells."""

    name: str
    x: Array  # reference positions, (2, n)
    u: Array  # displacements, (2, n)
    kind: str  # of the cells, by meshio's name
    cells: Array  # point numbers, (nc, k)
    elements: Array  # of the cells, (nc,)
    rows: int  # so many points across a section are consecutive
    values: Values | DomainValues | None  # None for a rigid body
    coincident: Array = np.zeros((2, 0), dtype=int)  # coincident points of neighbouring elements

    def points(self, undeformed: bool = False) -> Array:
        """Positions with a zero third component, shape (n, 3)."""
        return in_space(self.x if undeformed else self.x + self.u)


def grids(state: Any, subdivide: Any = (8, 4), lagrange: bool = False,
          recover: bool = True) -> list[Grid]:
    """The :class:`Grid` of each beam, rigid body and domain of a state."""
    # ``subdivide`` is the number of quads along and across an element; with ``lagrange`` an element
    # is one Lagrange cell.
    require_like("state", state, "State", "beams", "u_of")
    with retold((TypeError, ValueError), "subdivide must be two positive integers up to {}, along "
                "and across an element, got {!r}", MAX_SUBDIVISION, subdivide):
        m, n = (require_integer("subdivide", k, 1, MAX_SUBDIVISION) for k in subdivide)
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
        # first points of elements that are joined to the one before, whose last ones are there
        next_ones = 1 + np.flatnonzero(beam.mesh.t[1, :-1] == beam.mesh.t[0, 1:])
        first = start[next_ones, None] + np.arange(rows)
        out.append(Grid(f"beam {k}" if beam.name is None else beam.name, values.x, values.u,
                        "VTK_LAGRANGE_QUADRILATERAL" if lagrange else "quad",
                        (start[:, None, None] + local).reshape(-1, local.shape[1]),
                        np.repeat(np.arange(ne), len(local)), rows, values,
                        np.array([first - rows, first]).reshape(2, -1)))
    for k, body in enumerate(getattr(state, "bodies", ())):
        x = body.outline_at(np.zeros(4))
        out.append(Grid(f"body {k}" if body.name is None else body.name, x,
                        body.outline_at(state.u_of(body)) - x, "polygon",
                        np.arange(x.shape[1])[None], np.zeros(1, dtype=int), 1, None))
    for k, domain in enumerate(getattr(getattr(state, "system", None), "domains", ())):
        values, cells = values_of_domain(state, domain)
        number = domain.basis.mesh.nelements
        out.append(Grid(f"domain {k}" if domain.name is None else domain.name, values.x, values.u,
                        "triangle" if cells.shape[1] == 3 else "quad", cells,
                        np.repeat(np.arange(number), len(cells) // number), 1,
                        values))
    return out


def values_of_domain(state: Any, domain: Any) -> tuple[DomainValues, Array]:
    """Values of a domain at points of its cells, and the cells of a grid."""
    *at, cells = drawn(domain, state._places_of(domain))
    return DomainValues(domain, *at), cells


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
    """Points (2, [nelements,] npoints) and quads of an element with m and n intervals."""
    # each interval of the section has at least one cell, with points on both sides of jumps
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
    breaks = np.cumsum([row.shape[-1] for row in rows])[:-1] - 1
    cells = quads(m, eta.shape[-1] - 1).reshape(m, -1, 4)
    return X.reshape(X.shape[:-2] + (-1,)), np.delete(cells, breaks, axis=1).reshape(-1, 4)


def lagrange_cell(beam: Beam) -> tuple[Array, Array]:
    """Points of an element's Lagrange cell, and their VTK order."""
    p = max(min(beam.element.axis_degree, MAX_LAGRANGE_DEGREE), beam.element.order)
    refuse(p > MAX_LAGRANGE_DEGREE, "VTK has Lagrange cells up to degree {}, this element has {}: "
           "use subdivide=", MAX_LAGRANGE_DEGREE, p)
    k = np.arange((p + 1) ** 2).reshape(p + 1, p + 1)  # [xi, eta]
    inner = slice(1, -1)
    # corners, edges in the direction of increasing xi and eta, the interior with xi fastest
    order = np.concatenate([
        [k[0, 0], k[-1, 0], k[-1, -1], k[0, -1]],
        k[inner, 0], k[-1, inner], k[inner, -1], k[0, inner], k[inner, inner].T.ravel()])
    return grid(p, p), order[None]


# a member of a state as points, cells and arrays with VTK's names and components

logger = logging.getLogger(__name__)

#: Components of VTK's symmetric tensors and of vectors, in order.
COMPONENTS = {6: ("xx", "yy", "zz", "xy", "yz", "xz"), 3: ("x", "y", "z")}

#: Relative tolerance, of the largest value, of a field that is continuous between elements.
ROUND_OFF = 1e-9


class Body(NamedTuple):
    """One member: ``points`` (n, 3), ``cells`` (nc, k) and ``data`` (n,), (n, 3) or (n, 6)."""

    points: Array
    cells: Array
    data: dict[str, Array]


def body_of(grid: Grid, fields: Sequence[Field], undeformed: bool = False, lenient: bool = False,
            share: bool = True) -> Body:
    """The points, cells and arrays of a grid; undefined values are NaN."""
    # ``lenient``: so are fields that a material does not define, instead of an InputError.
    # ``share``: neighbouring elements share points where the displacement and all fields are
    # continuous.
    points, cells = grid.points(undeformed), grid.cells
    data = {field.name: _array(field, grid, lenient) for field in fields}
    a, b = grid.coincident
    if not share or not len(a):
        return Body(points, cells, data)
    one = np.ones(len(a), dtype=bool)
    for values in (grid.x.T, grid.u.T, *data.values()):
        values = values.reshape(len(points), -1)
        size = np.max(np.abs(values), initial=0.0, where=np.isfinite(values))
        one &= np.all(np.isclose(values[a], values[b], 0.0, ROUND_OFF * size, True), axis=1)
    number = np.arange(len(points))
    number[b[one]] = a[one]
    kept, new = np.unique(number, return_inverse=True)
    return Body(points[kept], new[cells], {name: x[kept] for name, x in data.items()})


def _array(field, grid, lenient):
    """A field with VTK's components; NaN if it is undefined."""
    n = grid.x.shape[1]
    if field.name == "displacement":
        return in_space(grid.u)
    nan = np.full((n, *{1: (), 2: (3,), 3: (6,)}[field.components]), np.nan)
    if grid.values is None:
        return nan
    try:
        value = field.of(grid.values)
    except InputError as error:
        if not lenient and not isinstance(grid.values, DomainValues):
            raise
        logger.info("%s is undefined: %s", field.name, error)
        return nan
    if field.components == 1:
        return value
    if field.components == 2:
        return in_space(value)
    # the out-of-plane component; NaN if the law does not define it
    values, normal, zero = grid.values, np.full(n, np.nan), np.zeros(n)
    with suppress(InputError):
        strain = values.elastic
        if field.name == "strain":
            normal = values.of_materials(lambda law: 0.5 * (law.thickness_stretch(strain)**2 - 1.0))
        elif field.name == "stress":
            normal = values.of_materials(lambda law: (
                law.nu * values.S[0] * (law.plane == "strain") if values.cable else
                law.stress_zz(strain)), not values.cable)
        elif field.name == "cauchy_stress":
            normal = values.sigma_zz
    return np.array([value[0], value[1], normal, value[2], zero, zero]).T


def facts_of(state: Any) -> dict[str, Array]:
    """Field data of a file: numbers of named members, load factor, time, version."""
    from .. import __version__

    members = getattr(getattr(state, "system", None), "members", state.beams)
    found = {member.name: np.array([k]) for k, member in enumerate(members)
             if member.name is not None}
    if getattr(state, "load", None) is not None:
        found["load_factor"] = np.array([state.load], dtype=float)
    if getattr(state, "t", None) is not None:
        found["TimeValue"] = np.array([state.t], dtype=float)  # VTK reads it as the time
    version = [int(number) for number in re.findall("[0-9]+", __version__)[:3]]
    return found | {"skfem_ancf_version": np.array(version)}
