r"""Bent to a circle: the strain across the section
===============================================

A beam is bent to a circle by an end moment, and the strain across its section is compared with the
exact plane solution.

The moment :math:`2 \pi EI / L` is a usual test of beams. Here the test is the strain across the
section: outer fibres become thinner, inner ones thicker, and all are compressed by the bending. The
beams are twenty to a million times as long as high.
"""

import time

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import simpson, solve_bvp

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

length, width, elements = 1.0, 0.05, 24
material = StVenantKirchhoff(E=1e9, nu=0.3)
curvature = 2 * np.pi / length

# %%
# **The exact solution.** In pure bending all sections are the same. The fibre Y becomes a circle of
# radius r(Y), with stretch :math:`\kappa r` along the beam and r' across it. Equilibrium of the
# first Piola-Kirchhoff stress, :math:`P_{yy}' = \kappa P_{xx}`, with free faces is a boundary value
# problem for r and :math:`P_{yy}`. Its unknown here is :math:`(r - 1/\kappa)/h`.


def exact(height):
    """Places across the section, eps_yy there, and the moment."""
    nu, a = material.nu, curvature * height
    C = material.E / (1 - nu**2)

    def along(z):                                       # eps_xx, from the stretch 1 + a z
        return a * z * (1 + a * z / 2)

    def slope(z, P):                                    # of z by -Y/h, from P_yy = lambda_y S_yy
        lam = np.ones_like(P)
        for _ in range(20):
            S = C * ((lam**2 - 1) / 2 + nu * along(z))
            lam -= (lam * S - P) / (S + C * lam**2)
        return lam

    def equations(y, v):
        lam = slope(*v)
        S = C * (along(v[0]) + nu * (lam**2 - 1) / 2)
        return np.array([lam, a * (1 + a * v[0]) * S])

    y = np.linspace(-0.5, 0.5, 101)
    v = solve_bvp(equations, lambda p, q: np.array([p[1], q[1]]), y, np.array([y, 0 * y]),
                  tol=1e-10).sol(y)
    P = equations(y, v)[1] / a
    moment = simpson(P * v[0], x=y) * width * height**2
    return -height * y, (slope(*v)**2 - 1) / 2, moment

# %%
# **The beam**: the moment increases in four steps. Points across the middle section are compared
# with the exact strain, relative to the largest one.


def bend(height):
    Y, eps_yy, moment = exact(height)
    mesh = MeshBeam.init_line(np.linspace(0, length, elements + 1), height)
    beam = Beam(mesh, ElementBeamANCFCubic(3), material, width)
    states, start = [], time.perf_counter()
    for part in (0.25, 0.5, 0.75, 1.0):
        scene = Scene(beam).clamp("left", thickness="free").moment("right", part * moment)
        states.append(scene.solve_static(start=states[-1] if states else None))
    seconds = time.perf_counter() - start
    strain = states[-1].strain(np.array([np.full_like(Y, length / 2), Y]))[1]
    error = np.max(abs(strain - eps_yy)) / np.max(abs(eps_yy))
    gap = np.hypot(*states[-1].position((length, 0))) / length
    print(f"L/h = {length / height:9,.0f}: eps_yy off by {error:.1e}, circle open by {gap:.1e} L, "
          f"{sum(s.iterations for s in states)} iterations, {1e3 * seconds:.0f} ms")
    assert error < 1e-4
    return states, Y, strain, eps_yy


states, Y, strain, eps_yy = [bend(height) for height in (1e-6, 1e-4, 1e-2, 0.05)][-1]

# %%
# The strain across the section of the thick beam. With the rule :math:`-\nu \varepsilon_{xx}` alone
# it would be a straight line.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.6), width_ratios=(1.7, 1),
                                  layout="constrained")
largest = np.max(abs(eps_yy))
for k, state in enumerate(states):
    state.plot("eps_yy", ax=left, thickness=1, limits=(-largest, largest), undeformed=k == 0,
               colorbar=k == 3, title=r"strain across the section $\varepsilon_{yy}$ at "
               r"1/4, 1/2, 3/4 and 1 of $2 \pi EI/L$")
left.set(xlabel="x (m)", ylabel="y (m)")
right.plot(eps_yy, 1e3 * Y, lw=6, alpha=0.35, label="exact, plane body")
right.plot(strain, 1e3 * Y, "k", lw=1.2, label="beam, 24 elements")
right.plot(largest * np.array([1, -1]), 1e3 * Y[[0, -1]], "k:", lw=1, label="straight line")
right.set(xlabel=r"$\varepsilon_{yy}$", ylabel="Y (mm)", title="half way along the circle")
right.legend(frameon=False, fontsize=8, loc="lower left")
plt.show()
