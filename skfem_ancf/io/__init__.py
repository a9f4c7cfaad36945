"""Files for ParaView, one state as .vtu, a series of them as .pvd; fields as xarray data sets."""

import logging
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..actions.obstacles.contact import may_touch, touching
from ..actions.obstacles.shapes import around, outlines
from ..core import (InputError, StrPath, output_file, refuse, require_finite_scalar, require_flag,
                    require_like, require_module, require_option, require_path, require_text)
from ..recovery.fields import FIELDS, find_fields, unit_of, units_of
from ..recovery.grids import COMPONENTS, body_of, facts_of, grids, in_space

logger = logging.getLogger(__name__)

#: What a file may end with: formats that meshio writes as one file with data on points.
SUFFIXES = (".vtu", ".vtk")

#: Numbers of the fields in files.
PRECISIONS = {"double": np.float64, "single": np.float32}


class BodyFields(NamedTuple):
    """The body of a state: ``meshio.Mesh(*fields)``. ``points`` have the shape (n, 3). ``cells``
    has for each beam its cell type and its cells, as rows of point numbers; for each rigid body its
    outline; for each domain its triangles or quads. ``point_data`` has fields by name, (n,), (n, 3)
    for vectors, with a third component of zero, and (n, 6) for symmetric tensors (xx, yy, zz, xy,
    yz, xz). ``cell_data`` has the numbers ``beam`` and ``element``, one array for each beam,
    ``field_data`` global data."""

    points: np.ndarray
    cells: list
    point_data: dict
    cell_data: dict
    field_data: dict


def body_fields(state: Any, subdivide: tuple[int, int] = (8, 4), lagrange: bool = False,
                undeformed: bool = False, recover: bool = True, fields: Any = None,
                share: bool = True) -> BodyFields:
    """The body of a state on points, with the arguments of :func:`save_vtu`.

    Parameters
    ----------
    state, subdivide, lagrange, undeformed, recover, fields
        As for :func:`save_vtu`.
    share
        False for elements without common points, so that all states have equally many.

    Examples
    --------
    >>> import meshio, numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.io import body_fields
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> meshio.Mesh(*body_fields(Scene(beam).state())).points.shape  # 4 x 8 x 4 quads
    (165, 3)
    """
    wanted, undeformed = find_fields(fields, state.beams), require_flag("undeformed", undeformed)
    found = grids(state, subdivide, lagrange, recover)
    if all(grid.values is None for grid in found):
        wanted = [field for field in wanted if field.name == "displacement"]
    bodies = [body_of(grid, wanted, undeformed, fields is None, share) for grid in found]
    first = np.cumsum([0] + [len(body.points) for body in bodies])
    return BodyFields(
        np.concatenate([body.points for body in bodies]),
        [(grid.kind, start + body.cells) for start, grid, body in zip(first, found, bodies)],
        {field.name: np.concatenate([body.data[field.name] for body in bodies])
         for field in wanted},
        {"beam": [np.full(len(grid.cells), k) for k, grid in enumerate(found)],
         "element": [grid.elements for grid in found]}, facts_of(state))


def save_vtu(state: Any, filename: StrPath, subdivide: tuple[int, int] = (8, 4),
             lagrange: bool = False, undeformed: bool = False, recover: bool = True,
             fields: Any = None, precision: str = "double") -> Path:
    """Write the deformed body of a state for ParaView; returns the path.

    All beams go into one file, which replaces an older one once it is complete. Neighbouring
    elements share points where all fields of the file agree to round-off, as recovered fields do;
    where one jumps, the points are doubled.

    =============  ==========================================================================
    on points      meaning
    =============  ==========================================================================
    displacement   from the reference configuration, 3 components
    strain         Green-Lagrange strain in the beam's own frame: x along the axis, y across
                   the section of the undeformed beam; 6 components xx, yy, zz, xy, yz, xz
    stress         second Piola-Kirchhoff stress in the same frame
    cauchy_stress  along the global axes; NaN where the material has no thickness left
    von_mises      von Mises stress
    =============  ==========================================================================

    Undefined values, as the component zz in plane strain, are NaN. VTK's field data contain the
    load factor, the time, the version and the numbers of named members; ``UNITS_LABEL`` contains
    units (:meth:`Scene.units <skfem_ancf.Scene.units>`). ``beam`` and ``element``, on cells, are
    their numbers. A rigid body is the polygon of its outline, numbered after the beams, with NaN
    for strain and stress. A domain has its cells, halved, with strain and stress in global axes;
    the stress of user-defined forms is NaN. Outlines of obstacles are lines in a second file,
    ``name_obstacles``, with numbers ``obstacle``. Where members touch obstacles or each other,
    ``name_contact`` has the contact points with ``force``, ``pressure``, ``gap`` and ``sticking``.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`, or an object with ``beams`` and ``u_of``.
    filename
        Path that ends with .vtu (or .vtk). Missing folders are created.
    subdivide
        Number of straight quads along and across each element.
    lagrange
        Write each element as one VTK_LAGRANGE_QUADRILATERAL of the degree of the axis, or N if that
        is larger: the deformed geometry is exact up to degree 10, the limit of VTK, except for
        cables, whose sections follow the unit normal.
    undeformed
        Write reference positions; ParaView's filter "Warp By Vector" applies ``displacement``.
    recover
        Recovered strain and stress if available; False for those of the elements.
    fields
        Names of :data:`skfem_ancf.recovery.fields.FIELDS`, functions or Fields; those of the table
        by default, with ``plastic_strain``, ``yield_ratio``, ``dissipated`` and ``back_stress`` of
        materials that yield.
    precision
        "double", or "single" for files of half the size.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print(state.save(f"{folder}/beam.vtu").name)
    beam.vtu
    """
    path = require_path("filename", filename, SUFFIXES)
    return _save(state, path, subdivide, lagrange, undeformed, recover, fields, precision)[0]


def _save(state, path, subdivide, lagrange, undeformed, recover, fields, precision):
    """Write the file of :func:`save_vtu` and those beside it; returns all."""
    dtype = PRECISIONS[require_option("precision", precision, PRECISIONS)]
    body = body_fields(state, subdivide, lagrange, undeformed, recover, fields)
    scale = units_of(state)
    units = {field.name: unit_of(field, scale)
             for field in find_fields(fields, state.beams) if scale}
    _write(path, body, dtype, units)
    logger.info("wrote %s: %d points", path, len(body.points))
    written = [path]
    if walls := outlines(state, around(body.points[:, :2].T)):
        points = in_space(np.concatenate(walls).reshape(-1, 2).T)
        numbers = np.repeat(np.arange(len(walls)), [len(wall) for wall in walls])
        written.append(path.with_name(f"{path.stem}_obstacles{path.suffix}"))
        _write(written[-1], BodyFields(
            points, [("line", np.arange(len(points)).reshape(-1, 2))], {},
            {"obstacle": [numbers]}, {}), dtype)
    if (found := None if undeformed else touching(state)) is not None:
        written.append(path.with_name(f"{path.stem}_contact{path.suffix}"))
        _write(written[-1], BodyFields(
            in_space(found.points), [("vertex", np.arange(len(found))[:, None])],
            found.arrays, {}, {}), dtype, {} if not scale else {
                "force": scale[0], "gap": scale[1],
                "pressure": unit_of(FIELDS["von_mises"], scale)})
    elif may_touch(state):  # of an older file
        path.with_name(f"{path.stem}_contact{path.suffix}").unlink(missing_ok=True)
    return written


def _write(path, body, dtype, units=()):
    import meshio

    from xml.sax.saxutils import escape, quoteattr  # which imports http and ssl

    with output_file(path) as temporary:
        meshio.write(temporary, meshio.Mesh(
            body.points.astype(dtype), body.cells,
            {name: values.astype(dtype) for name, values in body.point_data.items()},
            body.cell_data))
        if path.suffix.lower() != ".vtu":
            return
        # field data, names of components and units, which meshio does not write
        facts = "".join(
            f'<DataArray type="{"Int64" if x.dtype.kind == "i" else "Float64"}" '
            f'Name={quoteattr(name)} NumberOfTuples="{len(x)}" format="ascii">'
            f'{" ".join(map(repr, x.tolist()))}</DataArray>\n'
            for name, x in body.field_data.items())
        text, start = temporary.read_bytes(), b"<UnstructuredGrid>\n"
        text = text.replace(start, start + f"<FieldData>\n{facts}</FieldData>\n".encode(), 1)
        for name, values in body.point_data.items():
            at = text.find(f"Name={quoteattr(name)}".encode(), text.find(b"<PointData>"))
            end = text.find(b"</DataArray>", at)
            if at < 0 or end < 0:
                continue
            unit = dict(units).get(name, "")
            label = "" if unit in ("", "1") else (
                '<InformationKey name="UNITS_LABEL" location="vtkDataArray">'
                f"{escape(unit)}</InformationKey>\n")
            parts = "".join(f'ComponentName{k}="{c}" ' for k, c in enumerate(
                COMPONENTS.get(values.size // len(values), ())))
            text = b"".join([text[:at], parts.encode(), text[at:end], label.encode(), text[end:]])
        temporary.write_bytes(text)


# time series of states for ParaView

class PvdWriter:
    """Writes one .vtu file for each frame, and a .pvd file that lists them with their times.

    Both are complete after every :meth:`add`, so that ParaView can follow a run. Frames are called
    ``stem_00000.vtu`` and so on, in the folder of the .pvd; outlines of obstacles and contact
    points are further parts.

    Parameters
    ----------
    filename
        Path that ends with .pvd. Missing folders are created; the first frame replaces an older
        file.
    state, t
        A State, or an object with ``beams`` and ``u_of``, and its time.
    subdivide, lagrange, undeformed, recover, fields, precision
        As for :func:`~skfem_ancf.io.save_vtu`.

    Examples
    --------
    >>> import tempfile
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.io import PvdWriter
    >>> beam = Beam(MeshBeam.init_line([0, 1], height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> with tempfile.TemporaryDirectory() as folder, PvdWriter(f"{folder}/load.pvd") as series:
    ...     print(series.add(Scene(beam).state(), t=0.0).name)
    load_00000.vtu
    """

    def __init__(self, filename: StrPath, subdivide: tuple[int, int] = (8, 4),
                 lagrange: bool = False, undeformed: bool = False, recover: bool = True,
                 fields: Any = None, precision: str = "double") -> None:
        self.path = require_path("filename", filename, (".pvd",))
        require_text("filename", self.path.name)  # names of frames are written in Unicode
        self.options: dict[str, Any] = dict(
            subdivide=subdivide, lagrange=lagrange, undeformed=undeformed, recover=recover,
            fields=fields, precision=precision)
        find_fields(fields)
        self.frames: list[tuple[float, list[str]]] = []  # time, names of files

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        if self.frames:
            logger.info("wrote %s: %d frames", self.path, len(self.frames))

    def add(self, state: Any, t: float) -> Path:
        """Write a state at a time later than that of the previous frame; returns its file."""
        from xml.sax.saxutils import quoteattr  # which imports http and ssl

        require_like("state", state, "State", "beams", "u_of")
        t = require_finite_scalar("t", t)
        if self.frames and t <= self.frames[-1][0]:
            raise InputError(f"the times of the frames must increase: {t!r} after "
                             f"{self.frames[-1][0]!r}")
        name = f"{self.path.stem}_{len(self.frames):05d}.vtu"
        frame, *others = _save(state, self.path.with_name(name), **self.options)
        self.frames.append((t, [name, *(other.name for other in others)]))
        rows = [f'<DataSet timestep="{t!r}" part="{k}" file={quoteattr(name)}/>'
                for t, names in self.frames for k, name in enumerate(names)]
        with output_file(self.path) as temporary:
            temporary.write_text("\n".join(
                ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">',
                 "<Collection>", *rows, "</Collection>", "</VTKFile>", ""]), encoding="utf-8")
        return frame


#: The dimension and the labels of the components of vectors and tensors, and their columns in
#: arrays of VTK.
PARTS = {1: ("", (), (0,)), 2: ("component", ("x", "y"), (0, 1)),
         3: ("tensor", ("xx", "yy", "xy"), (0, 1, 3))}
#: Of a History, arrays (nt,).
ENERGIES = "strain_energy", "kinetic_energy", "potential_energy", "total_energy", "dissipated"


def to_xarray(solution: Any, fields: Any = None, at: Any = None, beam: Any = None,
              line: int | None = None, subdivide: tuple[int, int] = (8, 4),
              recover: bool = True) -> Any:
    """Fields as an ``xarray.Dataset``, with the names of files, and units if they are known.

    Its dimensions are "point", "component" (x, y) of vectors, "tensor" (xx, yy, xy), and for a
    History first "time". Coordinates "x" and "y" are reference positions; points all over the body
    have the coordinate "member", the name of their beam. Raises MissingExtra if xarray is not
    installed.

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
        As for :func:`skfem_ancf.io.save_vtu`.

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
    refuse(not states, "the history has no instants")
    if at is None:
        refuse(line is not None, "line={!r} is for points: give at=, too", line)
        tables = [_of_body(state, wanted, subdivide, recover, fields is None, beam)
                  for state in states]
    else:
        found = states[0].system.points.find(at, beam, line, ask=True)
        x = found.start.reshape(2, -1)
        place = {"x": ("point", x[0]), "y": ("point", x[1])}
        tables = [(place, {field.name: np.reshape(state.field(field, found, recover=recover),
                                                  (field.components, -1)).T for field in wanted})
                  for state in states]
    units, arrays, parts = units_of(states[0]), {}, {}
    for field in wanted:
        values = np.array([table[field.name] for _, table in tables])
        name, labels, _ = PARTS[field.components]
        dims: tuple[str, ...] = ("point", name)
        if name:
            parts[name] = list(labels)
        else:
            dims, values = dims[:1], values[..., 0]
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
    found = grids(state, subdivide, False, recover)
    if beam is not None:
        found = [found[state.system.members.index(state._member(beam))]]
    bodies = [body_of(grid, wanted, True, lenient, share=False) for grid in found]
    x = np.concatenate([body.points for body in bodies]).T
    names = np.repeat([grid.name for grid in found], [len(body.points) for body in bodies])
    table = {field.name: np.concatenate([body.data[field.name] for body in bodies]).reshape(
        len(names), -1)[:, PARTS[field.components][2]] for field in wanted}
    return {"x": ("point", x[0]), "y": ("point", x[1]), "member": ("point", names)}, table


__all__ = ["PvdWriter", "body_fields", "save_vtu"]
