"""Known problems against published and independent solutions: one table.

    python benchmarks/verification.py [--out out/verification.md]

Each case is solved with about 100 coordinates by three elements: the cable of degree 5, cubic
sections of order 2, and the paper's linear sections of order 2, all with the default formulation.
Nothing is stored: references are closed forms and rods integrated by shooting
(``validation/exact``), or, for thick bodies, the two-dimensional solution of
``benchmarks/reference_2d.py`` by stock scikit-fem.
"""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, fsolve

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "validation")]

import exact
import reference_2d
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, Section, StVenantKirchhoff)

#: The columns: a name, the element, and how many of it have about 100 coordinates.
ELEMENTS = {"cable, degree 5": (ElementBeamCable(5), 16),
            "cubic sections, N = 2": (ElementBeamANCFCubic(2), 8),
            "linear sections, N = 2": (ElementBeamANCF(2), 12)}

SLENDER, THIN = 1e-3, 1e-4  # height over length where the reference is a line
CASES = []


class Case(NamedTuple):
    """A row: what is asked, its reference, what solves it, and where the reference is from."""

    name: str
    quantity: str
    reference: object  # a function without arguments
    solve: object  # of the element and the number of elements
    source: str
    without: tuple  # names of elements that cannot know the answer


class Row(NamedTuple):
    """A case, computed: the reference, and by the name of an element the relative error."""

    case: Case
    reference: float
    errors: dict
    coordinates: dict


def case(name, quantity, reference, source, without=()):
    """Enter a case; the function solves it and returns the number and the scene."""
    def enter(solve):
        CASES.append(Case(name, quantity, reference, solve, source, without))
        return solve
    return enter


def beam_of(element, n, h=SLENDER, length=1.0, nu=0.0, EI=1.0, rhoA=1.0, **options):
    """A straight beam of width 1 with a given bending stiffness and mass per length."""
    law = StVenantKirchhoff(E=12 * EI / h**3, nu=nu, density=rhoA / h)
    mesh = MeshBeam.init_line(np.linspace(0, length, n + 1), h, **options)
    return Beam(mesh, element, law, width=1.0)


def clamped(beam):
    """A scene of one beam, its left section held in its plane."""
    return Scene(beam).clamp("left", thickness="free")


@case("Cantilever, tip force 10 EI/L^2", "deflection / L", lambda: exact.elastica_tip_load(10.0)[1],
      "Bisshopp, Drucker (1945), elliptic integrals, doi:10.1090/qam/13360")
def tip_force(element, n):
    scene = clamped(beam_of(element, n, h=THIN)).point_force((0, -10), at=(1, 0))
    return -scene.solve_static().displacement((1, 0))[1], scene


HEAVY = dict(E=12 / THIN**3, nu=0.0, rho=10 / THIN, L=1.0, b=1.0, h=THIN, g=1.0)


@case("Cantilever, own weight 10 EI/L^3 per length", "deflection / L",
      lambda: -exact.gravity_cantilever(**HEAVY, model="elastica")[1],
      "elastica, integrated by shooting; the paper's example 5.2 in the slender limit")
def own_weight(element, n):
    scene = clamped(beam_of(element, n, h=THIN, rhoA=10.0)).gravity((0, -1))
    return -scene.solve_static().displacement((1, 0))[1], scene


@case("Roll-up by an end moment 2 pi EI/L", "turns of the end",
      lambda: exact.rollup_end_angle(2 * np.pi, 12 / THIN**3, 1.0, THIN, 1.0) / (2 * np.pi),
      "closed form of St. Venant-Kirchhoff sections, docs/elements.md")
def roll_up(element, n):
    scene = clamped(beam_of(element, n, h=THIN)).moment("right", 2 * np.pi)
    state = scene.solve_static()
    across = state.position((1, THIN / 2)) - state.position((1, -THIN / 2))
    return 1 + np.arctan2(-across[0], across[1]) / (2 * np.pi), scene


@case("Lee's frame", "first limit load / (EI/L^2)", lambda: exact.lee_frame_limits()[0],
      "Lee, Manuel, Rossow (1968); elastica, integrated by shooting")
def lee(element, n):
    half = n // 2
    parts = [beam_of(element, half, angle=np.pi / 2), beam_of(element, half, origin=(0, 1))]
    parts = [beam.replace(name=name) for beam, name in zip(parts, ("column", "girder"))]
    scene = Scene(*parts).pin("left", beam="column").pin("right", beam="girder")
    scene.joint("weld", beams=("column", "girder"), at=("right", "left"))
    scene.point_force((0, -1), at=(0.2, 1), beam="girder")
    return scene.continuation(steps=200, ds=0.03, max_load=25).limit_points()[0], scene


@case("Arch of 215 degrees, clamped and hinged", "limit load / (EI/R^2)",
      exact.clamped_hinged_arch_limit,
      "DaDeppo, Schmidt (1975): 8.97; elastica, integrated by shooting")
def arch(element, n):
    a = np.deg2rad(215.0) / 2
    mesh = MeshBeam.init_curve(lambda s: np.array([np.sin(s), np.cos(s)]),
                               np.linspace(-a, a, n + 1), SLENDER)
    beam = Beam(mesh, element, StVenantKirchhoff(E=12 / SLENDER**3, nu=0.0), width=1.0)
    scene = clamped(beam).pin("right").point_force((0, -1), at=(0, 1))
    return scene.continuation(max_load=20, until=past_the_maximum()).limit_points()[0], scene


def past_the_maximum():
    """Ends a path where its load falls."""
    loads = []

    def fallen(state):
        loads.append(state.load)
        return len(loads) > 1 and loads[-1] < max(loads)
    return fallen


@case("Column, clamped and free", "buckling load / (EI/L^2)",
      lambda: exact.euler_buckling_load(1.0, 1.0, 1.0), "Euler: pi^2 / 4")
def euler(element, n):
    scene = clamped(beam_of(element, n)).point_force((-1, 0), at=(1, 0))
    return scene.buckling(1).factors[0], scene


@case("Column under its own weight", "critical q L^3/EI",
      lambda: exact.greenhill_load(1.0, 1.0, 1.0), "Greenhill (1881), Bessel functions")
def greenhill(element, n):
    scene = clamped(beam_of(element, n)).gravity((-1, 0))
    return scene.buckling(1).factors[0], scene


def beck_reference():
    """Where two roots of the frequency equation meet."""
    def equation(P, omega):
        root = np.sqrt(P**2 / 4 + omega**2)
        a, b = np.sqrt(P / 2 + root), np.sqrt(root - P / 2)
        return (P**2 + 2 * omega**2 * (1 + np.cos(a) * np.cosh(b))
                + omega * P * np.sin(a) * np.sinh(b))

    def meet(z):
        P, omega = z
        return [equation(P, omega), (equation(P, omega + 1e-4) - equation(P, omega - 1e-4)) / 2e-4]
    return fsolve(meet, (20.0, 11.0))[0]


@case("Column pushed along its end's tangent", "flutter load / (EI/L^2)", beck_reference,
      "Beck (1952), doi:10.1007/BF02008828")
def beck(element, n):
    def scene_of(P):
        return clamped(beam_of(element, n)).follower_force((-P, 0), at=(1, 0))

    def split(P):
        """The square of the half difference of the two lowest eigenvalues: negative in flutter."""
        scene = scene_of(P)
        a, b = np.asarray(scene.modes(2, scene.solve_static(stable=False)).eigenvalues)
        return float(np.real((a - b) ** 2))
    return brentq(split, 19.5, 20.6, xtol=1e-4), scene_of(20.0)


THICK = dict(E=1.0, I=0.1**3 / 12, A=0.1, rho=1.0, L=1.0)


@case("Cantilever, L/h = 1000", "third angular frequency",
      lambda: exact.euler_bernoulli_frequencies(1.0, 1.0, 1.0, 1.0, 1.0, n=3)[2],
      "Euler-Bernoulli, cos x cosh x = -1")
def slender_frequency(element, n):
    scene = clamped(beam_of(element, n))
    return scene.modes(3).frequencies[2], scene


@case("Cantilever, L/h = 10", "second angular frequency",
      lambda: exact.timoshenko_frequencies(
          **THICK, kGA=exact.shear_factor(0.0) * 0.5 * 0.1, n=2)[1],
      "Timoshenko's beam, root of its characteristic equation", ("cable, degree 5",))
def thick_frequency(element, n):
    law = StVenantKirchhoff(E=1.0, nu=0.0, density=1.0)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), 0.1), element, law, width=1.0)
    scene = clamped(beam)
    return scene.modes(2).frequencies[1], scene


@case("Rod that falls about a hinge, 1 s", "angle", lambda: exact.rigid_pendulum(1.0, 1.0)[()],
      "rigid rod, Jacobi's elliptic functions")
def pendulum(element, n):
    scene = Scene(beam_of(element, n, h=0.01, EI=1e6, rhoA=1.0)).pin("left").gravity((0, -9.81))
    tip = scene.integrate(1.0, 2e-3, t_eval=[1.0]).position((1, 0))[-1]
    return np.arctan2(tip[0], -tip[1]), scene


def bimetal(h=SLENDER):
    """Curvature by the change of temperature of two equal layers, moduli 2 : 1, expansion 1 : 0."""
    m, n = 1.0, 2.0
    return 6 * (1 + m)**2 / (h * (3 * (1 + m)**2 + (1 + m * n) * (m**2 + 1 / (m * n))))


@case("Bimetal strip, heated", "curvature h / (difference of expansion)",
      lambda: bimetal() * SLENDER, "Timoshenko (1925), eq. 4, doi:10.1364/JOSA.11.000233")
def strip(element, n):
    strain = 1e-6
    hot, cold = (StVenantKirchhoff(E=E, nu=0.0, thermal_expansion=a)
                 for E, a in ((1e9, 0.0), (2e9, 1.0)))
    section = Section.layers((SLENDER / 2, cold), (SLENDER / 2, hot), width=1.0)
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), SLENDER)
    scene = clamped(Beam(mesh, element, section=section)).temperature(strain)
    tip = scene.solve_static().displacement((1, 0))[1]
    return 2 * tip * SLENDER / strain, scene


@case("Strain across a slender cantilever, L/h = 100", "eps_yy on top, half way, recovered",
      lambda: exact.root_transverse_strain(1e-3, 12e6, 0.3, L=0.5, h=0.01, b=1.0)[0],
      "beam theory: -nu S_xx / E", ("cable, degree 5",))
def across(element, n):
    scene = clamped(beam_of(element, n, h=0.01, nu=0.3)).point_force((0, -1e-3), at=(1, 0))
    return scene.solve_static().strain((0.5, 0.005))[1], scene


BODY = reference_2d.CASES["thick"]


def body_tip():
    """Deflection of the two-dimensional body, of benchmarks/reference_2d.py."""
    with np.load(reference_2d.FILE) as data:
        return -float(data["thick_tip"][1])


@case("Thick cantilever, L/h = 4, large deflection", "deflection (m)", body_tip,
      "the two-dimensional body, quads of order 4, stock scikit-fem", ("cable, degree 5",))
def thick(element, n):
    law = StVenantKirchhoff(E=BODY["E"], nu=BODY["nu"])
    mesh = MeshBeam.init_line(np.linspace(0, BODY["length"], n + 1), BODY["height"])
    scene = Scene(Beam(mesh, element, law, width=0.1)).clamp("left")
    scene.traction("right", BODY["end"])
    return -scene.solve_static().displacement((BODY["length"], 0))[1], scene


def compute(cases=None, elements=None):
    """The rows, in the order of the table."""
    rows = []
    for entry in CASES if cases is None else cases:
        known, errors, coordinates = float(entry.reference()), {}, {}
        for name, (element, n) in (elements or ELEMENTS).items():
            if name in entry.without:
                continue
            value, scene = entry.solve(element, n)
            errors[name], coordinates[name] = float(value / known - 1), scene.layout.N
        rows.append(Row(entry, known, errors, coordinates))
    return rows


def table(rows):
    """The rows as Markdown."""
    names = list(ELEMENTS)
    lines = ["| case | quantity | reference | " + " | ".join(names) + " | source |",
             "|---|---|---|" + "---|" * len(names) + "---|"]
    for row in rows:
        # a hyphen at which no line is broken
        errors = [f"{row.errors[n]:+.1e}".replace("e-", "e\u2011") if n in row.errors else "-"
                  for n in names]
        source = row.case.source
        if "doi:" in source:
            text, doi = source.split("doi:")
            source = f"{text}[doi:{doi}](https://doi.org/{doi})"
        lines.append(f"| {row.case.name} | {row.case.quantity} | {row.reference:.8g} | "
                     + " | ".join(errors) + f" | {source} |")
    sizes = [row.coordinates[n] for row in rows for n in row.coordinates]
    lines += ["", f"Relative errors, with {min(sizes)} to {max(sizes)} degrees of freedom. \"-\": "
              "the element has no shear, or no independent strain across the section."]
    return "\n".join(lines) + "\n"


def main(arguments=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/verification.md", help="file to write")
    out = Path(parser.parse_args(arguments).out)
    text = table(compute())
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(text, encoding="utf-8")
    print(f"{text}\n{out}")


if __name__ == "__main__":
    main()
