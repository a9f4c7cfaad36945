"""Random static scenes: the default against each explicit method, by answers and iterations.

    python benchmarks/strategies.py --scenes 500 --seed 1
    python benchmarks/strategies.py --scenes 20 --kinds rope chain

Ropes, cables, rods under springs, arches, frames, columns and chains of bars are drawn. Ends with
1 if an explicit method finds a stable equilibrium where the default and the path from the reference
configuration find none, or needs less than a tenth of the iterations, those of steps and strategies
that were given up counted on both sides.
"""

import argparse
import sys
import time
import warnings

import numpy as np

from skfem_ancf import (AncfError, Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        Frame, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.equations.stability import verdict
from skfem_ancf.solvers import continuation, solve_static

#: What the default is compared with.
EXPLICIT = {"mixed": {"method": "mixed"}, "newton": {"method": "newton"},
            "mixed, tenths": {"method": "mixed", "first_step": 0.1},
            "newton, tenths": {"method": "newton", "first_step": 0.1}}
GRAVITY = (0.0, -9.81)


def power(rng, low, high):
    """A number between 10**low and 10**high."""
    return 10 ** rng.uniform(low, high)


def one_of(rng, *items):
    return items[int(rng.integers(len(items)))]


def material(E, nu=0.3):
    return StVenantKirchhoff(E, nu, 7800.0)


def direction(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def rope(rng):
    """A slack rope between pins, one of them moved in by the slack."""
    span, slack = power(rng, 0, 2.5), power(rng, -4, -0.3)
    L = span * (1 + slack)
    h, angle = L / power(rng, 2, 5), one_of(rng, 0.0, 0.0, rng.uniform(-1.2, 1.2))
    element = one_of(rng, ElementBeamCable(3), ElementBeamCable(5), ElementBeamCable(7),
                     ElementBeamANCF(2))
    n, d = one_of(rng, 6, 10, 20, 40, 80), direction(angle)
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, n + 1), h, angle=angle), element,
                material(power(rng, 7, 11)), width=h)
    move = (span - L) * d + [0.0, rng.uniform(-0.1, 0.1) * span * slack]
    scene = Scene(beam).pin("left").fix("right", "r^1", displacement=move[0])
    scene.fix("right", "r^2", displacement=move[1])
    weight = 7800 * 9.81 * h**2 * power(rng, -1, 2.5)
    if rng.random() < 0.6:
        return scene.line_load((0, -weight))
    at = one_of(rng, 0.3, 0.5) * L * d
    return scene.gravity(GRAVITY).point_force((0, -0.5 * weight * L), at=tuple(at))


def cable(rng):
    """A tight one, between pins or with a prestrain."""
    L, n = power(rng, 0, 2), one_of(rng, 6, 10, 20, 40)
    h = L / power(rng, 2, 4)
    element = one_of(rng, ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCF(2),
                     ElementBeamANCFCubic(2))
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, n + 1), h), element,
                material(power(rng, 8, 11)), width=h)
    scene = Scene(beam).pin("left").fix("right", "r^2")
    scene.fix("right", "r^1", displacement=one_of(rng, 0.0, L * power(rng, -6, -3)))
    return scene.gravity((0, -9.81 * power(rng, 0, 3)))


def guyed_rod(rng):
    """Clamped, its end pulled by a spring: linear, stiffening or of constant force."""
    L, n = power(rng, -0.5, 1), one_of(rng, 4, 8, 16)
    h, angle = L / power(rng, 1.3, 3), one_of(rng, 0.0, np.pi / 2, rng.uniform(-1.5, 1.5))
    d, E = direction(angle), power(rng, 8, 11)
    element = one_of(rng, ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCF(2))
    scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, L, n + 1), h, angle=angle), element,
                       material(E), width=h)).clamp("left")
    aside = rng.uniform(0.3, 2) * one_of(rng, -1, 1) * np.array([-d[1], d[0]])
    critical = np.pi**2 / 4 * E * h**4 / 12 / L**2
    T = critical * power(rng, -1.5, 1.3)
    law = one_of(rng, (lambda s: T + 0 * s, lambda s: T * s), T / L * power(rng, 0, 3),
                 (lambda s: T * (s / L + 10 * (s / L)**3),
                  lambda s: T * L * ((s / L)**2 / 2 + 2.5 * (s / L)**4)))
    scene.spring(law, between=(tuple(L * d), ("ground", tuple(L * (rng.uniform(-0.2, 2) * d
                                                                   + aside)))))
    if rng.random() < 0.3:
        return scene.gravity(GRAVITY)
    force = critical * power(rng, -1.5, 1.3) * direction(rng.uniform(0, 2 * np.pi))
    return scene.point_force(tuple(force), at=tuple(L * d))


def arch(rng):
    """A circular one, deep or shallow, beside its limit load and beyond."""
    rise, n, h = rng.uniform(0.03, 0.5), one_of(rng, 8, 16, 24), power(rng, -3, -1.5)
    R = (0.25 + rise**2) / (2 * rise)
    half = np.arcsin(min(1.0, 0.5 / R))

    def axis(s):
        angle = (2 * s - 1) * half
        return np.array([0.5 + R * np.sin(angle), rise - R + R * np.cos(angle)])

    mesh = MeshBeam.init_curve(axis, np.linspace(0, 1, n + 1), h)
    E = power(rng, 8, 11)
    scene = Scene(Beam(mesh, one_of(rng, ElementBeamCable(5), ElementBeamANCF(2)),
                       material(E, 0.0), width=h))
    for end in ("left", "right"):
        one_of(rng, scene.clamp, scene.pin)(end)
    P = E * h**4 / 12 * power(rng, 0, 2.3)
    if rng.random() < 0.3:
        return scene.line_load((0, -P))
    return scene.point_force((one_of(rng, 0.0, 0.02, 0.3) * P, -P),
                             at=tuple(mesh.p[:, one_of(rng, n // 2, n // 4)]))


def frame(rng):
    """A portal of one or two storeys."""
    H, W = rng.uniform(2, 5), rng.uniform(2, 8)
    h, E, storeys = power(rng, -2, -0.5), power(rng, 8, 11), one_of(rng, 1, 1, 2)
    points = [(x, k * H) for k in range(storeys + 1) for x in (0, W)]
    lines = [line for k in range(0, 2 * storeys, 2)
             for line in ((k, k + 2), (k + 1, k + 3), (k + 2, k + 3))]
    scene = Frame.from_lines(points, lines, height=h, material=material(E), width=h,
                             elements=one_of(rng, 2, 4)).clamp([0, 1])
    P = E * h**4 / 12 / H**2 * power(rng, -1.5, 1.5)
    scene.point_force((P * rng.uniform(-1, 1), -P), at=points[2])
    return scene.point_force((0, -P), at=points[3]) if rng.random() < 0.5 else scene


def cantilever(rng):
    """Bent far by a force, a line load or a moment, at any angle."""
    L, n, angle = power(rng, -0.5, 1), one_of(rng, 4, 8, 16), rng.uniform(0, 2 * np.pi)
    h, E = L / power(rng, 1, 4), power(rng, 8, 11)
    element = one_of(rng, ElementBeamCable(5), ElementBeamANCF(2), ElementBeamANCF(3),
                     ElementBeamANCFCubic(2))
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, n + 1), h, angle=angle), element,
                material(E, one_of(rng, 0.0, 0.3)), width=h)
    scene = Scene(beam).clamp("left", thickness="free")
    P = E * h**4 / 12 / L**2 * power(rng, -0.5, 1.7)
    force = P * direction(rng.uniform(0, 2 * np.pi))
    kind = one_of(rng, "force", "line load", "moment")
    if kind == "moment":
        return scene.moment("right", 0.15 * P * L)
    if kind == "line load":
        return scene.line_load(tuple(force / L))
    return scene.point_force(tuple(force), at=tuple(L * direction(angle)))


def column(rng):
    """Below and beyond its critical load, with and without an imperfection."""
    n, h, E = one_of(rng, 8, 16), power(rng, -3, -1.5), power(rng, 8, 11)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), h, angle=np.pi / 2),
                one_of(rng, ElementBeamCable(5), ElementBeamANCF(2)), material(E, 0.0), width=h)
    scene, P = Scene(beam).clamp("left"), np.pi**2 / 4 * E * h**4 / 12 * rng.uniform(0.3, 4)
    if rng.random() < 0.5:
        scene, P = scene.fix("right", "r^1"), 8 * P
    return scene.point_force((one_of(rng, 0.0, 1e-4, 1e-2, 0.1) * P, -P), at=(0, 1))


def chain(rng):
    """Bars with hinges between them, hanging from one pin or two."""
    bars, h, E = one_of(rng, 2, 3, 5), power(rng, -3, -1.5), power(rng, 8, 11)
    angle = one_of(rng, 0.0, -np.pi / 2, rng.uniform(-3, 3))
    d = direction(angle)
    element = one_of(rng, ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCF(2))
    scene = Scene(*[Beam(MeshBeam.init_line([0, 0.5, 1], h, origin=tuple(k * d), angle=angle),
                         element, material(E), width=h, name=f"bar {k}") for k in range(bars)])
    for k in range(bars - 1):
        scene.joint("hinge", beams=(f"bar {k}", f"bar {k + 1}"), at=("right", "left"))
    scene.pin("left", beam="bar 0").gravity(GRAVITY)
    last, kind = f"bar {bars - 1}", one_of(rng, "free", "pinned", "slack", "pulled")
    if kind == "pinned":
        return scene.pin("right", beam=last)
    if kind == "slack":
        move = -d * bars * power(rng, -3, -0.5)
        scene.fix("right", "r^1", beam=last, displacement=move[0])
        return scene.fix("right", "r^2", beam=last, displacement=move[1])
    if kind == "pulled":
        weight = 7800 * h**2 * 9.81 * bars
        scene.point_force((weight * power(rng, -1, 1), 0), at=tuple(bars * d), beam=last)
    return scene


KINDS = {f.__name__: f for f in (rope, cable, guyed_rod, arch, frame, cantilever, column, chain)}


def draw(kind, number, seed=1):
    """A scene of a kind; the same numbers draw the same scene."""
    return KINDS[kind](np.random.default_rng([seed, number, list(KINDS).index(kind)]))


def solved(scene, **options):
    """Iterations, those that were given up included, and the strategy; None without an answer."""
    system = scene.system
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = solve_static(system, **options)
    except AncfError:
        return None
    if verdict(system, found.u, 1.0, found.multipliers, 1.0).stability == "unstable":
        return None
    return sum(a.iterations for a in found.attempts), found.attempts[-1].strategy


def on_the_path(scene):
    """True if the path from the reference configuration is stable at full load."""
    try:
        points, _ = continuation(scene.system, 400, max_load=1.0)
    except AncfError:
        return False
    return points[-1].load == 1.0 and points[-1].stable is not False


def lost(scene, explicit=EXPLICIT):
    """By what the default loses to explicit methods, one line each; and its own answer."""
    mine, out = solved(scene), []
    if mine is None and on_the_path(scene):
        return out, mine
    for name, options in explicit.items():
        other = solved(scene, **options)
        if other is None:
            continue
        if mine is None:
            out.append(f"{name} has an answer after {other[0]} iterations, the default has none")
        elif mine[0] > 10 * max(other[0], 1):
            out.append(f"{name} takes {other[0]} iterations, the default {mine[0]} ({mine[1]})")
    return out, mine


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--seconds", type=float, default=3600.0, help="stop after these")
    options = parser.parse_args()
    strategies, losses, begin, number = {}, 0, time.perf_counter(), 0
    for number in range(options.scenes):
        if time.perf_counter() - begin > options.seconds:
            break
        kind = options.kinds[number % len(options.kinds)]
        found, mine = lost(draw(kind, number, options.seed))
        name = "no answer" if mine is None else mine[1]
        strategies[name] = strategies.get(name, 0) + 1
        losses += bool(found)
        for text in found:
            print(f"{kind} {number}: {text}", flush=True)
    print(f"{sum(strategies.values())} scenes, the default loses in {losses}:",
          ", ".join(f"{n} by {name}" for name, n in strategies.items()))
    sys.exit(losses > 0)


if __name__ == "__main__":
    main()
