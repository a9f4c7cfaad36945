"""A soft pendulum
===============

A strip of soft rubber, hinged at one end, is let go from the horizontal. It does not swing as a rod
does: it lags behind its hinge, and cracks like a whip where it turns round. No energy is lost in
the computation, so all that the picture shows is mechanics.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import cumulative_simpson

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# A metre of rubber, 15 mm thick.

length, height, width, g = 1.0, 0.015, 0.05, 9.81
rubber = StVenantKirchhoff(E=3e6, nu=0.45, density=1100)
mesh = MeshBeam.init_line(np.linspace(0, length, 13), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), rubber, width)
scene = Scene(beam).pin("left").gravity((0, -g))
history = scene.integrate(t_end=1.1, dt=4e-3)

# %%
# **Energy.** The scheme conserves it, whatever the step; to what Newton's method leaves.

total = history.total_energy
swing = history.kinetic_energy.max()
print(f"energy: changes by {np.ptp(total) / swing:.1e} of the largest kinetic energy")
assert np.ptp(total) < 1e-9 * swing

# %%
# **Angular momentum.** About the hinge it changes by the moment of the weight alone. Where the
# centre of mass is follows from the momentum: two integrals over time, of what is independent of
# how the strip bends.

t = history.t
mass_x = beam.total_mass * length / 2 + cumulative_simpson(history.momentum[:, 0], x=t, initial=0)
expected = -g * cumulative_simpson(mass_x, x=t, initial=0)
angular = history.angular_momentum
error = np.max(abs(angular - expected)) / np.max(abs(angular))
print(f"angular momentum: off by {error:.1e} of its largest value")
assert error < 1e-3

# %%
# A rigid rod would reach the bottom after a quarter of its period, with the speed sqrt(3 g L).

tip, speed = history.position((length, 0)), np.hypot(*history.velocity((length, 0)).T)
below = t[np.argmax(tip[:, 0] < 0)]
print(f"tip below the hinge after {below:.3f} s (rod: {0.4834 * np.sqrt(length):.3f} s); "
      f"fastest {speed.max():.2f} m/s (rod: {np.sqrt(3 * g * length):.2f} m/s)")
assert speed.max() > 1.1 * np.sqrt(3 * g * length)

# %%
# The motion, every 0.1 s, and the path of the tip; then a film of it.

fig, ax = plt.subplots(figsize=(7, 5.6), layout="constrained")
history.plot("eps_xx", times=np.arange(0, 1.1, 0.1), ax=ax, undeformed=False,
             title=r"strain along the strip $\varepsilon_{xx}$, every 0.1 s")
ax.plot(*tip.T, color="0.6", lw=0.8, zorder=0)
ax.set(xlabel="x (m)", ylabel="y (m)")
history.animate("out/pendulum.gif", "eps_xx", undeformed=False)
plt.show()
