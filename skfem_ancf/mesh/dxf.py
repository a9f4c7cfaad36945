"""Read lines of a DXF drawing as a meshio mesh."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import FileError, InputError, MeshError, MissingExtra, require_option

logger = logging.getLogger(__name__)

#: Entities that are not straight lines, which are refused.
CURVES = ("ARC", "CIRCLE", "ELLIPSE", "SPLINE", "INSERT")


#: Units of length in which drawings can be read.
UNITS = "m", "mm", "cm", "dm", "km", "in", "ft", "yd"


def mesh_of_dxf(path: Path, unit: str | None = None) -> Any:
    """The lines and points of the model space, as cell sets named after their layers.

    Coordinates are converted to ``unit`` from that of the drawing; None takes them as drawn.
    Polylines are split into lines. Text, dimensions and hatches are ignored; MeshError for curves
    or blocks, FileError if the file cannot be read.
    """
    import meshio

    try:
        import ezdxf
    except ImportError:
        raise MissingExtra("ezdxf", "dxf") from None
    try:
        drawing = ezdxf.readfile(path)
        entities = list(drawing.modelspace())
    except (OSError, ezdxf.DXFError) as error:
        raise FileError(f"{path} cannot be read as a drawing: {error}") from error
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
            elif kind in CURVES:
                raise MeshError(f"{path} has {kind} in the layer {entity.dxf.layer!r}, which is "
                                "no straight line: explode blocks, and draw curves as polylines")
    if not lines:
        raise MeshError(f"{path} has no lines and no polylines in its model space")
    at, number = np.unique(places + [x for _, x in points], axis=0, return_inverse=True)
    at = at * _scale(drawing.units, unit, path)
    ends, alone = np.split(number.ravel(), [2 * len(lines)])
    layers, of = np.array(lines), np.array([name for name, _ in points])
    return meshio.Mesh(at, [("line", ends.reshape(-1, 2)), ("vertex", alone[:, None])], cell_sets={
        name: [np.flatnonzero(layers == name), np.flatnonzero(of == name)]
        for name in dict.fromkeys([*lines, *of.tolist()])})


def _scale(code, unit, path):
    """The factor from the unit of a drawing, a number of $INSUNITS, to another one."""
    from ezdxf import units

    stated = units.decode(code) if code else None
    if unit is None:
        logger.info("%s is taken as drawn, %s; unit='m' converts its coordinates to metres", path,
                    f"in {stated}" if stated else "in a unit that it does not state")
        return 1.0
    target = getattr(units, require_option("unit of length", unit, UNITS).upper())
    if stated is None:
        raise InputError(f"{path} does not state its unit ($INSUNITS is {code}), so that it cannot "
                         f"be converted to {unit!r}: leave out unit=, and scale the drawing")
    return units.conversion_factor(code, target)
