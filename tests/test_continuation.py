"""Arc-length continuation against limit loads of exact rods, and what a Path offers."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamCable, InputError, MeshBeam, Scene, StVenantKirchhoff,
                        SupportError, exact)


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


def past_the_maximum():
    """Stop below 97 % of the largest load."""
    been = [0.0]

    def until(point):
        been.append(point.load)
        return point.load < 0.97 * max(been)

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
    ux, uy, load = exact.lee_frame(21, A=6, I=2, L=120)
    point = np.array([tip, path.load / 10]).T
    rod = np.array([-uy, load / 10]).T
    rod = rod[: np.argmin(load) + 2]
    gaps = []
    for r in rod:
        a, d = point[:-1], np.diff(point, axis=0)
        s = np.clip(np.sum((r - a) * d, axis=1) / np.sum(d * d, axis=1), 0, 1)
        gaps.append(np.min(np.linalg.norm(a + s[:, None] * d - r, axis=1)))
    assert max(gaps) < 1e-3  # of the chords between points


@pytest.mark.parametrize("element, n, slenderness, tol", [
    (ElementBeamCable(5), 10, 1e4, 3e-5), (ElementBeamCable(3), 20, 1e3, 5e-3),
    (ElementBeamANCFCubic(2), 20, 1e3, 2e-3), (ElementBeamANCF(2), 40, 1e3, 0.05),
    (ElementBeamANCFCubic(3), 20, 1e5, 2e-3)])
def test_limits_of_the_slender_lee_frame(element, n, slenderness, tol):
    h = 1.0 / slenderness
    ds = 0.01 if tol < 1e-3 else 0.02
    _, limits = lee_limits(element, n, ds, h=h, L=1.0, b=1.0, E=12.0 / h**3)
    np.testing.assert_allclose(limits, exact.lee_frame_limits(), rtol=0, atol=tol)


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
    path = arch(element, n).continuation(steps=100, ds=0.005, ds_max=0.005,
                                         until=past_the_maximum())
    assert len(path.limit_points()) == 1
    assert abs(path.limit_points()[0] - exact.clamped_hinged_arch_limit()) < tol


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
    assert path.load[-1] > 80 > path.load[-2]
    deflection = -path.displacement((SPAN, RISE))[:, 1]
    assert np.max(np.abs(path.load - exact.williams_toggle(deflection))) < tol
    highest, lowest = path.limit_points()
    np.testing.assert_allclose([highest, lowest], [33.861233, 31.262583], rtol=0,
                               atol=max(tol, 2e-4))


def test_limit_points_do_not_depend_on_the_step():
    found = [toggle(ElementBeamCable(5), 6).continuation(steps=200, ds=ds, ds_max=ds,
                                                         max_load=60).limit_points()
             for ds in (0.001, 0.002, 0.004)]
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=3e-4)
    np.testing.assert_allclose(found[2], found[0], rtol=0, atol=1e-2)


# stability


def shallow(rise, element=None, n=8, force=1.0):
    """A pinned shallow arch that snaps through; every support only fixes coordinates."""
    mesh = MeshBeam.init_curve(lambda s: np.array([s, rise * np.sin(np.pi * s)]),
                               np.linspace(0, 1, n + 1), 0.02)
    beam = Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), 0.01,
                formulation="assumed")
    return Scene(beam).pin("left").pin("right").point_force((0, -force), at=(0.5, rise))


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCFCubic(2)])
@pytest.mark.parametrize("rise", [0.02, 0.025])
def test_stability_changes_at_limit_points(rise, element):
    path = shallow(rise, element).continuation(steps=60, ds=1e-3, ds_max=1e-3)
    assert len(path.limit_points()) == 2
    rising = np.array([p.rate > 0 for p in path.points[:-1]])
    assert path.stable[:-1] == rising.tolist()


def test_stability_is_lost_before_the_limit_point_where_the_path_branches():
    path = shallow(0.035).continuation(steps=40, ds=1e-3, ds_max=1e-3)
    lost = path.stable.index(False)
    assert path.load[lost] < 0.98 * path.limit_points()[0] and path.points[lost].rate > 0


def test_stability_is_not_said_with_multipliers():
    path = toggle(ElementBeamCable(5), 2).continuation(steps=3)
    assert path.stable[1:] == [None] * 3


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
    figure = Figure()
    path.plot(point, component=1, ax=figure.subplots())
    figure.savefig(tmp_path / "path.png")


def test_a_path_is_a_static_solution(path):
    state = path.state(2)
    scene = shallow(0.02, force=state.load)
    np.testing.assert_allclose(scene.solve_static().u, state.u, rtol=0, atol=1e-7)


def test_path_without_limit_point():
    path = shallow(0.005).continuation(steps=10)
    assert path.limit_points().shape == (0,)


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
    assert path.load[-1] > 1.5 > np.max(path.load[:-1])


def test_steps_grow_up_to_ds_max():
    path = shallow(0.02).continuation(steps=12, ds=1e-4, ds_max=1e-3)
    steps = np.diff(path.arc)
    assert steps[0] == pytest.approx(1e-4) and 5e-4 < steps.max() <= 1e-3 * (1 + 1e-12)


def test_failure_keeps_the_path():
    # one iteration is a prediction and no more
    with pytest.raises(ConvergenceError, match="load") as failure:
        shallow(0.02).continuation(steps=20, ds=1e-3, max_iterations=1, tol=1e-14)
    path = failure.value.state
    assert len(path) >= 1 and path.load[0] == 0.0
    assert path.state(len(path) - 1).converged
    assert path.displacement((0.5, 0.02)).shape == (len(path), 2)


def test_loads_that_move_nothing():
    mesh = MeshBeam.init_line([0, 1, 2], 0.1)
    beam = Beam(mesh, ElementBeamANCF(1), StVenantKirchhoff(1.0, 0.3), 1.0, formulation="assumed")
    with pytest.raises(ConvergenceError, match="move nothing"):
        Scene(beam).clamp("left").continuation()


@pytest.mark.parametrize("options", [dict(ds=0.0), dict(ds=-1.0), dict(ds=np.nan),
                                     dict(ds_max=-0.1), dict(ds="a")])
def test_bad_input(options):
    with pytest.raises(InputError):
        shallow(0.02).continuation(**options)


def test_supports_are_required():
    mesh = MeshBeam.init_line([0, 1, 2], 0.1)
    beam = Beam(mesh, ElementBeamANCF(1), StVenantKirchhoff(1.0, 0.3), 1.0, formulation="assumed")
    with pytest.raises(SupportError, match="rotation"):
        Scene(beam).pin("left").point_force((0, 1), at=(2, 0)).continuation()
