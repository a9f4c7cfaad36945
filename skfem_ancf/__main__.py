"""The command ``python -m skfem_ancf compile``: compile everything beforehand, once."""

import os
import sys
from collections.abc import Callable

from .core.code_cache import VARIABLE, compiled_off, folder, nothing_collected, on_disk


def compile_all() -> None:
    """Solve a small scene in statics and in time; its types are those of every scene."""
    os.environ[VARIABLE] = "1"
    import numpy as np

    from . import Beam, ElementBeamCable, EnergyMomentum, MeshBeam, Scene, StVenantKirchhoff
    from .equations.backend import COMPILING, LOADED, PARTS, PROBLEMS, announced, load_part

    reason = compiled_off()
    if reason is not None:
        raise SystemExit(f"nothing is compiled: {reason}")
    scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.01), ElementBeamCable(3),
                       StVenantKirchhoff(2e8, 0.3, 7800.0), width=0.01)).clamp("left")
    system, zero = scene.system, np.zeros(scene.system.N)
    works: dict[str, Callable[[], object]] = {
             "equilibrium": lambda: scene.solve_static(),
             "tangent": lambda: system.assemble(zero),
             "force": lambda: system.internal_force(zero + 1e-9),
             "linearised": lambda: system.linearised_stress(
                 zero, system.backend.tables.stresses, zero),
             "steps": lambda: scene.integrate(0.02, 0.01, EnergyMomentum())}
    if on_disk(*COMPILING):
        print(f"all is compiled already, in {folder()}", file=sys.stderr)
    with nothing_collected(), announced(COMPILING) as update:
        for part in PARTS:
            load_part(part, update)
        for name, work in works.items():
            work()
            if PROBLEMS:
                raise SystemExit(PROBLEMS[0])
            update(name)
    assert set(COMPILING) <= set(LOADED)


if __name__ == "__main__":
    if sys.argv[1:] != ["compile"]:
        raise SystemExit("usage: python -m skfem_ancf compile\n"
                         "compiles everything and keeps it on disk; needs the extra 'fast'")
    compile_all()
