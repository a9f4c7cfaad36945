r"""A bimetal strip
===============

The curvature of a heated strip of two bonded metals, compared with Timoshenko's formula, and the
stress across it.

One metal expands more than the other, so the strip bends; thermostats switch in this way.
Timoshenko's formula [1]_ gives the curvature. It does not show the stress, which jumps at the
interface of the metals although no external force acts.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, Section, StVenantKirchhoff

# %%
# Invar below, brass above, 0.5 mm each. The strip is 150 mm long and 10 mm wide, and is heated by
# 200 K.

invar = StVenantKirchhoff(E=1.41e11, nu=0.29, thermal_expansion=1.2e-6)
brass = StVenantKirchhoff(E=1.05e11, nu=0.34, thermal_expansion=19e-6)
length, width, layer, heat = 0.15, 0.01, 0.5e-3, 200.0
height = 2 * layer

strip = Section.layers((layer, invar), (layer, brass), width=width)
mesh = MeshBeam.init_line(np.linspace(0, length, 17), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), section=strip)
state = Scene(beam).clamp("left", thickness="free").temperature(heat).solve_static()
tip = state.displacement((length, 0))

# %%
# **Timoshenko's formula**: m is the ratio of the thicknesses, n that of the moduli.

m, n = 1.0, invar.E / brass.E
kappa = (6 * (brass.thermal_expansion - invar.thermal_expansion) * heat * (1 + m)**2
         / (height * (3 * (1 + m)**2 + (1 + m * n) * (m**2 + 1 / (m * n)))))
expected = (1 - np.cos(kappa * length)) / kappa
print(f"tip {1e3 * tip[1]:.4f} mm, Timoshenko {-1e3 * expected:.4f} mm")
assert np.isclose(-tip[1], expected, rtol=5e-3)

# %%
# **Stress in the middle**: linear in each layer, with zero force and zero moment over the section.

y = height * np.concatenate([np.linspace(-0.5, -1e-6, 41), np.linspace(1e-6, 0.5, 41)])
stress = state.stress(np.array([np.full_like(y, length / 2), y]))[0]
force = width * trapezoid(stress, y)
moment = width * trapezoid(stress * y, y)
largest = np.max(abs(stress)) * width * height
print(f"jump in the joint: {1e-6 * (stress[41] - stress[40]):.1f} MPa; "
      f"force {force / largest:.0e}, moment {moment / largest / height:.0e} of stress times area")
assert abs(force) < 5e-3 * largest and abs(moment) < 5e-3 * largest * height

# %%
# The strip, and the stress across its section.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.2), width_ratios=(1.7, 1),
                                  layout="constrained")
state.plot("S_xx", ax=left, thickness=3, unit="Pa",
           title=f"stress $S_{{xx}}$ after heating by {heat:g} K")
left.set(xlabel="x (m)", ylabel="y (m)")
right.plot(1e-6 * stress, 1e3 * y)
right.axhline(0, color="0.7", lw=0.8)
right.axvline(0, color="0.7", lw=0.8)
right.set(xlabel="$S_{xx}$ (MPa)", ylabel="Y (mm)", title="half way:\nInvar below, brass above")
plt.show()

# %%
# .. [1] S. Timoshenko, Analysis of bi-metal thermostats, J. Opt. Soc. Am. 11 (1925) 233-255.
