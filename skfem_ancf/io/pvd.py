"""Time series of states for ParaView."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from ..actions.obstacles.outlines import obstacles_of
from ..core.archive import output_file
from ..core.errors import (InputError, require_finite_scalar, require_like, require_path,
                           require_text)
from ..core.types import StrPath
from ..recovery.fields import find_fields
from .vtu import save_vtu

logger = logging.getLogger(__name__)


class PvdWriter:
    """Writes one .vtu file for each frame, and a .pvd file that lists them with their times.

    Both are complete after every :meth:`add`, so that ParaView can follow a run. Frames are called
    ``stem_00000.vtu`` and so on, in the folder of the .pvd; outlines of obstacles are a second
    part.

    Parameters
    ----------
    filename
        Path that ends with .pvd. Missing folders are created; the first frame replaces an older
        file.
    subdivide, lagrange, undeformed, recover, fields, precision, encoding
        As for :func:`~skfem_ancf.io.vtu.save_vtu`.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.io import PvdWriter
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with PvdWriter(f"{folder}/load.pvd") as series:
    ...         for t in (1.0, 2.0):
    ...             scene = Scene(beam).clamp("left").point_force((0, -t), at=(1, 0))
    ...             print(series.add(scene.solve_static(), t).name)
    load_00000.vtu
    load_00001.vtu
    """

    def __init__(self, filename: StrPath, subdivide: tuple[int, int] = (8, 4),
                 lagrange: bool = False, undeformed: bool = False, recover: bool = True,
                 fields: Any = None, precision: str = "double",
                 encoding: str | None = None) -> None:
        self.path = require_path("filename", filename, (".pvd",))
        require_text("filename", self.path.name)  # names of frames are written in Unicode
        self.options: dict[str, Any] = dict(
            subdivide=subdivide, lagrange=lagrange, undeformed=undeformed, recover=recover,
            fields=fields, precision=precision, encoding=encoding)
        find_fields(fields)
        self.frames: list[tuple[float, str]] = []  # (time, name of the file)

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        if self.frames:
            logger.info("wrote %s: %d frames", self.path, len(self.frames))

    def add(self, state: Any, t: float) -> Path:
        """Write a frame; returns its file.

        Parameters
        ----------
        state
            A State, or an object with ``beams`` and ``u_of``.
        t
            Its time, later than that of the previous frame.
        """
        from xml.sax.saxutils import quoteattr  # which imports http and ssl

        require_like("state", state, "State", "beams", "u_of")
        t = require_finite_scalar("t", t)
        if self.frames and t <= self.frames[-1][0]:
            raise InputError(f"the times of the frames must increase: {t!r} after "
                             f"{self.frames[-1][0]!r}")
        name = f"{self.path.stem}_{len(self.frames):05d}.vtu"
        frame = save_vtu(state, self.path.with_name(name), **self.options)
        self.frames.append((t, name))
        endings = (".vtu", "_obstacles.vtu")[:1 + bool(obstacles_of(state))]
        rows = [f'<DataSet timestep="{t!r}" part="{k}" file='
                f'{quoteattr(name.replace(".vtu", ending))}/>'
                for t, name in self.frames for k, ending in enumerate(endings)]
        with output_file(self.path) as temporary:
            temporary.write_text("\n".join(
                ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">',
                 "<Collection>", *rows, "</Collection>", "</VTKFile>", ""]), encoding="utf-8")
        return frame
