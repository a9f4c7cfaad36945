r"""A user-defined material
=======================

A strip of a user-defined material, whose stress saturates with the strain, is bent by an end
moment.

Cast iron, wood and many plastics become softer as they are strained. A material is a class with an
energy and a stress. It works with all elements, in statics and motion; its derivatives are found
numerically. Here it bends the strip further than Hooke's law.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad
from scipy.optimize import fsolve

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.materials import Material
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# The stress along each axis of the beam is :math:`E e_0 \tanh(\varepsilon / e_0)`, which tends to
# :math:`E e_0`. Energy and stress are functions of the Green-Lagrange strain, an array whose first
# axis has the components xx, yy and 2 xy.

limit = 0.01


class Saturating(Material):
    """Stress E e tanh(eps / e) in each direction, no coupling between them."""

    def energy(self, strain):
        x, y, shear = strain
        logs = np.log(np.cosh(x / limit)) + np.log(np.cosh(y / limit))
        return self.E * (limit**2 * logs + shear**2 / 4)

    def stress(self, strain):
        x, y, shear = strain
        return self.E * np.array([limit * np.tanh(x / limit), limit * np.tanh(y / limit),
                                  shear / 2])


# %%
# A strip is bent by an end moment. Handbooks have its curvature for Hooke's law only.

length, height, width = 0.5, 0.01, 0.02
plastic = Saturating(E=2e9, nu=0.0)
hooke = StVenantKirchhoff(E=2e9, nu=0.0)
EI = hooke.E * width * height**3 / 12
mesh = MeshBeam.init_line(np.linspace(0, length, 9), height)


def bend(material, moment, start=None):
    beam = Beam(mesh, ElementBeamANCFCubic(2), material, width)
    scene = Scene(beam).clamp("left", thickness="free").moment("right", moment)
    return scene.solve_static(start=start)


moments, states = EI * np.array([0.5, 1.0, 1.5, 2.0, 2.4]), [None]
for moment in moments:
    states.append(bend(plastic, moment, start=states[-1]))
states = states[1:]
curvatures = [state.resultants((length / 2, 0)).curvature for state in states]

# %%
# **Check**: plane sections. Force and moment are integrals over the section, of the stretch of the
# axis and the curvature. The force must be zero, and the moment the given one.


def section(axis, curvature, part):
    def share(y):
        stretch = axis - y * curvature
        return stretch * np.tanh((stretch**2 - 1) / 2 / limit) * (-y if part == "moment" else 1)
    return hooke.E * width * limit * quad(share, -height / 2, height / 2)[0]


for moment, found in zip(moments, curvatures):
    expected = fsolve(lambda x, M: [section(*x, "force") / EI, section(*x, "moment") / M - 1],
                      [1, moment / EI], args=(moment,))[1]
    print(f"M = {moment:.3f} N m: curvature {found:.4f} 1/m, integral {expected:.4f}, "
          f"Hooke {moment / EI:.4f}")
    assert np.isclose(found, expected, rtol=2e-3)

# %%
# Both materials at the largest moment, and their stress across the section.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.2), width_ratios=(1.6, 1),
                                  layout="constrained")
elastic = bend(hooke, moments[-1])
plot_state([elastic, states[-1]], "S_xx", ax=left, unit="Pa",
           title="stress $S_{xx}$: Hooke's law (less bent), and the one that saturates")
left.set(xlabel="x (m)", ylabel="y (m)")
y = height * np.linspace(-0.5, 0.5, 41)
for state, name in ((elastic, "Hooke"), (states[-1], "saturating")):
    stress = state.stress(np.array([np.full_like(y, length / 2), y]))[0]
    right.plot(1e-6 * stress, 1e3 * y, label=name)
right.set(xlabel="$S_{xx}$ (MPa)", ylabel="Y (mm)", title="half way")
right.legend(frameon=False)
plt.show()
