"""The way from an unstable point down to a stable equilibrium."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from ..actions.forces.turns import Turns
from ..core.band import fix
from ..core.linalg import NO_FACTORS
from ..core.types import Array
from ..equations.stability import position_weights, potential, verdict
from ..equations.system import System
from .outcome import Equilibrium, StaticResult, StepFailed

logger = logging.getLogger(__name__)

#: Largest displacements of a node in one correction of a descent, relative to the scene's size,
#: that are tried one after the other.
STRIDES = (0.1, 0.02, 0.004)
#: First displacement along a negative direction, relative to the scene's size.
KICK = 0.02
#: How often a descent may come to rest at an unstable point and leave it again.
KICKS = 6
#: Positions of nodes up to which dense eigenvalues are used.
DENSE = 64
#: How much more the nodes move close to a limit point than in the reference configuration.
SOFTER = 8.0
#: How often a step that ends at an unstable point is cut before the path counts as unstable.
CUTS = 3
#: Iterations of a descent.
DESCENT = 200
#: Largest radius of a descent, and displacement over the size of the scene from which it is lost.
LARGEST, LOST = 0.5, 20.0
#: How often a correction of a descent is halved that leads through an obstacle.
HALVED = 8


def heads_on(system: System, start: StaticResult, u: Array, load: float) -> bool:
    """True if the scene moves from the last equilibrium to ``u`` as the load drives it there.

    Close to a bifurcation an iteration may jump to the other side. The nodes' displacements are
    compared with those of the tangent, but where obstacles move.
    """
    if system.forces.contacts.moving:
        return True  # the tangent does not know where obstacles go
    du, held, solver = np.zeros(system.N), system.constraints, system.solver
    du[held.fixed] = held.values(load) - start.u[held.fixed]
    force, _ = system.assemble(start.u, start.load)
    J = held.full_jacobian(start.u, load)
    residual = (load * system.external_force(start.u) - force - solver.multiply(du)
                - start.multipliers @ J)
    try:
        solver.factorize(start.u, load, start.multipliers)
        du += solver.solve(residual, -held.constraint(start.u, load) - J @ du)[0]
    except NO_FACTORS:
        return True
    return bool(du @ (position_weights(system) * (u - start.u)) >= 0.0)


def near_limit(system: System, start: StaticResult) -> bool:
    """True if the last equilibrium is close to a limit point.

    There the nodes move much more under forces that the reference configuration withstands.
    """
    if start.load == 0.0:
        return False
    descent, none, ratio = Descent(system), np.zeros(system.constraints.m), []
    try:
        for u, multipliers, at in ((start.u, start.multipliers, start.load),
                                   (np.zeros(system.N), none, 0.0)):
            system.assemble(u, at)
            system.solver.factorize(u, at, multipliers)
            ratio.append(descent.compliance())
    except NO_FACTORS:
        return True
    return ratio[0] > SOFTER * ratio[1]


class Descent:
    """Corrections of bounded size that lead to a minimum of the potential.

    The tangent is made stiffer by a multiple of the identity, of coordinates over their sizes,
    until it is positive definite and the correction no larger than a radius: a trust region by
    Levenberg and Marquardt, see Conn, Gould, Toint: Trust-Region Methods (2000), 7.3. Close to a
    minimum nothing is added, and the correction is Newton's.

    ``stride`` is the first radius: the largest change of a degree of freedom over its size. It is
    halved where corrections turn back, and grows to five times that where they go on. ``turned``
    is True once a direction of negative curvature was met.
    """

    def __init__(self, system: System, stride: float = STRIDES[0]) -> None:
        self.system, self.turned = system, False
        self._weights = position_weights(system)
        self._sizes = system.constraints.coordinate_sizes
        self._radius, self._largest = stride, min(5.0 * stride, LARGEST)
        self._shift, self._before = 0.0, np.zeros(system.N)

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """Solve for a correction; False if there is none."""
        if np.max(np.abs(u / self._sizes)) > LOST:
            return False
        found = self._bounded(lambda: self.system.solver.factorize(u, t, multipliers), R, phi)
        if found is None:
            return False
        du[:], dm[:] = self._held_back(t, u, *found)
        now, before = du / self._sizes, self._before
        along = now @ before / (np.sqrt(now @ now * (before @ before)) or 1.0)
        if along < -0.2:
            self._radius *= 0.5
        elif along > 0.3:
            self._radius = min(1.5 * self._radius, self._largest)
        self._before = now
        return True

    def _held_back(self, t, u, du, dm):
        """A correction, shortened until nothing passes through an obstacle."""
        for _ in range(HALVED):
            if self.system.forces.contacts.passed((u, t), (u + du, t)) is None:
                break
            du, dm = 0.5 * du, 0.5 * dm
        return du, dm

    def _bounded(self, factorize, R, phi):
        """The correction with the least stiffness added that will do, to a factor of ten or so."""
        band, system = self.system.K.band, self.system
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
                # where friction slips there is no potential: what does work will do
                down = system.solver.inertia().negative == 0 if system.symmetric else R @ du >= 0.0
            except NO_FACTORS:
                return None
            self.turned = self.turned or (shift == 0.0 and not down)
            return (du, dm) if down and np.max(np.abs(du / self._sizes)) <= self._radius else None

        least = 1e-14 * scale
        found, shift = correction(0.0), max(self._shift, 100.0 * least)
        if found is not None:
            self._shift = 0.0
            return found
        found = correction(shift)
        if found is None:  # more
            while found is None and shift < 1e6 * scale:
                shift *= 10.0
                found = correction(shift)
            self._shift = shift
            return found
        while shift > 10.0 * least:  # less
            less = correction(0.1 * shift)
            if less is None:
                break
            found, shift = less, 0.1 * shift
        self._shift = shift
        return found

    def product(self, a: Array, b: Array) -> float:
        """The sum over the nodes of ``a . b``, of displacements (N,)."""
        return float(a @ (self._weights * b))

    def directions(self, count: int) -> list[tuple[Array, float]]:
        """Directions v with negative ``v . K v``, from the factors, and that number: pairs.

        Eigenvectors of the inverse of K on the positions of the nodes, the most negative ones
        first.
        """
        inverse, values, Y = self._inverse_eigenvectors(count, "SA")
        return [(inverse(y), value) for y, value in zip(Y.T, values) if value < 0]

    def compliance(self) -> float:
        """The largest displacement of the nodes for unit forces on them, from the factors."""
        values = self._inverse_eigenvectors(1, "LA")[1]
        return float(np.max(values, initial=0.0))

    def _inverse_eigenvectors(self, count, which):
        at = np.nonzero((self._weights > 0) & self.system.constraints.free)[0]
        none, N = np.zeros(self.system.constraints.m), self.system.N

        def inverse(y):
            b = np.zeros(N)
            b[at] = np.ravel(y)
            return self.system.solver.solve(b, none)[0]

        count = min(count, len(at))
        if not count:
            return inverse, np.zeros(0), np.zeros((0, 0))
        if len(at) <= DENSE:
            G = np.array([inverse(y)[at] for y in np.eye(len(at))])
            values, Y = np.linalg.eigh(0.5 * (G + G.T))
            some = slice(count) if which == "SA" else slice(len(at) - count, None)
            return inverse, values[some], Y[:, some]
        G = LinearOperator((len(at), len(at)), lambda y: inverse(y)[at])
        start = G @ np.random.default_rng(0).standard_normal(len(at))
        values, Y = eigsh(G, k=min(count, len(at) - 1), which=which, v0=start)
        return inverse, values, Y


def way_down(increment: Any) -> tuple[Equilibrium | None, bool]:
    """What :func:`descend` finds, or None, and whether it met an unstable tangent.

    Of the strides the first that leads where the load drives the scene.
    """
    system, start, level = increment.system, increment.start, increment.level
    options = increment.options._replace(most=DESCENT, watched=False)
    first: tuple[Any, bool] = None, False
    for stride in STRIDES:
        descent = Descent(system, stride)

        def iterate(begin, descent=descent):
            return increment.iterate(begin, options, descent)

        try:
            found = descend(increment, iterate, descent)
        except (StepFailed, *NO_FACTORS) as failure:
            logger.info("no descent at load %.6g: %s", level, failure)
            continue
        if (not options.route.proportional or start.load == 0.0
                or heads_on(system, start, found.u, level)):
            return found, descent.turned
        first = (found, descent.turned) if first[0] is None else first
    return first


def descend(increment: Any, iterate: Callable[..., Equilibrium],
            descent: Descent) -> Equilibrium:
    """A stable equilibrium at a load where the path from the last one has lost its stability.

    Corrections of :class:`Descent` from the last stable equilibrium, by ``iterate``; where they
    come to rest at an unstable point, the lowest direction leads on, towards the last stable
    equilibrium, or where it points to neither side, to that of the lower potential.
    """
    system, start, load = increment.system, increment.start, increment.load
    u, multipliers = start.u, start.multipliers
    for _ in range(KICKS):
        found = iterate((u, multipliers))
        u, multipliers, _ = found
        if verdict(system, u, load, multipliers, increment.time).stability != "unstable":
            return found
        descent.turned = True
        directions = descent.directions(1)
        if not directions:  # what gives way does not move the nodes
            break
        v = directions[0][0]
        v = KICK * system.size / np.max(np.abs(v)) * v
        u = u + _side(system, descent, v, u, start.u, load) * v
    raise StepFailed("no stable equilibrium found along the directions that give way")


def _side(system, descent, v, u, last, load):
    """On which side of an unstable point to leave it along v: 1 or -1."""
    back = descent.product(v, last - u)
    if abs(back) > 1e-6 * descent.product(v, v):
        return 1.0 if back > 0 else -1.0
    turns = Turns(system)
    near = turns.begin(u)
    here, up, down = (potential(system, x, load, turns.follow(near, x[None])[0])
                      for x in (u, u + v, u - v))
    if abs(up - down) > 1e-6 * abs(up + down - 2.0 * here):
        return 1.0 if up < down else -1.0
    return 1.0 if v[np.argmax(np.abs(v) > 0.5 * np.max(np.abs(v)))] > 0 else -1.0
