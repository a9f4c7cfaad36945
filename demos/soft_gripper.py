r"""A soft gripper closes on a soft ring
=====================================

Two fingers of silicone hold a ring of rubber between them by friction; nothing else does.

The roots of the fingers move towards each other. The ring consists of two half rings. It touches
the fingers wherever they meet: ``scene.contact("all")`` names no places. What nothing holds has a
small drag, with which ``scene.run`` finds its position.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

radius, thin, thick, width, way = 0.03, 0.002, 0.006, 0.02, 0.012
silicone, rubber = StVenantKirchhoff(E=2e6, nu=0.0), StVenantKirchhoff(E=1e6, nu=0.0)
begin = radius + 0.5 * (thin + thick) + 1e-3                    # axes of the fingers, 1 mm apart

fingers = [Beam(MeshBeam.init_line(np.linspace(0, 0.08, 9), thick, origin=(x, 0.045),
                                   angle=-np.pi / 2),
                ElementBeamCable(3), silicone, width, name=name)
           for x, name in ((-begin, "left finger"), (begin, "right finger"))]
halves = [Beam(MeshBeam.init_curve(
    lambda s: radius * np.array([np.cos(s), np.sin(s)]), np.linspace(a, a + np.pi, 13), thin),
    ElementBeamCable(3), rubber, width, name=name)
    for a, name in ((-np.pi / 2, "right half"), (np.pi / 2, "left half"))]


def closed(friction):
    """The gripper closes; the history."""
    scene = Scene(*fingers, *halves).contact("all", friction=friction)
    scene.weld(("right half", "left"), ("left half", "right"))
    scene.weld(("right half", "right"), ("left half", "left"))
    for name, sign in (("left finger", 1.0), ("right finger", -1.0)):
        scene.fix("left", "r^1", lambda t, sign=sign: sign * way * t, name)
        scene.fix("left", "r^2", 0.0, name).fix("left", "r_X", 0.0, name)
    return scene.run(1.0, increments=12)


# %%
# **Friction holds the ring.** The fingers bend, and lean outwards: without friction they press the
# ring out.

curves = []
for friction in (0.6, 0.0):
    run = closed(friction)
    states = [run.state(k) for k in range(len(run.t))]
    force = [[state.contact(on=name).total[0] for name in ("left finger", "right finger")]
             for state in states]
    curves.append((1e3 * way * run.t, np.array(force), states))
held, lost = (states[-1].displacement((radius, 0.0), "right half") for *_, states in curves)
print(f"the ring moves by {1e3 * held[1]:.2f} mm with friction, {1e3 * lost[1]:.2f} mm without")
assert abs(held[1]) < 0.1 * radius and lost[1] < -radius

# %%
# Both fingers press with the same force. A thin ring between two opposite forces :math:`F` becomes
# narrower by :math:`(\pi / 4 - 2 / \pi) F R^3 / E I` while it is nearly round, as 2 mm after the
# start.

_, force, states = curves[0]
early, last = states[2], states[-1]
narrower = (early.displacement((-radius, 0.0), "left half")
            - early.displacement((radius, 0.0), "right half"))[0]
EI = rubber.E * width * thin**3 / 12
exact = narrower * EI / radius**3 / (np.pi / 4 - 2 / np.pi)
print(f"force {force[2, 1]:.5f} N, linear theory {exact:.5f} N")
assert np.isclose(force[2, 1], exact, rtol=0.02)
assert np.allclose(force.sum(axis=1), 0.0, atol=0.05 * force[-1, 1])
assert last.contact().penetration < 0.01 * thick

# %%

fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.2), layout="constrained")
plot_state(last, "S_xx", ax=left, unit="Pa", title="held by friction: stress $S_{xx}$")
for (x, force, _), label in zip(curves, ("friction 0.6", "no friction")):
    right.plot(x, force[:, 1], ".-", label=label)
right.set(xlabel="way of each finger's root (mm)", ylabel="force on the ring (N)")
right.legend(frameon=False)
plt.show()
