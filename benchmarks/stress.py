"""Numerical stability: slenderness, order, units, distances, loads, long motions; what breaks.

``python benchmarks/stress.py [--out out/stress] [--quick]`` runs every check, writes
``stress.csv``, ``report.md`` and pictures, and fails if a bound is exceeded. Rows without a bound
document where something stops working.
"""

import argparse
import csv
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "validation"))
import exact

from skfem_ancf import (Beam, ConvergenceError, ElasticPlastic, ElementBeamANCF,
                        ElementBeamANCFCubic, ElementBeamCable, MeshBeam, ModelWarning, NeoHookean,
                        Prony, Scene, StVenantKirchhoff, Voce)
from skfem_ancf.actions.forces import ForceElement, point
from skfem_ancf.actions.obstacles import Line
from skfem_ancf.formulations import Formulation, Term
from skfem_ancf.core.progress import progress_bar
from skfem_ancf.core.quadrature import gauss
from skfem_ancf.dynamics.history import angular_momentum, momentum

NU, WIDTH, G = 0.3, 0.01, 9.81


@dataclass
class Row:
    """One line of the table: what was measured, and the bound on it, None if it documents."""

    check: str
    case: str
    quantity: str
    value: float
    bound: float | None = None
    note: str = ""

    @property
    def passed(self):
        """True if the value is finite and within its bound, or has none."""
        return self.bound is None or bool(abs(self.value) <= self.bound)


class TwoGaussPoints(Formulation):
    """As "continuum", with two Gauss points along the axis."""

    name = "two Gauss points"

    def terms(self, element, material):
        _, section = self.full_rules(element)
        return [Term(material.law(material.shear_factor(element)), gauss(2), section)]


def line(n, h, length=1.0, **options):
    """A uniform straight mesh."""
    return MeshBeam.init_line(np.linspace(0.0, length, n + 1), h, **options)


def soft(h, law=StVenantKirchhoff, nu=NU, **options):
    """The material of the soft cantilever with E and density such that EI and mass stay."""
    return law(2e8 * (0.01 / h) ** 3, nu, 7800 * 0.01 / h, **options)


def cantilever(element, mesh, material, formulation="assumed", clamp="free"):
    """The scene of a cantilever under gravity."""
    beam = Beam(mesh, element, material, WIDTH, formulation=formulation)
    return Scene(beam).clamp("left", thickness=clamp).gravity((0, -G))


def tip(scene, **options):
    """Vertical tip displacement, iterations, load steps; NaN, 0 and the load reached if it fails.

    What is beyond the range of law and mesh is what is shown here: no warnings of it.
    """
    mesh = scene.beams[0].mesh
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)
            state = scene.solve_static(**options)
    except ConvergenceError as error:
        return np.nan, 0, error.state.load
    return state.displacement(mesh.p[:, -1])[1], state.iterations, len(state.steps)


def thin_limit(plane="stress", nu=NU):
    """Tip of the inextensible line."""
    return exact.gravity_cantilever(2e8, nu, 7800, 1.0, WIDTH, 0.01, model="elastica",
                                    plane=plane)[1]


def scaled_eigenvalues(beam):
    """Of the tangent at rest, scaled to unit diagonal."""
    K, nd = np.zeros((beam.N, beam.N)), beam.nd
    for e, k in enumerate(beam.kernel.tangents(np.zeros(beam.N))):
        K[e * nd:(e + 2) * nd, e * nd:(e + 2) * nd] += k
    scale = 1.0 / np.sqrt(np.diag(K))
    return eigh(K * np.outer(scale, scale), eigvals_only=True)


ELEMENTS = {"N=1": ElementBeamANCF(1), "N=2": ElementBeamANCF(2), "N=6": ElementBeamANCF(6),
            "cubic N=2": ElementBeamANCFCubic(2), "cable 3": ElementBeamCable(3),
            "cable 5": ElementBeamCable(5)}
#: |error| of 16 elements of the gravity cantilever in the thin limit
LIMIT_ERROR = {"N=1": 2.6e-3, "N=2": 2.5e-3, "N=6": 2.4e-3, "cubic N=2": 4e-4, "cable 3": 4e-4,
               "cable 5": 1.6e-4}


# the checks: generators of rows, each takes quick, out


def slenderness(quick, out):
    """L/h from 1 to 1e6."""
    check = "slenderness"
    # small load, against full quadrature on a fine mesh
    for s in (1.0, 10.0) if quick else (1.0, 2.0, 5.0, 10.0, 30.0):
        h, tips = 1.0 / s, {}
        for name, element, n, formulation in (
                ("reference", ElementBeamANCFCubic(4), 24, "continuum"),
                ("N=2", ElementBeamANCF(2), 16, "assumed"),
                ("N=6", ElementBeamANCF(6), 16, "assumed"),
                ("cubic N=4", ElementBeamANCFCubic(4), 8, "assumed")):
            beam = Beam(line(n, h), element, soft(h), WIDTH, formulation=formulation)
            scene = Scene(beam).clamp("left").traction("right", (0, -1e-6 * beam.material.E * h**2))
            tips[name] = tip(scene)[0]
        for name in list(tips)[1:]:
            yield Row(check, f"L/h = {s:g}, small load, {name}", "relative error of the tip",
                      tips[name] / tips["reference"] - 1.0,
                      {"N=2": 4e-2, "N=6": 2e-2, "cubic N=4": 5e-3}[name])
    names = ("N=2", "cable 3") if quick else ELEMENTS
    for name in names:
        for s in (1e2, 1e6) if quick else (1e2, 1e3, 1e4, 1e5, 1e6):
            u, iterations, steps = tip(cantilever(ELEMENTS[name], line(16, 1 / s), soft(1 / s)))
            yield Row(check, f"L/h = {s:g}, gravity, {name}", "error of the tip", u - thin_limit(),
                      LIMIT_ERROR[name], f"{iterations} iterations, {steps} load step(s)")
            # at 1e6 the round-off of the tangent decides: 9 mostly, up to 19 beside it
            yield Row(check, f"L/h = {s:g}, gravity, {name}", "iterations", iterations,
                      40 if s > 1e5 else 12)
            w = scaled_eigenvalues(Beam(line(4, 1 / s), ELEMENTS[name], soft(1 / s), WIDTH,
                                        formulation="assumed"))
            yield Row(check, f"L/h = {s:g}, free, {name}", "largest of three zero eigenvalues",
                      np.max(np.abs(w[:3])), 1e-14)
            yield Row(check, f"L/h = {s:g}, free, {name}", "(h/L)^2 over the next eigenvalue",
                      1 / (w[3] * s**2), 1e2)


def fine_and_slender(quick, out):
    """Where fine meshes of slender beams lose the axial force in round-off."""
    check = "fine and slender"
    for name in ("N=2", "cable 5"):
        for s in (1e3,) if quick else (1e2, 1e3, 1e4, 1e5, 1e6):
            for n in (64,) if quick else (16, 64, 256, 1024):
                u, iterations, steps = tip(cantilever(ELEMENTS[name], line(n, 1 / s), soft(1 / s)))
                fails = not np.isfinite(u)
                note = (f"reached load {steps:.3g}" if fails else
                        f"{iterations} iterations, {steps} load step(s)")
                held = n * s <= (1.1e8 if name == "N=2" else 1.1e7)
                yield Row(check, f"{name}, {n} elements, L/h = {s:g}", "error of the tip",
                          u - thin_limit(), LIMIT_ERROR[name] if held else None, note)


def poisson(quick, out):
    """nu up to 0.4999 in plane strain."""
    check = "nearly incompressible"
    elements = {**ELEMENTS, "N=3": ElementBeamANCF(3), "cubic N=3": ElementBeamANCFCubic(3)}
    highest = {"cubic N=2": 0.499}  # Y^2 of eps_xx has no partner in eps_yy
    for name in ("N=1", "N=3", "cubic N=3") if quick else (
            "N=1", "N=2", "N=3", "N=6", "cubic N=2", "cubic N=3", "cable 5"):
        for nu in (0.4999,) if quick else (0.0, 0.3, 0.45, 0.49, 0.499, 0.4999):
            scene = cantilever(elements[name], line(16, 1e-3), soft(1e-3, nu=nu, plane="strain"))
            u, iterations, _steps = tip(scene)
            bound = LIMIT_ERROR.get(name, LIMIT_ERROR["cubic N=2" if "cubic" in name else "N=2"])
            yield Row(check, f"nu = {nu:g}, plane strain, L/h = 1e3, {name}", "error of the tip",
                      u - thin_limit("strain", nu), bound if nu <= highest.get(name, 0.5) else None,
                      f"{iterations} iterations")
    # thick: the section must be rich enough to bend at constant volume
    for order in (1, 2, 3, 4):
        for nu in (0.4999,) if quick else (0.3, 0.49, 0.4999):
            ratio = []
            for element, n in ((ElementBeamANCFCubic(order), 8), (ElementBeamANCFCubic(6), 16)):
                beam = Beam(line(n, 0.2), element, StVenantKirchhoff(1e6, nu, plane="strain",
                            shear_correction=1.0), WIDTH, formulation="assumed")
                scene = Scene(beam).clamp("left", thickness="free")
                ratio.append(tip(scene.traction("right", (0, -0.1)))[0])
            yield Row(check, f"nu = {nu:g}, plane strain, L/h = 5, cubic N={order}",
                      "relative error of the tip", ratio[0] / ratio[1] - 1, 3e-2)


def orders(quick, out):
    """Orders to 20: condition numbers and the same tip for three families of section points."""
    check = "order"
    families = ("chebyshev", "gauss-lobatto", "equispaced")
    table = {}
    reference = None
    for order in (3, 8) if quick else (3, 4, 6, 8, 10, 12, 14, 16, 18, 20):
        for family in families:
            element = ElementBeamANCF(order, points=family)
            # one element as long as high, its position field fixed at the left
            beam = Beam(line(1, 1.0), element, StVenantKirchhoff(1.0, NU, 1.0), 1.0,
                        formulation="assumed")
            k = beam.kernel.tangents(np.zeros(beam.N))[0]
            free = np.setdiff1d(np.arange(beam.N), beam.dofs("left", element.welded))
            K = k[np.ix_(free, free)]
            scale = 1 / np.sqrt(np.diag(K))
            M = beam.mass_elements()[0]
            condition = (np.linalg.cond(K), np.linalg.cond(K * np.outer(scale, scale)),
                         np.linalg.cond(M))
            table[family, order] = condition
            bound = {"chebyshev": 1e10, "gauss-lobatto": 1e10, "equispaced": None}[family]
            for what, value in zip(("stiffness", "stiffness of unit diagonal", "mass"), condition):
                yield Row(check, f"N = {order}, {family}", f"condition of the {what}", value,
                          bound if what != "stiffness of unit diagonal" else bound and 1e8)
            u, iterations, _ = tip(cantilever(element, line(8, 0.01), soft(0.01)))
            reference = u if reference is None else reference
            yield Row(check, f"N = {order}, {family}", "tip, less that of N = 3", u - reference,
                      2e-5 if family != "equispaced" or order <= 14 else None,
                      f"{iterations} iterations")
    if not quick:
        _picture_orders(table, families, out)


def _picture_orders(table, families, out):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.2), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for k, (ax, what) in enumerate(((axes[0], "stiffness"), (axes[1], "mass"))):
        for family in families:
            points = sorted((o, c[2 * k]) for (f, o), c in table.items() if f == family)
            ax.semilogy(*np.array(points).T, marker=".", label=family)
        ax.set(title=f"condition of the element's {what}", xlabel="order N")
    axes[0].legend(frameon=False)
    figure.savefig(out / "orders.png", dpi=150)


def frequencies_of(scene):
    """Three frequencies, on a coarse mesh."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the mesh is coarse", ModelWarning)
        return scene.modes(3).frequencies


def units(quick, out):
    """The same digits from micrometres and GPa to kilometres and Pa."""
    check = "units"
    systems = {"m, Pa": (1.0, 1.0), "um, GPa": (1e-6, 1e9), "mm, MPa": (1e-3, 1e6),
               "km, Pa": (1e3, 1.0), "km, GPa": (1e3, 1e9), "um, Pa": (1e-6, 1.0)}
    names = ("N=2",) if quick else ("N=2", "N=6", "cubic N=2", "cable 3", "cable 5")
    for name in names:
        found = {}
        for system, (a, s) in systems.items():  # a metres, s pascals; seconds stay
            beam = Beam(line(8, 0.01 / a, 1 / a), ELEMENTS[name],
                        StVenantKirchhoff(2e8 / s, NU, 7800 * a**2 / s), WIDTH / a,
                        formulation="assumed")
            scene = Scene(beam).clamp("left", thickness="free").gravity((0, -G / a))
            state = scene.solve_static()
            history = Scene(beam).pin("left").gravity((0, -G / a)).integrate(t_end=0.05, dt=2.5e-3)
            found[system] = (state.displacement((1 / a, 0)) * a, state.iterations,
                             state.strain((0.3 / a, 0.004 / a)),
                             frequencies_of(Scene(beam).clamp("left")),
                             history.displacement((1 / a, 0))[-1] * a)
        base = found["m, Pa"]
        for system in list(systems)[1:]:
            now = found[system]
            for what, k in (("tip", 0), ("strain", 2), ("frequencies", 3), ("pendulum", 4)):
                # the eigenvalues of a slender beam lose (L/h)^2 in round-off
                yield Row(check, f"{system}, {name}", f"change of the {what}",
                          np.max(np.abs(now[k] - base[k])) / np.max(np.abs(base[k])),
                          1e-6 if what == "frequencies" else 1e-9,
                          f"{now[1]} iterations, in m and Pa {base[1]}")


def far_away(quick, out):
    """Beams far from the origin of the coordinates."""
    check = "far away"
    for name in ("N=2",) if quick else ("N=2", "cubic N=2", "cable 5"):
        for curved in (False, True):
            base = None
            for d in (0.0, 1e6) if quick else (0.0, 1e3, 1e6, 1e9, 1e12):
                o = np.array([d, -d / 3])
                if curved:
                    mesh = MeshBeam.init_curve(
                        lambda s, o=o: o[:, None] + np.array([np.sin(s), np.cos(s) - 1.0]),
                        np.linspace(0, 1, 9), 0.01, dr=lambda s: np.array([np.cos(s), -np.sin(s)]))
                else:
                    mesh = line(8, 0.01, origin=o)
                beam = Beam(mesh, ELEMENTS[name], soft(0.01), WIDTH, formulation="assumed")
                end = mesh.p[:, -1]
                scene = Scene(beam).clamp("left", thickness="free").gravity((0, -G))
                # the tip's own coordinates: no point far away is looked up
                state = scene.solve_static()
                u = state.u[-beam.nd:][:2]
                history = Scene(beam).pin("left").gravity((0, -G)).integrate(t_end=0.02, dt=1e-3)
                energy = np.ptp(history.total_energy) / np.max(history.kinetic_energy)
                base = u if base is None else base
                case = f"{d:g} L away, {'curved' if curved else 'straight'}, {name}"
                bound = (1e-9 if d <= 1e6 else None)
                yield Row(check, case, "change of the tip", np.max(np.abs(u - base)), bound,
                          f"tip at ({end[0]:.9g}, {end[1]:.9g})")
                yield Row(check, case, "energy drift over 20 steps", energy, 1e-10)


def length_ratios(quick, out):
    """Neighbouring elements of very different length."""
    check = "length ratios"
    for name in ("N=2",) if quick else ("N=2", "N=6", "cubic N=2", "cable 3", "cable 5"):
        for ratio in (1e4,) if quick else (1.0, 10.0, 1e2, 1e3, 1e4):
            d = np.tile([1.0, 1 / ratio], 16)
            x = np.append(0.0, np.cumsum(d)) / np.sum(d)
            x[-1] = 1.0
            scene = cantilever(ELEMENTS[name], MeshBeam.init_line(x, 1e-3), soft(1e-3))
            u, iterations, steps = tip(scene)
            yield Row(check, f"long and short in turn, 1 : {ratio:g}, L/h = 1e3, {name}",
                      "error of the tip", u - thin_limit(),
                      LIMIT_ERROR[name] if ratio <= 1e3 or "cubic" in name else None,
                      f"{iterations} iterations, {steps} load step(s)" if np.isfinite(u) else
                      f"reached load {steps:.3g}")
            graded = np.append(0.0, np.geomspace(1 / ratio, 1.0, 32) if ratio > 1 else
                               np.linspace(1 / 32, 1, 32))
            u, iterations, steps = tip(cantilever(
                ELEMENTS[name], MeshBeam.init_line(graded, 1e-3), soft(1e-3)))
            yield Row(check, f"graded to the root, 1 : {ratio:g}, L/h = 1e3, {name}",
                      "error of the tip", u - thin_limit(), 1e-2,
                      f"{iterations} iterations, {steps} load step(s)")


def loads(quick, out):
    """A tip force from 1e-12 to 1e3 EI/L^2."""
    check = "loads"
    s = 1e4
    EI = 2e8 * WIDTH * 0.01**3 / 12
    for name, n, bound in (("N=2", 32, 2.5e-3), ("cubic N=2", 32, 1e-3), ("cable 3", 32, 1e-3),
                           ("cable 5", 32, 1e-5)):
        for alpha in (1e-12, 1e3) if quick else 10.0 ** np.arange(-12, 4):
            beam = Beam(line(n, 1 / s), ELEMENTS[name], soft(1 / s), WIDTH, formulation="assumed")
            scene = Scene(beam).clamp("left", thickness="free")
            scene.point_force((0, -alpha * EI), at=(1, 0))
            u, iterations, steps = tip(scene)
            if alpha < 1e-4:
                w = alpha / 3  # to alpha^2
            elif alpha < 200:
                w = exact.elastica_tip_load(alpha)[1]
            else:  # to exp(-sqrt(alpha))
                w = 1 - (2 - np.sqrt(2)) / np.sqrt(alpha)
            yield Row(check, f"{alpha:.0e} EI/L^2, L/h = {s:g}, {name}",
                      "relative error of the deflection", -u / w - 1, bound,
                      f"{iterations} iterations, {steps} load step(s)")


def pendulum(quick, out):
    """A hundred thousand steps of a pendulum: energy."""
    steps = 300 if quick else 100_000
    dt = 2e-3
    beam = Beam(line(2, 0.01), ElementBeamCable(3), StVenantKirchhoff(2e8, NU, 7800), WIDTH,
                formulation="assumed")
    scene = Scene(beam).pin("left").gravity((0, -G))
    scale = beam.total_mass * G * 1.0
    start, times, drift, first, iterations, before = None, [], [], None, 0, time.perf_counter()
    parts = 1 if quick else 20  # in parts, so that the storage stays small
    for k in range(parts):
        n = steps // parts
        history = scene.integrate(t_end=(k + 1) * n * dt, dt=dt, start=start,
                                  t_start=k * n * dt, progress=False)
        every = max(1, n // 250)
        energy = np.array([history.system.strain_energy(history.u[i])
                           + 0.5 * history.v[i] @ history.system.mass.multiply(history.v[i])
                           + history.system.load_potential(history.u[i])
                           for i in range(0, n + 1, every)])
        first = energy[0] if first is None else first
        times.append(history.t[::every])
        drift.append((energy - first) / scale)
        iterations += history.iterations
        start = history.state(len(history) - 1)
        scene.initial_velocity(history.v[-1])
    times, drift = np.concatenate(times), np.concatenate(drift)
    elapsed = time.perf_counter() - before
    case = f"{steps} steps of {dt:g} s, 2 cubic cables"
    note = f"{elapsed / steps * 1e6:.0f} microseconds a step, {iterations / steps:.1f} iterations"
    yield Row("pendulum", case, "largest change of energy over m g L", np.max(np.abs(drift)), 1e-9,
              note)
    half = len(drift) // 2
    trend = (np.mean(drift[half:]) - np.mean(drift[:half])) * 2
    yield Row("pendulum", case, "drift of the mean over m g L", trend, 1e-9)
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 2.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(times, drift, lw=0.6)
    ax.set(xlabel="time (s)", ylabel="energy change / (m g L)",
           title=f"Soft pendulum, {case}, energy-momentum")
    figure.savefig(out / "pendulum.png", dpi=150)


def rigid_motions(quick, out):
    """Random rigid motions: no force, and the same force of a bent beam."""
    rng = np.random.default_rng(7)
    elements = {"N=2": ElementBeamANCF(2)} if quick else {
        **{f"N={n}": ElementBeamANCF(n) for n in (1, 2, 3, 4, 6, 12)},
        **{f"cubic N={n}": ElementBeamANCFCubic(n) for n in (1, 2, 4)},
        "cable 3": ElementBeamCable(3), "cable 5": ElementBeamCable(5)}
    for name, element in elements.items():
        for curved in (False, True):
            worst = bent = 0.0
            for _ in range(5 if quick else 50):
                h = 10.0 ** rng.uniform(-5, -1)
                mesh = (MeshBeam.init_curve(lambda s: np.array([np.sin(s), np.cos(s)]),
                                            np.linspace(0, 1, 7), h) if curved else line(6, h))
                beam = Beam(mesh, element, soft(h), WIDTH, formulation="assumed")
                kernel, L = beam.kernel, mesh.lengths[0]
                K = np.max(np.abs(kernel.tangents(np.zeros(beam.N))))
                angle, shift = rng.uniform(-10, 10), rng.normal(size=2)
                c, s = np.cos(angle), np.sin(angle)
                R = np.array([[c, -s], [s, c]])
                q = beam.q0_local.reshape(-1, beam.nd // 2, 2)
                moved = q @ R.T
                moved[:, 0] += shift
                u = moved.ravel() - beam.q0_local
                worst = max(worst, np.max(np.abs(kernel.force(u))) / (K * np.max(np.abs(u))))
                bump = 0.01 * rng.normal(size=q.shape) * min(L, h)
                f0 = kernel.force(bump.ravel()).reshape(-1, 2)
                turned = (q + bump) @ R.T
                turned[:, 0] += shift
                f1 = kernel.force(turned.ravel() - beam.q0_local).reshape(-1, 2)
                bent = max(bent, np.max(np.abs(f1 - f0 @ R.T)) / (K * np.max(np.abs(u))))
            case = f"{name}, {'curved' if curved else 'straight'}, L/h = 10 to 1e5"
            yield Row("rigid motions", case, "force over stiffness and motion", worst, 1e-13)
            yield Row("rigid motions", case, "change of a bent beam's force", bent, 1e-13)


def spin(quick, out):
    """Two hundred turns of a free beam."""
    turns, per_turn, omega = (3 if quick else 200), 200, 10.0
    dt = 2 * np.pi / omega / per_turn
    for name, element in (("N=2", ElementBeamANCF(2)), ("cubic N=2", ElementBeamANCFCubic(2)),
                          ("cable 3", ElementBeamCable(3))):
        if quick and name != "N=2":
            continue
        beam = Beam(line(4, 0.02), element, StVenantKirchhoff(2e9, NU, 7800), WIDTH,
                    formulation="assumed")
        scene = Scene(beam).initial_velocity(
            lambda x: omega * np.array([-x[1], x[0] - 0.5]) + np.array([[0.3], [0.0]])[..., None])
        history = scene.integrate(t_end=turns * per_turn * dt, dt=dt, progress=False)
        every = max(1, len(history) // 2000)
        u, v = history.u[::every], history.v[::every]
        system = history.system
        energy = np.array([system.strain_energy(a) + 0.5 * b @ system.mass.multiply(b)
                           for a, b in zip(u, v)])
        H = np.array([angular_momentum(system, a, b) for a, b in zip(u, v)])
        P = np.array([momentum(system, b) for b in v])
        centre = np.array([momentum(system, a) for a in u])  # mass times the centre's displacement
        straight = centre[0] + np.outer(history.t[::every], P[0])
        case = f"{turns} turns of {per_turn} steps, {name}"
        yield Row("spin", case, "relative change of energy", np.ptp(energy) / energy[0], 1e-9)
        yield Row("spin", case, "relative change of angular momentum",
                  np.ptp(H) / np.max(np.abs(H)), 1e-9)
        yield Row("spin", case, "change of momentum over m omega L",
                  np.max(np.ptp(P, axis=0)) / (beam.total_mass * omega), 1e-9)
        yield Row("spin", case, "centre off its straight line over L",
                  np.max(np.abs(centre - straight)) / beam.total_mass, 1e-7)
        # the middle of the step turns by 2 atan(omega dt / 2) / dt, not by omega
        ends = history.u[:, -beam.nd:][:, :2] - history.u[:, :2] + [1.0, 0.0]
        angle = np.unwrap(np.arctan2(ends[:, 1], ends[:, 0]))
        inertia = beam.total_mass * (1 + (0.02**2 if "cable" not in name else 0.0)) / 12
        rate = H[0] / inertia
        expected = len(history.t[1:]) * 2 * np.arctan(rate * dt / 2)
        yield Row("spin", case, "turn, relative to that of a rigid beam", angle[-1] / expected - 1,
                  1e-3, f"{angle[-1] / 2 / np.pi:.2f} turns")


ROOTS = {1: None, 2: ("r", "r_X", "r_Y0^1", "r_Y1^1"),
         3: ("r", "r_X", "r_Y0^1", "r_Y1", "r_Y2^1"),
         4: ("r", "r_X", "r_Y0^1", "r_Y1^1", "r_Y2^1", "r_Y3^1")}
#: Tips of 16 elements of order 2 from L/h = 100 on, to be met to the digits given.
KNOWN = {("paper, full quadrature", 2): (-0.888, -0.736, -0.270, -0.061),
         ("two Gauss points", 2): (-0.899, -0.870, -0.764, -0.349)}


def formulations_table(quick, out):
    """Tips of 16 elements: the paper's element, two Gauss points, the assumed strain."""
    check = "formulations"
    for order in (2,) if quick else (1, 2, 3, 4):
        for label, formulation in (("paper, full quadrature", "continuum"),
                                   ("two Gauss points", TwoGaussPoints()), ("assumed", "assumed")):
            for k, s in enumerate((1e2, 1e3) if quick else (1e2, 1e3, 1e4, 1e5, 1e6)):
                beam = Beam(line(16, 1 / s), ElementBeamANCF(order),
                            soft(1 / s, shear_correction="paper"), WIDTH, formulation=formulation)
                scene = Scene(beam).fix("left", ROOTS[order]).gravity((0, -G))
                # elements that are not stabilised have unstable solutions, those that are known
                u, iterations, steps = tip(scene, stable=label == "assumed")
                known = KNOWN.get((label, order), ())
                case = f"{label}, N={order}, L/h = {s:g}"
                yield Row(check, case, "tip", u, None, f"{iterations} iterations, {steps} step(s)")
                if k < len(known):
                    yield Row(check, case, "tip, less the known one", u - known[k], 5e-4)
                if label == "assumed":
                    yield Row(check, case, "error of the tip", u - thin_limit(), 2.6e-3)
    for name, element in (("cubic N=2", ElementBeamANCFCubic(2)), ("cable 3", ElementBeamCable(3)),
                          ("cable 5", ElementBeamCable(5))):
        for s in () if quick else (1e2, 1e3, 1e4, 1e5, 1e6):
            u, iterations, steps = tip(cantilever(element, line(16, 1 / s), soft(1 / s)))
            yield Row(check, f"assumed, {name}, L/h = {s:g}", "tip", u, None,
                      f"{iterations} iterations, {steps} step(s)")


def thick_and_heavy(quick, out):
    """L/h = 10: St. Venant-Kirchhoff collapses at the root, neo-Hookean does not."""
    check = "thick and heavy"
    for law in (StVenantKirchhoff, NeoHookean):
        for name, n in (("N=2", 16),) if quick else (("N=2", 16), ("N=2", 32), ("N=2", 64),
                                                    ("cubic N=2", 16), ("cubic N=2", 64)):
            for formulation in ("assumed", "continuum"):
                scene = cantilever(ELEMENTS[name], line(n, 0.1), soft(0.1, law), formulation,
                                   clamp="fixed")
                u, iterations, steps = tip(scene)
                fails = not np.isfinite(u)
                yield Row(check, f"{law.__name__}, {name}, {n} elements, {formulation}",
                          "tip, less -0.93635 of many elements", u + 0.93635,
                          3e-3 if law is NeoHookean else None,
                          f"no equilibrium beyond load {steps:.3g}" if fails else
                          f"{iterations} iterations, {steps} load step(s)")


def histories(quick, out):
    """Bending beyond yield, and relaxation: any units, slenderness and curvature."""
    check, p = "histories", 1e-3 / 1.001  # of hardening in the slope of the stress
    elements = {"cable 5": ElementBeamCable(5), "N=2": ElementBeamANCF(2),
                "N=3": ElementBeamANCF(3)}
    for name, element in elements.items():
        for s, unit, k in (((1e2, 1.0, 3.0),) if quick else (
                (1e1, 1.0, 2.0), (1e2, 1.0, 3.0), (1e2, 1e-6, 3.0), (1e2, 1e9, 3.0),
                (1e3, 1.0, 1.5))):
            h, E, y = 1.0 / s, 2e11 * unit, 2.5e8 * unit
            first, M_y = 2.0 * y / (E * h), y * WIDTH * h**2 / 6.0
            steel = ElasticPlastic(E, NU, y, 1e-3 * E, points=20)
            # for any law the error of order 2 is 0.3 times the square of the turn of an element:
            # as many elements as keep it at a tenth of a radian
            n = max(8, int(np.ceil(k * first / 0.12)))
            scene = Scene(Beam(line(n, h), element, steel, WIDTH)).clamp("left", thickness="free")
            scene.joint("angle", at="right", angle=lambda t, w=k * first: w * t)
            M = abs(scene.run(1.0, increments=10).state(-1).multipliers[0]) / M_y
            exact = (1.0 - p) * (1.5 - 0.5 / k**2) + p * k
            yield Row(check, f"plastic, {name}, L/h = {s:g}, E times {unit:g}, k = {k:g} k_y",
                      "relative error of the moment", M / exact - 1.0, 5e-3)
        for tau in (1.0,) if quick else (1e-6, 1.0, 1e9):
            polymer = Prony(StVenantKirchhoff(2e9, NU), [0.4], [tau])
            scene = Scene(Beam(line(4, 0.01), element, polymer, WIDTH)).clamp("left")
            scene.joint("angle", at="right", angle=lambda t, a=tau: 0.1 * min(t / a, 1e-6) / 1e-6)
            M = [x.multipliers[0] for x in scene.run([1e-6 * tau, 2.0 * tau], increments=4)]
            yield Row(check, f"relaxation, {name}, time {tau:g}", "relative error of the moment",
                      M[-1] / M[4] / (1.0 - 0.4 * (1.0 - np.exp(-2.0))) - 1.0, 1e-5)
        # a bar between walls is heated, cooled and heated: isotropic, saturating, kinematic
        def path(t):
            return np.interp(t, range(4), (0.0, 1.0, -1.0, 0.5))

        for unit in (1.0,) if quick else (1e-6, 1.0, 1e9):
            E, y, alpha = 2e11 * unit, 2.5e8 * unit, 1.2e-5
            for case, h, k in (("isotropic", (0.0, 1.0, 0.01 * E), 0.0),
                               ("Voce", (0.5 * y, 300.0, 0.0), 0.0),
                               ("kinematic", (0.0, 1.0, 0.0), 0.02 * E)):
                law = ElasticPlastic(E, 0.0, y, Voce(*h), k, thermal_expansion=alpha)
                scene = Scene(Beam(line(2, 0.05, 0.1), element, law, WIDTH))
                scene.temperature(200.0, amplitude=path)
                for end in ("left", "right"):
                    scene.clamp(end, thickness="free")
                run = scene.run([1.0, 2.0, 3.0], increments=3)
                error = np.array([x.stress((0.03, 0.0))[0] for x in run]) - fibre(
                    -200.0 * alpha * path(run.t), E, y, h, k)
                yield Row(check, f"{case} cycle, {name}, E times {unit:g}", "relative error of the "
                          "stress", np.abs(error).max() / y, 1e-7)
        # a slider that remembers where it is, dragged there and back: a loop of 4 F (d - F / k)
        for unit in (1.0,) if quick else (1e-6, 1.0, 1e9):
            F = 1e-3 * unit
            scene = Scene(Beam(line(2, 0.02), element, StVenantKirchhoff(1e7 * unit, 0.0), WIDTH))
            scene.clamp("left", thickness="free").add(Slider(1e2 * F, F))
            scene.fix("right", "r^2", displacement=lambda t: 0.05 * np.interp(
                t, range(4), (0.0, 1.0, -1.0, 1.0)))
            run = scene.run([1.0, 3.0], increments=10)
            yield Row(check, f"slider, {name}, F = {F:g}", "relative error of the loop",
                      (run.dissipated[-1] - run.dissipated[10]) / (4.0 * F * 0.04) - 1.0, 1e-6)


def fibre(strains, E, y, hardening, kinematic):
    """Stresses of a fibre that yields, at strains one after the other."""
    (Q, b, H), flow, back, p, out = hardening, 0.0, 0.0, 0.0, []
    for e in strains:
        x = E * (e - flow) - back

        def excess(g, x=x, p=p):
            return abs(x) - (E + kinematic) * g - y - Q * (1 - np.exp(-b * (p + g))) - H * (p + g)

        g = np.sign(x) * (brentq(excess, 0.0, abs(x) / E, xtol=1e-18) if excess(0.0) > 0.0 else 0.0)
        flow, back, p = flow + g, back + kinematic * g, p + abs(g)
        out.append(E * (e - flow))
    return np.array(out)


class Slider(ForceElement):
    """A spring of stiffness k to a place along y that gives way at a force."""

    def __init__(self, k, most):
        self.k, self.most = k, most

    def bind(self, layout):
        return [point(layout, None, "right")]

    def start(self):
        return np.zeros(1)

    def evaluate(self, x, v, t, history, dt):
        F = np.clip(self.k * (x[0, 1] - history[0]), -self.most, self.most)
        return np.array([[0.0, -F]]), np.array([x[0, 1] - F / self.k])

    def potential(self, x, history):
        return 0.5 * self.k * (x[0, 1] - history[0]) ** 2


def leaves(element, h, E, n, friction=0.0, origin=0.0):
    """n cantilevers on each other, the upper one loaded at its end, and their stiffness."""
    law = StVenantKirchhoff(E, 0.0, 1e-3 * E)
    beams = [Beam(line(8, h).translated((origin, -k * h)), element, law, WIDTH) for k in range(n)]
    scene = Scene(*beams).contact("all", friction=friction)
    for k in range(n):
        scene.clamp("left", k, thickness="free")
    return scene, 3.0 * n * E * WIDTH * h**3 / 12.0


def pairs(quick, out):
    """Beams that touch: leaves that slide and rub in any units, impacts."""
    check = "pairs"
    elements = {"cable 3": ElementBeamCable(3), "cable 5": ElementBeamCable(5),
                "N=2": ElementBeamANCF(2), "cubic 2": ElementBeamANCFCubic(2)}
    for name, element in elements.items():
        for s, E, n, origin in (((1e2, 2e11, 2, 0.0),) if quick else (
                (2e1, 2e11, 2, 0.0), (1e2, 2e11, 2, 0.0), (1e2, 2e11, 3, 0.0), (1e2, 1e-3, 3, 0.0),
                (1e2, 2e11, 2, 1e4), (1e3, 2e11, 2, 0.0))):
            scene, k = leaves(element, 1.0 / s, E, n, origin=origin)
            state = scene.point_force((0, -1e-3 * k), at=(origin + 1.0, 0), beam=0).solve_static()
            case = f"{n} leaves, {name}, L/h = {s:g}, E = {E:g}, from x = {origin:g}"
            yield Row(check, case, "relative error of the deflection",
                      state.displacement("right", 0)[1] / -1e-3 - 1.0, 6e-3)
            yield Row(check, case, "penetration over height", state.contact().penetration * s, 1e-2)
        mu, h = 0.3, 0.1
        for E in (2e11,) if quick else (2e11, 1e-3):
            slopes = []
            for friction in (0.0, mu):
                scene, k = leaves(element, h, E, 2, friction)
                scene.point_force((0, -1e-3 * k), at="right", beam=0, amplitude=lambda t: t)
                tip = scene.run(1.0, increments=5).displacement("right", 0)[:, 1]
                slopes.append(1.0 / (tip[-2] - tip[-1]))
            share = 3.0 * mu * h / 4.0
            yield Row(check, f"friction {mu}, {name}, L/h = 10, E = {E:g}", "relative error of the "
                      "stiffness", slopes[1] / slopes[0] * (1.0 - share) - 1.0, 5e-3)
        for friction in (0.0, 0.3):
            law = StVenantKirchhoff(1e7, 0.0, 1e3)
            rods = [Beam(line(4, 0.05, **given), element, law, 0.02) for given in (
                {}, {"origin": (0.4, 0.06), "angle": 0.1})]
            history = Scene(*rods).contact("all", friction=friction).initial_velocity(
                (0, -2.0), 1).integrate(0.01 if quick else 0.04, 4e-4)
            energy = history.total_energy + history.dissipated
            turn, case = history.angular_momentum, f"impact, {name}, friction {friction}"
            yield Row(check, case, "range of energy and dissipation", np.ptp(energy) / energy[0],
                      1e-10)
            yield Row(check, case, "range of the angular momentum", np.ptp(turn) / np.max(
                np.abs(turn)), 1e-10)


def squeezed(n, friction, fine=False, rest=(), unit=1.0):
    """Wavy wires that nothing holds in a box, whose lid comes down by half of its height until t =
    1, and stays there at instants ``rest``: the run, the largest penetration over the height h, and
    the forces of left and right wall, floor, lid. ``unit`` is that of lengths."""
    element, parts, increments = (ElementBeamANCFCubic(1), 10, 200) if fine else (
        ElementBeamCable(3), 4, 20)
    h, rng = 0.02 * unit, np.random.default_rng(3)
    beams = [Beam(MeshBeam.init_curve(lambda s, c=c, k=k: np.array(
        [s, (3.6 * k + 1.2 * np.sin(2 * np.pi * s / unit + c)) * h]),
        np.linspace(0, 1, parts + 1) * unit, height=h), element,
        StVenantKirchhoff(1e6 / unit, 0.0, 1.0), unit)
        for k, c in enumerate(rng.uniform(0, 2 * np.pi, n))]
    scene, low, top = Scene(*beams).contact("all", friction=friction), -1.8 * h, (3.6 * n - 1.8) * h
    for place, normal in (((-h, 0), (1, 0)), ((unit + h, 0), (-1, 0)), ((0, low), (0, 1))):
        scene.obstacle(Line(place, normal))
    scene.obstacle(Line((0, top), (0, -1)), position=lambda t: (
        0, -0.5 * min(t, 1.0) * (top - low)))
    run = scene.run([*np.arange(1, increments + 1) / increments, *rest], increments=1)
    walls = np.array([run.state(-1).contact(k).total for k in range(4)])
    return run, max(state.contact().penetration for state in run) / h, walls


def wires(quick, out):
    """Wavy wires that nothing holds, squeezed in a box until half of its height is left."""
    for n, friction in ((2, 0.0),) if quick else (
            (3, 0.0), (3, 0.2), (6, 0.0), (6, 0.2), (20, 0.0), (20, 0.2)):
        _, deepest, (_, _, floor, lid) = squeezed(n, friction, n == 20, (1.1, 1.2, 1.3))
        case = f"{n} wires, friction {friction}"
        yield Row("wires", case, "penetration over height", deepest, 1e-2)
        # the drag of what is loose, which increments at rest take away
        yield Row("wires", case, "difference of floor and lid", (floor + lid)[1] / lid[1], 0.15)


CHECKS = (formulations_table, slenderness, fine_and_slender, thick_and_heavy, poisson, orders,
          units, far_away, length_ratios, loads, rigid_motions, spin, pendulum, histories,
          pairs, wires)


def run(out="out/stress", quick=False, progress=None, checks=CHECKS):
    """Run the checks and write the tables.

    Parameters
    ----------
    out
        Directory for ``stress.csv``, ``report.md`` and pictures.
    quick
        A few cases of every check.
    progress
        Show a progress bar: True, False, or None for "if it takes long".
    checks
        Which checks.

    Returns
    -------
    list of Row
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    rows, times = [], {}
    with progress_bar(progress, total=len(checks), desc="stress") as bar:
        for check in checks:
            before = time.perf_counter()
            rows.extend(check(quick, out))
            times[check.__name__] = time.perf_counter() - before
            bar.update(1)
    with open(out / "stress.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["check", "case", "quantity", "value", "bound", "passed", "note"])
        for r in rows:
            writer.writerow([r.check, r.case, r.quantity, repr(float(r.value)),
                             "" if r.bound is None else repr(float(r.bound)), r.passed, r.note])
    (out / "report.md").write_text(report(rows, checks, times))
    return rows


def report(rows, checks, times):
    """The rows as tables in Markdown."""
    failed = [r for r in rows if not r.passed]
    text = ["# Numerical stability", "", f"{len(rows)} rows, "
            f"{sum(r.bound is not None for r in rows)} with a bound, {len(failed)} beyond it.", ""]
    if failed:
        text += ["Beyond their bound:", ""]
        text += [f"* {r.check}: {r.case}: {r.quantity} {r.value:.3g}, bound {r.bound:.3g}"
                 for r in failed] + [""]
    names = list(dict.fromkeys(r.check for r in rows))
    for name, check in zip(names, checks):
        text += [f"## {name}", "", f"{check.__doc__} ({times[check.__name__]:.1f} s)", "",
                 "| case | quantity | value | bound | |", "|---|---|---|---|---|"]
        for r in rows:
            if r.check == name:
                value = f"{r.value:.6f}" if r.quantity == "tip" else f"{r.value:.2g}"
                bound = "" if r.bound is None else f"{r.bound:.2g}"
                text.append(f"| {r.case} | {r.quantity} | {value} | {bound} | "
                            f"{'' if r.passed else '**beyond** '}{r.note} |")
        text.append("")
    return "\n".join(text)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/stress", help="directory of the results")
    parser.add_argument("--quick", action="store_true", help="a few cases of every check")
    options = parser.parse_args(arguments)
    before = time.perf_counter()
    rows = run(options.out, options.quick, progress=True)
    failed = [r for r in rows if not r.passed]
    for r in failed:
        print(f"beyond its bound: {r.check}: {r.case}: {r.quantity} {r.value:.3g} > {r.bound:.3g}")
    print(f"{len(rows)} rows, {len(failed)} beyond their bounds, "
          f"{time.perf_counter() - before:.0f} s; see {Path(options.out) / 'report.md'}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
