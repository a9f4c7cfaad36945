"""Beams of any size in metres: the same numbers without units, in as many iterations."""

import numpy as np
import pytest

import elbow
from noise import alike
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, MeshBeam, RigidBody, Scene, Section)
from skfem_ancf.actions.joints import JOINTS

#: Lengths of a beam in metres, beside one metre.
LENGTHS = 1e3, 1e-3, 1e-6, 1e-9
#: Elements of the two beams.
KINDS = {"sections": lambda: (ElementBeamPatelShabana(), ElementBeamANCFCubic(2)),
         "mixed": lambda: (ElementBeamANCF(3), ElementBeamCable(5))}


def between(a, b, ne, L, element, h, name=None):
    """A straight beam of density 1000 and unit modulus times 1e6, where L is the unit of length.

    That of mass is L^3, that of time one second.
    """
    a, b = L * np.array(a, dtype=float), L * np.array(b, dtype=float)
    return elbow.between(a, b, ne, h=L * h, E=1e6 * L * L, width=0.1 * L, element=element,
                         name=name)


def jointed(name, L, kind):
    """Two beams, clamped at an angle, with a joint of each kind of the registry, or a dashpot."""
    arm, forearm = KINDS[kind]()
    cases = elbow.joint_examples(L, 0.3, 0.005, 0.1)
    assert set(cases) == set(JOINTS)
    turns = name in ("hinge", "plane")
    scene = Scene(between((0, 0), (1, 0.3), 2, L, arm, 0.1, "arm"),
                  between((1, 0.3), (1.4, 1.2), 3, L, forearm, 0.15, "forearm"))
    scene.gravity((0.0, -0.3 * L)).clamp("left", beam="arm", thickness="free")
    held = "hinge" if turns else "weld"
    scene.joint(held, **cases[held])
    if name not in ("hinge", "weld", "dashpot"):
        scene.joint(name, **cases[name])
    if turns or name == "dashpot":
        scene.spring(300.0 * L**3, between=((1.4 * L, 1.2 * L), (1.9 * L, 1.2 * L)),
                     damping=20.0 * L**3)
    return scene


def found(name, L, kind, scheme):
    """Displacement of the tip over L, and the number of iterations."""
    scene, tip = jointed(name, L, kind), (1.4 * L, 1.2 * L)
    if scheme is None:
        state = scene.solve_static()
        return state.displacement(tip) / L, state.iterations
    history = scene.integrate(t_end=0.05, dt=0.01, scheme=scheme)
    return history.displacement(tip)[-1] / L, history.iterations


@pytest.mark.parametrize("kind, scheme", [("sections", None), ("mixed", None),
                                          ("mixed", "energy-momentum"), ("sections", "radau")])
@pytest.mark.parametrize("name", [*JOINTS, "dashpot"])
def test_joints_of_beams_of_any_size(name, kind, scheme):
    wanted, iterations = found(name, 1.0, kind, scheme)
    for L in LENGTHS[:None if scheme is None else 3]:
        tip, number = found(name, L, kind, scheme)
        assert np.allclose(tip, wanted, rtol=0, atol=1e-9 * np.abs(wanted).max()), L
        assert alike(number, iterations), L


@pytest.mark.parametrize("L", LENGTHS)
def test_rigid_bodies_of_any_size(L):
    """What holds coordinates without stiffness in statics has units of its own."""
    def run(L):
        body = RigidBody(0.5 * L**3, 0.01 * L**5, (1.3 * L, 0.8 * L))
        beam = between((0, 0), (1.3, 0.8), 4, L, ElementBeamCable(5), 0.15)
        scene = Scene(beam, body).gravity((0.0, -0.1 * L)).clamp("left")
        scene.hinge((beam, (1.3 * L, 0.8 * L)), (body, (1.3 * L, 0.8 * L)))
        scene.spring(50.0 * L**3, between=((body, (1.3 * L, 0.9 * L)), (2 * L, 0.5 * L)))
        return scene.solve_static()

    one, other = run(1.0), run(L)
    assert alike(other.iterations, one.iterations)
    assert np.isclose(other.strain_energy, one.strain_energy * L**5, rtol=1e-9)


@pytest.mark.parametrize("L", LENGTHS)
def test_verdicts_of_beams_of_any_size(L):
    """Above and below the buckling load of a column with a clamp at an angle."""
    def run(L, share):
        e = np.array([1.0, 0.3]) / np.hypot(1.0, 0.3)
        scene = Scene(between((0, 0), (1, 0.3), 6, L, ElementBeamPatelShabana(), 0.02))
        scene.clamp("left", thickness="free")
        scene.joint("angle", at="right", angle=lambda t: 0.0 * t)
        scene.point_force(tuple(-share * L**4 * e), at=(L, 0.3 * L))
        return scene

    load = run(1.0, 1.0).buckling(1).factors[0]
    assert np.isclose(run(L, 1.0).buckling(1).factors[0], load, rtol=1e-7)
    for share, negative in ((0.99 * load, 0), (1.01 * load, 1)):
        system = run(L, share).system
        straight = run(L, share).solve_linear()
        system.assemble(straight.u, 1.0)
        system.solver.factorize(straight.u, 1.0, straight.multipliers)
        assert tuple(system.solver.inertia()) == (negative, False)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_becks_column_flutters_in_any_unit(unit):
    """Loads without a potential are seen where coordinates have units of 1e-12 to 1e12."""
    mesh = MeshBeam.init_line(unit * np.linspace(0, 1, 7), 1e-2 * unit)
    column = Beam(mesh, ElementBeamCable(5), section=Section.numbers(
        EA=1.2e5 * unit, EI=unit**3, rhoA=1.0 / unit, rhoI=1e-9 * unit))
    scene = Scene(column).clamp("left").follower_force((-20.5 * unit, 0), at=(unit, 0))
    state = scene.solve_static()
    modes = scene.modes(2, state)
    assert modes.flutter and state.stability == "undecided"
    assert np.allclose(modes.frequencies.real, 10.98061, rtol=1e-6)  # beyond P = 20.051
