"""Equilibria in contact: a suitable start, then stiffening obstacles.

A belt that just does not touch its pulley has no transverse stiffness: the first correction is far
too large, and shorter ones close the contact at single points. At the start of a load step, points
near an obstacle are therefore bound to it in both directions (bilateral contact), as in a
primal-dual active set method with a large initial set (Hintermueller, Ito, Kunisch 2003). Then they
are released on an obstacle so soft that its pressure keeps all points in contact, then friction is
added, and the obstacle is stiffened step by step.

An obstacle of default stiffness is stiffened until the penetration is small and stores little
energy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from ..actions.contact.contacts import FIRMER, YIELDS, Contacts
from ..actions.contact.tables import ANCHORED, BILATERAL, LARGEST, MULTIPLIER, hardening
from ..core import Array

#: Distance of points that are bound at first, and range of the bond, relative to the height.
NEAR, FAR = 0.5, 1e3
#: Least fraction of the surface that is near an obstacle if points are bound.
PART = 0.03
#: Mean penetration after the release, relative to the height.
RELEASED = 0.1
#: Penetrations relative to the height, and relative stored energy, above which an obstacle is too
#: soft: deeper than the first, or deeper than the second with more energy.
DEEP, SEEN, STORED = 0.1, 0.02, 1e-3
#: Smallest target of the penetration, relative to the height.
LEAST = 1e-3
#: Target of penetration, energy and error, relative to their limits.
LEFT = 0.5
#: Largest stiffening factor in one step.
STEP = 30.0
#: Largest number of iterations close to the last equilibrium: directly, and from a soft start.
MOST_DIRECT, MOST_FROM_SOFT = 8, 15
#: Largest number of stiffenings in a load step, and of reductions of the factor.
TIMES, HALVED = 4, 2


def lies_near(contacts: Contacts, u: Array, t: float) -> list[Array] | None:
    """Flags of points near an obstacle by group; None if they are few, or already in contact."""
    flags, most, pressed = [], 0.0, 0.0
    for (_, group), _, gap in contacts.look(u, t):
        flags.append(gap < NEAR * group.height)
        whole = group.areas.sum()
        most = max(most, group.areas[flags[-1]].sum() / whole)
        pressed = max(pressed, group.areas[gap < 0.0].sum() / whole)
    return flags if most > PART and most > 2.0 * pressed else None


@contextmanager
def bound(contacts: Contacts, flags: list[Array]) -> Iterator[None]:
    """Bind flagged points to obstacles without friction inside the block."""
    memory = contacts.tables.memory
    before = memory.copy()
    try:
        memory[ANCHORED], memory[BILATERAL] = 0.0, 1.0
        for k, ((_, group), flag) in enumerate(zip(contacts.groups, flags)):
            pair = contacts.pair(k)
            far = FAR * group.height * hardening(pair)
            pair.memory[MULTIPLIER], memory[LARGEST + k] = far * flag, far
        yield
    finally:
        memory[:] = before


def soft(contacts: Contacts, u: Array, t: float) -> Array:
    """The firmness with which the mean pressure keeps all points in contact, shape (groups,)."""
    out = contacts.firmness.copy()
    for k, ((_, group), _, gap) in enumerate(contacts.look(u, t)):
        deep = np.maximum(-gap, 0.0)
        if np.any(deep):
            mean = group.areas @ deep / group.areas[deep > 0.0].sum()
            most = max(1.0, group.firmest / FIRMER)
            out[k] = min(most, (1.0 + out[k]) * mean / (RELEASED * group.height)) - 1.0
    return out


def firm(contacts: Contacts, u: Array, t: float, energy: float, yields: Array) -> Array:
    """The required firmness, shape (groups,); at least the present one."""
    # ``energy`` is the strain energy including that of the penetration, ``yields`` the result of
    # :meth:`~skfem_ancf.actions.contact.contacts.Contacts.yielding`.
    now, stored = contacts.firmness, contacts.potential(u, t)
    out, share = np.maximum(now, 0.0), stored / max(energy - stored, 1e-300)
    for k, ((_, group), _, gap) in enumerate(contacts.look(u, t)):
        part = (1.0 + now[k]) / (1.0 + out[k])  # penetration at this pressure and the new firmness
        deep, stores = -part * float(gap.min()) / group.height, part * share
        if deep > DEEP or (deep > SEEN and stores > STORED):
            more = max(deep / SEEN, min(stores / STORED, deep / LEAST)) / LEFT
            most = group.firmest / FIRMER
            out[k] = max(1.0, min(most, (1.0 + out[k]) * more)) - 1.0
        if yields[k] > YIELDS:
            more = min(group.firmest, (1.0 + now[k]) * yields[k] / (LEFT * YIELDS))
            out[k] = max(out[k], more - 1.0)
    return out


def search_contact(contacts: Contacts, start: tuple[Array, float], t: float,
                   solve: Callable[..., Any], energy: Callable[[Array], float],
                   respond: Callable[..., Any], failed: type[Exception],
                   close: bool = False, dragged: bool = False) -> Any:
    """An equilibrium in contact at the time t, from a displacement and its time."""
    # Obstacles have the contact history at the start of the load step. ``solve`` takes the last
    # equilibrium (None for the start), whether a rough one suffices, and the number of iterations;
    # it raises ``failed``. ``respond`` is that of ``contacts.yielding`` at an equilibrium. If the
    # start is ``close`` to the equilibrium, few iterations are tried.
    memory, before = contacts.tables.memory, contacts.tables.memory.copy()
    ramp = StiffnessRamp(contacts, start, t, solve, energy, respond, failed)

    def from_soft(most=None):
        # on soft obstacles contacts do not open and close one after the other: the correction that
        # moves one point out of the obstacle does not throw off its neighbours
        with contacts.without_friction(soft=True):
            found = solve(None, True)
        return solve(found, False, most)

    def released():  # rough, on soft obstacles, from points that are bound
        with bound(contacts, flags):
            found = solve(None, True)
        contacts.harden(soft(contacts, found[0], t), *start)
        if contacts.anchored:
            with contacts.without_friction():
                found = solve(found, True)
        return solve(found, True)

    def directly():
        try:
            return solve(None, False)
        except failed:
            if not contacts.anchored:
                raise
            with contacts.without_friction():
                found = solve(None, True)
            return solve(found, False)

    flags = None if close or dragged else lies_near(contacts, *start)
    ways: list[Callable[[], Any]] = [released] if flags is not None else []
    if dragged:  # which already stabilises the iteration
        ways = [directly]
    elif close:
        ways = [partial(solve, None, False, MOST_DIRECT), partial(from_soft, MOST_FROM_SOFT)]
    else:
        ways += [from_soft, directly]
    for way in ways:
        try:
            return ramp.climb(way(), rough=way is released)
        except failed:
            if way is ways[-1]:
                raise
            memory[:] = before


class StiffnessRamp:
    """Stiffens soft obstacles step by step; see :func:`search_contact`."""

    def __init__(self, contacts: Any, start: Any, t: float, solve: Any, energy: Any, respond: Any,
                 failed: Any) -> None:
        self.contacts, self.start, self.t, self.respond = contacts, start, t, respond
        self.solve, self.energy, self.failed = solve, energy, failed

    def climb(self, found: Any, rough: bool) -> Any:
        """The equilibrium on stiff obstacles, or the last one before a failure."""
        # ``rough``: ``found`` is one that is only a start.
        contacts = self.contacts
        for _ in range(0 if contacts.untouched(found[0]) else TIMES):
            u, yields = found[0], np.zeros(len(contacts.groups))
            if any(group.firmest > 1.0 for _, group in contacts.groups):
                yields = contacts.yielding(u, self.t, self.respond(found))
            wanted = firm(contacts, u, self.t, self.energy(u), yields)
            if np.all(wanted == contacts.firmness):
                break
            found, done, rough = self._to(wanted, found, rough)
            if not done:
                break
        return self.solve(found, False) if rough else found

    def _to(self, wanted, found, rough):
        """The equilibrium at a firmness or the last one before it; if reached; if it is rough."""
        contacts, step, fails = self.contacts, STEP, 0
        memory = contacts.tables.memory
        while True:
            before, now = memory.copy(), 1.0 + contacts.firmness
            more = np.clip((1.0 + wanted) / now, 1.0 / step, step)
            last = np.allclose(more * now, 1.0 + wanted, rtol=1e-9)
            contacts.harden(wanted if last else more * now - 1.0, *self.start)
            try:
                found = self.solve(found, not last)
            except self.failed:
                memory[:] = before
                step, fails = np.sqrt(step), fails + 1
                if fails > HALVED:
                    return found, False, rough
                continue
            rough = not last
            if last:
                return found, True, False
