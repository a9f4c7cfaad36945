r"""A magnetic rod in an opposing field
===================================

A soft magnetised rod buckles in an opposing magnetic field, and its path is compared with Euler's
elastica.

A field along the magnetisation keeps the rod straight. An opposing field makes it buckle above a
critical value. The field is an energy density, a user-defined function of three lines. It is enough
for the critical field and the path beyond it.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A rod of silicone with hard magnetic particles. Its magnetisation M moves with the material. In a
# field B, with the deformation gradient F, the energy per volume is :math:`-B \cdot F M` (Zhao,
# Kim, Cheng, Zhao, "Mechanics of hard-magnetic soft materials", J. Mech. Phys. Solids 124, 2019).

length, height, width = 40e-3, 0.4e-3, 5e-3
silicone = StVenantKirchhoff(E=1e6, nu=0.3)
M = 1e5  # A/m, along the axis

# %%
# The integral of :math:`F e_x` along the rod is r at its end minus r at its root. So an opposing
# field acts as a dead force A M B on the end, and the critical field is that of Euler's column.

critical = np.pi**2 / 4 * silicone.E * height**2 / 12 / length**2 / M


def opposing(r, F, X, t):
    return critical * M * F[0, 0]


mesh = MeshBeam.init_line(np.linspace(0, length, 21), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), silicone, width)
scene = Scene(beam).clamp("left", thickness="free").energy(opposing)
factor = scene.buckling(1).factors[0]
print(f"critical field {1e3 * factor * critical:.4f} mT, Euler's {1e3 * critical:.4f} mT")
assert np.isclose(factor, 1, rtol=2e-4)

# %%
# **The path**: the straight rod is followed beyond the critical field, and the bent one branches
# off.

trunk = scene.continuation(ds=2e-5 * length, max_load=1.5)
point = trunk.critical_points[0]
branch = scene.continuation(branch=point, ds=0.1 * length, max_load=5)
end = (length, 0)
back, sideways = np.abs(branch.displacement(end).T) / length
print(f"{point}; bent: {len(branch)} points, all stable: {all(branch.stable[1:])}")

# %%
# **Check**: Euler's elastica as a function of the angle at the end, :math:`k = \sin(\theta/2)`.


def elastica(load):
    k = brentq(lambda k: (2 * ellipk(k**2) / np.pi) ** 2 - load, 1e-9, 1 - 1e-9)
    return 2 - 2 * ellipe(k**2) / ellipk(k**2), 2 * k / ellipk(k**2)


far = branch.load > 1.01
exact = np.array([elastica(load) for load in branch.load[far]]).T
error = np.max(np.hypot(back[far] - exact[0], sideways[far] - exact[1]))
print(f"end at most {error:.1e} lengths from the elastica")
assert error < 2e-3 and all(branch.stable[1:]) and np.isclose(branch.load[-1], 5)

# %%
# The field against the displacement of the end, and the rod in some fields.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.6), layout="constrained")
fields = np.linspace(1.0005, 5, 200)
curves = np.array([elastica(field) for field in fields]).T
for moved, curve, name in zip((back, sideways), curves, ("back", "sideways")):
    line, = left.plot(curve, 1e3 * critical * fields, lw=5, alpha=0.3)
    left.plot(moved, 1e3 * critical * branch.load, "-", color=line.get_color(), label=name)
left.set(xlabel="movement of the end / length", ylabel="opposing field (mT)",
         title="elastica (broad), computed (thin)")
left.legend(frameon=False)
shown = [branch.state(np.argmin(abs(branch.load - load))) for load in (1.01, 1.2, 1.8, 5)]
plot_state(shown, "S_xx", ax=right, unit="Pa",
           title="stress $S_{xx}$ at 1.01, 1.2, 1.8 and 5 of the critical field")
right.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
