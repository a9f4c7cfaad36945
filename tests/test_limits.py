"""A static solution beyond a limit point of the path says so."""

import re
import warnings

import numpy as np
import pytest
from test_energy import cantilever, pull_in, stiffness

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, NeoHookean, Scene,
                        StabilityWarning, StVenantKirchhoff)

elements = pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(3)],
                                   ids=["sections", "cable"])


def arch(element, force, angle=0.0, law=StVenantKirchhoff):
    """Pinned, rise 0.05, height 0.01, with a force at 0.45 of the span 1; and the place of it."""
    x = np.linspace(0.0, 1.0, 21)
    c, s = np.cos(angle), np.sin(angle)
    p = np.array([[c, -s], [s, c]]) @ np.array([x, 0.2 * x * (1.0 - x)])
    scene = Scene(Beam(MeshBeam.from_points(p.T, 0.01), element, law(2e8, 0.3), width=0.01))
    at = scene.beams[0].mesh.p[:, 9]
    return scene.pin("left").pin("right").point_force(force * np.array([s, -c]), at=at), at


def told(scene):
    """The state, and texts of StabilityWarnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        state = scene.solve_static()
    return state, [str(w.message) for w in caught if issubclass(w.category, StabilityWarning)]


@pytest.fixture(scope="module")
def limits():
    """Limit loads of the arch by continuation, for each element."""
    return {type(e): arch(e, 1.0)[0].continuation(steps=40, until=lambda p: p.load < 0.5 and (
        not p.stable)).limit_points()[0] for e in (ElementBeamANCF(2), ElementBeamCable(3))}


@elements
@pytest.mark.parametrize("times", [1.05, 1.1, 1.2, 1.5, 2, 3, 5, 10, 20, 40])
def test_an_arch_that_has_snapped_says_the_limit_load(limits, element, times):
    scene, at = arch(element, times * limits[type(element)])
    state, texts = told(scene)
    assert state.displacement(at)[1] < -0.09 and state.stability == "stable"
    assert len(texts) == 1 and state.doubt in texts[0]
    says_the_level(state, times)


def says_the_level(state, times):
    levels = [float(x) for x in re.findall(r"\d\.\d+|\b1\b", state.doubt)]
    if "limit point" in state.doubt:
        assert levels[0] == pytest.approx(1.0 / times, rel=2e-2)
    else:  # between two load levels
        assert 0.97 * levels[0] < 1.0 / times < 1.03 * levels[1]


@pytest.mark.parametrize("angle, law", [(2.0, StVenantKirchhoff), (-0.5, NeoHookean)])
def test_it_does_so_at_any_angle_and_for_other_laws(limits, angle, law):
    scene, _ = arch(ElementBeamANCF(2), 4.0 * limits[ElementBeamANCF], angle, law)
    state, texts = told(scene)
    assert len(texts) == 1 and state.doubt in texts[0]
    says_the_level(state, 4.0)


@elements
def test_below_its_limit_load_it_does_not(limits, element):
    for times in (0.5, 0.9):
        state, texts = told(arch(element, times * limits[type(element)])[0])
        assert not texts and not state.doubt


@elements
@pytest.mark.parametrize("load", ["force", "moment", "follower", "gravity", "pushed"])
def test_large_deflections_alone_do_not(element, load):
    """A cantilever, bent by 1 to 3 rad, and a beam whose end is moved."""
    h, E = 0.01, 2e8
    EI = E * h**4 / 12.0
    scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 17), h), element,
                       StVenantKirchhoff(E, 0.3, 7800.0), width=h)).clamp("left")
    if load == "force":
        scene.point_force((0, -10.0 * EI), at=(1, 0))
    elif load == "moment":
        scene.moment("right", 3.0 * EI)
    elif load == "follower":
        scene.follower_force((0, -3.0 * EI), at=(1, 0))
    elif load == "gravity":
        scene.gravity((0, -20.0 * EI / (7800.0 * h * h)))
    else:
        scene.fix("right", "r^2", 0.5)
    state, texts = told(scene)
    assert not texts and not state.doubt and np.abs(state.u).max() > 0.3


@pytest.mark.parametrize("times", [0.9, 1.02, 2.0, 20.0])
def test_an_electrode_that_has_pulled_a_beam_in_is_said(times):
    """Beyond the pole of the energy there are stable states far behind the electrode."""
    height, width, gap = 0.002, 0.01, 0.01
    unit = times * pull_in() * stiffness(height, width) / width * gap**3
    scene = cantilever(8, height, width).energy(
        lambda r, F, X, t: -unit / (gap + r[1] - X[1]), over="bottom")
    state, texts = told(scene)
    if times < 1.0:
        assert not texts and state.displacement((1, 0))[1] > -0.5 * gap
        return
    assert state.displacement((1, 0))[1] < -gap and len(texts) == 1
    # the level, or those of the load steps before and beyond it
    said = [float(level) for level in re.search(
        r"load levels? (\d\.\d+)(?: and (\d\.\d+))?", texts[0]).groups() if level]
    assert max(said) - min(said) < 0.01
    assert np.clip(1.0 / times, min(said), max(said)) == pytest.approx(1.0 / times, rel=2e-3)
