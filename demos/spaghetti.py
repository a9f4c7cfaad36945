"""Flying spaghetti
================

A free soft rod is accelerated by a force and a moment, then flies, with constant momentum, angular
momentum and energy.

The load acts on one end for two and a half seconds. Then the rod tumbles and folds without any
support. In free flight all three quantities must stay constant. The numbers are those of Simo and
Vu-Quoc [1]_.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, Section

# %%
# The paper gives stiffnesses and inertias, no material. So the section is given by its numbers. It
# stays plane: this is the geometrically exact beam of the paper.

EA, GA, EI, rhoA, rhoI = 1e4, 1e4, 500.0, 1.0, 10.0
rod = Section.numbers(EA=EA, EI=EI, GA=GA, rhoA=rhoA, rhoI=rhoI)
height = np.sqrt(12 * EI / EA)
start, end = np.array([6.0, 0.0]), np.array([0.0, 8.0])
length = np.hypot(*(end - start))
mesh = MeshBeam.init_line(np.linspace(0, length, 11), height, origin=start,
                          angle=np.arctan2(8, -6))
beam = Beam(mesh, ElementBeamANCFCubic(1), section=rod)

# %%
# A force of 8 to the right and a moment of 80 act on the lower end until t = 2.5. As a breakpoint,
# this is the end of a time step.

push, moment, release = 8.0, 80.0, 2.5


def pulse(t):
    return np.where(t < release, 1.0, 0.0)


scene = Scene(beam).point_force((push, 0), at=start, amplitude=pulse)
scene.moment("left", moment, amplitude=pulse)
history = scene.integrate(t_end=13.0, dt=0.05, breakpoints=[release])

# %%
# **Conservation.** The momentum is the impulse of the force, 20 to the right. It is constant after
# the release, as are angular momentum and energy.

free = history.t > release + 1e-9
momentum, angular = history.momentum[free], history.angular_momentum[free]
energy = history.kinetic_energy[free] + history.strain_energy[free]
print("momentum after release:", momentum[-1].round(10), "impulse:", (push * release, 0.0))
print(f"changes in flight: momentum {np.ptp(momentum, axis=0).max():.1e}, "
      f"angular momentum {np.ptp(angular):.1e} of {angular[0]:.1f}, "
      f"energy {np.ptp(energy):.1e} of {energy[0]:.1f}")
assert np.allclose(momentum, [push * release, 0], rtol=0, atol=1e-7)
assert np.ptp(angular) < 1e-6 and np.ptp(energy) < 1e-6

# %%
# **Place.** A code of its own for the geometrically exact beam, with finer meshes and steps, has
# the upper end at (22.26, 1.42) at the time 13.

tip = history.position(end)[-1]
print("upper end at t = 13:", tip.round(2))
assert np.allclose(tip, [22.264, 1.420], rtol=0, atol=0.05)

# %%
# The rod every second, coloured by its axial strain, and the path of its middle.

fig, ax = plt.subplots(figsize=(9.5, 4.6), layout="constrained")
history.plot("eps_xx", times=np.arange(14), ax=ax, thickness=1, undeformed=False,
             title=r"strain along the rod $\varepsilon_{xx}$, every second")
ax.plot(*history.position(0.5 * (start + end)).T, color="0.6", lw=0.8, zorder=0)
ax.set(xlabel="x", ylabel="y")
history.animate("out/spaghetti.gif", "eps_xx", thickness=1, undeformed=False)
plt.show()

# %%
# .. [1] J. C. Simo, L. Vu-Quoc, On the dynamics of flexible beams under large overall motions, the
#    plane case: part II, J. Appl. Mech. 53 (1986) 855-863.
