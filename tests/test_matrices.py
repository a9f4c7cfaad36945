"""Free degrees of freedom, bases and matrices of a scene, for solvers of one's own."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse
from scipy.optimize import root_scalar
from scipy.sparse.linalg import eigsh, spsolve
from skfem import BilinearForm, asm
from skfem.helpers import dot

from skfem_ancf import (Beam, Circle, ElementBeamANCF, ElementBeamCable, InputError, KelvinVoigt,
                        Line, MeshBeam, RigidBody, Scene, StVenantKirchhoff)

MATERIAL = StVenantKirchhoff(2e8, 0.0, 1000.0)


def beam(start=0.0, end=1.0, n=6, element=None, **options):
    mesh = MeshBeam.init_line(np.linspace(start, end, n + 1), 0.02)
    return Beam(mesh, element or ElementBeamANCF(2), MATERIAL, 0.02, **options)


def everything():
    """Two beams, hinged and damped in all ways, springs, moments, a rigid body."""
    a, b = beam(damping=KelvinVoigt(1e-4)), beam(1.0, 1.5, 4, element=ElementBeamCable(5))
    body = RigidBody(mass=0.1, inertia=1e-4, position=(1.5, 0.0))
    scene = Scene(a, b, body).clamp("left", a).gravity((0.0, -9.81))
    scene.hinge((1.0, 0.0))
    scene.hinge((b, (1.5, 0.0)), body)
    scene.spring(50.0, ((a, (0.5, 0.0)), (0.5, 0.2)), damping=2.0).moment("right", 0.01, a)
    return scene.drag(1.0, 1.0, 0.1).damping(0.3, 1e-5, modal=(0.02, 0.0))


def close(a, b, tol):
    assert_allclose(np.asarray(a), np.asarray(b), rtol=0, atol=tol * np.abs(b).max())


def test_frequencies_by_scipy_are_those_of_the_rod():
    """A clamped beam of Bernoulli: cos(x) cosh(x) = -1."""
    scene = Scene(beam(n=32)).clamp("left", thickness="free")
    M, _, K, force, J = scene.matrices()
    assert not force.any() and J.shape == (0, scene.N)
    K, M = (A[scene.free][:, scene.free].tocsc() for A in (K, M))
    squares = eigsh(K, k=3, M=M, sigma=0.0)[0]
    x = [root_scalar(lambda x: np.cos(x) * np.cosh(x) + 1, bracket=b).root
         for b in ((1, 3), (4, 6), (7, 9))]
    c = np.sqrt(MATERIAL.E * 0.02**2 / 12 / MATERIAL.density)
    assert_allclose(np.sqrt(squares), np.array(x)**2 * c, rtol=5e-3)


def test_matrices_are_derivatives():
    scene, rng = everything(), np.random.default_rng(0)
    history = scene.integrate(0.05, 1e-3, scheme="generalized-alpha")
    state = history.state(-1)
    M, D, K, force, J = scene.matrices(state)
    system, u, v, t = scene.system, state.u, state.v, state.t
    size = system.constraints.coordinate_sizes * rng.standard_normal(scene.N)

    def forces(u, v):
        out = system.external_force(u, t) - system.internal_force(u, t)
        return out - system.damping_force(u, v, t)

    def held(u):
        return forces(u, 0.0 * v) - state.multipliers @ system.constraints.sparse_jacobian(u, t)

    close(force, forces(u, v), 1e-14)
    d = 1e-6 * size
    close(K @ d, 0.5 * (held(u - d) - held(u + d)), 1e-6)
    close(D @ d, 0.5 * (forces(u, v - d) - forces(u, v + d)), 1e-6)
    phi = system.constraints.constraint
    close(J @ d, 0.5 * (phi(u + d, t) - phi(u - d, t)), 1e-6)
    motion = state.acceleration
    rest = (M @ motion - force + J.T @ state.multipliers)[scene.free]
    assert np.abs(rest).max() < 1e-2 * np.abs(force).max()


def test_newton_of_ones_own_finds_what_the_scene_finds():
    a, b = beam(), beam(1.0, 1.5, 4)
    scene = Scene(a, b).clamp("left", a).pin("right", b).gravity((0.0, -9.81))
    scene.hinge((1.0, 0.0))
    free, u, multipliers = scene.free, np.zeros(scene.N), np.zeros(2)
    for _ in range(20):
        _, _, K, force, J = scene.matrices(scene.state(u, multipliers))
        A = sparse.bmat([[K[free][:, free], J[:, free].T], [J[:, free], None]])
        x = spsolve(A.tocsc(), np.append((force - J.T @ multipliers)[free], -(J @ u)))
        u[free] += x[:len(free)]
        multipliers += x[len(free):]
    assert np.abs(x[:len(free)]).max() < 1e-10
    assert_allclose(u, scene.solve_static().u, rtol=0, atol=1e-8)


def test_the_basis_is_that_of_the_degrees_of_freedom():
    a, b = beam(), beam(1.0, 1.5, 4)
    scene = Scene(a, b).clamp("left", a).gravity((0.0, -9.81))
    scene.weld((1.0, 0.0))
    state, mass = scene.solve_static(), BilinearForm(lambda u, v, _: 20.0 * dot(u, v))
    for k in range(2):
        basis, first = scene.basis(k), scene.layout.offset(k)
        s = slice(first, first + basis.N)
        r = basis.interpolate(scene.beams[k].q0 + state.u[s])
        x = np.asarray(basis.default_parameters()["x"]).reshape(2, -1)
        close(np.asarray(r).reshape(2, -1), state.position(x, beam=k), 1e-10)
        close(scene.matrices().M[s][:, s].toarray(), asm(mass, basis).toarray(), 1e-12)
    assert set(range(scene.N)) - set(scene.free) == set(a.dofs("left", ["r", "r_Y0", "r_Y1"]))


def test_what_is_no_state_of_the_scene():
    scene = Scene(beam())
    for wrong in (np.zeros(scene.N), Scene(beam(n=3)).state()):
        with pytest.raises(InputError):
            scene.matrices(wrong)
    light = Scene(Beam(beam().mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.0), 0.02))
    assert light.matrices().M is None


def on_a_roller(friction, force):
    """A cantilever bent over a roller with friction."""
    h = 0.01
    mesh = MeshBeam.init_line(np.linspace(0, 1, 17), h)
    cantilever = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e9, 0.3), width=h)
    scene = Scene(cantilever).clamp("left").point_force((1.0, -force), at="right")
    return scene.obstacle(Circle((0.5, -0.1 - h / 2 - 0.002), 0.1), friction=friction)


@pytest.mark.parametrize("friction", [0.1, 5.0])
def test_matrices_have_the_friction_of_the_state(friction):
    """Its force is in balance, and it yields as its solution does when it is unloaded a little."""
    scene, less = on_a_roller(friction, 4.0), on_a_roller(friction, 4.0 - 1e-3)
    state = scene.solve_static()
    free, rubs = scene.free, state.contact().total[0]
    assert np.abs(scene.matrices(state).force[free]).max() < 1e-6 * abs(rubs)
    K, force = (less.matrices(state)[k] for k in (2, 3))
    change = (less.solve_static(start=state).u - state.u)[free]
    close(spsolve(K[free][:, free].tocsc(), force[free]), change, 1e-3)


@pytest.mark.parametrize("stiffness", [1e3, 1e4, 1e5, 1e7])
def test_statics_in_soft_contact_is_as_tight_as_without(stiffness):
    """A strip on a bed so soft that it sinks in by a quarter of its length, and on a hard one."""
    h = 0.01
    strip = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), h), ElementBeamCable(5), MATERIAL, h)
    scene = Scene(strip).clamp("left").line_load((0, -4.0))
    scene.obstacle(Line((0, -h / 2)), stiffness=stiffness)
    state = scene.solve_static()
    assert np.abs(scene.matrices(state).force[scene.free]).max() < 1e-7 * 4.0
    carried = state.contact().total[1] + state.reactions("left").force[1]
    assert carried == pytest.approx(4.0, rel=1e-7)
