"""Forces, tangents and stresses of all beams of a scene."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.band import clear, copy
from .kernels.base import (CARRY, FORCE, GIVEN, GRADIENTS, MEAN, STRESS, TANGENT, TURNED, VISCOUS,
                           Destination, add_changes, add_pushes, add_scaled, repeated)
from .kernels.cable import CablePack, cable_evaluate
from .kernels.section import SectionPack, section_evaluate
from ..core.source import I1, I2, primitive, shaped, source

if TYPE_CHECKING:
    from .beam import Beam

#: Kinds of packs, by their number in a table.
PACKS = SectionPack, CablePack
SECTION, CABLE = range(2)
#: Columns of a table: kind, first coordinate and the one behind the last, first stress and the one
#: behind the last, the shape of the stresses, coordinates of an element, and first gradient and the
#: one behind the last.
(KIND, FIRST, LAST, BEGIN, END, COMPONENTS, POINTS, ELEMENTS, SPAN, BEGIN_GRADIENTS,
 END_GRADIENTS) = range(11)


class Body(NamedTuple):
    """The beams of a scene, for the plain texts: packs, and a table with a row for each."""

    packs: tuple
    table: I2


class FlatBody(NamedTuple):
    """The same for compiled code, of one type, whatever the scene is.

    Attributes
    ----------
    packs
        Addresses of the packs' words, see :mod:`skfem_ancf.equations.compiled.records`.
    table
        As of the Body.
    """

    packs: I1
    table: I2


@primitive("packs")
def section_pack(body, k):
    """The pack number k of sections."""
    return body.packs[k]


@primitive("packs")
def cable_pack(body, k):
    """The pack number k of a cable."""
    return body.packs[k]


def body_of(beams: Sequence["Beam"], slices: Sequence[slice],
            own: Sequence[Sequence[Any]] | None = None) -> "Body":
    """The Body of beams with their slices of the coordinates.

    Parameters
    ----------
    beams, slices
        The beams, and the coordinates of each.
    own
        The packs of each; those of its kernel by default.
    """
    packs, rows, at, place = [], [], 0, 0
    for beam, s, its in zip(beams, slices, own or [beam.kernel.packs for beam in beams]):
        for pack in its:
            shape = beam.kernel.texts.components, len(pack.weights), len(pack.start)
            size = shape[0] * shape[1] * shape[2]
            packs.append(pack)
            n = 2 * size * len(pack.span)
            rows.append([PACKS.index(type(pack)), s.start, s.stop, at, at + size, *shape,
                         len(pack.span), place, place + n])
            at, place = at + size, place + n
    table = np.array(rows, np.int64) if rows else np.zeros((0, END_GRADIENTS + 1), np.int64)
    return Body(tuple(packs), table)


def viscous_body_of(body: "Body", beams: Sequence["Beam"], times: Sequence[float]) -> "Body":
    """The Body of what resists the rates of strains; ``body`` itself where nothing does.

    Parameters
    ----------
    body, beams
        What :func:`body_of` has made of the beams; the stresses have the same places.
    times
        Retardation time of each beam.
    """
    packs, rows, first = [], [], 0
    for beam, time in zip(beams, times):
        last = first + len(beam.kernel.packs)
        if time > 0.0:
            packs += beam.kernel.viscous_packs(time)
            rows += list(body.table[first:last])
        first = last
    return Body(tuple(packs), np.array(rows)) if packs else body


def copies_of(body: "Body", n: int, N: int) -> "Body":
    """The Body of ``n`` times the same beams, whose coordinates are one behind the other.

    What takes few elements at a time takes less than n times as long for them. There are no
    tangents of it: they would be n times as long.

    Parameters
    ----------
    body
        What :func:`body_of` has made.
    n, N
        How often, and the number of all coordinates.
    """
    table = body.table.copy()
    table[:, LAST] += (n - 1) * N
    table[:, [BEGIN, END, ELEMENTS]] *= n
    return Body(tuple(repeated(pack, n, N) for pack in body.packs), table)


def stress_size(body: "Body") -> int:
    """How many numbers the stresses of all integration points are."""
    return int(body.table[-1, END]) if len(body.table) else 0


def gradients_size(body: "Body") -> int:
    """How many numbers :func:`body_gradients` finds."""
    return int(body.table[-1, END_GRADIENTS]) if len(body.table) else 0


@source
def quadratic(body):
    """True if all strains are quadratic in the coordinates: those of sections are."""
    for k in range(body.table.shape[0]):
        if body.table[k, KIND] == CABLE:
            return False
    return True


@source
def _stress(body, k, stresses):
    """The stresses of pack k, shape (components, points, elements), a view; or of none."""
    row = body.table[k]
    if stresses.size == 0:
        return shaped(stresses, (np.int64(0), row[POINTS], row[ELEMENTS]))
    return shaped(stresses[row[BEGIN]:row[END]], (row[COMPONENTS], row[POINTS], row[ELEMENTS]))


@source
def _written(body, k, what, out):
    """Where pack k writes: its stresses, or two gradients of each for each coordinate."""
    row = body.table[k]
    if what == GRADIENTS:
        return shaped(out[row[BEGIN_GRADIENTS]:row[END_GRADIENTS]],
                      (2 * row[SPAN] * row[COMPONENTS], row[POINTS], row[ELEMENTS]))
    return _stress(body, k, out)


@source
def _gradients(body, k, gradients):
    """What :func:`body_gradients` has found for pack k, (2, elements, stresses, coordinates)."""
    row = body.table[k]
    return shaped(gradients[row[BEGIN_GRADIENTS]:row[END_GRADIENTS]],
                  (np.int64(2), row[ELEMENTS], row[COMPONENTS] * row[POINTS], row[SPAN]))


@source
def evaluate_body(body, what, u, v, f, given, use_given, out, flat, ld):
    """What :func:`~skfem_ancf.beam.kernels.section.section_evaluate` does, for all beams.

    The tangent goes to an array in which columns begin every ``ld`` entries.
    """
    for k in range(body.table.shape[0]):
        a, b = body.table[k, FIRST], body.table[k, LAST]
        old = _stress(body, k, given if use_given > 0 else given[:0])
        new = _written(body, k, what, out)
        to = Destination(flat, ld, a)
        if body.table[k, KIND] == SECTION:
            section_evaluate(section_pack(body, k), what, u[a:b], v[a:b], f[a:b], old, new, to)
        else:
            cable_evaluate(cable_pack(body, k), what, u[a:b], v[a:b], f[a:b], old, new, to)


@source
def body_force(body, u, f):
    """The internal force."""
    clear(f)
    none = f[:0]
    evaluate_body(body, np.int64(FORCE), u, u, f, none, np.int64(0), none, none, np.int64(0))


@source
def body_tangent(body, u, f, carried, use_carried, stresses, A):
    """The internal force, the lower half of the tangent, and the stresses.

    The loads complete it: :func:`~skfem_ancf.actions.tables.add_load_stiffness`. The geometric part
    takes the stresses ``carried`` in place of these if ``use_carried``.
    """
    clear(f)
    clear(A.flat)
    evaluate_body(body, np.int64(TANGENT), u, u, f, carried, np.int64(use_carried), stresses,
                  A.flat[A.top:], A.ld)


@source
def body_stress(body, u, stresses):
    """The stresses at u."""
    evaluate_body(body, np.int64(STRESS), u, u, u, stresses, np.int64(0), stresses,
                  u, np.int64(0))


@source
def body_mean_stress(body, copies, weights, stresses, out):
    """The mean stresses of copies, with weights."""
    clear(out)
    for k in range(body.table.shape[0]):
        all_of_them, mean = _stress(copies, k, stresses), _stress(body, k, out)
        size = mean.shape[2]
        for j in range(weights.size):
            add_scaled(weights[j], all_of_them[:, :, j * size:(j + 1) * size], mean, mean)


@source
def body_carry(body, u, du, stresses, carried):
    """The stresses, linearised, at u + du, from those at u."""
    evaluate_body(body, np.int64(CARRY), u, du, u, stresses, np.int64(1), carried,
                  u, np.int64(0))


@source
def add_viscous_stress(viscous, body, copies, k, u, v, rooms, out):
    """Add the stresses in proportion to the rates of the strains, to those of copy k.

    ``rooms``, shape (2, s), is room, of which the first row is zero.
    """
    clear(rooms[1])
    evaluate_body(viscous, np.int64(CARRY), u, v, u, rooms[0], np.int64(1), rooms[1], u,
                  np.int64(0))
    for j in range(body.table.shape[0]):
        one, all_of_them = _stress(body, j, rooms[1]), _stress(copies, j, out)
        size = one.shape[2]
        its = all_of_them[:, :, k * size:(k + 1) * size]
        add_scaled(1.0, one, its, its)


@source
def add_viscous_force(body, u, v, f):
    """Add the force of stresses in proportion to the rates of the strains."""
    none = f[:0]
    evaluate_body(body, np.int64(VISCOUS), u, v, f, none, np.int64(0), none, none, np.int64(0))


@source
def body_mean(body, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the strain energy."""
    clear(f)
    none = f[:0]
    evaluate_body(body, np.int64(MEAN), u0, u1, f, none, np.int64(0), none, none, np.int64(0))


@source
def body_mixed(body, mean, u0, u1, f, carried, stresses):
    """As :func:`body_force` at u1, or :func:`body_mean`, but of carried stresses.

    The stresses of the strain are written.
    """
    clear(f)
    evaluate_body(body, np.int64(MEAN if mean else FORCE), u0 if mean else u1, u1, f, carried,
                  np.int64(1), stresses, f, np.int64(0))


@source
def add_force_of(body, u, stresses, f):
    """Add the force at u of given stresses."""
    none = f[:0]
    evaluate_body(body, np.int64(GIVEN), u, u, f, stresses, np.int64(1), none, none, np.int64(0))


@source
def body_gradients(body, u, gradients):
    """The derivatives of the strains at u, times weights, and of the stresses, of each element."""
    none = u[:0]
    evaluate_body(body, np.int64(GRADIENTS), u, u, u, none, np.int64(0), gradients, none,
                  np.int64(0))


@source
def body_tangent_by(body, u, stresses, gradients, A):
    """As :func:`body_gradients`, and the lower half of the tangent at these stresses."""
    clear(A.flat)
    evaluate_body(body, np.int64(GRADIENTS), u, u, u, stresses, np.int64(1), gradients,
                  A.flat[A.top:], A.ld)


@source
def _starts(body, k):
    """The first coordinate of each element of pack k, in those of its beam."""
    if body.table[k, KIND] == SECTION:
        return section_pack(body, k).start
    return cable_pack(body, k).start


@source
def carry_by(body, copies, gradients, du, stresses, carried):
    """As :func:`body_carry`, of copies, by the gradients of the body."""
    copy(stresses, carried)
    for k in range(body.table.shape[0]):
        B, new = _gradients(body, k, gradients)[1], _stress(copies, k, carried)
        add_changes(B, _starts(copies, k), du[copies.table[k, FIRST]:copies.table[k, LAST]], new)


@source
def add_force_by(body, copies, gradients, stresses, f):
    """As :func:`add_force_of`, of copies, by the gradients of the body."""
    for k in range(body.table.shape[0]):
        B, given = _gradients(body, k, gradients)[0], _stress(copies, k, stresses)
        add_pushes(B, _starts(copies, k), given, f[copies.table[k, FIRST]:copies.table[k, LAST]])


@source
def add_turned(body, u, v, U):
    """Add ``B(u)^T D (B(v) - B(u))`` to a matrix in two halves."""
    none = u[:0]
    evaluate_body(body, np.int64(TURNED), u, v, u, none, np.int64(0), none, U.flat, U.ld)
