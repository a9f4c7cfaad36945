"""Forces, tangents and stresses of all beams of a scene."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..core import I1, I2, Array, add_multiple, cached_property, clear, primitive, source
from .beam import Beam
from .kernels.elements import (Elements, run_accept, run_eigen_force, run_eigen_tangent, run_force,
                               run_linearised, run_put, run_tangent, run_unsymmetric)
from .kernels.kernel import ElementsWithHistory, Past, elements_of, remembering
from .kernels.tables import CABLE, LINEAR, StrainTables, repeated, scaled, together

#: Columns of the table of a body: begin and end of stresses; kind.
BEGIN, END, KIND = range(3)


class Body:
    """The beams of a scene: their :class:`StrainTables`, and a table with a row for each. A
    ``kernel`` has the same tables."""

    def __init__(self, packs: Sequence[StrainTables], table: Any, kernel: Any = None,
                 elements: Sequence[Elements] | None = None) -> None:
        self.packs, self.table, self._kernel = tuple(packs), table, kernel
        if elements is not None:
            vars(self)["elements"] = elements

    @cached_property
    def elements(self) -> Sequence[Elements]:
        """Their :class:`~skfem_ancf.beam.kernels.elements.Elements`."""
        return list(map(elements_of, self.packs)) if self._kernel is None else self._kernel.elements

    def after(self, past: Past) -> "Body":
        """A copy whose elements have views of a history."""
        return Body(self.packs, self.table, elements=remembering(self.elements, past))

    def elastic_from(self, u: Array) -> "Body":
        """A copy whose laws with a history are elastic from their stress at u (N,)."""
        return Body(self.packs, self.table, elements=[
            e.elastic_from(u) if isinstance(e, ElementsWithHistory) else e for e in self.elements])


class FlatBody(NamedTuple):
    """A Body for compiled code, with the addresses of the tables' words."""

    packs: I1
    table: I2


@primitive("skfem_ancf.equations.loops")
def tables_of(body, k):
    """The Elements number k, or their StrainTables in compiled code."""
    return body.elements[k]


def body_of(beams: Sequence["Beam"], slices: Sequence[slice], joined: bool = False) -> Body:
    """The Body of beams with their slices of DOFs."""
    # With ``joined``, tables with the same samples are merged, so that many short beams are as fast
    # as a long one.
    if len(beams) == 1:
        return _body([beams[0].kernel.tables], beams[0].kernel)
    tables = [[t._replace(start=t.start + s.start) for t in beam.kernel.tables]
              for beam, s in zip(beams, slices)]
    if joined:
        groups: dict[Any, list[StrainTables]] = {}
        # left nodes of a table are unique: tables of one beam stay separate
        for k, (j, t) in enumerate(pair for its in tables for pair in enumerate(its)):
            key = t.pattern, t.G.shape[1:], len(t.C) > 0, t.weights.shape[1], t.along.tobytes()
            groups.setdefault((j, key) if t.law.kind == LINEAR else k, []).append(t)
        tables = [[together(some) for some in groups.values()]]
    return _body(tables)


def eigenstrain_body_of(beams: Sequence["Beam"], slices: Sequence[slice]) -> Body:
    """The Body of eigenstrains: stresses for tables of linear laws, else strains at the points."""
    return _body([[t._replace(start=t.start + s.start) for t in beam.kernel.tables]
                  for beam, s in zip(beams, slices)], at_points=True)


def _body(tables, kernel=None, at_points=False):
    rows, at = [], 0
    flat = tuple(t for its in tables for t in its)
    for t in flat:
        kind, number = t.pattern.kind, t.pattern.ns
        if at_points and t.law.kind != LINEAR:
            number = (1 if kind == CABLE else 3) * t.weights.shape[1]
        size = number * len(t.start)
        rows.append([at, at + size, kind])
        at += size
    return Body(flat, np.array(rows, np.int64).reshape(-1, KIND + 1), kernel)


def viscous_body_of(body: Body, beams: Sequence["Beam"], times: Sequence[float]) -> Body:
    """The Body of viscous stresses for the beams' retardation times; ``body`` if all are zero."""
    # Stresses have the same positions as in ``body``.
    packs: list[StrainTables] = []
    rows, first = [], 0
    for beam, time in zip(beams, times):
        last = first + len(beam.kernel.tables)
        if time > 0.0:
            packs += [scaled(t, time)._replace(start=own.start) for t, own in zip(
                beam.kernel.tables, body.packs[first:last])]
            rows += list(body.table[first:last])
        first = last
    return Body(tuple(packs), np.array(rows)) if packs else body


def copies_of(body: Body, n: int, N: int) -> Body:
    """The Body of n copies of the beams, with an offset of N between their DOFs; without tangents.
    Few elements are faster in one call."""
    table = body.table.copy()
    table[:, [BEGIN, END]] *= n
    return Body(tuple(repeated(t, n, N) for t in body.packs), table)


def stress_size(body: Body) -> int:
    return int(body.table[-1, END]) if len(body.table) else 0


@source
def quadratic(body):
    """True if all strains are quadratic in the DOFs, which holds for sections."""
    for k in range(body.table.shape[0]):
        if body.table[k, KIND] == CABLE:
            return False
    return True


@source
def _stress(body, k, stresses):
    """View of the stresses of table k."""
    return stresses[body.table[k, BEGIN]:body.table[k, END]] if stresses.size > 0 else stresses


@source
def _add_force(body, u0, u1, given, out, f):
    """Add forces and write stresses of all tables, see :func:`~.kernels.elements.run_force`."""
    for k in range(body.table.shape[0]):
        run_force(tables_of(body, k), u0, u1, _stress(body, k, given), _stress(body, k, out), f)


@source
def body_force(body, u, f):
    clear(f)
    _add_force(body, u, u[:0], u[:0], u[:0], f)


@source
def body_tangent(body, u, f, independent, use_independent, stresses, A):
    """Internal force, lower half of the tangent without loads, and stresses."""
    # The geometric part uses the independent stresses if ``use_independent``.
    clear(f)
    clear(A.flat)
    given = independent if use_independent else independent[:0]
    for k in range(body.table.shape[0]):
        run_tangent(tables_of(body, k), u, _stress(body, k, given), _stress(body, k, stresses), f,
                    A.flat[A.top:], A.ld)


@source
def body_stress(body, u, stresses):
    _add_force(body, u, u[:0], u[:0], stresses, u[:0])


@source
def body_mean_stress(body, copies, weights, stresses, out):
    """Weighted mean of the stresses of copies."""
    clear(out)
    for k in range(body.table.shape[0]):
        all_of_them, mean = _stress(copies, k, stresses), _stress(body, k, out)
        for j in range(weights.size):
            add_multiple(weights[j], all_of_them[j * mean.size:(j + 1) * mean.size], mean)


@source
def body_linearised(body, u, du, stresses, independent):
    """Stresses at u plus their linearised change by du."""
    for k in range(body.table.shape[0]):
        run_linearised(tables_of(body, k), u, du, _stress(body, k, stresses),
                       _stress(body, k, independent), u[:0])


@source
def add_viscous_stress(viscous, body, copies, k, u, v, scratch, out):
    """Add the viscous stresses to those of copy k; ``scratch`` is (2, s), its first row zero."""
    clear(scratch[1])
    body_linearised(viscous, u, v, scratch[0], scratch[1])
    for j in range(body.table.shape[0]):
        one, all_of_them = _stress(body, j, scratch[1]), _stress(copies, j, out)
        add_multiple(1.0, one, all_of_them[k * one.size:(k + 1) * one.size])


@source
def add_viscous_force(body, u, v, f):
    for k in range(body.table.shape[0]):
        run_linearised(tables_of(body, k), u, v, u[:0], u[:0], f)


@source
def body_mean(body, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the strain energy."""
    clear(f)
    _add_force(body, u0, u1, u0[:0], u0[:0], f)


@source
def body_mixed(body, mean, u0, u1, f, independent, stresses):
    """As :func:`body_force` at u1, or :func:`body_mean`, but for independent stresses."""
    # The stresses of the strain are written.
    clear(f)
    _add_force(body, u0 if mean else u1, u1 if mean else u1[:0], independent, stresses, f)


@source
def add_force_of(body, u, stresses, f):
    _add_force(body, u, u[:0], stresses, u[:0], f)


@source
def accept_body(body, u0, u1, out):
    """Set the histories after an increment from u0 to u1; add what it dissipates to ``out[0]``."""
    for k in range(body.table.shape[0]):
        run_accept(tables_of(body, k), u0, u1, out)


@source
def add_unsymmetric(body, u, v, U):
    """Add ``B(u)^T D (B(v) - B(u))`` to an unsymmetric band matrix."""
    for k in range(body.table.shape[0]):
        run_unsymmetric(tables_of(body, k), u, v, U.flat[U.top:], U.ld)


@source
def put_eigenstrains(body, given):
    """Set the eigenstrains of laws with a history, minus ``given``."""
    for k in range(body.table.shape[0]):
        run_put(tables_of(body, k), _stress(body, k, given))


@source
def add_eigen_force(body, u, v, given, f):
    """Add the change by eigenstrains of the force at u, or with v of the mean from u to v."""
    for k in range(body.table.shape[0]):
        run_eigen_force(tables_of(body, k), u, v, _stress(body, k, given), f)


@source
def add_eigen_tangent(body, u, given, flat, ld):
    """Add the change of the tangent at u to a lower half."""
    for k in range(body.table.shape[0]):
        run_eigen_tangent(tables_of(body, k), u, _stress(body, k, given), flat, ld)
