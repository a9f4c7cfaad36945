"""Derivatives of motions by parameters."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from skfem_ancf import (Beam, Circle, ElementBeamANCF, ElementBeamCable, Energy, InputError,
                        KelvinVoigt, MeshBeam, MotionDesign, NameUnknown, NeoHookean, Parameters,
                        RigidBody, Scene, StVenantKirchhoff)
from tests.test_design import S, beam_of, difference
from tests.test_items import ProfileJoint


SCHEMES = ["generalized-alpha", "energy-momentum"]


def agree(design, p, rtol=1e-6):
    values, found = design(p)

    def other(build, readings):
        return MotionDesign(build, readings, design.t_end, design.dt, design.scheme, design.static)

    exact = difference(design, p, 1e-3, other)
    assert values.shape == (len(found),) and found.shape == exact.shape
    gap = np.abs(found - exact).max(axis=0) / np.abs(exact).max(axis=0)
    assert np.all(gap < rtol), gap
    # one number of all, by one adjoint solution, with few states kept
    weights = np.cos(np.arange(len(values))) / np.abs(values).max()
    design = MotionDesign(design.build, design.readings, design.t_end, design.dt, design.scheme,
                          design.static, every=3)
    value, gradient = design.objective(lambda y: weights @ y)(p)
    assert len(design.history) < 0.7 * len(design.history.sensors.t)
    assert np.isclose(value, weights @ values)
    gap = np.abs(gradient - weights @ exact) / (np.abs(weights) @ np.abs(exact))
    assert np.all(gap < rtol), gap


def test_mass_on_a_spring():
    """u = v / omega sin(omega t), and its derivatives by stiffness, mass and velocity."""
    def build(p):
        k, mass, v = p
        body = RigidBody(mass=mass, inertia=1.0, name="mass")
        scene = Scene(body).initial_velocity(lambda x: np.array([v + 0 * x[0], 0 * x[0]]), body)
        scene.spring(k, (("mass", (0, 0)), ("ground", (-1e4, 0))))
        return scene.sensor("u", "displacement", at=body)

    k, m, v = p = [8.0, 2.0, 0.5]
    design = MotionDesign(build, ["u"], 0.6, 0.02, "newmark")
    values, found = design(p)
    t, w = design.history.t, np.sqrt(k / m)
    u = v / w * np.sin(w * t)
    by_w = -u / w + v / w * t * np.cos(w * t)
    assert np.allclose(values.reshape(len(t), 2)[:, 0], u, atol=1e-4)
    expected = np.column_stack([by_w * w / (2 * k), -by_w * w / (2 * m), u / v])
    assert np.allclose(found.reshape(len(t), 2, 3)[:, 0], expected, atol=2e-4)
    for scheme in ("hht", "energy-momentum"):
        agree(MotionDesign(build, ["u"], 0.1, 0.02, scheme), p)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)])
def test_a_damped_pendulum(element, scheme):
    def build(p):
        E, height, density, g, damping = p
        beam = Beam(MeshBeam.init_line([0, 0.5, 1], height), element,
                    StVenantKirchhoff(E, 0.3, density), width=0.02, damping=KelvinVoigt(damping))
        scene = Scene(beam).pin("left").gravity((0, -g))
        return scene.sensor("tip", "displacement", at=(1, 0)).sensor("v", "velocity", at=(1, 0))

    agree(MotionDesign(build, ["tip", "v"], 0.24, 0.03, scheme), [1e6, 0.05, 1000.0, 9.81, 1e-3])


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_cantilever_released_with_joints(scheme):
    """From a static solution that depends on the parameters, with a body welded to the end."""
    def build(p):
        E, mass, F = p
        beam = Beam(MeshBeam.init_line(S, 0.05), ElementBeamANCF(2),
                    StVenantKirchhoff(E, 0.3, 1000.0), width=0.02, name="beam")
        body = RigidBody(mass=mass, inertia=0.01, position=(1.1, 0.0), name="body")
        scene = Scene(beam, body).clamp("left", "beam")
        scene.weld(("beam", "right"), (body, (1.0, 0.0)))
        scene.point_force((0, -F), at=(0.5, 0), beam="beam", amplitude=lambda t: np.cos(20 * t))
        return scene.sensor("body", "position", at=body)

    agree(MotionDesign(build, ["body"], 0.2, 0.01, scheme, static=True), [2e6, 0.2, 4.0])


@pytest.mark.parametrize("scheme", SCHEMES)
def test_motors_dashpots_and_drag(scheme):
    """Joints that move, forces of the velocity, a load that follows; read forces and stress."""
    def build(p):
        E, k, c, drag, F = p
        beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.05), ElementBeamCable(5),
                    StVenantKirchhoff(E, 0.3, 1000.0), width=0.02, damping=KelvinVoigt(1e-3))
        scene = Scene(beam).pin("left").drag(drag, normal=drag).damping(mass=0.3)
        motor = scene.motor((0, "left"), angle=lambda t: 3.0 * t * t)
        scene.spring(k, ((0.5, 0.0), ("ground", (0.5, 0.4))), damping=c)
        scene.follower_force((0, F), at=(1, 0))
        scene.sensor("torque", "joint_force", motor).sensor("a", "acceleration", at=(1, 0))
        return scene.sensor("S", "stress", at=(0.3, 0.01))

    p = [2e6, 30.0, 2.0, 0.5, 1.0]
    for name in ("torque", "a", "S"):
        agree(MotionDesign(build, [name], 0.1, 0.01, scheme), p)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_many_heights_by_one_adjoint_solution(scheme):
    """The time integral of the height of a tip, by heights at nodes and by element moduli."""
    x = np.linspace(0, 1, 13)
    scene = Scene(beam_of(mesh=MeshBeam.init_line(x, 0.05))).clamp("left").gravity((0, -9.81))
    scene.sensor("tip", "displacement", at=(1, 0)).sensor("S", "stress", at=(0.01, 0.02))
    beam = scene.beams[0]
    parameters = Parameters(scene, [(beam, "height", "nodes"), (beam, "E", "elements")])
    design = MotionDesign(parameters, ["tip", "S"], 0.12, 0.01, scheme, every=4)
    weights = np.zeros((13, 5))
    weights[:, 1], weights[6, 2], weights[-1, 2] = 1.0, 1e-5, 1e-5
    p = parameters.start * (1.0 + 0.1 * np.cos(np.arange(25.0)))
    _, gradient = design.objective(lambda y: np.sum(weights * y.reshape(13, 5)))(p)
    exact = np.tensordot(weights.ravel(), design.jacobian(p), 1)
    for part in (slice(0, 13), slice(13, 25)):
        assert np.allclose(gradient[part], exact[part], rtol=1e-6,
                           atol=1e-7 * np.abs(exact[part]).max())
    step = 1e-4 * np.cos(np.arange(25.0)) * p  # along one direction, of whole motions
    change = (design.values(p + step) - design.values(p - step)) @ weights.ravel() / 2.0
    assert np.isclose(gradient @ step, change, rtol=1e-6)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_last_value_alone_by_fields(scheme):
    """Instants that the objective does not read, and a start that no height changes."""
    scene = Scene(beam_of(mesh=MeshBeam.init_line(np.linspace(0, 1, 9), 0.05))).clamp("left")
    scene.gravity((0, -9.81)).sensor("tip", "displacement", at=(1, 0))
    heights = Parameters(scene, [(scene.beams[0], "height", "nodes")])
    design = MotionDesign(heights, ["tip"], 0.04, 0.01, scheme)
    _, gradient = design.objective(lambda y: y[-1])(heights.start)
    assert np.allclose(gradient, design.jacobian(heights.start)[-1], rtol=1e-6)


def test_mean_forces_of_a_law_a_torque_and_an_energy():
    """Means that are no polynomials, and couple a whole beam or the sections of a motor."""
    def build(p):
        one, two = (Beam(MeshBeam.init_line([x, x + 0.5, x + 1], 0.05), ElementBeamANCF(2), law,
                         width=0.02) for x, law in enumerate([
                             NeoHookean(p[0], 0.3, density=1000.0),
                             StVenantKirchhoff(1e6, 0.3, 1000.0)]))
        scene = Scene(one, two).pin("left", one).gravity((0, -9.81))
        scene.hinge((one, "right"), (two, "left"))
        scene.motor((two, "left"), other=(one, "right"), torque=p[1])
        scene.add(Energy(lambda r, F, X, t: p[2] * (r[1] + 0.2)**4,
                         lambda r, F, X, t: (np.array([0 * r[0], 4 * p[2] * (r[1] + 0.2)**3]),
                                             0 * F), beam=two))
        return scene.sensor("tip", "position", at="right", beam=two)

    agree(MotionDesign(build, ["tip"], 0.12, 0.04, "energy-momentum"), [1e6, 0.3, 300.0])


def test_joints_that_are_driven_fast_and_not_quadratic():
    """Impulses that count, in long steps."""
    def build(p):
        beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.02), ElementBeamCable(5),
                    StVenantKirchhoff(p[0], 0.3, 1000.0), width=0.02)
        hub, bob = (RigidBody(mass=m, inertia=0.01, position=(x, 0.0), name=name)
                    for m, x, name in ((0.3, 0.0, "hub"), (p[1], 1.1, "bob")))
        scene = Scene(beam, hub, bob).gravity((0, -9.81))
        scene.hinge((hub, (0, 0)), ("ground", (0, 0)))
        scene.motor(hub, angle=lambda t: 10.0 * t * t)
        scene.weld((hub, (0, 0)), (beam, "left"))
        scene.hinge((beam, "right"), (bob, (1, 0)))
        return scene.sensor("bob", "position", at=bob).sensor("v", "velocity", at=bob)

    agree(MotionDesign(build, ["bob", "v"], 0.12, 0.03, "energy-momentum"), [1e7, 0.3])

    def railed(p):
        scene = Scene(beam_of(p[0], mesh=MeshBeam.init_line([0, 0.5, 1], 0.05)))
        scene.gravity((0, -9.81)).add(ProfileJoint(lambda x: 9 * x**3))
        scene.initial_velocity(lambda x: np.array([p[1] + 0 * x[0], 0 * x[0]]))
        return scene.sensor("tip", "position", at="right").sensor("v", "velocity", at="right")

    agree(MotionDesign(railed, ["tip", "v"], 0.12, 0.04, "energy-momentum"), [1e6, 2.0])


def test_a_fit_of_damping_and_modulus():
    def build(p):
        beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.02), ElementBeamCable(5),
                    StVenantKirchhoff(1e6 * p[0], 0.3, 1000.0), width=0.02,
                    damping=KelvinVoigt(1e-2 * p[1]))
        scene = Scene(beam).clamp("left").point_force((0, -0.02), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    design = MotionDesign(build, ["tip"], 0.6, 0.05)
    measured = design.values([2.0, 0.7])
    found = least_squares(lambda p: design.values(p) - measured, [1.5, 1.0], design.jacobian)
    assert np.allclose(found.x, [2.0, 0.7], rtol=1e-4)


def test_what_has_no_derivative_is_said():
    def build(p):
        scene = Scene(beam_of(p[0])).clamp("left").gravity((0, -9.81))
        return scene.sensor("tip", "displacement", at=(1, 0))

    for scheme in ("energy-momentum-4", "gauss", "radau"):
        with pytest.raises(InputError, match="or 'energy-momentum', got"):
            MotionDesign(build, ["tip"], 0.1, 0.01, scheme)
    with pytest.raises(NameUnknown, match="tip"):
        MotionDesign(build, ["tap"], 0.1, 0.01).values([2e6])

    def moved(p):
        scene = Scene(beam_of()).fix("left", "r^1").fix("right", "r^2")
        scene.fix("left", "r^2", lambda t: p[0] * t**2)
        return scene.sensor("tip", "displacement", at=(1, 0))

    with pytest.raises(InputError, match="prescribed motion"):
        MotionDesign(moved, ["tip"], 0.03, 0.01)([0.1])
    with pytest.raises(InputError, match="prescribed motion"):
        MotionDesign(moved, ["tip"], 0.03, 0.01).objective(np.sum)([0.1])

    def sliding(p):
        body = RigidBody(mass=0.2, inertia=0.01, position=(0.4, 0.0))
        scene = Scene(beam_of(p[0]), body).clamp("left", 0)
        scene.slider((body, (0.4, 0.0)), on=0)
        return scene.sensor("tip", "displacement", at="right", beam=0)

    with pytest.raises(InputError, match="Sleeve.*Jacobian.*use the scheme 'generalized-alpha'"):
        MotionDesign(sliding, ["tip"], 0.03, 0.01, "energy-momentum")([2e6])

    def touching(p):
        return build(p).obstacle(Circle((0.5, -0.3), 0.1))

    with pytest.raises(InputError, match="smooth forces"):
        MotionDesign(touching, ["tip"], 0.03, 0.01)([2e6])
