r"""A machine on a rubber block on a leaf spring
============================================

The static deflection and the natural frequencies of a machine on a rubber block on a leaf spring.

The leaf is a beam and the machine a rigid body. The rubber is as high as it is wide, so it is no
beam: it is a plane mesh of scikit-fem.
"""

import matplotlib.pyplot as plt
import numpy as np
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad, condense, solve

from skfem_ancf import (Beam, Domain, ElementBeamANCF, MeshBeam, NeoHookean, RigidBody, Scene,
                        StVenantKirchhoff)
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# The leaf: 1 m between its eyes, 60 mm wide, 12 mm thick.

span, width, thick = 1.0, 0.06, 12e-3
leaf = Beam(MeshBeam.init_line(np.linspace(0, span, 17), thick), ElementBeamANCF(2),
            StVenantKirchhoff(E=2.06e11, nu=0.3, density=7850), width, name="leaf")

# %%
# The rubber: 60 mm long, 80 mm high, a compressible neo-Hookean material in plane strain.

rubber, long, high = NeoHookean(E=1e6, nu=0.45, density=1100, plane="strain"), 0.06, 0.08
mesh = MeshQuad.init_tensor(np.linspace(-long / 2, long / 2, 9), np.linspace(0, high, 11))
mesh = mesh.translated((span / 2, thick / 2)).with_defaults()
block = Domain.solid(Basis(mesh, ElementVector(ElementQuad2())), rubber, width, name="rubber")

# %%
# All three in one scene: the rubber is joined to the top of the leaf and to the machine.

machine = RigidBody(mass=20.0, inertia=0.15, position=(span / 2, thick / 2 + high + 0.06),
                    name="machine",
                    outline=[(-0.1, -0.06), (0.1, -0.06), (0.1, 0.06), (-0.1, 0.06)])
scene = Scene(leaf, block, machine).pin("left", leaf).fix("right", "r^2", beam=leaf)
scene.weld((block, "bottom"), (leaf, "top"))
scene.weld((block, "top"), machine)
scene.gravity((0, -9.81))
state = scene.solve_static()
modes = scene.modes(3, state)
sunk = -state.displacement(machine.position, machine)[1]
print(f"{state.verdict}; the machine sinks by {1e3 * sunk:.2f} mm, of which the leaf bends by "
      f"{-1e3 * state.displacement((span / 2, 0), leaf)[1]:.2f} mm")
print("frequencies:", *(f"{f:.2f} Hz" for f in modes.frequencies / (2 * np.pi)))

# %%
# **Check**: two springs in series. The stiffness of the leaf is 48 E I / L^3. That of the rubber
# between rigid plates is computed with scikit-fem alone.

basis = block.basis
top, bottom = basis.get_dofs("top"), basis.get_dofs("bottom")
x = basis.zeros()
K = block.tangent.assemble(basis, u=basis.interpolate(x))
x[top.nodal["u^2"]] = x[top.facet["u^2"]] = 1.0
x = solve(*condense(K, x=x, D=np.concatenate([top.all(), bottom.all()])))
soft, steel = x @ K @ x, 48 * 2.06e11 * width * thick**3 / 12 / span**3
both = 1 / (1 / soft + 1 / steel)
heave = min(modes.frequencies, key=lambda w: abs(w - np.sqrt(both / machine.mass)))
print(f"leaf {1e-3 * steel:.1f} N/mm, rubber {1e-3 * soft:.1f} N/mm: heave at "
      f"{heave / (2 * np.pi):.2f} Hz, two springs {np.sqrt(both / machine.mass) / (2 * np.pi):.2f}")
assert state.stability == "stable" and abs(heave / np.sqrt(both / machine.mass) - 1) < 0.05

rocking = modes.mode(0, amplitude=0.05)
fig, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for ax, shown, title in zip(axes, (state, rocking), ("at rest under gravity", "first mode")):
    plot_state(shown, "eps_yy", ax=ax, title=title, thickness=1, limits=(-0.1, 0.1))
    ax.set(xlim=(0.3, 0.7), xlabel="x (m)", ylabel="y (m)")
plt.show()
