r"""A compliant gripper
===================

Two compliant fingers grip a plate by its edges, and the work of the hands is compared with the
stored energy.

A finger is a wedge of two thin walls with ribs between them, in one piece without hinges, like the
fin of a fish. Its wall wraps around an object that presses on it. Its tip stays in place or bends
towards the object.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import simpson

from skfem_ancf import Frame, StVenantKirchhoff

# %%
# A finger is 100 mm high, 30 mm wide at its base, and made of a soft plastic. Its walls are 1.5 mm
# thick, its ribs 0.4 mm. The nodes of the front wall come first, then those of the back wall. The
# plate is 40 mm wide.

height, base, ribs, half, touched = 0.1, 0.03, 5, 0.02, 2
plastic = StVenantKirchhoff(E=30e6, nu=0.4, density=1200)
s = np.linspace(0, 1, ribs + 2)
shape = [(half, height * t) for t in s] + [(half + base * (1 - t), height * t) for t in s[:-1]]
n, k = len(s), np.arange(ribs + 1)
front, back = np.column_stack([k, k + 1]), np.column_stack([n + k, n + k + 1])
back[-1, 1] = n - 1  # both walls end at the tip
across = np.column_stack([k[1:], n + k[1:]])


# %%
# The gripper: a finger and its mirror image. ``settle`` moves their bases towards each other. The
# plate stops one node of each front wall.


def gripper(closing):
    finger, m, walls = np.array(shape), len(shape), 2 * len(front)
    lines = np.vstack([front, back, across])
    points = np.vstack([finger, finger * [-1, 1]])
    thin = np.r_[walls:len(lines), len(lines) + walls:2 * len(lines)]
    scene = Frame.from_lines(
        points, np.vstack([lines, m + lines]), elements=2, material=plastic, height=1.5e-3,
        width=0.02, sections={"ribs": {"height": 0.4e-3}},
        groups={"walls": np.setdiff1d(np.arange(2 * len(lines)), thin), "ribs": thin},
        nodes={"right": [0, n], "left": [m, m + n]})
    scene.clamp("right").clamp("left").hold([touched, m + touched], "x")
    return scene.settle("right", x=-closing).settle("left", x=closing)


closings = np.linspace(0, 0.014, 7)[1:]
states = [gripper(closing).solve_static() for closing in closings]
force = np.array([-state.reactions("right").force[0] for state in states])
lean = closings + [state.displacement(shape[n - 1], "walls")[0] for state in states]
for closing, F, d in zip(closings, force, lean, strict=True):
    print(f"closed by {1e3 * closing:4.1f} mm: {F:.2f} N on the plate; "
          f"the tip leans {1e3 * d:5.2f} mm")

# %%
# **The fin effect**: the plate presses on a wall at a third of its height. The tip of a single
# strip would move outwards by (3 - 1/3) / (2/3) = 4 times the displacement there. This tip stays,
# then moves inwards.

assert np.all(abs(lean) < 0.1 * closings) and lean[-1] < 0

# %%
# **Check**: the work of both hands, the integral of force over closing, is the strain energy.

work = 2 * simpson(np.r_[0, force], x=np.r_[0, closings])
stored = states[-1].strain_energy
print(f"work of both hands {1e3 * work:.3f} mJ, strain energy {1e3 * stored:.3f} mJ")
assert np.isclose(work, stored, rtol=2e-3)

fig, ax = plt.subplots(figsize=(5.6, 5.6), layout="constrained")
states[-1].plot("S_xx", ax=ax, thickness=1, title="stress along walls and ribs", unit="Pa")
edge = states[-1].position(shape[touched], "walls")[1]
ax.add_patch(plt.Rectangle((-half, edge - 1e-3), 2 * half, 2e-3, color="0.4"))
ax.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
