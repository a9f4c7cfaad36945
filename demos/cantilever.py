"""A slender cantilever, under its own weight and under a small tip force: examples 5.1 and 5.2.

    python demos/cantilever.py

writes the deformed bodies with their strains and stresses to out/*.vtu, and pictures of them,
coloured by the strain across the section, to out/*.png: under its own weight beside the same beam
with the default formulation. The numbers and files are those of the element of "A series of
locking-free beam element models in absolute nodal coordinate formulation" (Archive of Applied
Mechanics, 2024).
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff

LENGTH, SIDE, NU, DENSITY = 1.0, 0.01, 0.3, 7800.0
# what the paper fixes at the root for N = 3, by scikit-fem's names of the coordinates; a welded
# face, scene.clamp("left"), would fix r and all of r_Y and leave r_X free
ROOT = ["r", "r_X", "r_Y1", "r_Y0^1", "r_Y2^1"]


def cantilever(E, elements):
    """The beam with the paper's section, material and supports."""
    mesh = MeshBeam.init_line(np.linspace(0, LENGTH, elements + 1), height=SIDE)
    material = StVenantKirchhoff(E=E, nu=NU, density=DENSITY, plane="stress",
                                 shear_correction="paper")
    beam = Beam(mesh, ElementBeamANCF(3), material, width=SIDE, formulation="continuum")
    return Scene(beam).fix("left", ROOT)


def picture(state, filename, recover=True):
    """The deformed body, and its root enlarged."""
    ax = draw(state, recover=recover)
    ax.figure.savefig(filename, dpi=150, bbox_inches="tight")


def draw(state, ax=None, **options):
    """The deformed body with its root enlarged, on matplotlib Axes."""
    look = dict(limits=(-0.015, 0.015), recover=options.pop("recover", True))
    ax = state.plot("eps_yy", ax=ax, **look, **options)
    zoom = ax.inset_axes([0.42, 0.08, 0.56, 0.66])
    state.plot("eps_yy", ax=zoom, thickness=1, colorbar=False, title="the root, to scale",
               undeformed=False, **look)
    zoom.set(xlim=(-0.005, 0.13), ylim=(-0.115, 0.0225), xlabel="", ylabel="")
    return ax


def default(elements):
    """The same beam with the default formulation, welded, under its own weight."""
    mesh = MeshBeam.init_line(np.linspace(0, LENGTH, elements + 1), height=SIDE)
    beam = Beam(mesh, ElementBeamANCF(3), StVenantKirchhoff(E=2e8, nu=NU, density=DENSITY),
                width=SIDE)
    return Scene(beam).clamp("left").gravity((0, -9.81)).solve_static()


def compare(ours, paper, filename):
    """Both side by side, with the same colours."""
    left, right = Figure(figsize=(11.5, 6.0), layout="constrained").subplots(1, 2)
    n = paper.beams[0].mesh.nelements
    draw(ours, left, colorbar=False, title=f"default formulation, {n} elements: recovered "
         r"$\varepsilon_{yy}$")
    draw(paper, right, recover=False, title=f"the paper's element, {n} elements: its own "
         r"$\varepsilon_{yy}$")
    for ax in (left, right):
        ax.set(xlim=(-0.05, 1.05), ylim=(-0.95, 0.05))
    left.figure.savefig(filename, dpi=150, bbox_inches="tight")


def main(out="out", elements=16, progress=True):
    """Solve both, print a table against the paper, and write files; returns the two states."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    print(f"Cantilever, {elements} elements of order 3\n\nunder its own weight (E = 2e8):")
    large = cantilever(2e8, elements).gravity((0, -9.81)).solve_static(
        first_step=0.1, progress=progress)
    print("under a tip force of 10 N (E = 2e11):")
    small = cantilever(2e11, elements).point_force((0, -10), at=(LENGTH, 0)).solve_static(
        first_step=0.1, progress=progress)

    rows = [("gravity, tip u_y (m)", large.displacement((LENGTH, 0))[1], -0.885455,
             "paper, table 4"),
            ("tip force, tip u_y (m)", small.displacement((LENGTH, 0))[1], -0.02,
             "Euler-Bernoulli"),
            ("tip force, eps_y at the root, top", small.strain((0, SIDE / 2))[1], -90e-6, "paper"),
            ("tip force, eps_y at the root, bottom", small.strain((0, -SIDE / 2))[1], 90e-6,
             "paper")]
    print(f"\n{'':37}{'here':>12}{'reference':>12}")
    for name, here, reference, source in rows:
        print(f"{name:37}{here:12.6g}{reference:12.6g}  {source}")
    print(f"\nload steps: {len(large.steps)} and {len(small.steps)}, iterations: "
          f"{large.iterations} and {small.iterations}")

    files = [large.save(out / "cantilever_gravity.vtu"), small.save(out / "cantilever_force.vtu"),
             out / "cantilever_gravity.png", out / "cantilever_force.png"]
    compare(default(elements), large, files[2])
    small.plot("eps_yy", filename=files[3])
    print("wrote " + ", ".join(map(str, files)))
    return large, small


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", default="out", help="folder for the files")
    parser.add_argument("--elements", type=int, default=16)
    main(**vars(parser.parse_args()))
