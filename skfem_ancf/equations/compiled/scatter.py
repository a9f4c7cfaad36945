"""Sums into places that occur more than once."""

from .twin import jit


@jit
def add_each(out, at, x):
    """out[at] += x."""
    for k in range(at.size):
        out[at[k]] += x[k]


@jit
def add_products(out, at, v, x, i):
    """out[at] += v x[i]."""
    for k in range(at.size):
        out[at[k]] += v[k] * x[i[k]]


@jit
def add_triples(out, at, v, x, i, y, j):
    """out[at] += v x[i] y[j]."""
    for k in range(at.size):
        out[at[k]] += v[k] * x[i[k]] * y[j[k]]


@jit
def add_entries(J, k, i, v):
    """J[k, i] += v."""
    for a in range(k.size):
        J[k[a], i[a]] += v[a]


@jit
def add_weighted_entries(J, k, i, v, x, j):
    """J[k, i] += v x[j]."""
    for a in range(k.size):
        J[k[a], i[a]] += v[a] * x[j[a]]


@jit
def subtract_from_band(A, i, j, v, x, k):
    """A[i, j] -= v x[k], of the lower half alone where that is all there is."""
    for a in range(i.size):
        if i[a] >= j[a] or A.top > 0:
            A.flat[j[a] * A.ld + A.top + i[a] - j[a]] -= v[a] * x[k[a]]
