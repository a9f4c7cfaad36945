r"""Form a wire around a mandrel
============================

A steel wire is bent around a mandrel, springs open when it is let go, and the mandrel for a wanted
radius is found.

On the mandrel of radius :math:`R` the axis has the curvature :math:`\kappa = 1 / (R + h / 2)`.
Letting go unloads elastically, so that :math:`\kappa - M(\kappa) / E I` stays. The moment of a
square wire with the tangent modulus :math:`E_t` is :math:`M / M_y = (1 - p) (3/2 - (\kappa_y /
\kappa)^2 / 2) + p \, \kappa / \kappa_y`, with :math:`p = E_t / E` [1]_.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, Circle, ElasticPlastic, ElementBeamCable, MeshBeam, Scene

# %%
# The wire is clamped at the top of the mandrel. Its other end moves down by 0.15 m.

E, yield_stress, hardening, h, R = 2e11, 2.5e8, 1e9, 3e-3, 0.05
steel = ElasticPlastic(E, 0.3, yield_stress, hardening, points=20)
wire = Beam(MeshBeam.init_line(np.linspace(0, 0.2, 21), h), ElementBeamCable(3), steel, width=h)


def held():
    return Scene(wire).clamp("left")


forming = held().obstacle(Circle((0, -R - h / 2), R))
forming.fix("right", "r^2", displacement=lambda t: -0.15 * t)
formed = forming.run(1.0, increments=12)
on, off = formed.state(-1), held().run(2.0, increments=2, start=formed.state(-1)).state(-1)

# %%
# **Check**: the mean curvature of the wire on the mandrel, before and after.

s = np.array([[0.0, 0.04], [0.0, 0.0]])
found = [-np.diff(state.resultants(s).angle)[0] / 0.04 for state in (on, off)]


def after_springback(curvature):
    """The curvature that stays of a wire that was bent."""
    first, p = 2 * yield_stress / (E * h), hardening / (E + hardening)
    k = curvature / first
    return curvature - first * ((1 - p) * (1.5 - 0.5 / k**2) + p * k)


wanted = 1 / (R + h / 2), after_springback(1 / (R + h / 2))
print(f"radius on the mandrel {1e3 / found[0]:.2f} mm, theory {1e3 / wanted[0]:.2f}")
print(f"radius that stays     {1e3 / found[1]:.2f} mm, theory {1e3 / wanted[1]:.2f}")
assert np.allclose(found, wanted, rtol=1e-2)
springback = [a - b for a, b in (found, wanted)]
assert np.isclose(*springback, rtol=0.08)

# %%
# For an axis of radius 60 mm the mandrel has to be smaller.

radii = np.linspace(0.03, 0.07, 4001)
mandrel = np.interp(0.06, 1 / after_springback(1 / (radii + h / 2)), radii)
print(f"a mandrel of radius {1e3 * mandrel:.2f} mm gives an axis of radius 60 mm")

# %%
# The wire on the mandrel and after springback, and the stress that stays across a section.

fig, (one, two) = plt.subplots(1, 2, figsize=(10.5, 4), layout="constrained")
on.plot("yield_ratio", ax=one, title="on the mandrel, and after springback")
axis = off.position(np.array([np.linspace(0, 0.2, 101), np.zeros(101)]))
one.plot(*axis, "k--", lw=1)
eta = np.linspace(-0.5, 0.5, 61) * h
for state, label in ((on, "on the mandrel"), (off, "after springback")):
    two.plot(1e-6 * state.stress(np.array([0 * eta + 0.021, eta]))[0], 1e3 * eta, label=label)
two.set(xlabel="axial stress (MPa)", ylabel="distance from the axis (mm)")
two.legend(frameon=False, fontsize=8, loc="lower right")
plt.show()

# %%
# .. [1] W. Johnson, P. B. Mellor: Engineering plasticity (1983), chapter 6.
