r"""A soft finger under pressure
============================

A silicone finger bends under pressure, and its shape is compared with the elastica under a follower
load.

The pressure acts on its lower face and turns with it. So it bends the finger further than a dead
load: the finger curls.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, NeoHookean, Scene
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A finger 100 mm long and 6 mm thick, of neo-Hookean material in plane strain.

length, height, width = 0.1, 6e-3, 0.03
silicone = NeoHookean(E=1e6, nu=0.45, plane="strain")
EI = silicone.E / (1 - silicone.nu**2) * width * height**3 / 12
mesh = MeshBeam.init_line(np.linspace(0, length, 17), height)
finger = Beam(mesh, ElementBeamANCFCubic(3), silicone, width)


def pumped(pressure, start=None):
    scene = Scene(finger).clamp("left", thickness="free").pressure("bottom", pressure)
    return scene.solve_static(start=start)


# %%
# **The elastica**, with angle, moment, normal and shear force, and position. The load p b stays
# normal to it, and acts on the lower face, which becomes longer. Lengths are in L, forces in
# EI/L^2.


def line(full):
    def equations(s, v):
        angle, M, N, Q = v[:4]
        face = 1 + M * height / (2 * length)
        return np.array([M, -Q, M * Q, -M * N - load * face, np.cos(angle), np.sin(angle)])

    def ends(a, b):
        return np.array([a[0], b[1], b[2], b[3], a[4], a[5]])

    s = np.linspace(0, 1, 61)
    guess = np.zeros((6, 61))
    guess[4] = s
    for load in np.linspace(0.1, 1, 10) * full:
        found = solve_bvp(equations, ends, s, guess, tol=1e-8)
        s, guess = found.x, found.y
    return found.sol(1.0)


pressures = np.array([100.0, 200.0, 400.0, 600.0])
states = []
for pressure in pressures:
    states.append(pumped(pressure, states[-1] if states else None))
    load = pressure * width * length**3 / EI
    angle, *_, x, y = line(load)
    tip = states[-1].position((length, 0)) / length
    print(f"{pressure:g} Pa: tip at {tip.round(4)} L, line at [{x:.4f} {y:.4f}], which has "
          f"turned by {np.degrees(angle):.0f} degrees")
    assert np.hypot(*(tip - [x, y])) < 0.02

fig, ax = plt.subplots(figsize=(6.6, 5.4), layout="constrained")
plot_state(states, "eps_yy", ax=ax, thickness=1,
           title=r"strain across the finger $\varepsilon_{yy}$ at 100, 200, 400 and 600 Pa")
ax.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
