"""What a linear solution, and a mode, are asked: all of it is linear, in balance with the loads."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, Frame,
                        MeshBeam, NeoHookean, RigidBody, Scene, StVenantKirchhoff)

STEEL = StVenantKirchhoff(E=2e11, nu=0.3, density=7800.0)


def straight(element=None, n=20, height=0.01, material=STEEL, **options):
    """A beam of length 1."""
    return Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), height=height),
                element or ElementBeamANCF(3), material, width=height, **options)


# closed forms


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCFCubic(2),
                                     ElementBeamCable(5)])
@pytest.mark.parametrize("q", [0.5, 2.0, 5e4])
def test_reactions_of_a_propped_beam_do_not_depend_on_the_load(element, q):
    """3/8 q L at the prop, 5/8 q L and q L^2 / 8 at the clamp; the moment of the span 9/128 q L^2.

    Shear changes them by 1e-4 of that at L / h = 100.
    """
    state = Scene(straight(element, 40)).clamp("left", thickness="free").fix(
        "right", "r^2").line_load((0, -q)).solve_linear()
    left, right = state.reactions("left"), state.reactions("right")
    assert right.force[1] == pytest.approx(3 / 8 * q, rel=1e-3)
    assert left.force[1] == pytest.approx(5 / 8 * q, rel=1e-3)
    assert left.moment == pytest.approx(q / 8, rel=2e-3)
    assert_allclose(left.force + right.force, (0, q), rtol=0, atol=1e-9 * q)
    assert left.moment + right.force[1] == pytest.approx(0.5 * q, rel=1e-9)
    found = state.resultants([(0.25, 0), (0.625, 0)])
    assert found.recovered
    assert found.M[1] == pytest.approx(9 / 128 * q, rel=1e-3)
    assert_allclose(found.N, 0, atol=1e-8 * q)
    shear = q * np.array([0.25, 0.625]) - left.force[1]  # dM/ds = - Q
    assert_allclose(found.Q, shear, rtol=1e-8, atol=1e-8 * q)


@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(2),
                                     ElementBeamANCFCubic(2),
                                     ElementBeamCable(3), ElementBeamCable(5)], ids=repr)
@pytest.mark.parametrize("L, places", [(1.0, (0.37,)), (10.0, (3.7,)), (1.0, (0.385, 0.46)),
                                       (1.0, (0.01, 0.93)), (1.0, (0.375, 0.37))])
def test_forces_inside_elements(element, L, places):
    """Jumps of Q and kinks of M, at places that are no nodes; a moment at the end."""
    x = np.linspace(0.0173, 0.99, 33) * L
    mesh = MeshBeam.init_line(np.linspace(0, L, 9), 0.1)
    scene = Scene(Beam(mesh, element, STEEL, width=0.1)).clamp("left")
    scene.moment("right", 200.0)
    M, Q = 200.0 + 0.0 * x, 0.0 * x
    for k, a in enumerate(places):
        F = 1e3 * (k + 1)
        scene.point_force((0, -F), at=(a, 0))
        M, Q = M - F * np.maximum(a - x, 0.0), Q - F * (x < a)
    found = scene.solve_linear().resultants([(a, 0) for a in x])
    assert found.recovered
    assert_allclose(found.M, M, atol=1e-9 * np.abs(M).max())
    assert_allclose(found.Q, Q, atol=1e-9 * np.abs(Q).max())
    assert_allclose(found.N, 0, atol=1e-9 * np.abs(Q).max())


@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(2),
                                     ElementBeamANCFCubic(2), ElementBeamCable(3),
                                     ElementBeamCable(5)], ids=repr)
def test_a_moment_inside_an_element(element):
    """A torsional spring there: M jumps by its moment, and Q does not."""
    F, a, x = 1e3, 0.37, np.array([0.1, 0.255, 0.3, 0.36, 0.369, 0.371, 0.374, 0.376, 0.6])
    mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.1)
    scene = Scene(Beam(mesh, element, STEEL, width=0.1)).clamp("left")
    scene.torsional_spring(1e6, (a, 0)).point_force((0, -F), at=(1, 0))
    for state, exact in ((scene.solve_linear(), 1e-9), (scene.solve_static(), 1e-5)):
        found, moment = state.resultants([(s, 0) for s in x]), state.spring_force()
        assert found.recovered and abs(moment) > 50.0
        assert_allclose(found.M, -F * (1 - x) - moment * (x < a), atol=exact * F)
        assert_allclose(found.Q, -F, rtol=exact)


@pytest.mark.parametrize("recover", [True, False])
def test_strain_and_stress_of_a_cantilever_are_those_of_bending(recover):
    """sigma = M y / I, eps_yy = - nu eps_xx, whatever the load; no normal force."""
    I, x = 0.01**4 / 12, 0.53125  # the middle of an element
    for P in (10.0, 1e4):
        state = Scene(straight(n=16)).clamp("left").point_force((0, -P), at=(1, 0)).solve_linear()
        assert state.recovered == {0: ""}
        sigma = P * (1 - x) * 0.005 / I
        eps, S = (f((x, 0.005), recover=recover) for f in (state.strain, state.stress))
        error = 1e-6 if recover else 1e-3
        assert eps[0] == pytest.approx(sigma / STEEL.E, rel=error)
        assert eps[1] == pytest.approx(-0.3 * sigma / STEEL.E, rel=error)
        assert S[0] == pytest.approx(sigma, rel=error)
        assert_allclose(S[1:], 0, atol=error * sigma)
        for name in ("sigma_xx", "von_mises", "sigma_1"):
            assert state.field(name, (x, 0.005), recover=recover) == pytest.approx(
                sigma, rel=2 * error)
        found = state.resultants((x, 0), recover=recover)
        assert abs(found.N) < 1e-7 * P
        assert found.M == pytest.approx((x - 1) * P, rel=error)


def test_a_column_and_a_beam_of_a_frame_have_the_forces_of_statics():
    """A column of 4 m with an arm of 2 m and 1000 N at its end."""
    frame = Frame.from_lines([(0, 0), (0, 4), (2, 4)], [(0, 1), (1, 2)], height=0.1, width=0.1,
                             material=STEEL, elements=8).clamp(0)
    for F in (1000.0, 1e6):
        state = frame.point_force((0, -F), at=2).solve_linear()
        found = state.resultants((0, 2.0))
        assert found.N == pytest.approx(-F, rel=1e-7) and abs(found.Q) < 1e-6 * F
        assert abs(found.M) == pytest.approx(2 * F, rel=1e-7)
        assert state.resultants((1.0, 4.0)).Q == pytest.approx(-F, rel=1e-7)
        held = state.reactions(0)
        assert_allclose(held.force, (0, F), rtol=0, atol=1e-7 * F)
        assert held.moment == pytest.approx(2 * F, rel=1e-7)  # about the place without load
        assert set(state.recovered.values()) == {""}
        # theta = F a s / E I of the column
        EI = 2e11 * 0.1**4 / 12
        assert frame.rotations(state)[1] == pytest.approx(-F * 2 * 4 / EI, rel=1e-6)
        frame = Frame.from_lines([(0, 0), (0, 4), (2, 4)], [(0, 1), (1, 2)], height=0.1, width=0.1,
                                 material=STEEL, elements=8).clamp(0)


def test_temperature_of_a_held_and_of_a_free_beam():
    """N = - E A alpha T where both ends are held, M = E I alpha T' there; no stress where free."""
    steel = STEEL.replace(thermal_expansion=1e-5)
    for element in (ElementBeamANCF(2), ElementBeamCable(5)):
        beam, EA, EI = straight(element, material=steel), 2e11 * 1e-4, 2e11 * 1e-8 / 12
        for T in (1.0, 5000.0):
            held = Scene(beam).clamp("left", thickness="free").clamp(
                "right", thickness="free").temperature(lambda x, y, T=T: T * (1 + 200 * y))
            found = held.solve_linear().resultants((0.4, 0))
            assert found.N == pytest.approx(-EA * 1e-5 * T, rel=1e-8)
            assert found.M == pytest.approx(EI * 1e-5 * 200 * T, rel=1e-8)
            free = Scene(beam).clamp("left", thickness="free").temperature(T).solve_linear()
            assert_allclose(free.displacement((1, 0)), (1e-5 * T, 0), rtol=1e-9, atol=1e-12 * T)
            assert_allclose(free.stress((0.4, 0.003)), 0, atol=1e-8 * 2e11 * 1e-5 * T)
            assert free.strain((0.4, 0.003))[0] == pytest.approx(1e-5 * T, rel=1e-8)


def test_a_settlement_and_a_spring():
    """3 E I d / L^3 of a prop that sinks by d; of a spring k in place of it k / (k + 3 E I)."""
    EI, d, k = 2e11 * 1e-8 / 12, 0.3, 700.0
    beam = straight(ElementBeamCable(5))
    state = Scene(beam).clamp("left").fix("right", "r^2", displacement=-d).solve_linear()
    assert state.reactions("right").force[1] == pytest.approx(-3 * EI * d, rel=1e-8)
    assert state.reactions("left").moment == pytest.approx(3 * EI * d, rel=1e-8)
    assert state.strain_energy == pytest.approx(1.5 * EI * d * d, rel=1e-8)
    held = Scene(beam).clamp("left").spring(k, ((1, 0), (1, -1.0))).point_force(
        (0, -1e3), at=(1, 0)).solve_linear()
    u = -1e3 / (k + 3 * EI)
    assert held.displacement((1, 0))[1] == pytest.approx(u, rel=1e-8)
    assert held.reactions("left").force[1] == pytest.approx(-3 * EI * u, rel=1e-7)
    assert held.strain_energy == pytest.approx(0.5 * 1e3 * -u, rel=1e-8)


# linear in the load, and exactly in balance

BEAMS = {
    "order 1": lambda: ElementBeamANCF(1), "order 3": lambda: ElementBeamANCF(3),
    "cubic sections": lambda: ElementBeamANCFCubic(2), "cable": lambda: ElementBeamCable(5),
    "cubic cable": lambda: ElementBeamCable(3),
}
LAWS = {"SVK": StVenantKirchhoff(2e8, 0.3, 7800.0, thermal_expansion=1e-5),
        "plane strain": StVenantKirchhoff(2e8, 0.3, 7800.0, "strain", thermal_expansion=1e-5),
        "NeoHookean": NeoHookean(2e8, 0.3, 7800.0, "strain", thermal_expansion=1e-5)}
LOADS = {
    "point": lambda s, c: s.point_force((0.5 * c, -c), at=(np.sin(0.35), 1 - np.cos(0.35))),
    "line": lambda s, c: s.line_load((0.3 * c, -c)),
    "moment": lambda s, c: s.moment("right", c),
    "gravity": lambda s, c: s.gravity((0, -0.1 * c)),
    "pressure": lambda s, c: s.pressure("top", 20 * c),
    "follower": lambda s, c: s.follower_force((0, -c), at=(np.sin(0.7), 1 - np.cos(0.7))),
    "temperature": lambda s, c: s.temperature(lambda x, y: 20 * c * (1 + x + 20 * y)),
}


def curved(element, law):
    return Beam(MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1 - np.cos(s)]),
                                    np.linspace(0, 1, 11), height=0.05), element, law, width=0.02)


def readings(state, beam):
    """All that is asked of a state, as arrays; and sizes below which they are round-off."""
    e = np.array([4])
    x = beam.mesh.mapping().F(np.array([[[0.3, 0.8]], [[0.9, 0.2]]]).reshape(2, 1, 2), e)[:, 0]
    found = {"u": (state.displacement(x), 1e-5)}
    for recover in (True, False):
        found[f"eps {recover}"] = state.strain(x, recover=recover), 1e-5
        found[f"S {recover}"] = state.stress(x, recover=recover), 1e3
        found[f"one {recover}"] = state.stress(x[:, 0], recover=recover), 1e3
        for name in ("sigma_xx", "von_mises", "eps_1"):
            found[f"{name} {recover}"] = (state.field(name, x, recover=recover),
                                          1e-5 if name == "eps_1" else 1e3)
        r = state.resultants(recover=recover)
        for name, start, size in (("N", 0, 1), ("Q", 0, 1), ("M", 0, 0.1), ("curvature", 0, 1e-3),
                                  ("stretch", 1, 1e-5), ("shear", 0, 1e-5)):
            found[f"{name} {recover}"] = getattr(r, name) - start, size
    held, right = state.reactions("left"), state.reactions("right")
    found["force"], found["moment"] = (held.force, 1), (np.array(held.moment), 0.1)
    found["right"], found["f"] = (right.force, 1), (state.internal_force, 1)
    found["root of the energy"] = np.sqrt(state.strain_energy), 1e-2
    return found


@pytest.mark.parametrize("name", BEAMS)
def test_it_is_the_limit_of_small_loads(name):
    """Of what solve_static finds, divided by the load."""
    beam = curved(BEAMS[name](), LAWS["SVK"])
    for load in ("line", "moment", "temperature", "pressure", "point"):
        if load == "pressure" and not beam.has_sections:
            continue
        a, b = (readings(getattr(LOADS[load](Scene(beam).clamp("left").pin("right"), c), how)(),
                         beam) for how, c in (("solve_linear", 1.0), ("solve_static", 1e-3)))
        for what, (value, size) in a.items():
            scale = max(np.max(np.abs(value)), size)
            assert_allclose(1000 * b[what][0], value, rtol=0, atol=2e-3 * scale,
                            err_msg=f"{load}: {what}")


# bodies, joints, cables, pictures


def test_a_rigid_body_at_the_end_turns_by_the_small_angle():
    """A body of 0.2 m welded to a cantilever; theta = P L^2 / 2 E I + P a L / E I."""
    EI, a, P = 2e11 * 1e-8 / 12, 0.1, 500.0
    beam = straight(ElementBeamCable(5), 10)
    body = RigidBody(mass=1.0, inertia=0.1, position=(1.0 + a, 0.0))
    scene = Scene(beam, body).clamp("left", beam=0)
    weld = scene.weld((beam, "right"), (body, (1.0, 0.0)))
    state = scene.point_force((0, -P), at=(1.0 + a, 0.0), beam=body).solve_linear()
    theta = -(P / 2 + P * a) / EI
    assert theta < -1.0  # far beyond small
    assert state.angle(body) == pytest.approx(theta, rel=1e-8)
    tip = -(P / 3 + P * a / 2) / EI + theta * a
    assert_allclose(state.displacement(body), (0, tip), rtol=1e-8, atol=1e-9)
    force = state.joint_force(weld)
    assert np.max(np.abs(force)) == pytest.approx(P, rel=1e-8)
    assert state.reactions("left", beam=0).moment == pytest.approx(P * (1 + a), rel=1e-8)
    assert "turns" in str(state.checks) and "solve_static" in state.checks.findings[0]


# modes


@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamCable(5)])
def test_a_mode_has_the_stress_of_small_vibrations(element):
    """That of a pinned beam is a sine: M = E I kappa, the energy (omega a)^2 / 2."""
    beam, EI = straight(element), 2e11 * 1e-8 / 12
    modes = Scene(beam).pin("left").pin("right").modes(2)
    for a in (1e-3, 1.0):
        mode = modes.mode(0, a)
        assert mode.recovered == {0: ""}
        assert mode.strain_energy == pytest.approx(0.5 * (modes.frequencies[0] * a)**2, rel=1e-6)
        size = mode.displacement((0.5, 0))[1]
        M = EI * np.pi**2 * size * np.sin(0.325 * np.pi)
        for recover in (True, False):
            found = mode.resultants((0.325, 0), recover=recover)
            assert found.M == pytest.approx(-M, rel=1e-2)
            assert abs(found.N) < 1e-5 * abs(M) / 0.01
            S = mode.stress((0.325, 0.004), recover=recover)
            assert S[0] == pytest.approx(0.004 * M / (1e-8 / 12), rel=2e-2)
        assert mode.reactions("left").force[1] == pytest.approx(
            -EI * np.pi**3 * size, rel=1e-2)


def test_a_mode_about_a_loaded_state_adds_to_what_that_has():
    beam = straight(ElementBeamANCF(2), 10, 0.02)
    scene = Scene(beam).clamp("left").clamp("right").line_load((0, -2e4))
    state = scene.solve_static()
    modes = scene.modes(1, state)
    x = np.array([[0.13, 0.4, 0.77], [0.009, 0.0, -0.01]])
    for ask in (lambda s: s.strain(x, recover=False), lambda s: s.stress(x, recover=False),
                lambda s: s.displacement(x), lambda s: s.field("sigma_xx", x, recover=False),
                lambda s: s.resultants(recover=False).N, lambda s: s.internal_force):
        small, large = ask(modes.mode(0, 1e-3)) - ask(state), ask(modes.mode(0, 1.0)) - ask(state)
        assert_allclose(1e3 * small, large, rtol=0, atol=1e-6 * np.max(np.abs(large)))
    eps = 1e-6  # its direction is that of large displacements
    near = scene.state(state.u + eps * modes.shapes[0])
    change = (near.strain(x, recover=False) - state.strain(x, recover=False)) / eps
    exact = modes.mode(0, 1.0).strain(x, recover=False) - state.strain(x, recover=False)
    assert_allclose(exact, change, rtol=0, atol=1e-3 * np.max(np.abs(change)))
    assert "those of the elements" in modes.mode(0, 1.0).recovered[0]
