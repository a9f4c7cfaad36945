"""A first beam in plain scikit-fem
================================

A cantilever is solved with plain scikit-fem, by weak forms and Newton's method, and compared with a
``Scene``.

For users of scikit-fem: the mesh is a ``Mesh`` and the element an ``Element``, so ``Basis``,
``asm``, ``get_dofs`` and ``condense`` work as usual. The weak forms are written out as in a
textbook on nonlinear elasticity. The result equals that of a ``Scene`` to round-off.
"""

import matplotlib.pyplot as plt
import numpy as np
from skfem import Basis, BilinearForm, ElementVector, LinearForm, asm, condense, solve
from skfem.helpers import ddot, grad, mul, trace, transpose

from skfem_ancf import (Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff, forms,
                        reference_coordinates)

# %%
# A soft cantilever under its own weight. The unknown is the position r of the material points. Its
# gradient is the deformation gradient F.

E, nu, density, gravity = 2e8, 0.3, 7800.0, 9.81
length, side = 1.0, 0.01
lame = E * nu / (1 - nu**2), E / (2 * (1 + nu))     # of plane stress

mesh = MeshBeam.init_line(np.linspace(0, length, 17), height=side)
basis = Basis(mesh, ElementVector(ElementBeamANCF(3)))


def second_piola(strain):
    return lame[0] * trace(strain) * np.eye(2)[:, :, None, None] + 2 * lame[1] * strain


def strain(F):
    return 0.5 * (mul(transpose(F), F) - np.eye(2)[:, :, None, None])


@LinearForm
def internal_force(v, w):
    F = w.r.grad
    return side * ddot(mul(F, second_piola(strain(F))), grad(v))


@BilinearForm
def tangent(u, v, w):
    F = w.r.grad
    change = 0.5 * (mul(transpose(F), grad(u)) + mul(transpose(grad(u)), F))
    return side * ddot(mul(F, second_piola(change)) + mul(grad(u), second_piola(strain(F))),
                       grad(v))


@LinearForm
def weight(v, w):
    return -side * density * gravity * v[1]


# %%
# A clamp fixes the position of all points of the section: r, and all r_Y across the section. The
# slope r_X along the axis is a strain there, so it is free. ``newton`` applies the weight in six
# steps.

clamped = basis.get_dofs("left").all(["r^1", "r^2", *(f"r_Y{k}^{i}" for k in range(3)
                                                      for i in (1, 2))])
load = asm(weight, basis)


def newton(internal_force, tangent, steps=6, iterations=30):
    q = reference_coordinates(basis)
    for part in np.linspace(0, 1, steps + 1)[1:]:
        for _ in range(iterations):
            residual = part * load - asm(internal_force, basis, r=q)
            dq = solve(*condense(asm(tangent, basis, r=q), residual, D=clamped))
            q += dq
            if abs(dq).max() < 1e-10 * length:
                break
        else:
            raise RuntimeError(f"no convergence at {part:g} of the load")
    return q


# %%
# ``forms.of(beam)`` has the forms of the default formulation, which does not lock, for the same
# loop. The tip of an inextensible line moves down by 0.90313 m: the textbook forms are stiffer.

steel = StVenantKirchhoff(E=E, nu=nu, density=density)
for formulation in ("continuum", "assumed"):
    beam = Beam(mesh, ElementBeamANCF(3), steel, side, formulation)
    own = (internal_force, tangent) if formulation == "continuum" else forms.of(beam)[1:]
    q = newton(*own)
    tip = basis.probes(np.array([[length], [0.0]])) @ q - [length, 0]
    state = Scene(beam).clamp("left").gravity((0, -gravity)).solve_static()
    print(f"{formulation:10} plain: {tip[1]:.9f}  Scene: {state.displacement((length, 0))[1]:.9f}")
    assert np.allclose(tip, state.displacement((length, 0)), rtol=0, atol=1e-8)

fig, ax = plt.subplots(figsize=(6.4, 5), layout="constrained")
state.plot("eps_yy", ax=ax, title=r"strain across the section $\varepsilon_{yy}$")
ax.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
