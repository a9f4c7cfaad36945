"""A description of what a solution computes, keeps constant or skips."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from ..dynamics.choice import choose_scheme
from ..dynamics.integrator import OF_STEP
from ..actions.eigenstrain import EigenStrain
from ..core.errors import NameUnknown, require_option
from ..core.origin import ours
from ..solvers.iteration import ITERATIONS
from ..equations.system import System

KINDS = ("static", "linear", "dynamic")
#: Assumed number of steps of a motion, which decides on compilation.
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
    require_option("kind of solution", kind, KINDS)
    dynamic, linear = kind == "dynamic", kind == "linear"
    return Plan([
        *_beams(system), *_matrices(dynamic, linear), *_forces(system, dynamic, linear),
        *_solution(system, dynamic, linear),
        _item("sensors", sensors and dynamic, f"{sensors} read at every step",
              "they record motions" if sensors else "there are none")])


def _item(term, there, reason, missing, status="computed"):
    return Item(term, status, reason) if there else Item(term, "skipped", missing)


def _beams(s):
    """Strain energy of the beams, their sections and eigenstrains."""
    beams = s.beams
    points = sum(b.mesh.nelements * b.kernel.points_number for b in beams)
    yield _item("strain energy", beams, f"{points} integration points, "
                + _listed(b.formulation.name for b in beams), "there are no beams")
    yield Item("tables", "constant", "one for all elements of a straight beam with equal elements"
               if all(b.kernel.shared for b in beams) else
               "one for each element: curved or unequal elements")
    poisson = [f"{b.material.nu:g}" for b in beams if b.material.nu != 0 and b.has_sections]
    yield _item("Poisson coupling", poisson, "nu = " + _listed(poisson),
                "nu = 0, or a section without thickness strain")
    uneven = [b for b in beams if not b.across.simple]
    if uneven:
        yield Item("sections", "constant", _listed(map(_section, uneven)))
    eigen = [load for load in s.loads if isinstance(load, EigenStrain)]
    if eigen:
        yield Item("eigenstrain", "computed", f"{len(eigen)} at the integration points, "
                   f"{sum(load.grows for load in eigen)} of them with nonlinear laws")
    yield _item("stabilisation", any(b.kernel.constant is not None for b in beams),
                "quadratic: one matrix", "the quadrature misses no mode", "constant")


def _matrices(dynamic, linear):
    yield _item("geometric term", not linear, "the stress is not zero",
                "no stress in a linear solve")
    yield Item("tangent", "constant", "one assembly, one factorisation") if linear else Item(
        "tangent", "computed", "its factors are reused while the iteration contracts; else "
        "stresses are independent" if dynamic else
        "each iteration; the last evaluates the force only")
    yield _item("mass", dynamic, "assembled and factorised once", "no inertia in statics",
                "constant")


def _forces(s, dynamic, linear):
    """Loads, supports and joints."""
    yield _item("rigid bodies", s.bodies, f"{len(s.bodies)}: 4 coordinates each, a constant mass, "
                "a multiplier for the length of the director", "there are none")
    lossy = sum(time > 0.0 for time in s.retardation)
    kinds = [text for text, there in (
        (f"{lossy} beam(s) resist the rate of their strain", lossy),
        ("dashpots, drag or user-defined force elements", s.forces.resists),
        ("a part of the mass", s.damping.mass),
        (f"{len(s.damping.modal)} modes", len(s.damping.modal))) if there]
    yield _item("damping", kinds and dynamic, ", ".join(kinds),
                "no velocities in statics" if kinds else "there is none")
    forces = s.forces
    known = sum(ours(getattr(element, "item", element)) for element in forces.custom)
    yield _item("force elements", forces.elements, (
        f"{_kinds(forces.elements)}: {len(forces.parts)} in tables, "
        f"{len(forces.contacts.obstacles)} obstacles, {len(forces.custom) - known} user-defined, "
        f"{known} by functions asked in Python, {len(forces.masses)} in the mass"
        + (f", {len(forces.sampled)} sampled" if forces.sampled else "")
        + (", some couple points far apart" if forces.far else "")), "no springs, no masses")
    yield _obstacles(forces.contacts, linear)
    dead = [load for load in s.loads if load.constant and load.amplitude is None]
    rest = [load for load in s.loads if load not in dead]
    yield _item("dead loads", dead, f"{len(dead)} assembled when given", "there are none",
                "constant")
    yield _item("varying loads", rest, f"{_kinds(rest)}: they depend on displacement or time",
                "no follower load, no amplitude")
    constraints = s.constraints
    yield _item("multipliers", constraints.m,
                f"{constraints.m} equations of {_kinds(constraints.joints)}",
                "the joints only fix degrees of freedom" if constraints.all_joints else "no joints")


def _solution(s, dynamic, linear):
    """Solution method and checks."""
    beams = s.beams
    yield Item("linear solver", "computed", _linear_solver(s, dynamic))
    rules = sorted({(b.element.order, t.section_points, t.layer.measure.spent)
                    for b in beams if b.has_sections for t in b.kernel.firsts})
    layer = " a layer" if any(len(b.across.layers) > 1 for b in beams) else ""
    yield _item("section quadrature", rules, "; ".join(
        f"order {n}: {p} points{layer}, exact for degree {2 * p - 1 - spent} of {4 * n}"
        for n, p, spent in rules), "a cable has EA and EI, or fibres", "constant")
    if linear:
        yield Item("compiled loop", "skipped", "one solve")
    else:
        way, reason = (s.backend.choose("steps", STEPS * OF_STEP) if dynamic else
                       s.backend.choose("balance", ITERATIONS))
        yield Item("compiled loop", "skipped" if way == "plain" else "computed", "whole " + (
            f"time steps, in blocks, of {STEPS}" if dynamic else "iterations") + f": {reason}")
    if dynamic:
        scheme, reason = choose_scheme(s)
        yield Item("scheme", "computed", f'scheme="auto" takes {scheme!r}: {reason}')
    yield Item("fields", "skipped", "strain and stress are computed where a State is asked")


def _linear_solver(s, dynamic):
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
        return "sparse LU on the null space of the joints"
    solver = (f"banded Cholesky, half bandwidth {bandwidth}" if s.symmetric else
              f"banded LU, half bandwidth {bandwidth}: a force has no potential")
    if s.constraints.m:
        solver += ", with a Schur complement for the multipliers"
        if not dynamic:
            solver += "; sparse LU with these if joints prevent rigid motions"
    return solver


def _section(beam):
    """A section that is not a uniform rectangle, as text."""
    mesh, layers = beam.mesh, len(beam.across.layers)
    what = [repr(beam.section)] if not beam.across.plain else []
    if mesh.heights is not None:
        what.append(f"height {np.min(mesh.heights):.4g} to {mesh.height:.4g}")
    if layers > 1:
        what.append(f"{layers} laws")
    if any(layer.grade is not None for layer in beam.across.layers):
        what.append("graded")
    return " ".join(what)


def _listed(words):
    return ", ".join(sorted(set(words)))


def _kinds(things):
    return ", ".join(f"{n} {name}" for name, n in Counter(
        type(getattr(thing, "item", thing)).__name__.lstrip("_") for thing in things).items())


def _obstacles(contacts, linear):
    groups = [group for one in contacts.obstacles for group in one.groups]
    how = [text for text, there in (
        ("friction", contacts.anchored), ("augmented Lagrangian", contacts.augmented),
        ("moving", contacts.moving), ("a distance in Python", contacts.custom)) if there]
    return _item(
        "obstacles", groups and not linear, ", ".join([
            f"{len(contacts.obstacles)}, {sum(len(group.first) for group in groups)} points of the "
            f"surface where one of {sum(group.elements for group in groups)} elements is near",
            *how]), "a linear solution that enters one is refused" if groups else "there are none")
