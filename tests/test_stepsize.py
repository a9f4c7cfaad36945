"""Steps of automatic size, events, instants within steps, and what a History counts."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_dynamics import GRAVITY, by_scipy, soft

from skfem_ancf import Scene
from skfem_ancf.core.errors import InputError
from skfem_ancf.dynamics import SCHEMES, GeneralizedAlpha
from skfem_ancf.dynamics.base import in_steps
from skfem_ancf.dynamics.history import momentum


def positions(scene):
    """Which coordinates are positions of nodes."""
    return np.concatenate([np.arange(b.N) % b.nd < 2 for b in scene.beams])


# accuracy


def swinging():
    return Scene(soft(2, 2, E=1e5, h=0.1)).pin("left").gravity(GRAVITY)


def vibrating():
    """A cantilever that a force shakes faster than it vibrates itself."""
    beam = soft(2, 1, E=1e7, h=0.2)
    return Scene(beam).clamp("left").gravity((0, -400.0), amplitude=lambda t: np.sin(40 * t) ** 2)


MOTIONS = {"swinging": (swinging, 0.5), "vibrating": (vibrating, 0.25)}


@lru_cache
def known(name):
    build, t_end = MOTIONS[name]
    times = np.linspace(0, t_end, 21)[1:]
    return times, by_scipy(build(), times, rtol=1e-9, atol=1e-10)[0]


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("scheme", [name for name, cls in SCHEMES.items() if cls.adaptive])
def test_error_is_in_proportion_to_the_tolerance(scheme, name):
    build, t_end = MOTIONS[name]
    times, u = known(name)
    ratios = []
    for rtol in (1e-3, 1e-4):
        scene = build()
        history = scene.integrate(t_end, "auto", scheme=scheme, rtol=rtol, t_eval=times)
        error = np.abs(history.u - u)[:, positions(scene)].max() / scene.system.size
        ratios.append(error / rtol)
    assert np.abs(u).max() > 0.1
    assert 0.05 < min(ratios) and max(ratios) < 2.5, ratios


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
@pytest.mark.parametrize("scheme, size", [("auto", 1e-4), ("energy-momentum", 1e-5)])
def test_small_vibrations_are_right(scheme, size):
    """The first mode swings as a cosine with the frequency of the eigenvalue problem."""
    scene = Scene(soft(2, 2, E=1e5, h=0.1)).clamp("left")
    modes = scene.modes(1)
    largest = np.abs(modes.mode(0, 1.0).u[positions(scene)]).max()
    start = modes.mode(0, size * scene.system.size / largest)
    period = 2.0 * np.pi / modes.frequencies[0]
    history = scene.integrate(3.0 * period, "auto", scheme=scheme, start=start,
                              t_eval=np.linspace(0.0, 3.0 * period, 25))
    right = np.cos(modes.frequencies[0] * history.t)[:, None] * start.u
    at = positions(scene)
    assert np.abs(history.u - right)[:, at].max() < 0.01 * np.abs(start.u[at]).max()


@pytest.mark.parametrize("name, rtol, tol", [("swinging", 1e-6, 1e-3), ("vibrating", 1e-4, 1e-2)])
def test_as_many_steps_as_scipy_at_the_same_error(name, rtol, tol):
    """By its Radau, of the same order; its tolerances are of a step, of rates too."""
    build, t_end = MOTIONS[name]
    times, u = known(name)
    scene = build()
    history = scene.integrate(t_end, "auto", scheme="radau", rtol=rtol, t_eval=times)
    s, free = scene.system, np.nonzero(scene.system.constraints.free)[0]
    M = np.linalg.inv(s.mass.tocsc()[free][:, free].toarray())

    def rate(t, y):
        full = np.zeros(s.N)
        full[free] = y[:len(free)]
        force = s.external_force(full, t) - s.internal_force(full, t)
        return np.append(y[len(free):], M @ force[free])

    found = solve_ivp(rate, (0, t_end), np.zeros(2 * len(free)), "Radau", rtol=tol, atol=tol,
                      dense_output=True)
    theirs = np.zeros_like(u)
    theirs[:, free] = found.sol(times)[:len(free)].T
    off, other = (np.abs(x - u)[:, positions(scene)].max() for x in (history.u, theirs))
    assert off < 2.0 * other and off < rtol * s.size
    assert history.steps + history.rejected < 1.3 * len(found.t)


# a second motion in half steps


@pytest.mark.parametrize("dt", [5e-3, "auto"])
@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("scheme", [name for name, cls in SCHEMES.items() if cls.adaptive])
def test_the_difference_from_half_steps_is_about_the_error(scheme, name, dt):
    """Of the farthest node at the stored instants, against SciPy."""
    build, t_end = MOTIONS[name]
    times, u = known(name)
    scene = build()
    history = scene.integrate(t_end, dt, scheme=scheme, rtol=1e-3, t_eval=times, check=True)
    off = (history.u - u)[:, positions(scene)].reshape(len(u), -1, 2)
    most = np.hypot(*np.moveaxis(off, 2, 0)).max() / scene.system.size
    assert 0.4 * most - 1e-7 < history.error < 1.5 * most + 1e-7


def test_a_check_that_cannot_be_says_so(tmp_path):
    for options, text in (({"checkpoint": tmp_path / "b.npz"}, "a checkpoint cannot store"),
                          ({"check": 1}, "True or False")):
        with pytest.raises(InputError, match=text):
            swinging().integrate(**{"t_end": 0.02, "dt": 0.01, "check": True, **options})


def test_schemes_without_an_estimate_say_so():
    class Mine(GeneralizedAlpha):
        adaptive = False

    with pytest.raises(InputError, match="give a step size dt, or use a scheme of the package"):
        swinging().integrate(0.5, "auto", scheme=Mine())


# events


def blow(t, at=0.7, width=0.002):
    return np.where(np.abs(t - at) < width, np.cos(0.5 * np.pi * (t - at) / width) ** 2, 0.0)


@pytest.mark.filterwarnings("ignore:elements are turned inside out")
@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha"])
def test_a_blow_after_rest_is_seen(scheme):
    scene = Scene(soft(2, 1, E=1e4))
    scene.point_force((3e4, 0.0), (0.5, 0.1), amplitude=blow)
    history = scene.integrate(1.0, "auto", scheme=scheme, rtol=1e-3)
    assert history.momentum[-1][0] == pytest.approx(3e4 * 0.002, rel=0.02)
    assert np.diff(history.t).max() > 50 * np.diff(history.t).min()
    # whatever is at rest before and after does not ask for many steps
    assert history.steps < 6000 and history.rejected > 0


@pytest.mark.parametrize("kind", ["support", "joint"])
def test_a_driven_motion_after_rest_is_seen(kind):
    """A bump of a support, and one of a point that multipliers hold."""
    at = (0.0, 0.0) if kind == "support" else (0.3, 0.01)
    def build():
        scene = Scene(soft(2, 1, E=1e4))
        scene.joint("position", at=at,
                    r=lambda t: (at[0], at[1] + 0.05 * float(blow(t, 0.7, 0.02))))
        return scene

    scene = build()
    history = scene.integrate(1.0, "auto", rtol=1e-4)
    fine = build().integrate(1.0, 2e-4, t_eval=[1.0])
    assert np.abs(fine.u).max() > 0.02
    assert np.abs(history.u[-1] - fine.u[-1]).max() < 2e-3


@pytest.mark.parametrize("scheme", [name for name, cls in SCHEMES.items() if cls.adaptive])
@pytest.mark.parametrize("compiled", [True, False])
def test_steps_end_at_breakpoints(scheme, compiled):
    """A force that is switched: its impulse is exact, and the accelerations jump with it."""
    def run(**options):
        scene = Scene(soft(2, 1, E=1e4, compiled=compiled))
        scene.point_force((3.0, 0.0), (0.5, 0.1),
                          amplitude=lambda t: np.where((t >= 0.0333) & (t < 0.0777), 1.0, 0.0))
        return scene.integrate(0.1, 5e-3, scheme=scheme, **options)

    history = run(breakpoints=[0.0333, 0.0777, 5.0])  # what lies outside does not matter
    assert {0.0333, 0.0777} < set(history.t.tolist()) and np.all(np.diff(history.t) > 1e-6)
    assert history.momentum[-1][0] == pytest.approx(3.0 * 0.0444, rel=1e-9)
    mass = history.system.mass.multiply(history.acceleration.T[:, 0])  # of one instant: shape
    assert mass.shape == (history.u.shape[1],)
    total = np.array([momentum(history.system, a)[0] for a in history.acceleration])
    on = (history.t >= 0.0333) & (history.t < 0.0777)
    first = np.searchsorted(history.t, 0.0333)
    assert total[first] == pytest.approx(3.0, rel=1e-9) and abs(total[first - 1]) < 1e-9
    assert np.abs(total[on][2:] - 3.0).max() < 1e-6
    assert abs(run().momentum[-1][0] - 3.0 * 0.0444) > 1e-4


# instants within steps


@pytest.mark.parametrize("scheme", [*(cls() for cls in SCHEMES.values() if in_steps(cls())),
                                    GeneralizedAlpha(0.5)], ids=repr)
def test_order_within_steps(scheme):
    """Displacement, velocity, acceleration and multipliers at instants that no step meets."""
    def build():
        scene = Scene(soft(2, 1, E=1e4, h=0.3)).gravity(GRAVITY)
        scene.joint("position", at=(0.0, 0.05), r=lambda t: (0.1 * np.sin(2 * t) ** 3, 0.05))
        return scene

    times = np.array([0.05137, 0.1113, 0.19779])
    errors = []
    exact = (build().integrate(0.2, 0.2 / n, t_eval=times) for n in (1600, 3200))
    coarse, fine = exact
    names = ("u", "v", "acceleration", "multipliers")
    best = {k: (4 * getattr(fine, k) - getattr(coarse, k)) / 3 for k in names}
    for n in (60, 120):
        run = build().integrate(0.2, 0.2 / n, scheme=scheme, t_eval=times)
        errors.append([np.abs(getattr(run, k) - best[k]).max() for k in names])
    rates = np.log2(np.divide(*errors))
    # where in its step an instant lies changes too: the rates scatter
    assert np.all(rates[:2] > 1.5) and np.all(rates[2:] > 1.2), rates
    assert np.all(rates < 3.5), rates
