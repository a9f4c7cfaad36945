"""Force elements by the names that :mod:`skfem_ancf.equations.loops` imports."""

from .kernels import Kinds, of_kinds

__all__ = ["Kinds", "of_kinds"]
