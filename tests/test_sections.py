"""Profiles, layers and numbers: against beam theory, and scikit-fem's Q2 elements in the plane."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp
from skfem import (Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm,
                   MeshQuad, asm, condense, solve)
from skfem.helpers import sym_grad

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, ModelWarning, NameUnknown, NeoHookean, Scene, Section,
                        StVenantKirchhoff)
from skfem_ancf.beam.kinematics import locate
from skfem_ancf.core.errors import CallError
from skfem_ancf.core.quadrature import gauss
from skfem_ancf.materials.base import hooke

H = 0.1
STEEL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
PLAIN = StVenantKirchhoff(E=2e8, nu=0.0, density=7800)
BRASS = StVenantKirchhoff(E=1e8, nu=0.35, density=8500)
FOAM = StVenantKirchhoff(E=2e6, nu=0.3, density=100)
PROFILES = {
    "I": (Section.profile("I", width=0.06, web=0.01, flange=0.015), 0.0025,
          (0.06 * H**3 - 0.05 * 0.07**3) / 12),
    "box": (Section.profile("box", width=0.06, wall=0.01), 0.0028,
            (0.06 * H**3 - 0.04 * 0.08**3) / 12),
    "tube": (Section.profile("tube", wall=0.01), np.pi * 9e-4, np.pi * (0.05**4 - 0.04**4) / 4),
    "circle": (Section.profile("circle"), np.pi * 0.0025, np.pi * 0.05**4 / 4),
    "rectangle": (Section.profile("rectangle", width=0.03), 0.003, 0.03 * H**3 / 12),
}
profiles = pytest.mark.parametrize("section, area, second", PROFILES.values(), ids=PROFILES)
ELEMENTS = {"order 1": ElementBeamANCF(1), "order 2": ElementBeamANCF(2),
            "order 3": ElementBeamANCF(3), "cubic": ElementBeamANCFCubic(2),
            "quintic cable": ElementBeamCable(5)}
every = pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS)


def line(n=16, h=H, L=1.0):
    return MeshBeam.init_line(np.linspace(0, L, n + 1), height=h)


def cantilever(beam, force=None, moment=None):
    scene = Scene(beam).clamp("left")
    if force is not None:
        scene.point_force(force, at=(float(beam.mesh.p[0, -1]), 0.0))
    if moment is not None:
        scene.moment("right", moment)
    return scene.solve_static()


def straight(pieces):
    """Where pieces of a beam of constant height begin and end."""
    y = np.array([pieces[0][0], *(p[1] for p in pieces)])
    return lambda x: np.repeat(y[:, None], len(x), axis=1)


def plane(pieces, length, force, n=(80, 4), ends=None):
    """Displacement and stress at points of a clamped body of linear elasticity, pulled at x = L.

    pieces: (bottom, top, material, width), from the bottom; force: the whole of it; ends: a
    function of x (n,) that returns where pieces begin and end, (npieces + 1, n), of tapers.
    """
    ends = ends or straight(pieces)
    number = len(pieces)
    y = np.linspace(0, number, number * n[1] + 1)  # by the piece
    mesh = MeshQuad.init_tensor(np.linspace(0, length, n[0] + 1), y).with_boundaries(
        {"left": lambda x: x[0] == 0, "right": lambda x: np.isclose(x[0], length)})
    of = mesh.p[1][mesh.t].mean(axis=0).astype(int)
    k = np.minimum(mesh.p[1].astype(int), number - 1)
    Y, z = ends(mesh.p[0]), mesh.p[1] - k
    Y = (1 - z) * np.take_along_axis(Y, k[None], 0)[0] + z * np.take_along_axis(
        Y, k[None] + 1, 0)[0]
    mesh = replace(mesh, doflocs=np.array([mesh.p[0], Y]))
    basis = Basis(mesh, ElementVector(ElementQuad2()))

    def voigt(u):
        e = sym_grad(u)
        return np.array([e[0, 0], e[1, 1], 2 * e[0, 1]])

    D = np.moveaxis(np.array([p[3] * hooke(p[2].E, p[2].nu, "stress") for p in pieces])[of], 0, -1)

    @BilinearForm
    def stiffness(u, v, w):
        return np.sum(voigt(v) * np.einsum("ije,jeq->ieq", D, voigt(u)), axis=0)

    width = np.array([p[3] for p in pieces])
    area = np.diff(ends(np.array([length]))[:, 0]) @ width
    at = width[of[mesh.f2t[0, mesh.boundaries["right"]]], None] / area

    @LinearForm
    def load(v, w):
        return at * (force[0] * v[0] + force[1] * v[1])

    K = asm(stiffness, basis)
    f = asm(load, FacetBasis(mesh, ElementVector(ElementQuad2()), facets="right", intorder=6))
    u = solve(*condense(K, f, D=basis.get_dofs("left")))
    return mesh, basis, u


def axis_tip(basis, u, length):
    return (basis.probes(np.array([[length - 1e-12], [0.0]])) @ u).reshape(2)


@every
@profiles
def test_mass_bending_and_extension_of_profiles(element, section, area, second):
    beam = Beam(line(), element, PLAIN, section=section)
    assert beam.total_mass == pytest.approx(7800 * area, rel=1e-12)
    spin = np.stack([-beam.q0.reshape(-1, 2)[:, 1], beam.q0.reshape(-1, 2)[:, 0]], 1).ravel()
    assert spin @ (beam.mass() @ spin) == pytest.approx(7800 * (area / 3 + second), rel=1e-12)
    state = cantilever(beam, moment=1.0)
    # the moment's traction is linear in Y, not that of the width: there is a boundary layer
    assert state.displacement((1, 0))[1] == pytest.approx(0.5 / (2e8 * second), rel=2e-3)
    found = state.resultants((0.5, 0.0), recover=False)
    assert found.M == pytest.approx(1.0, rel=1e-4) and abs(found.N) < 1e-3
    pulled = Scene(beam).clamp("left").traction("right", (1.0 / area, 0.0)).solve_static()
    assert pulled.displacement((1, 0))[0] == pytest.approx(1.0 / (2e8 * area), rel=1e-5)


@pytest.mark.parametrize("name", ["I", "box", "tube"])
@pytest.mark.parametrize("ratio", [30.0, 1e3, 1e4])
def test_slender_profiles_are_beams(name, ratio):
    """Deflection against P L^3 / 3 E I; the shear of the rest falls with (h / L)^2."""
    section, _, second = PROFILES[name]
    L = H * ratio
    P = 1e-4 * 2e8 * second / L**2
    for element in (ElementBeamANCFCubic(2), ElementBeamCable(5)):
        state = cantilever(Beam(line(32, L=L), element, PLAIN, section=section), (0.0, -P))
        error = -state.displacement((L, 0))[1] / (P * L**3 / (3 * 2e8 * second)) - 1
        # with a small rotation of 5e-5
        assert abs(error) < (2e-9 if not element.order else 3e-7 + 4.0 / ratio**2)


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCFCubic(2),
                                     ElementBeamANCFCubic(3), ElementBeamANCFCubic(5)])
@pytest.mark.parametrize("length, pieces, section", [
    (0.5, [(-0.05, -0.035, PLAIN, 0.06), (-0.035, 0.035, PLAIN, 0.01), (0.035, 0.05, PLAIN, 0.06)],
     PROFILES["I"][0]),
    (0.5, [(-0.05, 0.035, PLAIN, 0.01), (0.035, 0.05, PLAIN, 0.06)],
     Section.profile("T", width=0.06, web=0.01, flange=0.015)),
])
def test_short_profiles_shear_as_the_plane_body(element, length, pieces, section):
    """Tip of the body whose width depends on Y, plane stress: bending, shear and their coupling."""
    P = 1e-2
    _, basis, u = plane(pieces, length, (0.0, -P))
    wanted = axis_tip(basis, u, length)
    beam = Beam(line(40, L=length), element, PLAIN, section=section)
    found = cantilever(beam, (0.0, -P)).displacement((length, 0.0))
    assert_allclose(found[1], wanted[1], rtol=6e-3)  # the load is on the axis
    if abs(wanted[0]) > 1e-12:
        assert_allclose(found[0], wanted[0], rtol=1e-2)


def test_extension_and_bending_of_a_T_are_coupled():
    """Moment and force on the axis: [EA, -ES; -ES, EI] times strain and curvature."""
    section = Section.profile("T", width=0.06, web=0.01, flange=0.015)
    a, b = 0.06 * 0.015, 0.01 * 0.085
    S = a * 0.0425 - b * 0.0075
    second = 0.06 * 0.015**3 / 12 + a * 0.0425**2 + 0.01 * 0.085**3 / 12 + b * 0.0075**2
    K = 2e8 * np.array([[a + b, -S], [-S, second]])
    for element in (ElementBeamANCF(2), ElementBeamANCFCubic(1), ElementBeamCable(3),
                    ElementBeamCable(5)):
        beam = Beam(line(L=5.0), element, PLAIN, section=section)
        scene = Scene(beam).clamp("left").moment("right", 3e-4)
        N, M = 2e-3, 3e-4
        if beam.has_sections:  # a traction acts at the centroid, a point force on the axis alone
            scene.traction("right", (N / (a + b), 0.0))
            M -= N * S / (a + b)
        else:
            scene.point_force((N, 0.0), at=(5.0, 0.0))
        state, (eps, kappa) = scene.solve_static(), np.linalg.solve(K, [N, M])
        # boundary layers of the length H
        assert_allclose(state.displacement((5.0, 0.0)), [5.0 * eps, 12.5 * kappa], rtol=1e-2)
        own = state.resultants((2.5, 0.0), recover=False)
        assert_allclose([own.N, own.M], [N, M], rtol=5e-3)
        # the weight acts at the centroid: on a beam that stands it bends
        up = beam.weight((1.0, 0.0)) @ np.stack(
            [-beam.q0.reshape(-1, 2)[:, 1], beam.q0.reshape(-1, 2)[:, 0]], 1).ravel()
        assert up == pytest.approx(-7800 * 5.0 * S, rel=1e-10)


SANDWICH = Section.layers((0.01, STEEL), (0.08, FOAM), (0.01, STEEL), width=0.02)
BIMETAL = Section.layers((0.04, STEEL), (0.06, BRASS), width=0.02)


@pytest.mark.parametrize("element, n, error", [
    (ElementBeamANCF(2), 32, 8e-4), (ElementBeamANCFCubic(2), 16, 1.2e-3),
    (ElementBeamCable(5), 16, 0.0)], ids=repr)
def test_layers_do_not_lock(element, n, error):
    """Under gravity with E h^2 constant, against the elastica of the composite section.

    What bending stretches and the axis off the centroid fall with h / L.
    """
    y, moduli = np.array([-0.5, -0.1, 0.5]), np.array([4.0, 1.0])
    EA, ES, EI = (moduli @ (y[1:]**k - y[:-1]**k) / k for k in (1, 2, 3))
    EI = 2e4 * (EI - ES**2 / EA)

    def rates(x, y):
        return np.array([y[1] / EI, 7800 * 9.81 * (1.0 - x) * np.cos(y[0]), np.sin(y[0])])

    x = np.linspace(0, 1, 50)
    limit = solve_bvp(rates, lambda a, b: np.array([a[0], b[1], a[2]]), x, np.array([
        -x, 0.0 * x, -x * x]), tol=1e-10, max_nodes=20000).sol(1.0)[2]
    for ratio in (1e2, 1e3, 1e4, 1e5, 1e6):
        h = 1.0 / ratio
        stiff, soft = (StVenantKirchhoff(k * 2e4 * ratio**2, 0.3, density=7800) for k in moduli)
        section = Section.layers((0.4 * h, stiff), (0.6 * h, soft), width=0.01)
        mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), height=h)
        state = Scene(Beam(mesh, element, section=section)).clamp("left").gravity(
            (0, -9.81)).solve_static()
        assert state.displacement((1, 0))[1] == pytest.approx(limit, rel=error + 0.3 / ratio)
        # at 1e6 the last corrections are round-off of the stretch
        assert state.iterations <= (36 if ratio < 1e6 else 60)


def test_a_sandwich_shears_as_the_plane_body_and_its_stress_jumps():
    P, L = 1e-3, 1.0
    pieces, y = [], -0.05
    for thickness, law, b in SANDWICH.parts:
        pieces.append((y, y + thickness, law, b))
        y += thickness
    _, basis, u = plane(pieces, L, (0.0, -P), n=(120, 4))
    wanted = axis_tip(basis, u, L)[1]
    for element, error in ((ElementBeamANCFCubic(2), 0.03), (ElementBeamANCFCubic(5), 0.03)):
        beam = Beam(line(60), element, section=SANDWICH)
        state = cantilever(beam, (0.0, -P))
        assert state.displacement((L, 0.0))[1] == pytest.approx(wanted, rel=error)
        Y = np.array([-0.0499, -0.0401, -0.0399, 0.0, 0.0399, 0.0401, 0.0499])
        x = np.array([0.5 + 0.0 * Y, Y])
        sxx = plane_stress(basis, u, x, pieces)[0]
        found = beam.stress(state.u, *_reference(beam, x))[0, :, 0]
        assert_allclose(found, sxx, atol=0.03 * np.abs(sxx).max())


def _reference(beam, x):
    e, X = zip(*(locate(beam, p) for p in x.T))
    return np.array(X).T[:, :, None], np.array(e)


def plane_stress(basis, u, x, pieces, ends=None):
    """Stress of the plane body at points, by the elements that hold them."""
    cells = basis.mesh.element_finder()(*x)
    X = basis.mapping.invF(x[:, :, None], tind=cells)
    grads = sum(u[basis.element_dofs[k, cells]][None, None, :, None] * basis.elem.gbasis(
        basis.mapping, X, k, tind=cells)[0].grad for k in range(basis.Nbfun))[..., 0]
    e = np.array([grads[0, 0], grads[1, 1], grads[0, 1] + grads[1, 0]])
    which = np.sum(x[1] >= (ends or straight(pieces))(x[0])[1:-1], axis=0)
    D = np.array([hooke(p[2].E, p[2].nu, "stress") for p in pieces])[which]
    return np.einsum("nij,jn->in", D, e)


def test_graded_moduli_and_densities():
    """E and rho as functions of (x, y): against integrals over the section."""
    law = StVenantKirchhoff(E=lambda x, y: 1e8 * (1 + x) * np.exp(10 * y), nu=0.0,
                            density=lambda x, y: 1000.0 * (1 + 2 * x + y))
    y, w = gauss(20)
    y, w = H * (y - 0.5), H * w
    EA, ES, EI = (0.02 * np.sum(w * 1e8 * np.exp(10 * y) * y**k) for k in range(3))
    x, v = gauss(20)
    bent = np.sum(v * (1 - x) / (1 + x)) / (EI - ES**2 / EA)
    for element in (ElementBeamANCF(2), ElementBeamANCFCubic(2), ElementBeamCable(5)):
        beam = Beam(line(), element, law, width=0.02)
        assert beam.total_mass == pytest.approx(1000 * 0.02 * H * 2, rel=1e-12)
        state = cantilever(beam, moment=0.1)
        assert state.displacement((1, 0))[1] == pytest.approx(0.1 * bent, rel=1e-3)
        S = beam.stress(state.u, np.array([[0.5], [0.9]]), np.array([8]))[0, 0, 0]
        eps = beam.strain(state.u, np.array([[0.5], [0.9]]), np.array([8]))[0, 0, 0]
        E = law.E(0.5 * (mesh_x(beam, 8) + mesh_x(beam, 9)), 0.04)
        stretch = np.sqrt(1 + 2 * eps)  # of a cable S = E (stretch - 1) / stretch
        law_of = eps if element.order else (stretch - 1) / stretch
        assert S == pytest.approx(E * law_of, rel=1e-9)
    scene = Scene(Beam(line(), "auto", law, width=0.02)).clamp("left").gravity((0, -1e-3))
    assert scene.modes(1, scene.solve_static()).frequencies[0] == pytest.approx(
        scene.modes(1).frequencies[0], rel=1e-3)
    soft = NeoHookean(E=law.E, nu=0.3)
    assert Beam(line(4), ElementBeamANCF(2), soft, width=0.02).kernel.energy(
        1e-3 * np.ones(40)) >= 0


def mesh_x(beam, node):
    return float(beam.mesh.p[0, node])


@every
def test_sections_by_their_numbers(element):
    """Bending, extension and shear are those given, and so are mass and rotary inertia."""
    EA, EI, GA = 1e6, 40.0, 2e5
    section = Section.numbers(EA=EA, EI=EI, GA=GA, rhoA=3.0, rhoI=0.01)
    beam = Beam(line(64, h=0.02), element, section=section)
    pulled = Scene(beam).clamp("left").traction("right", (1e-3 / 0.02, 0.0)).solve_static()
    assert pulled.displacement((1, 0))[0] == pytest.approx(1e-3 / EA, rel=1e-5)
    tip = cantilever(beam, (0.0, 1e-3)).displacement((1, 0))[1]
    sheared = 1.0 / GA if beam.has_sections else 0.0
    assert tip == pytest.approx(1e-3 * (1 / (3 * EI) + sheared), rel=1e-4)
    spin = np.stack([-beam.q0.reshape(-1, 2)[:, 1], beam.q0.reshape(-1, 2)[:, 0]], 1).ravel()
    assert spin @ (beam.mass() @ spin) == pytest.approx(3.0 / 3 + 0.01, rel=1e-12)


def test_a_cable_says_that_it_does_not_shear():
    """GA of 3 EI / L^2 doubles the deflection of a cantilever, 1e4 times as much does not."""
    mesh, EI = line(4, h=0.02), 40.0
    with pytest.warns(ModelWarning, match="no shear deformation and ignores GA=120 .* 100.0%"):
        Beam(mesh, ElementBeamCable(5), section=Section.numbers(EA=1e6, EI=EI, GA=3 * EI))
    soft = Section.numbers(EA=1e6, EI=EI, GA=3 * EI)
    Beam(mesh, ElementBeamANCFCubic(2), section=soft)
    for GA in (None, 3e4 * EI):
        Beam(mesh, ElementBeamCable(5), section=Section.numbers(EA=1e6, EI=EI, GA=GA))


@pytest.mark.parametrize("make, kind, words", [
    (lambda: Section.profile("J", width=1), NameUnknown, "profile"),
    (lambda: Section.profile("I", width=1), CallError, "web"),
    (lambda: Section.profile("I", width=0.01, web=0.02, flange=0.01), InputError, "wider"),
    (lambda: Section.profile("tube", wall=-1.0), InputError, "positive"),
    (lambda: Section.layers(), InputError, "no layers"),
    (lambda: Section.layers((0.1, 3.0), width=1.0), InputError, "layer 0"),
    (lambda: Section.layers((-0.1, STEEL), width=1.0), InputError, "thickness of layer 0"),
    (lambda: Section.layers((0.1, STEEL)), InputError, "layer 0 has no width: give width="),
    (lambda: Section.layers((0.1, STEEL, -1.0)), InputError, "width of layer 0"),
    (lambda: Section.layers((0.1, STEEL), (0.1, STEEL.replace(plane="strain")), width=1.0),
     InputError, "plane"),
    (lambda: Section.numbers(EA=1.0, EI=0.0), InputError, "EI"),
    (lambda: Section.numbers(EA=1.0, EI=1.0, rhoI=1.0), InputError, "rhoA"),
    (lambda: Beam(line(), ElementBeamANCF(2), STEEL, 0.1, section=PROFILES["I"][0]), InputError,
     "not both"),
    (lambda: Beam(line(), ElementBeamANCF(2), section=PROFILES["I"][0]), InputError, "material"),
    (lambda: Beam(line(), ElementBeamANCF(2), STEEL, section=BIMETAL), InputError, "its own"),
    (lambda: Beam(line(h=0.2), ElementBeamANCF(2), section=BIMETAL), InputError, "fills the rest"),
    (lambda: Beam(line(h=0.03), ElementBeamANCF(2), STEEL, section=PROFILES["I"][0]), InputError,
     "do not fit"),
    (lambda: Beam(line(), ElementBeamANCF(2), STEEL, section="I"), InputError, "Section.profile"),
    (lambda: Beam(line(), ElementBeamCable(3), section=Section.layers(
        (H, NeoHookean(1e6, 0.3)), width=1.0)), InputError, "Hooke"),
    (lambda: Scene(Beam(line(), ElementBeamANCF(2), STEEL, section=PROFILES["circle"][0])
                   ).pressure("top", 1.0), InputError, "line_load"),
    (lambda: StVenantKirchhoff(E=lambda x, y: 1.0 + x, nu=0.3).law(), InputError, "varies: use"),
])
def test_errors_teach(make, kind, words):
    with pytest.raises(kind, match=words):
        make()


@pytest.mark.parametrize("height", [0.01, 0.1])
def test_a_cable_has_rotary_inertia_however_its_section_is_given(height):
    """A hinged beam: Rayleigh's factor 1 / sqrt(1 + (n pi h)^2 / 12) on Euler's frequencies."""
    k = np.pi * np.array([1, 2])
    euler = k**2 * height * np.sqrt(2e8 / 7800 / 12)
    for h, options in ((height, {"width": 0.01}), (height, {"width": lambda x, y: 0.01 + 0.0 * x}),
                       (lambda s: height + 0.0 * s, {"width": 0.01}),
                       (height, {"section": Section.profile("rectangle", width=0.01)})):
        beam = Beam(line(12, h=h), ElementBeamCable(5), PLAIN, **options)
        found = Scene(beam).pin("left").fix("right", "r^2").modes(2).frequencies
        assert_allclose(found, euler * (1 + (k * height) ** 2 / 12) ** -0.5, rtol=1e-5)


@pytest.mark.parametrize("section, material, density", [
    (Section.layers((0.04, StVenantKirchhoff(1e7, 0.3, 800.0)),
                    (0.06, StVenantKirchhoff(1e7, 0.3, 200.0)), width=0.02), None,
     lambda Y: 0.02 * np.where(Y < -0.01, 800.0, 200.0)),
    (None, StVenantKirchhoff(1e7, 0.3, lambda x, y: 500.0 - 6000.0 * y),
     lambda Y: 0.02 * (500.0 - 6000.0 * Y))], ids=["layers", "varies"])
@pytest.mark.parametrize("element", [ElementBeamCable(7), ElementBeamANCFCubic(2)], ids=repr)
def test_the_mass_of_a_curve_is_that_of_its_body(element, section, material, density):
    """There is more of it outside: of cables it was the mass of the straight section."""
    R, H = 0.5, 0.1
    mesh = MeshBeam.init_curve(lambda s: (R * np.sin(s / R), R * (1 - np.cos(s / R))),
                               np.linspace(0, 1, 17), height=H)
    beam = Beam(mesh, element, material, **(dict(section=section) if section else {"width": 0.02}))
    Y, w = ((np.arange(50000) + 0.5) / 5e4 - 0.5) * H, H / 5e4
    mass = np.sum(density(Y) * (1 - Y / R)) * w
    assert beam.total_mass == pytest.approx(mass, rel=2e-6)
    assert mass - np.sum(density(Y)) * w > 0.01 * mass
    state = Scene(beam).clamp("left").gravity((0, -1e-3)).solve_static()
    assert state.reactions("left").force[1] == pytest.approx(1e-3 * mass, rel=2e-6)
    s = np.linspace(0, 1, 2001)[:-1] + 0.5 / 2000  # centroids of slices, at small displacement
    moment = 1e-3 * np.sum(density(Y)[:, None] * (1 - Y / R)[:, None] * (
        (R - Y[:, None]) * np.sin(s / R))) * w / 2000
    assert state.reactions("left").moment == pytest.approx(moment, rel=2e-4)
    assert state.resultants((0, 0)).M == pytest.approx(-moment, rel=2e-4)
