r"""A polymer clip that relaxes
============================

The arm of a polymer clip grips less and less, and does not come back at once when it is taken off.

The stiffness relaxes as :math:`\psi(t) = 1 - g (1 - e^{-t / \tau})`. An arm that is held deflected
by :math:`\delta` for the time :math:`T` grips with :math:`F_0 \psi(t)`. Taken off it comes back at
once to :math:`\delta (1 - \psi(T))`, and then slowly, as :math:`e^{-(1 - g) t / \tau}` [1]_.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Prony, Scene, StVenantKirchhoff

# %%
# A third of the stiffness relaxes in weeks. The arm is 20 mm long and is deflected by 1 mm for
# 60 days. Times are in days; a rate of strain within an increment is constant, so increments may be
# long where the arm is held.

g, tau, held_for = 0.35, 20.0, 60.0
polymer = Prony(StVenantKirchhoff(E=2.4e9, nu=0.38), shares=[g], times=[tau])
arm = Beam(MeshBeam.init_line(np.linspace(0, 0.02, 7), height=1.5e-3), ElementBeamANCF(2), polymer,
           width=4e-3)


def clip():
    return Scene(arm).clamp("left", thickness="free")


gripping = clip().fix("right", "r^2", displacement=lambda t: -1e-3 * min(t / 1e-3, 1.0))
grip = gripping.run([1e-3, 1.0, 10.0, held_for], increments=8)
off = clip().run(held_for + np.array([1e-3, 1.0, 10.0, 100.0]), increments=16,
                 start=grip.state(-1))

# %%
# **Check**: the force, and what stays of the deflection.

force = -grip.reactions("right").force[:, 1]
psi = 1 - g * (1 - np.exp(-grip.t / tau))
pushed = grip.t >= 1e-3
assert np.allclose(force[pushed] / force[pushed][0], psi[pushed], rtol=2e-4)
left = -off.displacement("right")[:, 1]
days = off.t - held_for
theory = 1e-3 * (1 - psi[-1]) * np.exp(-(1 - g) * days / tau)
free = days > 1e-3
print(f"grip {force[pushed][0]:.2f} N at once, {force[-1]:.2f} N after {held_for:.0f} days")
print(f"deflection just taken off {1e3 * left[free][0]:.3f} mm, theory {1e3 * theory[free][0]:.3f};"
      f" after 100 days {1e3 * left[-1]:.4f} mm, theory {1e3 * theory[-1]:.4f}")
assert np.allclose(left[free], theory[free], atol=4e-6)

# %%
# Force and deflection over the time.

fig, (one, two) = plt.subplots(1, 2, figsize=(8.5, 3.2), layout="constrained")
one.plot(grip.t[pushed], force[pushed], "k.", label="run")
one.plot(grip.t[pushed], force[pushed][0] * psi[pushed], lw=1, label="theory")
one.set(xlabel="days on the part", ylabel="grip (N)", ylim=(0, None))
two.plot(days[free], 1e3 * left[free], "k.", label="run")
two.plot(days[free], 1e3 * theory[free], lw=1, label="theory")
two.set(xlabel="days after it was taken off", ylabel="deflection (mm)")
one.legend(frameon=False)
plt.show()

# %%
# .. [1] W. N. Findley, J. S. Lai, K. Onaran: Creep and relaxation of nonlinear viscoelastic
#        materials (1976), chapter 5.
