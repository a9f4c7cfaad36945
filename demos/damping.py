r"""Damping: a ruler comes to rest
==============================

A plastic ruler vibrates with material damping, and its decay is compared with the damping ratio of
the first mode.

The ruler is bent and released. Its material is viscoelastic (Kelvin and Voigt): its stress depends
on the strain rate, too. The computation accounts for all dissipated energy. In the end the ruler is
in static equilibrium.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamCable, KelvinVoigt, MeshBeam, Scene, StVenantKirchhoff

# %%
# The relaxation time sets the decay: a vibration with angular frequency omega loses the fraction pi
# omega time of its amplitude in each period.

length, height, width = 0.25, 2e-3, 25e-3
plastic = StVenantKirchhoff(E=3e9, nu=0.35, density=1200)
mesh = MeshBeam.init_line(np.linspace(0, length, 5), height)
ruler = Beam(mesh, ElementBeamCable(5), plastic, width, damping=KelvinVoigt(4e-3))
tip = (length, 0)


def held():
    return Scene(ruler).clamp("left", thickness="free").gravity((0, -9.81))


# %%
# The ruler is bent by a force at its tip, then released: the motion starts from the static state of
# the other scene.

bent = held().point_force((0, -0.3), at=tip).solve_static()
scene = held()
history = scene.integrate(t_end=1.0, dt=2e-3, start=bent)
rest = scene.solve_static()

# %%
# **The decay**: two maxima that are n periods apart, against the damping ratio of the first mode.

y = history.displacement(tip)[:, 1] - rest.displacement(tip)[1]
mode = scene.modes(1, rest)
ratio, omega = mode.damping_ratios[0], mode.frequencies[0]
peaks = np.nonzero((y[1:-1] > y[:-2]) & (y[1:-1] > y[2:]))[0] + 1
n = 3
measured = np.log(y[peaks[1]] / y[peaks[1 + n]]) / (2 * np.pi * n)
print(f"damping ratio: decay {measured:.5f}, mode {ratio:.5f}, time omega / 2 = "
      f"{ruler.damping.time * omega / 2:.5f}")
period = (history.t[peaks[1 + n]] - history.t[peaks[1]]) / n
print(f"frequency: {1 / period:.3f} Hz, mode {omega / (2 * np.pi):.3f} Hz")
assert np.isclose(measured, ratio, rtol=0.03) and np.isclose(2 * np.pi / period, omega, rtol=0.02)

# %%
# **The balance**: the sum of total and dissipated energy is constant. In the end the ruler is in
# its static equilibrium.

total = history.total_energy + history.dissipated
print(f"balance of energy: {np.ptp(total):.1e} J of {np.ptp(history.total_energy):.1e} J lost; "
      f"tip {1e6 * abs(y[-1]):.0f} um from rest")
assert np.ptp(total) < 1e-9 * np.ptp(history.total_energy) and abs(y[-1]) < 1e-2 * abs(y[0])

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.2), layout="constrained")
left.plot(history.t, 1e3 * y)
left.plot(history.t, -1e3 * y[0] * np.exp(-ratio * omega * history.t), "k:", lw=1)
left.plot(history.t, 1e3 * y[0] * np.exp(-ratio * omega * history.t), "k:", lw=1,
          label="decay of the first mode")
left.set(xlabel="t (s)", ylabel="tip above its place of rest (mm)")
left.legend(frameon=False)
kinetic, lost = history.kinetic_energy, history.dissipated
stored = history.total_energy - history.total_energy[-1] - kinetic
right.stackplot(history.t, 1e3 * np.array([kinetic, stored, lost]), labels=(
    "kinetic", "of strain and weight", "dissipated"))
right.set(xlabel="t (s)", ylabel="energy (mJ)", xlim=(0, 0.6))
right.legend(frameon=False)
plt.show()
