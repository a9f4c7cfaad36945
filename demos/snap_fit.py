r"""A snap-fit, pressed in and pulled out
=====================================

The force to press a snap-fit in and to pull it out, with and without friction.

A tapered plastic arm rides over a pin and comes back. :meth:`skfem_ancf.Scene.run` computes named
steps without inertia. Each equilibrium starts from the one before, and friction depends on the
path.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, Circle, ElementBeamANCF, MeshBeam, Scene, Steps, StVenantKirchhoff

# %%
# The arm is 20 mm long and 5 mm wide, 2 mm high at its root and 1 mm at its end. The pin has a
# radius of 1.5 mm and overlaps the arm by 0.5 mm. Units are millimetres, newtons and megapascals.

length, radius, overlap, width = 20.0, 1.5, 0.5, 5.0
plastic = StVenantKirchhoff(E=2000.0, nu=0.35, density=1e-9)
mesh = MeshBeam.init_line(np.linspace(0, length, 17), height=lambda s: 2.0 - s / length)
arm = Beam(mesh, ElementBeamANCF(2), plastic, width=width)

# %%
# Two steps: the pin moves in by 9 mm, and out again. ``steps.ramp`` makes the function of time.

steps = Steps(insert=1.0, pull=1.0)
stroke = steps.ramp(insert=9.0, pull=0.0)
pin = Circle((length + 2.5, -0.5 - radius + overlap), radius)


def run(friction):
    scene = Scene(arm).clamp("left").obstacle(
        pin, friction=friction, position=lambda t: (-stroke(t), 0.0), points=40)
    scene.sensor("force", lambda state: state.reactions("left").force[0])
    return scene.run(steps, increments=30)


smooth, rough = run(0.0), run(0.2)
print(smooth, rough, sep="\n")

# %%
# **Check**: at each point of contact the force is turned from the normal of the pin by the angle of
# friction: backwards on the way in, forwards on the way out.

for step, sign in (("insert", -1), ("pull", 1)):
    at = rough.during(step)
    for i in at[(stroke(rough.t[at]) > 5.0) & (stroke(rough.t[at]) < 8.5)]:
        contact = rough.state(i).contact()
        nx, ny = contact.points - (pin.center - [stroke(rough.t[i]), 0.0])[:, None]
        Fx, Fy = contact.force
        found = (Fx * ny - Fy * nx) / (Fx * nx + Fy * ny)
        assert np.allclose(found, sign * 0.2, atol=1e-4)
    print(f"{step}: angle of friction {found.mean():+.4f}")

# %%
# The force against the stroke, and the arm on its way.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.2), width_ratios=(1, 1.5),
                                  layout="constrained")
for history, name in ((smooth, "without friction"), (rough, "friction 0.2")):
    history.plot_curve(stroke(history.sensors.t), "force", ax=left, label=name)
left.set(xlabel="stroke (mm)", ylabel="force on the arm (N)")
left.axhline(0.0, color="0.7", lw=0.8)
left.legend(frameon=False)
rough.plot("S_xx", times=[0.0, 0.25, 1.0], ax=right, unit="MPa", thickness=1,
           title="stress $S_{xx}$ on the way in")
right.set(xlabel="x (mm)", ylabel="y (mm)")
plt.show()
