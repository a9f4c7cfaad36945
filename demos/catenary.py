r"""A hanging rope and the catenary
===============================

A rope hangs between two hooks, and its shape and tension are compared with the catenary.

The rope is a beam whose bending stiffness is negligible. It starts straight, with one end far from
its hook. This end moves to the hook in steps, while the rope sags.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A cord 2.5 m long and 1 mm thick; the hooks are 2 m apart.

length, span, height, g = 2.5, 2.0, 1e-3, 9.81
hemp = StVenantKirchhoff(E=1e8, nu=0.0, density=1200)
weight = hemp.density * height**2 * g

mesh = MeshBeam.init_line(np.linspace(0, length, 41), height)
rope = Beam(mesh, ElementBeamCable(5), hemp, height)


def hang(distance, start=None):
    scene = Scene(rope).pin("left").gravity((0, -g))
    scene.fix("right", "r^1", displacement=distance - length).fix("right", "r^2")
    return scene.solve_static(start=start)


# %%
# The end moves in steps. Each solution starts from the one before.

states = [hang(0.99 * length)]
for distance in np.linspace(0.97 * length, span, 4):
    states.append(hang(distance, states[-1]))
state = states[-1]

# %%
# **The catenary** :math:`y = a \cosh(x / a)` with the length of the rope; a is the horizontal force
# over the weight per length.

a = brentq(lambda a: 2 * a * np.sinh(span / 2 / a) - length, 0.1, 10)
sag = a * (np.cosh(span / 2 / a) - 1)
middle = state.position((length / 2, 0))
horizontal = -state.reactions("left").force[0]
print(f"sag {-middle[1]:.5f} m, catenary {sag:.5f} m")
print(f"horizontal force {horizontal:.4f} N, catenary {weight * a:.4f} N")
assert np.isclose(-middle[1], sag, rtol=1e-3) and np.isclose(horizontal, weight * a, rtol=5e-3)

# %%
# The tension at each point is the weight per length times the height above the directrix of the
# catenary.

s = np.linspace(0.05, 0.95, 19) * length
points = np.array([s, 0 * s])
x, y = state.position(points)
curve = a * np.cosh((x - span / 2) / a) - a * np.cosh(span / 2 / a)
tension = state.resultants(points).N
print(f"distance from the catenary at most {1e3 * np.max(abs(y - curve)):.2f} mm; tension within "
      f"{100 * np.max(abs(tension / (weight * a * np.cosh((x - span / 2) / a)) - 1)):.2f} %")
assert np.max(abs(y - curve)) < 1e-3 * length

fig, ax = plt.subplots(figsize=(7, 5.4), layout="constrained")
plot_state(states, lambda v: 1e-3 * v["S_xx"], ax=ax, thickness=12, undeformed=False,
           title="stress along the rope", unit="kPa", cmap="viridis")
x = np.linspace(0, span, 101)
ax.plot(x, a * np.cosh((x - span / 2) / a) - a * np.cosh(span / 2 / a), "k:", zorder=5,
        label="catenary")
ax.plot([0, span], [0, 0], "ko", ms=6)
ax.set(xlabel="x (m)", ylabel="y (m)")
ax.legend(frameon=False, loc="lower right")
plt.show()
