"""The deformed body with its strains and stresses, as points and cells, and as a .vtu file."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.archive import output_file
from ..core.errors import (InputError, require_finite_scalar, require_flag, require_like,
                           require_option, require_path)
from ..recovery.fields import find_fields, values_on_grid
from ..actions.obstacles.pictures import around, outlines
from ..recovery.grids import in_space, lagrange_cell, layout, subdivision
from .xml import write_vtu

if TYPE_CHECKING:
    from ..core.types import Array, StrPath

logger = logging.getLogger(__name__)

#: What a file may end with: formats that meshio writes as one file with data on points.
SUFFIXES = (".vtu", ".vtk")

ENCODINGS = ("base64", "raw")

#: Numbers of the fields in files.
PRECISIONS = {"double": np.float64, "single": np.float32}

#: Points of a whole body, at most.
MAX_POINTS = 10**8

class BodyFields(NamedTuple):
    """The body of a state on points, in the form that meshio takes.

    Attributes
    ----------
    points
        Positions, shape (n, 3); elements do not share points.
    cells
        For each beam its cell type and its cells, as rows of point numbers; for each rigid body its
        outline.
    point_data
        Fields by name, shape (n,) or (n, 3): vectors have a third component of zero, tensors
        are (xx, yy, xy).
    cell_data
        ``beam`` and ``element``: the numbers of both, one array for each beam.
    """

    points: np.ndarray
    cells: list
    point_data: dict
    cell_data: dict


def body_fields(state: Any, subdivide: tuple[int, int] = (8, 4), lagrange: bool = False,
                undeformed: bool = False, recover: bool = True, fields: Any = None) -> BodyFields:
    """The body of a state on points.

    Parameters
    ----------
    state, subdivide, lagrange, undeformed, recover, fields
        As for :func:`save_vtu`.

    Returns
    -------
    BodyFields

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.io import body_fields
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    >>> body = body_fields(state, subdivide=(8, 4))
    >>> body.points.shape, body.cells[0][0], body.cells[0][1].shape  # 4 elements, 9 x 5 points
    ((180, 3), 'quad', (128, 4))
    >>> sorted(body.point_data)[:4]
    ['S_xx', 'S_xy', 'S_yy', 'displacement']
    """
    require_like("state", state, "State", "beams", "u_of")
    m, n = subdivision(subdivide)
    lagrange = require_flag("lagrange", lagrange)
    undeformed = require_flag("undeformed", undeformed)
    recover = require_flag("recover", recover)
    wanted = find_fields(fields)
    total = sum(b.mesh.nelements for b in state.beams) * (m + 1) * (n + 1)
    if total > MAX_POINTS and not lagrange:
        raise InputError(f"subdivide={(m, n)} makes {total} points, more than {MAX_POINTS}")
    first, points, cells = 0, [], []
    data: dict[str, list[Array]] = {}
    if not state.beams:  # what rigid bodies have
        data = {field.name: [] for field in wanted if field.name == "displacement"}
    numbers: dict[str, list[Array]] = {"beam": [], "element": []}
    for b, beam in enumerate(state.beams):
        if lagrange:
            X, local = lagrange_cell(beam)
        else:
            X, local = layout(beam, m, n)
        values = values_on_grid(state, beam, X, recover)
        x = values.x if undeformed else values.x + values.u
        points.append(in_space(x))
        for field in wanted:
            value = _known(field, values, fields is None)
            data.setdefault(field.name, []).append(
                value if field.components == 1 else in_space(value) if field.components == 2 else
                value.T)
        ne, npoints = beam.mesh.nelements, X.shape[-1]
        start = first + npoints * np.arange(ne)
        cells.append(("VTK_LAGRANGE_QUADRILATERAL" if lagrange else "quad",
                      (start[:, None, None] + local).reshape(-1, local.shape[1])))
        numbers["beam"].append(np.full(ne * len(local), b))
        numbers["element"].append(np.repeat(np.arange(ne), len(local)))
        first += ne * npoints
    for k, body in enumerate(getattr(state, "bodies", ())):
        start = body.outline_at(np.zeros(4))
        u = body.outline_at(state.u_of(body)) - start
        n = u.shape[1]
        points.append(in_space(start if undeformed else start + u))
        for name, parts in data.items():
            parts.append(in_space(u) if name == "displacement" else
                         np.full((n, *parts[0].shape[1:]), np.nan))
        cells.append(("polygon", first + np.arange(n)[None]))
        numbers["beam"].append(np.array([len(state.beams) + k]))
        numbers["element"].append(np.zeros(1, dtype=int))
        first += n
    return BodyFields(np.concatenate(points), cells,
                      {name: np.concatenate(v) for name, v in data.items()}, numbers)


def _known(field, values, lenient):
    """A field; not a number where a law does not say it, unless it was asked for."""
    try:
        return field.of(values)
    except InputError as error:
        if not lenient:
            raise
        logger.info("%s is not a number: %s", field.name, error)
        return np.full(values.n if field.components == 1 else (field.components, values.n), np.nan)


def save_vtu(state: Any, filename: StrPath, subdivide: tuple[int, int] = (8, 4),
             lagrange: bool = False, undeformed: bool = False, recover: bool = True,
             fields: Any = None, precision: str = "double",
             encoding: str = "base64") -> Path:
    """Write the deformed body of a state for ParaView.

    All beams go into one file. Points belong to one element each, since strains and stresses
    may jump between elements. The file replaces an older one of the same name only once it is
    complete.

    =============================  ==========================================================
    on points                      meaning
    =============================  ==========================================================
    displacement                   from the stress-free state, 3 components, the last zero
    eps_xx, eps_yy, eps_xy         Green-Lagrange strain in the beam's own frame: x along the
                                   axis, y across the section of the stress-free beam
    S_xx, S_yy, S_xy               second Piola-Kirchhoff stress in the same frame
    sigma_xx, sigma_yy, sigma_xy   Cauchy stress F S F^T / J along the global axes; J holds the
                                   change of thickness in plane stress. NaN where the material
                                   has no thickness left, or a law of one's own does not say it.
    =============================  ==========================================================

    The outlines of obstacles about the body go into a file of lines beside it, ``name_obstacles``,
    with their numbers in ``obstacle``.

    ``beam`` and ``element``, on cells, are the numbers of both. A rigid body is the polygon of its
    outline, numbered behind the beams, without strain and stress (NaN).

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`, or anything with its ``beams`` and ``u_of``.
    filename
        Path that ends with .vtu (or .vtk). Missing folders are made.
    subdivide
        Number of straight quads along and across each element.
    lagrange
        Write each element as one VTK_LAGRANGE_QUADRILATERAL in place of straight quads. Its
        degree is that of the axis, or N if that is larger, so the deformed geometry is exact up
        to degree 10; beyond it, and for cables, whose sections follow the unit normal, it is
        interpolated.
    undeformed
        Put the points at their stress-free places. ParaView's filter "Warp By Vector" then moves
        them by any multiple of ``displacement``.
    recover
        Recovered strain and stress (:mod:`skfem_ancf.recovery`) where the state has them; False for
        those of the elements at the points.

    fields
        Names of :data:`skfem_ancf.recovery.fields.FIELDS`, functions or Fields, see
        :mod:`skfem_ancf.recovery.fields`; those of the table by default.
    precision
        "double", or "single" for files of half the size.
    encoding
        "base64", or "raw", a quarter smaller: VTK and ParaView read it, meshio 5.3 reads wrong
        numbers from it.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        If the file name ends otherwise, ``subdivide`` is not two positive integers, or a Lagrange
        cell would exceed degree 10, the largest that VTK evaluates.

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
    return save_frame(state, filename, {}, precision, encoding, subdivide=subdivide,
                      lagrange=lagrange, undeformed=undeformed, recover=recover, fields=fields)


def save_frame(state: Any, filename: StrPath, packed: dict, precision: str = "double",
               encoding: str = "base64", **options: Any) -> Path:
    """As :func:`save_vtu`, for the next frame of a series.

    Parameters
    ----------
    state, filename, precision, encoding
        As for :func:`save_vtu`.
    packed
        What does not change from frame to frame, see :func:`skfem_ancf.io.xml.write_vtu`.
    **options
        Those of :func:`body_fields`.
    """
    path = require_path("filename", filename, SUFFIXES)
    dtype = PRECISIONS[require_option("precision", precision, PRECISIONS)]
    raw = require_option("encoding", encoding, ENCODINGS) == "raw"
    body = body_fields(state, **options)
    _write(path, body, dtype, raw, packed)
    logger.info("wrote %s: %d points", path, len(body.points))
    save_obstacles(state, path, body, dtype, raw)
    return path


def save_obstacles(state: Any, path: Path, body: BodyFields, dtype: Any = np.float64,
                   raw: bool = False) -> Path | None:
    """Write the outlines of obstacles about a body into a file beside its own.

    Parameters
    ----------
    state
        A State, or anything with its ``beams``.
    path
        The file of the body.
    body
        Its :class:`BodyFields`.
    dtype, raw
        As for :func:`skfem_ancf.io.xml.write_vtu`.

    Returns
    -------
    pathlib.Path or None
        The file; None without obstacles.
    """
    walls = outlines(state, around(body.points[:, :2].T))
    if not walls:
        return None
    points = in_space(np.concatenate(walls).reshape(-1, 2).T)
    numbers = np.repeat(np.arange(len(walls)), [len(wall) for wall in walls])
    lines = BodyFields(points, [("line", np.arange(len(points)).reshape(-1, 2))], {},
                       {"obstacle": [numbers]})
    suffix = path.suffix if path.suffix.lower() in SUFFIXES else ".vtu"
    beside = path.with_name(f"{path.stem}_obstacles{suffix}")
    _write(beside, lines, dtype, raw)
    return beside


def _write(path, body, dtype, raw, packed=None):
    with output_file(path) as temporary:
        if path.suffix.lower() == ".vtu":
            write_vtu(temporary, body, dtype, raw, packed)
            return
        import meshio

        meshio.write(temporary, meshio.Mesh(body.points, body.cells, body.point_data,
                                            body.cell_data))


def require_next(state: Any, t: Any, before: float | None) -> float:
    """The time of the next frame of a series, or raise :class:`InputError`.

    Parameters
    ----------
    state
        The frame.
    t
        Its time.
    before
        That of the frame before, or None.
    """
    require_like("state", state, "State", "beams", "u_of")
    t = require_finite_scalar("t", t)
    if before is not None and t <= before:
        raise InputError(f"the times of the frames must increase: {t!r} after {before!r}")
    return t
