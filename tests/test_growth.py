"""Stress-free strains of laws that are not linear: closed forms, tangents, energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, InputError, MeshBeam,
                        NeoHookean, Scene, Section)
from skfem_ancf.materials import Material
from skfem_ancf.materials.base import hooke

RUBBER = NeoHookean(E=1e6, nu=0.4, density=1000)


class Stiffening(Material):
    """Hooke's law whose energy W has 100 W^2 / E added."""

    def energy(self, strain):
        W = 0.5 * np.einsum("ij,i...,j...->...", hooke(self.E, self.nu, self.plane), strain, strain)
        return W + 100 * W**2 / self.E

    def stress(self, strain):
        S = np.tensordot(hooke(self.E, self.nu, self.plane), strain, 1)
        return S * (1 + 100 * np.sum(strain * S, axis=0) / self.E)


LAWS = [RUBBER, RUBBER.replace(plane="strain"), Stiffening(E=1e6, nu=0.3, density=1000)]
laws = pytest.mark.parametrize("law", LAWS, ids=["rubber", "plane strain", "own"])
ELEMENTS = [ElementBeamANCF(2), ElementBeamANCFCubic(2)]
elements = pytest.mark.parametrize("element", ELEMENTS, ids=["linear", "cubic"])


def bar(law, element, n=8, **section):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), height=0.05)
    return Beam(mesh, element, law, **(section or {"width": 0.02}))


@elements
@laws
def test_a_bar_between_walls_pulls_as_its_law_says(law, element):
    """E_xx = 0 and S_yy = 0: one equation for the elastic E_yy. E0 = -0.1 along it."""
    size = -0.1
    scene = Scene(bar(law, element)).fix("left", "r^2")
    for name in ("r^1", "r_Y0^1", "r_Y1^1"):
        scene.fix("left", name).fix("right", name)
    state = scene.eigenstrain(xx=size).solve_static()

    def across(y):
        return law.stress(np.array([-size, y, 0.0]))[1]

    y = brentq(across, -0.2, 0.2)
    exact = law.stress(np.array([-size, y, 0.0]))[0]
    assert state.recovered == {0: ""}
    for recover in (True, False):
        assert state.stress((0.5, 0.01), recover=recover)[0] == pytest.approx(exact, rel=1e-6)
    strain = state.strain((0.5, 0.01), recover=False)
    assert_allclose(strain, [0.0, y, 0.0], atol=1e-7)
    assert state.resultants((0.5, 0)).N == pytest.approx(exact * 0.05 * 0.02, rel=1e-6)


@elements
@laws
def test_a_free_body_grows_without_stress(law, element):
    state = Scene(bar(law, element)).clamp("left").eigenstrain(xx=0.22).solve_static()
    assert state.displacement((1, 0))[0] == pytest.approx(0.2, rel=1e-9)
    assert np.abs(state.stress((0.52, 0.01), recover=False)).max() < 1e-3


@elements
def test_a_bilayer_of_rubber_bends_as_timoshenkos_strip(element):
    soft = NeoHookean(E=5e5, nu=0.4)
    beam = bar(None, element, 16, section=Section.layers((0.02, RUBBER), (0.03, soft), width=0.02))
    size = 1e-3
    state = Scene(beam).clamp("left").eigenstrain(
        xx=lambda x, y: size * (y > -0.005)).solve_static()
    m, n = 0.02 / 0.03, 2.0
    kappa = -6 * size * (1 + m) ** 2 / (0.05 * (3 * (1 + m) ** 2
                                                + (1 + m * n) * (m**2 + 1 / (m * n))))
    assert state.displacement((1, 0))[1] == pytest.approx(kappa / 2, rel=5e-3)
    assert state.stability == "stable"


@elements
def test_a_motion_keeps_the_energy_and_follows_the_amplitude(element):
    scene = Scene(bar(RUBBER, element, 4)).clamp("left").eigenstrain(
        xx=lambda x, y: 0.05 * np.sign(y))
    history = scene.integrate(0.02, 1e-3)
    assert np.ptp(history.total_energy) < 1e-8 * history.kinetic_energy.max()
    # so slow that it is statics: the strain at t = 1 / 2 is half of it, and not half of two bodies
    slow = Scene(bar(RUBBER, element, 4)).clamp("left").eigenstrain(
        xx=lambda x, y, t: 0.3 * t * np.ones_like(x))
    half = Scene(bar(RUBBER, element, 4)).clamp("left").eigenstrain(xx=0.15).solve_static()
    load, = slow.system.loads
    factor, acting = load.factor_and_load(0.5)
    assert factor == 1.0
    internal = slow.system.internal_force(half.u)
    free = slow.system.constraints.free
    assert np.abs((acting.force(half.u) - internal)[free]).max() < 1e-6 * np.abs(internal).max()


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_rubber_expands_with_the_temperature(plane):
    """To E_xx = alpha T, (1 + nu) alpha T in plane strain, without stress in the plane."""
    law = RUBBER.replace(plane=plane, thermal_expansion=1e-3)
    state = Scene(bar(law, ElementBeamANCF(2))).clamp("left", thickness="free").temperature(
        20.0).solve_static()
    size = 0.02 * (1.0 if plane == "stress" else 1.4)
    assert state.displacement((1, 0))[0] == pytest.approx(np.sqrt(1 + 2 * size) - 1, rel=1e-9)
    assert np.abs(state.stress((0.52, 0.01), recover=False)).max() < 1e-3
    assert law.replace(E=2e6).thermal_expansion == 1e-3


def test_two_do_not_add_up_and_are_refused():
    scene = Scene(bar(RUBBER, ELEMENTS[0])).clamp("left").eigenstrain(xx=0.1)
    with pytest.raises(InputError, match="cannot be superposed"):
        scene.eigenstrain(xx=0.1)
