"""Laws with a history in compiled kernels, for a block of elements: see
:class:`~skfem_ancf.beam.kernels.kernel.ElementsWithHistory`, which is for NumPy."""

import numpy as np

from ...core import F3, apart, source
from .compiled import CompiledTables
from .tables import evaluate_history

#: The time of an increment that stands for its start.
AT_START = -1.0


@source
def of_block(x, first, out):
    """Values (., points, ne) of a block of elements, (., points, W); the last fills the block."""
    last = min(out.shape[2], x.shape[2] - first)
    for k in range(len(out)):
        for p in range(out.shape[1]):
            a, b = x[k, p, first:], out[k, p]
            for e in range(last):
                b[e] = a[e]
            for e in range(last, len(b)):
                b[e] = a[last - 1]


@apart("histories", CompiledTables, int, F3, float, F3, F3)
def evaluate_increment(t, first, E, dt, out, after):
    """Stress and moduli (c + c^2, points, W), or energy (1, ...), of strains (c, points, W) less
    eigenstrains, and the history after an increment; at its start if dt is AT_START."""
    m, n, scale = t.memory, len(E), t.law.scale
    shift, h = np.empty(E.shape), np.empty(after.shape)
    of_block(m.before if dt < 0.0 else m.now, first, shift)
    if len(m.elastic) > 0:
        elastic(m, first, E, shift, out)
        return
    of_block(m.history, first, h)
    for c in range(n):
        x, y, z = E[c].ravel(), shift[c].ravel(), scale[c]
        for k in range(len(x)):
            x[k] = z * (x[k] - y[k])
    evaluate_history(t.law, E, h, max(dt, 0.0), out, after)
    for c in range(len(out)):
        z = scale[c] if c < n else scale[(c - n) // n] * scale[(c - n) % n]
        if z != 1.0:
            x = out[c].ravel()
            for k in range(len(x)):
                x[k] *= z


@source
def elastic(m, first, E, shift, out):
    """Stress and moduli of what is elastic."""
    n = len(E)
    of_block(m.stress, first, out[:n])
    for c in range(n):
        for d in range(n):
            out[n + n * c + d] = m.elastic[c, d]
            x, y, z = E[d].ravel(), shift[d].ravel(), out[c].ravel()
            for k in range(len(x)):
                z[k] += m.elastic[c, d] * (x[k] - y[k])
