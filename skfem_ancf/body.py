"""Forces, tangents and stresses of all beams of a scene."""

from typing import NamedTuple

import numpy as np

from .kernels.cable import (CablePack, cable_carry, cable_force, cable_mean, cable_stress,
                            cable_tangent)
from .kernels.section import (SectionPack, section_carry, section_force, section_mean,
                              section_stress, section_tangent)
from .source import lanes, primitive, source

#: Kinds of packs, by their number in a table.
PACKS = SectionPack, CablePack
SECTION, CABLE = range(2)
#: Columns of a table: kind, first coordinate and the one behind the last, first stress and the one
#: behind the last, and the shape of the stresses.
KIND, FIRST, LAST, STRESS, END, COMPONENTS, POINTS, ELEMENTS = range(8)


class Body(NamedTuple):
    """The beams of a scene, for the plain texts: packs, and a table with a row for each."""

    packs: tuple
    table: np.ndarray


class FlatBody(NamedTuple):
    """The same in three arrays, for compiled code: of one type, whatever the scene is.

    ``where[k, j]`` has offset and shape of field j of pack k, or its value if it is a number.
    """

    floats: np.ndarray
    ints: np.ndarray
    where: np.ndarray
    table: np.ndarray


@primitive("packs")
def section_pack(body, k):
    """The pack number k of sections."""
    return body.packs[k]


@primitive("packs")
def cable_pack(body, k):
    """The pack number k of a cable."""
    return body.packs[k]


def body_of(beams, slices):
    """The Body of beams with their slices of the coordinates."""
    packs, rows, at = [], [], 0
    for beam, s in zip(beams, slices):
        for pack, shape in beam.kernel.packs:
            size = int(np.prod(shape))
            packs.append(pack)
            rows.append([PACKS.index(type(pack)), s.start, s.stop, at, at + size, *shape])
            at += size
    return Body(tuple(packs), np.array(rows, dtype=np.int64))


def flat_body(body):
    """The FlatBody of a Body."""
    arrays = {"f": [], "i": []}
    used = {"f": 0, "i": 0}
    fields = max(len(kind._fields) for kind in PACKS)
    where = np.zeros((len(body.packs), fields, 4), dtype=np.int64)
    for k, pack in enumerate(body.packs):
        for j, value in enumerate(pack):
            if np.ndim(value) == 0:
                where[k, j, 0] = value
                continue
            kind = value.dtype.kind
            where[k, j, 0], where[k, j, 1:1 + value.ndim] = used[kind], value.shape
            arrays[kind].append(value.ravel())
            used[kind] += value.size
    return FlatBody(np.concatenate(arrays["f"]), np.concatenate(arrays["i"]), where, body.table)


def stress_size(body):
    """How many numbers the stresses of all integration points are."""
    return int(body.table[-1, END])


@source
def _stress(body, k, stresses):
    """The stresses of pack k, shape (components, points, elements), a view."""
    row = body.table[k]
    return stresses[row[STRESS]:row[END]].reshape(row[COMPONENTS], row[POINTS], row[ELEMENTS])


@source
def _clear(x):
    for i in lanes(x.size):
        x[i] = 0.0


@source
def body_force(body, u, f):
    """The internal force."""
    _clear(f)
    for k in range(body.table.shape[0]):
        a, b = body.table[k, FIRST], body.table[k, LAST]
        if body.table[k, KIND] == SECTION:
            section_force(section_pack(body, k), u[a:b], f[a:b])
        else:
            cable_force(cable_pack(body, k), u[a:b], f[a:b])


@source
def body_tangent(body, u, f, carried, use_carried, stresses, A):
    """The internal force, the lower half of the tangent, and the stresses.

    The loads complete it: :func:`~skfem_ancf.tables.add_load_stiffness`. The geometric part takes the stresses ``carried`` in place of these if ``use_carried``.
    """
    _clear(f)
    _clear(A.flat)
    flat = A.flat[A.top:]
    for k in range(body.table.shape[0]):
        a, b = body.table[k, FIRST], body.table[k, LAST]
        old, new = _stress(body, k, carried), _stress(body, k, stresses)
        if body.table[k, KIND] == SECTION:
            section_tangent(section_pack(body, k), u[a:b], f[a:b], old, use_carried, new, flat,
                            A.ld, a)
        else:
            cable_tangent(cable_pack(body, k), u[a:b], f[a:b], old, use_carried, new, flat, A.ld,
                          a)


@source
def body_stress(body, u, stresses):
    """The stresses at u."""
    for k in range(body.table.shape[0]):
        a, b = body.table[k, FIRST], body.table[k, LAST]
        if body.table[k, KIND] == SECTION:
            section_stress(section_pack(body, k), u[a:b], _stress(body, k, stresses))
        else:
            cable_stress(cable_pack(body, k), u[a:b], _stress(body, k, stresses))


@source
def body_carry(body, u, du, stresses, carried):
    """The stresses, linearised, at u + du, from those at u."""
    for k in range(body.table.shape[0]):
        a, b = body.table[k, FIRST], body.table[k, LAST]
        old, new = _stress(body, k, stresses), _stress(body, k, carried)
        if body.table[k, KIND] == SECTION:
            section_carry(section_pack(body, k), u[a:b], du[a:b], old, new)
        else:
            cable_carry(cable_pack(body, k), u[a:b], du[a:b], old, new)


@source
def body_mean(body, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the strain energy."""
    _clear(f)
    for k in range(body.table.shape[0]):
        a, b = body.table[k, FIRST], body.table[k, LAST]
        if body.table[k, KIND] == SECTION:
            section_mean(section_pack(body, k), u0[a:b], u1[a:b], f[a:b])
        else:
            cable_mean(cable_pack(body, k), u0[a:b], u1[a:b], f[a:b])
