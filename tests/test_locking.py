"""The formulation "assumed": no locking at any slenderness, order, shape and plane."""

import exact
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import root

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.beam.kinematics import bent
from skfem_ancf.core.quadrature import gauss
from skfem_ancf.formulations import Formulation, Term
from skfem_ancf.materials import Material

ORDERS = (1, 2, 3, 6)
PLANES = ("stress", "strain")
SLENDER = (1e2, 1e3, 1e4, 1e5, 1e6)
NU, WIDTH = 0.3, 0.01

ELEMENTS = {**{f"linear {n}": ElementBeamANCF(n) for n in ORDERS},
            **{f"cubic {n}": ElementBeamANCFCubic(n) for n in ORDERS},
            **{f"cable {d}": ElementBeamCable(d) for d in (3, 5, 7)}}


def line(n, h):
    return MeshBeam.init_line(np.linspace(0.0, 1.0, n + 1), h)


def quarter(n, h):
    return MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                               np.linspace(0.0, np.pi / 2, n + 1), h)


def soft(h, plane="stress", law=StVenantKirchhoff, nu=NU, **options):
    """A material whose bending stiffness and mass per length do not depend on the height."""
    return law(2e8 * (0.01 / h) ** 3, nu, 7800 * 0.01 / h, plane=plane, **options)


def cantilever(element, n, slenderness, plane="stress", clamp="free", formulation="assumed",
               law=StVenantKirchhoff, nu=NU):
    """The tip of the gravity cantilever and the state."""
    h = 1.0 / slenderness
    beam = Beam(line(n, h), element, soft(h, plane, law, nu), WIDTH, formulation=formulation)
    state = Scene(beam).clamp("left", thickness=clamp).gravity((0, -9.81)).solve_static()
    return state.displacement((1, 0))[1], state


def thin(plane, nu=NU):
    """The tip of the inextensible line."""
    return exact.gravity_cantilever(2e8, nu, 7800, 1.0, WIDTH, 0.01, model="elastica",
                                    plane=plane)[1]


# the error of a mesh does not depend on the slenderness


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("order", ORDERS)
def test_straight_beam_of_any_slenderness(order, plane):
    tips, iterations = [], []
    for slenderness in SLENDER:
        tip, state = cantilever(ElementBeamANCF(order), 16, slenderness, plane)
        # at 1e6 round-off of the axis has the size of what bends: found, but not always at once
        assert len(state.steps) == 1 or slenderness > 5e5
        tips.append(tip)
        iterations.append(state.iterations)
    error = np.array(tips) - thin(plane)
    assert np.all(np.abs(error) < 2.6e-3)  # 16 elements of second order
    assert np.ptp(error[1:]) < 2e-5
    assert np.ptp(error) < 6e-4  # at L/h = 100 the beam itself is softer by 3.7e-4
    assert max(iterations[:4]) <= 36


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("order", ORDERS)
def test_straight_beam_with_cubic_sections_of_any_slenderness(order, plane):
    tips = [cantilever(ElementBeamANCFCubic(order), 16, s, plane)[0] for s in SLENDER]
    error = np.array(tips) - thin(plane)
    assert np.all(np.abs(error[1:]) < 1e-4)
    assert np.ptp(error[1:]) < 3e-5


def pulled_quarter():
    """Tip displacement of an inextensible quarter circle, EI = R = 1, pulled by PULL."""
    def end(m, part):
        def rate(_, y):
            c, s = np.cos(y[2]), np.sin(y[2])
            return [c, s, 1.0 + y[3], part * (s * PULL[0] - c * PULL[1])]

        start = [1, 0, np.pi / 2, m]
        return solve_ivp(rate, (0, np.pi / 2), start, rtol=1e-11, atol=1e-12).y[:, -1]

    m = 0.0
    for part in np.linspace(0.2, 1.0, 5):
        m = root(lambda z, part=part: end(z[0], part)[3], [m], tol=1e-12).x[0]
    return end(m, 1.0)[:2] - [0.0, 1.0]


PULL = np.array([-1.0, 2.0])


def pull(element, n, slenderness, plane):
    h = 1.0 / slenderness
    E = 12.0 / (WIDTH * h**3) * (1.0 if plane == "stress" else 1.0 - NU**2)
    mesh = quarter(n, h)
    beam = Beam(mesh, element, StVenantKirchhoff(E, NU, plane=plane), WIDTH, formulation="assumed")
    scene = Scene(beam).clamp("left", thickness="free").point_force(PULL, at=mesh.p[:, -1])
    state = scene.solve_static()
    assert slenderness > 5e5 or len(state.steps) == 1 and state.iterations <= 36
    return state.displacement(mesh.p[:, -1])


@pytest.mark.parametrize("plane", PLANES)
def test_curved_beam_of_any_slenderness(plane):
    reference = pulled_quarter()
    np.testing.assert_allclose(reference, [0.27158193, 0.32447890], rtol=0, atol=2e-8)
    for order in ORDERS:
        for element, error, spread in ((ElementBeamANCF(order), 5e-4, 1e-6),
                                       (ElementBeamANCFCubic(order), 2e-6, 1e-6)):
            tips = np.array([pull(element, 16, s, plane) for s in SLENDER]) - reference
            assert np.max(np.abs(tips[1:])) < error
            assert np.max(np.ptp(tips[1:], axis=0)) < spread
            assert np.max(np.abs(tips[0] - tips[1])) < 4e-5  # what the beam stretches
    # at 1e6 the axial stiffness is 1e13 times that of bending: its round-off is seen, by 4e-9
    for degree, error, noise in ((3, 2e-5, 2e-7), (5, 1e-9, 1e-7)):
        tips = np.array([pull(ElementBeamCable(degree), 16, s, plane) for s in SLENDER]) - reference
        assert np.max(np.abs(tips[3])) < error
        assert np.max(np.abs(tips[4] - tips[3])) < noise


# rates


def rate(errors):
    return np.log2(np.abs(errors[:-1] / errors[1:]))


@pytest.mark.parametrize("slenderness", [1e2, 1e5])
@pytest.mark.parametrize("order", ORDERS)
def test_linear_sections_converge_at_second_order(order, slenderness):
    element = ElementBeamANCF(order)
    fine = (thin("stress") if slenderness > 1e4 else
            cantilever(ElementBeamANCFCubic(order), 64, slenderness)[0])
    errors = np.array([cantilever(element, n, slenderness)[0] for n in (16, 32, 64)]) - fine
    assert np.all(rate(errors) > 1.95)
    assert abs(errors[-1]) < 1.5e-4


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("order", ORDERS)
def test_cubic_sections_converge_at_fourth_order(order, plane):
    element = ElementBeamANCFCubic(order)
    fine = cantilever(element, 64, 1e2, plane)[0]
    errors = np.array([cantilever(element, n, 1e2, plane)[0] for n in (8, 16, 32)]) - fine
    assert np.all(rate(errors) > 3.8)
    errors = np.array([cantilever(element, n, 1e5, plane)[0] for n in (16, 32, 64)]) - thin(plane)
    assert np.all(rate(errors) > 3.8)
    assert abs(errors[-1]) < 5e-7


@pytest.mark.parametrize("degree, meshes, order, error", [
    (3, (16, 32, 64), 3.8, 2e-6), (5, (8, 12, 16), 6.0, 1e-7), (7, (4, 6, 8), 8.5, 2e-8)])
@pytest.mark.parametrize("slenderness", [1e2, 1e4])
def test_cables_converge(degree, meshes, order, error, slenderness):
    h = 1.0 / slenderness
    reference = exact.gravity_cantilever(2e8 * (0.01 / h) ** 3, NU, 7800 * 0.01 / h, 1.0, WIDTH, h,
                                         model="extensible")[1]
    errors = np.abs([cantilever(ElementBeamCable(degree), n, slenderness)[0] - reference
                     for n in meshes])
    assert np.all(np.diff(np.log(errors)) / np.diff(np.log(meshes)) < -order)
    assert errors[-1] < error


# nearly incompressible in plane strain


@pytest.mark.parametrize("order, highest", [(2, 0.4999), (3, 0.49999), (4, 0.49999),
                                            (6, 0.49999)])
def test_no_volumetric_locking(order, highest):
    for nu in (0.1, 0.3, 0.45, 0.49, 0.499, highest):
        tip, state = cantilever(ElementBeamANCF(order), 16, 1e3, "strain", nu=nu)
        assert abs(tip - thin("strain", nu)) < 2.2e-3
        assert state.iterations <= 39


@pytest.mark.parametrize("order", [3, 6])
def test_no_volumetric_locking_of_neo_hookean(order):
    tip, _ = cantilever(ElementBeamANCF(order), 16, 1e3, "strain", law=NeoHookean, nu=0.499)
    assert abs(tip - thin("strain", 0.499)) < 2e-3


@pytest.mark.parametrize("law", [StVenantKirchhoff, NeoHookean])
@pytest.mark.parametrize("order", [2, 5])
def test_constant_strain_is_exact(order, law):
    material = law(2.0, 0.49, plane="strain", shear_correction=1.0)
    mesh = MeshBeam.init_line([0.0, 0.2, 0.7, 1.0], 0.3)
    beam = Beam(mesh, ElementBeamANCF(order), material, 0.4)
    F = np.array([[1.1, 0.2], [-0.1, 0.95]])
    u = (beam.q0.reshape(-1, 2) @ F.T).ravel() - beam.q0
    C = 0.5 * (F.T @ F - np.eye(2))
    strain = np.array([C[0, 0], C[1, 1], 2 * C[0, 1]])
    np.testing.assert_allclose(beam.kernel.energy(u), material.energy(strain) * 0.3 * 0.4,
                               rtol=1e-13)
    np.testing.assert_allclose(beam.stress(u, np.array([[0.1, 0.8], [0.0, 0.6]])) - material.stress(
        strain)[:, None, None], 0, atol=1e-12)
    force = beam.kernel.force(u)
    assert np.max(np.abs(force[beam.nd:-beam.nd].reshape(2, -1, 2)[:, 0])) < 1e-14


# zero modes


def scaled_eigenvalues(beam):
    """Of the tangent at rest, with unit diagonal so that no unit or slenderness hides a mode."""
    K, nd = np.zeros((beam.N, beam.N)), beam.nd
    for e, k in enumerate(beam.kernel.tangents(np.zeros(beam.N))):
        K[e * nd:(e + 2) * nd, e * nd:(e + 2) * nd] += k
    scale = 1.0 / np.sqrt(np.diag(K))
    return eigh(K * np.outer(scale, scale), eigvals_only=True)


@pytest.mark.parametrize("shape", [line, quarter])
@pytest.mark.parametrize("name", ELEMENTS)
def test_a_free_beam_has_three_zero_modes(name, shape):
    element = ELEMENTS[name]
    for plane in PLANES:
        for n in (1, 3):
            for slenderness in (10.0, 1e3, 1e6):
                h = 1.0 / slenderness
                w = scaled_eigenvalues(Beam(shape(n, h), element, soft(h, plane), WIDTH,
                                            formulation="assumed"))
                assert np.max(np.abs(w[:3])) < 1e-13
                assert w[3] > 2e-2 / slenderness**2  # bending against stretching


# other laws, and motion


class Hencky(Material):
    """A law of the reader's own, by its energy's derivative only: E ln(C) / 2, uncoupled."""

    def stress(self, strain):
        C = 1.0 + 2.0 * strain[:2]
        return np.array([self.E * np.log(C[0]) / (2 * C[0]), self.E * np.log(C[1]) / (2 * C[1]),
                         self.G * strain[2]])

    def energy(self, strain):
        C = 1.0 + 2.0 * strain[:2]
        return (self.E / 8.0 * (np.log(C[0]) ** 2 + np.log(C[1]) ** 2)
                + 0.5 * self.G * strain[2] ** 2)


@pytest.mark.parametrize("order", ORDERS[1:])
def test_any_law_in_the_thin_limit(order):
    for element, error in ((ElementBeamANCF(order), 2.6e-3), (ElementBeamANCFCubic(order), 1.2e-4)):
        linear = cantilever(element, 16, 1e4)[0]
        for law in (NeoHookean, Hencky):
            tip = cantilever(element, 16, 1e4, law=law)[0]
            assert abs(tip - thin("stress")) < error
            assert abs(tip - linear) < (1e-7 if law is NeoHookean else 2e-4)  # the other has no nu


# the paper's element, two Gauss points, and the assumed strain


class TwoGaussPoints(Formulation):
    """As "continuum", with two Gauss points along the axis."""

    name = "two Gauss points"

    def terms(self, element, material):
        _, section = self.full_rules(element)
        return [Term(material.law(material.shear_factor(element)), gauss(2), section)]


@pytest.mark.parametrize("formulation, tips", [
    ("continuum", (-0.888, -0.736, -0.270, -0.061)),
    (TwoGaussPoints(), (-0.899, -0.870, -0.764, -0.349)),
    ("assumed", (-0.905, -0.904, -0.904, -0.904, -0.904))])
def test_16_elements_of_order_2_from_slender_to_very_slender(formulation, tips):
    found = []
    for slenderness in SLENDER[:len(tips)]:
        h = 1.0 / slenderness
        beam = Beam(line(16, h), ElementBeamANCF(2), soft(h, shear_correction="paper"), WIDTH,
                    formulation=formulation)
        scene = Scene(beam).fix("left", ["r", "r_X", "r_Y0^1", "r_Y1^1"]).gravity((0, -9.81))
        found.append(scene.solve_static(stable=False).displacement((1, 0))[1])
    assert np.round(found, 3).tolist() == list(tips)


def test_ends_that_turn_against_each_other_are_a_fold():
    """The chord alone does not show it: the ends of one element, turned by 1.45 rad each."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=1e-3), ElementBeamCable(3),
                StVenantKirchhoff(2e8, 0.3), width=0.01)
    for angle, expected in (0.6, False), (1.45, True):
        u = np.zeros((5, beam.nd))
        u[1, 2:4] = np.cos(angle) - 1.0, -np.sin(angle)
        u[2, 2:4] = np.cos(angle) - 1.0, np.sin(angle)
        turn, folded = bent(beam, u.ravel())
        assert (turn > 2.5) is expected and not folded
