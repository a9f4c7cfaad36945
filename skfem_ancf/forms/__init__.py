"""The weak forms of a planar body."""

from .weak import (BeamBilinearForm, BeamForms, BeamLinearForm, EnergyForm, HasKernel, ModuliForm,
                   StressForm, deformation_gradient, gravity, green_lagrange, internal_force, mass,
                   of, pressure, strain_variation, tangent, textbook_energy,
                   textbook_internal_force, textbook_tangent, traction)

__all__ = [
    "BeamBilinearForm",
    "BeamForms",
    "BeamLinearForm",
    "EnergyForm",
    "HasKernel",
    "ModuliForm",
    "StressForm",
    "deformation_gradient",
    "gravity",
    "green_lagrange",
    "internal_force",
    "mass",
    "of",
    "pressure",
    "strain_variation",
    "tangent",
    "textbook_energy",
    "textbook_internal_force",
    "textbook_tangent",
    "traction",
]
