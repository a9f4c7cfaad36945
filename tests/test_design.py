"""Derivatives of static solutions by parameters, against differences of whole solutions."""

import sys

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares, minimize
from skfem import Functional
from skfem.helpers import dot

from skfem_ancf import (Beam, Circle, Design, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, Frame, InputError, Line, MeshBeam, MissingExtra,
                        NameUnknown, NeoHookean, RigidBody, Scene, StVenantKirchhoff, Temperature)

S = np.linspace(0, 1, 5)


def difference(design, p, step=2e-3, kind=Design):
    """Of whole solutions, of fourth order, (r, n)."""
    out = []
    for k, x in enumerate(p):
        h = step * (abs(x) or 1.0)
        parts = []
        for factor, weight in ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12)):
            q = np.array(p, dtype=float)
            q[k] += factor * h
            parts.append(weight / h * kind(design.build, design.readings).values(q))
        out.append(sum(parts))
    return np.array(out).T


def agree(design, p, rtol=1e-6, floor=1e-7, step=2e-3):
    values, found = design(p)
    exact = difference(design, p, step)
    # relative to what a change of the whole parameter does to the reading
    sizes = np.maximum(np.abs(values).max(), 1e-300) / np.where(np.array(p) == 0, 1.0, np.abs(p))
    assert np.allclose(found, exact, rtol=rtol, atol=0.0) or np.all(
        np.abs(found - exact) <= rtol * np.abs(exact) + floor * sizes), (found, exact)


def beam_of(E=2e6, nu=0.3, height=0.05, width=0.02, element=None, law=StVenantKirchhoff, mesh=None):
    mesh = MeshBeam.init_line(S, height) if mesh is None else mesh
    return Beam(mesh, element or ElementBeamANCF(2), law(E, nu, 1000.0, thermal_expansion=1e-4),
                width=width)


@pytest.mark.parametrize("element, law", [
    (ElementBeamANCF(2), StVenantKirchhoff), (ElementBeamANCFCubic(2), NeoHookean),
    (ElementBeamCable(5), StVenantKirchhoff)])
def test_numbers_of_a_cantilever(element, law):
    def build(p):
        E, nu, height, width, F, direction, temperature = p
        scene = Scene(beam_of(E, nu, height, width, element, law)).clamp("left")
        scene.point_force((F * np.cos(direction), F * np.sin(direction)), at=(1, 0))
        scene.gravity((0, -1.0)).add(Temperature(temperature))
        return scene.sensor("tip", "displacement", at=(1, 0)).sensor("M", "M", at=(0.4, 0))

    agree(Design(build, ["tip", "M"]), [2e6, 0.3, 0.05, 0.02, 0.4, -1.4, 20.0])


def test_functions_of_the_state():
    def build(p):
        mesh = MeshBeam.init_line([0, 0.5, 1], p[0])
        return Scene(beam_of(p[1], mesh=mesh, element=ElementBeamCable(5))).clamp(
            "left").point_force((0, -p[2]), at=(1, 0))

    agree(Design(build, [lambda state: state.strain_energy,
                         lambda state: state.reactions("left").moment]), [0.05, 2e6, 1.0])


def test_norms_of_stress_and_functionals_of_scikit_fem():
    """A p-norm of the equivalent stress, and an integral over the body of displacements."""
    points = np.array([np.linspace(0.05, 0.95, 7), 0.02 + 0 * np.linspace(0.05, 0.95, 7)])

    def norm(state):
        return np.sum(np.abs(state.field("von_mises", points))**8)**0.125

    def swept(state):
        beam = state.beams[0]
        return Functional(lambda w: dot(w["u"], w["u"])).assemble(beam.basis, u=state.u_of(beam))

    def build(p):
        return Scene(beam_of(p[0], height=p[1])).clamp("left").point_force((0, -p[2]), at=(1, 0))

    agree(Design(build, [norm, swept]), [2e6, 0.05, 0.3])
    scene = build([2e6, 0.05, 0.3])
    found = scene.solve_static().gradient(norm, [(scene.beams[0], "height", "nodes")])[0]
    assert found.shape == (5,) and found[0] < found[2] < 0.0  # the root decides


def test_heights_at_nodes_are_changed_together():
    built = []

    def build(p):
        built.append(1)
        mesh = MeshBeam.init_line(S, lambda x: np.interp(x, S, p))
        scene = Scene(beam_of(mesh=mesh)).clamp("left").point_force((0, -1), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0)).sensor("S", "stress", (0.37, 0.01))

    p = 0.05 + 0.01 * np.cos(3 * S)
    design = Design(build, ["tip", "S"])
    agree(design, p)
    design(p + 1e-4)
    built.clear()
    design(p + 2e-4)
    assert len(built) < 4 * len(S) + 2  # groups of nodes that are not neighbours


def test_shape_of_a_curved_axis():
    def build(p):
        mesh = MeshBeam.init_curve(lambda s: np.array([s, p[0] * s**2 + p[1] * s**3]), S, 0.05)
        scene = Scene(beam_of(mesh=mesh)).clamp("left").point_force((0, -1), at="right")
        return scene.sensor("tip", "displacement", at=(1, p[0] + p[1]))

    agree(Design(build, ["tip"]), [0.2, 0.1])


def test_joints_springs_bodies_and_prescribed_displacements():
    def build(p):
        k, settle, mass, angle = p
        beam = Beam(MeshBeam.init_line(S, 0.05), ElementBeamANCF(2), StVenantKirchhoff(2e6, 0.3),
                    width=0.02, name="beam")
        body = RigidBody(mass=mass, inertia=0.1, position=(1, 0), name="body")
        scene = Scene(beam, body).fix("left", "r^2", settle, beam="beam")
        scene.fix("left", "r^1", beam="beam").joint("angle", at="left", beam="beam",
                                                    angle=lambda t: angle * t)
        weld = scene.weld(("beam", "right"), body)
        scene.gravity((0, -9.81), body).spring(k, (("beam", (0.5, 0)), ("ground", (0.5, 0.3))))
        scene.sensor("tip", "displacement", at=body)
        return scene.sensor("weld", "joint_force", weld)

    agree(Design(build, ["tip"]), [20.0, 0.01, 0.05, 0.1])
    agree(Design(build, ["weld"]), [20.0, 0.01, 0.05, 0.1])


def test_contact_without_friction():
    """The default stiffness and the moving face are part of the derivative."""
    def build(p):
        E, height, F, place = p
        scene = Scene(beam_of(E, height=height)).clamp("left").point_force((0, -F), at=(1, 0))
        scene.obstacle(Circle((0.5, place), 0.15))
        return scene.sensor("tip", "displacement", at=(1, 0))

    agree(Design(build, ["tip"]), [2e6, 0.05, 4.0, -0.18], rtol=1e-3, floor=1e-4, step=2e-5)


def test_a_design_follows_what_its_parameters_act_on():
    """An obstacle that is not touched at first, and parameters that act on nothing at first."""
    def build(p):
        E, F, place = p
        scene = Scene(beam_of(E)).clamp("left").point_force((0, -F), at=(1, 0))
        scene.obstacle(Circle((0.5, place), 0.15))
        return scene.sensor("tip", "displacement", at=(1, 0))

    used = Design(build, ["tip"])
    assert np.all(used.jacobian([2e6, 0.1, -0.3])[:, 2] == 0.0)
    p = [2e6, 4.0, -0.18]
    assert np.allclose(used.jacobian(p), Design(build, ["tip"]).jacobian(p), rtol=1e-5, atol=0.0)

    def unloaded(p):
        scene = Scene(beam_of(p[0])).clamp("left").point_force((0, -p[1]), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    used = Design(unloaded, ["tip"], sizes=[1e6, 1.0])
    assert used.jacobian([2e6, 0.0])[1, 0] == 0.0
    fresh = Design(unloaded, ["tip"], sizes=[1e6, 1.0]).jacobian([2e6, 1.0])
    assert np.allclose(used.jacobian([2e6, 1.0]), fresh, rtol=1e-6, atol=0.0)


def test_frame():
    def build(p):
        points = [(0, 0), (0, 1), (1, 1.2), (2, 1), (2, 0)]
        scene = Frame.from_lines(points, [(0, 1), (1, 2), (2, 3), (3, 4)], elements=3,
                                 material=StVenantKirchhoff(p[0], 0.3), height=p[1], width=0.02)
        scene.clamp([0, 4]).point_force((p[2], -20.0), at=(1.0, 1.2))
        return scene.sensor("top", "displacement", at=(1.0, 1.2))

    agree(Design(build, ["top"]), [2e9, 0.02, 5.0])


def test_fit_of_a_modulus_and_a_load():
    def build(p):
        beam = beam_of(1e6 * p[0], element=ElementBeamCable(5))
        scene = Scene(beam).clamp("left").point_force((0, -p[1]), at=(1, 0)).gravity((0, -9.81))
        return scene.sensor("axis", "displacement", at=np.array([S[1:], 0 * S[1:]]))

    design, truth = Design(build, ["axis"]), np.array([2.3, 0.7])
    measured = design.values(truth)
    found = least_squares(lambda p: design.values(p) - measured, [1.5, 1.0], design.jacobian)
    assert np.allclose(found.x, truth, rtol=1e-5) and found.nfev < 15


def test_objective_for_minimize():
    """The place of a support that makes both spans sag equally: gradients lead there."""
    def build(p):
        scene = Scene(beam_of(element=ElementBeamCable(5))).pin("left")
        scene.fix("right", "r^2").gravity((0, -9.81)).point_force((0, p[0]), at=(0.5, 0))
        return scene.sensor("mid", "displacement", at=(0.5, 0))

    goal = Design(build, ["mid"]).objective(lambda y: 1e4 * (y[1] + 0.01)**2)
    value, gradient = goal([0.1])
    assert gradient.shape == (1,) and np.isclose(
        gradient[0], (goal([0.101])[0] - goal([0.099])[0]) / 2e-3, rtol=1e-4)
    found = minimize(goal, [0.1], jac=True)
    assert found.fun < 1e-6 < value


def test_readings_for_jax(monkeypatch):
    def build(p):
        scene = Scene(beam_of(1e6 * p[0], element=ElementBeamCable(5))).clamp("left")
        scene.point_force((0, -p[1]), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    design = Design(build, ["tip"])
    with monkeypatch.context() as m:
        m.setitem(sys.modules, "jax", None)
        with pytest.raises(MissingExtra, match="autodiff"):
            design.to_jax([2.0, 1.0])
    jax = pytest.importorskip("jax")
    readings, p = design.to_jax([2.0, 1.0]), jax.numpy.array([2.0, 1.0])
    found = jax.jit(jax.grad(lambda p: jax.numpy.sum(readings(p * p)**2)))(p)
    y, J = design([4.0, 1.0])
    assert np.allclose(found, 2 * (y @ J) * 2 * np.array([2.0, 1.0]), rtol=1e-5)


def test_what_has_no_derivative_is_said():
    def friction(p):
        scene = Scene(beam_of()).clamp("left").point_force((0, -p[0]), at=(1, 0))
        scene.obstacle(Circle((0.5, -0.18), 0.15), friction=0.3)
        return scene.sensor("tip", "displacement", at=(1, 0))

    with pytest.raises(InputError, match="depend on the path"):
        Design(friction, ["tip"])([4.0])
    with pytest.raises(NameUnknown, match="tip"):
        Design(lambda p: friction(p), ["tipp"])([4.0])
    with pytest.raises(InputError, match="must return a Scene"):
        Design(lambda p: 3, ["tip"])([1.0])

    def finer(p):
        mesh = MeshBeam.init_line(np.linspace(0, 1, 4 + int(p[0] > 1.0)), 0.05)
        scene = Scene(beam_of(mesh=mesh)).clamp("left").point_force((0, -1), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    with pytest.raises(InputError, match="number of degrees of freedom"):
        Design(finer, ["tip"])([1.0])


@pytest.mark.parametrize("element, law", [
    (ElementBeamCable(5), StVenantKirchhoff), (ElementBeamANCF(2), NeoHookean)])
def test_no_gradient_at_a_critical_point(element, law):
    """A column about to branch, and an arch about to snap; 1 % below they have one."""
    def column(load):
        beam = beam_of(height=0.02, element=element, law=law)
        scene = Scene(beam).clamp("left").point_force((-load, 0), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    point = column(0.1).continuation(ds=0.03, max_load=1.1).critical_points[0]
    loads = [("bifurcation", column, 0.1 * point.load, point)]

    def arch(load):
        rise = MeshBeam.init_curve(lambda s: np.array([s, 0.06 * np.sin(np.pi * s)]), S, 0.02)
        scene = Scene(beam_of(element=element, law=law, mesh=rise)).clamp("left").clamp("right")
        return scene.point_force((0, -load), at=(0.5, 0.06)).sensor("tip", "displacement",
                                                                    at=(0.5, 0.06))

    point = next(one for one in arch(5.0).continuation(
        ds=0.03, until=lambda point: point.rate < 0).critical_points if one.kind == "limit")
    loads.append(("limit", arch, 5.0 * point.load, point))
    for kind, build, load, point in loads:
        assert point.kind == kind
        wrt = [(point.state.system.beams[0], "E")]
        for gradient in (lambda: point.state.gradient("tip", wrt),
                         lambda: point.state.gradient(lambda state: state.strain_energy, wrt),
                         lambda: point.state.sensitivity(wrt)):
            with pytest.raises(InputError, match="snaps or branches"):
                gradient()
        scene = build(0.99 * load)
        by_load, = scene.solve_static().gradient("tip", [(scene.items[-1], "force")])
        assert np.all(np.isfinite(by_load))


def test_no_gradient_where_a_point_just_touches():
    """The least gap is zero at a load that is found; 1 % beside it the gradient is that branch's.
    """
    def build(p):
        scene = Scene(beam_of()).clamp("left").point_force((0, -p[0]), at=(1, 0))
        scene.obstacle(Circle((0.5, -0.195), 0.15))
        return scene.sensor("tip", "displacement", at=(1, 0))

    def gap(load):
        state = build([load]).solve_static()
        (_, _, gap), = state.system.forces.contacts.look(np.array(state.u), 1.0)
        return gap.min()

    load, design = brentq(gap, 0.06, 0.1, xtol=1e-12), Design(build, ["tip"])
    with pytest.raises(InputError, match=r"just touches an obstacle, at \(0\.50"):
        design([load])
    apart, touching = design([0.99 * load])[1], design([1.01 * load])[1]
    assert np.isclose(apart[1, 0], difference(design, [0.99 * load])[1, 0], rtol=1e-6)
    assert abs(touching[1, 0]) < 0.9 * abs(apart[1, 0])
    # lying there, lightly pressed; lifted off but for the clamp
    for weight in (-1.0, 1.0):
        scene = Scene(beam_of()).clamp("left").obstacle(Line((0, -0.025))).gravity((0, weight))
        scene.sensor("tip", "displacement", at=(1, 0))
        by, = scene.solve_static().gradient("tip", [(scene.beams[0], "E")])
        assert np.all(np.isfinite(by))
