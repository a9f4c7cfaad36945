r"""A strip pressed on a cylinder
=============================

A strip is bent over a cylinder by a force at its end, and the end of the contact is compared with
beam theory.

At small forces the strip touches the cylinder at its root only. At larger forces it lies on the
cylinder up to a point that moves outwards, with the curvature of the cylinder. The contact force is
concentrated at this point. Tapes, leaf springs with a stop and grippers work like this.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, Circle, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A strip of spring steel, clamped on top of a cylinder.

length, height, width, radius = 0.2, 0.4e-3, 0.01, 0.15
steel = StVenantKirchhoff(E=2.1e11, nu=0.0)
EI = steel.E * width * height**3 / 12
mesh = MeshBeam.init_line(np.linspace(0, length, 41), height)
strip = Beam(mesh, ElementBeamANCFCubic(2), steel, width)


def pulled(force, start=None):
    scene = Scene(strip).clamp("left").point_force((0, -force), at=(length, 0))
    scene.obstacle(Circle((0, -radius - height / 2), radius), stiffness=1e10)
    return scene.solve_static(start=start)


# %%
# **Check**: on the cylinder the strip has the curvature of the cylinder. At the end of the contact
# its moment is EI over the radius of the axis. This determines the lever of the force, and so the
# end of the contact.

bend = EI / (radius + height / 2)
states, lifts = [], []
forces = bend / length * np.array([0.8, 1.5, 2.5, 4.0])
for force in forces:
    states.append(pulled(force, states[-1] if states else None))
    contact = states[-1].contact()
    pressed = contact.points[0][contact.pressure > 1e-3 * contact.pressure.max(initial=0.0)]
    lifts.append(max(pressed, default=0.0))
    lever = states[-1].position((length, 0))[0] - lifts[-1]
    print(f"{force:.3f} N: pressed up to x = {1e3 * lifts[-1]:.1f} mm, lever {1e3 * lever:.1f} mm, "
          f"rule {1e3 * bend / force:.1f} mm")
    assert lifts[-1] < 1e-3 or abs(lever - bend / force) < length / 40

# %%
# The curvature along the strip, times the radius of the cylinder: 1 in contact.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.4), layout="constrained")
plot_state(states, "S_xx", ax=left, thickness=4, unit="Pa", title="stress along the strip $S_{xx}$")
left.set(xlabel="x (m)", ylabel="y (m)")
s = np.linspace(0, length, 401)[1:-1]
for force, state, lift in zip(forces, states, lifts):
    curvature = -state.resultants(np.array([s, 0 * s])).curvature * (radius + height / 2)
    right.plot(1e3 * s, curvature, label=f"{force:.2f} N")
    lying = (s > 0.01) & (s < lift - 0.015)
    assert np.all(abs(curvature[lying] - 1) < 0.02)
right.axhline(1, color="0.7", lw=0.8, zorder=0)
right.set(xlabel="place along the strip (mm)", ylabel="curvature, in 1 / radius")
right.legend(frameon=False)
plt.show()
