"""Linear models: receptances, state spaces, prescribed inputs, rotation, random loads."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, KelvinVoigt, MeshBeam,
                        Motor, NameUnknown, PointForce, RigidBody, RotatingFrame, Scene,
                        StVenantKirchhoff, SupportError, Temperature, Weight)

E, RHO, H, B = 2e8, 7800.0, 0.01, 0.01
EI, RA, RI = E * B * H**3 / 12, RHO * B * H, RHO * B * H**3 / 12
OMEGA = np.array([0.0, 1.0, 2.5, 11.0, 40.0])


def strip(n=12, start=0.0, end=1.0, name=None, **options):
    mesh = MeshBeam.init_line(np.linspace(start, end, n + 1), H)
    return Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(E, 0.3, RHO), width=B, name=name,
                **options)


def cantilever(**options):
    return Scene(strip(**options)).clamp("left").sensor("tip", "displacement", at=(1, 0))


def receptance(omega, retardation=0.0, mass=0.0):
    """Deflection of the tip of a cantilever by a unit force there: Rayleigh's beam, damped."""
    stiff, inertia = EI * (1 + 1j * omega * retardation), omega**2 - 1j * omega * mass
    if omega == 0.0:
        return 1.0 / (3 * EI)
    # EI w'''' + rho I (...) w'' - rho A (...) w = 0
    k = np.roots([stiff, 0, RI * inertia, 0, -RA * inertia])
    rows = [k**0, k, k**2 * np.exp(k), (stiff * k**3 + RI * inertia * k) * np.exp(k)]
    return np.linalg.solve(np.array(rows), [0, 0, 0, -1.0]) @ np.exp(k)


@pytest.mark.parametrize("retardation, mass", [(0.0, 0.0), (1e-3, 0.0), (2e-3, 0.3)])
def test_receptance_of_a_cantilever(retardation, mass):
    scene = cantilever().damping(mass=mass, stiffness=retardation)
    found = scene.frequency_response(OMEGA, [PointForce((0, 1), at=(1, 0))]).of("tip 1")
    exact = np.array([receptance(w, retardation, mass) for w in OMEGA])
    assert np.allclose(found, exact, rtol=1e-6, atol=0.0)


def test_state_space_has_the_same_response():
    scene = cantilever(damping=KelvinVoigt(1e-3)).sensor("v", "velocity", at=(1, 0))
    scene.sensor("a", "acceleration", at=(1, 0)).sensor("M", "M", at=(0.5, 0))
    model = scene.linearize(None, [PointForce((0, 1), at=(1, 0)), Weight((0, 1))])
    response = model.frequency_response(OMEGA[1:])
    A, B_, C, D, _ = model.state_space()
    for w, H_ in zip(OMEGA[1:], response.values):
        assert np.allclose(C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B_) + D, H_,
                           rtol=1e-5, atol=1e-5 * np.abs(H_).max(axis=1, keepdims=True))
    tip, v, a = (response.of(f"{name} 1") for name in ("tip", "v", "a"))
    assert np.allclose(v, 1j * OMEGA[1:] * tip) and np.allclose(a, -OMEGA[1:]**2 * tip)


def test_static_response_is_that_of_solve_linear():
    scene = cantilever().sensor("M", "M", at=(0.5, 0)).sensor("S", "stress", at=(0.3, 0.004))
    found = scene.frequency_response([0.0], {"F": PointForce((0, 2), at=(1, 0))})
    state = cantilever().point_force((0, 2), at=(1, 0)).solve_linear()
    assert found.inputs == ("F",)
    assert np.allclose(found.of("tip 1", "F"), state.displacement((1, 0))[1], rtol=1e-8)
    assert np.allclose(found.of("M"), 1.0, rtol=1e-6)  # F (L - x)
    assert np.allclose(found.of("S 0"), state.stress((0.3, 0.004), recover=False)[0], rtol=1e-7)


def test_modes_with_the_static_response_of_the_others():
    model = cantilever(damping=KelvinVoigt(1e-3)).linearize(None, [PointForce((0, 1), at=(1, 0))])
    exact, left = model.frequency_response([0.0, 8.0]), []
    for k in (2, 4, 8):
        A, B_, C, D, _ = model.state_space(modes=k)
        assert A.shape == (2 * k, 2 * k)
        found = [C @ np.linalg.solve(1j * w * np.eye(2 * k) - A, B_) + D for w in (1e-9, 8.0)]
        assert np.allclose(found[0][1], exact.values[0, 1], rtol=1e-6)
        left.append(np.abs(found[1][1] / exact.values[1, 1] - 1)[0])
    assert left[0] < 0.05 and left[1] < 0.2 * left[0] and left[2] < 0.2 * left[1]


def test_frequency_response_by_modes():
    """Beside the closed form, with damping; a moment beside the direct one."""
    scene = cantilever().damping(mass=0.3, stiffness=2e-3).sensor("M", "M", at=(0.1, 0))
    load, omega = [PointForce((0, 1), at=(1, 0))], OMEGA[:4]
    exact = np.array([receptance(w, 2e-3, 0.3) for w in omega])
    found = scene.frequency_response(omega, load, modes=10)
    assert np.allclose(found.of("tip 1"), exact, rtol=1e-4, atol=0.0)
    direct = scene.frequency_response(omega, load)
    assert found.inputs == direct.inputs and found.outputs == direct.outputs
    assert np.allclose(found.of("M"), direct.of("M"), rtol=3e-3)


def test_joints_are_eliminated():
    a, b = strip(6, 0.0, 0.5, "a"), strip(6, 0.5, 1.0, "b")
    scene = Scene(a, b).clamp("left", a).sensor("tip", "displacement", at=(1, 0), beam=b)
    weld = scene.weld(("a", "right"), ("b", "left"))
    scene.damping(stiffness=1e-3).sensor("joint", "joint_force", weld)
    F = PointForce((0, 1), at=(1, 0), beam="b")
    response = scene.frequency_response(OMEGA, [F])
    exact = np.array([receptance(w, 1e-3) for w in OMEGA])
    assert np.allclose(response.of("tip 1"), exact, rtol=1e-6)
    assert np.allclose(np.abs(response.amplitude[0, 2:, 0]), [0.0, 1.0, 0.5], atol=1e-6)
    A, B_, C, D, _ = scene.linearize(None, [F], ["tip"]).state_space()
    found = C @ np.linalg.solve(11j * np.eye(len(A)) - A, B_) + D
    assert np.isclose(found[1, 0], receptance(11.0, 1e-3), rtol=1e-5)
    with pytest.raises(InputError, match="force of a joint"):
        scene.linearize(None, [F]).state_space()


def test_column_near_its_euler_load():
    """Deflection by a small force across under an axial load P: (tan kL - kL) / (k P)."""
    h = 1e-3
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 13), h), ElementBeamCable(5),
                StVenantKirchhoff(E, 0.3, RHO), width=B)
    stiff = E * B * h**3 / 12
    P = 0.9 * stiff * np.pi**2 / 4
    scene = Scene(beam).clamp("left").point_force((-P, 0), at=(1, 0))
    scene.sensor("tip", "displacement", at=(1, 0))
    model = scene.linearize(scene.solve_static(), [PointForce((0, 1), at=(1, 0))])
    k = np.sqrt(P / stiff)
    assert np.isclose(model.frequency_response([0.0]).of("tip 1")[0].real,
                      (np.tan(k) - k) / (k * P), rtol=1e-4)


@pytest.mark.parametrize("eliminated", [True, False])
def test_moving_base(eliminated):
    """A base that moves: the response is that to its inertia in the frame of the base."""
    scene = Scene(strip(damping=KelvinVoigt(1e-3))).sensor("tip", "displacement", at=(1, 0))
    shaken = cantilever(damping=KelvinVoigt(1e-3)).frequency_response(OMEGA, [Weight((0, -1))])
    if eliminated:
        scene.fix("left", ["r_X^1", "r_X^2"])
        base = scene.joint("position", at=(0, 0), r=lambda t: (0.0, 0.0))
    else:
        scene.fix("left", ["r^1", "r^2"])  # a ground that carries the beam by an angle only
        base = scene.joint("angle", at="left", angle=lambda t: 0.0)
    found = scene.frequency_response(OMEGA, [base]).of("tip 1", 1 if eliminated else 0)
    if eliminated:
        exact = 1.0 - OMEGA**2 * shaken.of("tip 1")
        assert np.allclose(found, exact, rtol=1e-6)
    model = scene.linearize(None, [base, PointForce((0, 1), at=(1, 0))])
    response = model.frequency_response(OMEGA)
    for space, rtol in ((model.state_space(), 1e-5), (model.state_space(modes=6), 1e-2)):
        for w, H_ in zip(OMEGA, response.values[:, 1]):  # six modes bend, none stretches
            seen = space.C @ np.linalg.solve(1j * w * np.eye(len(space.A)) - space.A, space.B)
            assert np.allclose((seen + space.D)[1], H_, rtol=rtol, atol=1e-12)
    scene.sensor("v", "velocity", at=(1, 0))
    with pytest.raises(InputError, match="prescribed motion"):
        scene.linearize(None, [base]).state_space()
    if not eliminated:
        assert np.isclose(found[0], 1.0)  # L times the angle
        # reciprocity: tip by the angle is minus the moment of the clamp by a force at the tip
        scene.sensor("clamp", "joint_force", base)
        moment = scene.frequency_response(OMEGA, [PointForce((0, 1), at=(1, 0))], ["clamp"])
        assert np.allclose(np.abs(found), np.abs(moment.of("clamp")), rtol=1e-6)


def test_temperature_and_torque_are_inputs():
    beam = strip().replace(material=StVenantKirchhoff(E, 0.3, RHO, thermal_expansion=1e-5))
    scene = Scene(beam).clamp("left").sensor("tip", "displacement", at=(1, 0))
    scene.sensor("axis", "displacement", at=(0.5, 0))
    inputs = {"T": Temperature(10.0), "M": Motor((0, "right"), torque=1.0)}
    found = scene.frequency_response([0.0], inputs)
    assert np.isclose(found.of("axis 0", "T")[0], 0.5e-4, rtol=1e-8)
    assert np.isclose(found.of("tip 1", "M")[0], 1.0 / (2 * EI), rtol=1e-8)


def test_transfer_function_against_a_motion():
    """The tip under a sine, once transients have died."""
    def damped():
        return cantilever(n=6, damping=KelvinVoigt(0.02)).damping(mass=1.5)

    w = 5.0
    H_ = damped().frequency_response([w], [PointForce((0, 1), at=(1, 0))]).of("tip 1")[0]
    period, load = 2 * np.pi / w, 1e-4
    driven = damped().point_force(
        (0, load), at=(1, 0), amplitude=lambda t: np.sin(w * t))
    left = []
    for n in (40, 80):
        history = driven.integrate(20 * period, period / n, t_eval=np.arange(19 * n, 20 * n)
                                   * period / n)
        y = history.displacement((1, 0))[:, 1] / load
        amplitude = 2 * np.mean(y * np.exp(-1j * w * history.t)) * 1j
        left.append(abs(amplitude / H_ - 1))
    assert left[1] < 2e-3 and left[1] < 0.35 * left[0]  # second order


def test_random_load_on_a_mass():
    """White noise of density S on a mass, spring and dashpot: variance pi S / (2 c k)."""
    body = RigidBody(mass=2.0, inertia=1.0, position=(0, 0))
    scene = Scene(body).sensor("x", "displacement", at=body)
    scene.joint("line", at=(0, 0), direction=(1, 0), beam=body)
    scene.joint("angle", beam=body, angle=lambda t: 0.0)
    scene.spring(50.0, (body, ("ground", (-1, 0))), damping=1.5)
    omega = np.linspace(0.0, 100.0, 5001)
    found = scene.frequency_response(omega, [PointForce((1, 0), at=body)], ["x"])
    assert np.allclose(found.rms(0.1), [np.sqrt(np.pi * 0.1 / (2 * 1.5 * 50.0)), 0.0], rtol=1e-3)
    with pytest.raises(InputError, match="density must have the shape"):
        found.rms(np.ones(3))


def test_rms_of_stress_under_a_slow_random_force():
    """White noise far below the first frequency: the static stress times the root of the power."""
    F, h, b, density, slow = 1.0, 0.05, 0.1, 0.3, 0.01
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), h), ElementBeamCable(5),
                StVenantKirchhoff(1e8, 0.0, 1000.0), b)
    scene = Scene(beam).clamp("left").sensor("S", "S_xx", at=(0.25, h / 2))
    omega = np.linspace(0.0, slow * scene.modes(1).frequencies[0], 21)
    found = scene.frequency_response(omega, [PointForce((0, F), at=(1, 0))], ["S"]).rms(density)
    static = F * 0.75 * (h / 2) / (b * h**3 / 12)
    assert np.allclose(found, static * np.sqrt(density * omega[-1]), rtol=1e-3)


def test_body_in_a_rotating_frame():
    """Two frequencies, sqrt(k / m) - Omega and sqrt(k / m) + Omega."""
    body = RigidBody(mass=2.0, inertia=1.0, position=(0, 0))
    scene = Scene(body).add(RotatingFrame(1.3)).sensor("x", "displacement", at=body)
    for place in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        scene.spring(9.0, (body, ("ground", place)))
    scene.joint("angle", beam=body, angle=lambda t: 0.0)
    model = scene.linearize(scene.solve_static(), [PointForce((1, 0), at=body)])
    poles = np.linalg.eigvals(model.state_space().A)
    assert np.allclose(np.sort(poles.imag), np.sort([s * (3.0 + o) for s in (-1, 1)
                                                     for o in (-1.3, 1.3)]), rtol=1e-9)
    history = scene.integrate(0.2, 1e-3, start=scene.solve_static())
    assert np.abs(history.u).max() < 1e-12


def test_ring_that_turns():
    """Bryan (1890): waves of order n run on in a turning ring, 2 n / (n^2 + 1) Omega apart."""
    halves = [Beam(MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                       np.linspace(a, a + np.pi, 17), H), ElementBeamCable(5),
                   StVenantKirchhoff(E, 0.3, RHO), width=B, name=name)
              for name, a in (("a", 0.0), ("b", np.pi))]
    scene = Scene(*halves).add(RotatingFrame(1e-3)).sensor("p", "displacement", (1, 0), beam="a")
    scene.weld(("a", "right"), ("b", "left"))
    scene.weld(("b", "right"), ("a", "left"))
    A = scene.linearize(None, [PointForce((1, 0), at=(1, 0), beam="a")]).state_space().A
    found = np.sort([w for w in np.linalg.eigvals(A).imag if w > 0.3])
    for n, (low, high) in enumerate(found[:6].reshape(3, 2), 2):
        bending = np.sqrt(EI / RA * n**2 * (n**2 - 1)**2 / (n**2 + 1))
        assert np.isclose(0.5 * (low + high), bending, rtol=2e-4)
        assert np.isclose(high - low, 2e-3 * 2 * n / (n**2 + 1), rtol=1e-3)


def test_campbell_diagram_of_a_rotating_beam():
    """Wright, Smith, Thresher, Wang (1982): flapping mu; in the plane omega^2 = mu^2 - Omega^2."""
    unit, scene = np.sqrt(EI / RA), Scene(strip(8)).clamp("left")
    for speed, published in ((0.0, (3.5160, 22.0345)), (2.0, (4.1373, 22.6149)),
                             (6.0, (7.3604, 26.8091)), (12.0, (13.1702, 37.6031))):
        turning = scene if not speed else Scene(strip(8)).clamp("left").add(
            RotatingFrame(speed * unit))
        A = turning.sensor("tip", "displacement", at=(1, 0)).linearize(
            turning.solve_static(), [PointForce((0, 1), at=(1, 0))]).state_space().A
        found = np.sort([w for w in np.linalg.eigvals(A).imag if w > 0.0])[:2] / unit
        assert np.allclose(np.hypot(found, speed), published, rtol=1e-3)


def test_point_masses_feel_a_rotating_frame():
    """A mass at the tip stretches a bar by m Omega^2 L^2 / (E A); it is felt at rest as well."""
    mass, speed = 0.3, 2.0
    for beam in (strip(4), Beam(MeshBeam.init_line(np.linspace(0, 1, 5), H), ElementBeamANCF(2),
                                StVenantKirchhoff(E, 0.0, RHO), width=B)):
        scene = Scene(beam).pin("left").fix("right", "r^2").add(RotatingFrame(speed))
        alone = scene.solve_static().displacement((1, 0))[0]
        scene.point_mass(mass, at=(1, 0))
        tip = scene.solve_static().displacement((1, 0))[0] - alone
        assert np.isclose(tip, mass * speed**2 / (E * B * H), rtol=1e-3)
        assert np.isclose(scene.solve_static().displacement((1, 0))[0] - alone, tip, rtol=1e-12)


def test_steady_rotation_stretches_and_stays():
    for beam in (strip(4), Beam(MeshBeam.init_line(np.linspace(0, 1, 5), H), ElementBeamANCF(2),
                                StVenantKirchhoff(E, 0.0, RHO), width=B)):
        scene = Scene(beam).pin("left").fix("right", "r^2").add(RotatingFrame(2.0))
        state = scene.solve_static()
        assert np.isclose(state.displacement((1, 0))[0], RHO * 4 / (3 * E), rtol=1e-3)
        history = scene.integrate(0.5, 0.02, start=state)
        assert np.allclose(history.u, state.u, atol=1e-12)


def test_frame_of_reference_does_not_change_a_motion():
    """A free beam flies straight; a frame that turns sees the same motion turned."""
    speed, t_end = 1.5, 0.4
    free = Scene(strip(4)).initial_velocity((0.3, 0.1))
    turning = Scene(strip(4)).add(RotatingFrame(speed)).initial_velocity(
        lambda x: np.array([0.3 + speed * x[1], 0.1 - speed * x[0]]))
    c, s = np.cos(speed * t_end), np.sin(speed * t_end)
    x = np.array([[0.0, 1.0], [0.0, 0.0]])
    seen = turning.integrate(t_end, 4e-3).position(x)[-1]
    exact = np.array([[c, s], [-s, c]]) @ free.integrate(t_end, 4e-3).position(x)[-1]
    assert np.allclose(seen, exact, atol=1e-5)


def test_what_cannot_be_linearised_is_said():
    scene = cantilever()
    with pytest.raises(NameUnknown, match="tip"):
        scene.linearize(None, [PointForce((0, 1), at=(1, 0))], ["tipp"])
    with pytest.raises(InputError, match="an input is a Load"):
        scene.linearize(None, [(0, 1)])
    for inputs, outputs in (([], ["tip"]), ([PointForce((0, 1), at=(1, 0))], [])):
        with pytest.raises(InputError, match="has inputs, .* and outputs"):
            scene.linearize(None, inputs, outputs)
    moving = scene.initial_velocity((0, 0.1)).integrate(0.01, 0.01).state(-1)
    with pytest.raises(InputError, match="at rest"):
        scene.linearize(moving, [PointForce((0, 1), at=(1, 0))])
    free = Scene(strip()).sensor("tip", "displacement", at=(1, 0))
    with pytest.raises(SupportError, match="no static response.*rigid motions"):
        free.frequency_response([0.0], [PointForce((0, 1), at=(1, 0))])
