"""Linearisation about a base state by complex steps.

A function f of the displacement u is evaluated at ``u0 + 1j STEP (u - u0)``. To first order,

    f(u0) + f'(u0) (u - u0) = Re f + Im f / STEP,

to round-off, since nothing is subtracted [1]. The same code thus gives linear and nonlinear strain,
stress, force and rotation.

References
----------
[1] Squire, Trapp: "Using complex variables to estimate derivatives of real functions", SIAM Review
40 (1998).
"""

from typing import Any

import numpy as np

from .types import Array, Law

#: The step, a power of two; its square is negligible, its fifth power does not underflow.
STEP = 2.0**-200


def step(base: Any, value: Any) -> Any:
    """The complex argument from a base in the direction of a value."""
    return base + 1j * (STEP * (value - base))


def first_order(z: Any) -> Any:
    """Linearised value of a function from its result at a :func:`step`; real results pass.

    >>> first_order(step(2.0, 5.0) ** 2)
    16.0
    """
    return z.real + z.imag / STEP if np.iscomplexobj(z) else z


def angle_of(x: Any, y: Any) -> Any:
    """``arctan2(y, x)`` in radians, also for a :func:`step`."""
    if not np.iscomplexobj(x):
        return np.arctan2(y, x)
    turn = (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)
    return np.arctan2(y.real, x.real) + 1j * turn


def unwrapped(angle: Array) -> Array:
    """``np.unwrap`` along the last axis, also for a :func:`step`."""
    if not np.iscomplexobj(angle):
        return np.unwrap(angle)
    return np.unwrap(angle.real) + 1j * angle.imag


def stress_of(law: Law, strain: Array) -> Array:
    """The stress of a law, for a :func:`step` by its moduli."""
    if not np.iscomplexobj(strain):
        return law.stress(strain)
    real = np.ascontiguousarray(strain.real)
    return law.stress(real) + 1j * np.einsum("ij...,j...->i...", law.moduli(real), strain.imag)
