"""A straight beam rolled up by an end moment: the moment 2 pi EI / L turns its end once around.

    python demos/rollup.py

writes out/rollup.pvd, a series for ParaView with one frame per quarter of the moment, and the
picture out/rollup.png. A line with a linear law would close to a circle. A body of St.
Venant-Kirchhoff material with nu = 0 is softer in bending and turns farther: with a = (h kappa)^2,

    M / (EI kappa) = 1 - 0.3 a     if the sections stay rigid,
    M / (EI kappa) = 1 - 0.5 a     if they strain freely,

both up to terms in a^2. In between, the tension of the outer fibres presses the section
together, eps_yy = kappa^2 (Y^2 / 2 - h^2 / 8), a parabola that sections of order 3 can carry.
"""

import argparse
from pathlib import Path

import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.io import PvdWriter

LENGTH, HEIGHT, WIDTH, E = 1.0, 0.02, 0.02, 2e8
EI = E * WIDTH * HEIGHT**3 / 12


def end_angle(state):
    """Angle that the end has turned by, counted from the nearest full turn."""
    d = state.position((LENGTH, HEIGHT / 2)) - state.position((LENGTH, -HEIGHT / 2))
    return float(np.arctan2(-d[0], d[1]))


def closed_form(c=0.5):
    """Angle of the end of the body at M = 2 pi EI / L, from M = EI kappa (1 - c (h kappa)^2)."""
    kappa = 2 * np.pi / LENGTH
    for _ in range(50):
        kappa = 2 * np.pi / LENGTH / (1 - c * (HEIGHT * kappa) ** 2)
    return kappa * LENGTH


def main(out="out", elements=24, progress=True):
    """Roll it up in quarters, print the end's angle and write files; returns the last state."""
    out = Path(out)
    beam = Beam(MeshBeam.init_line(np.linspace(0, LENGTH, elements + 1), height=HEIGHT),
                ElementBeamANCFCubic(3), StVenantKirchhoff(E=E, nu=0.0, shear_correction=1.0),
                WIDTH)
    state, ax = None, None
    with PvdWriter(out / "rollup.pvd") as series:
        for quarter in range(1, 5):
            scene = Scene(beam).clamp("left").moment("right", quarter / 4 * 2 * np.pi * EI / LENGTH)
            state = scene.solve_static(first_step=0.25, progress=progress)
            series.add(state, quarter / 4)
            ax = state.plot("eps_xx", ax=ax, undeformed=quarter == 1, colorbar=quarter == 4,
                            limits=(-0.07, 0.07), thickness=1,
                            title="axial strain at 1/4, 1/2, 3/4 and 1 times $2\\pi EI/L$")
    angle = 2 * np.pi + end_angle(state)
    print(f"{elements} elements of order 3 with cubic sections, h/L = {HEIGHT / LENGTH:g}")
    print(f"the end has turned by     {angle / (2 * np.pi):.6f} x 2 pi")
    print(f"closed form of the body:  {closed_form() / (2 * np.pi):.6f} x 2 pi")
    print(f"with rigid sections:      {closed_form(0.3) / (2 * np.pi):.6f} x 2 pi")
    ax.figure.savefig(out / "rollup.png", dpi=150, bbox_inches="tight")
    print(f"wrote {series.path} and {out / 'rollup.png'}")
    return state


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", default="out", help="folder for the files")
    parser.add_argument("--elements", type=int, default=128)
    main(**vars(parser.parse_args()))
