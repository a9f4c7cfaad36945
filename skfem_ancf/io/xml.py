"""Writes .vtu files: XML with arrays compressed by zlib, in one appended block."""

from __future__ import annotations

import zlib
from base64 import b64encode
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

#: Level of zlib: the next ones save little and cost much.
LEVEL = 4

#: VTK's numbers of the cells.
CELL_TYPES = {"line": 3, "polygon": 7, "quad": 9, "VTK_LAGRANGE_QUADRILATERAL": 70}

_NAMES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


class _Arrays:
    """The arrays of a file, one after the other in its appended data."""

    def __init__(self, raw, packed):
        self.raw, self.packed, self.blocks, self._offset = raw, packed, [], 0

    def _block(self, raw):
        data = zlib.compress(raw, LEVEL)
        header = np.array([1, len(raw), 0, len(data)], dtype="<u4").tobytes()
        return header + data if self.raw else b64encode(header) + b64encode(data)

    def __call__(self, name, values, same=False):
        """A DataArray element for numbers (n,) or (n, components), mostly the same as before."""
        values = np.ascontiguousarray(values)
        raw = values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
        before = self.packed.get(name, (None, None)) if same else (None, None)
        block = before[1] if before[0] == raw else self._block(raw)
        if same:
            self.packed[name] = raw, block
        components = f'NumberOfComponents="{values.shape[1]}" ' if values.ndim == 2 else ""
        self.blocks.append(block)
        self._offset, offset = self._offset + len(block), self._offset
        return (f'<DataArray type="{_NAMES[values.dtype.str[1:]]}" Name={quoteattr(name)} '
                f'{components}format="appended" offset="{offset}"/>')


def topology(body: Any) -> tuple[Any, Any, Any]:
    """Connectivity, offsets and types of the cells of a body, for VTK."""
    connectivity = np.concatenate([cells.ravel() for _, cells in body.cells])
    sizes = np.concatenate([np.full(len(c), c.shape[1]) for _, c in body.cells])
    types = np.concatenate([np.full(len(c), CELL_TYPES[kind], np.uint8) for kind, c in body.cells])
    return connectivity.astype(np.int32), np.cumsum(sizes).astype(np.int32), types


def write_vtu(path: Path, body: Any, dtype: Any = np.float64,
              raw: bool = False, packed: dict | None = None) -> None:
    """Write a body as a .vtu file.

    Parameters
    ----------
    path
        The file.
    body
        The :class:`~skfem_ancf.io.vtu.BodyFields`.
    dtype
        Of points and fields: numpy.float64 or numpy.float32.
    raw
        Bytes as they are; else in base64.
    packed
        Arrays of cells of the frame before in the same encoding, used if they are the same; those
        of this one are put there.
    """
    connectivity, offsets, types = topology(body)
    array = _Arrays(raw, {} if packed is None else packed)
    cell_data = {name: np.concatenate(parts).astype(np.int32)
                 for name, parts in body.cell_data.items()}
    rows = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" '
        'header_type="UInt32" compressor="vtkZLibDataCompressor">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{len(body.points)}" NumberOfCells="{len(types)}">',
        "<Points>", array("Points", body.points.astype(dtype)), "</Points>",
        "<Cells>", array("connectivity", connectivity, True), array("offsets", offsets, True),
        array("types", types, True), "</Cells>",
        "<PointData>", *(array(k, v.astype(dtype)) for k, v in body.point_data.items()),
        "</PointData>",
        "<CellData>", *(array(k, v, True) for k, v in cell_data.items()), "</CellData>",
        "</Piece>", "</UnstructuredGrid>", 
        f'<AppendedData encoding="{"raw" if raw else "base64"}">', "_"]
    Path(path).write_bytes(b"".join([
        "\n".join(rows).encode(), *array.blocks, b"\n</AppendedData>\n</VTKFile>\n"]))
