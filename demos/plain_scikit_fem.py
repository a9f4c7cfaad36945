"""The gravity cantilever with scikit-fem alone: Basis, asm, get_dofs, condense and a Newton loop.

    python demos/plain_scikit_fem.py

The mesh, the element and the forms come from skfem_ancf; all else is scikit-fem. It is solved
twice: with the forms of the continuum, and with those of the default formulation, which does not
lock. The answers are those of :class:`skfem_ancf.Scene`.
"""

import numpy as np
from skfem import Basis, ElementVector, asm, condense, solve

from skfem_ancf import (Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff, forms,
                        reference_coordinates)

MESH = MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01)
MATERIAL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800, plane="stress")
WIDTH, G = 0.01, (0.0, -9.81)


FORMULATIONS = ("continuum", "assumed")


def make_beam(formulation, mesh=MESH):
    """The cantilever; a Scene takes it, and so does ``forms.of``."""
    return Beam(mesh, ElementBeamANCF(3), MATERIAL, WIDTH, formulation)


def newton(formulation="continuum", mesh=MESH, steps=10, tol=1e-10):
    """Tip displacement by Newton's method in equal load steps; returns it and the iterations."""
    basis = Basis(mesh, ElementVector(ElementBeamANCF(3)))
    # a welded face: the position of all of its points, not the slope r_X
    clamped = basis.get_dofs("left").all(["r^1", "r^2", "r_Y0^1", "r_Y0^2", "r_Y1^1", "r_Y1^2",
                                          "r_Y2^1", "r_Y2^2"])
    free = basis.complement_dofs(clamped)
    if formulation == "continuum":  # the weak forms as they stand
        internal, tangent = forms.internal_force(MATERIAL, WIDTH), forms.tangent(MATERIAL, WIDTH)
    else:
        _, internal, tangent = forms.of(make_beam(formulation, mesh))
    weight = asm(forms.gravity(MATERIAL.density, G, WIDTH), basis)
    q = reference_coordinates(basis)
    iterations = 0
    for load in np.linspace(0, 1, steps + 1)[1:]:
        for _ in range(50):
            residual = load * weight - asm(internal, basis, r=q)
            dq = solve(*condense(asm(tangent, basis, r=q), residual, D=clamped))
            q += dq
            iterations += 1
            if abs(residual[free] @ dq[free]) < tol**2 * abs(load * weight @ q):
                break
        else:
            raise RuntimeError(f"no convergence at load {load}")
    # probes gives the rows of x, then those of y; point_source would give x only
    tip = basis.probes(np.array([[1.0], [0.0]])) @ q
    return tip - np.array([1.0, 0.0]), iterations


def main(steps=10):
    """Solve it both ways and compare; returns the tip displacements of both formulations."""
    tips = []
    for formulation in FORMULATIONS:
        tip, iterations = newton(formulation, steps=steps)
        state = Scene(make_beam(formulation)).clamp("left").gravity(G).solve_static()
        short = state.displacement((1, 0))
        print(f"{formulation}, plain scikit-fem: tip ({tip[0]:.9f}, {tip[1]:.9f}), "
              f"Newton, {iterations} iterations")
        print(f"{formulation}, Scene:            tip ({short[0]:.9f}, {short[1]:.9f}), "
              f"{state.iterations} iterations")
        assert np.allclose(tip, short, rtol=0, atol=1e-8)
        tips.append((tip, short))
    return tips


if __name__ == "__main__":
    main()
