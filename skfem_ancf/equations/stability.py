"""Stability of an equilibrium."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from ..core.band import Inertia, fix
from ..core import NO_FACTORS, Array
from .rank import is_symmetric

#: Largest number of position DOFs for dense eigenvalues.
DENSE = 64
#: Largest relative difference of nodal displacements in a rigid translation.
SAME = 0.2
#: Forces that are zero, over modulus times area: strains at rest are of this size in compiled code.
NOTHING = 1e-17
#: Largest relative asymmetry that is round-off.
ROUND_OFF = 1e-10


@dataclass(frozen=True)
class Verdict:
    """The stability of an equilibrium.

    Attributes
    ----------
    stability : str
        "stable", "unstable", "singular" (an eigenvalue is zero to round-off), or "undecided" (the
        loads have no potential, and the symmetric part of the tangent is indefinite).
    negative_pivots : int
        Number of negative eigenvalues of the tangent at free degrees of freedom, on the null space
        of the joint Jacobian; of its symmetric part if loads have no potential.
    note : str
        Limits of the verdict, or "".
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


FOLLOWS = "against divergence: the loads have no potential, and statics cannot detect flutter"
RUBS = "if points stick where they touch: friction has no potential, flutter is not detected"


def verdict(system: Any, u: Array, load: float, multipliers: Array,
            t: float | None = None) -> Verdict:
    """The :class:`Verdict` on an equilibrium u (N,) with multipliers (m,)."""
    # Without a potential, as for a pressure with free edges, the tangent K is unsymmetric. det K <
    # 0 (an odd number of negative eigenvalues) means divergence: unstable. A positive definite
    # symmetric part excludes it. Otherwise an eigenvalue with a negative real part, for equal
    # masses at the nodes, means unstable. All else is undecided, and flutter depends on the mass:
    # see ``scene.modes``. Points that slip on obstacles count as sticking: of a disturbance either
    # way friction resists one.
    t = system.clock if t is None else t
    system = system.sticking()
    try:
        system.assemble(u, load)
        system.solver.factorize(u, load if t is None else t, multipliers)
        negative, singular = system.solver.inertia()
        has_friction = system.forces.contacts.anchored
        who = "friction or loads have" if has_friction else "the loads have"
        if system.symmetric or _is_symmetric(system):
            return Verdict("unstable" if negative else "singular" if singular else "stable",
                           negative)
        if system.solver.determinant_sign() < 0 or negative and _diverges(system):
            return Verdict("unstable", negative, f"by divergence: {who} no potential")
    except NO_FACTORS:
        return Verdict("singular", 0)
    if negative:
        return Verdict("undecided", negative, f"{who} no potential, and only the symmetric "
                       "part of the tangent is indefinite: see scene.modes")
    return Verdict("singular" if singular else "stable", 0, RUBS if has_friction else FOLLOWS)


def _diverges(system):
    """True if a motion grows, by the factors: an eigenvalue has a negative real part."""
    # As of equal masses at the nodes.
    _, G = inverse_on_positions(system)
    if isinstance(G, np.ndarray):
        values = np.linalg.eigvals(G)
        return bool(np.any(values.real < -ROUND_OFF * np.abs(values).max(initial=0.0)))
    try:
        least, largest = (eigs(G, k=1, which=which, v0=G @ np.ones(G.shape[0]), tol=1e-3,
                               return_eigenvectors=False)[0] for which in ("SR", "LM"))
    except ArpackNoConvergence:
        return False
    return bool(least.real < -ROUND_OFF * abs(largest))


def inverse_on_positions(system: Any) -> tuple[Callable[[Array], Array], Any]:
    """A function of forces on the free positions of nodes (n,): the displacement (N,); and the
    compliance there, (n, n), dense if there are few."""
    # By the factors of the tangent.
    at = np.nonzero((position_weights(system) > 0) & system.constraints.free)[0]
    none = np.zeros(system.constraints.m)

    def inverse(y):
        b = np.zeros(system.N)
        b[at] = np.ravel(y)
        return system.solver.solve(b, none)[0]

    if len(at) <= DENSE:
        return inverse, np.array([inverse(y)[at] for y in np.eye(len(at))])
    return inverse, LinearOperator((len(at), len(at)), lambda y: inverse(y)[at])


def _is_symmetric(system):
    """True if the tangent of follower loads happens to be symmetric."""
    return is_symmetric(system.K.tocsc(), system.constraints.coordinate_sizes
                        * system.constraints.mask, ROUND_OFF)


def response(system: Any, u: Array, load: float, when: float, multipliers: Array,
             t: float | None = None) -> Callable[[Array], Any]:
    """A function of forces (N,): displacements (N,) by the tangent at u (N,)."""
    # With a measure of displacements; None if there is no tangent. ``when`` is the time of joints,
    # ``t`` that of loads, None for full size.
    none = np.zeros(system.constraints.m)
    try:
        system.assemble(u, load, t=t)
        system.solver.factorize(u, when, multipliers)
    except NO_FACTORS:
        return lambda force: None
    return lambda force: (system.solver.solve(force, none)[0],
                          partial(largest_displacement, system))


def has_potential(system: Any, u: Array, load: float) -> bool:
    """True if the tangent at u (N,) is symmetric."""
    if system.symmetric:
        return True
    system.assemble(u, load)
    fix(system.K, system.constraints.fixed)
    return _is_symmetric(system)


def is_stabilised(system: Any, u: Array, multipliers: Array) -> bool:
    """True if loads or obstacles stabilise a scene with unconstrained rigid motions."""
    # The tangent at u (N,) must be positive definite beyond round-off.
    system = system.sticking()
    force, _ = system.assemble(u)
    fix(system.K, system.constraints.fixed)
    loads = np.maximum(np.abs(force), np.abs(system.external_force(u)))
    if is_nothing(system, loads):
        return False
    weights = position_weights(system) * system.constraints.mask
    acting = np.max(loads * weights)
    nodes = min(np.sum(weights[s]) for s in system.slices)  # of the smallest part that may be loose
    # of rigid motions, relative to the stiffness of the loads
    least = 1e-5 * acting / (system.size * max(1.0, nodes))
    system.K.add_diagonal(-least * weights)
    try:
        system.solver.factorize(u, 1.0, multipliers)
        return system.solver.inertia() == Inertia(0, False)
    except NO_FACTORS:
        return False


def is_nothing(system: Any, force: Array) -> bool:
    """True if forces (N,) at free positions are zero, or round-off."""
    weights = position_weights(system) * system.constraints.mask
    acting = np.max(np.abs(force) * weights)
    return bool(acting * system.size <= NOTHING * system.scales.energy_of_strains)


def motion_in_words(system: Any, u: Array, v: Array) -> str:
    """Describe a direction v (N,) at a displacement u (N,): which member moves most, and how."""
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
    """Why a scene is unstable without load because of an indefinite strain energy, or ""."""
    if system.constraints.missing_supports:
        return ""  # the sign of a pivot that should be zero is round-off
    at_rest = np.zeros((3, 1))
    names = sorted({beam.formulation.name for beam in system.beams for term in beam.terms
                    if np.linalg.eigvalsh(term.law.moduli(at_rest)[..., 0])[0] < 0.0})
    if not names:
        return ""
    found = verdict(system, np.zeros(system.N), 0.0, np.zeros(system.constraints.m))
    if found.stability != "unstable":
        return ""
    return (f"the scene is unstable without load ({found}): the strain energy of "
            f"formulation {', '.join(map(repr, names))} is not positive for this order of the "
            "element and this Poisson ratio. Use formulation 'assumed' (the default) or "
            "'continuum', a smaller nu or a smaller order")


def largest_displacement(system: Any, du: Array) -> float:
    """The largest displacement of a node, for displacements (..., N)."""
    places = position_weights(system).nonzero()[0]
    return float(np.hypot(*du[..., places].reshape(-1, 2).T).max(initial=0.0))


def position_weights(system: Any) -> Array:
    """One at nodal positions, zero at other DOFs, shape (N,)."""
    weights = np.zeros(system.N)
    for beam, s in zip(system.members, system.slices):
        weights[s].reshape(-1, beam.nd)[:, :2] = 1.0
    return weights
