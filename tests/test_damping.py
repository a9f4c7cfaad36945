"""Damping: what it takes, where it leads, and that nothing is lost besides."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        KelvinVoigt, MeshBeam, NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.dynamics import SCHEMES
from skfem_ancf.dynamics.history import momentum
from skfem_ancf.materials import Material


class Fibres(Material):
    """A law of one's own: Hooke's without coupling, stiffening."""

    def energy(self, strain):
        W = 0.5 * self.E * np.sum(strain**2, axis=0)
        return W + W**2 / self.E

    def stress(self, strain):
        W = 0.5 * self.E * np.sum(strain**2, axis=0)
        return self.E * strain * (1.0 + 2.0 * W / self.E)


STEEL = StVenantKirchhoff(2e8, 0.3, 7800.0)
BODIES = {
    "sections": lambda: (ElementBeamANCF(2), STEEL),
    "cubic": lambda: (ElementBeamANCFCubic(2), STEEL),
    "cable": lambda: (ElementBeamCable(5), STEEL),
    "stabilised cable": lambda: (ElementBeamCable(), STEEL),
    "neo-hookean": lambda: (ElementBeamANCF(2), NeoHookean(2e8, 0.3, 7800.0)),
    "own law": lambda: (ElementBeamANCF(2), Fibres(2e8, 0.3, 7800.0)),
}


def beam_of(body="sections", time=2e-3, ne=4, h=0.01, **options):
    element, material = BODIES[body]()
    return Beam(MeshBeam.init_line(np.linspace(0, 1, ne + 1), h), element, material, h,
                damping=KelvinVoigt(time), **options)


# the force


def test_rates_of_a_fibre_by_hand():
    """A bar pulled at a rate: the power is time E (d eps / dt)^2 of its volume."""
    E, time, A, L, stretch, rate = 5.0, 0.3, 0.04, 2.0, 1.4, 0.7
    beam = Beam(MeshBeam.init_line([0, L], 0.2), ElementBeamANCF(1), StVenantKirchhoff(E, 0.0), 0.2,
                damping=KelvinVoigt(time))
    u, v = np.zeros((2, 2, 3, 2))  # node; r, r_X, r_Y; component
    u[1, 0, 0], u[:, 1, 0] = (stretch - 1) * L, stretch - 1
    v[1, 0, 0], v[:, 1, 0] = rate * L, rate
    d = Scene(beam).system.damping_force(u.ravel(), v.ravel())
    power = E * time * (stretch * rate) ** 2 * A * L  # eps = (stretch^2 - 1) / 2
    assert_allclose(d @ v.ravel(), power, rtol=1e-13)


# energy


def hinged(body, damping):
    """Two beams, one of them damped, that swing on a hinge."""
    element, material = BODIES[body]()
    first = Beam(MeshBeam.init_line(np.linspace(0, 0.5, 3), 0.01), element, material, 0.01,
                 damping=KelvinVoigt(damping))
    second = Beam(MeshBeam.init_line(np.linspace(0.5, 1, 3), 0.01), element, material, 0.01)
    scene = Scene(first, second).pin("left", beam=0).gravity((0, -9.81))
    scene.joint("hinge", beams=(0, 1), at=(0.5, 0))
    return scene


@pytest.mark.parametrize("extra", [dict(), dict(mass=3.0), dict(stiffness=1e-3),
                                   dict(modal=[0.1, 0.05])], ids=str)
def test_balance_with_joints_and_all_kinds_at_once(extra):
    scene = hinged("sections", 1e-3).damping(**extra)
    history = scene.integrate(0.1, 2e-3)
    assert history.dissipated[-1] > 0.0
    assert np.ptp(history.total_energy + history.dissipated) < 2e-12 * history.kinetic_energy.max()
    # the others: to their order
    for scheme in (name for name, cls in SCHEMES.items()
                   if cls.joined and name != "energy-momentum-4"):
        gaps = []
        for dt in (2e-3, 1e-3):
            history = scene.integrate(0.05, dt, scheme=scheme)
            gaps.append(np.ptp(history.total_energy + history.dissipated))
        assert gaps[1] < 0.35 * gaps[0] or gaps[1] < 1e-10


# theory


def decay(scene, k, omega, periods=3, parts=168):
    """Damping ratio of mode k: the coefficients of q_{n+1} = a q_n + b q_{n-1}.

    The scheme's is smaller by (omega dt)^2 / 4.
    """
    modes = scene.modes(k + 1)
    shape, dt = modes.shapes[k], 2 * np.pi / omega / parts
    scene.initial_velocity(1e-6 * omega * shape)
    u = scene.integrate(periods * parts * dt, dt).u
    q = (u @ scene.system.mass.multiply(shape))[::parts // 6]
    (_, b), *_ = np.linalg.lstsq(np.stack([q[1:-1], q[:-2]], axis=1), q[2:], rcond=None)
    return -0.5 * np.log(-b) / (omega * dt * (parts // 6))


ROOTS = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613])
EULER = ROOTS**2 * np.sqrt(2e8 * 0.01**2 / 12 / 7800)  # angular frequencies of the cantilever


@pytest.mark.parametrize("k", [0, 1, 2])
def test_logarithmic_decrement_of_a_material(k):
    """Kelvin-Voigt: zeta = time omega / 2 of the Euler-Bernoulli cantilever."""
    scene = Scene(beam_of("cable", 1e-4, ne=8)).clamp("left")
    assert decay(scene, k, EULER[k]) == pytest.approx(0.5e-4 * EULER[k], rel=1e-3)


@pytest.mark.parametrize("k", [0, 1, 2])
def test_logarithmic_decrement_of_rayleigh_and_modal_damping(k):
    plain = beam_of("cable", 0.0, ne=8)
    scene = Scene(plain).clamp("left").damping(mass=0.4, stiffness=1e-4)
    zeta = 0.2 / EULER[k] + 0.5e-4 * EULER[k]
    assert decay(scene, k, EULER[k]) == pytest.approx(zeta, rel=1e-3)
    scene = Scene(plain).clamp("left").damping(modal=[0.01, 0.04, 0.02])
    assert decay(scene, k, EULER[k]) == pytest.approx((0.01, 0.04, 0.02)[k], rel=2e-3)


@pytest.mark.parametrize("scheme, left", [("energy-momentum", 1e-6), ("generalized-alpha", 1e-10)])
def test_a_swinging_beam_comes_to_rest_at_its_static_solution(scheme, left):
    """What its steps do not resolve the energy-momentum scheme keeps, as the midpoint rule does."""
    scene = Scene(beam_of("sections", 0.02, ne=8)).clamp("left").gravity((0, -9.81))
    scene.damping(mass=5.0)
    static = scene.solve_static()
    history = scene.integrate(6.0, 0.02, scheme=scheme)
    assert history.kinetic_energy[-1] < left * history.kinetic_energy.max()
    assert_allclose(history.displacement((1, 0))[-1], static.displacement((1, 0)), rtol=1e-5)
    # reactions of an instant have the damping in them
    start = scene.integrate(0.02, 1e-3, scheme="generalized-alpha").state(10)
    total = start.reactions("left").force + [0, -9.81 * scene.beams[0].total_mass]
    balance = (momentum(scene.system, start.acceleration)
               + 5.0 * momentum(scene.system, start.v))
    assert_allclose(total, balance, rtol=0, atol=1e-8 * np.abs(total).max())


def test_damping_ratios_of_modes():
    scene = Scene(beam_of("cable", 1e-4, ne=8)).clamp("left").damping(mass=0.4, modal=[0, 0.03])
    modes = scene.modes(3)
    expected = 0.2 / modes.frequencies + 0.5e-4 * modes.frequencies + [0, 0.03, 0]
    assert_allclose(modes.damping_ratios, expected, rtol=1e-8)
    assert_allclose(modes.frequencies, EULER, rtol=1e-3)
    free = Scene(beam_of("cable", 0.0)).clamp("left")
    assert free.modes(2).damping_ratios.tolist() == [0.0, 0.0]
    dashpot = free.spring(0.0, ((1, 0), (1, 1)), damping=0.1).drag(10.0, 1.0).modes(1)
    assert_allclose(dashpot.damping_ratios[0], 0.1 * dashpot.shapes[0].reshape(-1, 6)[-1, 1]**2
                    / (2 * dashpot.frequencies[0]), rtol=1e-5)


# what there is besides


@pytest.mark.parametrize("make", [
    lambda: KelvinVoigt(-1e-4), lambda: KelvinVoigt("soft"), lambda: KelvinVoigt(np.nan),
    lambda: Scene(beam_of()).damping(mass=-1.0), lambda: Scene(beam_of()).damping(stiffness=-1.0),
    lambda: Scene(beam_of()).damping(modal=[0.1, -0.1]),
    lambda: Scene(beam_of()).damping(modal=0.1),
    lambda: beam_of().replace(damping=1e-4)])
def test_bad_values(make):
    with pytest.raises(InputError):
        make()
