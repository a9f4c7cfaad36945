r"""Springback of a bent strip
==========================

A press bends a steel strip beyond yield, and the angle that stays is compared with plastic theory.

A punch pushes the middle of a strip that lies on two supports, and goes back. The moment is
:math:`M(x) = P (a - |x|) / 2`. Beyond the curvature of first yielding :math:`\kappa_y`, that of a
rectangle without hardening is :math:`M / M_y = 3/2 - (\kappa_y / \kappa)^2 / 2` [1]_. Unloading is
elastic, so that :math:`\kappa - M / E I` stays.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElasticPlastic, ElementBeamCable, MeshBeam, Scene

# %%
# The yield stress grows by a thousandth of E times the plastic strain: without any hardening, a
# hinge would bend one element only. Elements are short in the middle, and 20 points across the
# section give its moment to 0.4 %.

E, yield_stress, h, b, a = 2e11, 3e8, 3e-3, 0.02, 0.1
steel = ElasticPlastic(E, 0.3, yield_stress, hardening=1e-3 * E, points=20)
half = a * np.linspace(0, 1, 13) ** 2
mesh = MeshBeam.init_line(np.append(-half[:0:-1], half), h)
strip = Beam(mesh, ElementBeamCable(3), steel, width=b)

# %%
# The punch moves down by 6 mm and is taken away: another scene of the same strip goes on from the
# last state, with its plastic strains.


def supported():
    return Scene(strip).pin("left").fix("right", "r^2")


pressed = supported().fix((0, 0), "r^2", displacement=lambda t: -6e-3 * t).run(1.0, increments=24)
freed = supported().run(2.0, increments=1, start=pressed.state(-1))
bent, left = pressed.state(-1), freed.state(-1)

# %%
# **Check**: the force of the punch, and the angle between both halves, from the curvature of the
# theory by numerical integration.

M_y, first = b * h**2 / 6 * yield_stress, 2 * yield_stress / (E * h)
force = -pressed.reactions((0, 0)).force[:, 1]
s = np.linspace(0, a, 4001)
k = np.linspace(0, 20, 20001)
part = 1e-3 / (1 + 1e-3)  # of the hardening in the slope of the stress
of_k = (1 - part) * np.where(k < 1, k, 1.5 - 0.5 / np.maximum(k, 1) ** 2) + part * k
M = 0.5 * force[-1] * (a - s) / M_y
curvature = np.interp(M, of_k, k) * first
angles = [np.degrees(2 * np.sum(np.diff(s) * 0.5 * (c[1:] + c[:-1])))
          for c in (curvature, curvature - M * first)]
ends = np.array([[-a, a], [0.0, 0.0]])
found = [np.degrees(np.ptp(state.resultants(ends).angle)) for state in (bent, left)]
print(f"force {force[-1]:.0f} N, {force[-1] * a / 2 / M_y:.3f} times that of first yielding")
print(f"angle under the punch {found[0]:.2f} degrees, theory {angles[0]:.2f}; "
      f"after springback {found[1]:.2f}, theory {angles[1]:.2f}")
assert np.allclose(found, angles, rtol=0, atol=0.1)
assert np.isclose(freed.dissipated[-1], pressed.dissipated[-1], rtol=1e-6)

# %%
# The force and the deflection, and the stress that stays: the stretched surface is compressed.

eta = np.linspace(-0.5, 0.5, 41) * h
section = np.array([0.0 * eta + 1e-3, eta])
fig, axes = plt.subplot_mosaic("ab;cc", figsize=(8.5, 5.5), height_ratios=[2, 1],
                               layout="constrained")
one, two, three = axes.values()
way = [-6 * t for t in pressed.t] + [1e3 * left.displacement((0, 0))[1]]
one.plot(-np.array(way), [*force, 0.0], "k")
one.set(xlabel="way of the punch (mm)", ylabel="force (N)")
for state, label in ((bent, "under the punch"), (left, "after springback")):
    two.plot(1e-6 * state.stress(section)[0], 1e3 * eta, label=label)
two.set(xlabel="axial stress (MPa)", ylabel="distance from the axis (mm)")
two.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
left.plot("plastic_strain", ax=three, scale=5, title="")
plt.show()

# %%
# .. [1] W. Johnson, P. B. Mellor: Engineering plasticity (1983), chapter 6.
