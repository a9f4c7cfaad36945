"""The deformed body with its strains and stresses, as points and cells, and as a .vtu file."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import meshio
import numpy as np

from ..actions.obstacles.outlines import around, outlines
from ..core.archive import output_file
from ..core.errors import (InputError, require_finite_scalar, require_flag, require_like,
                           require_option, require_path, warn)
from ..core.types import Array, StrPath
from ..recovery.fields import DomainValues, find_fields
from ..recovery.grids import grids, in_space

logger = logging.getLogger(__name__)

#: What a file may end with: formats that meshio writes as one file with data on points.
SUFFIXES = (".vtu", ".vtk")

#: Numbers of the fields in files.
PRECISIONS = {"double": np.float64, "single": np.float32}


class BodyFields(NamedTuple):
    """The body of a state on points: the arguments of a ``meshio.Mesh``.

    ``points`` have the shape (n, 3); elements do not share points. ``cells`` has for each beam its
    cell type and its cells, as rows of point numbers; of each rigid body its outline; of each
    domain its triangles or quads.
    ``point_data`` has fields by name, (n,) or (n, 3): vectors with a third component of zero,
    tensors as (xx, yy, xy). ``cell_data`` has the numbers ``beam`` and ``element``, one array for
    each beam.
    """

    points: np.ndarray
    cells: list
    point_data: dict
    cell_data: dict


def body_fields(state: Any, subdivide: tuple[int, int] = (8, 4), lagrange: bool = False,
                undeformed: bool = False, recover: bool = True, fields: Any = None) -> BodyFields:
    """The body of a state on points, with the arguments of :func:`save_vtu`.

    Parameters
    ----------
    state, subdivide, lagrange, undeformed, recover, fields
        As for :func:`save_vtu`.

    Examples
    --------
    >>> import meshio, numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.io import body_fields
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> meshio.Mesh(*body_fields(Scene(beam).state())).points.shape  # 4 elements, 9 x 5 points
    (180, 3)
    """
    found, wanted = grids(state, subdivide, lagrange, recover), find_fields(fields)
    undeformed = require_flag("undeformed", undeformed)
    first = np.cumsum([0] + [g.x.shape[1] for g in found])
    data = {field.name: np.concatenate([_values(field, g, fields is None) for g in found])
            for field in wanted
            if field.name == "displacement" or any(g.values is not None for g in found)}
    return BodyFields(
        np.concatenate([g.points(undeformed) for g in found]),
        [(g.kind, start + g.cells) for start, g in zip(first, found)], data,
        {"beam": [np.full(len(g.cells), k) for k, g in enumerate(found)],
         "element": [g.elements for g in found]})


def _values(field, grid, lenient):
    """A field as meshio takes it; not a number where there is none, or where a law has none."""
    n = grid.x.shape[1]
    if field.name == "displacement":
        return in_space(grid.u)
    nan = np.full((n,) if field.components == 1 else (n, 3), np.nan)
    if grid.values is None:
        return nan
    try:
        value = field.of(grid.values)
    except InputError as error:
        if not lenient and not isinstance(grid.values, DomainValues):
            raise
        logger.info("%s is not a number: %s", field.name, error)
        return nan
    return in_space(value) if field.components == 2 else value.T


def save_vtu(state: Any, filename: StrPath, subdivide: tuple[int, int] = (8, 4),
             lagrange: bool = False, undeformed: bool = False, recover: bool = True,
             fields: Any = None, precision: str = "double", encoding: Any = None) -> Path:
    """Write the deformed body of a state for ParaView.

    All beams go into one file, which replaces an older one only once it is complete. Points belong
    to one element each, since strains and stresses may jump between elements.

    =============================  ==========================================================
    on points                      meaning
    =============================  ==========================================================
    displacement                   from the reference configuration, 3 components
    eps_xx, eps_yy, eps_xy         Green-Lagrange strain in the beam's own frame: x along the
                                   axis, y across the section of the undeformed beam
    S_xx, S_yy, S_xy               second Piola-Kirchhoff stress in the same frame
    sigma_xx, sigma_yy, sigma_xy   Cauchy stress along the global axes; NaN where the material
                                   has no thickness left, or a law does not say it
    =============================  ==========================================================

    ``beam`` and ``element``, on cells, are the numbers of both. A rigid body is the polygon of its
    outline, numbered behind the beams, without strain and stress (NaN). A domain has its
    own cells, halved, and its strain in global axes. The outlines of obstacles
    go into a file of lines beside it, ``name_obstacles``, with their numbers in ``obstacle``.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`, or anything with its ``beams`` and ``u_of``.
    filename
        Path that ends with .vtu (or .vtk). Missing folders are made.
    subdivide
        Number of straight quads along and across each element.
    lagrange
        Write each element as one VTK_LAGRANGE_QUADRILATERAL of the degree of the axis, or N if that
        is larger: the deformed geometry is exact up to degree 10, the largest that VTK evaluates,
        but for cables, whose sections follow the unit normal.
    undeformed
        Put the points at their undeformed places. ParaView's filter "Warp By Vector" then moves
        them by any multiple of ``displacement``.
    recover
        Recovered strain and stress where the state has them; False for those of the elements.
    fields
        Names of :data:`skfem_ancf.recovery.fields.FIELDS`, functions or Fields; those of the table
        by default.
    precision
        "double", or "single" for files of half the size.
    encoding
        Deprecated: files are compressed base64, as meshio writes them.

    Returns
    -------
    pathlib.Path
        The file.

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
    dtype = PRECISIONS[require_option("precision", precision, PRECISIONS)]
    if encoding is not None:
        warn("encoding= is no longer used: leave it out", DeprecationWarning)
    body = body_fields(state, subdivide, lagrange, undeformed, recover, fields)
    _write(path, body, dtype)
    logger.info("wrote %s: %d points", path, len(body.points))
    save_obstacles(outlines(state, around(body.points[:, :2].T)), path, dtype)
    return path


def save_obstacles(walls: list[Array], path: Path, dtype: Any = np.float64) -> None:
    """Write the outlines of obstacles, (m, 2, 2) each, into a file beside that of the body."""
    if not walls:
        return
    points = in_space(np.concatenate(walls).reshape(-1, 2).T)
    numbers = np.repeat(np.arange(len(walls)), [len(wall) for wall in walls])
    suffix = path.suffix if path.suffix.lower() in SUFFIXES else ".vtu"
    _write(path.with_name(f"{path.stem}_obstacles{suffix}"), BodyFields(
        points, [("line", np.arange(len(points)).reshape(-1, 2))], {}, {"obstacle": [numbers]}),
        dtype)


def _write(path, body, dtype):
    with output_file(path) as temporary:
        meshio.write(temporary, meshio.Mesh(
            body.points.astype(dtype), body.cells,
            {name: values.astype(dtype) for name, values in body.point_data.items()},
            body.cell_data))


class SeriesWriter:
    """What writers of a series share, besides ``add(state, t)`` for a frame."""

    def __enter__(self) -> Any:
        return self

    def extend(self, states: Iterable[Any], done: Callable[[], Any] = lambda: None) -> None:
        """Write the frames of a motion.

        Parameters
        ----------
        states
            Each a State with a time ``t``.
        done
            Called after each of them.
        """
        for state in states:
            self.add(state, state.t)  # type: ignore[attr-defined]
            done()


def require_next(state: Any, t: Any, before: float | None) -> float:
    """The time of the next frame of a series after that of the one before, which may be None."""
    require_like("state", state, "State", "beams", "u_of")
    t = require_finite_scalar("t", t)
    if before is not None and t <= before:
        raise InputError(f"the times of the frames must increase: {t!r} after {before!r}")
    return t
