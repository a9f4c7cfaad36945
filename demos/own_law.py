r"""Your own material law
=====================

Cast iron, wood and many plastics are softer in tension and compression the more they are strained.
A law is a class with an energy and a stress, in as many lines as its formula takes. It works in
every element, in statics and motion; its derivatives are found for you. Here is one that saturates,
bent further than Hooke's law would believe.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad
from scipy.optimize import fsolve

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.materials import Material
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# The law: along each direction of the axes of the beam the stress is :math:`E e_0 \tanh(\varepsilon
# / e_0)`, which tends to :math:`E e_0`. Energy and stress of the Green-Lagrange strain, whose
# components xx, yy and 2 xy come first in an array of any shape.

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
# A strip is bent by an end moment: the handbook says to which curvature only for Hooke's law.

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
# **The check**: with sections that stay plane, force and moment are integrals of the stretch of the
# axis and the curvature, which have to give no force and the moment.


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
# At the largest moment both laws; and the stress across the section, which Hooke's law exceeds.

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
