"""The strain energy of beams: energy, internal force and tangent of all elements at once.

The weak forms of :mod:`skfem_ancf.forms` say what is computed; this package computes the same from
tables of the derivatives of the local functions in the beam's own frame. Every formula stands
here once, as a text that :mod:`skfem_ancf.core.source` marks: it runs as plain NumPy, and compiled.
A kind of beam is a module with a pack of tables, a text that evaluates forces, stresses and
tangents, and its :class:`~skfem_ancf.beam.kernels.base.Texts`. In their arrays the elements are the
last axis.

Everything is a function of the displacement ``u = q - q0`` of the coordinates: the gradient is
``r_X = e_1 + G u``, and ``eps_xx = (e_1 + G u / 2) . G u`` has no cancellation where displacements
are small, nor far from the origin.
"""

from .cable import CableKernel, CablePack
from .section import Kernel, SectionPack

__all__ = ["CableKernel", "CablePack", "Kernel", "SectionPack"]
