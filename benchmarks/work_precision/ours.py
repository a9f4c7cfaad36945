"""Runs of this package."""

import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, Section, StVenantKirchhoff)
from skfem_ancf.dynamics import Gauss

from .problems import GRAVITY, THROW_ALONG, arm_angle, throw
from .runs import Run, Solver, grading

CODE = "skfem-ancf"
ELEMENTS = {"ancf": ElementBeamANCF, "cubic": ElementBeamANCFCubic, "cable": ElementBeamCable}


def scene(problem, element, n, formulation="assumed", compiled=True, grade=1.0):
    """The problem as a scene of one beam of n elements, smaller towards the root if grade > 1."""
    p = problem
    mesh = MeshBeam.init_line(p.L * grading(n, grade), height=p.h)
    thick = p.load == "traction"
    material = StVenantKirchhoff(p.E, p.nu, p.rho, shear_correction=1.0 if thick else "auto")
    rod: dict = dict(material=material, width=p.b)
    if isinstance(element, ElementBeamCable) and p.t_end is not None:  # no rotary inertia
        A = p.b * p.h
        rod = dict(section=Section.numbers(EA=p.E * A, EI=p.E * A * p.h**2 / 12, rhoA=p.rho * A,
                                           rhoI=1e-9 * p.rho * A * p.h**2))
    s = Scene(Beam(mesh, element, formulation=formulation, compiled=compiled, **rod))
    if p.support == "clamp":
        s.clamp("left", thickness="fixed" if thick else "free")
    elif p.support in ("pin", "arm"):
        s.pin("left")
    if p.support == "arm":
        s.joint("angle", at="left", angle=arm_angle)
    if p.support == "free":
        def velocity(x):
            vy, slope = throw(x[0], p.L)
            return np.array([THROW_ALONG - x[1] * slope, vy])
        s.initial_velocity(velocity)
    if p.load == "gravity":
        s.gravity((0.0, -GRAVITY))
    elif p.load == "force":
        s.point_force((0.0, -p.value), at=p.tip)
    elif p.load == "traction":
        s.traction("right", (0.0, -p.value / (p.b * p.h)))
    elif p.load == "moment":
        s.moment("right", p.value)
    return s


def element_of(kind, order):
    """An element, and the mechanical model that it converges to."""
    return ELEMENTS[kind](order), "cable" if kind == "cable" else f"section {order}"


def run(problem, kind, order, n, formulation="assumed", compiled=True, grade=1.0, steps=None,
        scheme="generalized-alpha", points=None, **options):
    """A Run: static, or in ``steps`` time steps (None with rtol: of automatic size).

    ``points`` are those of a method of Gauss.
    """
    p = problem
    element, model = element_of(kind, order)
    if model == "section 1" or formulation not in ("assumed", "continuum") and kind != "cable":
        model += " " + formulation  # it decides how the section couples
    words = [f"{kind} {order}", formulation, *([] if compiled else ["NumPy"]),
             *([f"graded {grade:g}"] if grade != 1.0 else [])]
    if p.t_end is not None:
        words.append({"energy-momentum": "EM", "generalized-alpha": "g-alpha"}.get(scheme, scheme)
                     + (f" of {points}" if points else ""))
    words += [f"{k} {v}" for k, v in options.items()]

    def build():
        s = scene(p, element, n, formulation, compiled, grade)

        if p.t_end is None:
            def solve():
                return s.solve_static(**options)

            def read(state):
                return state.displacement(p.tip), len(state.steps), state.iterations
        else:
            dt = "auto" if steps is None else p.t_end / steps

            def solve():
                return s.integrate(p.t_end, dt, scheme=Gauss(points) if points else scheme,
                                   t_eval=[p.t_end], progress=False, **options)

            def read(history):
                return history.displacement(p.tip)[-1], steps, history.iterations

        return Solver(solve, read, s.N)

    recipe = "ours", (kind, order, n), dict(
        options, formulation=formulation, compiled=compiled, grade=grade, steps=steps,
        scheme=scheme, points=points)
    return Run(p, CODE, ", ".join(words), n, model, build, steps, recipe)
