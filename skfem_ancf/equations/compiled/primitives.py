"""What texts leave to others."""

import numpy as np

from .twin import jit


@jit
def own_evaluate(handle, strain, out):
    out[:] = np.nan  # scenes with such laws run in NumPy


@jit
def own_distance(handle, obstacle, t, x, out):
    out[:] = np.nan  # scenes with such shapes run in NumPy


@jit
def log1p(x):
    return np.log1p(x)


@jit
def dot(a, b):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@jit
def weighted(a, b, w):
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i] * w[i]
    return total


@jit
def total(x):
    found = 0.0
    for i in range(x.size):
        found += x[i]
    return found


@jit
def smallest(x):
    found = np.inf
    for i in range(x.size):
        found = np.minimum(found, x[i])  # not a number, if one is not
    return found


@jit
def largest(x):
    found = 0.0
    for i in range(x.size):
        found = np.maximum(found, abs(x[i]))
    return found


@jit
def differs(a, b):
    for i in range(a.size):
        if a[i] != b[i]:
            return True
    return False
