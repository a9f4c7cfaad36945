"""Tables of the elements for kernels, and their laws: linear, pointwise functions of the strain, or
in Python.

Elements of one table have the same samples of strain. A sample depends on two rows of position
derivatives, ``r_g = x_g + G_g u`` and ``r_h``: of sections r_X and r_Y, and a sample is a
Green-Lagrange strain at a point; of cables r_X and r_XX, and a sample is the extension or the
change of curvature. Weighted stresses T are samples times weighted moduli: their work on the
samples is that of the stress in the element.

G excludes the left node's position; the right node's position is relative to it. Translations
therefore have no round-off.

A tangent is a sum over pairs of rows g and h: ``w[i, j] G[g, k] G[h, l]`` adds to the entry between
component i of function k and component j of function l. Few operations give the coefficients w; the
rest is a matrix product.
"""

import weakref
from collections.abc import Sequence
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from ...core import (F1, F2, F3, I1, I2, Array, apart, array_cache, cached_property, indices,
                     primitive)
from ...materials import LinearLaw, PointwiseMaterial
from ...materials.base import ShearCorrected
from ...materials.history import AtRest

#: Kinds of strains.
SECTION, CABLE = range(2)
#: Columns of :attr:`StrainTables.at`.
OF_G, OF_FRAME, OF_H, OF_C, OF_WEIGHTS = range(5)


class Pattern:
    """What samples of strain depend on and what couples them, without values: rows g and h of each
    sample, (2, ns), ``pairs`` of samples s <= t of each modulus, (2, nq), ``products`` of rows g <=
    h in tangents, (2, np), and ``terms``: product, rows a and b of the samples (g first), modulus,
    (4, nt). All are sorted; ``of`` is the product of g and h of each sample."""

    def __init__(self, kind: int, rows: Array, pairs: Array) -> None:
        self.kind, self.rows, self.pairs, self.ns = kind, rows, pairs, rows.shape[1]
        (g, h), size, row = rows, self.ns, rows.ravel()
        ends = [[s] if g[s] == h[s] else [s, size + s] for s in range(size)]
        terms = [(*sorted((a, b), key=lambda c: row[c]), q)
                 for q, (s, t) in enumerate(pairs.T)
                 for a in ends[s] for b in ends[t] if s < t or a <= b]
        of, found = (np.sort(x, axis=0) for x in (rows, row[np.transpose(terms)[:2]]))
        self.products = np.unique(np.concatenate([of, found], axis=1), axis=1).copy()
        number = {tuple(x): k for k, x in enumerate(self.products.T.tolist())}
        numbers = [[number[tuple(x)] for x in y.T.tolist()] for y in (found, of)]
        terms = sorted((p, *x) for p, x in zip(numbers[0], terms))
        self.terms = np.transpose(np.array(terms, np.int64)).copy()
        self.of = np.array(numbers[1], np.int64)

    @cached_property
    def ends(self) -> tuple[Array, ...]:
        """Samples with a second end; sample, row, and number of the direction of each end."""
        (g, h), own, n = self.rows, np.arange(self.ns), self.ns // 2
        second = (g != h).nonzero()[0]
        return (second, np.concatenate([own, second]), np.concatenate([g, h[second]]),
                np.concatenate([own, second + n] if self.kind == CABLE else [h, g[second]]))

    @cached_property
    def summands(self) -> tuple[Array, ...]:
        """Moduli and strains of the summands of the stresses, sorted, and the first of each."""
        (s, z), pairs = self.pairs, self.pairs
        both, q = np.concatenate([pairs, pairs[::-1, s != z]], axis=1), np.arange(len(s))
        order = both[0].argsort(kind="stable")
        return (np.concatenate([q, q[s != z]])[order], both[1, order],
                both[0, order].searchsorted(np.arange(self.ns)))

    @cached_property
    def coefficients(self) -> tuple[Array, ...]:
        """Directions a and b, moduli, rows k and l, and factors of the coefficients of tangents."""
        # Those of the products of the samples come first; the last item has their factors in the
        # geometric part.
        (second, _, _, direction), ns, terms = self.ends, self.ns, self.terms
        first, rest = np.full(self.products.shape[1], -1), np.ones(terms.shape[1], bool)
        first[terms[0, ::-1]] = np.arange(len(rest))[::-1]
        own = first[self.of]
        rest[own] = False
        p, a, b, q = terms[:, np.concatenate([own, rest.nonzero()[0]])]
        end = np.zeros(2 * ns, int)
        end[:ns], end[ns + second] = np.arange(ns), ns + np.arange(len(second))
        (k, l), (g, h) = self.products[:, p], self.rows
        return (direction[end[a]], direction[end[b]], q, k, l, np.where(a == b, 0.5, 1.0)[:, None],
                np.where(g == h, 0.5, 1.0)[:, None])


class StrainTables(NamedTuple):
    """Elements with the same samples of strain; k = 1 if all elements have equal values."""

    pattern: Pattern
    start: I1  # first DOF of each element, (ne,)
    at: I2  # numbers of an element's G, frame, H, C and weights, (ne, 5)
    G: F3  # derivatives of all shape functions but the first, (k, rows, nb - 1)
    frame: F3  # rows x in the reference configuration, (k, rows, 2)
    H: F2  # weighted moduli: T[s] = sum H[s, t] strain[t], (k, nq); at zero strain if nonlinear
    C: F3  # constant stiffness, (k, 2 nb - 2, 2 nb - 2), or (0, ...)
    law: "LawTables"
    along: F2  # for nonlinear laws: from samples to integration points, (3 points, ns)
    weights: F2  # for nonlinear laws: weights of the points, (k, points)
    reach: F2  # for fibres: factors of the samples before ``along``, (k, ns); (k, 0) if all are 1

    @property
    def kind(self) -> int:
        return self.pattern.kind


@array_cache(64)
def pattern_of(kind: int, rows: Array, pairs: Array) -> Pattern:
    """The :class:`Pattern` of samples; the same object for equal ones."""
    return Pattern(kind, rows, pairs)


def separated(t: StrainTables) -> StrainTables:
    """The tables with separate DOFs for each element."""
    return t._replace(start=(2 * t.G.shape[2] + 2) * np.arange(len(t.start)))


def repeated(t: StrainTables, n: int, N: int) -> StrainTables:
    """The tables of n copies of the elements, with an offset of N between their DOFs."""
    return t._replace(start=(t.start + N * np.arange(n)[:, None]).ravel(),
                      at=np.tile(t.at, (n, 1)))


def together(tables: Sequence[StrainTables]) -> StrainTables:
    """Merge tables with the same samples and linear laws."""
    first = tables[0]
    if len(tables) == 1:
        return first
    names = "G", "frame", "H", "C", "weights"  # in the order of the columns of ``at``
    sizes = np.array([[len(getattr(t, name)) for name in names] for t in tables])
    before = np.cumsum(sizes, axis=0) - sizes
    parts: dict[str, Any] = {name: np.concatenate([getattr(t, name) for t in tables])
                             for name in (*names, "reach", "start")}
    return first._replace(
        at=np.concatenate([t.at + k for t, k in zip(tables, before)]), **parts)


def linearised(t: StrainTables) -> StrainTables:
    """The tables with constant moduli, those at zero strain."""
    return t._replace(law=t.law._replace(kind=0))


def scaled(t: StrainTables, factor: float) -> StrainTables:
    """The linearised tables with moduli times a factor, without constant stiffness."""
    return linearised(t)._replace(H=factor * t.H, C=t.C[:0])


#: Kinds of laws: constant moduli, a function of the strain at a point, a law in Python, one with a
#: history.
LINEAR, POINTWISE, CUSTOM, HISTORY = 0, 1, 2, 3

#: Laws by handle, as long as a kernel uses them; compiled code has no Python objects.
_LAWS: dict[int, Any] = {}
_handles = count(1)


class LawTables(NamedTuple):
    """A law for kernels; :func:`law_tables` makes it."""

    kind: int  # LINEAR, POINTWISE, CUSTOM or HISTORY
    handle: int  # of a law that is not linear
    address: int  # of the compiled law, or 0
    D: F2  # moduli, at zero strain if they vary, (3, 3)
    constants: F1  # of a pointwise law
    scale: F1  # factors of strain and stress, sqrt(k_s) for shear, (3,)


@primitive("skfem_ancf.equations.loops")
def custom_evaluate(handle, strain, out):
    """Stress (3, n, elements), moduli (9, ...), both (12, ...) or energy (1, ...) in Python."""
    law = _LAWS[handle]
    if len(out) == 12:
        out[:3], out[3:] = law.stress(strain), np.reshape(law.moduli(strain), out[3:].shape)
        return
    found = {1: law.energy, 3: law.stress, 9: law.moduli}[len(out)](strain)
    out[...] = np.reshape(found, out.shape)


@primitive("skfem_ancf.equations.loops")
def evaluate_points(law, strain, out):
    """Energy, stress or moduli of a pointwise law; compiled code calls its address."""
    out[...] = _LAWS[law.handle].evaluated(strain, len(out))


@primitive("skfem_ancf.equations.loops")
def evaluate_history(law, strain, history, dt, out, after):
    """Stress and moduli, and the history after an increment, or energy, of a law with a history;
    compiled code calls its address. NumPy has
    :class:`~skfem_ancf.beam.kernels.kernel.ElementsWithHistory`."""


def points_of(t: StrainTables) -> tuple[Any, ...]:
    """The functions of a nonlinear law for compiled code: of a point, and of the energy stored at
    one that has a history. They are None for laws that run in Python."""
    if t.law.kind == LINEAR:
        return ()
    law = _LAWS[t.law.handle]
    if t.law.kind == HISTORY:
        return law.functions(t.pattern.kind == CABLE)
    return (law.point if t.law.kind == POINTWISE else None,)


def material_of(law: LawTables) -> Any:
    return _LAWS[law.handle]


@apart("laws", LawTables, F3, F3)
def law_evaluate(law, strain, out):
    """Second Piola-Kirchhoff stress, moduli or energy per volume of a nonlinear law."""
    # ``strain`` is (eps_xx, eps_yy, 2 eps_xy), shape (3, n, elements). The shape of ``out`` selects
    # the result: (3, n, elements) stress, (9, ...) moduli (c, d) at 3 c + d, (12, ...) both in
    # NumPy, (1, ...) energy.
    n, size = strain.shape[1], strain.shape[2]
    x = np.empty(strain.shape, strain.dtype)
    for c in range(3):  # with the shear correction
        y = law.scale[c]
        for p in indices(n):
            for e in indices(size):
                x[c, p, e] = y * strain[c, p, e]
    if law.kind == POINTWISE:
        evaluate_points(law, x, out)
    else:
        custom_evaluate(law.handle, x, out)
    stresses = 3 if len(out) == 3 or len(out) == 12 else 0
    for k in range(len(out)):
        y = 1.0
        if k < stresses:
            y = law.scale[k]
        elif len(out) > 1:
            y = law.scale[(k - stresses) // 3] * law.scale[k % 3]
        for p in indices(n):
            for e in indices(size):
                out[k, p, e] *= y


@apart("laws", LawTables, F3, F3, F3)
def conserve(law, middle, change, S):
    """Correct the mean stress S so that its work equals the change of energy, by Gonzalez (2000).
    ``middle`` and ``change`` are the mean of both strains and their difference, (3, n,
    elements)."""
    n, size = S.shape[1], S.shape[2]
    x, W = np.empty((3, 2 * n, size), S.dtype), np.empty((1, 2 * n, size), S.dtype)
    before, after, old, new = x[:, :n], x[:, n:], W[0, :n], W[0, n:]
    for c in range(3):
        for p in indices(n):
            for e in indices(size):
                before[c, p, e] = middle[c, p, e] - 0.5 * change[c, p, e]
                after[c, p, e] = middle[c, p, e] + 0.5 * change[c, p, e]
    law_evaluate(law, x, W)
    for p in indices(n):
        for e in indices(size):
            a, b, c = change[0, p, e], change[1, p, e], change[2, p, e]
            square = a * a + b * b + c * c
            missing = (new[p, e] - old[p, e]
                       - (S[0, p, e] * a + S[1, p, e] * b + S[2, p, e] * c))
            share = missing * (square > 1e-24) / np.maximum(square, 1e-24)
            S[0, p, e] += share * a
            S[1, p, e] += share * b
            S[2, p, e] += share * c


def law_tables(law: Any, owner: Any) -> LawTables:
    """The LawTables of a law; a law in Python is registered while its ``owner`` lives."""
    base, scale, constants = law, np.ones(3), np.zeros(3)
    if isinstance(law, AtRest):
        kind, base, scale, D = HISTORY, law.material, law.scale, law.D
        if base.point is not None or base.fibre is not None:
            constants = base.constants
    elif isinstance(law, LinearLaw):
        return LawTables(LINEAR, 0, 0, np.array(law.D, dtype=float), constants, scale)
    else:
        if type(law) is ShearCorrected:
            base, scale = law.base, law.scale
        kind = CUSTOM
        if isinstance(base, PointwiseMaterial) and base.is_pointwise:
            kind, constants = POINTWISE, base.constants
        with np.errstate(all="ignore"):
            D = np.reshape(law.moduli(np.zeros((3, 1, 1))), (3, 3))
    handle = next(_handles)
    _LAWS[handle] = base
    weakref.finalize(owner, _LAWS.pop, handle, None)
    return LawTables(kind, handle, 0, *(np.array(x, dtype=float) for x in (D, constants, scale)))


#: For cables, which have moduli only.
NO_LAW = LawTables(LINEAR, 0, 0, np.zeros((3, 3)), np.zeros(3), np.ones(3))
