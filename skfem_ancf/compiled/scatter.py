"""Sums into places that occur more than once."""

from .twin import jit


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
