"""The laws against their energy, Hooke, the three-dimensional body, and each other."""

import numpy as np
import pytest
from noise import alike
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, EnergyMomentum, InputError, MeshBeam, NameUnknown,
                        Scene, StVenantKirchhoff)
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.forms import green_lagrange
from skfem_ancf.materials import MATERIALS, Material, PointwiseMaterial
from skfem_ancf.materials.base import hooke as hooke_matrix

try:
    from numba import njit
except ImportError:
    def njit(function):
        return function

hypothesis = pytest.importorskip("hypothesis")
given, settings, st = hypothesis.given, hypothesis.settings, hypothesis.strategies

STEP = 1e-30
E, NU = 2.1e11, 0.3
LAWS = [(name, plane) for name in MATERIALS for plane in ("stress", "strain")]
STRAINS = np.array([[0.0, 0.12, -0.2, 0.3, 1e-9], [0.0, -0.1, 0.25, 0.2, -2e-9],
                    [0.0, 0.15, -0.3, 0.4, 3e-9]])

# energy of the three-dimensional body, of C_11, C_22, C_12 and C_33; C_13 = C_23 = 0


def _svk_3d(law, C11, C22, C12, C33):
    lame = law.E * law.nu / ((1 + law.nu) * (1 - 2 * law.nu))
    e1, e2, e3 = (C11 - 1) / 2, (C22 - 1) / 2, (C33 - 1) / 2
    return lame / 2 * (e1 + e2 + e3) ** 2 + law.G * (e1**2 + e2**2 + e3**2 + C12**2 / 2)


def _neo_hookean_3d(law, C11, C22, C12, C33):
    lame = law.E * law.nu / ((1 + law.nu) * (1 - 2 * law.nu))
    log_J = 0.5 * np.log((C11 * C22 - C12**2) * C33)
    return law.G / 2 * (C11 + C22 + C33 - 3) - law.G * log_J + lame / 2 * log_J**2


BODIES = {"st-venant-kirchhoff": _svk_3d, "neo-hookean": _neo_hookean_3d}


@pytest.fixture(params=LAWS, ids="-".join)
def law(request):
    name, plane = request.param
    return MATERIALS[name](E, NU, plane=plane)


@pytest.fixture(params=[1.0, 10 * (1 + NU) / (12 + 11 * NU)], ids=["k=1", "k<1"])
def corrected(law, request):
    return law.law(request.param)


def _directions(strain):
    for j in range(3):
        step = np.zeros((3, 1), dtype=complex)
        step[j] = 1j * STEP
        yield j, strain + step


def test_stress_is_the_derivative_of_energy(corrected):
    S = corrected.stress(STRAINS)
    assert S.shape == STRAINS.shape and corrected.energy(STRAINS).shape == STRAINS.shape[1:]
    for j, strain in _directions(STRAINS):
        assert_allclose(np.imag(corrected.energy(strain)) / STEP, S[j], rtol=1e-12,
                        atol=1e-12 * np.abs(S[j]).max())


def test_small_stress_keeps_its_digits(corrected):
    """No cancellation: relative accuracy at strains of 1e-9."""
    for size in (1e-9, 1e-12, 1e-15):
        e = size * np.array([1.0, -2.0, 3.0])
        assert_allclose(corrected.stress(e), corrected.moduli(0 * e) @ e, rtol=100 * size + 1e-15)


def test_moduli_are_the_derivative_of_stress_and_symmetric(corrected):
    D = corrected.moduli(STRAINS)
    assert D.shape == (3,) + STRAINS.shape
    size = np.abs(D).max()
    for j, strain in _directions(STRAINS):
        assert np.abs(np.imag(corrected.stress(strain)) / STEP - D[:, j]).max() < 1e-12 * size
    assert np.abs(D - D.swapaxes(0, 1)).max() < 1e-15 * size


@pytest.mark.parametrize("nu", [-0.9, -0.3, 0.0, 0.3, 0.49, 0.5])
@pytest.mark.parametrize("name, plane", LAWS)
def test_hooke(name, plane, nu):
    if nu == 0.5 and (plane == "strain" or name == "neo-hookean"):
        with pytest.raises(InputError, match="0.5"):
            MATERIALS[name](E, nu, plane=plane)
        return
    D = MATERIALS[name](E, nu, plane=plane).moduli(np.zeros(3))
    if plane == "stress":
        a, b = E / (1 - nu**2), nu * E / (1 - nu**2)
    else:
        a, b = (E * f / ((1 + nu) * (1 - 2 * nu)) for f in (1 - nu, nu))
    assert_allclose(D, [[a, b, 0], [b, a, 0], [0, 0, E / (2 * (1 + nu))]], rtol=1e-12)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_energy_is_that_of_the_body_with_its_thickness_stretch(name, plane):
    law = MATERIALS[name](E, NU, plane=plane)
    C11, C22, C12, C33 = *(1 + 2 * STRAINS[:2]), STRAINS[2], law.thickness_stretch(STRAINS) ** 2
    W = BODIES[name](law, C11, C22, C12, C33)
    assert_allclose(law.energy(STRAINS), W, rtol=1e-13, atol=4e-16 * E)
    S33 = 2 * np.imag(BODIES[name](law, C11, C22, C12, C33 + 1j * STEP)) / STEP
    if plane == "stress":
        assert np.abs(S33).max() < 1e-13 * E
        assert_allclose(C33[-1] - 1, -NU / (1 - NU) * 2 * STRAINS[:2, -1].sum(), rtol=1e-6)
    else:
        assert np.all(C33 == 1.0) and np.abs(S33).max() > 0.01 * E


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(-7, 7), st.lists(st.floats(-0.4, 0.4), min_size=4, max_size=4))
def test_frame_indifference_and_isotropy(angle, H):
    F = (np.eye(2) + np.reshape(H, (2, 2)))[:, :, None]
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s], [s, c]])
    J = np.linalg.det(F[..., 0])
    if J < 0.2:
        return
    for name, plane in LAWS:
        law = MATERIALS[name](1.0, NU, plane=plane)

        def tensor(f):
            S = law.stress(green_lagrange(f))[:, 0]
            return np.array([[S[0], S[2]], [S[2], S[1]]])

        turned, W = np.einsum("ij,jkp->ikp", R, F), law.energy(green_lagrange(F))
        assert_allclose(law.energy(green_lagrange(turned)), W, atol=1e-13)
        assert_allclose(tensor(turned), tensor(F), atol=1e-12 / J**2)
        material_turned = np.einsum("ikp,jk->ijp", F, R)  # F R^T
        assert_allclose(law.energy(green_lagrange(material_turned)), W, atol=1e-13)
        assert_allclose(tensor(material_turned), R @ tensor(F) @ R.T, atol=1e-12 / J**2)


# shear correction

K_S = 10 * (1 + NU) / (12 + 11 * NU)


@pytest.mark.parametrize("name", ELEMENTS)
def test_shear_factor(name):
    element = ELEMENTS[name]()
    carries = element.order >= 3
    for cls in MATERIALS.values():
        assert cls(E, NU).shear_factor(element) == (1.0 if carries else K_S)
        assert cls(E, NU, shear_correction="paper").shear_factor(element) == K_S
        assert cls(E, NU, shear_correction=0.7).shear_factor(element) == 0.7
        assert cls(E, NU, shear_correction=1).shear_factor(element) == 1.0


# bad input

@pytest.mark.parametrize("cls", MATERIALS.values())
@pytest.mark.parametrize("arguments, message", [
    (dict(E=0.0, nu=NU), "E must be positive.*0.0"), (dict(E=-2e11, nu=NU), "E must be positive"),
    (dict(E=np.nan, nu=NU), "E must be finite"), (dict(E=np.inf, nu=NU), "E must be finite"),
    (dict(E="steel", nu=NU), "E must be a number, got 'steel'"),
    (dict(E=E, nu=np.nan), "nu must be finite"), (dict(E=E, nu=None), "nu must be a number"),
    (dict(E=E, nu=-1.0), r"nu must lie in \(-1, 0.5\).*-1.0"),
    (dict(E=E, nu=0.51), r"nu must lie in \(-1, 0.5\).*0.51"),
    (dict(E=E, nu=0.5, plane="strain"), "0.5 in plane strain"),
    (dict(E=E, nu=NU, density=0.0), "density must be positive"),
    (dict(E=E, nu=NU, density=-1), "density must be positive"),
    (dict(E=E, nu=NU, density=np.nan), "density must be finite"),
    (dict(E=E, nu=NU, shear_correction=0.0), "shear_correction must be positive"),
    (dict(E=E, nu=NU, shear_correction=np.nan), "shear_correction must be finite"),
    (dict(E=E, nu=NU, shear_correction=None), "shear_correction must be a number"),
])
def test_bad_input(cls, arguments, message):
    with pytest.raises(InputError, match=message):
        cls(**arguments)


@pytest.mark.parametrize("arguments, known", [
    (dict(plane="stres"), "'stress', 'strain'"), (dict(plane=None), "'stress', 'strain'"),
    (dict(shear_correction="papers"), "'auto', 'paper'"),
])
def test_unknown_names(arguments, known):
    with pytest.raises(NameUnknown, match=f"known: {known}"):
        StVenantKirchhoff(E, NU, **arguments)


# a law of the user's own

class Stiffening(Material):
    """W = W_svk + c/4 (eps . eps)^2: energy and stress, nothing else."""

    def __init__(self, *args, c=0.0, **kwargs):
        super().__init__(*args, **kwargs)
        self.c = c

    def energy(self, strain):
        e = np.asarray(strain)
        D = StVenantKirchhoff(self.E, self.nu, plane=self.plane).D
        hooke = 0.5 * np.sum(e * np.tensordot(D, e, 1), axis=0)
        return hooke + self.c / 4 * np.sum(e * e, axis=0) ** 2

    def stress(self, strain):
        e = np.asarray(strain)
        D = StVenantKirchhoff(self.E, self.nu, plane=self.plane).D
        return np.tensordot(D, e, 1) + self.c * np.sum(e * e, axis=0) * e


class Apart(Stiffening):
    """The same, which names its volumetric part in plane strain."""

    def volumetric_split(self, k_s=1.0):
        if self.plane == "stress":
            return None
        hooke = StVenantKirchhoff(self.E, self.nu, plane="strain").volumetric_split(k_s)
        rest = Stiffening(2 * self.G, 0.0, plane="strain", c=self.c)  # lambda is zero
        return rest.law(k_s), hooke[1]


class Whole(StVenantKirchhoff):
    """St. Venant-Kirchhoff that is not taken apart: a subclass must say its parts."""


def _cantilever(material, N=2, **options):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.1)
    scene = Scene(Beam(mesh, ElementBeamANCF(N), material, 0.1))
    scene.clamp("left").point_force((0, -1e4), at=(1, 0))
    return scene.solve_static(**options)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("method", ["mixed", "newton"])
@pytest.mark.parametrize("law, hooke", [(Stiffening, Whole), (Apart, StVenantKirchhoff)])
def test_law_of_the_users_own(plane, method, law, hooke):
    own, soft = law(2e8, NU, plane=plane), hooke(2e8, NU, plane=plane)
    same, reference = _cantilever(own, method=method), _cantilever(soft, method=method)
    assert_allclose(same.u, reference.u, atol=1e-10)
    assert alike(same.iterations, reference.iterations)
    state = _cantilever(own.replace(c=1e11), method=method)
    load = state.system.external_force(state.u)
    error = (state.internal_force - load)[state.system.constraints.free]
    assert np.abs(error).max() < 1e-4  # of 1e4 N
    assert state.strain_energy < 0.99 * reference.strain_energy
    assert reference.displacement((1, 0))[1] < -0.15
    assert 0.05 < (state.displacement((1, 0)) - reference.displacement((1, 0)))[1] < 0.25
    # quadratic convergence of Newton's method with moduli by the complex step
    if method == "newton":
        assert state.steps[-1].force_residuals[-1] < 1e-9 < state.steps[-1].force_residuals[-3]


class StiffeningPoint(PointwiseMaterial):
    """The energy of Stiffening, at a point."""

    @property
    def constants(self):
        return np.append(hooke_matrix(self.E, self.nu, self.plane).ravel(), 2.0 / self.E)

    @staticmethod
    def point(constants, x, y, z):
        D, c = constants[:9].reshape(3, 3), constants[9]
        S = (D[0, 0] * x + D[0, 1] * y + D[0, 2] * z, D[1, 0] * x + D[1, 1] * y + D[1, 2] * z,
             D[2, 0] * x + D[2, 1] * y + D[2, 2] * z)
        W = 0.5 * (S[0] * x + S[1] * y + S[2] * z)
        d = 1.0 + c * W
        return W + 0.5 * c * W * W, (S[0] * d, S[1] * d, S[2] * d), (
            D[0, 0] * d + c * S[0] * S[0], D[0, 1] * d + c * S[0] * S[1],
            D[0, 2] * d + c * S[0] * S[2], D[1, 1] * d + c * S[1] * S[1],
            D[1, 2] * d + c * S[1] * S[2], D[2, 2] * d + c * S[2] * S[2])


class Marked(StiffeningPoint):
    """The same, marked by Numba where that is installed."""

    point = staticmethod(njit(StiffeningPoint.point))


class Squared(Material):
    """The same in Python."""

    def energy(self, strain):
        D = hooke_matrix(self.E, self.nu, self.plane)
        W = 0.5 * np.einsum("ij,i...,j...->...", D, strain, strain)
        return W + W**2 / self.E

    def stress(self, strain):
        S = np.tensordot(hooke_matrix(self.E, self.nu, self.plane), strain, 1)
        return S * (1.0 + np.sum(strain * S, axis=0) / self.E)


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_a_pointwise_law_is_the_law_it_says(plane):
    point, marked, python = (cls(E, NU, plane=plane) for cls in (StiffeningPoint, Marked, Squared))
    assert np.array_equal(point.stress(STRAINS), marked.stress(STRAINS))
    for name in ("energy", "stress", "moduli"):
        mine, other = getattr(point, name)(STRAINS), getattr(python, name)(STRAINS)
        assert_allclose(mine, other, rtol=1e-12, atol=1e-13 * np.abs(other).max())


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCF(3)], ids=repr)
def test_scenes_take_pointwise_laws(element):
    found = []
    for cls in (StiffeningPoint, Marked, Squared):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.1), element, cls(50.0, NU, 1.0), 0.1)
        scene = Scene(beam).clamp("left").point_force((0.1, -0.01), at=(1, 0))
        state, motion = scene.solve_static(), scene.integrate(0.1, 0.01, EnergyMomentum())
        free = scene.integrate(0.3, 0.01, EnergyMomentum(), start=state)
        assert np.ptp(free.total_energy) < 1e-12
        found.append((state.u, motion.u[-1]))
    for mine, marked, other in zip(*found):
        assert_allclose(mine, other, atol=1e-9 * np.abs(other).max())
        assert_allclose(marked, other, atol=1e-9 * np.abs(other).max())
