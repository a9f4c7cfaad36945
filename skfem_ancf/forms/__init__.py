"""Weak forms of a planar body: energy, internal force, tangent, mass, loads.

Each factory returns a scikit-fem form for ``asm`` on a ``Basis`` of the position field, with the
degrees of freedom passed as ``r``:

>>> import numpy as np
>>> from skfem import Basis, ElementVector, asm
>>> from skfem_ancf import (ElementBeamANCF, MeshBeam, StVenantKirchhoff, forms,
...                         reference_coordinates)
>>> basis = Basis(MeshBeam.init_line(np.linspace(0, 1, 3), height=0.1),
...               ElementVector(ElementBeamANCF(2)))
>>> steel = StVenantKirchhoff(E=2.1e11, nu=0.3)
>>> q = reference_coordinates(basis)
>>> K = asm(forms.tangent(steel, width=0.1), basis, r=q)
>>> K.shape, bool(abs(asm(forms.internal_force(steel, width=0.1), basis, r=q)).max() < 1e-3)
((24, 24), True)

There are four kinds, equal where they are the same integral:

* :func:`textbook_energy`, :func:`textbook_internal_force`, :func:`textbook_tangent`: plain
  formulas, assembled by scikit-fem for one pair of local functions at a time. Tests compare the
  others with them.
* :func:`energy`, :func:`internal_force`, :func:`tangent`: the same for all local functions at once.
* :func:`strain_energy`: the energy as an :class:`~skfem_ancf.Energy`, for a scene.
* :func:`of`: the forms in the formulation of a Beam, as :class:`~skfem_ancf.Scene` uses them.

The strain is the Green-Lagrange strain ``(F^T F - 1) / 2`` in the beam's frame with
``F = grad r``, and S is the second Piola-Kirchhoff stress.
"""

from .weak import (BeamBilinearForm, BeamForms, BeamLinearForm, EnergyForm, ModuliForm, Position,
                   StrainEnergy, StressForm, deformation_gradient, energy, gravity, green_lagrange,
                   internal_force, mass, moduli_of, of, piola, position, pressure, strain_energy,
                   strain_variation, tangent, textbook, textbook_energy, textbook_internal_force,
                   textbook_tangent, traction)

__all__ = ["BeamBilinearForm", "BeamForms", "BeamLinearForm", "EnergyForm", "ModuliForm",
           "Position", "StrainEnergy", "StressForm", "deformation_gradient", "energy", "gravity",
           "green_lagrange", "internal_force", "mass", "moduli_of", "of", "piola", "position",
           "pressure", "strain_energy", "strain_variation", "tangent", "textbook",
           "textbook_energy", "textbook_internal_force", "textbook_tangent", "traction"]
