r"""A flexible rod is balanced
==========================

A cart keeps a slender rod upright, by a linear quadratic regulator from the linearised equations.

The rod bends, and falls over without control. The regulator is designed on the linear model about
the upright state, and tried on the nonlinear one step by step, after a blow.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import solve_continuous_are

from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, PointForce, RigidBody,
                        Scene, StVenantKirchhoff)

mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.006, angle=np.pi / 2)
rod = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e8, 0.3, 1000), width=0.02, name="rod",
           damping=KelvinVoigt(1e-3))
cart = RigidBody(mass=0.3, inertia=1e-3, position=(0, 0), name="cart")


def rig():
    """The cart on its rail, and the rod on it."""
    scene = Scene(rod, cart).gravity((0, -9.81))
    scene.joint("line", at=(0, 0), direction=(1, 0), beam=cart)
    scene.joint("angle", beam=cart, angle=lambda t: 0.0)
    scene.hinge((0, 0))
    return scene.sensor("cart", "displacement", cart).sensor("tip", "displacement", (0, 1))


# %%
# **The upright state**, which is unstable: the rod under its weight, held at both ends.

held = Scene(rod).pin("left").fix("right", "r^1").gravity((0, -9.81)).solve_static()
scene = rig()
upright = scene.state(np.append(held.u, np.zeros(cart.N)))
push = PointForce((1, 0), at=cart)
model = scene.linearize(upright, {"push": push})
A, B, C, D, T = model.state_space()
falls = np.linalg.eigvals(A).real.max()
print(f"left alone it falls as exp({falls:.2f} t)")

# %%
# **The regulator** weighs the places of cart and tip against the force. The state of the model are
# coordinates of the displacements from the upright state, and their rates.

weights = C.T @ np.diag([1.0, 0.0, 10.0, 0.0]) @ C + 1e-6 * np.eye(len(A))
P = solve_continuous_are(A, B, weights, [[0.1]])
gain = 10.0 * B.T @ P
coordinates = np.linalg.pinv(T)
assert np.linalg.eigvals(A - B @ gain).real.max() < 0 < falls

# %%
# **A blow on the tip** of the nonlinear rod, and what the regulator makes of it.

kicked = rig().initial_velocity(lambda x: np.array([0.5 * x[1], 0 * x[0]]), "rod")
stepper = kicked.stepper(5e-3, {"push": push})
rows = []
for _ in range(900):
    x = np.append(coordinates @ (stepper.u - upright.u), coordinates @ stepper.v)
    stepper.step(-gain @ x)
    now = stepper.readings
    rows.append([stepper.t, now["cart"][0], now["tip"][0], *(-gain @ x)])
t, at, tip, force = np.transpose(rows)
print(f"the tip leans by {1e2 * np.abs(tip - at).max():.1f} cm, and in the end by "
      f"{1e2 * abs(tip[-1] - at[-1]):.3f} cm")
assert abs(tip[-1]) < 5e-3 and abs(at[-1]) < 5e-3 < np.abs(tip).max()

# %%

fig, axes = plt.subplots(2, 1, figsize=(6.4, 4.4), sharex=True, layout="constrained")
axes[0].plot(t, at, label="cart")
axes[0].plot(t, tip, label="tip of the rod")
axes[0].set_ylabel("place along the rail (m)")
axes[0].legend(frameon=False)
axes[1].plot(t, force)
axes[1].set_ylabel("force on the cart (N)")
axes[1].set_xlabel("time (s)")
plt.show()
