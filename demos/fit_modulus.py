"""Fitting a modulus to a measurement
==================================

Young's modulus of a rubber strip is fitted to measured points of its shape under its weight.

The strip is clamped at one end and bends far, so no handbook formula applies. The computed shape
must match the measured marks. SciPy finds the modulus and its standard deviation.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# The strip is 300 mm long and 4 mm thick, with known density and seven marks on its axis.

length, height, width, density, g = 0.3, 4e-3, 20e-3, 1150.0, 9.81
mesh = MeshBeam.init_line(np.linspace(0, length, 25), height)
marks = np.array([np.linspace(0.25, 1, 7) * length, np.zeros(7)])


def hanging(E, start=None):
    rubber = StVenantKirchhoff(E=E, nu=0.45, density=density)
    beam = Beam(mesh, ElementBeamANCFCubic(2), rubber, width)
    return Scene(beam).clamp("left", thickness="free").gravity((0, -g)).solve_static(start=start)


# %%
# **The measurement** is synthetic, so the result is known: the shape for a given modulus, with
# reading errors of half a millimetre.

true, reading = 5e6, 0.5e-3
rng = np.random.default_rng(1)
measured = hanging(true).position(marks) + reading * rng.standard_normal(marks.shape)

# %%
# **The fit**: the unknown is the logarithm of E, which keeps E positive. Each solution starts from
# the one before and takes a few milliseconds.

state = hanging(3e6)
solutions = 0


def residual(log_E):
    global state, solutions
    state = hanging(np.exp(log_E[0]), start=state)
    solutions += 1
    return (state.position(marks) - measured).ravel() / reading


fit = least_squares(residual, [np.log(3e6)], diff_step=1e-4, x_scale=0.1)
E = np.exp(fit.x[0])
deviation = E / np.sqrt(fit.jac[0:, 0] @ fit.jac[:, 0])
print(f"E = {1e-6 * E:.3f} +- {1e-6 * deviation:.3f} MPa, true {1e-6 * true:.3f} MPa, "
      f"{solutions} solutions; sum of squares {2 * fit.cost:.1f} of {measured.size} numbers")
assert abs(E - true) < 3 * deviation and deviation < 0.02 * true
assert 2 * fit.cost < 2 * measured.size

# %%
# The strip with the fitted modulus, and the marks.

fig, ax = plt.subplots(figsize=(6.4, 5), layout="constrained")
hanging(E, state).plot("eps_xx", ax=ax, title=r"strain along the strip $\varepsilon_{xx}$, fitted")
ax.plot(*measured, "kx", ms=7, mew=1.5, zorder=5, label="marks, measured")
ax.plot(*hanging(1.5 * E, state).position(marks), "o", mfc="none", color="0.5", zorder=5,
        label="with 1.5 E")
ax.set(xlabel="x (m)", ylabel="y (m)")
ax.legend(frameon=False, loc="center right")
plt.show()
