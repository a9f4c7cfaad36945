"""Plane vectors as complex numbers, by their components: Numba would multiply by 0."""

import numpy as np

from ...core import primitive, source


@source
def dot(a, b):
    """The scalar product."""
    return a.real * b.real + a.imag * b.imag


@source
def cross(a, b):
    """The product ``a_1 b_2 - a_2 b_1``."""
    return a.real * b.imag - a.imag * b.real


@source
def size(a):
    """The length."""
    return np.sqrt(a.real * a.real + a.imag * a.imag)


@source
def scaled(c, a):
    """A multiple; Numba would multiply and divide by a complex number."""
    return vector(c * a.real, c * a.imag)


@source
def turned(a):
    """A vector turned by a right angle, ``1j a``."""
    return vector(-a.imag, a.real)


@primitive("skfem_ancf.core.loops")
def vector(x, y):
    """The vector with two components; Numba would multiply by 1j."""
    return x + 1j * y
