"""The shear-rigid cable: its kernel, exact rods, motion and fields."""

import re

import exact
import numpy as np
import pytest
from scipy.optimize import fsolve

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam, ModelWarning,
                        Scene, Section, StVenantKirchhoff)
from skfem_ancf.actions.loads import Traction
from skfem_ancf.beam.kinematics import bent, shortest
from skfem_ancf.beam.strain_energy import stress_size
from skfem_ancf.equations.evaluation import AXES, RANGE, UNSEEN, examine

DEGREES = (3, 5, 7, 9, 13)
E, NU, RHO, B = 2e8, 0.3, 7800.0, 0.01


def line(n=4, h=0.01, **options):
    return MeshBeam.init_line(np.linspace(0.0, 1.0, n + 1), h, **options)


def uneven(h=0.05):
    return MeshBeam.init_line([0.0, 0.3, 0.35, 1.0, 1.2], h, origin=(5.0, -1.0), angle=2.1)


def wave(h=0.05, n=5):
    return MeshBeam.init_curve(lambda s: np.array([2 * s + 0.2 * s**2, 0.4 * np.sin(2.5 * s)]),
                               np.linspace(-1.0, 1.3, n + 1), h)


MESHES = {"line": line, "uneven": uneven, "wave": wave}
CASES = [(d, m) for d in DEGREES for m in MESHES]
FORMULATIONS = ("assumed", "continuum")


def cable(degree, mesh, formulation="assumed", plane="stress", **options):
    return Beam(mesh, ElementBeamCable(degree), StVenantKirchhoff(E, NU, RHO, plane=plane), B,
                formulation=formulation, **options)


def without_rotary_inertia():
    A, I = B * 0.01, B * 0.01**3 / 12
    return Beam(line(8), ElementBeamCable(5), section=Section.numbers(
        EA=E * A, EI=E * I, rhoA=RHO * A, rhoI=1e-9 * RHO * A))


def disturbed(beam, size=0.05, seed=0):
    """A displacement of the coordinates of that size relative to an element, shape (N,)."""
    L = np.min(beam.mesh.lengths)
    u = np.random.default_rng(seed).normal(size=(beam.N // beam.nd, beam.nd // 2, 2))
    return (size * u * L ** (1.0 - np.arange(beam.nd // 2)[:, None])).ravel()


# the kernel


@pytest.mark.parametrize("degree, name", CASES)
def test_objectivity(degree, name):
    beam = cable(degree, MESHES[name]())
    kernel, u = beam.kernel, disturbed(beam)
    q0, q = (x.reshape(-1, beam.nd // 2, 2) for x in (beam.q0_local, beam.q0_local + u))
    force = kernel.force(u).reshape(-1, 2)
    for angle in (0.7, 3.0, -2.2):
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, -s], [s, c]])
        moved, rigid = q @ R.T, q0 @ R.T
        moved[:, 0] += [3.0, -2.0]
        v, w = (x.ravel() - beam.q0_local for x in (moved, rigid))
        assert kernel.energy(v) == pytest.approx(kernel.energy(u), rel=1e-11)
        turned = kernel.force(v).reshape(-1, 2)
        assert np.max(np.abs(turned - force @ R.T)) < 1e-10 * np.max(np.abs(force))
        assert np.max(np.abs(kernel.force(w))) < 1e-11 * np.max(np.abs(force))


def test_degrees_are_odd_and_from_3_to_15():
    for degree in (1, 2, 4, 17, True, "3", 5.0):
        with pytest.raises(InputError, match="one of 3, 5, 7, 9, 11, 13, 15, got"):
            ElementBeamCable(degree)


# statics


@pytest.mark.parametrize("degree, n, tol", [(3, 32, 6e-6), (5, 16, 2e-8), (7, 8, 1e-9)])
def test_tip_load_of_a_thick_cantilever(degree, n, tol):
    L, h, modulus = 2.0, 0.1, 2.07e11
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, n + 1), h), ElementBeamCable(degree),
                StVenantKirchhoff(modulus, 0.3), h, formulation="assumed")
    P = 3 * modulus * h**4 / 12 / L**2
    state = Scene(beam).clamp("left").point_force((0, -P), at=(L, 0)).solve_static()
    tip = state.displacement((L, 0))
    np.testing.assert_allclose(tip, [-0.508537304326, -1.207239854550], rtol=0, atol=tol)
    EI, EA = modulus * h**4 / 12, modulus * h**2
    np.testing.assert_allclose(tip, exact.elastica_extensible_tip(P, EA, EI, L), rtol=0, atol=tol)
    reaction = state.reactions("left")
    np.testing.assert_allclose(reaction.force, [0, P], atol=1e-8 * P)
    assert reaction.moment == pytest.approx(P * (L + tip[0]), rel=1e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_cable_rolls_up_to_a_circle(formulation):
    beam = cable(5, line(16), formulation)
    EI = E * B * 0.01**3 / 12
    state = Scene(beam).clamp("left").moment("right", 2 * np.pi * EI).solve_static(first_step=0.25)
    # the law is linear in the curvature: it closes
    np.testing.assert_allclose(state.position((1, 0)), 0.0, atol=1e-5)


@pytest.mark.parametrize("slenderness", [10.0, 30.0, 1e3, 1e6])
def test_cubic_cables_do_not_lock(slenderness):
    h = 1.0 / slenderness
    tips = []
    for degree, n in ((3, 16), (5, 32)):
        beam = Beam(line(n, h), ElementBeamCable(degree),
                    StVenantKirchhoff(E * (0.01 / h) ** 3, NU, RHO * 0.01 / h), B)
        state = Scene(beam).clamp("left").gravity((0, -9.81)).solve_static()
        tips.append(state.displacement((1, 0)))
        assert len(state.steps) == 1 or slenderness > 1e5
    assert np.max(np.abs(tips[0] - tips[1])) < 3e-4


# vibration and motion


@pytest.mark.parametrize("degree, n, tol", [(3, 32, 5e-5), (5, 8, 1e-6), (7, 5, 1e-6)])
def test_frequencies(degree, n, tol):
    beam = cable(degree, line(n))
    A, I = B * 0.01, B * 0.01**3 / 12
    for scene, ends, skip in ((Scene(beam).clamp("left"), "fixed-free", 0),
                              (Scene(beam), "free-free", 3)):
        found = scene.modes(skip + 2).frequencies[skip:]
        reference = exact.timoshenko_frequencies(E, I, A, RHO, 1.0, 1e5 * E * A, n=2, ends=ends)
        np.testing.assert_allclose(found, reference, rtol=tol)
    found = Scene(without_rotary_inertia()).clamp("left").modes(2).frequencies
    euler = exact.euler_bernoulli_frequencies(E, I, A, RHO, 1.0, n=2)
    np.testing.assert_allclose(found, euler, rtol=1e-6)


def test_soft_pendulum_in_time():
    history = Scene(without_rotary_inertia()).pin("left").gravity((0, -9.81)).integrate(
        t_end=0.5, dt=2.5e-4, t_eval=[0.25, 0.5])
    tip = history.displacement((1, 0))
    np.testing.assert_allclose(tip, [[-0.100646, -0.308569], [-1.189393, -0.956101]], atol=2e-5)


# large strain: the strain is that of the place, the stress the one whose resultants are N and M


SOFT, STIFF = (StVenantKirchhoff(e, nu, thermal_expansion=a)
               for e, nu, a in ((1e6, 0.3, 1e-3), (4e6, 0.1, 2e-3)))


def arc(n=8, h=0.1):
    return MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1.0 - np.cos(s)]),
                               np.linspace(0.0, 1.0, n + 1), h)


LAYERS = Section.layers((0.04, SOFT), (0.06, STIFF), width=0.02)


@pytest.mark.parametrize("recover", [True, False])
@pytest.mark.parametrize("mesh, section, heated, degree", [
    ("line", None, False, 5), ("line", None, False, 3), ("line", LAYERS, False, 5),
    ("arc", None, False, 5), ("arc", LAYERS, False, 7), ("line", None, True, 5),
    ("line", LAYERS, True, 5)])
def test_strain_is_that_of_the_place_and_stress_that_of_the_resultants(
        mesh, section, heated, degree, recover):
    """Pulled by a tenth of EA and bent: fibres measured by positions of their points."""
    mesh = {"line": line(8 if degree > 3 else 16, 0.1), "arc": arc(16)}[mesh]
    beam = Beam(mesh, ElementBeamCable(degree), None if section else SOFT,
                None if section else 0.02, section=section)
    scene = Scene(beam).clamp("left").point_force((200.0, 0.0), at="right").moment("right", 3.0)
    if heated:
        scene = scene.temperature(lambda x, y: 50.0 + 500.0 * y)
    state, e, xi, d = scene.solve_static(), mesh.nelements // 2, 0.3, 1e-4

    def at(xi, eta):
        return beam.mesh.mapping().F(np.array([[xi], [eta]])[..., None], np.array([e]))[:, 0, 0]

    x, w = np.polynomial.legendre.leggauss(5)
    eta = np.concatenate([0.2 + 0.2 * x, 0.7 + 0.3 * x])  # of both layers
    points = np.array([at(xi, z) for z in eta]).T
    green = state.strain(points, recover=recover)[0]
    ends = [np.array([at(xi + s * d, z) for z in eta]).T for s in (-1, 1)]
    stretch = np.hypot(*(state.position(ends[1]) - state.position(ends[0]))) / np.hypot(
        *(ends[1] - ends[0]))
    size = np.max(np.abs(green))
    # recovered fields of arcs are those of a body that is as thick as it is
    tol = 1e-8 if mesh.is_straight and not recover else 6e-2 if recover and not mesh.is_straight \
        else 1e-2
    np.testing.assert_allclose(green, 0.5 * (stretch**2 - 1), rtol=0, atol=tol * size)
    S = state.stress(points, recover=recover)[0]
    P = np.sqrt(1 + 2 * green) * S * 0.02 * 0.1 * np.concatenate([0.2 * w, 0.3 * w])
    r = state.resultants(at(xi, 0.5), recover=recover)
    Y = 0.1 * (eta - 0.5)
    tol = 2e-3 if recover else 1e-8
    assert np.sum(P) == pytest.approx(r.N, rel=tol)
    assert -np.sum(P * Y) == pytest.approx(r.M, abs=tol * 0.1 * r.N)
    own = state.resultants(at(xi, 0.5), recover=False)
    np.testing.assert_allclose([r.stretch, r.curvature], [own.stretch, own.curvature], atol=1e-3)


def test_pressure_on_an_end_of_a_cable_is_refused():
    """Its position does not depend on Y there, so the force would be zero without a word."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.1), ElementBeamCable(3),
                StVenantKirchhoff(1e6, 0.3), 0.1)
    scene = Scene(beam).clamp("left")
    for place in ("right", lambda x: x[0] > -1):
        with pytest.raises(InputError, match="of a cable has no effect"):
            scene.pressure(place, 25.0)
    assert not scene.loads
    total = scene.pressure("top", 25.0).loads[0].force(np.zeros(beam.N)).reshape(-1, 2, 2)[:, 0]
    assert np.allclose(total.sum(axis=0), (0.0, -2.5))


@pytest.mark.parametrize("place, sign", [("top", 1.0), ("bottom", -1.0)])
def test_pressure_on_a_curved_cable_acts_on_its_axis(place, sign):
    """The resultant is that of the chord of the axis; the face is longer or shorter."""
    mesh = wave(h=0.2)
    beam = Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(1e6, 0.3), 0.1)
    load = Scene(beam).clamp("left").pressure(place, 25.0).loads[0]
    x, y = mesh.p[:, -1] - mesh.p[:, 0]
    total = load.force(np.zeros(beam.N)).reshape(-1, 2, 2)[:, 0].sum(axis=0)
    np.testing.assert_allclose(total, sign * 2.5 * np.array([y, -x]), rtol=1e-12)


# ropes with a force at a point


def wire(x, element, h=1e-4, EA=1e3, **options):
    return Beam(MeshBeam.init_line(x, h, **options), element,
                StVenantKirchhoff(EA / (h * 1e-3), 0.0), 1e-3)


def rope(element, n, at):
    """Pinned at both ends, which have come closer by a tenth, and pulled down at a point."""
    scene = Scene(wire(np.linspace(0.0, 1.0, n + 1), element)).pin("left").fix("right", "r^2").fix(
        "right", "r^1", displacement=-0.1)
    return scene.line_load((0.0, -1e-3)).point_force((0.0, -2.0), at=(at, 0.0))


def sag(at, EA=1e3, force=2.0, length=1.0, span=0.9):
    """Of the point of a rope of two straight parts."""
    def balance(z):
        (x, y), parts = z, []
        for dx, l0 in ((x, at), (span - x, length - at)):
            long = np.hypot(dx, y)
            parts.append(EA * (long / l0 - 1.0) / long)
        return [parts[0] * x - parts[1] * (span - x), (parts[0] + parts[1]) * y - force]

    return fsolve(balance, [at * span, 0.2])[1]


@pytest.mark.parametrize("degree, n, at", [(5, 20, 0.5), (5, 60, 0.5), (7, 20, 0.5), (5, 20, 0.341),
                                           (3, 20, 0.341)])
def test_a_force_inside_a_rope_that_its_elements_cannot_follow_is_said(degree, n, at):
    scene = rope(ElementBeamCable(degree), n, at)
    with pytest.warns(ModelWarning, match="bends its axis by 0.* rad within"):
        state = scene.solve_static(method="newton")
    off = -state.displacement((at, 0.0))[1] / sag(at) - 1
    assert 1e-3 < abs(off) < 0.2


def test_what_is_said_of_a_kink_helps():
    """A hinge at the point, or a cubic cable with a node there: no warning, and right."""
    state = rope(ElementBeamCable(3), 20, 0.5).solve_static(method="newton")
    assert -state.displacement((0.5, 0.0))[1] == pytest.approx(sag(0.5), rel=5e-4)
    at, x = 0.341, np.linspace(0.0, 1.0, 7)
    place = np.array([0.45 + (at**2 - (1 - at)**2) / 1.8, 0.0])  # of two straight parts
    place[1] = -np.sqrt(at**2 - place[0]**2)
    parts = [wire(at * x, ElementBeamCable(5), angle=np.arctan2(place[1], place[0])),
             wire((1 - at) * x, ElementBeamCable(5), origin=tuple(place),
                  angle=np.arctan2(-place[1], 0.9 - place[0]))]
    scene = Scene(*parts).pin("left", beam=0).pin("right", beam=1)
    scene.hinge(place)
    state = scene.point_force((0.0, -2.0), at=place, beam=0).solve_static(method="newton")
    assert -state.position(place, 0)[1] == pytest.approx(sag(at), rel=5e-4)


# tractions

HARD = StVenantKirchhoff(2e9, 0.3, 7800.0)


def bend(x):
    return np.array([50.0 * x[1], 0.0 * x[1]])


@pytest.mark.parametrize("place, t, moment", [("top", (3.0, 0.0), 3.0 * 0.02 * 0.05),
                                              ("right", bend, 50.0 * 0.02 * 0.1**3 / 12)])
def test_a_moment_that_a_cable_does_not_take_from_a_traction_is_said(place, t, moment):
    """Its axis was not bent at all; sections bend by that moment."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.1)
    scene = Scene(Beam(mesh, ElementBeamCable(5), HARD, 0.02)).clamp("left")
    with pytest.warns(ModelWarning, match=f"leaves out a moment of {moment:.3g} "):
        scene.traction(place, t)
    state = scene.solve_static()
    assert state.reactions("left").moment == pytest.approx(0.0, abs=1e-9 * moment)
    scene = Scene(Beam(mesh, ElementBeamANCF(2), HARD, 0.02)).clamp("left").traction(place, t)
    assert abs(scene.solve_static().reactions("left").moment) == pytest.approx(moment, rel=1e-5)


@pytest.mark.parametrize("section", [dict(width=0.02), dict(section=Section.profile(
    "I", width=0.06, web=0.01, flange=0.015))], ids=["plain", "I"])
@pytest.mark.parametrize("place, t", [("top", (0.0, -1.0)), ("right", (5.0, 1.0)),
                                      (("left", "right"), (5.0, 0.0))])
def test_tractions_that_a_cable_takes_whole(place, t, section):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.1)
    Traction(place, t).bind(Beam(mesh, ElementBeamCable(5), HARD, **section))


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, np.pi, 0.3])
@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)])
def test_a_clamp_with_a_free_thickness_at_any_angle(element, angle):
    """Along an axis it fixes degrees of freedom, else it is a joint: force and moment balance."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.1, angle=angle)
    along = np.array([np.cos(angle), np.sin(angle)])
    P = 20.0 * np.array([-along[1], along[0]])
    scene = Scene(Beam(mesh, element, HARD, 0.02)).clamp("left", thickness="free")
    state = scene.point_force(P, at=tuple(along)).solve_static()
    assert len(scene.joints) == (angle == 0.3)
    found, x = state.reactions("left"), along + state.displacement(tuple(along))
    np.testing.assert_allclose(found.force, -P, atol=1e-8)
    assert found.moment == pytest.approx(-(x[0] * P[1] - x[1] * P[0]), rel=1e-8)


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCF(2)],
                         ids=repr)
@pytest.mark.parametrize("curved", [False, True])
def test_what_an_iteration_has_seen_is_within_the_range(element, curved):
    """By the numbers that warnings ask: turn and folds of an axis, stretch of outer fibres."""
    line = np.linspace(0, 1, 7)
    mesh = MeshBeam.init_line(line, 0.05) if not curved else MeshBeam.init_curve(
        lambda s: np.array([np.sin(s), 1 - np.cos(s)]), line, 0.05)
    beam = Beam(mesh, element, StVenantKirchhoff(1e6, 0.3), width=0.1)
    plain, found = Scene(beam, beam.replace(name="other")).system.backend.tables.plain, set()
    rng, n = np.random.default_rng(3), beam.N
    for size in np.repeat([1e-4, 1e-3, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0], 30):
        u = np.zeros(2 * n)
        u[n:] = size * rng.standard_normal(n) * beam.sizes
        seen = examine(plain, u, np.zeros(stress_size(plain.body)))
        turn, folded = bent(beam, u[n:])
        assert (seen >= AXES) == (turn <= 1.0 and not folded)
        if seen == RANGE:
            assert shortest(beam, u[n:]) > 0.0
        found.add(seen)
    certain = not (beam.has_sections or curved)
    assert found == ({UNSEEN, AXES, RANGE} if certain else {UNSEEN, AXES})


@pytest.mark.parametrize("n, turn, text", [
    (40, 12.0, "overlap"), (8, 9.0, "too coarse.*turns by 1.1"), (8, 7.0, "")])
def test_bending_beyond_the_range_is_told(n, turn, text, recwarn):
    """Sections of height 0.2 overlap from the curvature 10 on, and 1 rad an element is too far."""
    rod = Beam(line(n, 0.2), ElementBeamCable(3), StVenantKirchhoff(E, NU), width=B)
    state = Scene(rod).clamp("left").moment("right", turn * E * B * 0.2**3 / 12.0).solve_static()
    assert state.checks.turning == pytest.approx(turn / n, rel=3e-3)
    found = [str(w.message) for w in recwarn if issubclass(w.category, ModelWarning)]
    assert len(found) == bool(text) and all(re.search(text, one) for one in found)
