"""What the texts of kernels leave to others: matrices of each element, and laws in Python."""

import numba
import numpy as np

from ..kernels import law as laws
from .twin import jit

#: Elements evaluated together: several vectors wide, with the work arrays still in cache.
BLOCK = 32


@jit
def block(pairs):
    return BLOCK


@jit
def element_products(A, first, B, out):
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for e in range(B.shape[2]):
                out[i, j, e] = 0.0
        for k in range(A.shape[1]):
            for j in range(B.shape[1]):
                for e in range(B.shape[2]):
                    out[i, j, e] += A[i, k, first + e] * B[k, j, e]


@jit
def turned_element_products(A, first, B, out):
    for i in range(A.shape[1]):
        for j in range(B.shape[1]):
            for e in range(B.shape[2]):
                out[i, j, e] = 0.0
        for k in range(A.shape[0]):
            for j in range(B.shape[1]):
                for e in range(B.shape[2]):
                    out[i, j, e] += A[k, i, first + e] * B[k, j, e]


@jit
def own_stress(handle, strain, S):
    with numba.objmode():
        laws.own_stress(handle, strain, S)


@jit
def own_moduli(handle, strain, D):
    with numba.objmode():
        laws.own_moduli(handle, strain, D)


@jit
def own_energy(handle, strain, W):
    with numba.objmode():
        laws.own_energy(handle, strain, W)


@jit
def log1p(x):
    return np.log1p(x)
