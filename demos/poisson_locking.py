r"""Poisson locking, seen across the section
========================================

Bend a rubber: the side that is pulled gets thinner, the side that is pressed gets thicker. An
element whose section can only be stretched as a whole cannot do that. It then bends as if it were
stiffer, by :math:`1/(1 - \nu^2)`, on any mesh: that is Poisson locking. Elements of order 2 and
more have a strain across the section that varies, and follow.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff

# %%
# A short, soft beam is bent by a small end moment. Poisson's ratio is that of many plastics.

length, height, width = 1.0, 0.1, 0.1
plastic = StVenantKirchhoff(E=2e9, nu=0.4)
EI = plastic.E * width * height**3 / 12
curvature = 0.01                                # 1/m
moment = EI * curvature
tip = curvature * length**2 / 2                 # what a line would do


def bend(order, formulation="continuum"):
    mesh = MeshBeam.init_line(np.linspace(0, length, 65), height)
    beam = Beam(mesh, ElementBeamANCF(order), plastic, width, formulation)
    return Scene(beam).clamp("left", thickness="free").moment("right", moment).solve_static()


states = {order: bend(order) for order in (1, 2, 3, 4)}

# %%
# The formulation "continuum" takes the strain at each point as it is, as the first elements of the
# kind did. Order 1 is off by just the factor of the textbook, the others are not.

ratios = {order: state.displacement((length, 0))[1] / tip for order, state in states.items()}
for order, ratio in ratios.items():
    print(f"order {order}: {ratio:.4f} of the deflection of a line")
assert np.isclose(ratios[1], 1 - plastic.nu**2, rtol=5e-3)
assert all(np.isclose(ratios[order], 1, rtol=5e-3) for order in (2, 3, 4))

# %%
# The strain of the elements across a section in the middle, against Poisson's ratio times that
# along the beam. Order 1 has none at all.

y = height * np.linspace(-0.5, 0.5, 41)
points = np.array([np.full_like(y, length / 2), y])
exact = plastic.nu * curvature * y              # eps_xx = -curvature y

fig, axes = plt.subplot_mosaic([["section", "order 1"], ["section", "order 2"]],
                               figsize=(9.4, 4.2), width_ratios=(1, 1.6), layout="constrained")
left = axes["section"]
for order, style in zip(states, ("o-", "s-", "-", "--")):
    eps_yy = states[order].strain(points, recover=False)[1]
    left.plot(1e4 * eps_yy, 1e3 * y, style, markevery=8, lw=2 if order < 4 else 1.2,
              label=f"order {order}")
    error = np.max(np.abs(eps_yy - exact)) / exact.max()
    print(f"order {order}: eps_yy off by {100 * error:.1f} % of its largest value")
    assert error < 0.02 if order > 1 else error > 0.95
left.plot(1e4 * exact, 1e3 * y, "k:", label=r"$-\nu\,\varepsilon_{xx}$")
left.set(xlabel=r"$\varepsilon_{yy}$ ($10^{-4}$)", ylabel="Y (mm)",
         title="half way, elements' own strain")
left.legend(frameon=False)
for order in (1, 2):
    ax = axes[f"order {order}"]
    states[order].plot("eps_yy", ax=ax, recover=False, limits=(-2.01e-4, 2.01e-4), undeformed=False,
                       colorbar=order == 2, title=rf"order {order}: $\varepsilon_{{yy}}$")
    ax.set(xlabel="x (m)", ylabel="y (m)")

# %%
# The default formulation gives elements of order 1 the right bending stiffness, by leaving the
# coupling to the mean of the section. It cannot give them the strain: take order 2 or more.

mended = bend(1, "assumed").displacement((length, 0))[1] / tip
print(f"order 1, default formulation: {mended:.4f}")
assert np.isclose(mended, 1, rtol=5e-3)
plt.show()
