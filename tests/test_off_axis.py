"""Forces on the face of a cable: fixed, moving and follower ones have its couple."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.actions.point_force import PointForce

H, E = 0.1, 2e9
EI, EA = E * H**4 / 12, E * H**2


def cantilever(element=None, n=4, **options):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), H)
    return Scene(Beam(mesh, element or ElementBeamCable(5), StVenantKirchhoff(E, 0.0, 1000.0),
                      width=H, **options)).clamp("left")


@pytest.mark.parametrize("x", [0.5, 0.63, 1.0])
@pytest.mark.parametrize("degree", [3, 5])
def test_a_force_along_the_face_bends(x, degree):
    """A couple -F h / 2 at x: the tip goes down by F h / 2 x (2 - x) / (2 EI)."""
    F = 20.0
    scene = cantilever(ElementBeamCable(degree)).point_force((F, 0), at=(x, H / 2))
    tip = -F * H / 2 * x * (2 - x) / (2 * EI)
    linear = scene.solve_linear()
    exact = 1e-9 if degree == 5 or x != 0.63 else 2e-2  # a kink of the moment in the element
    assert_allclose(linear.displacement((1, 0)), [F * x / EA, tip], rtol=exact)
    found = linear.resultants([(0.1, 0), (0.9, 0)])
    assert found.recovered
    assert_allclose(found.M, [-F * H / 2, -F * H / 2 * (x == 1.0)], atol=1e-9 * F * H)
    assert_allclose(linear.reactions("left").moment, F * H / 2, rtol=1e-9)
    state = scene.solve_static()
    assert_allclose(state.displacement((1, 0))[1], tip, rtol=max(exact, 1e-3))
    # exact in the deformed state: F times the height of the point over the clamp
    r, a = state.position((x, 0)), state.resultants((x - 1e-9, 0)).angle
    lever = r[1] + H / 2 * np.cos(a)
    assert_allclose(state.reactions("left").moment, F * lever, rtol=1e-6)


@pytest.mark.parametrize("Y", [H / 2, -0.3 * H])
def test_large_rotations(Y):
    """The moment of the clamp is that of the force at its place in the deformed state."""
    F, M, x = (-200.0, 300.0), 1.2 * EI, 0.7
    state = cantilever(n=16).moment("right", M).point_force(F, at=(x, Y)).solve_static()
    r, a = state.position((x, 0)), state.resultants((x, 0)).angle
    assert a > 0.7
    x, y = r + Y * np.array([-np.sin(a), np.cos(a)])
    assert_allclose(state.reactions("left").moment + M, y * F[0] - x * F[1], rtol=1e-6)


def test_derivatives_and_mean_forces():
    scene = cantilever()
    scene.point_force((30.0, -50.0), at=(0.63, -H / 2))
    load, = scene.loads
    rng = np.random.default_rng(0)
    u, v = 0.1 * rng.standard_normal((2, scene.N))
    d = rng.standard_normal(scene.N)
    step = 1e-6

    def slope(f):
        return (np.asarray(f(u + step * d)) - f(u - step * d)) / (2 * step)

    assert_allclose(-slope(load.potential), load.force(u) @ d, rtol=1e-8)
    i, j, K = load.stiffness(u)
    out = np.zeros(scene.N)
    np.add.at(out, i, K * d[j])
    assert_allclose(out, slope(load.force), atol=1e-7 * np.abs(out).max())
    assert_allclose(load.mean_force(u, v) @ (v - u), load.potential(u) - load.potential(v),
                    rtol=1e-12)


def test_a_moving_force_on_the_face():
    """At each instant of a slow passage the deflection is that of the force at its place."""
    F, x = (40.0, -10.0), np.array([0.2, 0.5, 0.83, 1.0])
    run = cantilever().point_force(F, at=lambda t: (t, H / 2)).run(x, increments=1)
    for t, r in zip(run.t, run.displacement((1, 0))):
        fixed = cantilever().point_force(F, at=(t, H / 2)).solve_static()
        assert_allclose(r, fixed.displacement((1, 0)), rtol=1e-6, atol=1e-9)


def test_energy_is_conserved():
    scene = cantilever()
    scene.point_force((900.0, 0.0), at=(1, H / 2))
    history = scene.integrate(t_end=0.2, dt=2e-3)
    energy = history.total_energy
    assert np.ptp(history.strain_energy) > 0.01
    assert np.ptp(energy) < 1e-6 * np.ptp(history.strain_energy)


def test_it_is_drawn_and_found():
    scene = cantilever().add(PointForce((1, 0), at=(0.5, H / 2)))
    assert scene.plot() is not None


# follower forces


@pytest.mark.parametrize("angle", [0.0, 2.1])
@pytest.mark.parametrize("Y, F, x", [(H / 2, (-150.0, 0.0), 1.0), (-H / 2, (60.0, 250.0), 0.63),
                                     (0.3 * H, (100.0, -200.0), 0.5)])
@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamCable(3), ElementBeamANCF(2)],
                         ids=repr)
def test_a_follower_force_on_a_face_keeps_its_lever(element, Y, F, x, angle):
    """Moment and force of the clamp are those of the turned force at its place, as it lies."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 17), H, angle=angle)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    cable = not element.order
    scene = Scene(Beam(mesh, element, StVenantKirchhoff(E, 0.0, 1000.0), width=H)).clamp("left")
    scene.moment("right", 1.2 * EI)
    state = scene.follower_force(turn @ F, at=turn @ (x, Y)).solve_static()
    r = state.position(turn @ (x, 0.0 if cable else Y))
    a, b = (turn.T @ state.position(turn @ (z, 0.0)) for z in (x - 1e-5, min(x + 1e-5, 1.0)))
    a = np.arctan2(b[1] - a[1], b[0] - a[0])
    if cable:
        r = r + Y * turn @ [-np.sin(a), np.cos(a)]
    c, s = np.cos(a), np.sin(a)
    force = turn @ [c * F[0] - s * F[1], s * F[0] + c * F[1]]
    assert a > 0.4
    clamp = state.reactions("left")
    assert_allclose(clamp.force, -force, atol=5e-5 * np.hypot(*F))
    assert_allclose(clamp.moment, -1.2 * EI - (r[0] * force[1] - r[1] * force[0]),
                    atol=5e-5 * 1.2 * EI)


def test_the_couple_of_a_follower_force_bends_by_the_closed_form():
    """A couple -F h / 2 at x, in linear theory."""
    F, x = 20.0, 0.5
    linear = cantilever().follower_force((F, 0), at=(x, H / 2)).solve_linear()
    tip = -F * H / 2 * x * (2 - x) / (2 * EI)
    assert_allclose(linear.displacement((1, 0)), [F * x / EA, tip], rtol=1e-9)
    found = linear.resultants([(0.1, 0), (0.45, 0), (0.9, 0)])
    assert found.recovered
    assert_allclose(found.M, [-F * H / 2, -F * H / 2, 0.0], atol=1e-9 * F * H)


@pytest.mark.parametrize("at", [(0.63, -H / 2), (1.0, 0.2 * H)])
def test_the_tangent_of_a_follower_force_on_a_face(at):
    load, = cantilever().follower_force((30.0, -50.0), at=at).loads
    rng = np.random.default_rng(1)
    u, d = 0.1 * rng.standard_normal((2, load.beam.N))
    i, j, v = load.stiffness(u)
    K = np.zeros((load.beam.N, load.beam.N))
    np.add.at(K, (i, j), v)
    slope = (load.force(u + 1e-6 * d) - load.force(u - 1e-6 * d)) / 2e-6
    assert_allclose(K @ d, slope, atol=1e-7 * np.abs(slope).max())


def test_a_push_along_a_face_moves_the_angular_momentum_of_a_free_cable():
    """Force times distance from the centre of mass, while the force turns with the end."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), H)
    beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(1e3 * E, 0.0, 1000.0), width=H)
    F, mass = 400.0, 1000.0 * H**2
    history = Scene(beam).follower_force((F, 0.0), at=(0.5, H / 2)).integrate(0.2, 1e-3)
    inertia = mass / 12 * (1 + H**2)
    angle = -0.5 * F * H / 2 / inertia * history.t**2
    assert abs(angle[-1]) > 0.4
    ends = history.displacement((1, 0)) - history.displacement((0, 0)) + [1.0, 0.0]
    assert_allclose(np.arctan2(ends[:, 1], ends[:, 0]), angle, atol=2e-4)
