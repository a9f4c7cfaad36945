"""Makes the pictures of the guides: python docs/pictures.py."""

import runpy
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.actions.obstacles import Circle, Line

DOCS = Path(__file__).resolve().parent
DEMOS = DOCS.parent / "demos"
#: Demos in the picture of the start page.
STARTS = {"compliant_gripper": "a soft gripper closes",
          "hanging_bridge": "a bridge swings in gusts", "soft_finger": "a finger is pumped up",
          "frame": "a frame is pushed sideways", "column": "a strip buckles",
          "rollup": "a beam is bent to a circle"}


def cantilever(elements):
    """The paper's cantilever under its own weight."""
    soft = StVenantKirchhoff(E=2e8, nu=0.3, density=7800, shear_correction="paper")
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, elements + 1), height=0.01),
                ElementBeamANCF(3), soft, width=0.01, formulation="continuum")
    scene = Scene(beam).fix("left", ["r", "r_X", "r_Y1", "r_Y0^1", "r_Y2^1"])
    return scene.gravity((0, -9.81)).solve_static()


def with_root(state, filename, recover):
    """The deformed body, and its root enlarged."""
    look = dict(limits=(-0.015, 0.015), recover=recover)
    ax = state.plot("eps_yy", **look)
    zoom = ax.inset_axes([0.42, 0.08, 0.56, 0.66])
    state.plot("eps_yy", ax=zoom, thickness=1, colorbar=False, title="the root, to scale",
               undeformed=False, **look)
    zoom.set(xlim=(-0.005, 0.13), ylim=(-0.115, 0.0225), xlabel="", ylabel="")
    ax.figure.savefig(filename, dpi=150, bbox_inches="tight")


def on_a_cylinder():
    """The first state of obstacles.md."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 33), height=0.01), ElementBeamCable(5),
                StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
    scene = Scene(beam).clamp("left").gravity((0, -9.81)).obstacle(Circle((0.5, -0.15), 0.1))
    return scene.obstacle(Line((0, -0.2), normal=(0, 1)), friction=0.3).solve_static()


def pushed_frame(n=5):
    """The first state of frames.md."""
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    lines = np.hstack([[number[:-1].ravel(), number[1:].ravel()],
                       [number[1:, :-1].ravel(), number[1:, 1:].ravel()]]).T
    frame = Frame.from_lines(np.column_stack(np.divmod(number.ravel(), n + 1)[::-1]), lines,
                             material=StVenantKirchhoff(E=2.1e11, nu=0.3), height=0.02, width=0.02)
    return frame.clamp(number[0]).point_force((2000, 0), at=number[1:, 0]).solve_static()


def portal(filename):
    """The portal of paraview.md, before it is solved and after."""
    from matplotlib.figure import Figure

    frame = Frame.from_lines(
        [(0, 0), (0, 3), (4, 3), (4, 0)], [(0, 1), (1, 2), (2, 3)], elements=4, hinges=[2],
        groups={"left": [0], "girder": [1], "right": [2]},
        material=StVenantKirchhoff(E=2.1e11, nu=0.3), height=0.12, width=0.1)
    frame.clamp(0).pin(3).point_force((2000, 0), at=1).line_load((0, -1500), "girder")
    frame.moment(1, -900).spring(5e4, [("girder", (2, 3)), ("ground", (2, 2))])
    frame.obstacle(Circle((3.1, 1.2), 0.4))
    figure = Figure(figsize=(11, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    frame.plot(left, names=True)
    frame.solve_static().plot("S_xx", ax=right, scale="auto", loads=True, supports=True, unit="Pa")
    figure.savefig(filename, dpi=110, bbox_inches="tight")


def start(filename):
    """Six demos at first sight."""
    import matplotlib.pyplot as plt
    import thumbnails

    plt.show = lambda: None
    figure, axes = plt.subplots(2, 3, figsize=(9.6, 4.2), layout="constrained")
    for ax, (demo, title) in zip(axes.flat, STARTS.items(), strict=True):
        others = set(plt.get_fignums())
        runpy.run_path(str(DEMOS / f"{demo}.py"))
        drawn = [plt.figure(k) for k in sorted(set(plt.get_fignums()) - others)]
        thumbnails.largest_of(drawn, filename.with_name("part.png"))
        ax.imshow(plt.imread(filename.with_name("part.png")))
        ax.set_title(title, fontsize=9)
        ax.set_axis_off()
    filename.with_name("part.png").unlink()
    figure.savefig(filename, dpi=120)
    plt.close("all")


def main(folder=DOCS):
    """Write cantilever.png (64 elements), cantilever_16.png (not recovered), frames, others."""
    folder = Path(folder)
    for elements, name, recover in ((64, "cantilever.png", True), (16, "cantilever_16.png", False)):
        with_root(cantilever(elements), folder / name, recover)
    on_a_cylinder().plot("eps_xx", thickness=1, filename=folder / "obstacles.png", dpi=110)
    pushed_frame().plot("eps_xx", thickness=6, filename=folder / "frames.png", dpi=110)
    portal(folder / "model.png")
    start(folder / "start.png")
    for demo, name, dpi in (("rollup", "rollup", 150), ("spring", "spring", 150),
                            ("live_view", "live", 90)):
        figure = runpy.run_path(str(DEMOS / f"{demo}.py"))["fig"]
        figure.savefig(folder / f"{name}.png", dpi=dpi, bbox_inches="tight")


if __name__ == "__main__":
    main()
