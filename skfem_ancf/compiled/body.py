"""Forces and tangents of all beams of a scene.

Cables and beams are given as packs and the coordinates (k, 2) of each, first and behind the last.
Numba leaves out what a scene has not, given as None.
"""

import numpy as np
from numba.typed import List

from .beam import beam_increment, beam_loop, beam_mean
from .cable import cable_increment, cable_loop, cable_mean, cable_stress
from .jit import inner, jit, spliced


@jit
def new_list(item):
    """A typed list; made here, so that its code is compiled once and kept."""
    items = List()
    items.append(item)
    return items


@jit
def append(items, item):
    """Add to a typed list."""
    items.append(item)


@spliced
def body_force(cables, beams, u, f, none, flat):
    """The internal force."""
    f[:] = 0.0
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            cable_loop(packs[k], u[a:b], f[a:b], False, False, none, False, none, flat, 1, 0)
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            beam_loop(packs[k], u[a:b], f[a:b], False, False, none, False, none, flat, 1, 0)


@spliced
def body_mean(cables, beams, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the energy."""
    f[:] = 0.0
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            cable_mean(packs[k], u0[a:b], u1[a:b], f[a:b])
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            beam_mean(packs[k], u0[a:b], u1[a:b], f[a:b])


@spliced
def body_tangent(cables, beams, u, f, geometric, carried, use_carried, stresses, flat, ld):
    """The internal force, the tangent into the band, and the stresses."""
    f[:] = 0.0
    flat[:] = 0.0
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b, s = at[k, 0], at[k, 1], stresses[0][k]
            cable_loop(packs[k], u[a:b], f[a:b], True, geometric, carried[0][k], use_carried, s,
                       flat, ld, a)
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b, s = at[k, 0], at[k, 1], stresses[1][k]
            beam_loop(packs[k], u[a:b], f[a:b], True, geometric, carried[1][k], use_carried, s,
                      flat, ld, a)


@inner
def _law(stiffness, strain, before):
    """In place of the strain the stress, added to the one before if there is one."""
    for e in range(strain.shape[1]):
        for p in range(strain.shape[2]):
            x, y, z = strain[0, e, p], strain[1, e, p], strain[2, e, p]
            for c in range(3):
                S = stiffness[c, 0] * x + stiffness[c, 1] * y + stiffness[c, 2] * z
                strain[c, e, p] = S + before[c, e, p] if before.size > 0 else S


@inner
def scale_add(strain, stiffness, before):
    """In place of a cable's strain the stress, added to the one before."""
    for c in range(2):
        for e in range(strain.shape[1]):
            for p in range(strain.shape[2]):
                strain[c, e, p] = stiffness[c] * strain[c, e, p] + before[c, e, p]


@spliced
def carry(cables, beams, u, du, stresses, out):
    """The stresses, linearised, at u + du."""
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            S, stiffness = out[0][k], packs[k][7]
            cable_increment(packs[k], u[a:b], du[a:b], S)
            scale_add(S, stiffness, stresses[0][k])
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            S = out[1][k]
            beam_increment(packs[k], u[a:b], du[a:b], S)
            _law(packs[k][5], S, stresses[1][k])


@spliced
def body_stress(cables, beams, u, out):
    """The stresses at u."""
    none = np.empty((0, 0, 0))
    if cables is not None:
        packs, at = cables
        for k in range(len(packs)):
            cable_stress(packs[k], u[at[k, 0]:at[k, 1]], out[0][k])
    if beams is not None:
        packs, at = beams
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            S = out[1][k]
            beam_increment(packs[k], 0.5 * u[a:b], u[a:b], S)  # the strain is quadratic
            _law(packs[k][5], S, none)
