"""Makes the pictures of the guides: python docs/pictures.py."""

import shutil
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent / "demos"))

import numpy as np
from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.obstacles import Circle, Line

import cantilever
import rollup
import spring


def on_a_cylinder():
    """The first state of obstacles.md."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 33), height=0.01), ElementBeamCable(5),
                StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
    scene = Scene(beam).clamp("left").gravity((0, -9.81)).obstacle(Circle((0.5, -0.15), 0.1))
    return scene.obstacle(Line((0, -0.2), normal=(0, 1)), friction=0.3).solve_static()


def main(folder=DOCS):
    """Write cantilever.png (64 elements), cantilever_16.png (not recovered), obstacles, others."""
    for elements, name, recover in ((64, "cantilever.png", True), (16, "cantilever_16.png", False)):
        state = cantilever.cantilever(2e8, elements).gravity((0, -9.81)).solve_static()
        cantilever.picture(state, Path(folder) / name, recover)
    on_a_cylinder().plot("eps_xx", thickness=1, filename=Path(folder) / "obstacles.png", dpi=110)
    with tempfile.TemporaryDirectory() as out:
        for demo in (rollup, spring):
            demo.main(out, progress=False)
            shutil.copy(Path(out) / f"{demo.__name__}.png", folder)


if __name__ == "__main__":
    main()
