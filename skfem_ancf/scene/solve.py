"""From the description of a scene to equations, and from solutions to states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..actions.forces import PointMass
from ..actions.forces.base import ForceElement
from ..actions.joints import Joint
from ..actions.loads import Load, bind_load
from ..actions.point_force import PointForce
from ..beam.beam import Beam
from ..beam.layout import Layout
from ..beam.masses import projected
from ..core.errors import (ConvergenceError, InputError, Interrupted, StabilityWarning,
                           SupportError, ask_field, require_finite, shown, warn)
from ..core.types import Array
from ..equations.linearised import linear_external_force, linear_force
from ..equations.system import System
from ..materials.damping import Damping
from ..results.checks import warn_of
from ..results.path import CriticalPoint
from ..results.state import State
from ..solvers import eigen
from ..solvers.outcome import StaticResult

#: Iterative refinement of linear solutions: largest number of solves with one factorisation,
#: largest number of degrees of freedom, and relative size of a correction to stop at.
LINEAR_SOLVES, SOLVED_AGAIN, CLOSE = 4, 50000, 1e-13


def system_of(layout: Layout, bound: Sequence[Any], fixed: dict[int, float],
              damping: Damping | None) -> System:
    """The equations of a scene."""
    loads = [one for one in bound if isinstance(one, Load)]
    elements = [one for one in bound if isinstance(one, ForceElement)]
    return System(layout.beams, loads + _weights(layout, loads, elements),
                  np.array(list(fixed), dtype=int), np.array(list(fixed.values()), dtype=float),
                  [one for one in bound if isinstance(one, Joint)], damping, elements,
                  layout.bodies, eigen.rest_modes, layout.domains)


def _weights(layout, loads, elements):
    """Weights of point masses."""
    masses = [one for one in elements if isinstance(one, PointMass) and one.mass]
    return [bind_load(PointForce(one.mass * load.g, one.at, None, load.amplitude), load.beam)
            for load in loads if getattr(load, "g", None) is not None
            for one in masses if layout.beam(one.beam) is load.beam]


def velocity_of(member: Any, v: Any) -> Array:
    """A velocity of the degrees of freedom of a member, shape (N,)."""
    if (isinstance(v, (list, tuple)) and len(v) == 2) or getattr(v, "shape", None) == (2,):
        uniform = require_finite("v", v, (2,))
        return velocity_of(member, lambda x: np.multiply.outer(uniform, np.ones(x[0].shape)))
    if callable(v):
        function = v

        def field(x: Array) -> Array:
            return ask_field("v(x)", function, x)

        v = projected(member, field) if isinstance(member, Beam) else member.velocity_of(field)
    return require_finite("v", v, (member.N,))


def solve_linear(system: System) -> State:
    """The small-displacement solution, see :meth:`skfem_ancf.Scene.solve_linear`."""
    system.constraints.require_supports()
    zero, none = np.zeros(system.N), np.zeros(system.constraints.m)
    system.assemble(zero, 1.0, geometric=False)
    system.solver.factorize(zero, 1.0, none)
    u, multipliers = np.zeros(system.N), none
    u[system.constraints.fixed] = system.constraints.values(1.0)
    gap, J = system.constraints.constraint(zero, 1.0), system.constraints.full_jacobian(zero, 1.0)
    # refine with residuals from strains: the assembled stiffness has round-off in bending
    for _ in range(LINEAR_SOLVES if system.N <= SOLVED_AGAIN else 1):
        rest = (linear_external_force(system, zero, u) - linear_force(system, zero, u)
                - multipliers @ J)
        du, dm = system.solver.solve(rest, -gap - J @ u)
        u, multipliers = u + du, multipliers + dm
        if np.max(np.abs(du)) <= CLOSE * np.max(np.abs(u)):
            break
    system.forces.contacts.require_free(u, "solve_linear()", "solve_static()")
    return State(system, u, iterations=1, message="linear, one factorisation",
                 multipliers=multipliers, base=State(system, zero, load=0.0))


def solve_static(system: System, u: Array | None, memory: Array | None,
                 find: Callable[..., StaticResult]) -> State:
    """The equilibrium under full load, without the warnings of :func:`warn_about`.

    ``find`` is :func:`skfem_ancf.solvers.solve_static` with its options.
    """
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
                 memory=result.memory)


def warn_about(state: State) -> None:
    """Warn of a doubtful static solution."""
    if state.doubt:
        warn(f"{state.doubt}; the state is {state.verdict}", StabilityWarning)
    warn_of(state)


def critical_of(point: CriticalPoint, system: System) -> Any:
    """The solver's data of a CriticalPoint of this system."""
    if not isinstance(point, CriticalPoint) or point.kind != "bifurcation":
        raise InputError("branch must be a point of path.critical_points of kind 'bifurcation', "
                         f"got {shown(point)}")
    if point.state.system is not system:
        raise InputError("the branch point belongs to another scene, or to this one before it was "
                         "changed: follow its path again")
    return point.critical
