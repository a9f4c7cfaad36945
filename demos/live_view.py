r"""A live view: pull at a rod
==========================

An interactive view of a fishing rod, whose equilibrium follows a slider or the arrow of a force.

:meth:`skfem_ancf.Scene.explore` opens the view with pyvista. Each move computes a static solution
that starts from the one before. Here, without a display, function calls make the same moves.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, PointForce, Scene, StVenantKirchhoff

# %%
# A tapered fishing rod of 2 m, clamped at an angle, under its own weight.

length = 2.0
carbon = StVenantKirchhoff(E=6e10, nu=0.3, density=1600)
mesh = MeshBeam.init_line(np.linspace(0, length, 21), height=lambda s: 0.012 - 0.004 * s,
                          angle=np.pi / 4)
tip = (length / np.sqrt(2), length / np.sqrt(2))
scene = Scene(Beam(mesh, ElementBeamANCF(2), carbon, width=0.008)).clamp("left")
scene.gravity((0, -9.81))

# %%
# **A slider**: the line pulls down by up to 30 N. ``slider.plotter.show()`` opens a window, or a
# view in a notebook. ``slider.set`` does what a move of the slider does.

slider = scene.explore(lambda F: PointForce((0, -F), at=tip), (0, 30), title="pull (N)",
                       field="S_xx", off_screen=True)
pictures = []
for pull in (3, 12, 30):
    state = slider.set(pull)
    pictures.append(slider.plotter.screenshot())
    print(f"{pull:2d} N: the tip is at {state.position(tip).round(3)}")

# %%
# **An arrow**: the mouse drags its handle and turns the force; ``arrow.set`` does the same.

arrow = scene.explore(PointForce((0, -20), at=tip), field="S_xx", off_screen=True)
state = arrow.set((-10, -20))
pictures.append(arrow.plotter.screenshot())

# %%
# **Check**: the view shows the solution. The beam in it ends at the tip, the support carries force
# and weight, and the solution does not depend on the previous ones.

points = np.asarray(arrow.mesh.points)[:, :2]
assert np.min(np.hypot(*(points - state.position(tip)).T)) < 1e-3
root = state.reactions("left").force
weight = 9.81 * scene.beams[0].total_mass
assert np.allclose(root, [10, 20 + weight], rtol=1e-6)
again = scene.point_force((-10, -20), at=tip).solve_static(start=slider.state)
assert np.allclose(again.position(tip), state.position(tip), atol=1e-4)

# %%
# Three positions of the slider, and the arrow.

fig, axes = plt.subplots(2, 2, figsize=(9.8, 7.0), layout="constrained")
for ax, picture in zip(axes.flat, pictures):
    ax.imshow(picture)
    ax.axis("off")
plt.show()
