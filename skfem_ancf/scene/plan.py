"""A description of what a solution uses: elements, solver, scheme, and why."""

from __future__ import annotations

from collections import Counter

from ..core.errors import NameUnknown, require_option
from ..dynamics.choice import choose_scheme
from ..dynamics.integrator import OF_STEP
from ..equations.system import System
from ..solvers.iteration import ITERATIONS

#: Assumed number of steps of a motion, which decides on compilation.
STEPS = 1000


class Plan(dict[str, str]):
    """What a solution uses, and why, by name; ``print(plan)`` shows all."""

    def __missing__(self, key: str) -> str:
        raise NameUnknown("term", key, self)

    def __str__(self) -> str:
        return "\n".join(f"{name:<{max(map(len, self))}}  {text}" for name, text in self.items())


def make_plan(system: System, kind: str) -> Plan:
    require_option("kind of solution", kind, ("static", "linear", "dynamic"))
    dynamic = kind == "dynamic"
    plan = Plan(elements="; ".join(
        f"{n} {name}" for name, n in Counter(_element(beam) for beam in system.beams).items())
        or "there are no beams")
    plan["linear solver"] = _linear_solver(system, dynamic)
    if kind == "linear":
        plan["compiled loop"] = "no: one solve"
    else:
        way, reason = (system.backend.choose("steps", STEPS * OF_STEP) if dynamic else
                       system.backend.choose("equilibrium", ITERATIONS))
        plan["compiled loop"] = "no" if way == "plain" else "yes"
        plan["compiled loop"] += f", for {STEPS} steps: {reason}" if dynamic else f": {reason}"
    if dynamic:
        scheme, reason = choose_scheme(system)
        plan["scheme"] = f'scheme="auto" takes {scheme!r}: {reason}'
    return plan


def _element(beam):
    """The element of a beam, what it samples, and what lies across it."""
    name = "beam" if beam.name is None else f"beam {beam.name!r}"
    across = "" if beam.across.simple else f", {beam.section!r}"
    return (f"{name} of {beam.mesh.nelements} x {beam.element!r}{across}, {beam.formulation.name} "
            f"strain at {beam.kernel.points_number} points an element")


def _linear_solver(s, dynamic):
    if dynamic and s.mass_solver.by_nodes:
        return ("lines condensed to displacements and rotations of nodes, sparse LDL^T of these, "
                "for steps and for the mass with its impulses; by 'energy-momentum', "
                "'generalized-alpha' and its kin")
    if not dynamic and s.solver.condensed is not None:
        return (f"lines condensed to {s.solver.condensed.size} displacements and rotations of "
                "nodes, sparse LDL^T of these: no multiplier is unknown")
    if not dynamic and s.solver.coupled and (
            not s.constraints.few or s.forces.far or not s.symmetric):
        return "sparse LU on the null space of the joints"
    solver = f"banded {'Cholesky' if s.symmetric else 'LU'}, half bandwidth {s.K.bandwidth}"
    solver += "" if s.symmetric else ": a force has no potential"
    if s.constraints.m:
        solver += f", with a Schur complement for the {s.constraints.m} equations of joints"
        solver += "" if dynamic else "; sparse LU with these if joints prevent rigid motions"
    return solver
