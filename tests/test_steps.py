"""The time step: one text, which takes the same iterations in NumPy and compiled."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (HHT, Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, EnergyMomentum, GeneralizedAlpha, MeshBeam,
                        Newmark, NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.equations.backend import LOADED
from skfem_ancf.core.band import (SPARE, Band, factorize, factorize_complex, solve, solve_complex,
                                  solve_joined, subtract_rows)
from skfem_ancf.dynamics.integrator import Integrator
from skfem_ancf.dynamics.steps import READY, TURNED
from skfem_ancf.actions.loads import Load

ELEMENTS = (ElementBeamANCF(1), ElementBeamANCF(2), ElementBeamANCFCubic(2),
            ElementBeamPatelShabana(), ElementBeamCable(3), ElementBeamCable(5))
SCHEMES = EnergyMomentum(), GeneralizedAlpha(0.7), HHT(0.1), Newmark()
JOINTS = {
    None: None,
    "hinge": {"beams": ("arm", "forearm"), "at": (1, 0)},
    "weld": {"beams": ("arm", "forearm"), "at": ("right", "left")},
    "line": {"beam": "arm", "at": (0.3, 0.0), "direction": (1, 2)},
    "circle": {"beam": "forearm", "at": (1.0, 0.0), "center": (0.4, 0.1)},
    "angle": {"beam": "forearm", "at": "right", "angle": lambda t: np.sin(3 * t)},
    "position": {"beam": "arm", "at": (0.4, 0.0),
                 "r": lambda t: (0.4 + 0.1 * np.sin(t), t * t)},
}


class Spring(Load):
    """A spring from the beam's first coordinates to where they began."""

    constant = False

    def force(self, u):
        out = np.zeros(self.beam.N)
        out[:2] = -5.0 * u[:2]
        return out

    def stiffness(self, u):
        return np.arange(2), np.arange(2), np.full(2, -5.0)

    def potential(self, u):
        return 2.5 * float(u[:2] @ u[:2])


def random_scene(seed, flag):
    """Two beams, what joins and moves them, and a scheme."""
    rng = np.random.default_rng(seed)
    beams = []
    for name, origin, angle in (("arm", (0, 0), 0.0), ("forearm", (1, 0), 1.1)):
        element = ELEMENTS[rng.integers(len(ELEMENTS))]
        law = NeoHookean if element.order and rng.random() < 0.2 else StVenantKirchhoff
        mesh = MeshBeam.init_line(np.linspace(0, 1, 2 + rng.integers(4)), 0.05 + 0.1 * rng.random(),
                                  origin=origin, angle=angle)
        beams.append(Beam(mesh, element, law(1e6, 0.3, 1000.0), 0.1, name=name, compiled=flag))
    scene = Scene(*beams).gravity((0, -9.81))
    names = list(JOINTS)
    name = names[rng.integers(len(names))]
    if name is not None:
        scene.joint(name, **JOINTS[name])
    if rng.random() < 0.5:
        scene.joint("position", beam="forearm", at=(1, 0),
                    r=lambda t: (1.0 + 0.05 * np.sin(8 * t), 0.0))
    if rng.random() < 0.5:
        scene.moment("right", 0.4, beam="arm", amplitude=lambda t: 1.0 - t)
    if rng.random() < 0.3 and beams[0].element.order:
        scene.pressure("top", 20.0, beam="arm", amplitude=lambda t: np.cos(9 * t))
    if rng.random() < 0.3:
        scene.add(Spring(beam="arm"))
    return scene, SCHEMES[rng.integers(len(SCHEMES))]


@pytest.mark.parametrize("seed", range(24))
def test_same_iterations_in_numpy_and_compiled(seed, needs_compiled):
    found = []
    for flag in (False, True):
        scene, scheme = random_scene(seed, flag)
        found.append(scene.integrate(0.05, 2.5e-3, scheme, tol=1e-9))
    slow, fast = found
    assert "steps" in LOADED
    assert fast.iterations == slow.iterations >= 20
    assert fast.factorizations == slow.factorizations
    assert fast.substeps == slow.substeps == 0
    assert_allclose(fast.u, slow.u, rtol=0, atol=1e-8)
    assert np.abs(slow.u).max() > 1e-3


def stiff_pendulum(slenderness, element, flag, law=StVenantKirchhoff, rods=1, n=16):
    """Hinged rods that fall from the horizontal, of the EI of L/h = 100 to a mass."""
    h, L = 1.0 / slenderness, 1.0 / rods
    material = law(2e8 * (0.01 / h)**2, 0.3, 7800.0)
    x = np.linspace(0, L, 1 + n // rods)
    scene = Scene(*(Beam(MeshBeam.init_line(x, h, origin=(k * L, 0)), element, material, 0.01,
                         name=f"rod {k}", compiled=flag) for k in range(rods)))
    scene.gravity((0, -9.81)).pin("left", beam="rod 0")
    if rods == 2:
        scene.joint("hinge", beams=("rod 0", "rod 1"), at=(0.5, 0.0))
    return scene


@pytest.mark.parametrize("slenderness", [1e3, 1e4])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)])
@pytest.mark.parametrize("scheme", [EnergyMomentum(), GeneralizedAlpha(1.0)])
def test_few_iterations_where_the_axis_is_stiff(slenderness, element, scheme):
    """And the equation of the scheme holds, whatever its iteration carried."""
    scene = stiff_pendulum(slenderness, element, False)
    history = scene.integrate(0.2, 1e-2, scheme)
    assert history.substeps == 0
    assert history.iterations <= 5.5 * history.steps
    assert history.factorizations <= history.steps + 2
    if not scheme.conserving:
        return
    assert np.ptp(history.total_energy) < 2e-12 * history.kinetic_energy.max()
    system, (u0, u1), (v0, v1) = scene.system, history.u[-2:], history.v[-2:]
    inertia, weight = system.mass.multiply((v1 - v0) / 1e-2), system.external_force(u1, 0.2)
    missing = (inertia + system.mean_internal_force(u0, u1) - weight)[system.constraints.free]
    assert np.abs(missing).max() < 1e-6 * np.abs(weight).max()


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)])
def test_few_iterations_of_a_stiff_rod_that_turns_fast(element):
    """By 10 degrees in a step, where the stresses at its end go up and down from step to step."""
    scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 1e-3), element,
                       StVenantKirchhoff(2e10, 0.3, 7800.0), 0.01))
    scene.initial_velocity(lambda x: np.array(
        [1.0 - 10.0 * x[1] * (1.0 + 2.0 * x[0]), 10.0 * x[0] * (1.0 + x[0])]))
    history = scene.integrate(0.5, 1e-2, EnergyMomentum())
    assert history.substeps == 0
    assert history.iterations <= 8 * history.steps
    assert history.factorizations <= history.steps + 2


def thrown(x):
    """A velocity that turns and bends: the right end by 17 degrees in 1e-2."""
    s = 2.0 * x[0] - 1.0
    bend = s**2 / 2.0 - s**4 / 6.0 + s**6 / 30.0 - 29.0 / 210.0
    slope = 2.0 * (6.0 + 17.0 * (s - 2.0 * s**3 / 3.0 + s**5 / 5.0))
    return np.array([1.0 - slope * x[1], 6.0 * s + 17.0 * bend])


@pytest.mark.parametrize("degree, n", [(5, 8), (7, 4), (9, 4)])
def test_few_iterations_where_more_strains_are_sampled_than_the_axis_has(degree, n):
    """Symmetric factors contract slowly there, or not at all: 19 to 24 iterations a step."""
    history = stiff_pendulum(1e4, ElementBeamCable(degree), False, n=n).integrate(
        0.7, 1e-2, EnergyMomentum())
    assert history.substeps == 0
    assert history.iterations <= 8 * history.steps
    assert history.factorizations <= 1.3 * history.steps
    assert np.ptp(history.total_energy) < 1e-12 * history.kinetic_energy.max()


@pytest.mark.parametrize("change", ["", "joints", "damping", "follower"])
def test_factors_that_are_not_symmetric_are_the_same_compiled(change, needs_compiled):
    found = []
    for flag in (False, True):
        scene = stiff_pendulum(1e4, ElementBeamCable(5), flag, rods=1 + (change == "joints"), n=8)
        if change == "damping":
            scene.damping(modal=[1e-3])
        if change == "follower":
            scene.add(Spring(beam="rod 0"))
        integrator = Integrator(scene.system, EnergyMomentum(), tol=1e-10)
        N, most = scene.system.N, 0.0
        y = integrator.start(np.zeros(N), np.zeros(N), 0.0, 1e-2)
        for _ in range(6):
            y = integrator.take(y, 1e-2)
            most = max(most, integrator.arrays()["state"][READY])
        assert most == TURNED
        found.append((integrator.iterations, integrator.factorizations, y.u))
    slow, fast = found
    assert slow[:2] == fast[:2]
    assert_allclose(slow[2], fast[2], rtol=0, atol=1e-8)


@pytest.mark.filterwarnings("ignore:the body is turned inside out")  # two steps are too few
@pytest.mark.parametrize("flag", [False, True])
def test_a_step_that_fails_is_cut_the_same(flag):
    """A step much longer than the fast turn of a free beam: it is halved."""
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamANCF(2),
                StVenantKirchhoff(1e7, 0.3, 1000.0), 0.1, compiled=flag)
    scene = Scene(beam).initial_velocity(lambda x: np.array([-90.0 * x[1], 90.0 * (x[0] - 0.5)]))
    history = scene.integrate(0.2, 0.1)
    assert history.substeps > 0
    assert np.ptp(history.total_energy) < 1e-9 * history.total_energy.max()


@pytest.mark.parametrize("top", [False, True])
def test_multiples_of_rows(top):
    """J x = -b, by multiples of the rows of J A^-1."""
    rng = np.random.default_rng(0)
    n, k, m = 9, 2, 3
    dense = np.zeros((n, n))
    for d in range(-k, k + 1):
        dense += np.diag(rng.standard_normal(n - abs(d)), d)
    dense = dense @ np.eye(n) + 9 * np.eye(n)
    dense = dense if top else 0.5 * (dense + dense.T)
    ld, first = (3 * k + 1, 2 * k) if top else (k + 2, 0)
    A = Band(np.zeros(n * ld), np.zeros(n, np.int64), ld, k, first)
    for i in range(n):
        for j in range(max(0, i - k), min(n, i + k + 1)):
            if top or i >= j:
                A.flat[j * ld + first + i - j] = dense[i, j]
    assert factorize(A)
    J, J1, b, x = *rng.standard_normal((2, m, n)), rng.standard_normal(m), rng.standard_normal(n)
    free = np.ones(n)
    free[2] = 0.0
    Y, S, c, y = np.zeros((m, n)), np.zeros((m, m)), b.copy(), x.copy()
    assert solve_joined(A, J, J1, free, True, Y, S, c, y)
    assert_allclose(Y, np.linalg.solve(dense, (J * free).T).T, rtol=0, atol=1e-13)
    assert_allclose(J1 @ y, -b, rtol=0, atol=1e-12)
    assert_allclose(y, x - c @ Y, rtol=0, atol=1e-13)
    one = x.copy()
    solve(A, one)
    assert_allclose(dense @ one, x, rtol=0, atol=1e-13)
    out = x.copy()
    subtract_rows(J, b, out)
    assert_allclose(out, x - J.T @ b, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("n", "width"), [(9, 2), (3, 5), (20, 6), (1, 0)])
def test_complex_factors(n, width):
    """Of a symmetric band whose real part is positive definite."""
    rng = np.random.default_rng(n)
    A, ld = np.zeros((n, n), dtype=complex), width + 1
    for d in range(min(width, n - 1) + 1):
        values = rng.standard_normal(n - d) + 1j * rng.standard_normal(n - d)
        A += np.diag(values, -d) + np.diag(values, d)
    A += 4.0 * ld * np.eye(n)
    lower = np.zeros((n, ld + SPARE), dtype=complex)
    for j in range(n):
        m = min(ld, n - j)
        lower[j, :m] = A[j:j + m, j]
    b = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    F, x, y = np.append(lower.real, lower.imag), b.real.copy(), b.imag.copy()
    assert factorize_complex(F, width)
    solve_complex(F, width, x, y)
    assert_allclose(A @ (x + 1j * y), b, rtol=0, atol=1e-13)
    assert not factorize_complex(0.0 * F, width)
