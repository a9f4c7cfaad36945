"""Strategies where an iteration finds nothing or takes long: descent from an unstable point, search
in contact, and the scene without contact.

In contact: a suitable start, then stiffening obstacles. A belt that just does not touch its pulley
has no transverse stiffness: the first correction is far too large, and shorter ones close the
contact at single points. At the start of a load step, points near an obstacle are therefore bound
to it in both directions (bilateral contact), as in a primal-dual active set method with a large
initial set (Hintermueller, Ito, Kunisch 2003). Then they are released on an obstacle so soft that
its pressure keeps all points in contact, then friction is added, and the obstacle is stiffened step
by step.

An obstacle of default stiffness is stiffened until the penetration is small and stores little
energy.
"""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse.linalg import eigsh

from ..actions.contact.contacts import LARGEST_FACTOR, YIELDS
from ..actions.contact.tables import ANCHORED, BILATERAL, is_clear, stiffness_factor
from ..actions.forces.kernels import nothing_touches
from ..actions.forces.springs import Turns
from ..beam.kinematics import tangents
from ..core import NO_FACTORS, Array, ConvergenceError, handle_of
from ..core.band import fix
from ..equations.evaluation import motion_is_clear
from ..equations.stability import (inverse_on_positions, largest_displacement, position_weights,
                                   response, verdict)
from ..equations.system import System
from .iteration import Equilibrium, LoadStepFailed, TooManyIterations, StaticResult

logger = logging.getLogger(__name__)

#: Initial trust-region radii, relative to the scene's size, in the order of attempts.
RADII = (0.1, 0.02, 0.004)
#: First displacement along a negative direction, relative to the scene's size.
KICK = 0.02
#: Size of small corrections, number of consecutive small ones that indicates a stall at an unstable
#: point, and number of inverse iterations for the softest direction.
SMALL, STALLED, POWERS = 1e-3, 4, 4
#: Iterations of a descent, and over those of Newton's method at its end.
DESCENT, SHORTER = 200, 7
#: Largest radius, and displacement that counts as diverged, relative to the scene's size.
WIDEST, LOST = 0.5, 20.0
#: Number of iterations between stored displacements; smallest cosine between successive changes
#: and smallest change, relative to the scene's size, of a motion without end.
BACK, ONWARD, AWAY = 50, 0.5, 0.01
#: How often a correction through an obstacle is halved.
HALVED = 8


def near_limit(system: System, start: StaticResult) -> bool:
    """True if the last equilibrium is much more compliant than the reference configuration."""
    if start.load == 0.0:
        return False
    descent, none, ratio = Descent(system), np.zeros(system.constraints.m), []
    try:
        for u, multipliers, at in ((start.u, start.multipliers, start.load),
                                   (np.zeros(system.N), none, 0.0)):
            system.assemble(u, at)
            system.solver.factorize(u, at, multipliers)
            ratio.append(max(0.0, descent.extreme("LA")[0]))
    except NO_FACTORS:
        return True
    return ratio[0] > 8.0 * ratio[1]


class Descent:
    """A trust-region method that minimises the potential. A multiple of the identity (in scaled
    DOFs) is added to the tangent until it is positive definite and the correction is within a
    radius (Levenberg-Marquardt; Conn, Gould, Toint: Trust-Region Methods (2000), 7.3), which starts
    as ``radius``, the largest change of a scaled DOF. It is halved if corrections reverse, and
    grows to five times that if they continue. Close to a minimum nothing is added: Newton's method.
    ``saw_unstable`` is True once a direction of negative curvature was met."""

    def __init__(self, system: System, radius: float = RADII[0]) -> None:
        self.system, self.saw_unstable, self.handle = system, False, handle_of(self)
        self._weights = position_weights(system)
        self._sizes = system.constraints.coordinate_sizes
        self._radius, self._largest = radius, min(5.0 * radius, WIDEST)
        #: multiple of the identity in the last tangent, 0 for that of Newton's method
        self.shift = 0.0
        self._before = np.zeros(system.N)
        self._small = self._calls = 0
        self._passed: list[Array] = []

    def onward(self) -> tuple[Array, Array] | None:
        """The displacement and its last change (N,) of a motion without end; else None."""
        if len(self._passed) < 3:
            return None
        last, before = self._passed[-1] - self._passed[-2], self._passed[-2] - self._passed[-3]
        along, far = self.product(last, before), AWAY * self.system.size
        if largest_displacement(self.system, last) < far or along < ONWARD * np.sqrt(
                self.product(last, last) * self.product(before, before)):
            return None
        return self._passed[-1], last

    def solve_into(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                   dm: Array) -> None:
        """Solve for a correction within a kernel."""
        if np.max(np.abs(u / self._sizes)) > LOST:
            raise np.linalg.LinAlgError("the iteration diverges")
        self._calls += 1
        if self._calls % BACK == 0:
            self._passed.append(u.copy())
        found = self._bounded(lambda: self.system.solver.factorize(u, t, multipliers), R, phi)
        if found is None:
            raise np.linalg.LinAlgError("no shift suffices")
        small = (self.shift > 0.0 and np.max(np.abs(found[0] / self._sizes)) < SMALL
                 and not self.system.constraints.missing_supports)  # no rigid motion
        self._small = self._small + 1 if small else 0
        du[:], dm[:] = found
        if self._small == STALLED:  # leave an unstable point along the softest direction
            v, none = du, np.zeros(self.system.constraints.m)
            for _ in range(POWERS):
                v = self.system.solver.solve(v / self._sizes**2, none)[0]
                v = v / (np.max(np.abs(v / self._sizes)) or 1.0)
            du += KICK * (v if R @ v >= 0.0 else -v)
            self._small = 0
        for _ in range(HALVED):  # until nothing passes through an obstacle
            if self.system.forces.passed((u, t), (u + du, t)) is None:
                break
            du *= 0.5
            dm *= 0.5
        now, before = du / self._sizes, self._before
        along = now @ before / (np.sqrt(now @ now * (before @ before)) or 1.0)
        if along < -0.2:
            self._radius *= 0.5
        elif along > 0.3:
            self._radius = min(1.5 * self._radius, self._largest)
        self._before = now

    def _bounded(self, factorize, R, phi):
        """The correction with the smallest shift that suffices, to a factor of ten."""
        band, system = self.system.K, self.system
        fix(band, system.constraints.fixed)
        tangent = band.flat.copy()
        scale = max(np.mean(np.abs(system.K.diagonal()) * self._sizes**2 * system.constraints.mask),
                    np.max(np.abs(R * self._sizes)))

        def correction(shift):
            band.flat[:] = tangent
            if shift > 0.0:
                system.K.add_diagonal(shift * system.constraints.mask / self._sizes**2)
            try:
                factorize()
                du, dm = system.solver.solve(R, phi)
                # slipping friction has no potential: the correction must do positive work
                down = system.solver.inertia().negative == 0 if system.symmetric else R @ du >= 0.0
            except NO_FACTORS:
                return None
            self.saw_unstable = self.saw_unstable or (shift <= least and not down)
            return (du, dm) if down and np.max(np.abs(du / self._sizes)) <= self._radius else None

        least = 1e-14 * scale
        # of a rigid motion the stiffness may be round-off, of any sign
        free = bool(system.constraints.missing_supports)
        found, shift = correction(free * least), max(self.shift, 100.0 * least)
        if found is not None:
            self.shift = 0.0
            return found
        found, grown = correction(shift), False
        while found is None and shift < 1e6 * scale:
            shift, grown = 10.0 * shift, True
            found = correction(shift)
        while found is not None and not grown and shift > 10.0 * least:
            less = correction(0.1 * shift)
            if less is None:
                break
            found, shift = less, 0.1 * shift
        self.shift = shift
        return found

    def product(self, a: Array, b: Array) -> float:
        """Scalar product of nodal displacements (N,)."""
        return float(a @ (self._weights * b))

    def extreme(self, which: str) -> tuple[float, Array]:
        """The smallest ("SA") or largest ("LA") eigenvalue of K^-1 on the nodal positions, and the
        displacement (N,) by its vector of forces; by the last factors."""
        inverse, G = inverse_on_positions(self.system)
        if not G.shape[0]:
            return 0.0, np.zeros(self.system.N)
        if isinstance(G, np.ndarray):
            values, Y = np.linalg.eigh(0.5 * (G + G.T))
        else:
            start = G @ np.random.default_rng(0).standard_normal(G.shape[0])
            values, Y = eigsh(G, k=1, which=which, v0=start)
        k = 0 if which == "SA" else -1
        return float(values[k]), inverse(Y[:, k])


def descend(increment: Any, options: Any, descent: Descent) -> Equilibrium:
    """A stable equilibrium at a load beyond which the path is unstable."""
    # Corrections of :class:`Descent` start from the last stable equilibrium. An unstable point is
    # left along its lowest direction, towards the last stable equilibrium, or to the lower
    # potential.
    system, start, load = increment.system, increment.start, increment.load
    u, multipliers = start.u, start.multipliers
    for _ in range(6):  # unstable points that it may leave
        try:
            found = increment.iterate((u, multipliers), options, descent)
        except TooManyIterations as failure:
            # at its end Newton's method is better, where a mode is very soft
            if descent.shift > 0.0 or system.forces.contacts.obstacles or system.forces.changing:
                raise  # far from the end, or where it may leave what is touched
            found = increment.iterate(failure.found, options._replace(
                method="newton", most=options.most // SHORTER))
        u, multipliers = found.u, found.multipliers
        if verdict(system, u, load, multipliers, increment.time).stability != "unstable":
            return found
        descent.saw_unstable = True
        value, v = descent.extreme("SA")
        if value >= 0.0:  # the unstable direction does not move the nodes
            break
        v = KICK * system.size / np.max(np.abs(v)) * v
        ahead = descent.product(v, start.u - u)
        if not abs(ahead) > 1e-6 * descent.product(v, v):  # across the way back
            turns = Turns(system)
            near = turns.begin(u)
            here, up, down = (  # total potentials
                system.strain_energy(x, load) + load * system.load_potential(
                    x, turned=turns.follow(near, x[None])[0]) for x in (u, u + v, u - v))
            ahead = down - up
            if not abs(ahead) > 1e-6 * abs(up + down - 2.0 * here):  # symmetric: either side
                ahead = v[np.argmax(np.abs(v) > 0.5 * np.max(np.abs(v)))]
        u = u + (v if ahead > 0 else -v)
    raise LoadStepFailed("no stable equilibrium found along the unstable directions")


#: Tolerance of an equilibrium that is only a start.
CLOSE = 1e-2
#: Distance of points that are bound at first, and range of the bond, relative to the height.
NEAR, FAR = 0.5, 1e3
#: Least fraction of the surface that is near an obstacle if points are bound.
PART = 0.03
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
TIMES, RETRIED = 4, 2


class ContactSearch:
    """The search for an equilibrium in contact at the end of an increment. Obstacles have the
    contact history at its start."""

    def __init__(self, increment: Any) -> None:
        start, options = increment.start, increment.options
        self.increment, self.contacts = increment, increment.system.forces.contacts
        self.start, self.t = (start.u, options.route.load_and_time(start.load)[1]), increment.time
        self._memory = self.contacts.tables.memory

    def find(self) -> Equilibrium:
        """The equilibrium on obstacles that are stiff enough."""
        options, before = self.increment.options, self._memory.copy()
        ways: list[Callable[[], Any]]
        if options.drag is not None:  # which already stabilises the iteration
            ways = [self._directly]
        elif options.close:  # to the equilibrium: few iterations are tried
            ways = [partial(self.solve, None, False, MOST_DIRECT),
                    partial(self._from_soft, MOST_FROM_SOFT)]
        else:
            ways = [self._released, self._from_soft, self._directly]
        *first, last = ways
        for strategy in first:
            try:
                return self._stiffened(strategy(), strategy == self._released)
            except LoadStepFailed:
                self._memory[:] = before
        return self._stiffened(last(), False)

    def solve(self, begin: Any, rough: bool, most: int | None = None) -> Equilibrium:
        """Iterate from an equilibrium, None for the start; a ``rough`` one is only a start."""
        options = self.increment.options
        chosen = options._replace(most=min(options.most, most or options.most))
        if rough:
            chosen = options._replace(rough=max(options.tol, CLOSE), patience=MOST_FROM_SOFT)
        if begin is None:
            return self.increment.from_start(chosen)
        return self.increment.iterate(begin, chosen)

    def _from_soft(self, most=None):
        # on soft obstacles contacts do not open and close one after the other: the correction that
        # moves one point out of the obstacle does not throw off its neighbours
        with self.contacts.without_friction(soft=True):
            found = self.solve(None, True)
        forces = self.increment.system.backend.tables.plain.forces
        return found if nothing_touches(forces, found.u) else self.solve(found, False, most)

    def _released(self):
        """Rough, on soft obstacles, from points near them that are bound."""
        contacts, (u, t), flags, near, pressed = self.contacts, self.start, [], 0.0, 0.0
        if not is_clear(contacts.tables.clear, u,
                        NEAR * max(group.height for _, group in contacts.groups)):
            for (_, group), _, gap in contacts.look(u, t):
                flags.append(gap < NEAR * group.height)
                whole = group.areas.sum()
                near = max(near, group.areas[flags[-1]].sum() / whole)
                pressed = max(pressed, group.areas[gap < 0.0].sum() / whole)
        if near <= max(PART, 2.0 * pressed):
            raise LoadStepFailed("few points are near an obstacle, or most of them are pressed")
        memory, before = self._memory, self._memory.copy()
        try:  # bound to obstacles, without friction
            memory[ANCHORED], memory[BILATERAL] = 0.0, 1.0
            for (_, group), pair, flag in zip(contacts.groups, contacts.tables.pairs, flags):
                far = FAR * group.height * stiffness_factor(pair)
                pair.multipliers[:], pair.largest[0] = far * flag, far
            found = self.solve(None, True)
        finally:
            memory[:] = before
        # all points stay in contact on obstacles so soft that the mean penetration is a tenth of
        # the height
        wanted = contacts.stiffening.copy()
        for k, ((_, group), _, gap) in enumerate(contacts.look(found.u, self.t)):
            deep = np.maximum(-gap, 0.0)
            if np.any(deep):
                mean = group.areas @ deep / group.areas[deep > 0.0].sum()
                most = max(1.0, group.largest_factor / LARGEST_FACTOR)
                wanted[k] = min(most, (1.0 + wanted[k]) * mean / (0.1 * group.height)) - 1.0
        contacts.stiffen(wanted, *self.start)
        if contacts.anchored:
            with contacts.without_friction():
                found = self.solve(found, True)
        return self.solve(found, True)

    def _directly(self):
        try:
            return self.solve(None, False)
        except LoadStepFailed:
            if not self.contacts.anchored:
                raise
            with self.contacts.without_friction():
                found = self.solve(None, True)
            return self.solve(found, False)

    def _stiffened(self, found, rough):
        """The equilibrium on stiff obstacles, or the last one before a failure."""
        # ``rough``: ``found`` is one that is only a start.
        contacts, increment, t = self.contacts, self.increment, self.t
        system = increment.system
        for _ in range(0 if contacts.untouched(found.u) else TIMES):
            u, yields = found.u, np.zeros(len(contacts.groups))
            if any(group.largest_factor > 1.0 for _, group in contacts.groups):
                yields = contacts.yielding(u, t, response(system, u, increment.load, t,
                                                          found.multipliers))
            # at least the present stiffness; the strain energy includes that of the penetration
            now, stored = contacts.stiffening, contacts.potential(u, t)
            share = stored / max(system.strain_energy(u, t) - stored, 1e-300)
            wanted = np.maximum(now, 0.0)
            for k, ((_, group), _, gap) in enumerate(contacts.look(u, t)):
                part = (1.0 + now[k]) / (1.0 + wanted[k])  # penetration at this pressure, stiffened
                deep, stores = -part * float(gap.min()) / group.height, part * share
                if deep > DEEP or (deep > SEEN and stores > STORED):
                    more = max(deep / SEEN, min(stores / STORED, deep / LEAST)) / LEFT
                    most = group.largest_factor / LARGEST_FACTOR
                    wanted[k] = max(1.0, min(most, (1.0 + wanted[k]) * more)) - 1.0
                if yields[k] > YIELDS:
                    more = min(group.largest_factor,
                               (1.0 + now[k]) * yields[k] / (LEFT * YIELDS))
                    wanted[k] = max(wanted[k], more - 1.0)
            if np.all(wanted == now):
                break
            found, done, rough = self._to(wanted, found, rough)
            if not done:
                break
        return self.solve(found, False) if rough else found

    def _to(self, wanted, found, rough):
        """The equilibrium at a stiffening or the last one before it; if reached; if it is rough."""
        contacts, step, fails = self.contacts, STEP, 0
        while True:
            before, now = self._memory.copy(), 1.0 + contacts.stiffening
            more = np.clip((1.0 + wanted) / now, 1.0 / step, step)
            last = np.allclose(more * now, 1.0 + wanted, rtol=1e-9)
            contacts.stiffen(wanted if last else more * now - 1.0, *self.start)
            try:
                found = self.solve(found, not last)
            except LoadStepFailed:
                self._memory[:] = before
                step, fails = np.sqrt(step), fails + 1
                if fails > RETRIED:
                    return found, False, rough
                continue
            rough = not last
            if last:
                return found, True, False


# equilibria in which nothing touches

# Corrections of Newton's method lead far beyond an equilibrium, and to know on the way of each that
# nothing touches takes longer than to find it. A scene is therefore solved without contact first.
# That holds if a motion to the result is known on which nothing touches.
#
# A straight line in the degrees of freedom would shorten what turns far. In the motion each node
# turns by its part of the whole, with its slopes, and chords between nodes by the mean of both
# ends.

#: Largest rotation of a node between two displacements of a motion, in radians, and their number.
TURN, MOST = 1.0, 40


def solved_without_contact(system: System, u: Array, memory: Array | None,
                           solve: Callable[[System], StaticResult], cut: bool = False
                           ) -> StaticResult | None:
    """The result of ``solve`` for the scene without contact of members, if it is known that they do
    not touch from u (N,) to there; else None, or LoadStepFailed if a failure is to ``cut`` the
    increment."""
    free = system.without_contact
    if free is None or system.constraints.missing_supports:
        return None
    here = system.recycled(memory, 0.0)
    try:
        if not (here.starts_untouched and not u.any() or here.backend.of(motion_is_clear)(u[None])):
            return None
        result = solve(free if system.clock is None else free.at(system.clock))
        motion, run = motion_between(here, u, result.u), here.backend.of(motion_is_clear)
        if motion is None:
            return None
        if len(motion) < 3:
            return result if run(motion) else None
        far = np.all([e.broad_search.discs.stay_apart(motion.view(complex)[:, at[::2] // 2])
                      for e, at in here.forces.changing], axis=0)
        clear = all(far[k] or run(motion[k:k + 2]) for k in range(len(far)))
        return result if clear else None
    except (LoadStepFailed, ConvergenceError) as failure:
        if cut and isinstance(failure, LoadStepFailed):
            raise
        logger.debug("without contact: %s", failure)
        return None
    finally:
        here.recycle()


def motion_between(system: System, u0: Array, u1: Array) -> Array | None:
    """Displacements (n, N) of a motion of shapes from u0 to u1; None if anything turns far but a
    beam of one chain, or this many times."""
    # Fixed and joined nodes go straight, so that joints of places hold.
    beams = list(zip(system.beams, system.slices))
    turns: list[Array] = []  # of the nodes of chains, the least where they move least
    for beam, s in beams:
        turn = tangents(beam, u1[s]) * tangents(beam, u0[s]).conj()
        turn = np.cumsum(np.angle(np.append(turn[:1], turn[1:] * turn[:-1].conj())))
        base = np.abs((u1[s] - u0[s]).view(complex)[::beam.nd // 2]).argmin()
        turns.append(turn - 2.0 * np.pi * np.rint(turn[base] / (2.0 * np.pi)))
    most = max([0.0, *(np.abs(turn).max() for turn in turns)])
    n = max(1, int(np.ceil(most / TURN)))
    if n > MOST or n > 1 and not all(beam.mesh.is_chain for beam, _ in beams) or any(
            np.hypot(*(u1 - u0)[system.of(body)][2:]) > TURN for body in system.bodies):
        return None
    share = np.linspace(0.0, 1.0, n + 1)[:, None]
    out = u0 + share * (u1 - u0)
    if n == 1:
        return out
    held, share = ~system.constraints.free, share[1:-1]
    held[system.constraints.slopes[1]] = True
    for (beam, s), turn in zip(beams, turns):
        a, b = ((beam.q0 + u[s]).view(complex).reshape(-1, beam.nd // 2) for u in (u0, u1))
        z, x, y = _evenly(a, b, turn[:, None], share[..., None]), a[:, 0], b[:, 0]
        at = np.flatnonzero(held[s].reshape(-1, beam.nd)[:, :2].any(axis=1))
        if not len(at):
            at = np.array([np.abs(y - x).argmin()])
        z[:, 1:, 0] = z[:, :1, 0] + np.cumsum(_evenly(
            np.diff(x), np.diff(y), 0.5 * (turn[1:] + turn[:-1]), share), axis=1)
        lost = x[at] + share * (y - x)[at] - z[:, at, 0]
        z[:, :, 0] += [np.interp(np.arange(len(x)), at, d) for d in lost]
        out[1:-1, s] = z.reshape(len(share), -1).view(float) - beam.q0
    return out


def _evenly(x, y, turn, share):
    """Vectors between x and y that turn evenly."""
    return np.exp(1j * share * turn) * (x + share * (y * np.exp(-1j * turn) - x))
