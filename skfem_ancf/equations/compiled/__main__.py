"""Compile every text and keep it on disk: ``python -m skfem_ancf.equations.compiled``."""

import os
import sys
from functools import partial

from ...core.switch import VARIABLE
from . import ADDRESSES, PROBLEMS, address, folder, nothing_collected, on_disk


def main() -> None:
    """Solve a small scene in statics and in time, compiled: its types are those of every scene."""
    os.environ[VARIABLE] = "1"
    import numpy as np

    from ... import Beam, ElementBeamCable, EnergyMomentum, MeshBeam, Scene, StVenantKirchhoff
    from ..backend import COMPILING, announced
    from ...core.switch import compiled_off

    reason = compiled_off()
    if reason is not None:
        raise SystemExit(f"nothing is compiled: {reason}")
    scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.01), ElementBeamCable(3),
                       StVenantKirchhoff(2e8, 0.3, 7800.0), width=0.01)).clamp("left")
    system = scene.system
    works = {**{part: partial(address, part) for part in ADDRESSES},
             "evaluate": lambda: system.internal_force(np.zeros(system.N)),
             "equilibrium": scene.solve_static,
             "steps": lambda: scene.integrate(0.02, 0.01, EnergyMomentum())}
    if on_disk(*COMPILING):
        print(f"all is compiled already, in {folder()}", file=sys.stderr)
    with nothing_collected(), announced(COMPILING) as update:
        for name, work in works.items():
            work()
            if PROBLEMS:
                raise SystemExit(PROBLEMS[0])
            update(name)


if __name__ == "__main__":
    main()
