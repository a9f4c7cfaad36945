"""Energy, force, tangent, mass and loads: three implementations, derivatives, rigid motion."""

from functools import lru_cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import Basis, BilinearForm, LinearForm, asm
from skfem.helpers import ddot, dot

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, ElementBeamPatelShabana, MeshBeam,
                        NeoHookean, Scene, Section, StVenantKirchhoff, forms,
                        reference_coordinates)
from skfem_ancf.actions.loads import EndMoment, Pressure
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.formulations import FORMULATIONS

hypothesis = pytest.importorskip("hypothesis")
given, settings, st = hypothesis.given, hypothesis.settings, hypothesis.strategies

STEP = 1e-30
BODIES = {
    "straight": lambda: MeshBeam.init_line([0.0, 0.5, 1.0, 1.5], 0.2),
    "unequal": lambda: MeshBeam.init_line([-1.0, -0.7, 0.3, 1.1], 0.3),
    "inclined": lambda: MeshBeam.init_line([0.0, 0.4, 1.1], 0.25, origin=(3.0, -2.0), angle=2.3),
    "arc": lambda: MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                       np.linspace(0.0, np.pi / 2, 4), 0.3),
}
SHAPES = {"1": ElementBeamANCF(1), "2": ElementBeamANCF(2), "3": ElementBeamANCF(3),
          "5": ElementBeamANCF(5), "ps": ElementBeamPatelShabana()}
LAWS = {"svk": StVenantKirchhoff(2.0, 0.3, density=1.7),
        "svk-strain": StVenantKirchhoff(2.0, 0.45, density=1.7, plane="strain"),
        "neo": NeoHookean(2.0, 0.3, density=1.7, plane="strain")}
WIDTH = 0.4


@lru_cache(None)
def make(body, element="3", law="svk", formulation="continuum"):
    shape = SHAPES[element] if element in SHAPES else ELEMENTS[element]()
    return Beam(BODIES[body](), shape, LAWS[law], WIDTH, formulation)


def deformed(beam, size=0.05, seed=0):
    """A displacement with gradients of about ``size``, the same field for every element."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-1, 1, (beam.N // beam.nd, beam.nd // 2, 2))
    scale = np.array([beam.mesh.lengths.min()] + [
        beam.mesh.height ** min(0, 1 - f[2]) for f in beam.element.functionals[1:]])
    return (size * u * scale[:, None]).ravel()


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def turn(q, angle):
    return (q.reshape(-1, 2) @ rotation(angle).T).ravel()


def moved(beam, u, angle, shift):
    """The displacement after the deformed state ``u`` is turned and shifted."""
    q = turn(beam.q0 + u, angle).reshape(-1, beam.nd // 2, 2)
    q[:, 0] += shift
    return q.ravel() - beam.q0


def dense(beam, tangents):
    """Element tangents of the kernel as one dense matrix."""
    K = np.zeros((beam.N, beam.N))
    for k, Ke in enumerate(tangents):
        i = beam.mesh.t[0, k] * beam.nd + np.arange(2 * beam.nd)
        K[np.ix_(i, i)] += Ke
    return K


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


# three implementations


@pytest.mark.parametrize("body", BODIES)
def test_stock_basis_and_stock_assembly(body):
    """The user's own forms beside the package's, on a Basis with scikit-fem's own quadrature."""
    beam = make(body)
    basis = Basis(beam.mesh, beam.basis.elem)
    q = reference_coordinates(basis) + deformed(beam)
    assert_allclose(reference_coordinates(basis), beam.q0)

    @BilinearForm
    def bedding(u, v, w):
        return 3.0 * dot(u, v)

    @LinearForm
    def bedding_force(v, w):
        return 3.0 * dot(w.r, v)

    @BilinearForm
    def laplace(u, v, w):
        return ddot(u.grad, v.grad)

    K = asm(forms.tangent(beam.material, WIDTH), basis, r=q)
    B = asm(bedding, basis)
    assert B.shape == K.shape == (beam.N, beam.N)
    free, bedded = (np.linalg.eigvalsh(A.toarray()) for A in (K, K + B))
    assert free[0] < 1e-12 * free[-1] < 1e-9 * free[-1] < bedded[0]
    assert_allclose(asm(bedding_force, basis, r=q), B @ q, atol=1e-13)
    assert_allclose(B.toarray(), 3.0 / 1.7 / WIDTH * asm(forms.mass(1.7, WIDTH), basis).toarray(),
                    atol=1e-15)
    # int grad v : 1 : grad u is a ModuliForm with A = identity
    identity = np.einsum("ik,jl->ijkl", np.eye(2), np.eye(2))[..., None, None]

    @forms.ModuliForm
    def moduli(w):
        return identity * np.ones_like(w.x[0])

    @forms.StressForm
    def stress(w):
        return w.r.grad

    A = asm(laplace, basis)
    assert abs(A - asm(moduli, basis)).max() < 1e-13 * abs(A).max()
    assert_allclose(asm(stress, basis, r=q), A @ q, atol=1e-13 * abs(A).max())


@pytest.mark.parametrize("law", LAWS)
def test_forms_are_derivatives_of_each_other(law):
    """Complex step through scikit-fem's own assembly of the forms."""
    beam = make("arc", "2", law)
    q, args = beam.q0 + deformed(beam), (beam.material, WIDTH, 0.85)
    f = asm(forms.internal_force(*args), beam.basis, r=q)
    K = asm(forms.tangent(*args), beam.basis, r=q).toarray()
    d = np.random.default_rng(1).uniform(-1, 1, beam.N)
    # stock interpolation of complex coordinates, real and imaginary part
    field = beam.basis.interpolate(q)
    change = beam.basis.interpolate(d)
    F = field.grad + 1j * STEP * change.grad
    frame = beam.mesh.mapping().frame(beam.basis.X)
    eps = forms.green_lagrange(np.einsum("ij...,jJ...->iJ...", F, frame))
    W = WIDTH * np.sum(beam.material.law(0.85).energy(eps) * beam.basis.dx)
    assert abs(W.imag / STEP - f @ d) < 1e-12 * np.abs(f).max()
    h = 1e-6
    fp, fm = (asm(forms.internal_force(*args), beam.basis, r=q + s * h * d) for s in (1, -1))
    assert relative((fp - fm) / (2 * h), K @ d) < 1e-8


# derivatives, for every formulation

CASES = [(f, "svk") for f in FORMULATIONS] + [("assumed", "svk-strain")]


# rigid motion and objectivity

MOTIONS = dict(angle=st.floats(-20.0, 20.0),
               shift=st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)))


@pytest.mark.parametrize("element", [name for name in ELEMENTS if name[-1] not in "789"])
@pytest.mark.parametrize("formulation, law", CASES)
@settings(max_examples=5, deadline=None, derandomize=True)
@given(**MOTIONS)
def test_rigid_motion_costs_nothing(formulation, element, angle, shift, law):
    for body in ("unequal", "arc"):
        beam = make(body, element, law, formulation)
        u = moved(beam, 0.0, angle, np.array(shift))
        f, scale = beam.kernel.force(u), np.abs(beam.kernel.tangents(0 * u)).max()
        assert np.abs(f).max() < 1e-14 * scale * (1 + np.abs(u).max())
        # a stabilisation u^T K u cancels less well than the square of a strain
        floor = 1e-16 * scale * (1 + np.abs(u).max()) ** 2
        floor = 1e-26 if beam.kernel.constant is None else floor
        assert abs(beam.kernel.energy(u)) < floor
        X = np.array([[0.0, 0.3, 1.0, 0.5], [0.0, 0.8, 1.0, 0.5]])
        assert np.abs(beam.strain(u, X)).max() < 1e-11


@pytest.mark.parametrize("element", SHAPES)
@pytest.mark.parametrize("formulation, law", CASES)
@settings(max_examples=5, deadline=None, derandomize=True)
@given(**MOTIONS)
def test_objectivity(formulation, element, angle, shift, law):
    """Turning a deformed state turns its force and keeps its energy, strain and stiffness."""
    X = np.array([[0.1, 0.9], [0.2, 1.0]])
    for body in ("inclined", "arc"):
        beam = make(body, element, law, formulation)
        u = deformed(beam)
        v = moved(beam, u, angle, np.array(shift))
        f, W = beam.kernel.force(u), beam.kernel.energy(u)
        assert relative(beam.kernel.force(v), turn(f, angle)) < 1e-11
        assert abs(beam.kernel.energy(v) - W) < 1e-11 * W
        assert_allclose(beam.strain(v, X), beam.strain(u, X), atol=1e-12)
        K, Kv = (dense(beam, beam.kernel.tangents(w)) for w in (u, v))
        T = np.kron(np.eye(beam.N // 2), rotation(angle))
        assert relative(Kv, T @ K @ T.T) < 1e-11
        # the force is in balance whatever the state
        q = (beam.q0 + u).reshape(-1, 2)
        g = f.reshape(-1, 2)
        size = np.abs(g).sum() * np.abs(q).max()
        assert np.abs(f.reshape(-1, beam.nd // 2, 2)[:, 0].sum(axis=0)).max() < 1e-13 * size
        assert abs(np.sum(q[:, 0] * g[:, 1] - q[:, 1] * g[:, 0])) < 1e-13 * size


@pytest.mark.parametrize("formulation, law", CASES)
@pytest.mark.parametrize("element", SHAPES)
@pytest.mark.parametrize("body", ["straight", "arc"])
def test_three_zero_modes(body, element, formulation, law):
    """The stress-free tangent is positive but for the rigid motions."""
    beam = make(body, element, law, formulation)
    K = dense(beam, beam.kernel.tangents(np.zeros(beam.N)))
    M = beam.mass().toarray()
    C = np.linalg.inv(np.linalg.cholesky(M))
    values = np.linalg.eigvalsh(C @ K @ C.T)
    assert np.abs(values[:3]).max() < 1e-9 * values[3] + 1e-13 * values[-1]
    assert values[3] > 1e-3  # omega^2 of the first bending mode, E = 2
    assert np.abs(K @ beam.rigid_motions()).max() < 1e-13 * np.abs(K).max()


# mass and dead loads

@pytest.mark.parametrize("element", SHAPES)
@pytest.mark.parametrize("body", BODIES)
def test_mass(body, element):
    beam = make(body, element)
    M, mesh = beam.mass().toarray(), beam.mesh
    T = beam.rigid_motions()
    # stock volumes of an arc are those of a body that is thinner between nodes
    fine = (Basis(mesh, beam.basis.elem, intorder=20) if mesh.is_straight else
            beam.exact_basis())
    assert relative(M, asm(forms.mass(1.7, WIDTH), fine).toarray()) < 1e-12
    assert relative(M.T, M) < 1e-15
    assert np.linalg.eigvalsh(M)[0] > 0
    # momentum and rotation about the origin of the beam
    x = np.asarray(fine.global_coordinates()) - beam.origin[:, None, None]
    m, J = (1.7 * WIDTH * np.sum(value * fine.dx) for value in (1.0, x[0] ** 2 + x[1] ** 2))
    moments = 1.7 * WIDTH * np.sum(x * fine.dx, axis=(1, 2))
    assert_allclose(T.T @ M @ T, [[m, 0, -moments[1]], [0, m, moments[0]],
                                  [-moments[1], moments[0], J]], atol=1e-13 * m)
    assert abs(beam.total_mass - m) < 1e-13 * m
    if mesh.is_straight:
        h, L = mesh.height, mesh.lengths.sum()
        assert abs(m - 1.7 * WIDTH * h * L) < 1e-14
        about_middle = J - (moments @ moments) / m
        assert abs(about_middle - 1.7 * WIDTH * (h * L**3 + h**3 * L) / 12) < 1e-13


ARC = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]), np.linspace(0, 1, 6), 0.1)
STEEL = StVenantKirchhoff(2e11, 0.3, density=7800.0)


@pytest.mark.parametrize("element", [*SHAPES.values(), ElementBeamCable(3)], ids=repr)
def test_an_arc_weighs_what_its_area_and_length_say(element):
    """At 0.2 rad an element: mass, weight, reactions and section forces."""
    beam, g = Beam(ARC, element, STEEL, 0.05), 9.81
    mass = 7800.0 * 0.05 * 0.1
    T, M = beam.rigid_motions()[:, :2], beam.mass()
    assert_allclose(beam.total_mass, mass, rtol=3e-6)
    assert_allclose(T.T @ M @ T, beam.total_mass * np.eye(2), atol=1e-11 * mass)
    own = LinearForm(lambda v, w: -7800.0 * 0.05 * g * v[1])
    for scene, close in ((Scene(beam).gravity((0, -g)), 1e-12), (Scene(beam).load(own), 1e-7)):
        assert_allclose(T.T @ scene.loads[0].force(None), [0, -g * beam.total_mass], rtol=close,
                        atol=1e-9)
        state = scene.clamp("left").solve_static()
        assert_allclose(state.reactions("left").force, [0, g * mass], rtol=3e-6, atol=1e-5)
        forces = state.resultants()
        assert_allclose(forces.force[:, 0], [0, -g * mass], rtol=4e-6, atol=1e-3)
        assert_allclose(forces.M[0], g * mass * (1 - np.sin(1.0)), rtol=1e-2)


@pytest.mark.parametrize("options", [
    {"width": 0.05}, {"width": lambda x, y: 0.05 + 0.0 * x},
    {"section": Section.profile("rectangle", width=0.05)}], ids=["number", "function", "section"])
def test_a_curved_cable_weighs_at_its_centroid_and_a_form_acts_on_its_axis(options):
    """Slices of an arc of radius 1 have their centroid h^2 / 12 outside of the axis."""
    weight, couple = 7800.0 * 0.05 * 0.1 * 9.81, 0.1**2 / 12 * np.sin(1.0)
    own = LinearForm(lambda v, w: -7800.0 * 0.05 * 9.81 * v[1])
    scene = Scene(Beam(ARC, ElementBeamCable(5), STEEL, **options)).clamp("left")
    for loaded, arm in ((scene.replace().gravity((0, -9.81)), 1 - np.sin(1.0) - couple),
                        (scene.replace().load(own), 1 - np.sin(1.0))):
        state = loaded.solve_static()
        assert state.recovered == {0: ""}
        forces = state.resultants()
        assert_allclose(forces.force[:, 0], [0, -weight], rtol=4e-6, atol=1e-6 * weight)
        assert_allclose(forces.M[0], weight * arm, rtol=1e-4)  # the couple is 4.4e-3 of it
        assert_allclose(state.reactions("left").force, [0, weight], rtol=4e-6, atol=1e-6 * weight)


# follower loads

ENDS = ["left", "right", "top", "bottom"]


@pytest.mark.parametrize("element", SHAPES)
@pytest.mark.parametrize("body", BODIES)
def test_pressure_on_a_closed_surface(body, element):
    """Its force is minus p times the derivative of the deformed area; it has no resultant."""
    beam, p = make(body, element), 0.7
    facets = np.concatenate([beam.mesh.boundaries[name] for name in ENDS])
    load = Pressure(facets, p).bind(beam)
    u = deformed(beam, 0.1)
    f = load.force(u)

    X, W = beam.basis.X, beam.basis.dx

    def area(u):
        H, frame = beam.gradients(u, X)
        F = H + frame
        return WIDTH * np.sum((F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]) * W)

    h = 1e-6  # the area is quadratic in u: central differences are exact up to round-off
    gradient = np.array([(area(u + h * e) - area(u - h * e)) / (2 * h) for e in np.eye(beam.N)])
    assert np.abs(f + p * gradient).max() < 1e-9
    assert np.abs(beam.rigid_motions()[:, :2].T @ f).max() < 1e-14
    q, g = (beam.q0 + u).reshape(-1, 2), f.reshape(-1, 2)
    assert abs(np.sum(q[:, 0] * g[:, 1] - q[:, 1] * g[:, 0])) < 1e-13


def test_end_moment_counts_whole_turns():
    """A beam rolled up k times: the potential is -M times the whole angle."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 33), 0.01)
    beam = Beam(mesh, ElementBeamANCF(2), LAWS["svk"], 1.0)
    x = beam.mesh.p[0]
    for turns in (0.2, -0.9, 1.6, -3.3):
        angle = 2 * np.pi * turns * x
        q = beam.q0.reshape(-1, beam.nd // 2, 2).copy()
        c, s = np.cos(angle), np.sin(angle)
        q[:, 1] = np.array([c, s]).T
        q[:, 2:] = np.array([-s, c]).T[:, None]
        load = EndMoment("right", 2.0).bind(beam)
        assert abs(load.potential(q.ravel() - beam.q0) + 4 * np.pi * turns) < 1e-12
