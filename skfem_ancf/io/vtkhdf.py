"""Time series of states in one temporal VTKHDF file."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..actions.obstacles.outlines import around, outlines
from ..core.archive import find_h5py, new_file, put_in_place
from ..core.errors import FileError, InputError, require_option, require_path
from ..core.types import StrPath
from ..recovery.fields import find_fields
from ..recovery.grids import CELL_TYPES
from .vtu import PRECISIONS, SeriesWriter, body_fields, require_next, save_obstacles

#: Bytes of a spare file, deleted if the disk is full: HDF5 aborts the process if it cannot close a
#: file.
SPARE = 2**22


class VtkHdfWriter(SeriesWriter):
    """Writes a series into one file, which stores the cells once.

    The file appears under its name when the series is closed, as at the end of a ``with`` block.

    Parameters
    ----------
    filename
        Path that ends with .vtkhdf. Missing folders are created.
    subdivide, lagrange, undeformed, recover, fields, precision
        As for :func:`~skfem_ancf.io.vtu.save_vtu`.

    Raises
    ------
    FileError
        If the file cannot be written; an older file is kept.
    MissingExtra
        If h5py is not installed.

    References
    ----------
    VTK file formats, "VTKHDF", version 2: temporal UnstructuredGrid.
    """

    def __init__(self, filename: StrPath, subdivide: tuple[int, int] = (8, 4),
                 lagrange: bool = False, undeformed: bool = False, recover: bool = True,
                 fields: Any = None, precision: str = "double") -> None:
        self.path = require_path("filename", filename, (".vtkhdf",))
        self.options: dict[str, Any] = dict(
            subdivide=subdivide, lagrange=lagrange, undeformed=undeformed, recover=recover,
            fields=fields)
        self._dtype = PRECISIONS[require_option("precision", precision, PRECISIONS)]
        find_fields(fields)
        files = find_h5py()
        self._made: list[Path] = []
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            for beside in self.path, self.path.with_suffix(".spare"):
                self._made.append(new_file(beside))
            self._temporary, self._spare = self._made
            self._spare.write_bytes(os.urandom(SPARE))  # incompressible
            self._file = files.File(self._temporary, "w", rdcc_nbytes=0)  # chunks are whole frames
        except BaseException as error:
            self._remove()
            if isinstance(error, OSError):
                raise self._cannot(error) from error
            raise
        self._root = self._file.create_group("VTKHDF")
        self._root.attrs["Version"] = (2, 0)
        self._root.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
        self.times: list[float] = []

    def __exit__(self, kind: Any, *_: Any) -> None:
        if self._file is None:
            return
        try:
            self._spare.unlink(missing_ok=True)
            if self.times:
                self._steps()
            self._file.close()
            if kind is None and self.times:
                put_in_place(self._temporary, self.path)
                save_obstacles(self._walls, self.path)
        except OSError as error:
            raise self._cannot(error) from error
        finally:
            self._file = None
            self._remove()

    def _remove(self):
        for path in self._made:
            with suppress(OSError):
                path.unlink()

    def _cannot(self, error):
        why = os.strerror(error.errno) if error.errno else error  # HDF5's text has ten lines
        return FileError(f"cannot write {str(self.path)!r}: {why}")

    def add(self, state: Any, t: float) -> Path:
        """Append a frame; returns the path of the file.

        Parameters
        ----------
        state
            A State, or an object with ``beams`` and ``u_of``.
        t
            Its time, later than that of the previous frame.
        """
        t = require_next(state, t, self.times[-1] if self.times else None)
        body = body_fields(state, **self.options, share=False)  # as many in all frames
        if not self.times:
            self._begin(body)
            self._cells = _cells(body)
            self._walls = outlines(state, around(body.points[:, :2].T))
        elif len(body.points) != self._n:
            raise InputError(f"all frames have the same points: the first has {self._n}, this one "
                             f"{len(body.points)}")
        elif not all(map(np.array_equal, _cells(body), self._cells)):
            raise InputError("all frames have the same cells, of the same beams and elements: "
                             "write states of another scene into another file, or as .pvd")
        try:
            self._append("Points", body.points)
            for name, values in body.point_data.items():
                self._append(f"PointData/{name}", values)
        except OSError as error:
            raise self._cannot(error) from error
        self.times.append(t)
        return self.path

    def _begin(self, body):
        connectivity, offsets, types, *numbers = _cells(body)
        self._n, root = len(body.points), self._root
        root["NumberOfPoints"] = np.array([self._n], dtype="i8")
        root["NumberOfCells"] = np.array([len(types)], dtype="i8")
        root["NumberOfConnectivityIds"] = np.array([len(connectivity)], dtype="i8")
        packed = dict(compression="gzip", shuffle=True)
        root.create_dataset("Connectivity", data=connectivity, **packed)
        root.create_dataset("Offsets", data=offsets, **packed)
        root.create_dataset("Types", data=types, **packed)
        root.create_group("PointData")
        for name, values in zip(body.cell_data, numbers):
            root.create_dataset(f"CellData/{name}", data=values, **packed)
        for name, values in {"Points": body.points, **{
                f"PointData/{k}": v for k, v in body.point_data.items()}}.items():
            root.create_dataset(name, shape=(0,) + values.shape[1:], dtype=self._dtype,
                                maxshape=(None,) + values.shape[1:], chunks=values.shape,
                                compression="gzip", compression_opts=4, shuffle=True)

    def _append(self, name, values):
        data, n = self._root[name], len(self.times) * self._n  # behind the last whole frame
        data.resize(n + len(values), axis=0)
        data[n:] = values

    def _steps(self):
        n = len(self.times)
        steps = self._root.create_group("Steps")
        steps.attrs["NSteps"] = n
        steps["Values"] = np.array(self.times)
        zero, first = np.zeros(n, dtype="i8"), self._n * np.arange(n, dtype="i8")
        steps["PartOffsets"], steps["NumberOfParts"] = zero, zero + 1
        steps["PointOffsets"] = first
        steps["CellOffsets"], steps["ConnectivityIdOffsets"] = zero[:, None], zero[:, None]
        for group, offsets in (("PointData", first), ("CellData", zero)):
            for name in self._root[group]:
                steps[f"{group}Offsets/{name}"] = offsets


def _cells(body):
    """Data stored once: connectivity, offsets and types of cells, their numbers."""
    sizes = np.concatenate([np.full(len(c), c.shape[1]) for _, c in body.cells])
    return (np.concatenate([c.ravel() for _, c in body.cells]).astype("i8"),
            np.append(0, np.cumsum(sizes)).astype("i8"),
            np.concatenate([np.full(len(c), CELL_TYPES[kind], np.uint8) for kind, c in body.cells]),
            *(np.concatenate(parts).astype("i4") for parts in body.cell_data.values()))
