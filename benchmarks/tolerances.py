"""Motions with steps of automatic size: the error over the tolerance asked for.

    python benchmarks/tolerances.py [--others] [--scheme radau gauss]
                                    [--motion pendulum rod] [--rtol 1e-4]

``--others`` takes the motions of ``other_motions.py``, by which nothing was chosen. The error is by
how far a node or a rigid body is off, the farthest of the scene at 200 instants of the motion, over
the scene's size; in brackets that at the end, then the steps. Motions are measured against many
steps of collocation on the same mesh, kept in out/. Three minutes.
"""

import argparse
import os
import sys
import time
import warnings
from pathlib import Path

for _name in ("OPENBLAS", "OMP", "MKL", "NUMBA"):  # before NumPy is imported
    os.environ[f"{_name}_NUM_THREADS"] = "1"

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import other_motions
import slider_crank
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, KelvinVoigt, MeshBeam, RigidBody,
                        Scene, StVenantKirchhoff)
from skfem_ancf.dynamics import SCHEMES, Gauss
from skfem_ancf.core.errors import AncfError, InputError
from work_precision import ours
from work_precision.problems import PROBLEMS

INSTANTS = 200
GRAVITY = (0.0, -9.81)


def problem(name, degree, n):
    return ours.scene(PROBLEMS[name], ElementBeamCable(degree), n)


def section(n, E, h, order=2, length=1.0, density=1000.0, width=0.1, **options):
    mesh = MeshBeam.init_line(np.linspace(0.0, length, n + 1), h)
    return Beam(mesh, ElementBeamANCF(order), StVenantKirchhoff(E, 0.3, density), width, **options)


def cable(n, E=2e8, h=0.01, start=0.0, length=1.0, **options):
    mesh = MeshBeam.init_line(np.linspace(start, start + length, n + 1), h)
    return Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(E, 0.3, 7800.0), 0.01, **options)


def hinged():
    """Two rods on a hinge fall from the horizontal."""
    a, b = cable(4, name="a"), cable(4, start=1.0, name="b")
    scene = Scene(a, b).pin("left", a).gravity(GRAVITY)
    scene.hinge((a, (1, 0)), (b, (1, 0)))
    return scene


def tip_mass():
    """A cantilever with a body on its end."""
    beam = cable(4, name="beam")
    body = RigidBody(0.5, 1e-3, (1.0, 0.0), name="body")
    scene = Scene(beam, body).clamp("left", beam).gravity(GRAVITY)
    scene.weld((beam, "right"), (body, (1, 0)))
    return scene


def spring_damper():
    """A pendulum that a spring with a damper holds."""
    beam = cable(4)
    scene = Scene(beam).pin("left").gravity(GRAVITY)
    return scene.spring(200.0, ((beam, (1, 0)), ("ground", (1.0, 1.0))), damping=1.0)


def rubber_bar():
    """Thrown: it turns, bends and is shaken along."""
    return Scene(section(4, 1e5, 0.1)).initial_velocity(
        lambda x: np.array([-8.0 * x[1] + 0.5 * np.sin(np.pi * x[0]), 8.0 * (x[0] - 0.5)]))


def pulled():
    """A cantilever, shaken at its root."""
    scene = Scene(cable(4))
    scene.joint("position", at=(0, 0), r=lambda t: (0.0, 0.1 * np.sin(6.0 * t) ** 3))
    scene.joint("angle", at="left", angle=lambda t: 0.0 * t)
    return scene


#: By name: what builds it, the end, steps of the reference, whether it has joints.
MOTIONS = {
    "pendulum": (lambda: problem("pendulum", 5, 4), 1.0, 6000, False),
    "spin-up": (lambda: problem("spin-up", 5, 4), 5.0, 1500, True),
    "rod": (lambda: problem("free-rod", 5, 4), 0.5, 8000, False),
    "long pendulum": (lambda: problem("pendulum", 3, 4), 3.0, 6000, False),
    "hinged": (hinged, 0.8, 3000, True),
    "slider-crank": (lambda: slider_crank.scene(4)[0], slider_crank.END, 4000, True),
    "tip mass": (tip_mass, 1.0, 4000, True),
    "damped": (lambda: Scene(cable(4, damping=KelvinVoigt(2e-3))).clamp("left").gravity(GRAVITY),
               1.5, 2000, False),
    "drag": (lambda: Scene(cable(4)).pin("left").gravity(GRAVITY).damping(mass=1.0), 1.5, 3000,
             False),
    "spring": (spring_damper, 1.0, 3000, False),
    "section": (lambda: Scene(section(2, 1e5, 0.1)).pin("left").gravity(GRAVITY), 1.0, 800, False),
    "shaken": (lambda: Scene(section(2, 1e7, 0.2, order=1)).clamp("left").gravity(
        (0, -400.0), amplitude=lambda t: np.sin(40 * t) ** 2), 0.25, 800, False),
    "rubber": (rubber_bar, 0.5, 800, False),
    "root": (pulled, 1.0, 3000, True),
    "cantilever": (lambda: Scene(cable(4)).clamp("left").gravity(GRAVITY), 1.0, 3000, False),
}
RTOLS = {"radau": (1e-3, 1e-4, 1e-5, 1e-6, 1e-7), "gauss": (1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
         "energy-momentum-4": (1e-3, 1e-4, 1e-5, 1e-6)}
COARSE = 1e-3, 1e-4, 1e-5
#: Of the motions here and of the others: where their references are, what they are, and the least
#: tolerance that these are known for.
SETS = {False: ("tolerances.npz", MOTIONS, 0.0),
        True: ("other_motions.npz", other_motions.MOTIONS, 1e-6)}


def places(scene, u):
    """Places of nodes and bodies, from coordinates (n, N): (n, k, 2)."""
    s, found = scene.system, []
    for body, part in zip(s.members, s.slices):
        own = u[:, part]
        n = 4 if isinstance(body, RigidBody) else body.nd
        found.append(own.reshape(len(u), -1, n)[:, :, :2])
    return np.concatenate(found, axis=1)


def fine(motion, steps):
    build, t_end, _, joined = motion
    times = np.linspace(0.0, t_end, INSTANTS + 1)[1:]
    scene = build()
    scheme = "radau" if joined or scene.system.damped else Gauss(4)
    n = -(-steps // INSTANTS) * INSTANTS
    history = scene.integrate(t_end, t_end / n, scheme=scheme, progress=False)
    every = n // INSTANTS
    return times, places(scene, history.u[every::every])


def references(names, others=False):
    """Places of motions, from a file in out/ or by many steps: name, (times, places)."""
    file, motions = ROOT / "out" / SETS[others][0], SETS[others][1]
    kept = dict(np.load(file)) if file.exists() else {}
    for name in names:
        if name in kept and len(kept[f"{name} times"]) == INSTANTS:
            continue
        begin = time.perf_counter()
        (_, half), (times, full) = (fine(motions[name], motions[name][2] // k) for k in (2, 1))
        kept[name], kept[f"{name} times"] = full, times
        size = motions[name][0]().system.size
        print(f"{name}: known to {np.hypot(*np.moveaxis(full - half, 2, 0)).max() / size:.1e}, "
              f"{time.perf_counter() - begin:.1f} s", flush=True)
        file.parent.mkdir(exist_ok=True)
        np.savez(file, **kept)
    return {name: (kept[f"{name} times"], kept[name]) for name in names}


def measure(motion, scheme, rtol, known):
    """Largest error of the instants and error at the end, over rtol, and the history."""
    scene, (times, exact) = motion[0](), known
    history = scene.integrate(times[-1], "auto", scheme=scheme, rtol=rtol, t_eval=times,
                              progress=False)
    off = np.hypot(*np.moveaxis(places(scene, history.u) - exact, 2, 0)) / scene.system.size
    return off.max() / rtol, off[-1].max() / rtol, history


def table(scheme, names, rtols, motions, known):
    """Print the rows of a scheme, and how many errors are as they should be: its errors."""
    print(f"\n{scheme}".ljust(18) + "".join(f"{rtol:>21g}" for rtol in rtols))
    errors = []
    for name in names:
        row = ""
        for rtol in rtols:
            try:
                most, end, history = measure(motions[name], scheme, rtol, known[name])
                text = f"{most:.2g} ({end:.2g}) {history.steps}"
                errors.append((most, end))
            except InputError:  # a scene that the scheme is not for
                break
            except AncfError as error:
                text = type(error).__name__
                errors.append((np.inf, np.inf))
            row += text.rjust(21)
        if row:
            print(name.ljust(17) + row, flush=True)
    summary(errors)
    return errors


def summary(errors):
    for text, e in zip(("at any time", "at the end"), np.array(errors).T):
        print(f"{text}: {np.sum((e >= 0.2) & (e <= 1.0))} of {len(e)} within 0.2 to 1, "
              f"{np.sum(e < 0.2)} below, {np.sum(e > 1.0)} above, {np.sum(e > 1.2)} above 1.2, "
              f"largest {e.max():.2g}, median {np.median(e):.2g}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scheme", nargs="*", default=["radau", "gauss", "energy-momentum-4",
                                                        "generalized-alpha", "energy-momentum"],
                        choices=list(SCHEMES))
    parser.add_argument("--motion", nargs="*")
    parser.add_argument("--rtol", nargs="*", type=float)
    parser.add_argument("--others", action="store_true")
    args = parser.parse_args()
    warnings.simplefilter("ignore")  # of bodies that coarse steps turn inside out
    _, motions, least = SETS[args.others]
    names = args.motion or list(motions)
    known = references(names, args.others)
    errors = []
    for scheme in args.scheme:
        rtols = args.rtol or [x for x in RTOLS.get(scheme, COARSE) if x >= least]
        errors += table(scheme, names, rtols, motions, known)
    print("\nall")
    summary(errors)


if __name__ == "__main__":
    main()
