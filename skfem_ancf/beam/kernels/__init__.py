"""The strain energy of beams: energy, internal force and tangent of all elements at once.

The weak forms of :mod:`skfem_ancf.forms` say what is computed; this package computes the same from
:mod:`.tables` of the derivatives of the local functions in the beam's own frame. :mod:`.strain`
has the kernels, as steps of :mod:`.arrays` that :mod:`.loops` has for Numba; :mod:`.section` and
:mod:`.cable` make the tables.

Everything is a function of the displacement ``u = q - q0``: the gradient is ``r_X = e_1 + G u``,
and ``eps_xx = (e_1 + G u / 2) . G u`` has no cancellation where displacements are small, nor far
from the origin.
"""

from .cable import CableKernel
from .section import SectionKernel

__all__ = ["CableKernel", "SectionKernel"]
