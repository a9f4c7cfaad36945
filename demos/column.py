r"""A column past its Euler load
============================

The path of a compressed column, through its critical load and along the bent branch, compared with
Euler's elastica.

The straight column loses its stability at Euler's load, and the bent column branches off. Its load
increases along the whole branch, until the head comes down to the foot.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A strip of spring steel, clamped at its foot and free at its head.

length, height, width = 0.3, 0.5e-3, 20e-3
steel = StVenantKirchhoff(E=2.1e11, nu=0.3)
euler = np.pi**2 / 4 * steel.E * width * height**3 / 12 / length**2

mesh = MeshBeam.init_line(np.linspace(0, length, 21), height, angle=np.pi / 2)
beam = Beam(mesh, ElementBeamANCFCubic(2), steel, width)
head = (0, length)
scene = Scene(beam).clamp("left", thickness="free").point_force((0, -euler), at=head)

# %%
# The path of the straight column, in small steps since it hardly shortens. The critical load is
# computed, and the branch starts there.

trunk = scene.continuation(ds=2e-6 * length, max_load=1.5)
point = trunk.critical_points[0]
print(point, "unstable beyond:", not trunk.stable[-1])
assert point.kind == "bifurcation" and np.isclose(point.load, 1, rtol=1e-4)

branch = scene.continuation(branch=point, ds=0.03 * length, max_load=5)
sideways, down = np.abs(branch.displacement(head).T) / length
print(f"the bowed column: {len(branch)} points, all stable: {all(branch.stable[1:])}")

# %%
# Euler's elastica, with :math:`k = \sin(\theta/2)` of the angle at the head: the load is
# :math:`(2 K(k) / \pi)^2`. The head moves sideways by :math:`2 k / K` and down by
# :math:`2 - 2 E / K`, in lengths.


def elastica(load):
    k = brentq(lambda k: (2 * ellipk(k**2) / np.pi) ** 2 - load, 1e-9, 1 - 1e-9)
    return 2 * k / ellipk(k**2), 2 - 2 * ellipe(k**2) / ellipk(k**2)


far = branch.load > 1.001
exact = np.array([elastica(load) for load in branch.load[far]]).T
error = np.max(np.hypot(sideways[far] - exact[0], down[far] - exact[1]))
print(f"head at most {error:.1e} lengths from the elastica")
assert error < 1e-3 and all(branch.stable[1:])

# %%
# The load against the displacement of the head, and the column at some loads.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.6), layout="constrained")
loads = np.linspace(1.0005, 5, 200)
curves = np.array([elastica(load) for load in loads]).T
for moved, curve, name in zip((sideways, down), curves, ("sideways", "down")):
    line, = left.plot(curve, loads, lw=5, alpha=0.3)
    left.plot(moved, branch.load, "-", color=line.get_color(), label=name)
left.plot([0, 0], [0, 1], "k-", [0, 0], [1, 1.5], "k--")
left.set(xlabel="movement of the head / length", ylabel="load / Euler's load",
         title="elastica (broad), computed (thin)")
left.legend(frameon=False)
shown = [branch.state(np.argmin(abs(branch.load - load))) for load in (1.01, 1.2, 1.8, 5)]
plot_state(shown, "S_xx", ax=right, unit="Pa",
           title="stress $S_{xx}$ at 1.01, 1.2, 1.8 and 5 of Euler's load")
right.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
