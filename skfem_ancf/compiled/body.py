"""Forces and tangents of all beams of a scene.

Cables and beams are given as packs and the coordinates (k, 2) of each, first and behind the last.
Numba leaves out what a scene has not, given as None.
"""

from numba.typed import List

from .beam import beam_carry, beam_loop, beam_mean, beam_stress
from .cable import cable_carry, cable_loop, cable_mean, cable_stress
from .jit import jit, spliced


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


# of one kind of beam, which may be None


@spliced
def _forces(loop, part, u, f, none, flat):
    if part is not None:
        packs, at = part
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            loop(packs[k], u[a:b], f[a:b], False, False, none, False, none, flat, 1, 0)


@spliced
def _tangents(loop, part, u, f, geometric, carried, use_carried, stresses, flat, ld):
    if part is not None:
        packs, at = part
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            loop(packs[k], u[a:b], f[a:b], True, geometric, carried[k], use_carried, stresses[k],
                 flat, ld, a)


@spliced
def _means(mean, part, u0, u1, f):
    if part is not None:
        packs, at = part
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            mean(packs[k], u0[a:b], u1[a:b], f[a:b])


@spliced
def _carries(carry, part, u, du, stresses, out):
    if part is not None:
        packs, at = part
        for k in range(len(packs)):
            a, b = at[k, 0], at[k, 1]
            carry(packs[k], u[a:b], du[a:b], stresses[k], out[k])


@spliced
def _stresses(stress, part, u, out):
    if part is not None:
        packs, at = part
        for k in range(len(packs)):
            stress(packs[k], u[at[k, 0]:at[k, 1]], out[k])


# of all beams


@spliced
def body_force(cables, beams, u, f, none, flat):
    """The internal force."""
    f[:] = 0.0
    _forces(cable_loop, cables, u, f, none, flat)
    _forces(beam_loop, beams, u, f, none, flat)


@spliced
def body_mean(cables, beams, u0, u1, f):
    """The force whose work from u0 to u1 is the change of the energy."""
    f[:] = 0.0
    _means(cable_mean, cables, u0, u1, f)
    _means(beam_mean, beams, u0, u1, f)


@spliced
def body_tangent(cables, beams, u, f, geometric, carried, use_carried, stresses, flat, ld):
    """The internal force, the tangent into the band, and the stresses."""
    f[:] = 0.0
    flat[:] = 0.0
    _tangents(cable_loop, cables, u, f, geometric, carried[0], use_carried, stresses[0], flat, ld)
    _tangents(beam_loop, beams, u, f, geometric, carried[1], use_carried, stresses[1], flat, ld)


@spliced
def body_carry(cables, beams, u, du, stresses, out):
    """The stresses, linearised, at u + du."""
    _carries(cable_carry, cables, u, du, stresses[0], out[0])
    _carries(beam_carry, beams, u, du, stresses[1], out[1])


@spliced
def body_stress(cables, beams, u, out):
    """The stresses at u."""
    _stresses(cable_stress, cables, u, out[0])
    _stresses(beam_stress, beams, u, out[1])
