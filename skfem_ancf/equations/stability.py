"""The verdict on the stability of an equilibrium."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.band import fix
from ..core.linalg import NO_FACTORS, Inertia
from ..core.types import Array

logger = logging.getLogger(__name__)

#: Stiffness that holds what supports leave free, over that of the loads.
HELD = 1e-6
#: Difference of motions of nodes that are one, over the largest.
SAME = 0.2
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
        t = system.clock if t is None else t
        system.solver.factorize(u, load if t is None else t, multipliers)
        return verdict_of_factors(system)
    except NO_FACTORS:
        return Verdict("singular", 0)


def verdict_of_factors(system: Any) -> Verdict:
    """As :func:`verdict`, from the tangent that has been factorised."""
    negative, singular = system.solver.inertia()
    rubs = system.forces.contacts.anchored
    who = "friction or loads have" if rubs else "the loads have"
    if system.symmetric or _is_symmetric(system):
        return Verdict("unstable" if negative else "singular" if singular else "stable", negative)
    if system.solver.determinant_sign() < 0:
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
        if system.solver.stays():
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
        A :class:`~skfem_ancf.equations.system.System`.
    u, multipliers
        The equilibrium at full load, shapes (N,) and (m,).
    """
    force, _ = system.assemble(u)
    fix(system.K.band, system.constraints.fixed)
    loads = np.maximum(np.abs(force), np.abs(system.external_force(u)))
    weights = position_weights(system) * system.constraints.mask
    acting = np.max(loads * weights)
    if acting * system.size <= NOTHING * system.scales.energy_of_strains:
        return False
    least = HELD * acting / (system.size * max(1.0, np.sum(weights)))
    system.K.add_diagonal(-least * weights)
    try:
        system.solver.factorize(u, 1.0, multipliers)
        return system.solver.inertia() == Inertia(0, False)
    except NO_FACTORS:
        return False


def motion_in_words(system: Any, u: Array, v: Array) -> str:
    """Which member moves most along the direction v of the coordinates, and how, in words.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    u, v
        Displacement, and a direction, shape (N,) both.
    """
    def nodes(member, s):
        return np.reshape(v[s], (-1, member.nd))[:, :2]

    member, s = max(zip(system.members, system.slices), key=lambda of: np.abs(nodes(*of)).max())
    moves, name = nodes(member, s), getattr(member, "name", None)
    who = "the scene" if name is None and len(system.members) > 1 else (
        "the beam" if name is None else str(name))
    largest = moves[np.argmax(np.hypot(*moves.T))]
    d = largest / np.hypot(*largest)
    d = np.round(d if d[np.argmax(np.abs(d))] > 0 else -d, 3) + 0.0
    if np.abs(moves - moves.mean(axis=0)).max() < SAME * np.abs(moves).max():
        return f"{who} along ({d[0]:.3g}, {d[1]:.3g})"
    x = np.reshape(u[s] + member.q0_local, (-1, member.nd))[:, :2]
    tangents = np.gradient(x, axis=0) if len(x) > 1 else x
    tangents /= np.maximum(np.hypot(*tangents.T), 1e-300)[:, None]
    along = np.sum(moves * tangents, axis=1)
    if np.abs(along - along.mean()).max() < SAME * np.abs(along).max():
        return f"{who} along its axis"
    at = x[np.argmax(np.hypot(*moves.T))]
    return f"{who} at ({at[0]:.4g}, {at[1]:.4g}) along ({d[0]:.3g}, {d[1]:.3g})"


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


def largest_displacement(system: Any, du: Array) -> float:
    """The largest displacement of a node, of changes of the DOFs (..., N)."""
    places = np.nonzero(position_weights(system))[0]
    return float(np.hypot(*du[..., places].reshape(-1, 2).T).max(initial=0.0))


def position_weights(system: Any) -> Array:
    """One at the positions of the nodes, zero at other coordinates, shape (N,)."""
    weights = np.zeros(system.N)
    for beam, s in zip(system.members, system.slices):
        weights[s].reshape(-1, beam.nd)[:, :2] = 1.0
    return weights
