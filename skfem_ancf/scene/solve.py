"""States for the equations of a scene, static and adaptive solutions, and plans of solutions."""

import logging
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..actions.joints.nodes import chain_ends
from ..beam import Beam
from ..core import (AncfError, Array, ConvergenceError, InputError, Interrupted, ModelWarning,
                    NameUnknown, SupportError, gauss, refuse, require_finite, require_integer,
                    require_option, require_positive, warn)
from ..dynamics.schemes import choose_scheme
from ..dynamics.integrator import OF_STEP
from ..elements.base import DEGREES
from ..equations.system import System
from ..results.modes import ROUND_OFF, Modes
from ..results.state import State
from ..solvers.eigen import improved
from ..solvers.iteration import ITERATIONS, StaticResult

# checks of states and displacements for the equations of a scene

#: What meshes must have in common to exchange states, with messages.
_GEOMETRY = {
    "nelements": "its mesh has {} elements, that of the scene {}",
    "height": "its height is {:.9g}, that of the scene {:.9g}",
    "sections": "its sections are {}, those of the scene {}",
    **dict.fromkeys(("p", "p_X", "lengths"), "its nodes lie elsewhere"),
    "t": "its nodes are joined in another way", "heights": "its heights are others",
    **dict.fromkeys(("p_Y", "p_XY"), "its sections turn in another way")}


def displacement(system: System, state: State, name: str = "start") -> Array:
    """Displacement (N,) of a State for a scene; ``name`` is for messages."""
    refuse(not isinstance(state, State), "{} is a State, as of solve_static or scene.state(u), got "
           "{}", name, type(state).__name__)
    other = state.system
    if other is not system:
        refuse(len(other.beams) != len(system.beams), "{} is a state of {} beams, the scene has {}",
               name, len(other.beams), len(system.beams))
        for k, (a, b) in enumerate(zip(other.beams, system.beams)):
            if a is b or (a.mesh is b.mesh and a.element is b.element):
                continue
            pairs = ((getattr(a.mesh, key), getattr(b.mesh, key), text)
                     for key, text in _GEOMETRY.items())
            why = next((text.format(x, y) for x, y, text in pairs if not (
                x is y or x is not None and y is not None and np.array_equal(x, y))), "")
            if repr(a.element) != repr(b.element) or not np.array_equal(
                    a.element.doflocs, b.element.doflocs):
                why = f"its element is {a.element!r}, that of the scene {b.element!r}"
            refuse(why, "{} is a state of another mesh{}: {}; scene.state(other.u) takes its "
                   "coordinates", name, f" of beam {b.name or k}" * (len(system.beams) > 1), why)
    places = [[(tuple(b.position), b.angle) for b in s.bodies] for s in (other, system)]
    refuse(places[0] != places[1], "{} is a state of rigid bodies at {}, those of the scene are at "
           "{}", name, *places)
    return np.array(require_finite(f"{name}.u", state.u, (system.N,)))


def configuration(system: System, state: State) -> State:
    """A State with its multipliers, for a scene."""
    u = displacement(system, state, "state")
    if state.system is system:
        return state
    kinds = [[(type(j), j.equations) for j in s.constraints.joints] for s in (state.system, system)]
    refuse(kinds[0] != kinds[1], "state has multipliers of other joints, {}: scene.state(u, "
           "multipliers) takes them", state.system.constraints.joints)
    memory = system.histories.of_state(state)
    return state.replace(system=system, u=u).replace(memory=memory)


def solve_static(system: System, u: Array | None, memory: Array | None,
                 find: Callable[..., StaticResult]) -> State:
    """The equilibrium under full load, without warnings."""
    # ``find`` is :func:`skfem_ancf.solvers.solve_static` with its options.
    system.constraints.require_independent_joints()
    if system.constraints.adrift:
        system.constraints.require_supports()
    try:
        return _state(system, find(system, u, memory=memory))
    except Interrupted as error:
        raise Interrupted(str(error), _state(system, error.state)) from None
    except ConvergenceError as error:
        if system.constraints.missing_supports:
            raise SupportError(str(error)) from error
        state, message = _state(system, error.state), str(error)
        if state.checks.findings:
            message += (f". At the load level {state.load:.6g} already "
                        + "; ".join(state.checks.findings))
        raise ConvergenceError(message, state) from None


def _state(system, result):
    return State(system, result.u, result.load, result.force, result.converged, result.iterations,
                 result.message, result.steps, result.multipliers, doubt=result.doubt,
                 memory=result.memory, seen=result.seen)


# what a solution uses, and why

#: Assumed number of steps of a motion, which decides on compilation.
STEPS = 1000


class Plan(dict[str, str]):
    """What a solution uses, and why, by name; ``print(plan)`` shows all."""

    def __missing__(self, key: str) -> str:
        raise NameUnknown("term", key, self)

    def __str__(self) -> str:
        return "\n".join(f"{name:<{max(map(len, self))}}  {text}" for name, text in self.items())


def make_plan(system: System, kind: str) -> Plan:
    """What a "static", "linear" or "dynamic" solution uses."""
    require_option("kind of solution", kind, ("static", "linear", "dynamic"))
    dynamic = kind == "dynamic"
    found = Counter[str]()
    for beam in system.beams:  # the element, what it samples, and what lies across it
        name = "beam" if beam.name is None else f"beam {beam.name!r}"
        across = "" if beam.across.simple else f", {beam.section!r}"
        strain = f"{beam.formulation.name} strain at {beam.kernel.points_number} points an element"
        found[f"{name} of {beam.mesh.nelements} x {beam.element!r}{across}, {strain}"] += 1
    plan = Plan(elements="; ".join(f"{n} {name}" for name, n in found.items())
                or "there are no beams")
    solver, m = system.solver, system.constraints.m
    if dynamic and system.mass_solver.by_nodes:
        text = ("lines condensed to displacements and rotations of nodes, sparse LDL^T of these, "
                "for steps and for the mass with its impulses; by 'energy-momentum', "
                "'generalized-alpha' and its kin")
    elif not dynamic and solver.condensed is not None:
        text = (f"lines condensed to {solver.condensed.size} displacements and rotations of nodes, "
                "sparse LDL^T of these: no multiplier is unknown")
    elif not dynamic and solver.coupled and (
            not system.constraints.few or system.forces.couples_far or not system.symmetric):
        text = "sparse LU on the null space of the joints"
    else:
        text = (f"banded {'Cholesky' if system.symmetric else 'LU'}, half bandwidth "
                f"{system.K.width}{'' if system.symmetric else ': a force has no potential'}")
        if m:
            text += f", with a Schur complement for the {m} equations of joints"
            text += "" if dynamic else "; sparse LU with these if joints prevent rigid motions"
    plan["linear solver"] = text
    if kind == "linear":
        plan["compiled loop"] = "no: one solve"
    else:
        chosen, reason = (system.backend.choose("steps", STEPS * OF_STEP) if dynamic else
                          system.backend.choose("equilibrium", ITERATIONS))
        plan["compiled loop"] = "no" if chosen == "plain" else "yes"
        plan["compiled loop"] += f", for {STEPS} steps: {reason}" if dynamic else f": {reason}"
    if dynamic:
        scheme, reason = choose_scheme(system)
        plan["scheme"] = f'scheme="auto" takes {scheme!r}: {reason}'
    return plan


# adaptive solutions: h-refinement, or p-refinement where the solution is smooth

logger = logging.getLogger(__name__)

#: Fraction of the squared error whose elements are halved (bulk criterion).
BULK = 0.7

#: Least reduction of the error by a higher degree for a smooth solution.
SMOOTH = 10.0

#: Error measures.
GOALS = ("displacement", "strain")

#: Relative error of a frequency that gives a warning, and largest number of DOFs for an estimate.
ROUGH, MOST_HALVED = 0.03, 30_000

#: Default and largest limit of the number of elements.
MOST_ELEMENTS, MAX_ELEMENTS = 20000, 10**7


@dataclass(frozen=True)
class Refinement:
    """One round of an adaptive solution for one beam. ``beam`` is its number; ``kind`` is "degree"
    if the degree along the axis was raised, "split" if elements were halved; ``degree`` and
    ``elements`` are the new ones, ``error`` the estimate before."""

    beam: int
    kind: str
    degree: int
    elements: int
    error: float


def solve_adaptive(scene: Any, tol: float, max_elements: int, goal: str, max_degree: int,
                   find: Callable[..., StaticResult]) -> State:
    """Solve with higher degrees or on finer meshes until the estimated error is small enough."""
    # With the goal "displacement" each round solves twice. The second solution has the next degree
    # (:meth:`~skfem_ancf.elements.ElementBeam.raised`) for beams whose error decreased at least
    # tenfold with each degree so far (smooth solutions), and halved elements for the others. The
    # difference is the estimate: of the displacement of the beams' ends relative to the size of the
    # scene, and of the strain energy, relative. For the next round smooth beams take the higher
    # degree (Melenk, Wohlmuth: "On residual-based a posteriori error estimation in hp-FEM",
    # Advances in Computational Mathematics 15 (2001)); in the others the elements are halved that
    # contribute most. Beams on a curve are always halved, as a higher degree does not improve their
    # geometry. With the goal "strain" the estimate is the difference of the elements' strain and
    # the recovered one in the L2 norm, relative, and the elements that contribute most are halved.
    tol = require_positive("adapt", tol)
    max_elements = require_integer("max_elements", max_elements, 1, MAX_ELEMENTS)
    max_degree = require_integer("max_degree", max_degree, 1, DEGREES[-1])
    if require_option("goal", goal, GOALS) == "strain":
        return _solve_for_strain(scene, tol, max_elements, find)
    rounds = _Rounds(scene, tol, max_degree)
    while True:
        # each mesh starts from the reference configuration: the solution of a coarse mesh has
        # spurious strains on a finer one, and is a poor start
        coarse, state = rounds.scene, rounds.state or solve_static(
            rounds.scene.system, None, None, find)
        fine = _changed(coarse, elements=[rounds.raised(k) for k in range(len(coarse.beams))])
        better = solve_static(fine.system, None, None, find)
        # the contribution of each beam to the larger of both parts of the estimate
        total, changes, errors = better.strain_energy, [0.0], []
        for a, b in zip(coarse.beams, fine.beams):
            u, v = state.u_of(a), better.u_of(b)
            there, here = (np.append([0, -1], chain_ends(beam)) for beam in (a, b))
            ends = v.reshape(-1, b.nd)[here, :2] - u.reshape(-1, a.nd)[there, :2]
            changes.append(float(np.max(np.hypot(*np.transpose(ends)))) / coarse.system.size)
            energy = float(b.kernel.energy(v) - a.kernel.energy(u)) / (total or 1.0)
            errors.append(max(changes[-1], abs(energy)))
        estimate = {"displacement": max(changes),
                    "energy": abs(total - state.strain_energy) / (abs(total) or 1.0)}
        better = better.replace(error_estimate=estimate, scene=fine,
                                refinements=rounds.done(errors, fine))
        n = sum(b.mesh.nelements for b in fine.beams)
        logger.info("%d elements, %d coordinates, estimated error %.3g", n, fine.layout.N,
                    max(estimate.values()))
        if rounds.judge(errors) and max(estimate.values()) <= tol:
            return better
        if n >= max_elements:
            raise _too_few(n, estimate, tol, better)
        rounds.advance(state, fine, better, errors)


class _Rounds:
    """The beams of an adaptive solution, and their next refinement."""

    def __init__(self, scene: Any, tol: float, max_degree: int) -> None:
        self.scene, self.tol, self._most = scene, tol, max_degree
        self.state: State | None = None  # where a round has solved the scene of the next
        self._rough: set[int] = set()
        self._before: dict[int, float] = {}
        self._refinements: tuple[Refinement, ...] = ()

    def raised(self, k: int) -> Any:
        """The element of a beam of the next degree; None if its elements are to be halved."""
        element = self.scene.beams[k].element
        # the axis on a curve is cubic: a higher degree does not improve the geometry
        may = (k not in self._rough and element.axis_degree + 2 <= self._most
               and self.scene.beams[k].mesh.curve is None)
        return element.raised() if may else None

    def done(self, errors: list[float], scene: Any) -> tuple[Refinement, ...]:
        """All refinements, with those from the current scene to another one."""
        return self._refinements + tuple(
            Refinement(k, "split" if new.mesh.nelements > old.mesh.nelements else "degree",
                       new.element.axis_degree, new.mesh.nelements, errors[k])
            for k, (old, new) in enumerate(zip(self.scene.beams, scene.beams))
            if new.nd > old.nd or new.mesh.nelements > old.mesh.nelements)

    def judge(self, errors: list[float]) -> bool:
        """Find beams that gain little from a higher degree; False if that is unknown or new."""
        sure = True
        for k, error in enumerate(errors):
            if self.raised(k) is None:
                continue
            before = self._before.get(k)
            if before is None:
                sure = False
            elif (error * SMOOTH > before and error > 0.1 * self.tol
                  and error >= 0.5 * max(errors)):  # a small one may be another beam's
                self._rough.add(k)
                sure = sure and before <= self.tol
        return sure

    def advance(self, state: State, fine: Any, better: State, errors: list[float]) -> None:
        """Raise degrees where that pays; halve the elements that matter in other beams."""
        beams = self.scene.beams
        split = [new.mesh.nelements > old.mesh.nelements for old, new in zip(beams, fine.beams)]
        raised = [None if error <= 0.1 * self.tol and k in self._before else self.raised(k)
                  for k, error in enumerate(errors)]
        self._before = {k: e for k, e in enumerate(errors) if self.raised(k) is not None}
        if all(e is not None for e in raised):
            self._refinements, self.scene, self.state = self.done(errors, fine), fine, better
            return
        # elements with most of the difference in the energy norm, of beams whose elements the fine
        # mesh has halved; where the loads of both meshes differ, as those that jump within an
        # element, the work of their difference is included
        before = self.scene.system.external_force(state.u)
        after, shares = fine.system.external_force(better.u), []
        for a, b, s in zip(beams, fine.beams, split):
            if not s:
                shares.append(np.zeros(a.mesh.nelements))
                continue
            v, t, nb, halving = better.u_of(b), a.mesh.t, a.element.nodal_dofs, _halving(a)
            d = v - _prolonged(a, halving, state.u_of(a))
            # the force on the finer mesh, restricted to the coarse one by the transpose
            new = np.insert(np.zeros(a.mesh.p.shape[1], dtype=bool), t[1], True)
            force = after[fine.system.of(b)].reshape(-1, nb, 2)
            gap, ends = force[~new], np.einsum("eij,eic->ejc", halving, force[new])
            np.add.at(gap, t[0], ends[:, :nb])
            np.add.at(gap, t[1], ends[:, nb:])
            gap -= before[self.scene.system.of(a)].reshape(gap.shape)
            work = np.abs(np.sum(gap * d.reshape(force.shape)[~new], axis=(1, 2)))
            d = b.kernel.gather(d).reshape(b.mesh.nelements, -1)
            local = np.abs(np.einsum("ei,eij,ej->e", d, b.kernel.tangents(v), d))
            shares.append(local.reshape(-1, 2).sum(axis=1) + 0.5 * work[t].sum(axis=0))
        chosen = _largest(np.concatenate(shares), [len(e) for e in shares])
        marked = [c if s else np.arange(0) for c, s in zip(chosen, split)]
        scene, self.state = self.scene, state
        if any(e is not None for e in raised) or any(len(m) for m in marked):
            scene, self.state = _changed(self.scene, marked, raised), None
        self._refinements, self.scene = self.done(errors, scene), scene


def _changed(scene, marked=None, elements=None):
    """The scene with marked elements halved, all by default, or other kinds of elements."""
    marked = marked or [np.arange(b.mesh.nelements) for b in scene.beams]
    return scene.replace(beams=[
        b.replace(mesh=b.mesh.refined(m)) if e is None else b.replace(element=e)
        for b, m, e in zip(scene.beams, marked, elements or [None] * len(marked))])


def frequency_errors(scene: Any, modes: Modes) -> Array:
    """Relative errors (k,) of frequencies at rest by the mesh of the beams; NaN if not known."""
    # They are the change as all elements are halved, times 4/3: the sum of all further changes for
    # elements of second order, a quarter too large for those of fourth order. The shapes are
    # improved on the halved elements by two steps of subspace iteration (Xu, Zhou: "A two-grid
    # discretization scheme for eigenvalue problems", Mathematics of Computation 70 (2001)). A
    # ModelWarning says where errors are large.
    nothing = np.full(len(modes.frequencies), np.nan)
    if scene.layout.N > MOST_HALVED or not scene.beams or np.iscomplexobj(modes.shapes):
        return nothing
    try:
        fine = _changed(scene)
        shapes = np.zeros((len(nothing), fine.layout.N))
        for a, b in zip(scene.layout.members, fine.layout.members):
            part = modes.shapes[:, scene.system.of(a)]
            shapes[:, fine.system.of(b)] = part if not isinstance(a, Beam) else [
                _prolonged(a, _halving(a), one) for one in part]
        better = improved(fine.system, shapes)
    except AncfError as error:
        logger.info("no estimate of the error of frequencies: %s", error)
        return nothing
    rigid = better <= ROUND_OFF * np.sqrt(scene.system.scales.bending_eigenvalue)
    errors = np.where(rigid, np.nan, 4.0 / 3.0 * np.abs(
        modes.frequencies / np.where(rigid, 1.0, better) - 1.0))
    if len(bad := np.flatnonzero(errors > ROUGH)):
        warn(f"the mesh is coarse for {len(bad)} of {len(errors)} frequencies, modes.errors: "
             f"number {bad[0]} is about {100 * errors[bad[0]]:.2g} % off. Use mesh.refined(), or "
             "ElementBeamANCFCubic(2) or ElementBeamCable(5) (docs/choose.md)", ModelWarning)
    return errors


def _too_few(n, estimate, tol, state):
    return ConvergenceError(
        f"{n} elements leave an estimated error of {max(estimate.values()):.3g}, adapt = {tol:g} "
        "is not reached: raise max_elements or use an element of higher order", state)


def _solve_for_strain(scene, tol, max_elements, find):
    before = 0, np.inf
    while True:
        state = solve_static(scene.system, None, None, find)
        parts = [strain_error(state, b) for b in scene.beams]
        errors, sizes = (np.concatenate(x) for x in zip(*parts))
        size = sizes.sum()
        estimate = {"strain": float(np.sqrt(errors.sum() / size)) if size else 0.0}
        state = state.replace(error_estimate=estimate, scene=scene)
        logger.info("%d elements, estimated error of the strain %.3g", len(errors),
                    estimate["strain"])
        if estimate["strain"] <= tol:
            return state
        if len(errors) >= 2 * before[0]:
            if estimate["strain"] > 0.95 * before[1]:
                raise ConvergenceError(
                    f"the estimated error of the strain stays at {estimate['strain']:.3g}, adapt = "
                    f"{tol:g} is not reached: use an element of higher order", state)
            before = len(errors), estimate["strain"]
        if len(errors) >= max_elements:
            raise _too_few(len(errors), estimate, tol, state)
        scene = _changed(scene, _largest(errors, [len(e) for e, _ in parts]))


def strain_error(state: State, beam: Beam) -> tuple[Array, ...]:
    """Squared L2 norms by element: recovered minus elements' strain, and the strain."""
    recovery = state.recovery(beam)
    if recovery is None:
        k = list(state.beams).index(beam)
        raise InputError('the goal "strain" needs recovered fields, which this scene has not: '
                         f"{list(state.recovered.values())[k]}")
    weights = np.array([1.0, 1.0, 0.5])  # eps_xy twice, from its double
    ne, (x, w) = beam.mesh.nelements, gauss(5)
    out, e, xi = np.zeros((2, ne)), np.repeat(np.arange(ne), 5), np.tile(x, ne)
    for layer in beam.across.layers:
        eta, v = beam.across.points(layer, e, xi, 2 * max(beam.element.order, 1) + 1)
        X = np.array([xi[:, None] + 0.0 * eta, eta]).reshape(2, ne, -1)
        dV = (v * np.tile(w, ne)[:, None]).reshape(ne, -1) * beam.mesh.mapping().detDF(X)
        of = np.repeat(np.arange(ne), X.shape[-1])
        strain = recovery.at(of, X.reshape(2, -1), slice(3)).reshape(3, *X.shape[1:])
        gap = strain - beam.strain(state.u_of(beam), X)
        out += [np.einsum("k,kep,ep->e", weights, f * f, dV) for f in (gap, strain)]
    return tuple(out)


def _halving(beam):
    """Nodal DOFs in the middle of each element by those of its ends, (ne, nb, 2 nb)."""
    slope = np.array([f[1] for f in beam.element.functionals])
    L = beam.mesh.lengths[:, None, None]
    return (beam.element.halving[beam.element.nodal_dofs:] * L ** np.tile(slope, 2)) / (
        0.5 * L) ** slope[:, None]


def _prolonged(beam, halving, u):
    """The same displacement on halved elements: the spaces are nested."""
    u, t = u.reshape(-1, beam.element.nodal_dofs, 2), beam.mesh.t
    middle = np.einsum("eij,ejc->eic", halving, np.concatenate([u[t[0]], u[t[1]]], axis=1))
    return np.insert(u, t[1], middle, axis=0).ravel()


def _largest(errors, numbers):
    """For each beam its elements among those with most of the squared error."""
    order = np.argsort(-errors)
    keep = order[:1 + int(np.searchsorted(np.cumsum(errors[order]), BULK * errors.sum()))]
    chosen = np.zeros(len(errors), dtype=bool)
    chosen[keep] = True
    return [np.nonzero(c)[0] for c in np.split(chosen, np.cumsum(numbers)[:-1])]
