"""Equilibria in contact: from a start that holds what lies on an obstacle, and hard enough.

A belt that just does not touch its pulley has no stiffness across: the first correction throws it
far off, and what shortens it brings back single points. So bodies that lie beside an obstacle at
the begin of a load step are first held there, pulled as well as pushed, as a belt is by a groove;
then let go, on an obstacle so soft that the pressure found presses all points in; then there is
friction, and last the obstacle is hardened step by step. Each is close to the next. It begins as a
primal-dual active set method does (Hintermueller, Ito, Kunisch 2003) to which all that lies near
is active.

An obstacle of the default stiffness is hardened until the body lies on it, and not in it: what the
penetration stores is by how much the whole is too compliant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..actions.contact.contacts import Contacts
from ..actions.contact.tables import ANCHORED, BILATERAL, LARGEST, MULTIPLIER, hardening
from ..core.types import Array

#: How near a point lies that is held at first, and how far it is held, relative to the height.
NEAR, FAR = 0.5, 1e3
#: Part of the surface that lies near where points are held.
PART = 0.03
#: The mean penetration of what is let go, relative to the height.
LET_GO = 0.1
#: Penetration, relative to the height, and energy of it, relative to all other, up to which an
#: obstacle is hard enough: what is deeper than the first, or than the second and stores more.
DEEP, SEEN, STORED = 0.1, 0.02, 1e-3
#: What is not asked for, relative to the height: what lies flat stores nothing else.
LEAST = 1e-3
#: What the harder one is to leave of each.
LEFT = 0.5
#: By how much obstacles are made harder at once.
RUNG = 30.0
#: Iterations of an equilibrium that is close to the last one, at most: at once, and from a start.
AT_ONCE, SOON = 8, 15
#: Times that they are found too soft in a load step at most, and that what is done at once is less.
TIMES, HALVED = 4, 2


def lies_near(contacts: Contacts, u: Array, t: float) -> list[Array] | None:
    """Points of each group that lie on an obstacle, or near it; None if they are few, or press."""
    flags, most, pressed = [], 0.0, 0.0
    for (_, group), _, gap in contacts.look(u, t):
        flags.append(gap < NEAR * group.height)
        whole = group.areas.sum()
        most = max(most, group.areas[flags[-1]].sum() / whole)
        pressed = max(pressed, group.areas[gap < 0.0].sum() / whole)
    return flags if most > PART and most > 2.0 * pressed else None


@contextmanager
def held(contacts: Contacts, flags: list[Array]) -> Iterator[None]:
    """While it is open, flagged points of groups stay on obstacles, without friction."""
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
    """The firmness with which the mean pressure presses all points in, shape (groups,)."""
    out = contacts.firmness.copy()
    for k, ((_, group), _, gap) in enumerate(contacts.look(u, t)):
        deep = np.maximum(-gap, 0.0)
        if np.any(deep):
            mean = group.areas @ deep / group.areas[deep > 0.0].sum()
            out[k] = min(group.firmest, (1.0 + out[k]) * mean / (LET_GO * group.height)) - 1.0
    return out


def firm(contacts: Contacts, u: Array, t: float, energy: float) -> Array:
    """The firmness that leaves the body on the obstacles, shape (groups,); not less than it is.

    ``energy`` is the strain energy, with that of the penetration.
    """
    now, stored = contacts.firmness, contacts.potential(u, t)
    out, share = np.maximum(now, 0.0), stored / max(energy - stored, 1e-300)
    for k, ((_, group), _, gap) in enumerate(contacts.look(u, t)):
        part = (1.0 + now[k]) / (1.0 + out[k])  # what this pressure leaves if it is not harder
        deep, stores = -part * float(gap.min()) / group.height, part * share
        if deep > DEEP or (deep > SEEN and stores > STORED):
            more = max(deep / SEEN, min(stores / STORED, deep / LEAST)) / LEFT
            out[k] = max(1.0, min(group.firmest, (1.0 + out[k]) * more)) - 1.0
    return out


def found_touching(contacts: Contacts, start: tuple[Array, float], t: float,
                   solve: Callable[..., Any], energy: Callable[[Array], float],
                   failed: type[Exception], close: bool = False) -> Any:
    """An equilibrium in contact at the time t, from a displacement and its time.

    The obstacles have the memory of the begin of the load step; at its end that of its end, if
    they had to be harder. ``solve`` is a function of what has been found, or None for the begin,
    of whether a start is wanted only, and of iterations at most; it raises ``failed``. ``close``:
    the start is close to what is looked for: few iterations tell.
    """
    before = contacts.tables.memory.copy()
    climb = _Climb(contacts, start, t, solve, energy, failed)
    ways = [_at_once, _soon] if close else [_let_go, _from_soft, _directly]
    flags = lies_near(contacts, *start)
    for way in ways:
        if way is _let_go and flags is None:
            continue
        try:
            return climb.up(way(climb, flags))
        except failed:
            if way is ways[-1]:
                raise
            contacts.tables.memory[:] = before


def _at_once(climb, _):
    """What is found in few iterations."""
    return climb.solve(None, False, AT_ONCE)


def _soon(climb, flags):
    """As :func:`_from_soft`, in few iterations."""
    return _from_soft(climb, flags, SOON)


def _from_soft(climb, _, most=None):
    """What is found from the equilibrium on soft obstacles without friction.

    There points come and go one after the other no longer: the correction that presses one out of
    the obstacle does not throw off those beside it.
    """
    with climb.contacts.eased(soft=True):
        found = climb.solve(None, True)
    return climb.solve(found, False, most)


def _let_go(climb, flags):
    """What is found from bodies that are held, on obstacles that are soft."""
    contacts = climb.contacts
    with held(contacts, flags):
        found = climb.solve(None, True)
    contacts.harden(soft(contacts, found[0], climb.t), *climb.start)
    if contacts.anchored:
        with contacts.eased():  # no friction
            found = climb.solve(found, True)
    return climb.solve(found, True)


def _directly(climb, _):
    """What is found without more ado; where that fails, from obstacles without friction."""
    try:
        return climb.solve(None, False)
    except climb.failed:
        if not climb.contacts.anchored:
            raise
        with climb.contacts.eased():
            found = climb.solve(None, True)
        return climb.solve(found, False)


class _Climb:
    """From obstacles that are soft to those that are hard enough; see :func:`found_touching`."""

    def __init__(self, contacts, start, t, solve, energy, failed):
        self.contacts, self.start, self.t = contacts, start, t
        self.solve, self.energy, self.failed = solve, energy, failed

    def up(self, found):
        """What is found there, or on the way to it, where that ends."""
        contacts = self.contacts
        for _ in range(TIMES):
            wanted = firm(contacts, found[0], self.t, self.energy(found[0]))
            if np.all(wanted == contacts.firmness):
                break
            found, done = self._to(wanted, found)
            if not done:
                break
        return found

    def _to(self, wanted, found):
        """What is found there, or last on the way, and whether it is there."""
        contacts, rung, fails = self.contacts, RUNG, 0
        memory = contacts.tables.memory
        while True:
            before, now = memory.copy(), 1.0 + contacts.firmness
            more = np.clip((1.0 + wanted) / now, 1.0 / rung, rung)
            last = np.allclose(more * now, 1.0 + wanted, rtol=1e-9)
            contacts.harden(wanted if last else more * now - 1.0, *self.start)
            try:
                found = self.solve(found, not last)
            except self.failed:
                memory[:] = before
                rung, fails = np.sqrt(rung), fails + 1
                if fails > HALVED:
                    return found, False
                continue
            if last:
                return found, True
