"""What depends on the displacement, to first order about a base state.

A function f of the displacement u is evaluated at ``u0 + 1j STEP (u - u0)``. To first order,

    f(u0) + f'(u0) (u - u0) = Re f + Im f / STEP,

exact to round-off, as nothing is subtracted [1]: one evaluation of what serves large displacements
gives the linear strain, stress, force and rotation.

References
----------
[1] Squire, Trapp: "Using complex variables to estimate derivatives of real functions", SIAM Review
40 (1998).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .types import Array, Law

#: The step, a power of two. Its square is round-off beside anything, its fifth power a number.
STEP = 2.0**-200


def step(base: Any, value: Any) -> Any:
    """The place at which a function is evaluated: from the base in the direction of a value.
    """
    return base + 1j * (STEP * (value - base))


def first_order(z: Any) -> Any:
    """What a function is to first order, from its value at a :func:`step`; real ones stay.

    Examples
    --------
    >>> first_order(step(2.0, 5.0) ** 2)
    16.0
    """
    return z.real + z.imag / STEP if np.iscomplexobj(z) else z


def angle_of(x: Any, y: Any) -> Any:
    """The angle of vectors, in radians: ``arctan2(y, x)``, of a :func:`step` too.
    """
    if not np.iscomplexobj(x):
        return np.arctan2(y, x)
    turn = (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)
    return np.arctan2(y.real, x.real) + 1j * turn


def unwrapped(angle: Array) -> Array:
    """``np.unwrap`` along the last axis, of a :func:`step` too.
    """
    if not np.iscomplexobj(angle):
        return np.unwrap(angle)
    return np.unwrap(angle.real) + 1j * angle.imag


def stress_of(law: Law, strain: Array) -> Array:
    """The stress of a law, of a :func:`step` too: by its moduli, so that it need not know of it.
    """
    if not np.iscomplexobj(strain):
        return law.stress(strain)
    real = np.ascontiguousarray(strain.real)
    return law.stress(real) + 1j * np.einsum("ij...,j...->i...", law.moduli(real), strain.imag)
