"""Which equilibrium: the verdict on its stability, and the way from an unstable one down."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from ..core.band import fix
from ..actions.forces.turns import Turns
from ..core.linalg import NO_FACTORS, Inertia

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..core.types import Array

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
#: How much more the nodes move close to a limit point than in the stress-free state.
SOFTER = 8.0
#: How often a step that ends at an unstable point is cut before the path counts as unstable.
CUTS = 3
#: Iterations of a descent.
DESCENT = 200
#: Largest radius of a descent, and displacement over the size of the scene from which it is lost.
LARGEST, ASTRAY = 0.5, 20.0
#: How often a correction of a descent is halved that leads through an obstacle.
HALVED = 8
#: Stiffness that holds what supports leave free, over that of the loads.
HELD = 1e-6
#: Forces that are zero, over those that a strain of one would cause.
NOTHING = 1e-20
#: Largest difference of a tangent from its transpose, relative, that is round-off.
ROUND_OFF = 1e-10


@dataclass(frozen=True)
class Verdict:
    """What the tangent says of an equilibrium.

    Attributes
    ----------
    stability : str
        "stable", "unstable", "singular" where an eigenvalue is zero to round-off, or "undecided"
        where the loads have no potential and the tangent does not tell.
    negative_pivots : int
        Number of negative eigenvalues of the tangent at free coordinates, on the tangent space of
        the joints; of its symmetric part where loads have no potential.
    note : str
        What the verdict does not say; empty where it says all.
    """

    stability: str
    negative_pivots: int
    note: str = ""

    def __str__(self):
        out = self.stability
        if self.negative_pivots:
            s = "" if self.negative_pivots == 1 else "s"
            out += f" ({self.negative_pivots} negative pivot{s})"
        return f"{out}, {self.note}" if self.note else out


FOLLOWS = "against divergence: the loads have no potential, and flutter is not seen in statics"
RUBS = "with friction as it is, sticking or slipping: it has no potential, and flutter is not seen"


def verdict(system: Any, u: Array, load: float, multipliers: Array,
            t: float | None = None) -> Verdict:
    """The :class:`Verdict` on an equilibrium, from the tangent there.

    Where the loads have no potential (a pressure with free edges) the tangent K is not symmetric.
    An odd number of negative eigenvalues, det K < 0, then is a motion that grows without
    oscillating: unstable. A symmetric part that is positive definite excludes any such motion. In
    between the tangent does not tell, and flutter needs the masses: see ``scene.modes``.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u, multipliers
        Displacement (N,) and multipliers (m,).
    load, t
        Load factor, and the time of joints that move; the load factor by default.
    """
    try:
        system.assemble(u, load)
        system.factorize(u, load if t is None else t, multipliers)
        return verdict_of_factors(system)
    except NO_FACTORS:
        return Verdict("singular", 0)


def verdict_of_factors(system: Any) -> Verdict:
    """As :func:`verdict`, from the tangent that has been factorised."""
    negative, singular = system.inertia()
    rubs = system.forces.contacts.anchored
    who = "friction or loads have" if rubs else "the loads have"
    if system.symmetric or _is_symmetric(system):
        return Verdict("unstable" if negative else "singular" if singular else "stable", negative)
    if system.determinant_sign() < 0:
        return Verdict("unstable", negative, f"by divergence: {who} no potential")
    if negative:
        return Verdict("undecided", negative, f"{who} no potential, and only the symmetric "
                       "part of the tangent is indefinite: scene.modes tells")
    return Verdict("singular" if singular else "stable", 0, RUBS if rubs else FOLLOWS)


def _is_symmetric(system):
    """True if the tangent of loads that follow is symmetric all the same."""
    skew, size = system.K.skew_size(system.constraints.coordinate_sizes * system.constraints.mask)
    return skew <= ROUND_OFF * size


def has_potential(system: Any, u: Array, load: float) -> bool:
    """True if the tangent is symmetric: the loads have a potential, or act like such.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u
        Displacement of the coordinates, shape (N,).
    load
        Load factor.
    """
    if system.symmetric:
        return True
    system.assemble(u, load)
    fix(system.K.band, system.constraints.fixed)
    return _is_symmetric(system)


def holds(system: Any, u: Array, load: float, multipliers: Array, t: float | None) -> bool:
    """True unless the equilibrium that an iteration has just found is unstable.

    The factors of the last iterate mostly answer at little cost; what they do not affirm is asked
    of the tangent at the solution.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u, multipliers
        The equilibrium, shapes (N,) and (m,).
    load, t
        Load factor, and the time of joints that move.
    """
    try:
        if system.stays():
            return True
    except NO_FACTORS:
        logger.debug("the last factors do not tell")
    return verdict(system, u, load, multipliers, t).stability != "unstable"


def is_held(system: Any, u: Array, multipliers: Array) -> bool:
    """True if loads or obstacles hold an equilibrium of a scene whose supports leave it free.

    Its tangent has to be positive definite, and not by round-off alone.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.
    u, multipliers
        The equilibrium at full load, shapes (N,) and (m,).
    """
    force, _ = system.assemble(u)
    fix(system.K.band, system.constraints.fixed)
    loads = np.maximum(np.abs(force), np.abs(system.external_force(u)))
    weights = position_weights(system) * system.constraints.mask
    acting = np.max(loads * weights)
    if acting * system.size <= NOTHING * system.energy_of_strains:
        return False
    least = HELD * acting / (system.size * max(1.0, np.sum(weights)))
    system.K.add_diagonal(-least * weights)
    try:
        system.factorize(u, 1.0, multipliers)
        return system.inertia() == Inertia(0, False)
    except NO_FACTORS:
        return False


def weak_at_rest(system: Any) -> str:
    """Why a scene gives way without any load, if its strain energy is to blame; else empty.

    A spring may push a scene out of rest, and a way leads down from there. Where a formulation
    subtracts a part of the energy and leaves less than nothing, none does.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    """
    at_rest = np.zeros((3, 1))
    names = sorted({beam.formulation.name for beam in system.beams for term in beam.terms
                    if np.linalg.eigvalsh(term.law.moduli(at_rest)[..., 0])[0] < 0.0})
    if not names:
        return ""
    found = verdict(system, np.zeros(system.N), 0.0, np.zeros(system.constraints.m))
    if found.stability != "unstable":
        return ""
    return (f"the scene gives way at rest, without any load ({found}): the strain energy of "
            f"formulation {', '.join(map(repr, names))} is not positive for this order of the "
            "element and this Poisson ratio. The formulations 'assumed' (the default) and "
            "'continuum' have a positive one; so has a smaller nu or order")


def heads_on(system: Any, result: Any, u: Array, load: float) -> bool:
    """True if the scene moves from the last equilibrium to ``u`` as the load drives it there.

    Close to a bifurcation an iteration may jump to the other side. The nodes' displacements are
    compared with those of the tangent, but where obstacles move.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    result
        The last equilibrium, a :class:`~skfem_ancf.solvers.newton.StaticResult`.
    u
        Displacement of the next one, shape (N,).
    load
        Its load factor.
    """
    if system.forces.contacts.moving:
        return True  # the tangent does not know where obstacles go
    du = np.zeros(system.N)
    fixed = system.constraints.fixed
    du[fixed] = system.constraints.values(load) - result.u[fixed]
    force, _ = system.assemble(result.u, result.load)
    J = system.constraints.full_jacobian(result.u, load)
    residual = (load * system.external_force(result.u) - force - system.multiply(du)
                - result.multipliers @ J)
    try:
        system.factorize(result.u, load, result.multipliers)
        du += system.solve(residual, -system.constraints.constraint(result.u, load) - J @ du)[0]
    except NO_FACTORS:
        return True
    return bool(du @ (position_weights(system) * (u - result.u)) >= 0.0)


def gives_way(system: Any, result: Any, load: float) -> bool:
    """True if the last equilibrium is close to a limit point.

    There the nodes move much more under forces that the stress-free scene withstands.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    result
        The last equilibrium, a :class:`~skfem_ancf.solvers.newton.StaticResult`.
    load
        The next load factor.
    """
    descent, none, ratio = Descent(system), np.zeros(system.constraints.m), []
    if result.load == 0.0:
        return False
    try:
        for u, multipliers, at in ((result.u, result.multipliers, result.load),
                                   (np.zeros(system.N), none, 0.0)):
            system.assemble(u, at)
            system.factorize(u, at, multipliers)
            ratio.append(descent.compliance())
    except NO_FACTORS:
        return True
    return ratio[0] > SOFTER * ratio[1]


class Descent:
    """Corrections of bounded size that lead to a minimum of the potential.

    The tangent is made stiffer by a multiple of the identity, of coordinates over their sizes,
    until it is positive definite and the correction no larger than a radius: a trust region by
    Levenberg and Marquardt, see Conn, Gould, Toint: Trust-Region Methods (2000), 7.3. So it leads
    down where directions give way, and where a rigid motion is free. Close to a minimum nothing is
    added, and the correction is Newton's.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    stride
        The radius at first: largest change of a coordinate in one correction over its size, which
        is that of the scene for positions and about 1 for rotations. It is halved where corrections
        turn back, and grows to five times that where they go on.

    Attributes
    ----------
    turned : bool
        A direction of negative curvature was met.
    """

    def __init__(self, system: Any, stride: float = STRIDES[0]) -> None:
        self.system, self.turned = system, False
        self._weights = position_weights(system)
        self._sizes = system.constraints.coordinate_sizes
        self._radius, self._largest = stride, min(5.0 * stride, LARGEST)
        self._shift, self._before = 0.0, np.zeros(system.N)

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """Solve for a correction; False if there is none.

        Parameters
        ----------
        t, u, multipliers, R, phi, du, dm
            As for :meth:`System.solve_own <skfem_ancf.equations.system.System.solve_own>`, shapes
            (N,) and (m,).
        """
        if np.max(np.abs(u / self._sizes)) > ASTRAY:
            return False
        found = self._bounded(lambda: self.system.factorize(u, t, multipliers), R, phi)
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
                du, dm = system.solve(R, phi)
                # where friction slips there is no potential: what does work will do
                down = system.inertia().negative == 0 if system.symmetric else R @ du >= 0.0
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
        """The sum over the nodes of ``a . b``, of displacements of the coordinates.

        Parameters
        ----------
        a, b
            Displacements of the coordinates, shape (N,).
        """
        return float(a @ (self._weights * b))

    def directions(self, count: int) -> list[tuple[Array, float]]:
        """Directions v with negative ``v . K v``, from the factors, and that number: pairs.

        Eigenvectors of the inverse of K seen from the positions of the nodes, of its most negative
        eigenvalues: those of K that are closest to zero.
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
            return self.system.solve(b, none)[0]

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


def way_down(system: Any, result: Any, load: float, full: float, at: float,
             proportional: bool, iterate: Callable[..., Any],
             failed: type[Exception]) -> tuple[Any, bool]:
    """What :func:`descend` finds, or None, and whether it met an unstable tangent.

    Of the strides the first that leads where the load drives the scene.

    Parameters
    ----------
    system, result
        As for :func:`descend`.
    load
        As for :func:`heads_on`.
    full, at
        Load factor and time for :func:`descend`.
    proportional
        Loads and supports grow together, so that :func:`heads_on` can tell.
    iterate, failed
        As for :func:`descend`.
    """
    first: tuple[Any, bool] = None, False
    for stride in STRIDES:
        descent = Descent(system, stride)
        try:
            found = descend(system, result, full, at, iterate, descent, failed)
        except (failed, *NO_FACTORS) as failure:
            logger.info("no descent at load %.6g: %s", load, failure)
            continue
        if not proportional or result.load == 0.0 or heads_on(system, result, found[0], load):
            return found, descent.turned
        first = (found, descent.turned) if first[0] is None else first
    return first


def descend(system: Any, result: Any, load: float, t: float, iterate: Callable[..., Any],
            descent: Descent, failed: type[Exception]) -> tuple[Array, Array, Array]:
    """A stable equilibrium at a load where the path from the last one has lost its stability.

    Corrections of :class:`Descent` from the last stable equilibrium; where they come to rest at an
    unstable point, the lowest direction leads on, towards the last stable equilibrium, or where it
    points to neither side, to that of the lower potential.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    result
        The last stable equilibrium, a :class:`~skfem_ancf.solvers.newton.StaticResult`.
    load, t
        Where to find the next.
    iterate
        A function of displacement, multipliers and Descent: displacement, multipliers and force
        of the equilibrium that the iteration finds.
    descent
        A :class:`Descent`.
    failed
        The exception to raise where there is none.
    """
    u, multipliers = result.u, result.multipliers
    for _ in range(KICKS):
        u, multipliers, force = iterate(u, multipliers, descent)
        found = verdict(system, u, load, multipliers, t)
        if found.stability != "unstable":
            return u, multipliers, force
        descent.turned = True
        directions = descent.directions(1)
        if not directions:  # what gives way does not move the nodes
            break
        v = directions[0][0]
        v = KICK * system.size / np.max(np.abs(v)) * v
        u = u + _side(system, descent, v, u, result.u, load) * v
    raise failed("no stable equilibrium found along the directions that give way")


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


def potential(system: Any, u: Array, load: float, turned: Array | None = None) -> float:
    """The total potential: strain energy less the work of the loads.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u
        Displacement of the coordinates, shape (N,).
    load
        Load factor.
    turned
        As of :meth:`~skfem_ancf.equations.system.System.load_potential`, shape (k,).
    """
    return system.strain_energy(u, load) + load * system.load_potential(u, turned=turned)


def position_weights(system: Any) -> Array:
    """One at the positions of the nodes, zero at other coordinates, shape (N,)."""
    weights = np.zeros(system.N)
    for beam, s in zip(system.members, system.slices):
        weights[s].reshape(-1, beam.nd)[:, :2] = 1.0
    return weights
