"""The cantilever of the paper
===========================

A slender cantilever under a tip force and under its weight, compared with examples 5.1 and 5.2 of
the paper.

The paper [1]_ defines the elements of this package. The last part solves the same problem with the
default formulation. It shows that sixteen of the paper's elements are far from the limit. ``make
demo`` runs this script.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff

length, side, elements = 1.0, 0.01, 16
out = Path("out")
mesh = MeshBeam.init_line(np.linspace(0, length, elements + 1), height=side)

# %%
# The beam of the paper: sections of order 3, the formulation "continuum", a shear correction
# factor, and the degrees of freedom that it fixes at the root, by name. This is not
# ``clamp("left")``, which fixes r and all of r_Y and leaves r_X free.


def paper(E):
    material = StVenantKirchhoff(E=E, nu=0.3, density=7800, shear_correction="paper")
    beam = Beam(mesh, ElementBeamANCF(3), material, width=side, formulation="continuum")
    return Scene(beam).fix("left", ["r", "r_X", "r_Y1", "r_Y0^1", "r_Y2^1"])


print(f"Cantilever, {elements} elements of order 3\nunder its own weight (E = 2e8):")
large = paper(2e8).gravity((0, -9.81)).solve_static(first_step=0.1, progress=True)
print("under a tip force of 10 N (E = 2e11):")
small = paper(2e11).point_force((0, -10), at=(length, 0)).solve_static(progress=True)

# %%
# The table: displacements in metres, strains without unit.

rows = [
    ("gravity, tip u_y", large.displacement((length, 0))[1], -0.885455, 1.5e-6, "paper, table 4"),
    ("tip force, tip u_y", small.displacement((length, 0))[1], -0.02, 5e-5, "Euler-Bernoulli"),
    ("tip force, eps_yy at the root, top", small.strain((0, side / 2))[1], -90e-6, 4e-6, "paper"),
    ("tip force, eps_yy at the root, bottom", small.strain((0, -side / 2))[1], 90e-6, 4e-6,
     "paper"),
]
print(f"\n{'':37}{'here':>12}{'reference':>12}")
for name, here, reference, tolerance, source in rows:
    print(f"{name:37}{here:12.6g}{reference:12.6g}  {source}")
    assert abs(here - reference) < tolerance

# %%
# The default formulation with as many elements, clamped. The limit of fine meshes is -0.9033 m.

soft = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
ours = Scene(Beam(mesh, ElementBeamANCF(3), soft, width=side)).clamp("left").gravity((0, -9.81))
ours = ours.solve_static()
print(f"\ndefault formulation: gravity, tip u_y = {ours.displacement((length, 0))[1]:.6f}")

# %%
# Both beams, coloured by the strain across the section, and their roots to scale.

figure, axes = plt.subplots(1, 2, figsize=(11.5, 6), layout="constrained")
for ax, state, recover, title in (
        (axes[0], ours, True, r"default formulation: recovered $\varepsilon_{yy}$"),
        (axes[1], large, False, r"the paper's element: its own $\varepsilon_{yy}$")):
    look = dict(limits=(-0.015, 0.015), recover=recover)
    state.plot("eps_yy", ax=ax, title=title, colorbar=state is large, **look)
    zoom = ax.inset_axes([0.42, 0.08, 0.56, 0.66])
    state.plot("eps_yy", ax=zoom, thickness=1, colorbar=False, title="the root, to scale",
               undeformed=False, **look)
    zoom.set(xlim=(-0.005, 0.13), ylim=(-0.115, 0.0225), xlabel="", ylabel="")
    ax.set(xlim=(-0.05, 1.05), ylim=(-0.95, 0.05), xlabel="x (m)", ylabel="y (m)")

# %%
# Files for ParaView, and the picture.

files = [large.save(out / "cantilever_gravity.vtu"), small.save(out / "cantilever_force.vtu"),
         out / "cantilever.png"]
figure.savefig(files[-1], dpi=150)
print("wrote " + ", ".join(map(str, files)))

# %%
# .. [1] A series of locking-free beam element models in absolute nodal coordinate formulation,
#    Archive of Applied Mechanics (2024).
