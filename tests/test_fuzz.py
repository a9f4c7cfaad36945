"""Random static scenes: an equilibrium that holds on its own evaluation, or an error of ours.

The scenes and the checks are those of benchmarks/fuzz.py, which runs thousands of them
(``make fuzz``). Here Hypothesis draws a few, the same each time, and shrinks what fails.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

hypothesis = pytest.importorskip("hypothesis")
given, settings, st = hypothesis.given, hypothesis.settings, hypothesis.strategies

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"
if not (FOLDER / "fuzz.py").exists():
    pytest.skip("benchmarks/ is not part of this installation", allow_module_level=True)
sys.path.insert(0, str(FOLDER))

import fuzz


class Drawn:
    """Draws by Hypothesis, with the methods of ``fuzz.Dice``."""

    def __init__(self, draw):
        self.draw = draw

    def integer(self, low, high):
        return self.draw(st.integers(low, high))

    def number(self, low, high):
        return float(f"{low + (high - low) * self.draw(st.integers(0, 200)) / 200:.3g}")

    def choice(self, items):
        return self.draw(st.sampled_from(list(items)))


@st.composite
def scripts(draw):
    return fuzz.draw(Drawn(draw))


@settings(max_examples=50, derandomize=True, database=None, deadline=None,
          suppress_health_check=list(hypothesis.HealthCheck))
@given(scripts(), st.integers(0, 4))
def test_a_random_scene_ends_in_an_equilibrium_or_in_an_error_of_ours(script, number):
    outcome, wrong = fuzz.run(script, compare=number == 0)
    hypothesis.note(f"{fuzz.HEADER}COMPILED = True\n{script}{outcome}: {wrong}")
    assert not wrong


# the checks see what they are there for

PLAIN = """mesh0 = MeshBeam.init_line(np.linspace(0, 1.0, 4), 0.05)
beam0 = Beam(mesh0, ELEMENTS["ancf-2"](), StVenantKirchhoff(1e6, 0.3, 1.0), 0.1, {formulation!r},
             compiled=COMPILED)
scene = Scene(beam0).clamp("left").point_force((0.0, -1.0), at=(1.0, 0.0))
options = {{}}
"""


@pytest.mark.parametrize("formulation", fuzz.FORMULATIONS)
def test_a_wrong_equilibrium_is_seen(formulation):
    script = PLAIN.format(formulation=formulation)
    assert fuzz.run(script, compare=True) == ("stable", "")
    scene, (state, *_), _ = fuzz.solve(script, False)
    state = state.replace(u=state.u * (1 + 1e-3))
    with pytest.raises(fuzz.Wrong, match="residual"):
        fuzz.check(scene, state)


def test_leaves_that_touch_are_checked():
    """They are in equilibrium, and a displacement that is none is seen."""
    script = fuzz.draw_leaves(fuzz.Dice((7, 2)))
    assert "contact" in script and fuzz.run(script) == ("in contact", "")
    scene, (state, *_), _ = fuzz.solve(script, False)
    with pytest.raises(fuzz.Wrong):
        fuzz.check(scene, state.replace(u=state.u * (1 + 1e-3)))


SLIDING = """mesh0 = MeshBeam.init_line(np.linspace(0, 1.0, 9), 0.02)
mesh1 = MeshBeam.init_line(np.linspace(0, 1.1, 9), 0.02, origin=(0.0, -0.02))
beam0, beam1 = (Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(1e6, 0.3, 1), 0.1, name=name,
                     compiled=COMPILED) for mesh, name in ((mesh0, "b0"), (mesh1, "b1")))
scene = Scene(beam0, beam1)
for beam in (beam0, beam1):
    scene.clamp("left", beam=beam, thickness="free")
scene.contact("all", friction=0.3)
scene.line_load((0.0, -0.05), beam=beam0, amplitude=lambda t: np.interp(t, [0, 1, 2], [0, 1, 0.6]))
options = {"increments": 3}
"""


def test_friction_of_members_is_checked():
    """It is at its limit where leaves slide: a hundredth more or less is seen."""
    assert fuzz.run(SLIDING) == ("in contact", "")
    _, (state, _), _ = fuzz.solve(SLIDING, False)
    (element, at), = state._equations.forces.changing
    found = element.look(state.u[at].reshape(-1, 2), 1.0, element.history)
    assert 0 < np.sum(found[5]) < 0.2 * len(found[5])
    faces = fuzz.faces_of(state)
    fuzz.check_cone(found, faces, 0.3)
    for friction, words in ((0.297, "cone"), (0.303, "not at its limit")):
        with pytest.raises(fuzz.Wrong, match=words):
            fuzz.check_cone(found, faces, friction)


def test_points_that_yield_are_checked():
    """On their way back: what is not on the yield surface is seen, and hardening that is wrong."""
    for beam, plane, y in (("ElementBeamCable(3)", "stress", 1e4), (
            "ElementBeamANCF(2)", "stress", 1e4), ("ElementBeamANCF(2)", "strain", 8e3)):
        script = PLAIN.replace("ELEMENTS[\"ancf-2\"](), StVenantKirchhoff(1e6, 0.3, 1.0)", (
            f"{beam}, ElasticPlastic(1e6, 0.3, {y}, 1e4, 1e5, plane={plane!r})"))
        script = script.format(formulation="assumed")
        script = script.replace("at=(1.0, 0.0)", "at=(1.0, 0.0),\n    amplitude=lambda t: "
                                "0.6 * np.interp(t, [0, 1, 2], [0, 1, -1])")
        script = script.replace("{}", "{'increments': 4}")
        assert fuzz.run(script) == ("stable", "")
        scene, (state, before), _ = fuzz.solve(script, False)
        past = fuzz.past_of(state, 0)
        assert np.any(past[6] > fuzz.past_of(before, 0)[6]) and np.any(past[6] == 0.0)
        n = past[0].size
        for k, factor in ((0, 1.01), (3, 0.99), (6, 1.01)):
            memory = state.memory.copy()
            memory[k * n:(k + 1) * n] *= factor
            with pytest.raises(fuzz.Wrong):
                fuzz.check(scene, state.replace(memory=memory), before)


def test_an_obstacle_that_a_beam_is_pressed_on_is_checked():
    script = fuzz.draw_pressed(fuzz.Dice(6))
    assert "friction=0.5" in script and fuzz.run(script) == ("in contact", "")
    scene, (state, before), _ = fuzz.solve(script, False)
    assert len(state.contact()) > 0
    with pytest.raises(fuzz.Wrong):
        fuzz.check(scene, state.replace(u=state.u * (1 + 1e-3)), before)


@pytest.mark.parametrize("load, verdict", [("(-0.14, 0.0)", "stable"), ("(-0.2, 0.0)", "unstable")])
def test_the_dense_tangent_is_the_derivative_and_knows_euler(load, verdict):
    """Against the package's tangent at any displacement; P_cr = pi^2 E I / (4 L^2) = 0.164."""
    mesh = "mesh0 = MeshBeam.init_line(np.linspace(0, 1.0, 9), 0.02)\n"
    script = mesh + PLAIN.split("\n", 1)[1].format(formulation="assumed").replace(
        "(0.0, -1.0)", load)
    scene, _ = fuzz.build(script, False)
    system, state, bodies = scene.system, scene.solve_linear(), [fuzz.Body(scene.beams[0])]
    K = fuzz.tangent(bodies, state)
    assert fuzz.verdict_of(system, state, K, 1.0 / np.abs(np.diag(K)))[0] == verdict
    state = state.replace(u=0.05 * np.random.default_rng(0).standard_normal(system.N))
    system.assemble(state.u)
    expected = system.K.tocsc().toarray()
    np.testing.assert_allclose(fuzz.tangent(bodies, state), expected, rtol=0,
                               atol=1e-11 * np.abs(expected).max())
