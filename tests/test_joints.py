"""Joints: derivatives, statics, mechanisms, conservation over long runs, and what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid

from elbow import between, joint_examples
from skfem_ancf import (Beam, ElementBeamANCFCubic, ElementBeamCable, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.actions.joints import JOINTS
from skfem_ancf.core.errors import InputError, ModelWarning, NameUnknown, SupportError

E, NU, RHO = 1e6, 0.3, 1000.0
GRAVITY = (0.0, -9.81)


def elbow(**options):
    """Two beams that meet at a corner, of different order, height and width."""
    return (between((0, 0), (1, 0), 2, 1, name="arm", **options),
            between((1, 0), (1.4, 0.9), 3, 3, h=0.15, width=0.07, name="forearm", **options))


CASES = joint_examples()
#: Joints whose equations are not quadratic in the coordinates, and a step of differences for them.
CURVED, STEP = (JOINTS["sleeve"],), 1e-4


def test_every_joint_has_a_case():
    assert set(CASES) == set(JOINTS)


@pytest.fixture(params=JOINTS)
def joint(request):
    scene = Scene(*elbow())
    return scene.joint(request.param, **CASES[request.param]), scene


def test_value_is_zero_at_the_start(joint):
    joint, scene = joint
    assert np.abs(joint.value(np.zeros(scene.layout.N), 0.0)).max() < 1e-14
    assert joint.value(np.zeros(scene.layout.N), 0.0).shape == (len(joint.equations),)


def test_jacobian_is_the_derivative(joint):
    joint, scene = joint
    rng = np.random.default_rng(0)
    u, v, t = 0.3 * rng.standard_normal(scene.layout.N), rng.standard_normal(scene.layout.N), 0.7
    h, tol = 1.0, 1e-12  # Phi is quadratic at most: central differences are exact
    if type(joint) in CURVED:
        u, h, tol = 0.03 * u, STEP, 1e-5
    along = 0.5 / h * (joint.value(u + h * v, t) - joint.value(u - h * v, t))
    assert np.allclose(joint.jacobian(u, t) @ v, along, rtol=0, atol=tol)
    assert np.linalg.matrix_rank(joint.jacobian(u, t)) == len(joint.equations)


def test_curvature_is_the_derivative_of_the_jacobian(joint):
    joint, scene = joint
    rng = np.random.default_rng(1)
    u, v, t = 0.3 * rng.standard_normal(scene.layout.N), rng.standard_normal(scene.layout.N), 0.7
    multipliers = rng.standard_normal(len(joint.equations))
    h, tol = 1.0, 1e-12
    if type(joint) in CURVED:
        u, h, tol = 0.03 * u, STEP, 1e-4
    along = 0.5 / h * multipliers @ (joint.jacobian(u + h * v, t) - joint.jacobian(u - h * v, t))
    second = joint.curvature(u, t, multipliers)
    C = np.zeros((scene.layout.N, scene.layout.N))
    if second is not None:
        np.add.at(C, (second[0], second[1]), second[2])
    assert np.allclose(C, C.T, rtol=0, atol=1e-14)
    assert np.allclose(C @ v, along, rtol=0, atol=tol)
    assert joint.constant == (not np.any(joint.jacobian(u + v, t + 0.1) - joint.jacobian(u, t)))
    assert joint.moving == bool(np.any(joint.value(u, t + 0.1) - joint.value(u, t)))


# conservation and drift

FORCED = ("position", "angle", "turn")


@pytest.mark.parametrize("name", [n for n in JOINTS if n not in FORCED])
def test_energy_momentum_with_every_joint(name):
    """Energy to round-off, and the joint met in position and in velocity."""
    scene = Scene(*elbow()).gravity(GRAVITY)
    joint = scene.joint(name, **CASES[name])
    for beam in scene.beams:
        scene.initial_velocity(lambda x: np.array([1 - 2 * x[1], 2 * x[0]]), beam=beam)
    history = scene.integrate(0.4, 0.01)
    assert history.strain_energy.max() > 1e-2
    assert np.ptp(history.total_energy) < 1e-10
    for k in range(len(history)):
        J = joint.jacobian(history.u[k], 0.0)
        assert np.abs(joint.value(history.u[k], 0.0)).max() < 1e-13
        assert np.abs(J @ history.v[k]).max() < 1e-12


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_a_driven_joint_is_met_in_position_and_velocity(scheme):
    beam = between((0, 0), (1, 0), 2, 2)
    scene = Scene(beam).pin("left")
    joint = scene.joint("angle", at="left", angle=lambda t: np.sin(2 * t))
    history = scene.integrate(1.0, 5e-3, scheme=scheme)
    for k in range(0, len(history), 20):
        t, u, v = history.t[k], history.u[k], history.v[k]
        assert abs(joint.value(u, t)[0]) < 1e-13
        turned = joint.jacobian(u, t) @ v
        # d/dt (e(t) x d) = J v - 2 cos(2 t) e . d
        a = joint.start + np.sin(2 * t)
        rate = turned[0] - 2 * np.cos(2 * t) * (np.array([np.cos(a), np.sin(a)]) @ joint.d(u))
        assert abs(rate) < 1e-9  # the motion's rate is a difference of fourth order


# statics


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_two_welded_beams_are_one(angle):
    """Cut in the middle and welded: the same deflection and the same frequencies."""
    d = np.array([np.cos(angle), np.sin(angle)])
    load = 0.3 * np.array([-d[1], d[0]])
    whole = Scene(between((0, 0), 2 * d, 4)).clamp("left").point_force(load, 2 * d)
    a, b = between((0, 0), d, 2), between(d, 2 * d, 2)
    cut = Scene(a, b).clamp("left", beam=a).point_force(load, 2 * d, beam=b)
    joint = cut.joint("weld", beams=(a, b), at=("right", "left"))
    one, two = whole.solve_static(), cut.solve_static()
    tip = one.displacement(2 * d)
    assert np.hypot(*tip) > 0.05
    # the weld leaves r_X free on both sides and the face free to warp
    assert np.abs(two.displacement(2 * d, beam=b) - tip).max() < 2e-3 * np.hypot(*tip)
    force = two.joint_force(joint)
    # on the first beam acts the load, and the moment of it about the weld
    arm = two.position(2 * d, beam=b) - two.position(d, beam=b)
    assert np.allclose(force[:2], load, rtol=1e-8)
    assert force[2] == pytest.approx(arm[0] * load[1] - arm[1] * load[0], rel=1e-2)
    f1, f2 = whole.modes(4).frequencies, cut.modes(4).frequencies
    assert np.allclose(f1[:2], f2[:2], rtol=1e-3)
    assert np.allclose(f1, f2, rtol=0.02)


@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_roller(tilt):
    """A beam under its weight on a pin and a roller: half the weight each, if the roller is flat.

    On a tilted guide the roller pushes along the normal, and the pin takes the rest.
    """
    beam = between((0, 0), (1, 0), 2, E=1e8)
    scene = Scene(beam).pin("left").gravity(GRAVITY)
    joint = scene.joint("line", at=(1, 0), direction=(np.cos(tilt), np.sin(tilt)))
    assert scene.system.constraints.m == (0 if tilt == 0 else 1)  # along x it only fixes r^2
    state = scene.solve_static()
    W = beam.total_mass * 9.81
    N = W / 2 / np.cos(tilt)
    assert state.joint_force(joint)[0] == pytest.approx(N, rel=1e-3)
    push = N * np.array([-np.sin(tilt), np.cos(tilt)])
    assert np.allclose(state.reactions("left").force, [-push[0], W - push[1]], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("at, m", [((1, 0), 0), ((0.6, 0.02), 2)])
def test_prescribed_position_in_statics(at, m):
    """Time is the load factor; where only coordinates are fixed no multiplier is spent."""
    beam = between((0, 0), (1, 0), 2)
    scene = Scene(beam).clamp("left")
    end = np.array(at) + [-0.1, 0.3]
    joint = scene.joint("position", at=at, r=lambda t: np.array(at) + t * np.array([-0.1, 0.3]))
    assert scene.system.constraints.m == m
    state = scene.solve_static()
    assert np.allclose(state.position(at), end, rtol=0, atol=1e-12)
    # the force is what would move the point there
    other = Scene(beam).clamp("left").point_force(state.joint_force(joint), at).solve_static(
        stable=False)
    assert np.allclose(other.position(at), end, rtol=0, atol=1e-7)
    root = state.reactions("left").force
    assert np.allclose(root, -state.joint_force(joint), rtol=1e-7)


def test_prescribed_angle_in_statics():
    """Both ends pinned so that one may slide, one turned: M = 3 EI / L times the angle."""
    h, turn = 0.02, 1e-3
    beam = between((0, 0), (1, 0), 8, h=h, nu=0.0)
    scene = Scene(beam).pin("left").fix("right", "r^2")
    joint = scene.joint("angle", at="left", angle=lambda t: turn * t)
    state = scene.solve_static()
    EI = E * h**3 * 0.1 / 12
    assert state.joint_force(joint)[0] == pytest.approx(3 * EI * turn, rel=5e-3)
    # a large turn of a free end needs no force
    free = Scene(beam).pin("left")
    joint = free.joint("angle", at="left", angle=lambda t: 1.2 * t)
    state = free.solve_static(first_step=0.25)
    assert np.allclose(state.position((1, 0)), [np.cos(1.2), np.sin(1.2)], atol=1e-6)
    assert abs(state.joint_force(joint)[0]) < 1e-6 * EI


# mechanisms


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_four_bar_mechanism(scheme):
    """A crank that turns steadily; the coupler's end follows the geometry of rigid bars."""
    ground, crank, coupler, rocker, omega = 2.0, 0.5, 1.8, 1.2, 2.0

    def joint_of(angle):
        """Where the coupler meets the rocker: the intersection of two circles, the upper one."""
        A, D = crank * np.array([np.cos(angle), np.sin(angle)]), np.array([ground, 0.0])
        d = D - A
        r = np.hypot(*d)
        x = (coupler**2 - rocker**2 + r**2) / (2 * r)
        y = np.sqrt(coupler**2 - x**2)
        return A, A + (x * d + y * np.array([-d[1], d[0]])) / r

    A, B = joint_of(0.0)
    options = dict(E=1e11, h=0.04, width=0.04, ne=1, order=1, nu=0.0)
    bars = [between((0, 0), A, name="crank", **options),
            between(A, B, name="coupler", **{**options, "order": 2}),
            between((ground, 0), B, name="rocker", **{**options, "h": 0.06})]
    scene = Scene(bars).pin("left", beam="crank").pin("left", beam="rocker")
    scene.joint("hinge", beams=("crank", "coupler"), at=A)
    scene.joint("hinge", beams=("coupler", "rocker"), at=B)
    turn = lambda t: omega * t**3 / (1 + t**2)
    drive = scene.joint("angle", beam="crank", at="left", angle=turn)
    history = scene.integrate(1.0, 5e-3, scheme=scheme)
    for k in (50, 100, 150, 200):
        A_t, B_t = joint_of(turn(history.t[k]))
        assert np.abs(history.position(A, beam="crank")[k] - A_t).max() < 1e-4
        assert np.abs(history.position(B, beam="coupler")[k] - B_t).max() < 1e-3
        assert np.abs(history.position(B, beam="rocker")[k]
                      - history.position(B, beam="coupler")[k]).max() < 1e-12
    # the drive's power is the change of energy
    rate = omega * (3 * history.t**2 + history.t**4) / (1 + history.t**2) ** 2
    work = trapezoid(history.joint_force(drive)[:, 0] * rate, history.t)
    assert work == pytest.approx(history.kinetic_energy[-1] + history.strain_energy[-1], rel=0.03)


# equations that repeat others


def repeated(more):
    """The elbow, pinned at its end, with its joint and what repeats that; all joints."""
    a, b = elbow()
    scene = Scene(a, b).clamp("left", beam=a).pin((1.4, 0.9), beam=b)
    scene.point_force((-30.0, -50.0), at=(1.2, 0.45), beam=b)
    if more.startswith("line"):
        held = [scene.joint("line", beam=b, at=(1.2, 0.45), direction=(1, d)) for d in (1, -1)]
        if more == "line, third":
            held.append(scene.joint("line", beam=b, at=(1.2, 0.45), direction=(1, 0.3)))
        scene.joint("hinge", beams=(a, b), at=(1, 0))
    elif more.startswith("weld"):
        held = [scene.joint("weld", beams=(a, b), at=("right", "left"))]
        if more == "weld, hinge":
            held.append(scene.joint("hinge", beams=(a, b), at=(1, 0)))
    else:
        held = [scene.joint("hinge", beams=(a, b), at=(1, 0))]
        for _ in range({"hinge": 0, "hinge, twice": 1, "hinge, three times": 2}.get(more, 0)):
            held.append(scene.joint("hinge", beams=(a, b), at=(1, 0)))
        if more == "hinge, clamp":
            held.append(scene.joint("line", beam=a, at=(0, 0.02), direction=(1, 1)))
    return scene, held


def test_forces_of_repeated_joints_are_the_smallest():
    """Shared evenly by hinges at one place; a line that a clamp holds already has none."""
    scene, held = repeated("hinge, three times")
    with pytest.warns(ModelWarning):
        state = scene.solve_static()
    first, *others = (state.joint_force(joint) for joint in held)
    for force in others:
        assert_allclose(force, first, rtol=0, atol=1e-9)
    scene, (_, line) = repeated("hinge, clamp")
    with pytest.warns(ModelWarning):
        state = scene.solve_static()
    assert abs(state.joint_force(line)[0]) < 1e-12


# what is refused


def test_contradictory_joints():
    a, b = elbow()

    def scene():
        return Scene(a, b).clamp("left", beam=a)

    s = scene()
    s.joint("line", beam=b, at=(1.4, 0.9), direction=(1, 1))
    s.joint("line", beam=b, at=(1.4, 0.9), direction=(1, 1), through=(0, 0), name="guide")
    with pytest.raises(SupportError, match="OnLine guide.*contradicts"):
        s.solve_static()

    s = scene()  # the third of three lines through one point
    s.joint("line", beam=b, at=(1.2, 0.45), direction=(1, 1))
    s.joint("line", beam=b, at=(1.2, 0.45), direction=(1, -1))
    s.joint("line", beam=b, at=(1.2, 0.45), direction=(1, 0.3), through=(1.4, 1.0), name="third")
    with pytest.raises(SupportError, match="OnLine third.*contradicts"):
        s.solve_static()

    s = scene()
    s.joint("line", beam=a, at=(0, 0.02), direction=(1, 1), through=(0, 0.3), name="on the clamp")
    with pytest.raises(SupportError, match="on the clamp.*contradicts what the supports"):
        s.solve_static()

    s = scene()
    s.joint("position", beam=a, at=(0, 0), r=lambda t: (0, t))
    with pytest.raises(SupportError, match="prescribes r\\^1 of node 0 of beam arm.*support"):
        s.solve_static()

    s = scene()
    s.joint("line", beam=b, at=(1.4, 0.9), direction=(1, 0))
    s.joint("position", beam=b, at=(1.4, 0.9), r=lambda t: (1.4, 0.9))
    with pytest.raises(SupportError, match="r\\^2 of node 3 of beam forearm"):
        s.solve_static()


def test_free_mechanism_is_named():
    a, b = elbow()
    scene = Scene(a, b).clamp("left", beam=a)
    scene.joint("hinge", beams=(a, b), at=(1, 0))
    with pytest.raises(SupportError, match=r"rotation about \(1, 0\) of beam forearm"):
        scene.solve_static()


@pytest.mark.parametrize("call, error, message", [
    (lambda s: s.joint("glue"), NameUnknown, "'glue'; known: 'hinge', 'weld'"),
    (lambda s: s.joint("hinge", beams=("arm", "leg"), at=(1, 0)), NameUnknown, "'leg'"),
    (lambda s: s.joint("hinge", beams=("arm", "forearm"), at=(5, 5)), InputError, "5"),
    (lambda s: s.joint("hinge", beams=("arm", "forearm"), at=None), InputError, "at="),
    (lambda s: s.joint("weld", beams=("arm", "forearm"), at=("right", "top")), InputError, "top"),
    (lambda s: s.joint("line", at=(1, 0), direction=(1, 0)), InputError, "choose one"),
    (lambda s: s.joint("line", beam="arm", at=(1, 0), direction=(0, 0)), InputError, "direction"),
    (lambda s: s.joint("circle", beam="arm", at=(1, 0), center=(1, 0)), InputError, "positive"),
    (lambda s: s.joint("circle", beam="arm", at=(1, 0), center=(0, 0), radius=-1.0), InputError,
     "radius"),
])
def test_bad_inputs(call, error, message):
    with pytest.raises(error, match=message):
        call(Scene(*elbow()))


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamCable(9),
                                     ElementBeamANCFCubic(3)])
def test_points_inside_elements_are_held_in_any_unit(element):
    """A prop, a spring and a torsional spring inside an element, of beams of 10 nm to 1000 km."""
    def tips(L):
        beam = Beam(MeshBeam.init_line(np.linspace(0, L, 8), 0.02 * L), element,
                    StVenantKirchhoff(2e9, 0.0), 0.02 * L)
        out = []
        for hold in (lambda s: s.hinge((beam, (0.3 * L, 0)), ("ground", (0.3 * L, 0))),
                     lambda s: s.spring(2e3 * L, ((0.3 * L, 0), ("ground", (0.3 * L, 0.5 * L)))),
                     lambda s: s.torsional_spring(2e3 * L**3, at=(0.3 * L, 0))):
            scene = Scene(beam).clamp("left", thickness="free")
            hold(scene)
            scene.point_force((0, -0.02 * L**2), at=(L, 0))
            out.append(scene.solve_static().displacement((L, 0))[1] / L)
        return np.array(out)

    one, stiffness = tips(1.0), 2e9 * 0.02**4 / 12
    assert one[0] == pytest.approx(-0.02 * 0.7**2 * (0.3 / 4 + 0.7 / 3) / stiffness, rel=0.05)
    for L in (1e-8, 1e-3, 1e6):
        assert np.allclose(tips(L) / one, 1.0, rtol=0, atol=1e-10)


@pytest.mark.parametrize("angle", [np.pi / 2, 2.0, -0.8])
def test_frame_against_slope_deflection(angle):
    """A column with a rigid corner and a beam off it, loaded across the beam's end.

    Small deflections: the beam's tip moves across by P L^3 / (3 EI) + (corner rotation) L, the
    corner turns by P L H / (EI) plus the column's own share.
    """
    H, L, h, P = 1.0, 0.8, 0.02, 1e-5
    EI = E * h**3 * 0.1 / 12
    # at the corner the column ends in the direction (0, 1); the beam leaves at `angle` to it
    d = np.array([-np.sin(angle), np.cos(angle)])
    n = np.array([-d[1], d[0]])
    corner = np.array([0.0, H])
    a = between((0, 0), corner, 4, h=h, nu=0.0)
    b = between(corner, corner + L * d, 4, h=h, nu=0.0)
    scene = Scene(a, b).clamp("left", beam=a).point_force(P * n, corner + L * d, beam=b)
    scene.joint("weld", beams=(a, b), at=("right", "left"))
    state = scene.solve_static()
    # column under an end force across it, Q = P n . (-1, 0), and an end moment P L
    Q, M = -P * n[0], P * L
    turn = Q * H**2 / (2 * EI) + M * H / EI
    sway = Q * H**3 / (3 * EI) + M * H**2 / (2 * EI)
    tip = np.array([-sway, 0.0]) + n * (turn * L + P * L**3 / (3 * EI))
    found = state.displacement(corner + L * d, beam=b)
    assert np.abs(found - tip).max() < 0.01 * np.hypot(*tip)
    assert np.hypot(*tip) < 0.01


def test_hinge_reactions_of_a_three_hinged_arch():
    """Two bars that meet at the top: the thrust of a load there is P / (2 tan a)."""
    P, a = 0.1, 0.6
    top = np.array([np.cos(a), np.sin(a)])
    left = between((0, 0), top, 1, E=1e8, name="left")
    right = between((2 * top[0], 0), top, 1, E=1e8, name="right")
    scene = Scene(left, right).pin("left", beam="left").pin("left", beam="right")
    hinge = scene.joint("hinge", beams=(left, right), at=top)
    scene.point_force((0, -P), top, beam=left)
    state = scene.solve_static()
    thrust = P / (2 * np.tan(a))
    assert np.allclose(state.joint_force(hinge), [-thrust, P / 2], rtol=1e-4)
    assert np.allclose(state.reactions("left", beam="left").force, [thrust, P / 2], rtol=1e-4)
    assert np.allclose(state.reactions("left", beam="right").force, [-thrust, P / 2], rtol=1e-4)
