r"""Laying a pipe on the seabed
===========================

The shape and the bending moment of a pipe between a ship and the seabed, compared with the
elastica.

The pull on the pipe and its largest curvature limit the operation. A catenary gives both, but
without bending stiffness: its curvature is largest at the touchdown point and zero beyond it. Here
the pipe is a beam and the bed an obstacle. The touchdown point results from the contact.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

from skfem_ancf import Beam, ElementBeamCable, Line, MeshBeam, Scene, Section

# %%
# A flooded steel pipe, given by its stiffnesses and its weight in water. It starts straight on the
# bed. Then its right end is lifted to the ship, which pulls with its propellers.

depth, length, diameter = 50.0, 250.0, 0.2                    # m
EA, EI, weight, thrust = 1.2e9, 5.6e6, 400.0, 4e4             # N, N m2, N/m in water, N

mesh = MeshBeam.init_line(np.linspace(0, length, 51), height=diameter)
section = Section.numbers(EA=EA, EI=EI, GA=EA / 3, rhoA=weight / 9.81, rhoI=1e-2)
pipe = Beam(mesh, ElementBeamCable(5), section=section)
scene = Scene(pipe).pin("left").gravity((0, -9.81))
scene.obstacle(Line((0, -diameter / 2)))
scene.fix("right", "r^2", displacement=depth).point_force((thrust, 0), at="right")
state = scene.solve_static()
print(state)

# %%
# **Check**: the elastica under its weight, from the touchdown point, with zero slope and curvature,
# to the ship, with zero curvature. The length between them is an unknown.


def along(s, y, length):
    _, _, angle, moment, lift = y
    pull = thrust * np.cos(angle) + lift * np.sin(angle)
    across = lift * np.cos(angle) - thrust * np.sin(angle)
    stretch = 1 + pull / EA
    return length[0] * np.array([stretch * np.cos(angle), stretch * np.sin(angle), moment / EI,
                                 -stretch * across, weight + 0 * s])


def ends(a, b, length):
    return np.array([a[0], a[1], a[2], a[3], b[1] - depth, b[3]])


c, s = thrust / weight, np.linspace(0, 1, 200)
hanging = np.sqrt(depth**2 + 2 * depth * c)                   # of the catenary, the start
x = c * np.arcsinh(hanging * s / c)
start = [x, np.hypot(c, hanging * s) - c, np.arctan(hanging * s / c), 0 * s, weight * hanging * s]
exact = solve_bvp(along, ends, s, start, p=[hanging], tol=1e-6)

lift = state.reactions("right").force[1]
s = np.linspace(0, length, 601)
sections = state.resultants(np.array([s, 0 * s]))
print(f"lift of the ship: {lift:.2f} N, elastica {exact.y[4, -1]:.2f} N")
print(f"largest moment: {sections.M.max():.2f} Nm, elastica {exact.y[3].max():.2f} Nm")
print(f"smallest radius: {EI / sections.M.max():.2f} m, of the catenary {c:.2f} m")
assert np.isclose(lift, exact.y[4, -1], rtol=1e-5)
assert np.isclose(sections.M.max(), exact.y[3].max(), rtol=1e-3)
bed = state.contact().total + state.reactions("left").force     # with the pin at the far end
assert np.allclose(bed, [-thrust, weight * length - exact.y[4, -1]], rtol=1e-4)

# %%
# The moment along the pipe, and that of the catenary. On the bed it is zero.

landing = length - exact.p[0]
fig, (top, below) = plt.subplots(2, 1, figsize=(8, 6), layout="constrained")
state.plot(lambda v: 1e3 * v["eps_xx"], ax=top, thickness=15, undeformed=False,
           title="strain along the pipe", unit="1e-3")
top.set(xlabel="x (m)", ylabel="y (m)")
below.plot(landing + exact.p[0] * exact.x, exact.y[3], lw=5, alpha=0.3, label="elastica")
beyond = s - (length - hanging)
below.plot(s, np.where(beyond > 0, EI / c / (1 + (beyond / c)**2), 0), "--", label="catenary")
below.plot(s, sections.M, "k", lw=1.2, label="computed")
below.set(xlabel="along the pipe (m)", ylabel="bending moment (Nm)")
below.legend(frameon=False)
plt.show()
