"""Sections given by numbers are the geometrically exact beam, on an independent code."""

import exact
import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                        ElementBeamCable, ElementBeamPatelShabana, InputError, MeshBeam, Scene,
                        Section)
from skfem_ancf.materials.pointwise import PlaneSections

#: Simo's and Vu-Quoc's rod: rotary inertia is that of a section 14 times as high as the stiffness.
ROD = dict(EA=1e4, EI=500.0, GA=1e4, rhoA=1.0, rhoI=10.0)
START, END = (6.0, 0.0), (0.0, 8.0)


def rod(element, n, section=None, **line):
    mesh = MeshBeam.init_line(np.linspace(0.0, 10.0, n + 1), 0.7, **line)
    return Beam(mesh, element, section=section or Section.numbers(**ROD))


@pytest.mark.parametrize("element, n, error", [
    (ElementBeamANCF(1), 40, 4e-3), (ElementBeamANCF(3), 40, 4e-3),
    (ElementBeamPatelShabana(), 40, 4e-3), (ElementBeamANCFCubic(2), 10, 1e-3),
    (ElementBeamANCFHermite(4, 5), 5, 1e-3)])
def test_frequencies_are_those_of_plane_sections(element, n, error):
    right = exact.Reissner(**ROD, start=(0, 0), end=(10, 0), elements=8).frequencies(3)
    assert_allclose(right, [0.6469, 2.4399, 4.9369], atol=6e-5)
    beam = rod(element, n)
    assert beam.element.order == 1 and beam.element.axis_degree == element.axis_degree
    assert_allclose(Scene(beam).clamp("left").modes(3).frequencies, right, rtol=error)


@pytest.mark.parametrize("GA", [1e4, 50.0])
def test_a_moment_rolls_a_cantilever_to_a_circle_whatever_its_shear_stiffness(GA):
    section = Section.numbers(EA=1e4, EI=100.0, GA=GA)
    for element, n in ((ElementBeamANCFHermite(2, 5), 10), (ElementBeamANCFCubic(1), 40)):
        state = Scene(rod(element, n, section)).clamp("left").moment(
            "right", 2.0 * np.pi * 100.0 / 10.0).solve_static()
        assert_allclose(state.position((10, 0)), 0.0, atol=3e-3)
        assert_allclose(state.position((5, 0)), [0.0, 10.0 / np.pi], atol=3e-3)


def test_linear_sections_converge_to_the_circle():
    section = Section.numbers(EA=1e4, EI=100.0, GA=50.0)
    errors = [np.hypot(*Scene(rod(ElementBeamANCF(2), n, section)).clamp("left").moment(
        "right", 2.0 * np.pi * 10.0).solve_static().position((10, 0))) for n in (20, 40)]
    assert errors[1] < 0.3 * errors[0] < 0.15


def test_the_flying_rod_is_where_the_geometrically_exact_beam_is():
    def on(t):
        return np.where(t < 2.5, 1.0, 0.0)

    right = exact.Reissner(**ROD, start=START, end=END, elements=5).motion(
        lambda t: np.array([8.0, 0.0, 80.0]) * (t < 2.5), [2.5, 13.0], accuracy=1e-6)[-1, :2]
    assert_allclose(right[:, -1], [22.264, 1.420], atol=5e-3)  # with finer meshes and steps
    scene = Scene(rod(ElementBeamANCFCubic(2), 10, origin=START, angle=np.arctan2(8, -6)))
    scene.point_force((8, 0), at=START, amplitude=on).moment("left", 80.0, amplitude=on)
    history = scene.integrate(t_end=13.0, dt=0.05, breakpoints=[2.5])
    assert_allclose(history.position(END)[-1], right[:, -1], atol=0.05)
    assert_allclose(history.position(START)[-1], right[:, 0], atol=0.1)


def test_the_law_is_linear_in_the_strains_of_reissner():
    """Stress of points of a section that is stretched, bent and sheared, by its definition."""
    E, G = 3.0, 0.7
    law, n, t = PlaneSections(E, G), np.array([-np.sin(0.4), np.cos(0.4)]), np.array(
        [np.cos(0.4), np.sin(0.4)])
    for longer, slide in ((0.2, 0.0), (-0.3, 0.5), (0.0, -1.4)):
        f = (1.0 + longer) * t + slide * n
        strain = np.array([0.5 * (f @ f - 1.0), 0.0, f @ n])
        assert law.energy(strain) == pytest.approx(0.5 * (E * longer**2 + G * slide**2), rel=1e-12)
        S = law.stress(strain)  # f S_xx + n S_xy is the force on the section
        assert_allclose(S[0] * f + S[2] * n, E * longer * t + G * slide * n, atol=1e-13)
        d = np.array([0.3, -0.2, 0.5]) * 1e-6
        change = law.stress(strain + d) - law.stress(strain - d)
        assert_allclose(law.moduli(strain) @ d * 2.0, change, rtol=1e-6, atol=1e-12)
        gain = law.energy(strain + d) - law.energy(strain - d)
        assert gain == pytest.approx(2.0 * S @ d, rel=1e-6, abs=1e-15)


def test_user_defined_sections_of_higher_order_are_refused():
    class Mine(ElementBeamANCF):
        pass

    with pytest.raises(InputError, match="order 1, got Mine of order 2"):
        rod(Mine(2), 4)
    stiff = Section.numbers(EA=1e4, EI=1.0)
    assert rod(ElementBeamCable(5), 4, stiff).element.order == 0
    assert rod("auto", 4).element.order == 1


def test_stiffnesses_alone_have_no_stress(tmp_path):
    """Fields are NaN, pictures say what is missing; what is known is drawn and written."""
    bare = rod(ElementBeamCable(5), 8, Section.numbers(EA=1e5, EI=2.0))
    state = Scene(bare).clamp("left").point_force((0, -0.1), at="right").solve_static()
    assert np.all(np.isnan(state.stress((0.5, 0.0)))) and np.isnan(state.field("S_xx", (0.5, 0.0)))
    assert np.isnan(state.field("von_mises", (0.5, 0.0))) and "no stress" in state.recovered[0]
    assert np.all(np.isfinite(state.strain((0.5, 0.0))))
    with pytest.raises(InputError, match="sections with a shape; state.resultants"):
        state.plot("von_mises")
    with pytest.raises(InputError, match="sections with a shape"):
        state.extremes("S_xx")
    assert state.plot().get_title(loc="left")
    saved = meshio.read(state.save(tmp_path / "bare.vtu")).point_data
    assert np.all(np.isnan(saved["von_mises"])) and np.all(np.isfinite(saved["displacement"]))
