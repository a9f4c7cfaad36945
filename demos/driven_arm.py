r"""A driven arm and its stiffening
===============================

A slender arm is spun up by a motor, and the lag of its tip is compared with linear theory and with
centrifugal stiffening.

While the arm accelerates its tip lags behind. In steady rotation the arm is straight and slightly
longer. The centrifugal force stiffens it. A linear theory without this effect bends the arm too
far, and fails at higher speeds. The example is by Simo and Vu-Quoc [1]_.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamCable, KelvinVoigt, MeshBeam, Scene, Section

EA, EI, rhoA, rhoI, length = 2.8e7, 1.4e4, 1.2, 6e-4, 10.0
speed, ramp = 6.0, 15.0                                         # rad/s reached after 15 s

arm = Section.numbers(EA=EA, EI=EI, rhoA=rhoA, rhoI=rhoI)
mesh = MeshBeam.init_line(np.linspace(0, length, 5), height=np.sqrt(12 * EI / EA))
beam = Beam(mesh, ElementBeamCable(5), section=arm, damping=KelvinVoigt(0.02))
scene = Scene(beam).pin("left")

# %%
# The angle of the hub. Its acceleration is smooth, its final speed is 6 rad/s.


def angle(t):
    s = np.minimum(t, ramp)
    rise = s**2 / 2 + (ramp / (2 * np.pi))**2 * (np.cos(2 * np.pi * s / ramp) - 1)
    return speed / ramp * rise + speed * (t - s)


scene.joint("angle", at="left", angle=angle)
history = scene.integrate(t_end=20.0, dt=0.02)

# %%
# The tip in axes that turn with the hub: its lag, and the elongation of the arm.

t, x = history.t, history.position((length, 0))
c, s = np.cos(angle(t)), np.sin(angle(t))
along, across = c * x[:, 0] + s * x[:, 1] - length, -s * x[:, 0] + c * x[:, 1]

# %%
# **Steady rotation.** The arm is longer by :math:`\rho A\, \Omega^2 L^3 / 3 EA`.

steady = rhoA * speed**2 * length**3 / (3 * EA)
mean = along[t > ramp + 3].mean()
print(f"longer by {1e4 * mean:.3f}e-4, formula {1e4 * steady:.3f}e-4")
assert np.isclose(mean, steady, rtol=0.01)

# %%
# **Acceleration.** The inertia force bends the cantilever by
# :math:`11 \rho A\, \alpha L^4 \cdot L / 120 EI`. The centrifugal force raises the lowest
# eigenvalue from :math:`\omega_0^2` by :math:`0.193\, \Omega^2` (Southwell), and reduces the lag by
# the same factor.

S = np.minimum(t, ramp) / ramp
alpha = speed / ramp * (1 - np.cos(2 * np.pi * S)) * (t < ramp)
Omega = speed * (S - np.sin(2 * np.pi * S) / (2 * np.pi))
linear = -11 / 120 * rhoA * alpha * length**5 / EI
omega = 1.8751**2 * np.sqrt(EI / rhoA) / length**2
stiffened = linear / (1 + 0.193 * Omega**2 / omega**2)
print(f"largest lag {-across.min():.3f}, stiffened {-stiffened.min():.3f}, "
      f"linear {-linear.min():.3f}")
assert np.isclose(across.min(), stiffened.min(), rtol=0.03)
assert np.max(abs(across[t > ramp + 3])) < 0.02 * abs(across.min())

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.2), layout="constrained")
left.plot(t, linear, ":", label="linear theory")
left.plot(t, stiffened, "--", label="with Southwell's stiffening")
left.plot(t, across, label="computed")
left.set(xlabel="t (s)", ylabel="lag of the tip (m)")
left.legend(frameon=False)
history.plot("displacement", times=np.arange(4, 9, 0.5), ax=right, undeformed=False,
             colorbar=False, title="the arm every half second, t = 4 to 8.5 s")
right.set(xlabel="x (m)", ylabel="y (m)")
plt.show()

# %%
# .. [1] J. C. Simo, L. Vu-Quoc, On the dynamics of flexible beams under large overall motions, the
#    plane case: part II, J. Appl. Mech. 53 (1986) 855-863.
