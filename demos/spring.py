"""A meander spring, curved in its stress-free state, pulled until it is nearly straight.

    python demos/spring.py

The spring follows y = A sin(x), is clamped at one end and pulled by a force along x at the other.
Its stiffness rises as the bends straighten. Writes out/spring.vtu and out/spring.png.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, NeoHookean, Scene

PERIODS, AMPLITUDE, HEIGHT, WIDTH = 3, 1.6, 0.3, 1.0
FORCES = (2.0, 8.0, 32.0, 128.0)


def meander(s):
    """The axis: the parameter runs along x."""
    return np.array([s, AMPLITUDE * np.sin(s)])


def main(out="out", elements=72, progress=True):
    """Pull with growing forces, print the extension and write files; returns the last state."""
    out = Path(out)
    mesh = MeshBeam.init_curve(meander, np.linspace(0, 2 * np.pi * PERIODS, elements + 1), HEIGHT)
    beam = Beam(mesh, ElementBeamANCF(3), NeoHookean(E=2e4, nu=0.45, plane="strain"), WIDTH)
    end, length = mesh.p[:, -1], mesh.lengths.sum()
    print(f"{elements} elements of order 3, axis of length {length:.4g}, end to end {end[0]:.4g}")
    print(f"{'force':>8}{'end to end':>12}{'stiffness':>11}")
    before = (0.0, end[0])
    axes = Figure(figsize=(8, 7), layout="constrained").subplots(len(FORCES), 1, sharex=True)
    for force, ax in zip(FORCES, axes):
        scene = Scene(beam).clamp("left").point_force((force, 0), at=end)
        state = scene.solve_static(progress=progress)
        now = (force, state.position(end)[0])
        stiffness = (now[0] - before[0]) / (now[1] - before[1])
        print(f"{force:8g}{now[1]:12.4f}{stiffness:11.3f}")
        before = now
        state.plot("eps_xx", ax=ax, thickness=1, limits=(-0.06, 0.06),
                   title=f"axial strain at a force of {force:g}",
                   colorbar=ax is axes[-1])
        ax.set(xlabel="x" if ax is axes[-1] else "", ylim=(-2.4, 2.4))
    state.save(out / "spring.vtu")
    axes[0].figure.savefig(out / "spring.png", dpi=150, bbox_inches="tight")
    print(f"wrote {out / 'spring.vtu'} and {out / 'spring.png'}")
    return state


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", default="out", help="folder for the files")
    parser.add_argument("--elements", type=int, default=72)
    main(**vars(parser.parse_args()))
