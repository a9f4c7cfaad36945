r"""Poisson locking across the section
==================================

The deflection and the strain across the section of beams of orders 1 to 4 in bending, which show
Poisson locking.

In bending, the stretched side of a beam becomes thinner and the compressed side thicker. A section
of order 1 can only be stretched as a whole. So the beam is too stiff, by the factor
:math:`1/(1 - \nu^2)` on any mesh: Poisson locking. The strain across sections of order 2 and more
varies, and does not lock.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff

# %%
# A short beam is bent by a small end moment. Poisson's ratio is that of many plastics.

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
# The formulation "continuum" integrates the strain at each point, as in the first ANCF elements.
# Order 1 has exactly the factor of theory, higher orders have the right deflection.

ratios = {order: state.displacement((length, 0))[1] / tip for order, state in states.items()}
for order, ratio in ratios.items():
    print(f"order {order}: {ratio:.4f} of the deflection of a line")
assert np.isclose(ratios[1], 1 - plastic.nu**2, rtol=5e-3)
assert all(np.isclose(ratios[order], 1, rtol=5e-3) for order in (2, 3, 4))

# %%
# The strain of the elements across a section, against Poisson's ratio times the axial strain. Order
# 1 has none.

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
# The default formulation gives order 1 the right bending stiffness: it applies Poisson coupling to
# the mean of the section only. It cannot give the strain: for this use order 2 or more.

mended = bend(1, "assumed").displacement((length, 0))[1] / tip
print(f"order 1, default formulation: {mended:.4f}")
assert np.isclose(mended, 1, rtol=5e-3)
plt.show()
