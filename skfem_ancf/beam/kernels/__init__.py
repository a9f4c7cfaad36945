"""Strain energy, internal force and tangent of all elements of a beam. :mod:`skfem_ancf.forms` has
the weak forms; this package evaluates them from :mod:`.tables` of the derivatives of the shape
functions, which :mod:`.section` makes. :mod:`.elements` has the kernels for NumPy; :mod:`.loops`
replaces them in compiled code. All quantities are functions of the displacement ``u = q - q0``:
with ``r_X = e_1 + G u``, the strain ``eps_xx = (e_1 + G u / 2) . G u`` has no cancellation at small
displacements or far from the origin."""

from .section import CableKernel, SectionKernel

__all__ = ["CableKernel", "SectionKernel"]
