"""Load cases, combinations with factors, envelopes: against closed forms and scenes by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, Frame, InputError, LoadCases, MeshBeam, NameUnknown,
                        NeoHookean, Scene, StVenantKirchhoff, SupportError)

STEEL = StVenantKirchhoff.named("S235")
Q, P, L = 1e4, 3e4, 6.0


def girder():
    frame = Frame.from_lines([(0, 0), (L, 0)], [(0, 1)], material=STEEL, height=0.3, width=0.1)
    return frame.pin(0).hold(1, "y")


CASES = {"dead": lambda scene: scene.line_load((0, -Q)),
         "crane": lambda scene: scene.point_force((0, -P), at=(0.25 * L, 0)),
         "up": lambda scene: scene.point_force((0, P), at=(0.5 * L, 0))}
COMBINATIONS = {"dead": {"dead": 1.35}, "crane": {"dead": 1.35, "crane": 1.5},
                "wind": {"dead": 1.0, "up": 1.5}}


def test_envelopes_of_section_forces_are_those_of_the_worst_combination():
    """M of a girder in closed form at each section, and of which combination it is."""
    cases = LoadCases(girder(), CASES, COMBINATIONS)
    found = cases.envelope()
    x, a = found.x[0], 0.25 * L

    def M(dead, crane, up):
        uniform = 0.5 * dead * Q * x * (L - x)
        point = crane * P * np.where(x < a, 0.75 * x, 0.25 * (L - x))
        return uniform + point - up * P * 0.5 * np.minimum(x, L - x)

    every = np.array([M(1.35, 0, 0), M(1.35, 1.5, 0), M(1.0, 0, 1.5)])
    assert_allclose(found.greatest["M"], every.max(axis=0), atol=2.0)
    assert_allclose(found.least["M"], every.min(axis=0), atol=2.0)
    names = np.array(list(COMBINATIONS))
    clear = np.sort(every, axis=0)[-1] - np.sort(every, axis=0)[-2] > 100.0
    assert np.all(found.by["M"][1][clear] == names[every.argmax(axis=0)][clear])
    # both sides of the crane, where Q jumps
    beside = np.abs(x - a) < 1e-6
    Q0 = 1.35 * Q * (0.5 * L - a)
    assert_allclose(sorted(-found.least["Q"][beside]), [Q0, Q0 + 0.75 * 1.5 * P], rtol=1e-4)


def test_reactions_and_the_table():
    cases = LoadCases(girder(), CASES, COMBINATIONS)
    left = cases.reactions()["node 0 at (0, 0)"]
    dead = 0.5 * Q * L
    assert left["crane"][1] == pytest.approx(1.35 * dead + 1.5 * 0.75 * P)
    assert left["least"][1] == pytest.approx(dead - 1.5 * 0.5 * P)
    assert left["greatest"][1] == pytest.approx(1.35 * dead + 1.5 * 0.75 * P)
    *rows, last = cases.table()
    assert [row["combination"] for row in rows] == list(COMBINATIONS) == list(cases)
    assert rows[0]["greatest M"] == pytest.approx(1.35 * Q * L**2 / 8, rel=1e-6)
    assert rows[0]["utilisation"] == pytest.approx(
        1.35 * Q * L**2 / 8 * 6 / (0.1 * 0.3**2) / 235e6, rel=5e-3)
    assert last["greatest M"] == max(row["greatest M"] for row in rows)
    assert last["least Q"] == min(row["least Q"] for row in rows)
    lines = str(cases).splitlines()
    assert len(lines) == 5 and len(set(map(len, lines))) == 1
    assert lines[0].split()[:3] == ["combination", "displacement", "utilisation"]


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("law", [StVenantKirchhoff, NeoHookean])
def test_factors_are_those_of_scenes_by_hand(linear, law):
    """Dead, following, and thermal loads and moments, in linear and large displacements."""
    material = law(2e8, 0.3, 7800.0, thermal_expansion=1e-4)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.02), ElementBeamANCF(2), material, 0.02)

    def fill(scene, a, b, c, d):
        scene.point_force((0, -a), at=(1, 0)).pressure("top", b)
        return scene.moment("right", c).temperature(d)

    cases = LoadCases(Scene(beam).clamp("left"), {
        "force": lambda s: s.point_force((0, -0.4), at=(1, 0)),
        "others": lambda s: s.pressure("top", 10.0).moment("right", 0.1),
        "warm": lambda s: s.temperature(20.0)}, linear=linear, combinations={
        "all": {"force": 1.5, "others": -2.0, "warm": 0.5, }, "one": {"force": 1.0}})
    state = cases["all"]
    hand = fill(Scene(beam).clamp("left"), 0.6, -20.0, -0.2, 10.0)
    right = hand.solve_linear() if linear else hand.solve_static()
    assert_allclose(state.displacement((1, 0)), right.displacement((1, 0)), rtol=1e-6, atol=1e-9)
    assert_allclose(state.stress((0.4, 0.01)), right.stress((0.4, 0.01)), rtol=1e-4, atol=1.0)
    assert_allclose(state.reactions("left").force, right.reactions("left").force, rtol=1e-5,
                    atol=1e-7)
    assert_allclose(state.resultants((0.4, 0)).M, right.resultants((0.4, 0)).M, rtol=1e-5)
    motion = cases.factored("one").integrate(0.01, 0.001)
    other = Scene(beam).clamp("left").point_force((0, -0.4), at=(1, 0)).integrate(0.01, 0.001)
    assert_allclose(motion.u[-1], other.u[-1], atol=1e-12)


def test_the_stress_under_a_temperature_that_grows_over_time_in_a_neo_hookean_beam():
    """A free end has no stress, and a held one E alpha dT, at half of the time too."""
    material = NeoHookean(2e8, 0.0, 7800.0, thermal_expansion=1e-5)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.1), ElementBeamANCF(2), material, 0.1)
    for held, stress in ((False, 0.0), (True, -2e8 * 1e-5 * 10)):
        scene = Scene(beam).clamp("left").temperature(20.0, amplitude=lambda t: t)
        if held:
            scene.clamp("right", thickness="free")
        half = scene.run([0.5], 2).state(-1)
        assert half.stress((0.4, 0.02))[0] == pytest.approx(stress, abs=15.0)


def test_the_scene_is_not_changed_and_large_displacements_do_not_superpose():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), ElementBeamANCF(2), STEEL, 0.01)
    scene = Scene(beam).clamp("left").point_force((0, -1.0), at=(1, 0))
    cases = LoadCases(scene, {"more": lambda s: s.point_force((0, -999.0), at=(1, 0))},
                      linear=False)
    assert len(scene.loads) == 1 and list(cases) == ["more"]
    hand = Scene(beam).clamp("left").point_force((0, -1000.0), at=(1, 0)).solve_static()
    assert_allclose(cases["more"].displacement((1, 0)), hand.displacement((1, 0)), rtol=1e-8)
    assert cases["more"] is cases["more"]


def test_wrong_cases_teach():
    scene = girder()
    for cases, match in (({"a": 3.0}, "must be a function"), ({"a": lambda s: s}, "and adds none"),
                         ({"a": lambda s: s.spring(1.0, ((3, 0), (3, -1)))}, "loads, and adds"),
                         ({}, "no load case")):
        with pytest.raises(InputError, match=match):
            LoadCases(scene, cases)
    with pytest.raises(NameUnknown, match="'dead'"):
        LoadCases(scene, CASES, {"all": {"dad": 1.0}})
    with pytest.raises(InputError, match="must have factors"):
        LoadCases(scene, CASES, {"all": 1.35})
    with pytest.raises(NameUnknown, match="combination"):
        LoadCases(scene, CASES)["all"]
    loose = Frame.from_lines([(0, 0), (L, 0)], [(0, 1)], material=STEEL, height=0.3, width=0.1)
    with pytest.raises(SupportError, match="combination 'dead': "):
        LoadCases(loose.pin(0), CASES)["dead"]


def test_an_envelope_is_printed_by_its_extremes():
    """q L^2 / 8 = 2 and 1.5 F L / 4 = 3 in the middle of a girder; units are those of the scene."""
    girder = Frame.from_lines([(0, 0), (4, 0)], [(0, 1)], height=0.2, width=0.1,
                              material=StVenantKirchhoff(2e8, 0.3))
    cases = LoadCases(girder.pin(0).hold(1, "y").units("kN", "m"), {
        "q": lambda scene: scene.line_load((0, -1.0)),
        "F": lambda scene: scene.point_force((0, -2.0), at=(2, 0))},
        {"q": {"q": 1.0}, "1.5 F": {"F": 1.5}})
    lines = str(cases.envelope()).splitlines()
    assert len(lines) == 6
    assert next(line for line in lines if line.startswith("greatest M 3 at s = 2 by '1.5 F'"))
    assert next(line for line in lines if line.startswith("greatest Q")).endswith(" by 'q'")
    assert next(line for line in lines if line.startswith("least Q")).endswith("at s = 0 by 'q'")
    assert str(cases).splitlines()[-1] == "in kN, m"
