"""Section forces, against the statics of the free body and closed forms."""

import itertools

import numpy as np
import pytest
from conftest import quarter_arc
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.core.quadrature import gauss

ELEMENTS = [ElementBeamANCF(1), ElementBeamANCF(3), ElementBeamANCFCubic(2), ElementBeamCable(5)]


def line(n=16, h=0.01, element=None, E=2e8, nu=0.3, density=7800, length=1.0, **options):
    return Beam(MeshBeam.init_line(np.linspace(0, length, n + 1), height=h),
                element or ElementBeamANCF(3), StVenantKirchhoff(E, nu, density), width=h,
                **options)


def axis(state, s):
    """Positions of the axis of a straight beam from 0 on, at arc lengths (n,)."""
    return state.position(np.array([s, 0.0 * s]))


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_weight_behind_each_section(element):
    state = Scene(line(element=element)).clamp("left").gravity((0, -9.81)).solve_static(tol=1e-12)
    r, w = state.resultants(), 7800 * 9.81 * 1e-4
    assert_allclose(r.force, [0 * r.s, -w * (1 - r.s)], atol=1e-9 * w)
    x, v = gauss(5)
    beam = state.beams[0]
    eta = np.tile(x, (5, 1)).ravel() - 0.5
    for k in range(0, len(r.s), 7):  # the moment of the weight about the axis, piece by piece
        cuts = np.append(r.s[k], np.linspace(0, 1, 17)[np.linspace(0, 1, 17) > r.s[k] + 1e-12])
        total = 0.0
        for a, b in itertools.pairwise(cuts):
            s, weight = np.repeat(a + (b - a) * x, 5), np.repeat((b - a) * v, 5) * np.tile(v, 5)
            at = state.position(np.array([s, 0.01 * eta]))[0]
            total += np.sum(weight * (at - axis(state, r.s[k:k + 1])[0]))
        assert r.M[k] == pytest.approx(-w * total, abs=2e-9 * w)
    root = state.reactions("left")
    assert_allclose(root.force, -r.force[:, 0], atol=1e-9 * w)
    assert r.M[0] == pytest.approx(-root.moment, abs=1e-9)
    assert_allclose(r.N * r.t + r.Q * np.array([-r.t[1], r.t[0]]), r.force, atol=1e-12)
    assert state.beams[0] is beam and r.recovered


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_end_force_on_an_arc(element):
    """The force is the same everywhere, the moment is that of its arm in the deformed body."""
    mesh = quarter_arc(8, height=0.05)
    beam = Beam(mesh, element, NeoHookean(1e7, 0.3) if element.order else
                StVenantKirchhoff(1e7, 0.3), width=0.05)
    P = np.array([6.0, -9.0])
    state = Scene(beam).clamp("left").point_force(P, at=mesh.p[:, -1]).solve_static(tol=1e-12)
    r = state.resultants()
    assert_allclose(r.force, np.repeat(P[:, None], len(r.s), 1), atol=1e-8 * 10)
    arm = state.position(mesh.p[:, -1])[:, None] - state.position(r.x)
    # the axis of the cable is of degree 5, that of the points cubic
    assert_allclose(r.M, cross(arm, P[:, None]), atol=1e-8 * 10 if beam.has_sections else 1e-3)
    assert_allclose(np.hypot(r.N, r.Q), np.hypot(*P), rtol=1e-9)
    assert np.ptp(r.M) > 5.0 and np.abs(arm).max() > 0.5
    # the axis points where the body's does
    d = np.diff(state.position(r.x), axis=1)
    middle = np.hypot(*d) > 1e-9
    found = np.arctan2(d[1], d[0])[middle]
    between = 0.5 * (r.angle[1:] + r.angle[:-1])[middle]
    assert_allclose(np.exp(1j * found), np.exp(1j * between), atol=0.04)


@pytest.mark.parametrize("at", [0.5, 0.53], ids=["at a node", "inside of an element"])
def test_beam_on_two_supports(at):
    """Force in the span: Q and M by statics, both sides of the jump."""
    beam = line(h=0.02, E=2e11)
    scene = Scene(beam).pin("left").fix("right", "r^2")
    state = scene.point_force((0, -1.0), at=(at, 0)).solve_static(tol=1e-12)
    r = state.resultants()
    before = r.s < at - 1e-9
    after = r.s > at + 1e-9
    Q, x = np.where(before, at - 1.0, at), axis(state, r.s)[0]
    assert_allclose(r.force[1][before | after], Q[before | after], atol=1e-8)
    load = axis(state, np.array([at]))[0]
    M = np.where(before, (1 - at) * x, at * (x[-1] - x))
    assert_allclose(r.M, M, atol=1e-7)
    jump = np.nonzero(~(before | after))[0]
    assert sorted(np.round(r.force[1][jump], 6)) == [at - 1.0, at]
    assert_allclose(r.M[jump], at * (1 - at), atol=1e-5)
    assert state.resultants((at, 0)).Q == pytest.approx(at - 1.0, abs=1e-6)  # before the jump
    right = state.resultants((at + 0.001, 0.004))
    assert right.Q == pytest.approx(at, abs=1e-6) and np.shape(right.M) == ()
    assert right.x == pytest.approx([at + 0.001, 0.0]) and load == pytest.approx(at, abs=1e-4)


@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_two_forces_on_few_elements(element, n):
    """M under forces inside of elements, beside supports, of a follower, above the axis."""
    places, x = (0.15, 0.3), np.array([0.05, 0.15, 0.2, 0.3, 0.6, 0.95])
    scene = Scene(line(n, h=0.02, E=2e11, element=element)).pin("left").fix("right", "r^2")
    scene = scene.point_force((0, -1.0), at=(places[0], 0))
    state = scene.follower_force((0, -1.0), at=(places[1], 0)).solve_static()
    M = sum(np.minimum((1 - a) * x, a * (1 - x)) for a in places)
    r = state.resultants(np.array([x, 0 * x]))
    assert state.recovered == {0: ""}
    assert_allclose(r.M, M, rtol=1e-5)
    assert_allclose(r.curvature * 2e11 * 0.02**4 / 12, M, rtol=1e-4)
    top = state.strain(np.array([x, 0 * x + 0.01]))[0]
    assert_allclose(top, -0.01 * M / (2e11 * 0.02**4 / 12), rtol=1e-3)
    if element.order:
        state = scene.point_force((4.0, 0.0), at=(0.5, 0.01)).solve_linear()
        before, after = state.resultants(np.array([[0.5 - 1e-6, 0.5 + 1e-6], [0, 0]])).M
        assert after - before == pytest.approx(0.04, rel=1e-3)


def test_frame_with_a_hinge():
    """A Gerber beam: no moment in the hinge, shear by statics."""
    steel = StVenantKirchhoff(1e9, 0.3)
    a, b = (Beam(MeshBeam.init_line(np.linspace(*ends, 9), height=0.02), ElementBeamANCF(2), steel,
                 width=0.1, name=name) for name, ends in (("a", (0, 1)), ("b", (1, 2))))
    scene = Scene(a, b).clamp("left", beam="a").pin("right", beam="b")
    scene.joint("hinge", beams=("a", "b"), at=(1, 0))
    state = scene.point_force((0, -0.1), at=(1.5, 0), beam="b").solve_static(tol=1e-12)
    ra, rb = (state.resultants(beam=name) for name in "ab")
    assert abs(ra.M[-1]) < 1e-9 and abs(rb.M[0]) < 1e-9
    assert ra.Q[0] == pytest.approx(-0.05, rel=1e-3) and rb.Q[-1] == pytest.approx(0.05, rel=1e-3)
    assert ra.M[0] == pytest.approx(-state.reactions("left", beam="a").moment, abs=1e-9)
    with pytest.raises(InputError, match="choose one with beam="):
        state.resultants()
    with pytest.raises(InputError, match="with beam="):
        state.resultants([(0.5, 0), (1.7, 0)])


@pytest.mark.parametrize("element", ELEMENTS[:3], ids=repr)
def test_strains_of_the_axis(element):
    """M / EI, N / EA, and the shear angle 6/5 + 3/20 nu/(1 + nu) times Q / GA.

    The second part is the section's change of thickness, which the axis' inclination holds.
    """
    h, E, nu = 0.05, 2e11, 0.3
    beam = line(h=h, E=E, element=element)
    scene = Scene(beam).clamp("left", thickness="free")
    state = scene.point_force((50.0, -10.0), at=(1, 0)).solve_static(tol=1e-12)
    r, A = state.resultants(), h * h
    inner = (r.s > 0.1) & (r.s < 0.9)
    assert_allclose(r.curvature[inner], (r.M / (E * h**4 / 12))[inner], rtol=1e-5)
    assert_allclose(r.stretch[inner] - 1, (r.N / (E * A))[inner], rtol=1e-4)
    k = 1.2 + 0.15 * nu / (1 + nu)
    assert_allclose(r.shear[inner], (k * r.Q / (E / (2 * (1 + nu)) * A))[inner], rtol=1e-4)


def test_diagrams(tmp_path):
    state = Scene(line(8, h=0.02)).clamp("left").point_force((1, -1.0), at=(0.5, 0)).solve_static()
    axes = state.plot_resultants(filename=tmp_path / "new" / "diagrams.png", title="three")
    assert (tmp_path / "new" / "diagrams.png").stat().st_size > 5000
    r = state.resultants()
    for ax, values in zip(axes, (r.N, r.Q, r.M)):
        line_ = ax.lines[0]
        assert_allclose(line_.get_xdata(), r.s)
        assert_allclose(line_.get_ydata(), values)
    assert axes[0].get_title(loc="left") == "three"
    with pytest.raises(InputError, match="three matplotlib Axes, got 2"):
        state.plot_resultants(axes=axes[:2])
