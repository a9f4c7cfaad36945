r"""A rope on a fixed pulley
========================

A rope slips on a pulley that does not turn, and the ratio of its end forces is compared with
Euler's and Eytelwein's formula.

Friction increases the tension along the contact angle :math:`\alpha` by the factor
:math:`e^{\mu \alpha}` [1]_. This is how a sailor holds a ship with one hand and a bollard. Here the
rope lies on half a pulley. One end carries a weight, the other is pulled until the rope slips.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, Circle, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff

# %%
# The reference configuration of the rope is already on the pulley: straight, half a circle,
# straight. The rope is thin, and stress-free in this shape, so bending has no effect.

radius, hanging, thickness, friction = 0.1, 0.1, 2e-3, 0.25
cord = StVenantKirchhoff(E=5e7, nu=0.0)
arc = np.pi / 2 * (radius + thickness / 2)


def shape(s):
    turn = np.clip(s, -arc, arc) / (radius + thickness / 2)
    beyond = np.abs(s) - np.minimum(np.abs(s), arc)
    return np.array([(radius + thickness / 2) * np.sin(turn),
                     (radius + thickness / 2) * np.cos(turn) - beyond])


ends = np.linspace(arc, arc + hanging, 4)
nodes = np.concatenate([-ends[::-1], np.linspace(-arc, arc, 41)[1:-1], ends])
rope = Beam(MeshBeam.init_curve(shape, nodes, thickness), ElementBeamCable(5), cord, thickness)
held, pulled = shape(nodes[0]), shape(nodes[-1])

weight, way = 1.0, 4e-3
scene = Scene(rope).fix("left", "r^1").fix("right", "r^1")
scene.obstacle(Circle((0, 0), radius), friction=friction)
scene.point_force((0, -weight), at=held)
scene.fix("right", "r^2", displacement=-way)
state = scene.solve_static(first_step=0.1)

# %%
# **Check**: the force of the hand over the weight, and the tension along the contact.

hand = -state.reactions("right").force[1]
wanted = weight * np.exp(friction * np.pi)
print(f"force of the hand: {hand:.4f} N; Euler and Eytelwein {wanted:.4f} N")
assert np.isclose(hand, wanted, rtol=0.015)

s = np.linspace(nodes[0], nodes[-1], 201)[1:-1]
tension = state.resultants(shape(s)).N
expected = weight * np.exp(friction * np.clip(s + arc, 0, 2 * arc) / (radius + thickness / 2))
print(f"tension along the rope within {100 * np.max(abs(tension / expected - 1)):.1f} %")
assert np.max(abs(tension / expected - 1)) < 0.05

# %%
# The force on the pulley is the sum of both end forces. The figure shows the stress, and the
# tension along the contact.

contact = state.contact()
print("force on the rope from the pulley:", contact.total.round(3), "N")
assert np.isclose(contact.total[1], weight + hand, rtol=1e-3)

fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.4), layout="constrained")
state.plot(lambda v: 1e-6 * v["S_xx"], ax=left, thickness=3, undeformed=False, cmap="viridis",
           title="stress along the rope", unit="MPa")
left.set(xlabel="x (m)", ylabel="y (m)")
angle = np.degrees(s / (radius + thickness / 2))
right.plot(angle, expected, lw=5, alpha=0.3, label="Euler and Eytelwein")
right.plot(angle, tension, "k", lw=1.2, label="computed")
right.set(xlabel="angle on the pulley (degrees)", ylabel="tension (N)")
right.legend(frameon=False)
plt.show()

# %%
# .. [1] L. Euler, Remarques sur l'effet du frottement dans l'equilibre, Mem. Acad. Sci. Berlin 18
#    (1762) 265-278; J. A. Eytelwein, Handbuch der Statik fester Korper (1808).
