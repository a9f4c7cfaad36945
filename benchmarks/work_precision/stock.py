"""Runs of stock scikit-fem: its forms on the same element, and Q2 quads."""

import numpy as np
from reproduction.continuum import constants, internal, tangent
from skfem import (Basis, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad, asm,
                   condense, solve)
from skfem.helpers import dot

from skfem_ancf import ElementBeamANCF, forms

from .ours import scene
from .problems import GRAVITY
from .runs import Run, Solver, grading

Q2, TEXTBOOK = "scikit-fem Q2", "scikit-fem forms"


def newton(u, load, held, steps, evaluate, size, tol):
    """Newton's method in load steps; returns u and the number of iterations."""
    count = 0
    for k in range(1, steps + 1):
        for _ in range(40):
            force, K = evaluate(u)
            du = solve(*condense(K, load * (k / steps) - force, D=held))
            u, count = u + du, count + 1
            largest = np.max(np.abs(du))
            if not np.isfinite(largest) or largest > 1e3 * size:
                raise RuntimeError("the iteration diverges")
            if largest < tol * size:
                break
        else:
            raise RuntimeError("no convergence in 40 iterations")
    return u, count


def q2(problem, nx, ny, steps=1, grade=1.0, tol=1e-7):
    """Run of the body as a mesh of nx x ny quadrilaterals of second order."""
    p = problem
    words = [f"{ny} across", f"{steps} load steps", *([f"graded {grade:g}"] if grade != 1 else [])]

    def build():
        mesh = MeshQuad.init_tensor(p.L * grading(nx, grade),
                                    np.linspace(-p.h / 2, p.h / 2, ny + 1))
        basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=4)
        if p.load == "gravity":
            load = LinearForm(lambda v, w: -p.rho * GRAVITY * v[1]).assemble(basis)
        else:
            pull = np.array([0.0, -p.value / (p.b * p.h)])[:, None, None]
            end = mesh.facets_satisfying(lambda x: np.isclose(x[0], p.L))
            load = LinearForm(lambda v, w: dot(pull, v)).assemble(
                FacetBasis(mesh, basis.elem, facets=end))
        held = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).flatten()
        lam, mu = constants(p.E, p.nu)
        probe = basis.probes(np.array([[p.L], [0.0]]))

        def evaluate(u):
            data = dict(state=basis.interpolate(u), lam=lam, mu=mu)
            return internal.assemble(basis, **data), tangent.assemble(basis, **data)

        return Solver(lambda: newton(basis.zeros(), load, held, steps, evaluate, p.L, tol),
                      lambda result: (probe @ result[0], steps, result[1]), basis.N)

    return Run(p, Q2, ", ".join(words), nx, "body", build, steps)


def textbook(problem, order, n, steps, tol=1e-7):
    """Run of the pairwise forms on ElementBeamANCF(order), assembled by scikit-fem itself."""
    p = problem

    def build():
        s = scene(p, ElementBeamANCF(order), n, "continuum")
        beam, system = s.beams[0], s.system
        basis, k_s = beam.basis, beam.material.shear_factor(beam.element)
        load, q0 = system.external_force(np.zeros(s.N)), beam.q0
        force = forms.textbook.internal_force(beam.material, p.b, k_s)
        stiffness = forms.textbook.tangent(beam.material, p.b, k_s)
        dofs, weights = beam.probe(p.tip)

        def evaluate(u):
            return asm(force, basis, r=q0 + u), asm(stiffness, basis, r=q0 + u)

        fixed = system.constraints.fixed
        return Solver(lambda: newton(np.zeros(s.N), load, fixed, steps, evaluate, p.L, tol),
                      lambda result: (result[0][dofs] @ weights, steps, result[1]), s.N)

    return Run(p, TEXTBOOK, f"ancf {order}, continuum, {steps} load steps", n, f"section {order}",
               build, steps)
