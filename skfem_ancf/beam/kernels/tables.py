"""Tables of the elements from which kernels find strains, forces and tangents.

Elements of one table have a number of samples of strain. A sample depends on two rows of
derivatives of the position: ``r_g = x_g + G_g u`` and ``r_h``. Of sections these are r_X and r_Y,
and a sample is a Green-Lagrange strain at a point; of cables r_X and r_XX, and a sample is the
extension or the change of curvature. Samples times moduli with the weights of the integration
are weighted stresses T, whose work on the samples is that of the stress in the element.

Left nodes take no part: G multiplies the other functions, and the right node's position
less the left one's. A translation changes nothing then, not even round-off.

A tangent is a sum over pairs of rows g and h: ``w[i, j] G[g, k] G[h, l]`` adds to the entry between
component i of function k and component j of function l. The coefficients w take few operations, and
all else is one product of matrices.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...core.source import F1, F2, F3, I1, I2
from .law import LawTables

#: Kinds of strains: of sections, and of cables.
SECTION, CABLE = range(2)
#: Columns of :attr:`StrainTables.at`.
OF_G, OF_FRAME, OF_H, OF_C, OF_WEIGHTS = range(5)


class StrainTables(NamedTuple):
    """Elements with the same samples of strain.

    Attributes
    ----------
    kind
        :data:`SECTION` or :data:`CABLE`.
    start
        First degree of freedom of each element, (ne,).
    at
        Which G, frame, H, C and weights are an element's, (ne, 5).
    G
        Derivatives of the local functions but the first, (k, rows, nb - 1).
    frame
        The rows x in the reference configuration, (k, rows, 2).
    rows
        g and h of each sample, (2, ns); both are the same where there is one only.
    pairs
        Samples s <= t of each modulus, sorted by s, with all s = t; (2, nq).
    products
        Rows g <= h of the products that tangents are made of, sorted, (2, np).
    terms
        Which product, which two rows a and b of samples, and which modulus make a coefficient, (4,
        nt), sorted by products: rows g of the samples are the first ns, rows h the others.
    of
        The product of g and h of each sample, (ns,).
    H
        Moduli between samples, with weights: ``T[s] = sum H[s, t] strain[t]``; (k, nq). Of laws
        that are not linear those without strain.
    C
        Constant stiffness of an element, (k, 2 nb - 2, 2 nb - 2), or (0, ...) for none.
    law
        :class:`~skfem_ancf.beam.kernels.law.LawTables`; what follows is for those not linear.
    along
        From samples to the points of integration, (3 points, ns), and (0, ns) of cables.
    weights
        Of the points, (k, points).
    address
        That of the compiled kernels; 0 for none.
    """

    kind: int
    start: I1
    at: I2
    G: F3
    frame: F3
    rows: I2
    pairs: I2
    products: I2
    terms: I2
    of: I1
    H: F2
    C: F3
    law: LawTables
    along: F2
    weights: F2
    address: int = 0


@lru_cache(64)
def _products(rows, pairs, size):
    """:attr:`StrainTables.products`, ``terms`` and ``of``, from the bytes of rows and pairs."""
    g, h = np.frombuffer(rows, np.int64).reshape(2, size)
    ends = [[s] if g[s] == h[s] else [s, size + s] for s in range(size)]
    row = np.concatenate([g, h])
    terms = [(*sorted((a, b), key=lambda c: row[c]), q)
             for q, (s, t) in enumerate(np.frombuffer(pairs, np.int64).reshape(2, -1).T)
             for a in ends[s] for b in ends[t] if s < t or a <= b]
    of, found = (np.sort(x, axis=0) for x in (np.array([g, h]), row[np.transpose(terms)[:2]]))
    products = np.unique(np.concatenate([of, found], axis=1), axis=1)
    number = {tuple(x): k for k, x in enumerate(products.T.tolist())}
    numbers = [[number[tuple(x)] for x in y.T.tolist()] for y in (found, of)]
    terms = sorted((p, *x) for p, x in zip(numbers[0], terms))
    return products, np.transpose(np.array(terms, np.int64)).copy(), np.array(numbers[1], np.int64)


def products_of(rows: Any, pairs: Any) -> Any:
    """The products, terms and ``of`` of :class:`StrainTables` with such rows and pairs."""
    return _products(*(np.ascontiguousarray(x, np.int64).tobytes() for x in (rows, pairs)),
                     rows.shape[1])


class Destination(NamedTuple):
    """Entry (i, j), i >= j, of a tangent is added at ``flat[j * ld + i - j]``.

    Of a matrix in two halves (j, i) is ``ld // 2`` behind.
    """

    flat: F1
    ld: int


def apart(t: StrainTables) -> StrainTables:
    """The tables with degrees of freedom for each element, one element behind the other."""
    return t._replace(start=(2 * t.G.shape[2] + 2) * np.arange(len(t.start)))


def repeated(t: StrainTables, n: int, N: int) -> StrainTables:
    """The tables of n times the elements, whose degrees of freedom begin N later each time."""
    return t._replace(start=(t.start + N * np.arange(n)[:, None]).ravel(),
                      at=np.tile(t.at, (n, 1)))


def together(tables: Sequence[StrainTables]) -> StrainTables:
    """The elements of several tables with the same samples, of linear laws, in one."""
    first = tables[0]
    if len(tables) == 1:
        return first
    names = "G", "frame", "H", "C", "weights"  # in the order of the columns of ``at``
    sizes = np.array([[len(getattr(t, name)) for name in names] for t in tables])
    before = np.cumsum(sizes, axis=0) - sizes
    parts: dict[str, Any] = {
        name: np.concatenate([getattr(t, name) for t in tables]) for name in (*names, "start")}
    return first._replace(
        at=np.concatenate([t.at + k for t, k in zip(tables, before)]), **parts)


def linearised(t: StrainTables) -> StrainTables:
    """The tables of the law with constant moduli, those without strain."""
    return t._replace(law=t.law._replace(kind=0))


def scaled(t: StrainTables, factor: float) -> StrainTables:
    """The tables of a linear law with ``factor`` times the moduli, without constant stiffness."""
    return linearised(t)._replace(H=factor * t.H, C=t.C[:0])
