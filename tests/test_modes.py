"""Natural frequencies and linear buckling against beam theory."""

import numpy as np
import pytest
from scipy.optimize import brentq

import exact
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.solvers import eigen
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.core.errors import ConvergenceError, InputError, ModelWarning, SupportError
from skfem_ancf.formulations import FORMULATIONS
from skfem_ancf.results.state import State

from conftest import quarter_arc

E, RHO, B = 1e9, 1000.0, 0.1


def straight(ne, h=0.02, element=None, nu=0.0, formulation="assumed", L=1.0, **options):
    mesh = MeshBeam.init_line(np.linspace(0, L, ne + 1), h, **options)
    return Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(E, nu, RHO), B,
                formulation=formulation)


def theory(h, ends, n=3, L=1.0, timoshenko=False, nu=0.0):
    A, I = B * h, B * h**3 / 12
    if timoshenko:
        kGA = exact.shear_factor(nu) * E / (2 * (1 + nu)) * A
        return exact.timoshenko_frequencies(E, I, A, RHO, L, kGA, n, ends)
    return exact.euler_bernoulli_frequencies(E, I, A, RHO, L, n, ends)


def held(beam, ends):
    """A scene of the beam with the ends held, and how many modes are no bending."""
    scene = Scene(beam)
    if ends == "fixed-free":
        scene.clamp("left")
    elif ends == "pinned-pinned":
        scene.pin("left").fix("right", "r^2")
    return scene, 3 if ends == "free-free" else 0


ENDS = ("fixed-free", "free-free", "pinned-pinned")


@pytest.mark.parametrize("ends", ENDS)
def test_slender_beam_against_euler_bernoulli(ends):
    """h / L = 1 / 200: the theory's own error is 1e-4 in the third frequency."""
    h = 0.005
    known = theory(h, ends)
    scene, skip = held(straight(16, h, ElementBeamANCFCubic(1)), ends)
    found = scene.modes(3 + skip).frequencies[skip:]
    assert np.abs(found / known - 1).max() < 1e-3


@pytest.mark.parametrize("ends", ["fixed-free", "pinned-pinned"])
def test_beam_as_thin_as_a_hair(ends, caplog):
    """A slenderness of 1e8: the stresses are unknowns beside the coordinates."""
    h = 1e-8
    scene, _ = held(straight(64, h, ElementBeamANCF(3)), ends)
    with caplog.at_level("INFO", logger="skfem_ancf.equations.strain_tangent"):
        found = scene.modes(3).frequencies
    assert "stresses become unknowns" in caplog.text
    # elements as long as 1 / 64: the same relative error as at a slenderness of 200
    same, _ = held(straight(64, 0.005, ElementBeamANCF(3)), ends)
    assert np.abs(found / theory(h, ends) - 1).max() < 3e-3
    assert np.abs(found / h / same.modes(3).frequencies * 0.005 - 1).max() < 1e-3


def test_modes_of_more_than_digits_hold_are_refused():
    """Elements of 5e4 heights, two thousand of them: no digit of the bending is left."""
    scene, _ = held(straight(2000, 1e-8, ElementBeamANCF(2)), "fixed-free")
    with pytest.raises(ConvergenceError, match="too slender for elements so short"):
        scene.modes(1)


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("order", [1, 2])
def test_thick_beam_against_timoshenko(ends, order):
    """h / L = 1 / 10: Euler-Bernoulli is off by up to a fifth in the third frequency."""
    h = 0.1
    known = theory(h, ends, timoshenko=True)
    scene, skip = held(straight(16, h, ElementBeamANCFCubic(order)), ends)
    modes = scene.modes(6 + skip)
    # a bar's axial vibrations lie between: those move along x on the axis
    across = [k for k in range(skip, 6 + skip)
              if np.abs(modes.shapes[k].reshape(-1, scene.beams[0].nd)[:, 1]).max()
              > 10 * np.abs(modes.shapes[k].reshape(-1, scene.beams[0].nd)[:, 0]).max()][:3]
    found = modes.frequencies[across]
    assert len(found) == 3
    assert np.abs(found / known - 1).max() < 4e-3
    assert np.abs(theory(h, ends) / known - 1).max() > 0.05


@pytest.mark.parametrize("element, formulation, rate, bound", [
    (lambda: ElementBeamANCF(2), "assumed", 2, 5e-3),
    (lambda: ElementBeamANCF(2), "continuum", 2, 5e-3),
    (lambda: ElementBeamANCFCubic(1), "assumed", 4, 1e-5),
], ids=["assumed", "continuum", "cubic"])
def test_rate_of_convergence(element, formulation, rate, bound):
    """The first frequency of a cantilever, against a fine mesh."""
    def first(ne, make):
        return Scene(straight(ne, 0.05, make(), formulation=formulation)).clamp("left").modes(
            1).frequencies[0]

    fine = first(64, lambda: ElementBeamANCFCubic(2)) if rate == 2 else first(40, element)
    errors = [abs(first(ne, element) / fine - 1) for ne in (4, 8, 16)]
    assert errors[2] < bound
    assert np.log2(errors[0] / errors[1]) > rate - 0.4
    assert np.log2(errors[1] / errors[2]) > rate - 0.5


@pytest.mark.parametrize("T", [-0.8, 0.0, 3.0, 20.0])
def test_tension_stiffens(T):
    """A pinned beam under an axial force: omega^2 = (n pi / L)^4 EI / rho A (1 + T / T_n).

    T in units of the first buckling load pi^2 EI / L^2, T_n the n-th.
    """
    h, L = 0.01, 1.0
    EI = E * B * h**3 / 12
    force = T * np.pi**2 * EI / L**2
    scene = Scene(straight(8, h, ElementBeamANCFCubic(1))).pin("left").fix("right", "r^2")
    scene.point_force((force, 0), (L, 0))
    state = scene.solve_static()
    n = np.arange(1, 4)
    known = (n * np.pi / L) ** 2 * np.sqrt(EI / (RHO * B * h)) * np.sqrt(1 + T / n**2)
    assert np.abs(scene.modes(3, state).frequencies / known - 1).max() < 4e-3


def test_unstable_state():
    """Beyond the buckling load the straight state has a negative omega^2, shown as such."""
    h = 0.01
    EI = E * B * h**3 / 12
    scene = Scene(straight(8, h, ElementBeamANCFCubic(1))).pin("left").fix("right", "r^2")
    scene.point_force((-1.5 * np.pi**2 * EI, 0), (1, 0))
    frequencies = scene.modes(2, scene.solve_static(stable=False)).frequencies
    assert frequencies[0] < 0 < frequencies[1]
    assert frequencies[0] == pytest.approx(
        -np.pi**2 * np.sqrt(EI / (RHO * B * h)) * np.sqrt(0.5), rel=0.02)


def elastic_scale(beam):
    return np.sqrt(E / RHO) / beam.mesh.lengths.sum()


@pytest.mark.parametrize("name", ELEMENTS)
def test_free_beam_has_three_zero_modes(name):
    for formulation in FORMULATIONS:
        for mesh in (MeshBeam.init_line([0, 0.4, 1.0], 0.2, angle=0.5), quarter_arc(2, 0.2)):
            beam = Beam(mesh, ELEMENTS[name](), StVenantKirchhoff(E, 0.3, RHO), B,
                        formulation=formulation)
            frequencies = Scene(beam).modes(5).frequencies / elastic_scale(beam)
            assert np.abs(frequencies[:3]).max() < 1e-3, (formulation, frequencies)
            assert frequencies[3] > 0.1, (formulation, frequencies)


def test_shapes_and_modes():
    beam = straight(6)
    scene = Scene(beam).clamp("left")
    modes = scene.modes(4)
    M = scene.system.mass.tocsc()
    assert np.allclose(modes.shapes @ (M @ modes.shapes.T), np.eye(4), atol=1e-9)
    scene.system.assemble(np.zeros(scene.layout.N))
    K = scene.system.K.tocsc()
    stiffness = modes.shapes @ (K @ modes.shapes.T)
    assert np.allclose(stiffness, np.diag(modes.frequencies**2), atol=1e-9 * stiffness.max())
    assert not np.any(modes.shapes[:, ~scene.system.constraints.free])
    shown = modes.mode(1, 0.01)
    assert np.array_equal(shown.u, 0.01 * modes.shapes[1])
    # a mode is a motion: released in shape 0 the beam comes back after a period
    period = 2 * np.pi / modes.frequencies[0]
    history = scene.integrate(period, period / 200, start=modes.mode(0, 1e-5))
    assert np.abs(history.u[-1] - history.u[0]).max() < 0.01 * np.abs(history.u[0]).max()


def test_modes_with_joints():
    """Two bars hinged in the middle of a propped span, by symmetry: sin and cosine parts.

    A free-free beam cut by a weld keeps its frequencies; hinged at its middle, where the even
    modes have no curvature, only these stay.
    """
    whole = Scene(straight(8))
    a, b = straight(4, L=0.5), straight(4, L=0.5, origin=(0.5, 0))
    one = whole.modes(7).frequencies
    welded, hinged = Scene(a, b), Scene(a, b)
    welded.joint("weld", beams=(a, b), at=("right", "left"))
    hinged.joint("hinge", beams=(a, b), at=(0.5, 0))
    two = welded.modes(7).frequencies
    assert np.abs(two[:3]).max() < 1e-3 * two[3]
    assert np.allclose(two[3:6], one[3:6], rtol=0.01)
    four = hinged.modes(7).frequencies
    assert np.abs(four[:4]).max() < 1e-3 * four[4]  # the bars turn freely
    assert four[4] == pytest.approx(one[4], rel=0.02)  # the antisymmetric one stays


def test_pendulum_on_a_hinge_and_on_a_circle():
    """Small swings of a hanging rod, omega^2 = 3 g / (2 L), stiffened by the weight it carries.

    A bar whose two ends hang on circles of radius R swings without turning, omega^2 = g / R: here
    the restoring force is the joints' own curvature.
    """
    L, R, g = 0.5, 0.8, 9.81
    rod = straight(2, 0.01, L=L, angle=-np.pi / 2)

    def hung(still):
        scene = Scene(rod).pin("left").gravity((0, -g))
        return scene.fix("right", "r^1") if still else scene

    def swing(still):
        scene = Scene(straight(2, 0.02, L=L)).gravity((0, -g))
        for x in (0, L):
            scene.joint("circle", at=(x, 0), center=(x, R))
        return scene.fix("left", "r^1") if still else scene

    def omega(make):
        state = make(still=True).solve_static()  # statics wants the swing held
        scene = make(still=False)
        return scene.modes(1, State(scene.system, state.u, multipliers=state.multipliers)
                           ).frequencies[0]

    assert omega(hung) == pytest.approx(np.sqrt(1.5 * g / L), rel=1e-3)
    assert omega(swing) == pytest.approx(np.sqrt(g / R), rel=2e-3)


@pytest.mark.parametrize("joined", [False, True])
def test_sparse_branch_equals_dense_branch(monkeypatch, joined):
    def scene():
        a, b = straight(6), straight(5, L=0.5, origin=(1, 0), angle=1.0)
        s = Scene(a, b) if joined else Scene(a)
        if joined:
            s.joint("weld", beams=(a, b), at=("right", "left"))
        return s

    dense_free = scene().modes(6)
    held_scene = scene()
    held_scene.clamp("left", beam=held_scene.beams[0])
    dense_held = held_scene.modes(6)
    monkeypatch.setattr(eigen, "DENSE", 10)
    sparse_free, sparse_held = scene().modes(6), held_scene.modes(6)
    scale = dense_free.frequencies[3]
    assert np.abs(sparse_free.frequencies[:3]).max() < 2e-3 * scale
    assert np.allclose(sparse_free.frequencies[3:], dense_free.frequencies[3:], rtol=1e-6)
    assert np.allclose(sparse_held.frequencies, dense_held.frequencies, rtol=1e-6)
    for x, y in zip(sparse_held.shapes, dense_held.shapes):
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        assert abs(x @ y) == pytest.approx(1, abs=1e-8)


@pytest.mark.parametrize("equal, k", [(1, 8), (3, 7), (5, 10), (5, 15)])
def test_all_of_equal_frequencies_are_found(equal, k, monkeypatch):
    monkeypatch.setattr(eigen, "DENSE", 10)
    beams = [straight(16, origin=(0.0, float(i))) for i in range(equal)]
    scene = Scene(*beams)
    for beam in beams:
        scene.clamp("left", beam=beam)
    modes = scene.modes(k)
    alone = Scene(beams[0]).clamp("left").modes(-(-k // equal)).frequencies
    assert np.allclose(modes.frequencies, np.repeat(alone, equal)[:k], rtol=1e-10)
    found = modes.shapes @ (scene.system.mass.tocsc() @ modes.shapes.T)
    assert np.allclose(found, np.eye(k), atol=1e-8)


# buckling


@pytest.mark.parametrize("ends", ["fixed-free", "pinned-pinned", "fixed-pinned", "fixed-fixed"])
def test_euler_buckling(ends):
    h, L = 0.01, 1.0
    scene = Scene(straight(8, h, ElementBeamANCFCubic(1)))
    left, right = ends.split("-")
    scene.clamp("left") if left == "fixed" else scene.pin("left")
    if right != "free":
        scene.fix("right", "r^2")
    if right == "fixed":
        scene.fix("right", "r_Y0^1")
    scene.point_force((-1, 0), (L, 0))
    known = exact.euler_buckling_load(E, B * h**3 / 12, L, ends)
    buckling = scene.buckling(2)
    assert buckling.factors[0] == pytest.approx(known, rel=3e-3)
    assert buckling.factors[1] > 2 * known
    # the shape is across, and is still at the ends
    shape = buckling.shapes[0].reshape(-1, scene.beams[0].nd)
    assert np.abs(shape[:, 1]).max() > 100 * np.abs(shape[:, 0]).max()


def test_buckling_load_is_where_the_frequency_vanishes():
    h = 0.02
    def loaded(P):
        return Scene(straight(6, h)).clamp("left").point_force((-P, 0), (1, 0))

    P = loaded(1.0).buckling(1).factors[0]
    squares = []
    for part in (0.9, 0.95):
        scene = loaded(part * P)
        squares.append(scene.modes(1, scene.solve_static()).frequencies[0] ** 2)
    zero = 0.95 + 0.05 * squares[1] / (squares[0] - squares[1])
    # linear buckling leaves out the shortening before it, of the size of the strain
    assert zero == pytest.approx(1, abs=3e-3)


@pytest.mark.parametrize("R", [3.0, -3.0])
def test_buckling_under_a_guided_end(R):
    """A column whose head slides on a circle about a point of its axis: the joint's curvature.

    The column is pushed from its foot, which is clamped but may slide along the axis. The circle
    pushes back along its radius: at a deflection w of the head there is a force P w / R across,
    away from the axis for a centre on the side of the column. With k^2 = P / EI the deflection is
    y = A (1 - cos kx) + C (kx - sin kx). At the head its second derivative is zero, and the third
    plus k^2 times the first is k^2 y / R.
    """
    h, L = 0.01, 1.0
    scene = Scene(straight(8, h, ElementBeamANCFCubic(1)))
    scene.fix("left", ["r^2", "r_Y0^1"])
    scene.joint("circle", at=(L, 0), center=(L - R, 0))
    scene.point_force((1, 0), (0, 0))

    def determinant(k):
        c, s = np.cos(k * L), np.sin(k * L)
        # the two conditions over k^2, for A and C
        moment, force = (c, s), (-(1 - c) / R, k - (k * L - s) / R)
        return moment[0] * force[1] - moment[1] * force[0]

    x = np.linspace(0.1, 8, 4000)
    n = int(np.nonzero(determinant(x[:-1]) * determinant(x[1:]) < 0)[0][0])
    k = brentq(determinant, x[n], x[n + 1])
    assert abs(k * L - np.pi / 2) > 0.1  # that of a free head
    known = k * k * E * B * h**3 / 12
    assert scene.buckling(1).factors[0] == pytest.approx(known, rel=3e-3)


def test_greenhill():
    """A column under its own weight, clamped at its foot."""
    h, L, g = 0.01, 1.0, 9.81
    column = straight(8, h, ElementBeamANCFCubic(1), angle=np.pi / 2)
    factor = Scene(column).clamp("left").gravity((0, -g)).buckling(1).factors[0]
    known = exact.greenhill_load(E, B * h**3 / 12, L) / (RHO * B * h * g)
    assert factor == pytest.approx(known, rel=3e-3)


def test_buckling_under_a_moved_support():
    """A support that moves by d compresses a pinned column by EA d / L."""
    h = 0.01
    scene = Scene(straight(8, h, ElementBeamANCFCubic(1))).pin("left").fix("right", "r^2")
    scene.fix("right", "r^1", displacement=-1e-3)
    known = exact.euler_buckling_load(E, B * h**3 / 12, 1.0, "pinned-pinned")
    assert scene.buckling(1).factors[0] == pytest.approx(known / (E * B * h * 1e-3), rel=2e-3)


def test_buckling_of_a_welded_column_and_of_the_sparse_branch(monkeypatch):
    h = 0.01
    known = exact.euler_buckling_load(E, B * h**3 / 12, 1.0, "fixed-free")

    def scene():
        a, b = straight(4, h, L=0.5), straight(4, h, L=0.5, origin=(0.5, 0))
        s = Scene(a, b).clamp("left", beam=a).point_force((-1, 0), (1, 0), beam=b)
        s.joint("weld", beams=(a, b), at=("right", "left"))
        return s

    assert scene().buckling(1).factors[0] == pytest.approx(known, rel=0.02)
    whole = Scene(straight(8, h)).clamp("left").point_force((-1, 0), (1, 0))
    dense = whole.buckling(3)
    monkeypatch.setattr(eigen, "DENSE", 10)
    sparse = whole.buckling(3)
    assert np.allclose(sparse.factors, dense.factors, rtol=1e-7)


# what is refused


@pytest.mark.parametrize("k", [0, -1, 1.5, True, 10**6])
def test_number_of_modes(k):
    with pytest.raises(InputError, match="number of modes"):
        Scene(straight(2)).modes(k)


def test_refused():
    with pytest.raises(InputError, match="pull the beam straight"):
        Scene(straight(4)).clamp("left").point_force((1, 0), (1, 0)).buckling()
    with pytest.raises(SupportError, match="rigid motions"):
        Scene(straight(4)).point_force((1, 0), (1, 0)).buckling()


def test_modes_of_free_beams_with_a_hinge_that_repeats_another():
    a, b = straight(2), straight(2, origin=(1, 0))
    once, twice = Scene(a, b), Scene(a, b)
    for scene in (once, twice, twice):
        scene.joint("hinge", beams=(a, b), at=(1, 0))
    with pytest.warns(ModelWarning, match="^2 of 4 equations"):
        found = twice.modes(6).frequencies
    known = once.modes(6).frequencies
    np.testing.assert_allclose(found[4:], known[4:], rtol=1e-7)


@pytest.mark.parametrize("place", [0.0, 1e4])
def test_of_a_state_that_turns_modes_say_that_they_know_its_stiffness_alone(place):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.02, origin=(place, 0))
    beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(E, 0.0, RHO), B)

    def instant(scene, speed, flight=0.0):
        scene.initial_velocity(lambda x: np.array([flight - speed * x[1], speed * (x[0] - place)]))
        return scene, scene.integrate(0.01, 1e-3).state(-1)

    scene, state = instant(Scene(beam).pin("left"), 20.0)
    with pytest.warns(ModelWarning, match="turns by 20 rad/s.*centrifugal") as found:
        scene.modes(2, state)
    assert found[0].filename == __file__
    for scene, state in (instant(Scene(beam), 1.0, 1e3), instant(Scene(beam).clamp("left"), 1.0)):
        scene.modes(5, state)  # warnings are errors
