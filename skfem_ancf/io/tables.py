"""Fields as xarray data sets."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from ..beam.layout import select_member
from ..core import InputError, require_module, shown
from ..recovery.fields import find_fields, unit_of, units_of
from ..recovery.grids import body_of, grids

#: The dimension and the labels of the components of vectors and tensors, and their columns in
#: arrays of VTK.
PARTS = {2: ("component", ("x", "y"), (0, 1)), 3: ("tensor", ("xx", "yy", "xy"), (0, 1, 3))}
#: Of a History, arrays (nt,).
ENERGIES = "strain_energy", "kinetic_energy", "potential_energy", "total_energy", "dissipated"


def to_xarray(solution: Any, fields: Any = None, at: Any = None, beam: Any = None,
              line: int | None = None, subdivide: tuple[int, int] = (8, 4),
              recover: bool = True) -> Any:
    """Fields as an ``xarray.Dataset``, with the names of files, and units if they are known.

    Its dimensions are "point", "component" (x, y) of vectors, "tensor" (xx, yy, xy), and for a
    History first "time". Coordinates "x" and "y" are reference positions; points all over the body
    have the coordinate "member", the name of their beam.

    Parameters
    ----------
    solution
        A State, or a :class:`~skfem_ancf.History` with all its instants.
    fields
        Names of :data:`skfem_ancf.recovery.fields.FIELDS`, functions or Fields; those of files by
        default.
    at, beam, line
        Points of the body as for :meth:`State.displacement <skfem_ancf.State.displacement>`, shape
        (2,) or (2, n); by default points all over it, or over ``beam`` alone, as many as
        ``subdivide`` says.
    subdivide, recover
        As for :func:`skfem_ancf.io.vtu.save_vtu`.

    Raises
    ------
    MissingExtra
        If xarray is not installed.

    Examples
    --------
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
    >>> state = Scene(Beam(MeshBeam.init_line([0, 1], height=0.1), ElementBeamCable(5),
    ...                    StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)).state()
    >>> data = state.to_xarray(["displacement", "S_xx"], at=[(0.5, 0), (1, 0)])
    >>> data.displacement.sel(component="y").values
    array([0., 0.])
    """
    xarray, wanted = require_module("xarray", "arrays"), find_fields(fields)
    motion = hasattr(solution, "states")
    states = list(solution) if motion else [solution]
    if not states:
        raise InputError("the history has no instants")
    if at is None:
        if line is not None:
            raise InputError(f"line={shown(line)} is for points: give at=, too")
        tables = [_of_body(state, wanted, subdivide, recover, fields is None, beam)
                  for state in states]
    else:
        found = states[0].system.points.find(at, beam, line, ask=True)
        x = found.start.reshape(2, -1)
        place = {"x": ("point", x[0]), "y": ("point", x[1])}
        tables = []
        for state in states:
            table = {}
            for field in wanted:
                values = np.reshape(state.field(field, found, recover=recover),
                                    (field.components, -1)).T
                table[field.name] = values[:, 0] if field.components == 1 else values
            tables.append((place, table))
    units, arrays, parts = units_of(states[0]), {}, {}
    for field in wanted:
        values = np.array([table[field.name] for _, table in tables])
        dims: tuple[str, ...] = ("point",)
        if field.components > 1:
            name, labels, _ = PARTS[field.components]
            dims, parts[name] = ("point", name), list(labels)
        about = {"long_name": re.sub(r"\s*\$[^$]*\$", "", field.title) or field.name}
        if unit := "1" if field.unit == "1" else units and unit_of(field, units):
            about["units"] = unit
        arrays[field.name] = (("time", *dims), values, about) if motion else (
            dims, values[0], about)
    places, length = tables[0][0], {} if units is None else {"units": units[1]}
    coords = {name: (*entry, length if name in "xy" else {}) for name, entry in places.items()}
    if motion:
        joule = {} if units is None else {"units": " ".join(units)}
        arrays |= {name: (("time",), getattr(solution, name), joule) for name in ENERGIES}
    facts = {} if motion else {"load_factor": states[0].load}
    return xarray.Dataset(arrays, coords | parts | ({"time": solution.t} if motion else {}), facts)


def _of_body(state, wanted, subdivide, recover, lenient, beam):
    """Coordinates of points all over the body, or over one beam, and fields by name."""
    found, members = grids(state, subdivide, False, recover), state.system.members
    if beam is not None:
        one = select_member(state.beams, members[len(state.beams):], beam)
        found = [grid for grid, member in zip(found, members) if member is one]
    bodies = [body_of(grid, wanted, True, lenient, share=False) for grid in found]
    x = np.concatenate([body.points for body in bodies]).T
    names = np.repeat([grid.name for grid in found], [len(body.points) for body in bodies])
    table = {}
    for field in wanted:
        values = np.concatenate([body.data[field.name] for body in bodies])
        table[field.name] = values if field.components == 1 else (
            values[:, PARTS[field.components][2]])
    return {"x": ("point", x[0]), "y": ("point", x[1]), "member": ("point", names)}, table
