"""The kernels compiled by Numba, for scenes too small for batched NumPy.

Found at run time: without the package numba nothing changes but the speed. The functions repeat
what :mod:`skfem_ancf.kernel`, :mod:`skfem_ancf.cable`, :mod:`skfem_ancf.statics` and
:mod:`skfem_ancf.dynamics` say, a block of elements at a time and into the band matrix, and are
tested against them. What calls them from Python: :class:`CompiledKernel` for one beam,
:class:`~skfem_ancf.compiled.structure.Structure` for all of a scene.
"""

from .kernel import CompiledKernel

__all__ = ["CompiledKernel"]
