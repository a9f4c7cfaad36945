"""Sections given by their stiffnesses and inertias."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, require_positive
from ..materials import StVenantKirchhoff
from .base import Section, Slab
from .measure import Uniform

if TYPE_CHECKING:
    from ..mesh.mesh_beam import MeshBeam
    from ..core.types import HasShear


class Numbers(Section):
    """A section by its numbers; :meth:`Section.numbers` makes it.

    It is a rectangle of the material E = EA / (b h), nu = 0, whose height sqrt(12 EI / EA) need
    not be that h of the mesh: this is where section coordinates are, and what pictures show.

    Parameters
    ----------
    EA, EI
        Stiffnesses against extension and bending about the axis.
    GA
        Against shear, its factor included; None for that of a rectangle, 5/12 EA. A cable has none.
    rhoA, rhoI
        Mass per length, and its moment of inertia about the axis; rhoI is that of the height
        sqrt(12 EI / EA) if it is None.
    width
        Of the faces, where pressures and tractions act.
    """

    has_materials = True
    has_fields = False

    def __init__(self, EA: float, EI: float, GA: float | None = None, rhoA: float | None = None,
                 rhoI: float | None = None, width: float = 1.0) -> None:
        self.EA, self.EI = require_positive("EA", EA), require_positive("EI", EI)
        self.GA = None if GA is None else require_positive("GA", GA)
        self.rhoA = None if rhoA is None else require_positive("rhoA", rhoA)
        self.rhoI = None if rhoI is None else require_positive("rhoI", rhoI)
        self.width_of_faces = require_positive("width", width)
        if rhoI is not None and rhoA is None:
            raise InputError("rhoI is given without rhoA: give both, or neither of them")

    def slabs(self, mesh: MeshBeam, material: Any) -> list[Slab]:
        b, h = self.width_of_faces, mesh.height
        if mesh.heights is not None:
            raise InputError("the numbers of a section are the same all along: use a mesh of "
                             "constant height")
        E = self.EA / (b * h)
        GA = 5.0 / 12.0 * self.EA if self.GA is None else self.GA
        density = None if self.rhoA is None else self.rhoA / (b * h)
        law = _Given(E=E, nu=0.0, density=density, shear_correction=2.0 * GA / self.EA)
        part = np.sqrt(12.0 * self.EI / self.EA) / h
        own = part if self.rhoI is None or self.rhoA is None else (
            np.sqrt(12.0 * self.rhoI / self.rhoA) / h)
        return [Slab(law, b, Uniform(0.5 - 0.5 * part, 0.5 + 0.5 * part), face=(b, b), outer=b,
                     density=density, shear=2.4 * GA / self.EA,
                     inertia=Uniform(0.5 - 0.5 * own, 0.5 + 0.5 * own))]

    def __repr__(self) -> str:
        return f"Section.numbers(EA={self.EA:g}, EI={self.EI:g})"


class _Given(StVenantKirchhoff):
    """Hooke's law whose shear factor gives a section of any order one stiffness against shear."""

    def shear_factor(self, element: HasShear) -> float:
        return super().shear_factor(element) * (1.2 if element.carries_shear_parabola else 1.0)
