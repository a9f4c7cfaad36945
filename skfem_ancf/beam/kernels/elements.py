"""Strain energy of elements with the same samples of strain, in NumPy: stresses, force and tangent.

An end of a sample is a row of position derivatives with a direction. The strain changes by the sum
over its ends of ``direction . change of the row``: this holds for derivatives, with the directions
at u, and for finite changes, with mean directions, see :meth:`Elements.directions`. Rows, ends and
samples are first in arrays, elements last.

Rows are ``r = x + R (G (D U))``. U are the DOFs relative to the left node, without its position, so
that translations have no round-off. G is shared and R and D are diagonal (equal or graded meshes,
arcs), or each element has its own G (other curved meshes, tapers) and R and D are one.

The tangent is a product of constant matrices with few coefficients, those of products of two rows.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from ...core import Array, array_cache, cached_property, primitive
from .tables import (CABLE, HISTORY, LINEAR, OF_C, OF_FRAME, OF_G, OF_H, OF_WEIGHTS, Pattern,
                     StrainTables, conserve, law_evaluate)

#: Mode of ``take`` for valid numbers, which is the fastest.
CLIP: Any = "clip"
#: Number of displacements whose rows are kept.
KEPT = 3
#: Relative difference between shared and own derivatives that is round-off.
SAME = 1e-13


def scaled(G: Array) -> tuple[Array, Array, Array]:
    """One G, and R (k, rows) and D (k, m) with ``G[e] = R[e] G D[e]``; or all G, and ones."""
    k, rows, m = G.shape
    R, D = 1.0 + np.zeros((k, rows)), 1.0 + np.zeros((k, m))
    if k == 1:
        return G, R, D
    used = G[0].any(axis=0)
    size = np.abs(G[0][:, used]) / np.abs(G[0][:, used]).max(axis=0)
    with np.errstate(all="ignore"):
        ratio = np.where(size > 1e-9, G[:, :, used] / G[0][:, used], np.nan)
        full = size.min(axis=1).argmax()  # a row with all functions
        right = np.count_nonzero(used[:m // 2])  # 1 for the position of the right node
        D[:, used] = E = ratio[:, full] / ratio[:, full, right, None]
        R = ratio[:, np.arange(rows), size.argmax(axis=1)] / E[:, size.argmax(axis=1)]
        same = np.abs(R[:, :, None] * G[0] * D[:, None] - G) <= SAME * np.abs(G).max(
            axis=1, keepdims=True)
    return (G[:1], R, D) if same.all() else (G, np.ones((k, rows)), np.ones((k, m)))


@lru_cache(64)
def _entries(m: int) -> Any:
    """Lower half of an element matrix with the left node's position, from its parts."""
    # Returns rows, columns and signs of the entries; functions (without the left node's) and part
    # of each: xx, yy, or xy, the component x of the first and y of the second function; and their
    # positions in the parts of :meth:`Elements.matrices`, stacked.
    i, j = np.tril_indices(2 * m + 2)
    (k, x), (l, y) = divmod(i, 2), divmod(j, 2)
    sign = np.where(k == 0, -1.0, 1.0) * np.where(l == 0, -1.0, 1.0)
    k, l = np.where(k == 0, m // 2, k - 1), np.where(l == 0, m // 2, l - 1)
    swap = x > y  # the entry of y and x is that of x and y with functions exchanged
    k, l, part = np.where(swap, l, k), np.where(swap, k, l), np.where(x == y, x, 2)
    high, low, n = np.maximum(k, l), np.minimum(k, l), m * (m + 1) // 2
    number = high * (high + 1) // 2 + low
    return i, j, sign, k, l, part, np.where(
        part < 2, 3 * number + part, (3 + (k < l)) * n + number)


@array_cache(64)
def _to_rows(k: Array, l: Array, rows: int) -> Any:
    """Sparse matrix from coefficients (4 n,) to W (3 rows^2,) of xx, yy and xy between rows."""
    from scipy import sparse

    n, one = len(k), np.arange(len(k))
    to = np.concatenate([part * rows**2 + a * rows + b for part, a, b in (
        (0, k, l), (0, l, k), (1, k, l), (1, l, k), (2, k, l), (2, l, k))])
    of = np.concatenate([c * n + one for c in (0, 0, 1, 1, 2, 3)])
    return sparse.csr_matrix((np.ones(6 * n), (to, of)), shape=(3 * rows**2, 4 * n))


@array_cache(64)
def to_moduli(pattern: Pattern, points: int, along: Array) -> Any:
    """Sparse matrix from moduli at the points (9 points, of fibres points) to those between samples
    (nq)."""
    from scipy import sparse

    (s, z), A = pattern.pairs, along.reshape(-1, points, pattern.ns)
    c, n = np.abs(A).sum(axis=1).argmax(axis=0), len(A)  # component of each sample
    M = np.zeros((len(s), n * n, A.shape[1]))
    M[np.arange(len(s)), n * c[s] + c[z]] = A[c[s], :, s] * A[c[z], :, z]
    return sparse.csr_matrix(M.reshape(len(s), -1))


class Elements:
    """The elements of :class:`~skfem_ancf.beam.kernels.tables.StrainTables` t. Displacements are
    (N,), weighted stresses and strains (ns, ne), forces (N,), bands flat."""

    def __init__(self, t: StrainTables) -> None:
        self.t, self.ne, self.ns, self.m = t, len(t.start), t.pattern.ns, t.G.shape[2]
        self.kind = t.pattern.kind
        G, R, D = scaled(t.G[t.at[:, OF_G]] if len(t.G) > 1 else t.G)
        self.G, self.own, self._even = G, len(G) > 1, len(R) == 1 or len(G) > 1
        self.R, self.D = R.T[:, None].copy(), D.T[:, None].copy()
        self.x = self._last(t.frame, OF_FRAME)
        self.rest = self.measured(self.x)
        self._second, self._sample, self._row, self._direction = t.pattern.ends
        self._last_rows: tuple[Any, ...] = ()  # displacements, with the results of :meth:`at`
        self._at_band: dict[int, Array] = {}  # flat positions of the lower halves in a band
        # relative DOFs (2 m, ne)
        self._dofs = t.start + np.arange(2, 2 * self.m + 2)[:, None]
        self._left = t.start + np.arange(2)[:, None]
        # the slice of DOFs, and where in it the element forces of :meth:`add` go
        self._span = slice(int(t.start.min()), int(t.start.max()) + 2 * self.m + 2)
        self._ends = np.concatenate([self._dofs, self._left]).ravel() - self._span.start
        #: Weighted moduli between samples, (nq, ne or 1).
        self.moduli = self._last(t.H, OF_H)
        #: The constant stiffness (1 or ne, 2 m, 2 m), or None.
        self.C: Array | None = (None if not len(t.C) else t.C if len(t.C) == 1 else
                                t.C[t.at[:, OF_C]])

    def _last(self, x, column):
        """A table with the elements as last axis, of length 1 if all are equal."""
        x = x if len(x) == 1 else x[self.t.at[:, column]]
        return x.transpose(*range(1, x.ndim), 0).copy()

    @cached_property
    def _G_ends(self):
        return np.ascontiguousarray(self.G.transpose(0, 2, 1).take(self._row, axis=2))

    # kinematics

    def relative(self, u: Array) -> Array:
        """DOFs relative to the left node, (m, 2, ne)."""
        U, q = u.take(self._dofs, 0, None, CLIP), self.m // 2 * 2
        U[q:q + 2] -= u.take(self._left, 0, None, CLIP)
        return U.reshape(self.m, 2, -1)

    def rows(self, U: Array) -> Array:
        """Changes (rows, 2, ne) of the rows by relative DOFs."""
        if self.own:
            return np.matmul(self.G, U.transpose(2, 0, 1)).transpose(1, 2, 0)
        if self._even:
            return (self.G[0] @ U.reshape(self.m, -1)).reshape(-1, 2, self.ne)
        d = self.G[0] @ (self.D * U).reshape(self.m, -1)
        return d.reshape(-1, 2, self.ne) * self.R

    def measured(self, r: Array) -> Any:
        """What :meth:`directions` needs of rows."""
        # For cables this is r_X and r_XX as complex numbers, |r_X| and the material curvature.
        if self.kind != CABLE:
            return r
        z = r[:, 0] + 1j * r[:, 1]
        a, b = z[::2], z[1::2]
        return a, b, np.abs(a), (b / a).imag

    def at(self, u: Array) -> tuple[Array, Array, Any, Array]:
        """Relative DOFs, changes of the rows, measures and directions at u."""
        key = u.tobytes()  # iterations of steps come back to their start and to that of the factors
        for known, found in self._last_rows:
            if known == key:
                return found
        U = self.relative(u)
        d = self.rows(U)
        one = self.measured(self.x + d)
        found = U, d, one, self.directions(one, one)
        self._last_rows = ((key, found), *self._last_rows[:KEPT - 1])
        return found

    def directions(self, one: Any, two: Any) -> Array:
        """Directions (n, 2, ne) whose products with a change of the rows are that of the strain."""
        # For equal measures these are derivatives.
        if self.kind != CABLE:
            return one if one is two else 0.5 * (one + two)
        (a, b, p, k), (c, d, q, l) = one, two
        s, square = a + c, p * p + q * q
        turned = s * (1j / square)
        second = (b + d) * (-1j / square) + (1j * (k + l)) * turned
        X = np.concatenate([s / (p + q), second, turned])
        return X.view(float).reshape(*X.shape, 2).transpose(0, 2, 1)

    def change(self, Y: Array, d: Array) -> Array:
        """Change (ns, ne) of the strain by a change of the rows in directions Y."""
        x = Y.take(self._direction, 0, None, CLIP) * d.take(self._row, 0, None, CLIP)
        ends = x[:, 0] + x[:, 1]
        strain = ends[:self.ns]
        strain[self._second] += ends[self.ns:]
        return strain

    def strain(self, d: Array, one: Any) -> Array:
        """The strain (ns, ne) of changes d of the rows, with their measures."""
        return self.change(self.directions(self.rest, one), d)

    # stress

    def linear_stress(self, strain: Array, moduli: Array | None = None) -> Array:
        """Weighted stresses (ns, ne) by moduli (nq, ne) between samples."""
        H = self.moduli if moduli is None else moduli
        modulus, other, begin = self.t.pattern.summands
        products = H.take(modulus, 0, None, CLIP) * strain.take(other, 0, None, CLIP)
        return np.add.reduceat(products, begin)

    @cached_property
    def weights(self) -> Array:
        """Weights of the integration points of nonlinear laws, (points, ne or 1)."""
        return self._last(self.t.weights, OF_WEIGHTS)

    @cached_property
    def reach(self) -> Array | None:
        """Factors of the samples for fibres (ns, ne or 1), or None."""
        return self._last(self.t.reach, OF_WEIGHTS) if self.t.reach.size else None

    def at_points(self, strain: Array) -> Array:
        """Strains (3 or, of fibres, 1, points, ne) at the integration points."""
        E = self.t.along @ (strain if self.reach is None else self.reach * strain)
        return E.reshape(-1, self.t.weights.shape[1], self.ne)

    def _weighted(self, S):
        """Stresses of the samples from those at the points."""
        T = self.t.along.T @ (S * self.weights).reshape(-1, self.ne)
        return T if self.reach is None else self.reach * T

    def stress(self, strain: Array, change: Array | None = None, shift: Array | None = None
               ) -> Array:
        """Weighted stresses (ns, ne)."""
        # With a ``change``, ``strain`` is its middle and the work of the stresses on the change is
        # the change of energy. With a ``shift`` (3, points, ne) of the strain of a nonlinear law,
        # it is the difference that the shift makes.
        if self.t.law.kind == LINEAR:
            return self.linear_stress(strain)
        return self._weighted(self.of_law(3, self.at_points(
            strain), None if change is None else self.at_points(change), shift))

    def of_law(self, n: int, E: Array, change: Array | None = None, shift: Array | None = None
               ) -> Array:
        """What a nonlinear law has at strains E (3, points, ne): 1, the energy, 3 stresses, 9
        moduli, or 12, both; see :meth:`stress`."""
        found = np.empty((n, *E.shape[1:]), E.dtype)
        law_evaluate(self.t.law, E, found)
        if change is not None:
            conserve(self.t.law, E, change, found)
        return found if shift is None else self.of_law(n, E + shift, change) - found

    @cached_property
    def _reach_of_pairs(self):
        return None if self.reach is None else self.reach[self.t.pattern.pairs].prod(axis=0)

    @cached_property
    def _to_moduli(self):
        """Sparse matrix from moduli at the points (9 points) to those between samples (nq)."""
        return to_moduli(self.t.pattern, self.t.weights.shape[1], self.t.along)

    def _moduli_of_samples(self, D):
        """Moduli (nq, ne) between samples from those at the points, as if they were symmetric."""
        D = self._to_moduli @ (D * self.weights).reshape(-1, self.ne)
        return D if self.reach is None else self._reach_of_pairs * D

    def stress_and_moduli(self, strain: Array) -> tuple[Array, Array]:
        """Weighted stresses (ns, ne), and moduli (nq, ne) between samples."""
        if self.t.law.kind == LINEAR:
            return self.linear_stress(strain), self.moduli
        both = self.of_law(12, self.at_points(strain))
        return self._weighted(both[:3]), self._moduli_of_samples(both[3:])

    def moduli_at(self, strain: Array, shift: Array | None = None) -> Array:
        """Moduli (nq, ne) between samples, or their change by a shift as in :meth:`stress`."""
        if self.t.law.kind == LINEAR:
            return self.moduli
        return self._moduli_of_samples(self.of_law(9, self.at_points(strain), shift=shift))

    # force

    def force(self, Y: Array, T: Array, U: Array | None = None) -> Array:
        """Element forces (m, 2, ne) of stresses; with U, those of the constant stiffness too."""
        F = T.take(self._sample, 0, None, CLIP)[:, None] * Y.take(self._direction, 0, None, CLIP)
        if self.own:
            F = np.matmul(self._G_ends, F.transpose(2, 0, 1)).transpose(1, 2, 0)
        elif self._even:
            F = (self._G_ends[0] @ F.reshape(len(F), -1)).reshape(self.m, 2, self.ne)
        else:
            F *= self.R[self._row]
            F = (self._G_ends[0] @ F.reshape(len(F), -1)).reshape(self.m, 2, self.ne) * self.D
        if U is not None and self.C is not None:
            U = U.reshape(2 * self.m, -1)
            CU = self.C[0] @ U if len(self.C) == 1 else np.einsum("eij,je->ie", self.C, U)
            F = F + CU.reshape(F.shape)
        return F

    def add(self, F: Array, f: Array) -> None:
        """Add element forces (m, 2, ne) to f."""
        q = self.m // 2
        at, F = self._ends, np.concatenate([F, -F[q:q + 1]]).ravel()
        f[self._span] += np.bincount(at, F, self._span.stop - self._span.start)

    # tangent

    @cached_property
    def _terms(self):
        """:attr:`Pattern.coefficients` with the factors R of the rows."""
        (*found, k, l, factor, geometric), (g, h), R = (
            self.t.pattern.coefficients, self.t.pattern.rows, self.R[:, 0])
        return (*found, k, l, (factor * R[k] * R[l])[:, None],
                (geometric * R[g] * R[h])[:, None])

    @cached_property
    def _products(self):
        """P (m (m + 1) / 2, terms) of xx, yy and xy + yx, Q of xy - yx, and its terms."""
        _, _, _, k, l, _, _ = self._terms
        (i, j), G = np.tril_indices(self.m), self.G[0].T
        one, two, skew = G[:, k], G[:, l], (k != l).nonzero()[0]
        P = one[i] * two[j] + one[j] * two[i]
        return P, (one[i] * two[j] - one[j] * two[i])[:, skew], skew

    @cached_property
    def _constant_moduli(self):
        return (self._terms[5] * self.moduli[self._terms[2]][:, None] if self.t.law.kind == LINEAR
                else None)

    def geometric(self, one: Any, T: Array) -> Array:
        """Coefficients (ns, 3, ne) of xx, yy and xy + yx of the geometric part, or of xx = yy."""
        # Those of cables are ``Im(Z v v)`` for the change v of r_X, and ``Im(z v w)`` for v and the
        # change w of r_XX.
        if self.kind != CABLE:
            return T[:, None]
        (a, b, p, _), n = one, len(T) // 2
        N, z = 0.5 * T[:n] / p, T[n:] / (-a * a)
        Z = np.concatenate([(-1j * N * a.conj() - 2.0 * z * b) / a, z])
        X = np.empty((2 * n, 3, self.ne))
        X[:, 0], X[:, 1], X[:, 2] = Z.imag, -Z.imag, 2.0 * Z.real
        X[:n, :2] += N[:, None]
        return X

    def coefficients(self, Y: Array, Z: Array, moduli: Array) -> tuple[Array, Array, Array]:
        """Coefficients (terms, 3, ne) of xx, yy, xy + yx, and xy and yx, of the material part."""
        a, b, q, _, _, factor, _ = self._terms
        c = (self._constant_moduli if moduli is self.moduli else
             factor * moduli.take(q, 0, None, CLIP)[:, None])
        X, Z = Y.take(a, 0, None, CLIP) * c, Z.take(b, 0, None, CLIP)
        w = np.empty((len(a), 3, self.ne))
        np.multiply(X, Z, out=w[:, :2])
        xy, yx = X[:, 0] * Z[:, 1], X[:, 1] * Z[:, 0]
        np.add(xy, yx, out=w[:, 2])
        return w, xy, yx

    def matrices(self, w: Array, xy: Array, yx: Array) -> Array:
        """Element matrices Q of coefficients, in parts for :func:`_entries`."""
        if self.own:
            rows, (_, _, _, k, l, _, _) = self.G.shape[1], self._terms
            to = _to_rows(k, l, rows)
            W = (to @ np.concatenate([w[:, 0], w[:, 1], xy, yx])).T.reshape(self.ne, -1, rows)
            WG = np.matmul(W, self.G).reshape(self.ne, 3, rows, self.m)
            return np.matmul(self.G.transpose(0, 2, 1)[:, None], WG)
        P, Q, skew = self._products
        K = (P @ w.reshape(len(w), -1)).reshape(-1, 3, self.ne)
        Z = Q @ (xy.take(skew, 0, None, CLIP) - yx.take(skew, 0, None, CLIP))
        return np.concatenate([K.reshape(-1, self.ne), 0.5 * (K[:, 2] + Z), 0.5 * (K[:, 2] - Z)])

    def lower(self, K: Array) -> Array:
        """Entries of the lower half with the left node's position, (entries, ne)."""
        _, _, sign, k, l, part, place = _entries(self.m)
        if self.own:
            at = (part * self.m + k) * self.m + l
            return K.reshape(self.ne, -1).take(at, axis=1).T * sign[:, None]
        return K.take(place, 0, None, CLIP) * self._signs

    @cached_property
    def _signs(self):
        _, _, sign, k, l, *_ = _entries(self.m)
        return sign[:, None] * self.D[k, 0] * self.D[l, 0]

    def tangent(self, one: Any, Y: Array, T: Array, moduli: Array | None) -> Array:
        """Lower halves (entries, ne) of the element tangents, without the constant stiffness."""
        # ``moduli`` None leaves out the material part; T are the stresses of the geometric part.
        n, geometric = self.ns, self.geometric(one, T) * self._terms[6]
        if moduli is None:
            terms = len(self._terms[0])
            w, xy, yx = np.zeros((terms, 3, self.ne)), *np.zeros((2, terms, self.ne))
        else:
            w, xy, yx = self.coefficients(Y, Y, moduli)
        w[:n, :2] += geometric[:, :2]
        if geometric.shape[1] > 1:
            w[:n, 2] += geometric[:, 2]
            xy[:n] += 0.5 * geometric[:, 2]
            yx[:n] += 0.5 * geometric[:, 2]
        return self.lower(self.matrices(w, xy, yx))

    @cached_property
    def constant(self) -> Array | None:
        """Lower halves (entries, ne or 1) of the constant stiffness, or None."""
        if self.C is None:
            return None
        i, j, *_ = _entries(self.m)
        K = np.empty((len(self.C), 2 * self.m + 2, 2 * self.m + 2))
        q = self.m // 2 * 2
        K[:, 2:, 2:] = self.C
        K[:, :2, 2:] = -K[:, q + 2:q + 4, 2:]
        K[:, :, :2] = -K[:, :, q + 2:q + 4]
        return K[:, i, j].T.copy()

    def add_to_band(self, K: Array, flat: Array, ld: int) -> None:
        """Add lower halves (entries, ne) to a band, entry (i, j) at ``flat[j * ld + i - j]``."""
        first, last = self._span.start * ld, min(self._span.stop * ld, len(flat))
        if ld not in self._at_band:
            (i, j, *_), start = _entries(self.m), self.t.start - self._span.start
            self._at_band[ld] = ((start + j[:, None]) * ld + (i - j)[:, None]).ravel()
        flat[first:last] += np.bincount(self._at_band[ld], K.ravel(), last - first)

    # derivatives

    def derivatives(self, Y: Array) -> Array:
        """Derivatives of the strain in directions Y by the DOFs of both nodes, (ne, ns, 2 nb)."""
        R, D = (x[:, 0].T[:, :, None] for x in (self.R[self._row], self.D))
        G = self.G.take(self._row, axis=1) * R * D.transpose(0, 2, 1)
        ends = G[..., None] * Y.take(self._direction, 0, None, CLIP).transpose(2, 0, 1)[:, :, None]
        B, q = np.empty((self.ne, self.ns, self.m + 1, 2)), self.m // 2
        B[:, :, 1:] = ends[:, :self.ns]
        B[:, self._second, 1:] += ends[:, self.ns:]
        B[:, :, 0] = -B[:, :, q + 1]
        return B.reshape(self.ne, self.ns, -1)

    def square(self, moduli: Array) -> Array:
        """Moduli between samples as matrices, (1 or ne, ns, ns)."""
        H, (s, z) = np.zeros((moduli.shape[1], self.ns, self.ns)), self.t.pattern.pairs
        H[:, s, z] = H[:, z, s] = moduli.T
        return H


# Kernels. Displacements u are (N,); f (N,) and ``flat`` are added to. Stresses are weighted, flat,
# (ne, ns); ``flat, ld`` store entry (i, j), i >= j, of a tangent at ``flat[j * ld + i - j]``.
# Forces and tangents of the strain include the constant stiffness. Arrays of size 0 are not used.
# In compiled code the functions of the same names in :mod:`.loops` replace them.

#: Marks kernels with a compiled version.
kernel = primitive("skfem_ancf.beam.kernels.loops")


def _given(e, T):
    """Stresses (ns, ne) from those of all elements, flat."""
    return T.reshape(e.ne, e.ns).T


def _put(e, T, out):
    """Write stresses (ns, ne) to ``out``, flat."""
    out.reshape(e.ne, e.ns)[:] = T.T


def _moved(e, u, v):
    """Relative DOFs, change of the rows from the reference, that from u to v, and directions."""
    # With v, DOFs and directions are means from u to v; without it, the second change is None.
    U, d, one, Y = e.at(u)
    if not v.size:
        return U, (d, one), None, Y
    dU = e.relative(v - u)
    dd = e.rows(dU)
    return U + 0.5 * dU, (d, one), dd, e.directions(one, e.measured(e.x + d + dd))


def _strain(e, at, dd, Y):
    """The strain, in the middle, and its change or None."""
    strain, change = e.strain(*at), None if dd is None else e.change(Y, dd)
    return strain if change is None else strain + 0.5 * change, change


@kernel
def run_force(e, u, v, given, out, f):
    """Force and stresses at u, or with v means from u to v whose work is the change of the energy.
    Given stresses act in place of those of the strain; without ``out``, they act without the
    constant stiffness."""
    U, at, dd, Y = _moved(e, u, v)
    T, whole = None, out.size > 0 or given.size == 0
    if whole:
        T = e.stress(*_strain(e, at, dd, Y))
    if out.size:
        _put(e, T, out)
    if f.size:
        e.add(e.force(Y, _given(e, given) if given.size else T, U if whole else None), f)


@kernel
def run_linearised(e, u, du, given, out, f):
    """Linearised stresses of a change or rate du at u: plus given ones to out, or as forces."""
    _, d, one, Y = e.at(u)
    moduli = e.moduli if e.t.law.kind == LINEAR else e.moduli_at(e.strain(d, one))
    T = e.linear_stress(e.change(Y, e.rows(e.relative(du))), moduli)
    if out.size:
        _put(e, _given(e, given) + T, out)
    if f.size:
        e.add(e.force(Y, T), f)


@kernel
def run_tangent(e, u, given, out, f, flat, ld):
    """Tangent and force at u; writes the stresses."""
    # The geometric part has the given stresses, or those of the strain if there are none.
    U, d, one, Y = e.at(u)
    T, moduli = e.stress_and_moduli(e.strain(d, one))
    if f.size:
        e.add(e.force(Y, T, U), f)
    if out.size:
        _put(e, T, out)
    K = e.tangent(one, Y, _given(e, given) if given.size else T, moduli)
    if e.constant is not None:
        K += e.constant
    e.add_to_band(K, flat, ld)


@kernel
def run_unsymmetric(e, u, v, flat, ld):
    """Add ``B(u)^T D (B(v) - B(u))`` to a matrix, entry (i, j) at ``flat[j * ld + i - j]``."""
    _, d, one, Y = e.at(u)
    B, change = e.derivatives(Y), e.derivatives(e.at(v)[3])
    K = B.transpose(0, 2, 1) @ (e.square(e.moduli_at(e.strain(d, one))) @ (change - B))
    j = np.arange(K.shape[1])
    at = (e.t.start[:, None, None] + j) * ld + j[:, None] - j
    flat += np.bincount(at.ravel(), K.ravel(), len(flat))


@kernel
def run_put(e, given):
    """Set the eigenstrains of a law with a history, minus ``given`` at the points."""
    if e.t.law.kind == HISTORY:
        e.now[:] = -given.reshape(e.now.shape)


@kernel
def run_eigen_force(e, u, v, given, f):
    """Change of the force at u, or with v of the mean from u to v, by eigenstrains."""
    # ``given`` are stresses for a linear law, else strains at the points, (3, points, ne). Laws
    # with a history have it in their strain, see :func:`run_put`.
    if e.t.law.kind == LINEAR:
        run_force(e, u, v, given, u[:0], f)
    elif e.t.law.kind != HISTORY:
        _, at, dd, Y = _moved(e, u, v)
        e.add(e.force(Y, e.stress(*_strain(e, at, dd, Y), given.reshape(3, -1, e.ne))), f)


@kernel
def run_eigen_tangent(e, u, given, flat, ld):
    """Change of the tangent at u by eigenstrains."""
    if e.t.law.kind == HISTORY:
        return
    _, d, one, Y = e.at(u)
    T, moduli = _given(e, given) if e.t.law.kind == LINEAR else None, None
    if T is None:
        strain, shift = e.strain(d, one), given.reshape(3, -1, e.ne)
        T, moduli = e.stress(strain, shift=shift), e.moduli_at(strain, shift)
    e.add_to_band(e.tangent(one, Y, T, moduli), flat, ld)


@kernel
def run_accept(e, u, v, out):
    """Set the history after an increment from u to v; add what it dissipates to ``out[0]``."""
    if e.t.law.kind == HISTORY:
        out[0] += e.accept(u, v)
