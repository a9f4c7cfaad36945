"""States for the equations of a scene, static solutions, and plans of solutions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

from ..core import (Array, ConvergenceError, InputError, Interrupted, NameUnknown, SupportError,
                    refuse, require_finite, require_option)
from ..dynamics.choice import choose_scheme
from ..dynamics.integrator import OF_STEP
from ..equations.system import System
from ..results.state import State
from ..solvers.iteration import ITERATIONS
from ..solvers.outcome import StaticResult

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
    refuse(not isinstance(state, State), "{} is a State, as solve_static returns it, got {}; "
           "scene.state(u) makes one of coordinates of shape ({},)", name, type(state).__name__,
           system.N)
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
            if why:  # degrees of freedom of the beam do not fit that of the scene
                who = "" if len(system.beams) == 1 else f" of beam {b.name or k}"
                raise InputError(
                    f"{name} is a state of another mesh{who}: {why}. Its coordinates mean "
                    "something else here; where they do not, scene.state(other.u) takes them over")
    places = [[(tuple(b.position), b.angle) for b in s.bodies] for s in (other, system)]
    if places[0] != places[1]:
        raise InputError(f"{name} is a state of other rigid bodies: at (position, angle) "
                         f"{places[0]} there, {places[1]} in the scene")
    return np.array(require_finite(f"{name}.u", state.u, (system.N,)))


def configuration(system: System, state: State) -> State:
    """A State with its multipliers, for a scene."""
    u = displacement(system, state, "state")
    if state.system is system:
        return state
    kinds = [[(type(j), j.equations) for j in s.constraints.joints] for s in (state.system, system)]
    if kinds[0] != kinds[1]:
        raise InputError("state has multipliers of other joints: "
                         f"{list(state.system.constraints.joints)} there, "
                         f"{list(system.constraints.joints)} in the scene; "
                         "scene.state(u, multipliers) takes them as they are")
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
