"""Utilisation of the strength: a field, its largest values and where, findings."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElasticPlastic, ElementBeamANCF, ElementBeamCable, Frame, InputError,
                        MeshBeam, NeoHookean, Prony, Scene, Section, StVenantKirchhoff)

L, H, B, P = 1.0, 0.05, 0.03, 500.0
#: Bending stress at the clamp.
SIGMA = 6 * P * L / (B * H**2)
STEEL = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850, strength=235e6)


def cantilever(element, material=STEEL, name=None, **sizes):
    mesh = MeshBeam.init_line(np.linspace(0, L, 17), height=H)
    beam = Beam(mesh, element, material, name=name, **(sizes or {"width": B}))
    return Scene(beam).clamp("left", thickness="free").point_force((0, -P), at=(L, 0))


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)], ids=repr)
@pytest.mark.parametrize("solve", ["solve_static", "solve_linear"])
def test_the_utilisation_of_a_cantilever(element, solve):
    """6 P L / (b h^2) over the strength, at the clamped end of a face, and falling along it."""
    scene = cantilever(element)
    state = getattr(scene, solve)()
    worst = state.extremes(count=100)
    assert worst[0].value == pytest.approx(SIGMA / 235e6, rel=0.005)
    assert worst[0].point == pytest.approx([0.0, np.sign(worst[0].point[1]) * H / 2], abs=1e-9)
    values = np.array([one.value for one in worst])
    assert np.all(np.diff(values) <= 0)
    x = np.array([one.point for one in worst])
    apart = np.hypot(*(x[:, None] - x).transpose(2, 0, 1)) + 9.0 * np.eye(len(x))
    assert apart.min() >= 2 * H * (1 - 1e-12)
    assert values[1] == pytest.approx(SIGMA / 235e6 * (1 - x[1, 0]), rel=0.01)
    assert state.field("utilisation", (0.5, H / 2)) == pytest.approx(SIGMA / 235e6 / 2, rel=0.01)
    assert f"largest utilisation {worst[0].value:.4g} at (0, " in str(state)
    assert state.checks.findings == () and state.checks.utilisation.beam == 0


def test_a_finding_where_the_strength_is_exceeded():
    state = cantilever(ElementBeamCable(5), STEEL.replace(strength=20e6), "arm").solve_static()
    finding, = state.checks.findings
    assert "2 times the strength" in finding and "beam 'arm'" in finding
    assert "beyond its range: the stress" in str(state)


def test_tension_and_compression_have_strengths_of_their_own():
    """Principal stresses, for brittle materials: a beam fails on the side of the weaker one."""
    for strength, side, part in (((30e6, 300e6), 1, 30e6), ((300e6, 10e6), -1, 10e6)):
        state = cantilever(ElementBeamCable(5), STEEL.replace(strength=strength)).solve_static()
        worst = state.extremes(count=1)[0]
        assert worst.value == pytest.approx(SIGMA / part, rel=0.005)
        assert worst.point[1] == pytest.approx(side * H / 2, abs=1e-9)


def test_layers_have_their_own_strength():
    """Of a sandwich only the faces are asked, and a layer without strength has no value."""
    core, skin = StVenantKirchhoff(1e9, 0.3), StVenantKirchhoff(7e10, 0.3, strength=1e8)
    layers = Section.layers((0.005, skin), (0.04, core), (0.005, skin), width=B)
    state = cantilever(ElementBeamANCF(3), None, section=layers).solve_static()
    EI = B / 12 * (7e10 * H**3 + (1e9 - 7e10) * 0.04**3)
    middle = (0.5, H / 2)
    assert state.field("utilisation", middle) == pytest.approx(
        7e10 * P * 0.5 * H / 2 / EI / 1e8, rel=0.01)
    assert np.isnan(state.field("utilisation", (0.5, 0.0)))


def test_extremes_of_other_fields_and_of_groups():
    frame = Frame.from_lines([(0, 0), (0, 4), (10, 4), (10, 0)], [(0, 1), (1, 2), (3, 2)],
                             groups={"columns": [0, 2], "girder": [1]}, material=STEEL, height=0.3,
                             width=0.2)
    state = frame.clamp([0, 3]).line_load((0, -1e4), beam="girder").solve_linear()
    sag = state.extremes("displacement", 1)[0]
    assert sag.beam == "girder" and sag.point[0] == pytest.approx(5.0, abs=0.1)
    assert sag.value == pytest.approx(-state.displacement((5, 4), line=1)[1], rel=1e-3)
    assert {one.beam for one in state.extremes("S_xx", 5, beam="columns")} == {"columns"}
    largest = state.extremes("S_xx", 1)[0]
    M = state.resultants(beam="girder", line=1)
    assert abs(largest.value) > np.max(np.abs(M.M)) * 6 / (0.2 * 0.3**2)


def test_strength_of_materials():
    for law in (NeoHookean(1e6, 0.3, strength=2e6), ElasticPlastic(2e11, 0.3, 2e8, strength=2e8),
                Prony(STEEL, [0.5], [1.0])):
        assert law.strength in (2e6, 2e8, 235e6)
    assert STEEL.replace(E=1.0).strength == 235e6 and STEEL.replace(strength=None).strength is None
    assert STEEL.replace(strength=[1, 2]).strength == (1.0, 2.0)
    for wrong in (0.0, -1.0, (1.0, -2.0), (1.0, 2.0, 3.0), "high"):
        with pytest.raises(InputError, match="strength"):
            StVenantKirchhoff(1e9, 0.3, strength=wrong)
    state = cantilever(ElementBeamCable(5), STEEL.replace(strength=None)).solve_static()
    assert "utilisation" not in str(state)
    for ask in (state.extremes, lambda: state.plot("utilisation")):
        with pytest.raises(InputError, match="give a material its strength"):
            ask()
