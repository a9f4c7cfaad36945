"""A first beam: a ruler bent by its tip
=====================================

A steel ruler is clamped at its left end and bent by a force at the other, far beyond linear theory.

Its tip ends up below the clamp. Mesh, element, material, support and load take six lines. The rest
of the script evaluates the solution.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# The ruler: 300 mm long, 25 mm wide, 0.5 mm thick. Units are metres, newtons and kilograms.

length, height, width = 0.3, 0.5e-3, 25e-3
steel = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850)

# %%
# The mesh divides the axis into elements. The cubic element of order 2 has strain along the beam
# and across its section. ``thickness="free"`` keeps the clamped section plane but does not fix its
# thickness, as in the rest of the beam.

mesh = MeshBeam.init_line(np.linspace(0, length, 25), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), steel, width)
EI = steel.E * width * height**3 / 12
force = 10 * EI / length**2

scene = Scene(beam).clamp("left", thickness="free").point_force((0, -force), at=(length, 0))
state = scene.solve_static()
print(state)

# %%
# Points are given in the undeformed beam. With :math:`P L^2 / EI = 10` the tip of the elastica
# moves down by 0.81061 L and back by 0.55500 L [1]_. The formula for small displacements,
# :math:`P L^3 / 3 EI`, gives 3.3 L.

u = state.displacement((length, 0)) / length
print(f"tip: {-u[0]:.5f} L back, {-u[1]:.5f} L down; line: 0.55500 and 0.81061")
assert np.allclose(u, [-0.55500, -0.81061], rtol=0, atol=2e-5)

# %%
# The clamp carries the force, and the moment of the force in the deformed beam.

root = state.reactions("left")
print("force and moment of the clamp:", root.force, root.moment)
assert np.isclose(root.moment, force * state.position((length, 0))[0], rtol=1e-6)

# %%
# Strain along and across the beam at the lower surface of the root. 0.4 % would break many steels.
# The compressed side becomes thicker, by Poisson's ratio.

eps_xx, eps_yy, _ = state.strain((0, -height / 2))
print(f"lower surface of the root: eps_xx = {eps_xx:.5f}, eps_yy = {eps_yy:.5f}")
assert np.isclose(eps_yy, -steel.nu * eps_xx, rtol=0.01)

# %%
# A picture, coloured by the stress along the beam. ``state.save("ruler.vtu")`` writes a file for
# ParaView.

fig, ax = plt.subplots(figsize=(6.4, 5), layout="constrained")
state.plot("S_xx", ax=ax, title="stress along the ruler $S_{xx}$", unit="Pa")
ax.set(xlabel="x (m)", ylabel="y (m)")
plt.show()

# %%
# .. [1] K. Mattiasson, Numerical results from large deflection beam and frame problems analysed by
#    means of elliptic integrals, Int. J. Numer. Methods Eng. 17 (1981) 145-153, table I.
