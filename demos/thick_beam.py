"""A thick beam against a plane body
=================================

Strain and stress in a block four times as long as high, compared with a two-dimensional solution by
scikit-fem.

The block is clamped and sheared at its end. The plane mesh has 25 000 degrees of freedom, the beam
1 700. Both agree across the section, even near the wall, where plane sections do not stay plane.
"""

import matplotlib.pyplot as plt
import numpy as np
from skfem import (Basis, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad, asm,
                   condense, solve)
from skfem.helpers import sym_grad
from skfem.models.elasticity import lame_parameters, linear_elasticity, linear_stress

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# Steel in plane strain, with a load small enough for linear elasticity. A uniform stress of 1 MPa
# pulls the end down.

length, height, width = 0.4, 0.1, 1.0
steel = StVenantKirchhoff(E=2.1e11, nu=0.3, plane="strain")
tau = 1e6

# %%
# **The plane body**: stock scikit-fem, quadratic quadrilaterals that become smaller towards the
# wall.

x = length * np.linspace(0, 1, 97) ** 1.5
mesh = MeshQuad.init_tensor(x, height * np.linspace(-0.5, 0.5, 33)).with_defaults()
basis = Basis(mesh, ElementVector(ElementQuad2()))
lame = lame_parameters(steel.E, steel.nu)


@LinearForm
def end_shear(v, w):
    return -tau * v[1]


plane = solve(*condense(asm(linear_elasticity(*lame), basis),
                        asm(end_shear, FacetBasis(mesh, basis.elem, facets="right")),
                        D=basis.get_dofs("left")))


middles = Basis(mesh, basis.elem, quadrature=(np.full((2, 1), 0.5), np.ones(1)))
plane_strain = sym_grad(middles.interpolate(plane))
plane_stress = linear_stress(*lame)(plane_strain)[..., 0]
places = middles.global_coordinates()[..., 0]

# %%
# **The beam**: cubic sections of order 6, with smaller elements towards the clamp.

axis = MeshBeam.init_line(np.linspace(0, length, 9), height).graded("left", size=height / 32)
beam = Beam(axis, ElementBeamANCFCubic(6), steel, width)
state = Scene(beam).clamp("left").traction("right", (0, -tau)).solve_linear()
print(f"coordinates: beam {beam.N}, plane body {basis.N}")

tip = state.displacement((length, 0))[1]
reference = (basis.probes(np.array([[length], [0.0]])) @ plane)[1]
print(f"tip: {1e6 * tip:.3f} um, plane body {1e6 * reference:.3f} um")
assert np.isclose(tip, reference, rtol=2e-3)

# %%
# Strain and stress across four sections, the first at an eighth of the height from the wall. Near
# the corners the exact stress is infinite.

fig, axes = plt.subplots(3, 4, figsize=(9.6, 8), sharey=True, sharex="row", layout="constrained")
components = (("eps_yy", plane_strain[1, 1, :, 0], r"$\varepsilon_{yy}$ ($10^{-6}$)"),
              ("S_xx", plane_stress[0, 0], r"$\sigma_{xx}$ (MPa)"),
              ("S_xy", plane_stress[0, 1], r"$\sigma_{xy}$ (MPa)"))
for distance, column in zip((0.125, 0.25, 0.5, 1.0), axes.T):
    nearest = places[0, np.argmin(abs(places[0] - distance * height))]
    points = places[:, np.isclose(places[0], nearest)]
    inner = abs(points[1]) < 0.4 * height
    for ax, (name, reference, label) in zip(column, components):
        reference = reference[np.isclose(places[0], nearest)]
        ours = state.field(name, points)
        error = np.max(abs(ours - reference)[inner]) / np.max(abs(reference))
        print(f"{name} at {nearest / height:.3f} h: {100 * error:.1f} %")
        assert error < 0.04
        scale = 1e6 if name == "eps_yy" else 1e-6
        ax.plot(scale * reference, 1e3 * points[1], lw=5, alpha=0.35, label="plane body")
        ax.plot(scale * ours, 1e3 * points[1], "k-", lw=1.2, label="beam")
        ax.set_xlabel(label)
    column[0].set_title(f"{nearest / height:.3f} h from the wall", fontsize=10)
axes[0, 0].legend(frameon=False, fontsize=8)
for ax in axes[:, 0]:
    ax.set_ylabel("Y (mm)")
plt.show()
