"""What a solution computes, keeps constant or skips, and why."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from ..dynamics.choice import choose_scheme
from ..dynamics.run import ITERATIONS as OF_STEP
from ..actions.eigenstrain import EigenStrain
from ..core.errors import NameUnknown, require_option
from ..core.origin import ours
from ..solvers.newton import ITERATIONS as OF_STATICS
from ..core.switch import expecting
from ..equations.system import System

KINDS = ("static", "linear", "dynamic")
#: Steps of a motion of which it is said whether they are compiled: how many there will be is not
#: known.
STEPS = 1000


class Item(NamedTuple):
    """One term: its name, "computed", "constant" or "skipped", and the reason."""

    term: str
    status: str
    reason: str


class Plan(tuple):
    """The items of a plan; ``plan["mass"]`` finds one by its term, ``print(plan)`` shows all."""

    def __getitem__(self, key):
        if not isinstance(key, str):
            return super().__getitem__(key)
        for item in self:
            if item.term == key:
                return item
        raise NameUnknown("term", key, [item.term for item in self])

    def __str__(self):
        width = max(len(item.term) for item in self)
        return "\n".join(f"{i.term:<{width}}  {i.status:<8}  {i.reason}" for i in self)


def make_plan(system: System, kind: str = "static", sensors: int = 0) -> Plan:
    """The plan of a scene."""
    require_option("kind of solution", kind, KINDS)
    return Plan([Item(*item) for part in (_energy, _matrices, _forces, _solution)
                 for item in part(system, kind)] + [Item(*_sensors(sensors, kind == "dynamic"))])


def _energy(s, _):
    """What belongs to the strain energy of the beams."""
    beams = s.beams
    points = sum(b.mesh.nelements * b.kernel.points_number for b in beams)
    if beams:
        yield "strain energy", "computed", f"{points} integration points, " + ", ".join(
            sorted({b.formulation.name for b in beams}))
    else:
        yield "strain energy", "skipped", "rigid bodies alone"
    shared = [b for b in beams if b.kernel.shared]
    yield "tables", "constant", (
        "one for all elements of a straight beam with equal elements"
        if len(shared) == len(beams) else "one for each element: curved or unequal elements")
    poisson = [b for b in beams if b.material.nu != 0 and b.has_sections]
    if poisson:
        yield "Poisson coupling", "computed", "nu = " + ", ".join(
            sorted({f"{b.material.nu:g}" for b in poisson}))
    else:
        yield "Poisson coupling", "skipped", "nu = 0, or a section without thickness strain"
    yield from _sections(s)
    held = [b for b in beams if b.kernel.constant is not None]
    yield "stabilisation", "constant" if held else "skipped", (
        "quadratic: one matrix" if held else "the quadrature leaves no mode out")


def _matrices(_, kind):
    """Tangent and mass."""
    dynamic, linear = kind == "dynamic", kind == "linear"
    yield "geometric term", "skipped" if linear else "computed", (
        "no stress in a linear solve" if linear else "the stress is not zero")
    yield "tangent", "constant" if linear else "computed", (
        "one assembly, one factorisation" if linear else
        "its factors are kept while the iteration contracts; where a step's own do not, "
        "stresses are carried" if dynamic else
        "each iteration; the last evaluates the force only")
    yield "mass", "constant" if dynamic else "skipped", (
        "assembled and factorised once" if dynamic else "no inertia in statics")


def _forces(s, kind):
    """What acts on the beams, and what holds them."""
    yield from (_bodies(s), _damping(s, kind == "dynamic"), _elements(s),
                _obstacles(s, kind == "linear"))
    dead = [load for load in s.loads if load.constant and load.amplitude is None]
    rest = [load for load in s.loads if load not in dead]
    yield "dead loads", "constant" if dead else "skipped", (
        f"{len(dead)} assembled when given" if dead else "there are none")
    yield "varying loads", "computed" if rest else "skipped", (
        f"{_kinds(rest)}: they depend on displacement or time" if rest else
        "no follower load, no amplitude")
    yield "multipliers", "computed" if s.constraints.m else "skipped", (
        f"{s.constraints.m} equations of {_kinds(s.constraints.joints)}" if s.constraints.m else
        "no joints" if not s.constraints.all_joints else "the joints only fix coordinates")


def _solution(s, kind):
    """How the equations are solved, and what is looked at."""
    beams, dynamic, linear = s.beams, kind == "dynamic", kind == "linear"
    yield "linear solver", "computed", _linear_solver(s, dynamic)
    rules = sorted({(b.element.order, t.section_points, t.layer.measure.spent)
                    for b in beams if b.has_sections for t in b.kernel.firsts})
    layer = " a layer" if any(len(b.across.layers) > 1 for b in beams) else ""
    yield "section quadrature", "constant" if rules else "skipped", (
        "; ".join(f"order {n}: {p} points{layer}, exact for degree {2 * p - 1 - spent} of {4 * n}"
                  for n, p, spent in rules) or "a cable has EA and EI")
    if linear:
        yield "compiled loop", "skipped", "one solve"
    else:
        with expecting(STEPS * OF_STEP if dynamic else OF_STATICS):
            way, reason = s.backend.choose("steps" if dynamic else "equilibrium")
        yield "compiled loop", "skipped" if way == "plain" else "computed", (
            f"whole {f'time steps, in blocks, of {STEPS}' if dynamic else 'iterations'}: {reason}")
    if dynamic:
        scheme, reason = choose_scheme(s)
        yield "scheme", "computed", f'scheme="auto" takes {scheme!r}: {reason}'
    yield "fields", "skipped", "strain and stress are computed where a State is asked for them"


def _sensors(number, dynamic):
    """Term, status and reason of sensors."""
    return "sensors", "computed" if number and dynamic else "skipped", (
        f"{number} read at every step" if number and dynamic else
        "they record motions" if number else "there are none")


def _linear_solver(s, dynamic):
    """How the linear systems of a system are solved."""
    bandwidth = s.K.bandwidth
    if dynamic and s.mass_solver.by_nodes:
        return ("lines condensed to displacements and rotations of nodes, sparse LDL^T of these, "
                "for steps and for the mass with its impulses; by 'energy-momentum', "
                "'generalized-alpha' and its kin")
    if not dynamic and s.solver.condensed is not None:
        return (f"lines condensed to {s.solver.condensed.size} displacements and rotations of "
                "nodes, sparse LDL^T of these: no multiplier is unknown")
    many = not s.constraints.few or s.forces.far or not s.symmetric
    if not dynamic and s.solver.coupled and many:
        return "sparse LU of the saddle-point matrix with the multipliers"
    solver = (f"banded Cholesky, half bandwidth {bandwidth}" if s.symmetric else
              f"banded LU, half bandwidth {bandwidth}: a force has no potential")
    if s.constraints.m:
        solver += ", with a Schur complement for the multipliers"
        if not dynamic:
            solver += "; sparse LU with these where joints hold what supports leave free"
    return solver


def _sections(s):
    """Terms, status and reasons of sections and stress-free strains, where there are any."""
    uneven = [b for b in s.beams if not b.across.simple]
    if uneven:
        yield "sections", "constant", ", ".join(sorted({_section(b) for b in uneven}))
    eigen = [load for load in s.loads if isinstance(load, EigenStrain)]
    if eigen:
        linear, nonlinear = (sum(of) for of in zip(*((load.linear, load.grows) for load in eigen)))
        kinds = (linear, "of sections, a constant matrix each"), (
            len(eigen) - linear - nonlinear, "of cables, normal forces and moments at points"), (
            nonlinear, "under laws that are not linear, asked twice at points")
        yield "stress-free strain", "computed", "; ".join(
            f"{number} {text}" for number, text in kinds if number) + ": compiled where beams are"


def _section(beam):
    """The section of a beam that is no rectangle of one height, width and material, in words."""
    mesh, layers = beam.mesh, len(beam.across.layers)
    what = [repr(beam.section)] if not beam.across.plain else []
    if mesh.heights is not None:
        what.append(f"height {np.min(mesh.heights):.4g} to {mesh.height:.4g}")
    if layers > 1:
        what.append(f"{layers} laws")
    if any(layer.grade is not None for layer in beam.across.layers):
        what.append("graded")
    return " ".join(what)


def _damping(s, dynamic):
    """Term, status and reason of what resists velocities."""
    lossy = sum(time > 0.0 for time in s.retardation)
    kinds = [text for text, there in (
        (f"{lossy} beam(s) resist the rate of their strain", lossy),
        ("dashpots, drag or force elements of your own", s.forces.resists),
        ("a part of the mass", s.damping.mass),
        (f"{len(s.damping.modal)} modes", len(s.damping.modal))) if there]
    if not kinds:
        return "damping", "skipped", "there is none"
    return ("damping", "computed", ", ".join(kinds)) if dynamic else (
        "damping", "skipped", "no velocities in statics")


def _bodies(s):
    """Term, status and reason of rigid bodies."""
    if not s.bodies:
        return "rigid bodies", "skipped", "there are none"
    return "rigid bodies", "computed", (f"{len(s.bodies)}: 4 coordinates each, a constant mass, a "
                                        "multiplier for the length of the director")


def _kinds(things):
    """How many there are of each kind, in words."""
    return ", ".join(f"{n} {name}" for name, n in Counter(
        type(getattr(thing, "item", thing)).__name__.lstrip("_") for thing in things).items())


def _elements(s):
    """Term, status and reason of force elements."""
    forces = s.forces
    if not forces.elements:
        return "force elements", "skipped", "no springs, no masses"
    known = sum(ours(getattr(element, "item", element)) for element in forces.own)
    return "force elements", "computed", (
        f"{_kinds(forces.elements)}: {len(forces.parts)} in tables, "
        f"{len(forces.contacts.obstacles)} obstacles, {len(forces.own) - known} of your own, "
        f"{known} by functions asked in Python, {len(forces.masses)} in the mass"
        + (f", {len(forces.sampled)} sampled" if forces.sampled else "")
        + (", some couple points far apart" if forces.far else ""))


def _obstacles(s, linear):
    """Term, status and reason of contact."""
    contacts = s.forces.contacts
    if not contacts.obstacles:
        return "obstacles", "skipped", "there are none"
    if linear:
        return "obstacles", "skipped", "a linear solution that enters one is refused"
    points = sum(len(group.first) for one in contacts.obstacles for group in one.groups)
    elements = sum(group.elements for one in contacts.obstacles for group in one.groups)
    how = [text for text, there in (
        ("friction", contacts.anchored),
        ("augmented Lagrangian", contacts.augmented),
        ("moving", contacts.moving), ("a distance in Python", contacts.own)) if there]
    return "obstacles", "computed", (
        f"{len(contacts.obstacles)}, {points} points of the surface where one of {elements} "
        "elements is near" + "".join(f", {text}" for text in how))
