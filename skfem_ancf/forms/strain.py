"""The strain energy of a beam as an Energy."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..actions.density import points_of
from ..actions.energy import Energy
from ..beam.kinematics import element_dofs
from ..core.errors import require_like
from ..formulations import get_formulation
from .weak import green_lagrange, moduli_of, piola


def strain_energy(beam: Any) -> Energy:
    """The strain energy of a beam as an :class:`~skfem_ancf.Energy`, fully integrated.

    psi is the strain energy density of the material at the points of the formulation "continuum",
    in all layers of the section, independent of the formulation of the beam. Load factors do not
    scale it. A scene of the beam already contains this energy: adding it doubles the stiffness. The
    kernels of a Beam with this formulation give the same numbers faster.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff, forms
    >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(2e8, 0.3), width=0.1, formulation="continuum")
    >>> u = 1e-3 * beam.sizes * np.cos(np.arange(beam.N))
    >>> energy = forms.strain_energy(beam).bind(beam)
    >>> bool(abs(energy.potential(u) / beam.kernel.energy(u) - 1) < 1e-12)
    True
    """
    require_like("beam", beam, "Beam", "facet_basis")
    return StrainEnergy(beam)


class StrainEnergy(Energy):
    """The energy of :func:`strain_energy`, of a ``beam``."""

    def __init__(self, beam: Any = None) -> None:
        super().__init__(strain_energy, strain_energy, strain_energy, beam=beam, scaled=False)

    def _points(self, beam):
        mapping, every, out = beam.mesh.mapping(), np.arange(beam.mesh.nelements), []
        for layer, terms in beam.across.terms(get_formulation("continuum")):
            for term in terms:
                X, W = term.quadrature
                weights = beam.across.volume(layer, X, W, every, len(term.section[0]) == 1,
                                             "" if layer.grade is None else "grade")
                out.append(points_of(
                    element_dofs(beam, every), np.asarray(mapping.F(X, every)),
                    np.broadcast_to(weights, (len(every), len(W))),
                    *beam.element.functions(mapping, X, every),
                    (term.law, mapping.frame(X, every))))
        return out

    def _ask(self, name, y, part, times=1):
        law, frame = part.of
        F = np.einsum("ij...,jJ...->iJ...", y[2:].reshape(2, 2, *y.shape[1:]), frame)
        if name == "psi":
            return law.energy(green_lagrange(F))
        if name == "gradient":
            return 0.0 * y[:2], piola(law, F, frame)
        out = np.zeros((6, *y.shape))
        out[2:, 2:] = moduli_of(law, F, frame).reshape(4, 4, *y.shape[1:])
        return out

    def distribution(self, u: Any) -> None:
        return None
