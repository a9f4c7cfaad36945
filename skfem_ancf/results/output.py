"""What a state shows: extremes of fields, files, pictures."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..beam.beam import Beam
from ..beam.domain import Domain
from ..beam.layout import WhichMember, select_member
from ..core import AncfError, Array, CallbackError, InputError, require_flag, require_integer
from ..io import tables, vtu
from ..recovery.fields import DRAWN, find_field, no_value, values_on_grid
from ..recovery.grids import layout, values_of_domain
from ..visuals import diagrams, html, matplotlib, pyvista
from .report import report

#: Points of all beams together, along an element at least and at most, and across it.
POINTS, FEW, MANY, ACROSS = 4000, 4, 32, 8
#: Distance of places in heights of the section, and in sizes of a domain.
APART, IN_DOMAIN = 2.0, 0.1


class Extreme(NamedTuple):
    """A place of a large value of a field.

    Attributes
    ----------
    value
        The value; of a vector its magnitude.
    point
        The material point, in the reference configuration, shape (2,).
    beam
        Name of the beam or domain, or its number.
    kind
        "beam" or "domain".
    """

    value: float
    point: Array
    beam: Any
    kind: str = "beam"

    def __str__(self) -> str:
        x, y = self.point
        return f"{self.value:.4g} at ({x:.4g}, {y:.4g}) of {self.kind} {self.beam!r}"


class Output:
    """Extremes, files and pictures of a State."""

    def extremes(self, field: Any = "utilisation", count: int = 10, beam: WhichMember = None,
                 recover: bool = True) -> list[Extreme]:
        """The places where a field is largest in magnitude, two heights or more from each other.

        Components of a domain are in global axes; places in it are a tenth of its size apart.

        Parameters
        ----------
        field
            A scalar field or "displacement", as for :meth:`State.plot <skfem_ancf.State.plot>`;
            "utilisation" is the stress over the ``strength`` of the material.
        count
            Largest number of places.
        beam
            Beam or domain, its name or number; by default all that have the field.
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
        members = state.system.members
        beams = [one for one in members if isinstance(one, (Beam, Domain))] if beam is None else [
            select_member(state.beams, members[len(state.beams):], beam)]
        total = sum(b.mesh.nelements for b in beams if isinstance(b, Beam))
        m = int(np.clip(POINTS // max(1, total), FEW, MANY))
        found: list[tuple[Extreme, float]] = []
        undefined: AncfError = no_value(wanted)
        for b in beams:
            if isinstance(b, Beam):
                kind, apart = "beam", APART * b.mesh.height
                v: Any = values_on_grid(state, b, layout(b, m, ACROSS)[0], recover)
            elif isinstance(b, Domain):
                kind, v = "domain", values_of_domain(state, b)[0]
                apart = IN_DOMAIN * float(np.max(np.ptp(v.x, axis=1)))
            else:
                raise InputError(f"extremes are those of beams and domains, got {b!r}, in which no "
                                 "field varies")
            try:
                values = wanted.of(v)
            except AncfError as error:
                if kind == "beam" and isinstance(error, CallbackError):
                    raise
                undefined = error  # of a law without this stress
                continue
            values = np.hypot(*values) if wanted.components == 2 else values
            size = np.abs(values - wanted.neutral)
            size[~np.isfinite(size)] = -1.0
            name = members.index(b) if b.name is None else b.name
            for _ in range(count):
                k = int(np.argmax(size))
                if size[k] < 0.0:
                    break
                found.append((Extreme(float(values[k]), v.x[:, k].copy(), name, kind),
                              float(size[k])))
                size[np.hypot(*(v.x - v.x[:, [k]])) < apart] = -1.0
        if not found:
            raise undefined
        return [one for one, _ in sorted(found, key=lambda pair: -pair[1])[:count]]

    _repr_html_ = html.state_html
    save = vtu.save_vtu
    to_xarray = tables.to_xarray
    to_pyvista = pyvista.to_pyvista
    view = pyvista.view
    plot = matplotlib.plot_state
    plot_resultants = diagrams.plot_resultants
    report = report
