"""Natural frequencies and linear buckling against beam theory."""

import exact
import numpy as np
import pytest
from conftest import quarter_arc
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, Frame, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.core.errors import ConvergenceError, InputError, ModelWarning, SupportError
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.formulations import FORMULATIONS

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


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(3), ElementBeamCable(3),
                                     ElementBeamANCFCubic(2), ElementBeamPatelShabana()], ids=repr)
@pytest.mark.parametrize("ends", ENDS)
def test_modes_know_the_error_of_their_mesh(ends, element):
    """h / L = 1e-4: the theory's own error is below 1e-6. Elements of fourth order have up to a
    third less."""
    for ne in (4, 8, 16):
        scene, skip = held(straight(ne, 1e-4, element), ends)
        modes = scene.modes(3 + skip)
        assert np.all(np.isnan(modes.errors[:skip]))
        true = np.abs(modes.frequencies[skip:] / theory(1e-4, ends) - 1)
        seen = true > 2e-5
        ratio = modes.errors[skip:][seen] / true[seen]
        assert np.all((ratio > 0.85) & (ratio < 1.45))
        assert np.all(modes.errors[skip:][~seen] < 5e-5)


def test_modes_warn_of_a_coarse_mesh_and_of_no_other():
    """The third frequency of a cantilever, 5.3 % off with eight elements of second order."""
    third = theory(0.01, "fixed-free")[2]
    for element, n, off in ((ElementBeamANCF(3), 8, 0.053), (ElementBeamANCF(3), 16, None),
                            (ElementBeamANCFCubic(2), 8, None), (ElementBeamCable(5), 2, None)):
        scene, _ = held(straight(n, 0.01, element), "fixed-free")
        if off is None:
            assert scene.modes(3).frequencies[2] == pytest.approx(third, rel=0.02)
            continue
        with pytest.warns(ModelWarning, match="number 2 is about 5.* % off.*refined.*Cubic"):
            modes = scene.modes(3)
        assert modes.frequencies[2] / third - 1 == pytest.approx(off, rel=0.05)
        assert modes.errors[2] == pytest.approx(off, rel=0.05)
        finer = scene.replace(mesh=scene.beams[0].mesh.refined()).modes(3)  # as the message says
        assert finer.errors[2] < 0.03


def test_errors_of_frequencies_of_arcs_frames_and_loaded_beams():
    arc = Beam(quarter_arc(8, 0.01), ElementBeamANCFCubic(2), StVenantKirchhoff(E, 0.0, RHO), B)
    coarse, fine = (Scene(b).clamp("left").modes(3) for b in (
        arc, arc.replace(mesh=arc.mesh.refined(2))))
    true = np.abs(coarse.frequencies / fine.frequencies - 1)
    assert np.all(coarse.errors > 0.5 * true) and np.all(coarse.errors < 2 * true + 1e-5)
    frame = Frame.from_lines([(0, 0), (0, 3), (4, 3), (4, 0)], [(0, 1), (1, 2), (2, 3)],
                             nodes={"ground": [0, 3]}, material=StVenantKirchhoff(E, 0.0, RHO),
                             height=0.1, width=B, elements=2).clamp("ground")
    better = Frame.from_lines([(0, 0), (0, 3), (4, 3), (4, 0)], [(0, 1), (1, 2), (2, 3)],
                              nodes={"ground": [0, 3]}, material=StVenantKirchhoff(E, 0.0, RHO),
                              height=0.1, width=B, elements=8).clamp("ground")
    found, true = frame.modes(3), better.modes(3).frequencies
    true = np.abs(found.frequencies / true - 1)
    assert np.all(found.errors < 2 * true + 1e-4) and np.all(found.errors > 0.5 * true - 1e-4)
    loaded = Scene(straight(4)).clamp("left").point_force((0, -1), at="right")
    assert np.all(np.isnan(loaded.modes(4, loaded.solve_static()).errors))  # and no warning


def test_modes_of_more_than_digits_hold_are_refused():
    """Elements of 5e4 heights, two thousand of them: no digit of the bending is left."""
    scene, _ = held(straight(2000, 1e-8, ElementBeamANCF(2)), "fixed-free")
    with pytest.raises(ConvergenceError, match="too short for so slender a beam"):
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


def elastic_scale(beam):
    return np.sqrt(E / RHO) / beam.mesh.lengths.sum()


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
@pytest.mark.parametrize("name", ELEMENTS)
def test_free_beam_has_three_zero_modes(name):
    for formulation in FORMULATIONS:
        for mesh in (MeshBeam.init_line([0, 0.4, 1.0], 0.2, angle=0.5), quarter_arc(2, 0.2)):
            beam = Beam(mesh, ELEMENTS[name](), StVenantKirchhoff(E, 0.3, RHO), B,
                        formulation=formulation)
            frequencies = Scene(beam).modes(5).frequencies / elastic_scale(beam)
            assert np.abs(frequencies[:3]).max() < 1e-3, (formulation, frequencies)
            assert frequencies[3] > 0.1, (formulation, frequencies)


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
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


# what is refused


def test_refused():
    with pytest.raises(InputError, match="stiffen the beam"):
        Scene(straight(4)).clamp("left").point_force((1, 0), (1, 0)).buckling()
    with pytest.raises(SupportError, match="rigid motions"):
        Scene(straight(4)).point_force((1, 0), (1, 0)).buckling()


@pytest.mark.parametrize("place", [0.0, 1e4])
def test_of_a_state_that_turns_modes_say_that_they_know_its_stiffness_alone(place):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.02, origin=(place, 0))
    beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(E, 0.0, RHO), B)

    def instant(scene, speed, flight=0.0):
        scene.initial_velocity(lambda x: np.array([flight - speed * x[1], speed * (x[0] - place)]))
        return scene, scene.integrate(0.01, 1e-3).state(-1)

    scene, state = instant(Scene(beam).pin("left"), 20.0)
    with pytest.warns(ModelWarning, match="rotates at 20 rad/s.*centrifugal") as found:
        scene.modes(2, state)
    assert found[0].filename == __file__
    for scene, state in (instant(Scene(beam), 1.0, 1e3), instant(Scene(beam).clamp("left"), 1.0)):
        scene.modes(5, state)  # warnings are errors
