"""The force elements of a scene: tables of known kinds, and user-defined elements."""

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from scipy import sparse

from ...core import Array, constant
from ..contact.contacts import NO_CONTACTS, Contacts, matched, take_over
from ..contact.tables import HAS_ENTRIES, SAFE, SEARCHED, SEEN, clear_table, set_clear
from ..bound import BoundForce, Remembering, is_like, positions, recalled
from .springs import TorsionalSpring
from .inertia import RotatingFrame
from .kernels import (ALONG_PUSHING, DERIVATIVES, DRAG, ELASTIC, ENTRIES, KINDS, NUMBERS, PUSHING,
                      RESISTING, SETTLED, TORSION, TURNED, ForceTables, Rested, coordinates,
                      element_stiffness, kinds_of, of_kinds, rests, vectors_of)


#: Relative size of forces of an item that are round-off.
SMALL = 1e-6
#: The derivatives of elements that depend on their first vector.
FIRST = np.array([[0, 0, 1, 1], [0, 1, 0, 1]])
NONE = np.zeros(0, dtype=np.int64)


class Forces:
    """The bound force elements of a scene; ``custom`` are those of no kind that kernels know, as
    solvers see them, ``changing`` those with a pattern that changes, with their DOFs, and
    ``remembering`` those with a memory.

    ``couples_far``: an element couples DOFs outside the band, or, where ``places`` (N,) are given,
    with places that differ by more than 1. ``symmetric``: all derivatives are symmetric.
    ``resists``: there are velocity-dependent forces. ``masses`` contribute to the mass matrix;
    ``contacts`` are the obstacles. ``clear`` and ``rested`` are tables of
    :func:`~skfem_ancf.actions.forces.kernels.rests`. ``blocks`` are the numbers of the derivatives
    of each element.
    """

    #: The vectors are ``start + B u``: the start, and the rows, DOFs and weights of B.
    _vectors: Any = np.zeros(0), NONE, NONE, np.zeros(0)
    #: Rows, columns, weights and derivatives of the entries of the stiffness.
    _entries: Any = NONE, NONE, np.zeros(0), NONE
    #: Whether their element has one outside the band: then it is in the border of the band. Of that
    #: the rows, of B, rows, columns, weights and derivatives of its entries, and positions and
    #: numbers of the derivatives between its rows.
    _in_border = NONE > 0
    border_entries = _entries
    _border: Any = NONE, NONE
    #: Of a scene without elements.
    masses: Any = ()
    elements = custom = changing = remembering = parts = blocks = _springs = _slices = masses
    _paired: Any = masses
    _searches = _paired
    pairs: Any = NONE
    rows = size = paired = 0
    couples_far = resists = False
    symmetric = True
    contacts = Contacts((), 0)
    #: Entries of the last tangent of a step: rows, columns and values. Those of the last tangent of
    #: changing elements, and what they were computed from.
    kept: Any = NONE, NONE, np.zeros(0)
    _last: Any = None, ()

    def __init__(self, elements: Sequence[BoundForce], N: int, bandwidth: int,
                 places: Array | None = None) -> None:
        self._N, self._bandwidth, self.border_rows = N, bandwidth, np.zeros((0, N))
        if not elements:
            self.clear, self.rested = np.zeros(SEEN + 2 * N), nowhere(N)
            return
        self.masses = [e for e in elements if e.mass_entries() is not None]
        self.elements = [e.with_masses(self.masses, N) if isinstance(e, RotatingFrame) else e
                         for e in elements]
        self._sort()
        n = len(self.parts)
        # of each element its links, the rows of their components in the vectors (those of the parts
        # side by side), two of these for each derivative, and the numbers of the derivatives
        blocks: list[Any] = []
        for k, part in enumerate(self.parts):
            a, b = np.divmod(np.arange(16), 4) if part.kind == TORSION else FIRST
            blocks.append(((part.d, part.e), k + n * np.arange(4), a, b, k + n * (4 * a + b)))
        self.blocks = [k + n * np.arange(16).reshape(4, 4) for k in range(n)]
        row, at = 4 * n, 16 * n
        self._slices = []
        for element in self.custom:
            m = 2 * len(element.links)
            dense = element.entries is None
            a, b = (NONE, NONE) if element.changing else np.divmod(
                np.arange(m * m), m) if dense else element.entries
            numbers = at + np.arange(len(a))
            if not element.changing:
                self.blocks.append(numbers.reshape(m, m) if dense else numbers)
            self._slices.append((slice(row, row + m), slice(at, at + len(a))))
            blocks.append((element.links, row + np.arange(m), a, b, numbers))
            row, at = row + m, at + len(a)
        self.rows, self.size = row, at
        if blocks:
            self._couple(blocks, places)
        weights = np.zeros((2, N // 2))
        for element, dofs in self.changing:
            if hasattr(element, "least_gap"):
                at = dofs[::2] // 2
                weights[:, at] = np.maximum(weights[:, at], element.weights)
        self._pair()
        self.clear, self.rested, u = clear_table(weights), nowhere(N), np.zeros(N)
        if self.changing:
            # of those that do not tell their gap none is known
            gaps = [e.least_gap(u[at].reshape(-1, 2)) if hasattr(e, "least_gap") else 0.0
                    for e, at in self.changing]
            set_clear(self.clear, u, 0.5 * SAFE * min(gaps))
            self.clear[SEARCHED] = sum(pair.found[1] for pair in self.pairs)
        self.couples_far = bool(len(self.border_rows) or self.changing)
        self.symmetric = all(e.symmetric for e in self.elements)
        # those of user-defined laws first, then in the order of the parts
        self._springs = sorted((e for e in self.elements if isinstance(e, TorsionalSpring)),
                               key=lambda e: -1 if e in self.custom else self.rows_of(e)[0])
        self.contacts = Contacts(self.elements, N, len(self._springs))
        self.resists = (any(e.resists for e in self.custom)
                        or any(any(part.numbers[int(part.kind != DRAG):2]) for part in self.parts)
                        or any(one.damping > 0.0 for one in self.contacts.obstacles))

    def _sort(self):
        """Sort elements into parts that the kernels know, by kind, and the user's, by pattern."""
        parts = list[Any]()
        self.custom, self.changing, self.remembering = list[Any](), list[Any](), list[Any]()
        for element in self.elements:
            found = element.parts()
            if found is not None:
                parts += found
                continue
            one = recalled(element)
            if element.changing:
                self.changing.append((one, element.all_dofs))
            if not hasattr(element, "broad_search"):
                self.custom.append(one)
            if isinstance(one, Remembering):
                self.remembering.append(one)
        order = sorted(range(len(parts)), key=lambda k: parts[k].kind)
        self.parts = [parts[k] for k in order]
        self._place = np.argsort(order) if order else np.zeros(0, np.int64)

    def _pair(self, fresh=False):
        """Set the tables of contact of members; ``fresh`` with a search of their own."""
        self._paired = [(e, at) for e, at in self.changing if hasattr(e, "broad_search")]
        self._searches = [e.broad_search.fresh() if fresh else e.broad_search
                          for e, _ in self._paired]
        self.pairs = tuple(
            search.tables._replace(used=at[::2] // 2, history=e.values)
            for search, (e, at) in zip(self._searches, self._paired)) or NONE
        self.paired = len(self.pairs)

    def _couple(self, blocks, places):
        """Find the vectors, ``start + B u``, and the entries of all derivatives by two of them."""
        start, vectors, pairs = np.zeros(self.rows), [], []
        for k, (links, rows, a, b, numbers) in enumerate(blocks):
            for link, both in zip(links, rows.reshape(-1, 2)):
                start[both] = link.start
                vectors.append((np.repeat(both, link.dofs.shape[1]), link.dofs.ravel(),
                                link.weights.ravel()))
            pairs.append((rows[a], rows[b], numbers, np.full(len(a), k)))
        i, j, weights = map(np.concatenate, zip(*vectors))
        self._vectors = start, i.astype(np.int64), j.astype(np.int64), weights
        B = sparse.csr_array((weights, (i, j)), shape=(self.rows, self._N))
        a, b, number, block = map(np.concatenate, zip(*pairs))
        # each nonzero of row a with each of row b
        first, many = B.indptr[:-1].astype(np.int64), np.diff(B.indptr).astype(np.int64)
        size = many[a] * many[b]
        pair = np.repeat(np.arange(len(a)), size)
        p, q = np.divmod(np.arange(len(pair)) - np.repeat(np.cumsum(size) - size, size),
                         many[b][pair])
        p, q = first[a][pair] + p, first[b][pair] + q
        i, j = (B.indices[x].astype(np.int64) for x in (p, q))
        off = np.abs(i - j) > self._bandwidth
        if places is not None:
            off |= np.abs(places[i] - places[j]) > 1
        far = np.bincount(block[pair], off, len(blocks)) > 0.0
        self._entries = i, j, B.data[p] * B.data[q], number[pair]
        self._in_border = far[block[pair]]
        i, j, weights, number_of = (x[self._in_border] for x in self._entries)
        self.border_entries = i, j, weights, number_of
        out = far[block]
        rows, at = np.unique([a[out], b[out]], return_inverse=True)
        a, b = at.reshape(2, -1)
        self._border, self.border_rows = (len(rows) * a + b, number[out]), B[rows].toarray()

    def after(self, memory: Array, pasts: Sequence[tuple[Array, Array]]) -> "Forces":
        """A copy with a history of obstacles and springs, and pasts of items, which it uses."""
        other, new = copy(self), [one.after(*past) for one, past in zip(self.remembering, pasts)]
        of = dict(zip(map(id, self.remembering), new))
        other.remembering, other.custom = new, [of.get(id(e), e) for e in self.custom]
        other.changing = [(of.get(id(e), e), at) for e, at in self.changing]
        other._pair(fresh=True)
        other.clear, other.rested = self.clear.copy(), Rested(*(x.copy() for x in self.rested))
        if memory.size:
            other.contacts = self.contacts.after(memory)
        return other

    def tables(self, position: Any, symmetric: bool, handle: int) -> ForceTables:
        """The tables for kernels."""
        if not self.elements:
            return NO_FORCES
        (start, at, of, weight), (i, j, w, number) = self._vectors, self._entries
        keep = ~self._in_border & ((i >= j) | (not symmetric))
        kinds = np.array([part.kind for part in self.parts], dtype=np.int64)
        numbers = np.array([part.numbers for part in self.parts]).reshape(-1, NUMBERS)
        return ForceTables(
            start, at, of, weight, len(self.parts),
            np.searchsorted(kinds, np.arange(KINDS + 1)).astype(np.int64),
            np.ascontiguousarray(numbers.T), self.size,
            position(i[keep], j[keep]).astype(np.int64), number[keep], w[keep],
            self._border[0], self._border[1],
            handle if self.custom or self.changing else 0, self.contacts.tables,
            len(self.changing), self.clear, self.paired, self.pairs, self.rested)

    def acting_rows(self, u: Array, t: float) -> tuple[Array, Array]:
        """Derivatives of positions of concentrated elements, and forces of items, (k, N) each."""
        rows, own, N = [], [np.zeros((0, self._N))], self._N
        known = {id(getattr(e, "element", e)): e for e in self.custom}
        for element in self.elements:
            if element.of_item is None:
                if not (element.distributed or element.internal):
                    rows += [link.row(n, N) for link in element.links for n in np.eye(2)]
                continue
            # it acts where its force at u, the derivatives of that and its mass do
            found, e = [], known.get(id(element))
            if e is not None:
                x, at = positions(e, u), element.all_dofs
                for K in (e.force(x, 0.0 * x, t), e.stiffness(x, 0.0 * x, t),
                          e.resistance(x, 0.0 * x, t)):
                    found.append(np.zeros((N, 1 if np.shape(K) == x.shape else x.size)))
                    found[-1][at] = K.toarray() if sparse.issparse(K) else np.reshape(
                        K, (x.size, -1))
            if (mass := element.mass_entries()) is not None:
                M = sparse.csc_array((mass[2], mass[:2]), shape=(N, N))
                found.append(M[:, np.unique(mass[1])].toarray())
            columns = np.hstack([K / (np.abs(K).max() or 1.0) for K in found])
            at = np.flatnonzero(np.any(columns != 0.0, axis=1))
            U, sizes, _ = np.linalg.svd(columns[at], full_matrices=False)
            own.append(np.zeros((np.sum(sizes > SMALL * sizes.max(initial=0.0)), N)))
            own[-1][:, at] = U.T[:len(own[-1])]
            own[-1][np.abs(own[-1]) < SMALL] = 0.0
        return np.array(rows).reshape(-1, self._N), np.concatenate(own)

    # values

    def potential(self, tables: ForceTables, u: Array, t: float = 0.0) -> float:
        """Potential of all elements; zero for those without one."""
        y, p = np.empty(self.rows), tables.numbers
        vectors_of(tables, u, 1.0, y)
        q = coordinates(kinds_of(tables), y[:4 * tables.number].reshape(4, -1))
        self.recall()
        return float(0.5 * np.sum(p[0] * q**2 * (1.0 - p[4] * (q < 0.0)))) + (
            self.contacts.potential(u, t)) + sum(
            element.potential_at(y[rows].reshape(-1, 2), t) or 0.0
            for element, (rows, _) in zip(self.custom, self._slices)) + (
            0.0 if self._at_rest(u) else sum(
                element.potential_at(u[at].reshape(-1, 2), t) or 0.0
                for element, at in self._paired))

    @property
    def sampled(self) -> list[Any]:
        """Controls with a sampling time."""
        return [e for e in self.remembering if hasattr(e.element, "sample")]

    def rows_of(self, element: BoundForce) -> Array:
        """Positions of the parts of an element among all, in its order; shape (n,)."""
        first = 0
        for other in self.elements:
            n = len(other.parts() or ())
            if other is element:
                return self._place[first:first + n]
            first += n
        return self._place[:0]

    def part_forces(self, tables: ForceTables, u: Array, v: Array) -> Array:
        """Resisting force on the first vector of each part, shape (2, parts)."""
        n, y, w, out = len(self.parts), np.empty(self.rows), np.empty(self.rows), np.zeros(
            (2, self.rows))
        vectors_of(tables, u, 1.0, y)
        vectors_of(tables, v, 0.0, w)
        if n:
            kinds = kinds_of(tables)
            of_kinds(kinds, np.int64(ELASTIC), y, y, 0.0, out[0])
            of_kinds(kinds, np.int64(RESISTING), y, w, 0.0, out[1])
        return out.sum(axis=0)[:2 * n].reshape(2, n)

    def small_part_forces(self, tables: ForceTables, t: float, base: Array, d: Array) -> Array:
        """:meth:`part_forces` of elements on single points at rest, linearised."""
        n, w = len(self.parts), np.empty(self.rows)
        vectors_of(tables, d, 0.0, w)
        D = self.stiffness(tables, t, base, 0.0 * base, 0.0)[:16 * n].reshape(4, 4, n)
        return self.part_forces(tables, base, 0.0 * base) + np.einsum(
            "ijk,jk->ik", D[:2, :2], w[:2 * n].reshape(2, n))

    def recall(self) -> None:
        """Tell the torsional springs the angles of the history data."""
        for spring, angle in zip(self._springs, self.contacts.turns):
            spring._last = float(angle)

    def settle(self, u0: Array, u: Array, t: float) -> float:
        """Update the history data at the end of an increment from u0 to u; returns lost work."""
        self.recall()  # the angles are less than half a turn from the last ones
        self.contacts.turns[:] = [one.coordinate(np.array([link(u) for link in one.links]))[0]
                                  for one in self._springs]
        return self.contacts.settle(u, t) + sum(
            item.settle(u0, u, t) for item in self._at_work(u0, u))

    def _at_work(self, *displacements):
        """The elements with a memory, without changing ones that do nothing at displacements."""
        idle = self._at_rest(*displacements)
        return [item for item in self.remembering if not (idle and item.changing)]

    def take_over(self, other: "Forces", u: Array, t: float) -> bool:
        """Set the history to that of equal parts of another scene at u, t; True if there are any.
        """
        items = [*matched(self.remembering, other.remembering, lambda a, b: a.same(b), is_like)]
        for item, one in items:
            item.take_over(one)
        turns, springs = self.contacts.turns, [*matched(
            enumerate(self._springs), enumerate(other._springs),
            lambda a, b: np.array_equal(a[1].key, b[1].key))]
        for (k, spring), (j, one) in springs:
            turns[k] = other.contacts.turns[j] + one._start - spring._start
        return take_over(self.contacts, other.contacts, u, t) or bool(items or springs)

    def stiffness(self, tables: ForceTables, t: float, u: Array, v: Array,
                  factor: float) -> Array:
        """Derivatives by the vectors, shape (size,)."""
        D = np.zeros(self.size)
        element_stiffness(tables, t, u, v, factor, D)
        return D

    def entries(self, tables: ForceTables, t: float, u: Array, v: Array,
                factor: float) -> tuple[Array, Array, Array]:
        """The stiffness in the DOFs: rows, columns and values."""
        D = self.stiffness(tables, t, u, v, factor)
        i, j, w, place = self._entries
        touched = self.contacts.entries(t, u, self._bandwidth)
        parts = (i, j, w * D[place]), touched, self.changing_entries(t, u, u, v, factor)
        return tuple(np.concatenate(x) for x in zip(*parts))  # type: ignore[return-value]

    # elements with a pattern that changes

    def _at_rest(self, *displacements: Array) -> bool:
        """True if it is known that they do nothing at displacements (N,), nor between these."""
        return all(rests(self, u, 0.0) for u in displacements)

    def changing_entries(self, t: float, u0: Array, u1: Array, v: Array | None = None,
                         factor: float = 0.0) -> tuple[Array, Array, Array]:
        """Rows, columns and values (k,) of the stiffness of changing elements, of the mean force
        between two displacements if these are two arrays. Plus a factor times the resistance."""
        found: list[Any] = [(NONE, NONE, np.zeros(0))]
        if self._at_rest(u0, u1):
            return found[0]
        # a line search, and products, ask at the displacements of the last factors
        by = np.concatenate([u0, u1, [t, factor, u0 is u1], [] if v is None else v, *(
            x for one in self.remembering for x in (one.values, one.span))])
        if np.array_equal(by, self._last[1]):
            return self._last[0]
        for element, at in self.changing:
            x, y = (u[at].reshape(-1, 2) for u in (u0, u1))
            w = 0.0 * x if v is None else v[at].reshape(-1, 2)
            K = element.stiffness(x, w, t) if u0 is u1 else element.mean_stiffness(x, y, t)
            if element.resists and factor != 0.0:
                K = K + factor * element.resistance(0.5 * (x + y), w, t)
            K = sparse.coo_array(K)
            found.append((at[K.row], at[K.col], -K.data))
        self._last = tuple(np.concatenate(x) for x in zip(*found)), by
        return self._last[0]

    def corrected(self, u: Array, t: float) -> bool:
        """Change histories with which an increment is to be repeated; True if there are any."""
        return bool(self.remembering) and sum(
            element.correct(u, t) for element in self._at_work(u)) > 0

    def passed(self, a: tuple[Array, float], b: tuple[Array, float]) -> str | None:
        """Why a step must not lead from a displacement and time to others, or None."""
        if text := self.contacts.passed(a, b):
            return text
        if not self.changing or self._at_rest(a[0], b[0]):
            return None
        for element, at in self.changing:
            if text := element.passed(*(u[at].reshape(-1, 2) for u in (a[0], b[0])), b[1]):
                return text
        return None

    def moves_far(self, u: Array) -> Array:
        """True for steps between displacements (n + 1, N) that may lead through an element."""
        weights = self.clear[SEEN + self._N:].reshape(2, 1, -1)
        moved = np.max(weights * np.abs(np.diff(u, axis=0).view(complex)), axis=2).sum(axis=0)
        return moved >= min(getattr(element, "near", 0.0) for element, _ in self.changing)

    def add_custom(self, what: int, t: float, factor: float, a: Array, b: Array,
                out: Array) -> None:
        """Evaluate user-defined elements, for :func:`skfem_ancf.core.callbacks.call_custom`."""
        # a and b are positions or, for SETTLED, a step's start and its end with velocities; from
        # PUSHING on displacements (N,), of elements with a pattern that changes alone
        if what == ENTRIES:
            i, j, values = self.changing_entries(t, a, a if np.array_equal(a, b) else b)
            self.kept, self.clear[HAS_ENTRIES] = (i, j, factor * values), float(len(i) > 0)
            return
        if what == ALONG_PUSHING:
            i, j, values = self.changing_entries(t, a, a)
            out[0] += values @ (b[i] * b[j])
        if what >= PUSHING:
            for element, at in self.changing:
                x, y = (u[at].reshape(-1, 2) for u in (a, b))
                if what == ALONG_PUSHING:
                    out[1] = max(out[1], element.search_intervals(x, x + y))
                elif not hasattr(element, "broad_search"):
                    out[at] -= np.ravel(element.force(x, 0.0 * x, t))
            return
        self.recall()
        for element, (rows, places) in zip(self.custom, self._slices):
            x, y = a[rows].reshape(-1, 2), b[rows].reshape(-1, 2)
            remembers = isinstance(element, Remembering)
            if what == ELASTIC:
                out[rows] -= np.ravel(element.mean_force(x, y, t, *[factor] * remembers))
            elif what == RESISTING and element.resists and np.any(y):
                out[rows] -= np.ravel(np.asarray(element.force(x, y, t))
                                      - element.force(x, 0.0 * y, t))
            elif what == TURNED and isinstance(element, TorsionalSpring):
                self.contacts.turns[self._springs.index(element)] = element.coordinate(x)[0]
            elif what == SETTLED and remembers:
                out[0] += element.accept(x, y, b[len(a):][rows].reshape(-1, 2), t)
            elif what == DERIVATIVES and not element.changing:
                found = np.array(element.stiffness(x, y, t))
                if element.resists and factor != 0.0:
                    found = found + factor * np.asarray(element.resistance(x, y, t))
                out[places] -= found.ravel()


_X, _I = np.zeros(0), np.zeros(0, np.int64)


def nowhere(N: int) -> Rested:
    """No displacement at which anything is known."""
    return Rested(np.zeros((2, N)), -np.ones(2), np.zeros(1, np.int64))


#: For scenes without force elements.
NO_FORCES = constant(ForceTables(
    _X, _I, _I, _X, 0, np.zeros(KINDS + 1, np.int64), np.zeros((NUMBERS, 0)), 0, _I, _I, _X, _I,
    _I, 0, NO_CONTACTS, 0, _X, 0, _I, nowhere(0)))
