"""Arc-length continuation against limit loads of exact rods, and what a Path offers."""

import exact
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from skfem import LinearForm

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, InputError, MeshBeam, Scene, StVenantKirchhoff,
                        SupportError)


def lee(element, n, h, L, b, E):
    """Lee's frame: two members of n elements; the load factor is in EI / L^2."""
    material = StVenantKirchhoff(E, 0.3)
    column = Beam(MeshBeam.init_line(np.linspace(0, L, n + 1), h, angle=np.pi / 2), element,
                  material, b, formulation="assumed", name="column")
    m = n // 5
    x = np.append(np.linspace(0, L / 5, m + 1), np.linspace(L / 5, L, n - m + 1)[1:])
    girder = Beam(MeshBeam.init_line(x, h, origin=(0, L)), element, material, b,
                  formulation="assumed", name="girder")
    scene = Scene(column, girder).pin("left", beam="column").pin("right", beam="girder")
    scene.joint("weld", beams=(column, girder), at=("right", "left"))
    return scene.point_force((0, -E * b * h**3 / 12 / L**2), at=(L / 5, L), beam=girder)


def around_the_minimum():
    """Stop on the way up after the minimum."""
    been = []

    def until(point):
        been.append(point.load)
        return min(been) < -5.0 < point.load

    return until


def lee_limits(element, n, ds, h=2.0, L=120.0, b=3.0, E=720.0):
    path = lee(element, n, h, L, b, E).continuation(steps=400, ds=ds, ds_max=ds,
                                                    until=around_the_minimum())
    return path, path.limit_points()


def test_limits_of_lee_frame_with_quintic_cables():
    path, limits = lee_limits(ElementBeamCable(5), 10, 0.005)
    np.testing.assert_allclose(limits, exact.lee_frame_limits(A=6, I=2, L=120), rtol=0, atol=6e-6)
    # through snap-back: the loaded point comes up again while the load falls
    tip = -path.displacement((24, 120), beam="girder")[:, 1] / 120
    fall = (path.load > -5) & (np.arange(len(path)) > np.argmax(path.load))
    assert np.any(np.diff(tip[fall]) < 0)
    # and the whole path lies on that of the rod
    _ux, uy, load = exact.lee_frame(21, A=6, I=2, L=120)
    point = np.array([tip, path.load / 10]).T
    rod = np.array([-uy, load / 10]).T
    rod = rod[: np.argmin(load) + 2]
    gaps = []
    for r in rod:
        a, d = point[:-1], np.diff(point, axis=0)
        s = np.clip(np.sum((r - a) * d, axis=1) / np.sum(d * d, axis=1), 0, 1)
        gaps.append(np.min(np.linalg.norm(a + s[:, None] * d - r, axis=1)))
    assert max(gaps) < 1e-3  # of the chords between points


SPAN, RISE, EA, EI = 12.943, 0.386, 1.885e6, 9.27e3


def toggle(element, n):
    """Half of Williams' toggle; the load factor is in pounds on the whole."""
    h = np.sqrt(12 * EI / EA)
    mesh = MeshBeam.init_line(np.linspace(0, np.hypot(SPAN, RISE), n + 1), h,
                              angle=np.arctan2(RISE, SPAN))
    beam = Beam(mesh, element, StVenantKirchhoff(1.03e7, 0.0), EA / 1.03e7 / h,
                formulation="assumed")
    scene = Scene(beam).clamp("left", thickness="free").fix("right", "r^1")
    scene.joint("plane", at="right")
    return scene.point_force((0, -0.5), at=(SPAN, RISE))


@pytest.mark.parametrize("element, n, tol", [
    (ElementBeamCable(5), 8, 1e-6), (ElementBeamCable(7), 4, 1e-6), (ElementBeamCable(3), 16, 0.1),
    (ElementBeamANCFCubic(2), 8, 0.2), (ElementBeamANCF(2), 32, 0.5)])
def test_williams_toggle(element, n, tol):
    path = toggle(element, n).continuation(steps=100, ds=0.002, ds_max=0.002, max_load=80)
    assert path.load[-1] == 80 > path.load[-2]
    deflection = -path.displacement((SPAN, RISE))[:, 1]
    assert np.max(np.abs(path.load - exact.williams_toggle(deflection))) < tol
    highest, lowest = path.limit_points()
    np.testing.assert_allclose([highest, lowest], [33.861233, 31.262583], rtol=0,
                               atol=max(tol, 2e-4))


# critical points of an arch whose loads are known in closed form


def sine_arch(ratio, h=1e-3):
    """A shallow arch H sin(pi x) of L = 1, H = ratio h, under a load q sin(pi x).

    In the theory of shallow arches the deflection is a multiple x of the arch, and
    q = EI pi^4 H ((1 - x) + c x (1 - x^2)), c = H^2 A / 4 I. The load factor is q.
    """
    H = ratio * h
    mesh = MeshBeam.init_curve(lambda s: np.array([s, H * np.sin(np.pi * s)]),
                               np.linspace(0, 1, 9), h)
    beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(12 / h**3, 0.0), 1.0)
    form = LinearForm(lambda v, w: -np.sin(np.pi * w.x[0]) * v[1] / h)
    c = 3.0 * ratio**2

    def load(x):
        return np.pi**4 * H * ((1 - x) + c * x * (1 - x**2))

    return Scene(beam).pin("left").pin("right").load(form), c, load


def test_critical_loads_of_a_shallow_arch():
    """Default steps: the axis force reaches that of two half waves, then the load turns.

    With x^2 = 1 - 4 / c and (1 - 1 / c) / 3; the way down has both once more. In arches with
    c > 9 three half waves come as well.
    """
    scene, c, load = sine_arch(1.6)
    path = scene.continuation(steps=200, max_load=1.2 * load(np.sqrt((1 - 1 / c) / 3)))
    x, y = np.sqrt((1 - 1 / c) / 3), np.sqrt(1 - 4 / c)
    assert [p.kind for p in path.critical_points] == ["bifurcation", "limit", "limit",
                                                      "bifurcation"]
    np.testing.assert_allclose(path.limit_points(), [load(x), load(-x)], rtol=1e-4)
    np.testing.assert_allclose(path.bifurcation_points(), [load(y), load(-y)], rtol=1e-4)
    assert [p.change for p in path.critical_points] == [1, 1, -1, -1]
    assert path.load[-1] == pytest.approx(1.2 * load(x), rel=1e-15)
    first = path.critical_points[0]
    across = first.mode.reshape(-1, 6)[:, 1]
    assert np.abs(across + across[::-1]).max() < 1e-4 * np.abs(across).max()  # two half waves
    assert np.abs(path.error).max() < 1e-7
    # the state is an equilibrium, and its tangent is singular
    system = first.state.system
    system.assemble(first.state.u, first.load)
    force = system.K.tocsc() @ first.mode * system.constraints.free
    scale = system.K.diagonal() * np.abs(first.mode)
    assert np.abs(force).max() < 1e-6 * scale.max()


# branches


def column(slenderness=1e3, n=8):
    """A cantilever under a load at its end; the load factor is in EI / L^2."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), 1 / slenderness)
    beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(12 * slenderness**3, 0.0), 1.0)
    return Scene(beam).clamp("left").point_force((-1, 0), (1, 0))


@pytest.mark.parametrize("side", [1, -1])
def test_post_buckling_of_eulers_column(side):
    """The elastica: with k = sin(alpha / 2), alpha the angle of the end, P = K(k)^2,
    deflection 2 k / K(k) and height of the end 2 E(k) / K(k) - 1."""
    scene = column()
    trunk = scene.continuation(max_load=5, ds=1e-5)
    path = scene.continuation(branch=trunk.critical_points[0], side=side, max_load=9)
    assert path.load[0] == trunk.critical_points[0].load and path.load[-1] == 9.0
    tip = path.displacement((1, 0))
    assert np.all(side * tip[1:, 1] * tip[-1, 1] * side > 0) and all(path.stable[1:])
    for P, (ux, uy) in zip(path.load[1:], tip[1:]):
        m = brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 2 - ux, 0.0, 0.99)
        assert P == pytest.approx(ellipk(m) ** 2, rel=1e-4)
        assert abs(uy) == pytest.approx(2 * np.sqrt(m) / ellipk(m), abs=1e-4)


# stability


def shallow(rise, element=None, n=8, force=1.0):
    """A pinned shallow arch that snaps through; every support only fixes coordinates."""
    mesh = MeshBeam.init_curve(lambda s: np.array([s, rise * np.sin(np.pi * s)]),
                               np.linspace(0, 1, n + 1), 0.02)
    beam = Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), 0.01,
                formulation="assumed")
    return Scene(beam).pin("left").pin("right").point_force((0, -force), at=(0.5, rise))


# what a path offers


@pytest.fixture(scope="module")
def path():
    return shallow(0.02).continuation(steps=20, ds=2e-3, ds_max=2e-3)


def test_path_api(path, tmp_path):
    n, N = len(path), path.system.N
    assert n == 21 and path.u.shape == (n, N) and path.load.shape == path.arc.shape == (n,)
    assert path.load[0] == 0.0 and not np.any(path.u[0]) and np.all(np.diff(path.arc) > 0)
    assert path.iterations == sum(p.iterations for p in path.points) and path.iterations >= 20
    assert repr(n) in repr(path)
    state = path.state(7)
    assert state.load == path.load[7] and np.array_equal(state.u, path.u[7]) and state.converged
    point = (0.5, 0.02)
    np.testing.assert_allclose(path.displacement(point)[7], state.displacement(point), atol=1e-15)
    reaction = state.reactions("left").force + state.reactions("right").force
    np.testing.assert_allclose(reaction, [0, state.load], rtol=0, atol=1e-6 * abs(state.load))
    figure = pytest.importorskip("matplotlib.figure").Figure()
    path.plot(point, component=1, ax=figure.subplots())
    figure.savefig(tmp_path / "path.png")


def test_path_with_a_prescribed_displacement():
    # pull the right end: the load factor is the part of the displacement
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.05)
    beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), 0.01, formulation="assumed")
    scene = Scene(beam).clamp("left").fix("right", "r^1", displacement=0.02)
    path = scene.continuation(steps=30, ds=0.002, max_load=1.0)
    np.testing.assert_allclose(path.displacement((1, 0))[:, 0], 0.02 * path.load, atol=1e-12)


# ends


def test_steps_until_and_max_load():
    scene = shallow(0.02)
    assert len(scene.continuation(steps=5)) == 6
    seen = []
    path = scene.continuation(steps=50, ds=1e-3, until=lambda p: seen.append(p.arc) or p.arc > 4e-3)
    assert len(seen) == len(path) - 1 and path.arc[-1] > 4e-3 >= path.arc[-2]
    path = scene.continuation(steps=100, ds=1e-3, max_load=1.5)
    assert path.load[-1] == 1.5 > np.max(path.load[:-1])
    state = path.state(-1)
    reaction = state.reactions("left").force + state.reactions("right").force
    np.testing.assert_allclose(reaction, [0, 1.5], rtol=0, atol=1e-6)


def test_failure_keeps_the_path():
    # one iteration is a prediction and no more
    with pytest.raises(ConvergenceError, match="load") as failure:
        shallow(0.02).continuation(steps=20, ds=1e-3, max_iterations=1, tol=1e-14)
    path = failure.value.state
    assert len(path) >= 1 and path.load[0] == 0.0
    assert path.state(len(path) - 1).converged
    assert path.displacement((0.5, 0.02)).shape == (len(path), 2)


@pytest.mark.parametrize("options", [
    dict(ds=0.0), dict(ds=-1.0), dict(ds=np.nan), dict(ds_max=-0.1), dict(ds="a"),
    dict(steps=10**30), dict(steps=0), dict(steps=1.5), dict(steps="a"), dict(max_load=0.0),
    dict(tol=-1.0), dict(max_iterations=0), dict(locate=0.0), dict(side=2), dict(side="left"),
    dict(until=3), dict(branch=7)])
def test_bad_input(options):
    with pytest.raises(InputError):
        shallow(0.02).continuation(**options)


def test_supports_are_required():
    mesh = MeshBeam.init_line([0, 1, 2], 0.1)
    beam = Beam(mesh, ElementBeamANCF(1), StVenantKirchhoff(1.0, 0.3), 1.0, formulation="assumed")
    with pytest.raises(SupportError, match="rotation"):
        Scene(beam).pin("left").point_force((0, 1), at=(2, 0)).continuation()


def past_the_maximum():
    """Stop below 97 % of the largest load."""
    been = [0.0]

    def until(point):
        been.append(point.load)
        return point.load < 0.97 * max(been)

    return until


def arch(element, n, h=1e-3, angle=215.0):
    """Clamped at the left, hinged at the right; the load factor is in EI / R^2."""
    a = np.deg2rad(angle) / 2
    mesh = MeshBeam.init_curve(lambda s: np.array([np.sin(s), np.cos(s)]),
                               np.linspace(-a, a, n + 1), h)
    beam = Beam(mesh, element, StVenantKirchhoff(12 / (h**3 * 0.01), 0.3), 0.01,
                formulation="assumed")
    scene = Scene(beam).clamp("left", thickness="free").pin("right")
    return scene.point_force((0, -1), at=(0, 1))


@pytest.mark.parametrize("element, n, tol", [
    (ElementBeamCable(5), 32, 1e-5), (ElementBeamANCFCubic(2), 48, 5e-3),
    (ElementBeamANCF(2), 64, 0.2)])
def test_limit_of_the_deep_arch(element, n, tol):
    limits = arch(element, n).continuation(until=past_the_maximum()).limit_points()
    assert len(limits) == 1
    assert abs(limits[0] - exact.clamped_hinged_arch_limit()) < tol
