"""A member of a state as points, cells and arrays with VTK's names and components."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.types import Array
from .fields import DomainValues, Field
from .grids import Grid, in_space

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
    """The points, cells and arrays of a grid.

    Parameters
    ----------
    grid, fields
        The member and its fields; undefined values are NaN.
    undeformed
        Points in the reference configuration.
    lenient
        Fields that a material does not define are NaN; by default they raise InputError.
    share
        Merge the coincident points of neighbouring elements where the displacement and all fields
        are continuous; otherwise each element has its own points.
    """
    points, cells = grid.points(undeformed), grid.cells
    data = {field.name: _array(field, grid, lenient) for field in fields}
    a, b = grid.between
    if not share or not len(a):
        return Body(points, cells, data)
    one = np.ones(len(a), dtype=bool)
    for values in (grid.x.T, grid.u.T, *data.values()):
        values = values.reshape(len(points), -1)
        size = np.max(np.abs(values), initial=0.0, where=np.isfinite(values))
        one &= np.all(np.isclose(values[a], values[b], 0.0, ROUND_OFF * size, True), axis=1)
    number, unique = np.arange(len(points)), np.ones(len(points), dtype=bool)
    number[b[one]], unique[b[one]] = a[one], False
    new = np.cumsum(unique) - 1
    return Body(points[unique], new[number[cells]], {name: x[unique] for name, x in data.items()})


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
    zero = np.zeros(n)
    return np.array([value[0], value[1], _normal(field, grid.values), value[2], zero, zero]).T


def _normal(field, values):
    """The out-of-plane component of a tensor, (n,); NaN if the law does not define it."""
    try:
        strain, cable = values.elastic, not values.beam.has_sections
        if field.name == "strain":
            return values.of_materials(lambda law: 0.5 * (law.thickness_stretch(strain)**2 - 1.0))
        if field.name == "stress":
            return values.of_materials(lambda law: (
                law.nu * values.S[0] * (law.plane == "strain") if cable else
                law.stress_zz(strain)), not cable)
        if field.name == "cauchy_stress":
            return values.sigma_zz
    except InputError:
        pass
    return np.full(values.n, np.nan)


def facts_of(state: Any) -> dict[str, Array]:
    """Field data of a file: numbers of named members, load factor, time, version.

    VTK reads ``TimeValue`` as the time of the file.
    """
    from .. import __version__

    members = getattr(getattr(state, "system", None), "members", state.beams)
    found = {member.name: np.array([k]) for k, member in enumerate(members)
             if member.name is not None}
    if getattr(state, "load", None) is not None:
        found["load_factor"] = np.array([state.load], dtype=float)
    if getattr(state, "t", None) is not None:
        found["TimeValue"] = np.array([state.t], dtype=float)
    version = [int(number) for number in re.findall("[0-9]+", __version__)[:3]]
    return found | {"skfem_ancf_version": np.array(version)}
