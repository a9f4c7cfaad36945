"""Derivatives of densities given at a point, by Numba or by JAX."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..core.errors import MissingExtra

#: Complex step, and step of differences relative to a variable.
IMAGINARY, REAL = 1e-30, 1e-5


@lru_cache(32)
def by_jax(psi: Callable[..., Any]) -> dict[str, Callable[..., Any]]:
    """A density in JAX and its derivatives."""
    try:
        import jax
    except ImportError:
        raise MissingExtra("jax", "autodiff") from None
    from jax import experimental
    double = jax.enable_x64 if hasattr(jax, "enable_x64") else experimental.enable_x64

    def one(y, X, t):
        return psi(y[:2], y[2:].reshape(2, 2), X, t)

    def at_points(function):
        found = jax.jit(jax.vmap(function, (1, 1, None), -1))

        def of(r, F, X, t):
            y = np.concatenate([r, F.reshape(4, *r.shape[1:])])
            with double(True):
                out = np.asarray(found(y.reshape(6, -1), X.reshape(2, -1), t))
            return out.reshape(*out.shape[:-1], *r.shape[1:])

        return of

    return {"psi": at_points(one), "gradient": _in_two(at_points(jax.grad(one))),
            "hessian": at_points(jax.hessian(one))}


def _in_two(gradient):
    """Split a gradient by all six variables into those by r and F."""
    def of(r, F, X, t):
        out = gradient(r, F, X, t)
        return out[:2], out[2:].reshape(F.shape)

    return of


@lru_cache(32)
def by_loops(psi: Any, gradient: Any, hessian: Any,
             height: float) -> dict[str, Callable[..., Any]]:
    """Compiled functions of one point as functions of arrays, with missing derivatives of psi.

    First derivatives are complex steps, second ones differences of these, with steps relative to
    the height.
    """
    from numba import njit

    steps = REAL * np.array([height] * 2 + [1.0] * 4)

    def stepped(r, F, x, t, z, first, out):
        for k in range(first, 6):
            kept = z[k]
            z[k] += 1j * IMAGINARY
            out[k] = complex(psi(r, F, x, t)).imag / IMAGINARY
            z[k] = kept

    def density(r, F, x, t, z, first, out):
        out[0] = psi(r, F, x, t)

    def given(r, F, x, t, z, first, out):
        out[:2], b = gradient(r, F, x, t)
        out[2:] = b.copy().reshape(4)

    def curvature(r, F, x, t, z, first, out):
        out[:] = hessian(r, F, x, t).copy().reshape(36)

    def differences(r, F, x, t, z, first, out):
        a = np.empty((2, 6))
        for k in range(6):
            kept = z[k]
            for side in range(2):
                z[k] = kept + (2 * side - 1) * steps[k]
                slope_of(r, F, x, t, z, k, a[side])
            z[k] = kept
            for i in range(k, 6):
                out[6 * i + k] = out[6 * k + i] = 0.5 * (a[1, i] - a[0, i]) / steps[k]

    slope = stepped if gradient is None else given
    slope_of, kind = njit(slope), complex if gradient is None else float

    def at_points(function, shape, dtype):
        one, size = njit(function), int(np.prod(shape))

        @njit(error_model="numpy")
        def loop(y, X, t, z, x, out):
            r, F = z[:2], z[2:].reshape(2, 2)
            for p in range(y.shape[1]):
                z[:], x[:] = y[:, p], X[:, p]
                one(r, F, x, t, z, 0, out[p])

        def of(r, F, X, t):
            y = np.concatenate([r, F.reshape(4, *r.shape[1:])]).reshape(6, -1)
            out = np.empty((y.shape[1], size))
            loop(y, X.reshape(2, -1), float(t), np.empty(6, dtype), np.empty(2), out)
            return out.T.reshape(*shape, *r.shape[1:])

        return of

    return {"psi": at_points(density, (), float),
            "gradient": _in_two(at_points(slope, (6,), kind)),
            "hessian": at_points(differences, (6, 6), kind) if hessian is None else
            at_points(curvature, (6, 6), float)}
