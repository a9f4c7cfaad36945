"""What errors are measured against: the converged solution of each code's own model.

    python benchmarks/work_precision/references.py

computes the table :data:`CONVERGED` of the motions anew (ten minutes).
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "validation"), str(ROOT / "benchmarks")]

from work_precision import exudyn_beams, ours
from work_precision.problems import GRAVITY, PROBLEMS

import exact

#: Tip displacements (m) of the two-dimensional body in plane stress, no shear factor, from
#: independent codes: 1e-6 and 1e-5.
BODY = {"5.2": (-0.741168, -0.903426), "thick": (-0.15792, -0.71438)}

#: Tip displacements (m) at the end of the motions, by model: a fine mesh, and the limit in the
#: time step from two runs, or the method of Gauss of order 8. Known to 3e-9 for the cables, but to
#: 1e-5 with shear and rotary inertia (5e-5 for the thrown rod): there the start sets off short
#: waves that converge slowly.
CONVERGED = {
    ("pendulum", "cable"): (-1.823770842, 0.177184988),
    ("pendulum", "section 2"): (-1.823973863, 0.177006997),
    ("pendulum", "rod"): (-1.824073766, 0.176958775),
    ("spin-up", "cable"): (-9.627593777, 9.991388744),
    ("spin-up", "section 2"): (-9.627558113, 9.991387194),
    ("spin-up", "rod"): (-9.627558110, 9.991387520),
    ("free-rod", "cable"): (0.408075277, 0.206548278),
    ("free-rod", "section 2"): (0.407865360, 0.206645610),
    ("free-rod", "rod"): (0.407846280, 0.206601980),
}


@cache
def reference(name, model):
    """Converged tip displacement, shape (2,), of a problem by a model.

    ``model`` is "cable" (extensible, shear-rigid), "rod" (Reissner's), "section N" (planar
    sections of order N), with its formulation where that changes the solution, or "body"
    (two-dimensional).
    """
    p = PROBLEMS[name]
    if name == "thick" or model == "body":
        return np.array(BODY[name])
    if p.t_end is not None:
        return np.array(CONVERGED[name, model])
    line = {"cable": "extensible", "rod": "reissner"}.get(model)
    if p.load == "moment":
        return closed_circle(p) if line else bent_body(p)
    if line and p.load == "gravity":
        return exact.gravity_cantilever(p.E, p.nu, p.rho, p.L, p.b, p.h, GRAVITY, model=line)
    if model == "cable":
        return exact.elastica_extensible_tip(p.value, p.EA, p.EI, p.L)
    if model == "rod":
        return tip(exudyn_beams.run(p, "GE2D quadratic", 64))
    _, order, *formulation = model.split()
    n = 256 if p.L < 5e3 * p.h else 128  # beyond, round-off in E A / E I
    return tip(ours.run(p, "cubic", int(order), n, *formulation))


def closed_circle(p):
    """Tip displacement of an elastic line that an end moment 2 pi EI / L has closed."""
    return np.array([-p.L, 0.0])


def bent_body(p):
    """Tip displacement of a St. Venant-Kirchhoff body in pure bending, nu = 0."""
    kappa, stretch = exact.rollup_curvature(p.value, p.E, p.b, p.h)
    turn = kappa * p.L
    return stretch / kappa * np.array([np.sin(turn), 1.0 - np.cos(turn)]) - [p.L, 0.0]


def tip(run):
    """Tip displacement of one run."""
    solver = run.build()
    return np.array(solver.read(solver.solve())[0])


def limit(make, steps):
    """Limit of second order in the step size, from two runs, and how much it differs."""
    coarse, fine = (tip(make(k * steps)) for k in (1, 2))
    return fine + (fine - coarse) / 3.0


def main():
    """Print the table, twice: with the meshes used, and with coarser ones and larger steps."""
    for name in ("pendulum", "spin-up", "free-rod"):
        p, slow = PROBLEMS[name], name == "spin-up"
        steps, recipes = 1000 if slow else 16000, {}
        if slow:
            recipes["cable"] = lambda k, q: ours.run(p, "cable", 7, 8 * k, steps=2 * q, tol=1e-8)
        else:  # of order 8: limits of second order change nothing
            recipes["cable"] = lambda k, q: ours.run(p, "cable", 7, 16 * k, steps=q // 4,
                                                     scheme="gauss", points=4, tol=1e-9)
        recipes["section 2"] = lambda k, q: ours.run(p, "cubic", 2, (8 if slow else 24) * k,
                                                     steps=q // 2, tol=1e-8)
        if exudyn_beams.exudyn is not None:
            recipes["rod"] = lambda k, q: exudyn_beams.run(
                p, "GE2D quadratic", (8 if slow else 32) * k, q, rtol=1e-4 if slow else 1e-5)
        for model, make in recipes.items():
            try:
                fine = limit(lambda q, make=make: make(2, q), steps)
                check = limit(lambda q, make=make: make(1, q), steps // 2)
            except Exception as error:
                print(f"    # {name} {model}: {error}", flush=True)
                continue
            print(f"    ({name!r}, {model!r}): ({fine[0]:.9f}, {fine[1]:.9f}),"
                  f"  # {np.linalg.norm(fine - check):.0e}", flush=True)


if __name__ == "__main__":
    main()
