"""Springs and dashpots by functions of the caller's: against linear ones, SciPy and energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.actions.forces.laws import Law

E, B, H, G = 2e8, 0.01, 0.01, 9.81
MESH = MeshBeam.init_line(np.linspace(0, 1, 9), height=H)


def beam_of(element=None, modulus=E, density=7800.0):
    return Beam(MESH, element or ElementBeamANCF(2), StVenantKirchhoff(modulus, 0.3, density), B)


def hardening(s):
    return 20.0 * s + 500.0 * s**3


def hardening_potential(s):
    return 10.0 * s**2 + 125.0 * s**4


def drag(w):
    return 0.5 * w * abs(w)


def wound(a):
    return 0.4 * a + 0.3 * a**3


LAWS = [hardening, (hardening, hardening_potential)]
ELEMENTS = {"sections": ElementBeamANCF(2), "cable": ElementBeamCable(3)}


def test_a_rigid_bar_on_a_hardening_spring_at_rest():
    """A stiff bar hangs from a pin and a spring at its tip: moments about the pin."""
    scene = Scene(beam_of(modulus=2e13)).pin("left").gravity((0, -G))
    scene.spring(hardening, between=((1, 0), (1, 0.5)))
    state = scene.solve_static()
    weight = 7800 * B * H * G

    def moment(angle):
        tip, end = np.array([np.cos(angle), np.sin(angle)]), np.array([1.0, 0.5])
        d = end - tip
        force = hardening(np.hypot(*d) - 0.5) * d / np.hypot(*d)
        return tip[0] * force[1] - tip[1] * force[0] - 0.5 * weight * np.cos(angle)

    angle = brentq(moment, -1.0, 0.2, xtol=1e-14)
    tip = [np.cos(angle), np.sin(angle)]
    assert_allclose(state.position((1, 0)), tip, atol=1e-6)


@pytest.mark.parametrize("law", LAWS, ids=["force", "both"])
def test_a_rigid_pendulum_with_a_hardening_torsional_spring(law):
    """Against SciPy: J phi'' = -M(phi) - c phi' |phi'| - m g / 2 cos(phi)."""
    scene = Scene(beam_of(modulus=2e13)).pin("left").gravity((0, -G))
    scene.torsional_spring(law, at="left", damping=drag)
    history = scene.integrate(0.3, 1e-3, scheme="generalized-alpha")
    m = 7800 * B * H
    J = m / 3.0 + m * H**2 / 12.0

    def rate(t, y):
        return [y[1], (-hardening(y[0]) - drag(y[1]) - 0.5 * m * G * np.cos(y[0])) / J]

    exact = solve_ivp(rate, (0, 0.3), [0.0, 0.0], rtol=1e-10, atol=1e-12, t_eval=[0.1, 0.2, 0.3])
    tip = history.position((1, 0))[[100, 200, 300]]
    assert_allclose(np.arctan2(tip[:, 1], tip[:, 0]), exact.y[0], atol=2e-3 * np.ptp(exact.y[0]))


@pytest.mark.parametrize("law", LAWS, ids=["force", "both"])
@pytest.mark.parametrize("element", list(ELEMENTS))
def test_energy_is_kept(element, law):
    scene = Scene(beam_of(ELEMENTS[element])).pin("left").gravity((0, -G))
    scene.spring(law, between=((1, 0), (1, 0.5)), damping=drag).torsional_spring(wound, at="left")
    history = scene.integrate(0.2, 2e-3)
    assert history.dissipated[-1] > 1e-4
    total = history.total_energy + history.dissipated
    assert np.ptp(total) < 1e-9 * np.ptp(history.kinetic_energy)


def test_a_spring_that_only_pulls():
    """A rope: no force while it is slack; its potential by integration over the kink."""
    law = Law("k", lambda s: 30.0 * max(s, 0.0))
    assert law.potential(-0.5) == 0.0
    assert_allclose(law.potential(0.2), 15.0 * 0.04, rtol=1e-9)
    scene = Scene(beam_of()).clamp("left").gravity((0, -G))
    slack = scene.spring(lambda s: 30.0 * max(s, 0.0), ((1, 0), (1, -3.0))).solve_static()
    free = Scene(beam_of()).clamp("left").gravity((0, -G)).solve_static()
    assert_allclose(slack.u, free.u, atol=1e-9)


@pytest.mark.parametrize("add, message", [
    (lambda s: s.spring("soft", ((1, 0), (1, 1))), "k"),
    (lambda s: s.spring((), ((1, 0), (1, 1))), "a function and its potential"),
    (lambda s: s.spring((np.sin, 3.0), ((1, 0), (1, 1))), "potential of k must be a function"),
    (lambda s: s.spring(lambda s: "much", ((1, 0), (1, 1))), r"k\(elongation"),
    (lambda s: s.spring(lambda s: 1 / 0, ((1, 0), (1, 1))), "ZeroDivisionError"),
    (lambda s: s.spring((lambda s: s, lambda s: s * s), ((1, 0), (1, 1))), "is not the derivative"),
    (lambda s: s.spring(1.0, ((1, 0), (1, 1)), damping=np.cos), "must be 0 where that is 0"),
    (lambda s: s.torsional_spring(lambda a: np.nan, "left"), r"k\(angle"),
    (lambda s: s.torsional_spring(1.0, "left", damping=lambda w: None), "damping")])
def test_bad_laws(add, message):
    with pytest.raises(InputError, match=message):
        add(Scene(beam_of()))
