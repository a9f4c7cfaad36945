"""What a state shows: extremes of fields, files, pictures."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..beam.layout import WhichBeam, select_beam
from ..core.errors import require_flag, require_integer
from ..core.types import Array
from ..io import tables, vtu
from ..recovery.fields import DRAWN, find_field, no_value, values_on_grid
from ..recovery.grids import layout
from ..visuals import diagrams, html, matplotlib, pyvista
from .report import report

#: Points of all beams together, along an element at least and at most, and across it.
POINTS, FEW, MANY, ACROSS = 4000, 4, 32, 8
#: Distance of places in heights of the section.
APART = 2.0


class Extreme(NamedTuple):
    """A place of a large value of a field.

    Attributes
    ----------
    value
        The value; of a vector its magnitude.
    point
        The material point, in the reference configuration, shape (2,).
    beam
        Name of the beam, or its number.
    """

    value: float
    point: Array
    beam: Any

    def __str__(self) -> str:
        x, y = self.point
        return f"{self.value:.4g} at ({x:.4g}, {y:.4g}) of beam {self.beam!r}"


class Output:
    """Extremes, files and pictures of a State."""

    def extremes(self, field: Any = "utilisation", count: int = 10, beam: WhichBeam = None,
                 recover: bool = True) -> list[Extreme]:
        """The places where a field is largest in magnitude, two heights or more from each other.

        Parameters
        ----------
        field
            A scalar field or "displacement", as for :meth:`State.plot <skfem_ancf.State.plot>`;
            "utilisation" is the stress over the ``strength`` of the material.
        count
            Largest number of places.
        beam
            Beam, name or number; all by default.
        recover
            Recovered strain and stress if available.

        Raises
        ------
        InputError
            If the field has no value, as the utilisation without a strength.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> steel = StVenantKirchhoff(E=2.1e11, nu=0.3, strength=235e6)
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.1), ElementBeamANCF(2),
        ...             steel, width=0.06)
        >>> state = Scene(beam).clamp("left").point_force((0, -1e4), at=(1, 0)).solve_static()
        >>> worst = state.extremes()[0]  # 6 P L / (b h^2) / 235e6
        >>> round(worst.value, 2), worst.point.round(3).tolist(), worst.beam
        (0.43, [0.0, 0.05], 0)
        """
        state: Any = self
        recover, count = require_flag("recover", recover), require_integer("count", count, 1)
        wanted = find_field(field, DRAWN)
        beams = state.beams if beam is None else (select_beam(state.beams, beam),)
        m = int(np.clip(POINTS // max(1, sum(b.mesh.nelements for b in beams)), FEW, MANY))
        found: list[tuple[Extreme, float]] = []
        for b in beams:
            v = values_on_grid(state, b, layout(b, m, ACROSS)[0], recover)
            values = wanted.of(v)
            values = np.hypot(*values) if wanted.components == 2 else values
            size, apart = np.abs(values - wanted.neutral), APART * b.mesh.height
            size[~np.isfinite(size)] = -1.0
            name = state.beams.index(b) if b.name is None else b.name
            for _ in range(count):
                k = int(np.argmax(size))
                if size[k] < 0.0:
                    break
                found.append((Extreme(float(values[k]), v.x[:, k].copy(), name), float(size[k])))
                size[np.hypot(*(v.x - v.x[:, [k]])) < apart] = -1.0
        if not found:
            raise no_value(wanted)
        return [one for one, _ in sorted(found, key=lambda pair: -pair[1])[:count]]

    def _repr_html_(self) -> str:
        return html.state_html(self)

    save = vtu.save_vtu
    to_xarray = tables.to_xarray
    to_pyvista = pyvista.to_pyvista
    view = pyvista.view
    plot = matplotlib.plot_state
    plot_resultants = diagrams.plot_resultants
    report = report
