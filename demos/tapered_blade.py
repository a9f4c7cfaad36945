"""A tapered blade and its section forces
======================================

The deflection and the section forces of a tapered wind turbine blade under wind and weight.

The blade becomes thinner and narrower towards its tip. The diagrams of normal force, shear force
and bending moment follow from equilibrium of the deformed blade, not from derivatives of
displacements.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# A vertical blade of glass fibre laminate, 4 m long. Thickness and width are functions of the
# position.

length, g = 4.0, 9.81
laminate = StVenantKirchhoff(E=2.5e10, nu=0.25, density=1900)


def height(x):
    return 0.08 - 0.012 * x


def width(x, y):
    return 0.3 - 0.05 * x


mesh = MeshBeam.init_line(np.linspace(0, length, 21), height, angle=np.pi / 2)
blade = Beam(mesh, ElementBeamANCFCubic(2), laminate, width)

# %%
# The wind: 1500 N/m at the tip, proportional to the square of the height above the root.

tip_wind = 1500.0
scene = Scene(blade).clamp("left", thickness="free").gravity((0, -g))
scene.line_load(lambda x: (tip_wind * (x[1] / length)**2, 0 * x[1]))
state = scene.solve_static()
print(f"deflection of the tip {1e3 * state.displacement((0, length))[0]:.1f} mm; "
      f"fields from equilibrium: {state.recovered == {0: ''}}")

# %%
# **Check**: force and moment at the root from the loads on the undeformed blade, and the deflection
# from the integral of M m / EI. Shear adds a little.

N, Q, M = (getattr(state.resultants((0, 0)), name) for name in "NQM")
shear, lever = tip_wind * length / 3, 0.75 * length
print(f"root: N = {N:.1f} N (weight {-blade.total_mass * g:.1f}), Q = {Q:.1f} N (wind "
      f"{shear:.1f}), M = {M:.1f} N m (wind {-shear * lever:.1f})")
assert np.isclose(N, -blade.total_mass * g, rtol=1e-3)
assert np.isclose(abs(Q), shear, rtol=1e-3) and np.isclose(abs(M), shear * lever, rtol=0.02)


def bending(x):
    EI = laminate.E * width(x, 0) * height(x)**3 / 12
    z = x / length
    moment = tip_wind * length**2 * (0.25 - z / 3 + z**4 / 12)
    return moment * (length - x) / EI


bent = quad(bending, 0, length)[0]
print(f"deflection: {1e3 * bent:.1f} mm by bending alone")
assert bent < state.displacement((0, length))[0] < 1.05 * bent

# %%
# The blade, and the diagrams along it.

fig = plt.figure(figsize=(9.4, 5.6), layout="constrained")
left, right = fig.subfigures(1, 2, width_ratios=(1, 1.8))
ax = left.subplots()
state.plot(lambda v: 1e-6 * v["S_xx"], ax=ax, thickness=6, unit="MPa", title="stress $S_{xx}$")
ax.set(xlabel="x (m)", ylabel="y (m)", xticks=(0, 0.4), xlim=(-0.4, 0.7))
state.plot_resultants(axes=right.subplots(3, 1, sharex=True))
for ax, unit in zip(right.axes, ("N", "N", "N m")):
    ax.set_ylabel(f"{ax.get_ylabel()} ({unit})")
plt.show()
