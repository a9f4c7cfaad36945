r"""A ring between two plates
=========================

A thin ring is compressed between two plates, and its force-displacement curve is compared with the
elastica.

At first the ring touches each plate at a point and follows the handbook formula. Then it becomes
flat there. From then on it lies on the plate along a growing length, with contact forces only at
both ends of it. By symmetry a quarter of the ring is enough.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

from skfem_ancf import Beam, ElementBeamANCFCubic, Line, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A ring of spring steel, 100 mm in diameter. Sections in the planes of symmetry stay in them.

radius, height, width = 0.05, 0.5e-3, 0.01
steel = StVenantKirchhoff(E=2.1e11, nu=0.3)
EI = steel.E * width * height**3 / 12
mesh = MeshBeam.init_curve(lambda s: radius * np.array([np.cos(s), np.sin(s)]),
                           np.linspace(0, np.pi / 2, 25), height)
ring = Beam(mesh, ElementBeamANCFCubic(2), steel, width)


def squeeze(way):
    """The quarter when the upper plate, of 10 N/mm^3, has come down by a way."""
    scene = Scene(ring).fix("left", ["r^2", "r_Y0^2", "r_Y1^2"])
    scene.fix("right", ["r^1", "r_Y0^1", "r_Y1^1"])
    plate = Line((0, radius + height / 2), normal=(0, -1))
    scene.obstacle(plate, stiffness=1e10, position=lambda t: (0, -way * t))
    return scene.solve_static(first_step=0.05)


# %%
# **The elastica**: the angle of the axis satisfies :math:`EI\, \theta'' = F/2 \cos\theta`, with the
# force F of a plate. As long as the ring touches at a point, F is the unknown. Then the free length
# is an unknown, too, with zero curvature at its end.


def elastica(way):
    quarter = radius * np.pi / 2

    def equations(s, v, p):
        ell = p[1] if len(p) > 1 else quarter
        return ell * np.array([v[1], p[0] * np.cos(v[0]) / radius**2, np.sin(v[0])])

    def ends(a, b, p):
        return np.array([a[0] - np.pi / 2, a[2], b[0] - np.pi, b[2] - radius + way,
                         b[1]][:3 + len(p)])

    s = np.linspace(0, 1, 41)
    guess = np.array([np.pi / 2 * (1 + s), np.full(41, 1 / radius), radius * np.sin(np.pi / 2 * s)])
    point = solve_bvp(equations, ends, s, guess, p=[1.0], tol=1e-8)
    if point.y[1, -1] < 0:
        point = solve_bvp(equations, ends, point.x, point.y, p=[point.p[0], 0.95 * quarter],
                          tol=1e-8)
    return 2 * point.p[0] * EI / radius**2


# %%
# The force of the plate, and that of the elastica. The first point is compared with linear theory,
# :math:`F = 2\, w\, EI / 0.1488\, R^3` for plates that approach by 2 w.

ways = radius * np.array([0.05, 0.15, 0.3, 0.4, 0.5])
states = [squeeze(way) for way in ways]
forces = np.array([-2 * state.contact().total[1] for state in states])
exact = np.array([elastica(way) for way in ways])
linear = 2 * EI / (0.1488 * radius**3)
for way, state, force, expected in zip(ways, states, forces, exact):
    touching = state.contact().points[0][state.contact().pressure > 0]
    print(f"{way / radius:.2f} R: {force:.3f} N, elastica {expected:.3f} N, linear "
          f"{linear * way:.3f} N; touches up to {1e3 * touching.max():.1f} mm from the middle")
assert np.allclose(forces, exact, rtol=0.01)
assert np.isclose(forces[0], linear * ways[0], rtol=0.1)

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.4), layout="constrained")
plot_state(states, "S_xx", ax=left, unit="Pa", title="a quarter, stress along the ring $S_{xx}$")
left.set(xlabel="x (m)", ylabel="y (m)")
grid = radius * np.linspace(0.01, 0.52, 40)
right.plot(2e3 * grid, [elastica(way) for way in grid], lw=5, alpha=0.3, label="elastica")
right.plot(2e3 * grid, linear * grid, "k:", label="linear theory")
right.plot(2e3 * ways, forces, "ko", ms=5, label="computed")
right.set(xlabel="way of the plates together (mm)", ylabel="force (N)")
right.legend(frameon=False)
plt.show()
