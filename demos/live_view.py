r"""A live view: pull at a rod, and it follows
==========================================

:meth:`skfem_ancf.Scene.explore` opens a view by pyvista in which a slider sets a number, or the
mouse drags the arrow of a force. Each move is a static solution that starts from the one before.
Without a display, as here, the same moves are made by calls.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, PointForce, Scene, StVenantKirchhoff

# %%
# A fishing rod of 2 m that gets thinner, held at an angle, under its own weight.

length = 2.0
carbon = StVenantKirchhoff(E=6e10, nu=0.3, density=1600)
mesh = MeshBeam.init_line(np.linspace(0, length, 21), height=lambda s: 0.012 - 0.004 * s,
                          angle=np.pi / 4)
tip = (length / np.sqrt(2), length / np.sqrt(2))
scene = Scene(Beam(mesh, ElementBeamANCF(2), carbon, width=0.008)).clamp("left")
scene.gravity((0, -9.81))

# %%
# **A slider**: the line pulls down by up to 30 N. ``slider.plotter.show()`` opens the window, or a
# cell of a notebook. ``slider.set`` is what the slider calls.

slider = scene.explore(lambda F: PointForce((0, -F), at=tip), (0, 30), title="pull (N)",
                       field="S_xx", off_screen=True)
pictures = []
for pull in (3, 12, 30):
    state = slider.set(pull)
    pictures.append(slider.plotter.screenshot())
    print(f"{pull:2d} N: the tip is at {state.position(tip).round(3)}")

# %%
# **An arrow**: the mouse takes its handle and turns the force; ``arrow.set`` is called with it.

arrow = scene.explore(PointForce((0, -20), at=tip), field="S_xx", off_screen=True)
state = arrow.set((-10, -20))
pictures.append(arrow.plotter.screenshot())

# %%
# **Check**: what is seen is what is solved. The body of the picture ends where the tip is, the
# support carries the force and the weight, and the solution does not depend on the way there.

points = np.asarray(arrow.mesh.points)[:, :2]
assert np.min(np.hypot(*(points - state.position(tip)).T)) < 1e-3
root = state.reactions("left").force
weight = 9.81 * scene.beams[0].total_mass
assert np.allclose(root, [10, 20 + weight], rtol=1e-6)
again = scene.point_force((-10, -20), at=tip).solve_static(start=slider.state)
assert np.allclose(again.position(tip), state.position(tip), atol=1e-4)

# %%
# Three places of the slider, and the arrow.

fig, axes = plt.subplots(2, 2, figsize=(9.8, 7.0), layout="constrained")
for ax, picture in zip(axes.flat, pictures):
    ax.imshow(picture)
    ax.axis("off")
plt.show()
