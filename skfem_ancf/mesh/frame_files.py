"""Frames from meshio meshes and DXF drawings: each line cell is a line."""

import logging
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..core import (FileError, MeshError, lagrange, refuse, refuse_any, require_finite,
                    require_kind, require_module, require_names, require_option, require_path,
                    retold)
from .frame_graph import FrameGraph


# read lines of a DXF drawing as a meshio mesh

logger = logging.getLogger(__name__)

#: Units of length in which drawings can be read.
UNITS = "m", "mm", "cm", "dm", "km", "in", "ft", "yd"


def mesh_of_dxf(path: Path, unit: str | None = None) -> Any:
    """Lines and points of a drawing as a meshio mesh, with a cell set for each layer."""
    import meshio

    ezdxf, units = require_module("ezdxf", "dxf"), require_module("ezdxf.units", "dxf")
    with retold((OSError, ezdxf.DXFError), "{} cannot be read as a drawing: {error}", path,
                error=FileError):
        drawing = ezdxf.readfile(path)
        entities = list(drawing.modelspace())
    places: list[Any] = []  # two of each line, then one of each point
    lines, points = list[str](), list[tuple[str, Any]]()
    for entity in entities:
        whole = entity.dxftype() in ("LWPOLYLINE", "POLYLINE")
        for part in entity.virtual_entities() if whole else [entity]:
            kind = part.dxftype()
            if kind == "LINE":
                places += [part.dxf.start.xyz, part.dxf.end.xyz]
                lines.append(entity.dxf.layer)
            elif kind == "POINT":
                points.append((entity.dxf.layer, part.dxf.location.xyz))
            refuse(kind in ("ARC", "CIRCLE", "ELLIPSE", "SPLINE", "INSERT"), "{} has {} in the "
                   "layer {!r}: explode blocks, draw curves as polylines", path, kind,
                   entity.dxf.layer, error=MeshError)
    refuse(not lines, "{} has no lines and no polylines", path, error=MeshError)
    at, number = np.unique(places + [x for _, x in points], axis=0, return_inverse=True)
    stated = units.decode(drawing.units) if drawing.units else None  # $INSUNITS
    if unit is None:
        logger.info("%s is taken as drawn, %s; unit='m' converts its coordinates to metres", path,
                    f"in {stated}" if stated else "in a unit that it does not state")
    else:
        target = getattr(units, require_option("unit of length", unit, UNITS).upper())
        refuse(stated is None, "{} does not state its unit ($INSUNITS is {}): leave out unit={!r}",
               path, drawing.units, unit)
        at = at * units.conversion_factor(drawing.units, target)
    ends, alone = np.split(number.ravel(), [2 * len(lines)])
    layers, of = np.array(lines), np.array([name for name, _ in points])
    return meshio.Mesh(at, [("line", ends.reshape(-1, 2)), ("vertex", alone[:, None])], cell_sets={
        name: [np.flatnonzero(layers == name), np.flatnonzero(of == name)]
        for name in dict.fromkeys([*lines, *of.tolist()])})


#: Line cells of meshio: the ends first, then interior points in order.
LINE = re.compile("line([0-9]*)")


def graph_from_meshio(mesh: Any, groups: Any = None, named: Sequence[str] = (),
                    tol: float | None = None, unit: str | None = None) -> FrameGraph:
    """The graph of the line cells of a ``meshio.Mesh``, or of a file of meshio or DXF: see
    :meth:`skfem_ancf.Frame.from_meshio`. ``named`` are sets to which other arguments refer."""
    mesh = _mesh_of(mesh, unit)
    refuse(not isinstance(groups, (str, list, tuple, set, frozenset, type(None))), "groups are "
           "names of sets of lines, got {!r}", groups)
    points = require_finite("the points of the mesh", mesh.points)
    kinds = {block.type for block in mesh.cells}
    odd = sorted(kind for kind in kinds if kind != "vertex" and not LINE.fullmatch(kind))
    refuse(odd, "the mesh has cells of the kinds {}: a frame is made of 'line', 'line3', ..., and "
           "'vertex' names nodes", odd, error=MeshError)
    blocks = {k: block for k, block in enumerate(mesh.cells) if LINE.fullmatch(block.type)}
    cells = [_ends_first(points, cell) for block in blocks.values()
             for cell in np.asarray(block.data, dtype=np.int64)]
    refuse(not cells, "the mesh has no lines: its cells are {}", sorted(kinds) or "none",
           error=MeshError)
    # the same cell may be there once for each set that it is in
    number: dict[tuple[int, ...], int] = {}
    cell_number = np.array([number.setdefault(min(cell, cell[1::-1] + cell[:1:-1]), len(number))
                            for cell in map(tuple, map(np.ndarray.tolist, cells))])
    lines = [cells[k] for k in np.unique(cell_number, return_index=True)[1]]
    used, ends = np.unique([cell[:2] for cell in lines], return_inverse=True)
    if points.shape[1] > 2:
        inside = np.unique(np.concatenate(lines))
        x, y, z = points[inside].T
        refuse_any(np.abs(z) > 1e-6 * max(np.ptp(x), np.ptp(y)), "the point {} of the mesh is at z "
                   "= {:.9g} in place of 0", inside, z, error=MeshError)
    curves = {k: partial(_polynomial, points[cell, :2].T) for k, cell in enumerate(lines)
              if len(cell) > 2}
    first = dict(zip(blocks, np.cumsum([0] + [len(b.data) for b in blocks.values()])))
    wanted = [*named, *([] if groups is None else [groups] if isinstance(groups, str) else groups)]
    sets, nodes, lost = _names(mesh, {k: cell_number[first[k]:first[k] + len(block.data)]
                                      for k, block in blocks.items()}, used, wanted)
    if groups is not None:
        chosen = require_names("set of lines in groups", groups, sets)
        beams = tuple(name for name in sets if name in chosen)
    else:
        taken = np.bincount(np.concatenate([*map(np.unique, sets.values()), []]).astype(int),
                            minlength=len(lines))
        beams = tuple(name for name, some in sets.items()
                      if name in named or np.all(taken[some] == 1))
    return FrameGraph(points[used, :2], ends.reshape(-1, 2), sets, nodes, curves, tol, beams, lost)


def _mesh_of(mesh, unit):
    import meshio

    path = require_path("mesh", mesh) if isinstance(mesh, (str, Path)) else None
    if path is not None and path.suffix.lower() == ".dxf":
        return mesh_of_dxf(path, unit)
    if path is not None:
        with retold((Exception, SystemExit),  # meshio exits on an unknown format
                    "{} cannot be read as a mesh: {error}", path, error=FileError):
            mesh = meshio.read(path)
    refuse(unit is not None, "unit={!r} is for drawings in DXF, which state theirs", unit)
    require_kind("mesh", mesh, meshio.Mesh, " of meshio or the name of a file")
    if path is None or path.suffix.lower() != ".inp":
        return mesh
    # element sets of an Abaqus file that meshio 5 misreads
    blocks, sets, keyword = [], [], ""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("*"):
            keyword = line.partition(",")[0].strip().upper()
            found = re.search(r"ELSET\s*=\s*([^,]*)", line, re.IGNORECASE)
            name = found.group(1).strip() if found else ""
            if keyword == "*ELEMENT":
                blocks.append(name)
            elif keyword == "*ELSET":
                sets.append(name)
        elif keyword == "*ELSET":
            refuse(re.match(r"\s*[A-Za-z_]", line), "{}: the set {!r} lists names of sets: list "
                   "numbers of elements", path, sets[-1], error=MeshError)
    named = [name for name in blocks if name]
    again = sorted({name for name in named + sets if (named + sets).count(name) > 1})
    refuse(again or blocks[:len(named)] != named, "{}: write *ELSET with the numbers of all its "
           "elements: {}", path, f"{again[0]!r} is there twice" if again else
           "an *ELEMENT has no set before one that has", error=MeshError)
    return mesh


def _ends_first(points, cell):
    """Reorder the points of a three-point line: ends first, which are farthest apart."""
    if len(cell) != 3:
        return cell
    a, b, c = points[cell]
    if np.linalg.norm(c - a) > max(np.linalg.norm(b - a), np.linalg.norm(c - b)):
        return cell[[0, 2, 1]]
    refuse(np.linalg.norm(c - b) > np.linalg.norm(b - a), "the points {} of a line are not in the "
           "order end, end, middle, or end, middle, end", cell.tolist(), error=MeshError)
    return cell


def _names(mesh, blocks, used, wanted):
    """Lines and nodes by name, and by name a point that is not an end of a line."""
    sets = {name: parts for name, parts in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    # or stored as numbers: Gmsh physical groups, or names in meshio cell data
    names = {int(number): name for name, (number, _) in mesh.field_data.items()}
    for key, parts in () if sets else mesh.cell_data.items():
        known: Any = ()
        texts = key.split("-")
        numbers = np.unique(np.concatenate([np.ravel(part) for part in parts]))
        if key == "gmsh:physical":
            known = [(int(k), names.get(int(k), str(int(k)))) for k in numbers if k]
        elif set(wanted) & set(texts) and numbers.dtype.kind in "iu" and (
                -1 <= numbers[0] and numbers[-1] < len(texts)):
            known = enumerate(texts)
        for number, name in known:
            sets[name] = [np.flatnonzero(np.ravel(part) == number) for part in parts]
    groups, found = {}, dict[str, list[Any]]()
    for name, parts in sets.items():
        refuse(len(parts) > len(mesh.cells), "the cell set {!r} has {} parts, the mesh {} blocks",
               name, len(parts), len(mesh.cells), error=MeshError)
        parts = {k: _entries(name, part, len(mesh.cells[k].data)) for k, part in enumerate(parts)
                 if part is not None}
        some = [blocks[k][part] for k, part in parts.items() if k in blocks and len(part)]
        if some:
            groups[name] = np.concatenate(some)
        for k, part in parts.items():
            if k not in blocks and len(part):
                found.setdefault(name, []).append(np.ravel(mesh.cells[k].data)[part])
    for name, part in mesh.point_sets.items():
        part = _entries(name, part, len(mesh.points))
        if len(part):
            found[name] = [part]
    nodes, lost = {}, {}
    for name, parts in found.items():
        at = np.concatenate(parts).astype(np.int64)
        on = np.isin(at, used)
        if np.any(on):
            nodes[name] = np.searchsorted(used, at[on])
        if not np.all(on):
            lost[name] = int(at[~on][0])
    return groups, nodes, lost


def _entries(name, part, n):
    """Check the numbers of a set of a mesh, (k,)."""
    try:
        out = np.ravel(np.asarray(part))
    except ValueError:  # of sets
        out = np.zeros(1, dtype=object)
    refuse(len(out) and (out.dtype.kind not in "iu" or out.min() < 0 or out.max() >= n), "the set "
           "{!r} must hold numbers from 0 to {}, got {!r}", name, n - 1, part, error=MeshError)
    return out.astype(np.int64)


def _polynomial(points, s):
    """Polynomial through ends at s = 0 and 1 and equidistant points (2, n - 2) between."""
    n = points.shape[1]
    return points[:, [0, *range(2, n), 1]] @ lagrange(np.arange(n), (n - 1) * np.asarray(s)).T
