"""Microseconds a material point costs: a new one alone, and one of 10,000, with their difference.

    python benchmarks/points.py [--only strain "raw stress"] [--body taper layers] [--quick]

The last column is the largest difference between single points and many, over the largest value.
"""

import argparse
import os
import sys
import time

for _name in ("OPENBLAS", "OMP", "MKL", "NUMBA"):  # before NumPy is imported
    os.environ[f"{_name}_NUM_THREADS"] = "1"

import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        NeoHookean, Scene, Section, StVenantKirchhoff)

ELEMENTS = {"N=1": lambda: ElementBeamANCF(1), "N=2": lambda: ElementBeamANCF(2),
            "N=3": lambda: ElementBeamANCF(3), "cubic N=2": lambda: ElementBeamANCFCubic(2),
            "cable": lambda: ElementBeamCable(3), "quintic cable": lambda: ElementBeamCable(5)}
NODES = np.linspace(0.0, 1.0, 17)
MESHES = {"straight": lambda height: MeshBeam.init_line(NODES, height=height),
          "arc": lambda height: MeshBeam.init_curve(
              lambda s: np.array([np.cos(s), np.sin(s)]), NODES, height=height)}
RUBBER = {"E": 2e6, "nu": 0.3, "density": 1000.0}
#: What the beam is made of, and what a cable may be made of.
BODIES = {
    "plain": lambda: dict(material=StVenantKirchhoff(**RUBBER), width=0.05),
    "taper": lambda: dict(material=StVenantKirchhoff(**RUBBER), width=0.05),
    "profile": lambda: dict(material=StVenantKirchhoff(**RUBBER), section=Section.profile(
        "I", width=0.05, web=0.01, flange=0.008)),
    "tapered profile": lambda: BODIES["profile"](),
    "layers": lambda: dict(section=Section.layers(
        (0.02, StVenantKirchhoff(**RUBBER)),
        (0.03, StVenantKirchhoff(E=1e6, nu=0.2, density=500.0)), width=0.05)),
    "graded": lambda: dict(material=StVenantKirchhoff(
        E=lambda x, y: 2e6 * (1.0 + 0.3 * x + y), nu=0.3, density=1000.0), width=0.05),
    "neo-Hookean": lambda: dict(material=NeoHookean(**RUBBER), width=0.05),
    "plane strain": lambda: dict(material=StVenantKirchhoff(plane="strain", **RUBBER),
                                 width=0.05),
    "continuum": lambda: dict(material=StVenantKirchhoff(**RUBBER), width=0.05,
                              formulation="continuum"),
    "ecm": lambda: dict(material=StVenantKirchhoff(**RUBBER), width=0.05, formulation="ecm")}
FOR_CABLES = "plain", "taper", "profile", "tapered profile", "layers", "graded"
NONE = "N=1", "tapered profile"  # its mean strain is no rule's
#: What is asked, and what it costs at most: one new point, and one of many, in microseconds.
QUANTITIES = {"displacement": {}, "position": {}, "velocity": {}, "strain": {}, "stress": {},
              "raw strain": {"recover": False}, "raw stress": {"recover": False}}
GOALS = 1000.0, 2.0
MANY, BATCH, BATCHES, QUICK = 10000, 100, 5, 3


def states(element, mesh, body):
    """An equilibrium under a tip load, and an instant of a motion."""
    beam = Beam(mesh, element, **BODIES[body]())
    scene = Scene(beam).clamp("left").point_force((0.3, -0.5), at=mesh.p[:, -1])
    return scene.solve_static(), scene.integrate(2e-3, 1e-3).state(2)


def points(mesh, n, rng):
    """Random points of the body, (2, n)."""
    e, X = rng.integers(0, mesh.nelements, n), rng.random((2, n))
    return mesh.mapping().F(X[:, :, None], e)[..., 0]


def measure(ask, mesh, quick, rng):
    """Microseconds of a new point, of one of many, and their largest relative difference."""
    middles = mesh.mapping().F(np.array([[0.5], [0.4]]))[..., 0]
    for p in middles.T.tolist():  # each element was asked for
        ask(tuple(p))
    alone, many, gap = [], [], 0.0
    for _ in range(2 if quick else BATCHES):
        x = points(mesh, QUICK if quick else BATCH, rng)
        pairs = [tuple(p) for p in x.T.tolist()]
        start = time.perf_counter()
        found = [ask(p) for p in pairs]
        alone.append((time.perf_counter() - start) / len(pairs))
        values = ask(x)
        gap = max(gap, np.max(np.abs(np.array(found).T - values)) / np.max(np.abs(values)))
        y = points(mesh, 10 * QUICK if quick else MANY, rng)
        start = time.perf_counter()
        ask(y)
        many.append((time.perf_counter() - start) / y.shape[1])
    return 1e6 * min(alone), 1e6 * min(many), gap


def run(only, quick=False, bodies=("plain",)):
    """Rows (quantity, body, element, mesh, one, many, gap)."""
    rows, rng = [], np.random.default_rng(0)  # never the same point twice
    for shape, mesh in MESHES.items():
        for body, name in ((body, name) for body in bodies for name in ELEMENTS):
            if ("cable" in name and body not in FOR_CABLES) or (name, body) == NONE:
                continue
            height = (lambda s: 0.05 - 0.02 * s) if "taper" in body else 0.05
            at_rest, moving = states(ELEMENTS[name](), mesh(height), body)
            for quantity, options in QUANTITIES.items():
                if quantity not in only:
                    continue
                state = moving if quantity == "velocity" else at_rest
                method = getattr(state, quantity.split()[-1])
                rows.append((quantity, body, name, shape, *measure(
                    lambda p: method(p, **options), state.beams[0].mesh, quick, rng)))
    return rows


def table(rows):
    """Lines of a table; what misses its goal is marked."""
    lines = [f"{'':14}{'':16}{'':15}{'':10}{'one':>8}{'many':>9}{'difference':>13}"]
    for quantity, body, name, shape, one, many, gap in sorted(rows, key=lambda row: row[:2]):
        marks = "".join("*" if value > goal else " " for value, goal in zip((one, many), GOALS))
        lines.append(f"{quantity:14}{body:16}{name:15}{shape:10}{one:8.1f}{many:9.3f}{gap:13.1e} "
                     f"{marks}")
    return lines


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(QUANTITIES), default=list(QUANTITIES))
    parser.add_argument("--body", nargs="+", choices=list(BODIES), default=["plain"])
    parser.add_argument("--quick", action="store_true", help="few points: does it run?")
    options = parser.parse_args(arguments)
    sys.stdout.write("\n".join(table(run(options.only, options.quick, options.body))) + "\n")


if __name__ == "__main__":
    main()
