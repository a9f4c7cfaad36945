"""Contact of beams, rigid bodies and domains with each other."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, BodyContact, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        InputError, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.actions.forces.base import bind_force, recalled
from skfem_ancf.beam.layout import Layout

ELEMENTS = (ElementBeamANCF(2), ElementBeamANCFCubic(1), ElementBeamCable(3), ElementBeamCable(5))
STEEL = StVenantKirchhoff(2e11, 0.0, 7800.0)
RUBBER = StVenantKirchhoff(1e7, 0.0, 1000.0)


def line(length, n, height, origin=(0.0, 0.0), element=ELEMENTS[2], material=STEEL, angle=0.0,
         width=0.02):
    mesh = MeshBeam.init_line(np.linspace(0.0, length, n + 1), height=height, origin=origin,
                              angle=angle)
    return Beam(mesh, element, material, width=width)


def strips(element, friction=0.0):
    """The contact of two strips bound to them, and positions at which they touch."""
    beams = [line(0.5, 3, 0.01, (0.0, y), element) for y in (0.0, -0.0102)]
    layout = Layout(*beams)
    u = 3e-4 * layout.sizes * np.cos(np.arange(layout.N))
    u[1:beams[0].N:beams[0].nd] -= 6e-4
    contact = recalled(bind_force(BodyContact(friction=friction), layout))
    if friction:
        x = u.reshape(-1, 2)
        contact.accept(x, x, 0.0 * x, 0.0)
        u[0:beams[0].N:beams[0].nd] += 2e-6
    d = layout.sizes * np.random.default_rng(0).standard_normal(layout.N)
    return contact, beams, u.reshape(-1, 2), d.reshape(-1, 2)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_force_stiffness_and_potential_agree(element, friction):
    contact, _, x, d = strips(element, friction)
    s = 1e-7
    change = (contact.force(x + s * d, 0 * x, 0.0) - contact.force(x - s * d, 0 * x, 0.0)) / (2 * s)
    slope = (contact.stiffness(x, 0 * x, 0.0) @ d.ravel()).reshape(x.shape)
    size = np.abs(change).max()
    assert_allclose(slope, change, rtol=0, atol=(1e-4 if friction else 1e-9) * size)
    if not friction:
        work = np.sum(contact.force(x, 0 * x, 0.0) * d)
        gain = contact.potential_at(x + s * d, 0.0) - contact.potential_at(x - s * d, 0.0)
        assert gain / (2 * s) == pytest.approx(-work, rel=1e-8)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("element", ELEMENTS, ids=repr)
def test_a_mean_force_has_no_resultant_and_exact_work(element, friction):
    contact, beams, x, d = strips(element, friction)
    y = x + 1e-5 * d
    force = contact.mean_force(x, y, 0.0, 1.0)
    middle = np.concatenate([b.q0 for b in beams]).reshape(-1, 2) + 0.5 * (x + y)
    moments = middle[:, 0] * force[:, 1] - middle[:, 1] * force[:, 0]
    assert abs(moments.sum()) < 1e-12 * np.abs(moments).sum()
    places = force.reshape(-1, beams[0].nd // 2, 2)[:, 0]
    assert_allclose(places.sum(axis=0), 0.0, atol=1e-12 * np.abs(places).sum())
    gain = contact.potential_at(y, 0.0) - contact.potential_at(x, 0.0)
    lost = contact.accept(x, y, 0.0 * y, 0.0)
    assert np.sum(force * (y - x)) == pytest.approx(-gain - lost, rel=1e-9)
    assert lost > 1e-3 * abs(gain) if friction else abs(lost) < 1e-9 * abs(gain)


def test_a_cantilever_on_a_shorter_one():
    """They touch at the end of the shorter one: Euler-Bernoulli in closed form."""
    E, b, h, L, a, F = 2e11, 0.02, 0.01, 1.0, 0.6, 5.0
    scene = Scene(line(L, 10, h), line(a, 6, h, (0.0, -h))).clamp("left", 0).clamp("left", 1)
    scene.contact(0, 1).point_force((0.0, -F), at=(L, 0.0), beam=0)
    state = scene.solve_static()
    EI, push = E * b * h**3 / 12, F * (3 * L / a - 1) / 4
    tip = (F * L**3 - push * a * a * (3 * L - a) / 2) / (3 * EI)
    assert state.displacement("right", 0)[1] == pytest.approx(-tip, rel=2e-3)
    for on, sign in ((0, 1.0), (1, -1.0)):
        found = state.contact(on=on)
        assert found.total[1] == pytest.approx(sign * push, rel=5e-3)
        where = found.force[1] @ found.points[0] / found.total[1]
        assert where == pytest.approx(a, rel=1e-3) and found.penetration < 0.01 * h
    assert_allclose(state.contact().total, 0.0, atol=1e-9 * push)
    assert str(state.verdict) == "stable" and np.all(scene.modes(2, state).frequencies > 0)


@pytest.mark.parametrize("element", [*ELEMENTS[1:], ElementBeamANCF(3)], ids=repr)
@pytest.mark.parametrize("n", [2, 3])
def test_leaves_without_friction_are_so_many_springs(n, element):
    h, L = 0.01, 0.5
    scene = Scene(*(line(L, 8, h, (0.0, -k * h), element) for k in range(n))).contact("all")
    for k in range(n):
        scene.clamp("left", k)
    stiffness = n * 3 * 2e11 * 0.02 * h**3 / 12 / L**3
    scene.point_force((0.0, -2e-3 * stiffness), at=(L, 0.0), beam=0)
    state = scene.solve_static()
    assert state.displacement("right", 0)[1] == pytest.approx(-2e-3, rel=5e-3)
    assert state.contact().penetration < 0.01 * h


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=repr)
def test_an_impact_keeps_energy_and_momenta(element, friction):
    beams = [line(1.0, 4, 0.05, (0.0, 0.0), element, RUBBER),
             line(1.0, 4, 0.05, (0.4, 0.06), element, RUBBER, angle=0.1)]
    scene = Scene(*beams).contact("all", friction=friction)
    scene.initial_velocity((0.0, -2.0), 1)
    history = scene.integrate(0.02, 4e-4)
    energy = history.total_energy + history.dissipated
    assert np.ptp(energy) < 1e-11 * energy[0]
    for momentum in (history.momentum, history.angular_momentum):
        assert np.ptp(momentum, axis=0).max() < 1e-11 * np.abs(momentum).max()
    assert np.abs(history.u[-1][:beams[0].N]).max() > 1e-3  # they have touched
    assert (history.dissipated[-1] > 1e-4 * energy[0]) == (friction > 0.0)


def test_rods_that_collide_lengthwise_part_after_two_passages():
    """St. Venant (1867): equal rods exchange their velocities in the time 2 L / c."""
    c, L, v, gap = 100.0, 1.0, -1.0, 2e-4
    beams = [line(L, 16, 0.05, (x, 0.0), ElementBeamANCF(2), RUBBER) for x in (0.0, L + gap)]
    scene = Scene(*beams).contact("all")
    scene.initial_velocity((v, 0.0), 1)
    t = np.linspace(0.0, 0.03, 61)
    history = scene.integrate(0.03, 2.5e-4, t_eval=t)
    mass = 0.5 * history.momentum[0, 0] / v
    momenta = []
    for k in range(len(t)):
        state, s = history.state(k), scene.system.slices[0]
        momenta.append(scene.system.mass.multiply(np.where(
            np.arange(scene.N) < s.stop, state.v, 0.0))[0:s.stop:beams[0].nd].sum())
    share = np.array(momenta) / history.momentum[0, 0]
    begin, end = (np.interp(level, share, t) for level in (0.1, 0.9))
    assert mass > 0.0 and share[-1] == pytest.approx(1.0, abs=0.03)
    assert end - begin == pytest.approx(0.8 * 2 * L / c, rel=0.03)
    assert np.ptp(history.total_energy) < 1e-10 * history.total_energy[0]
    assert_allclose(history.momentum[:, 0], history.momentum[0, 0], rtol=1e-11)


def test_what_does_not_fit_is_said():
    scene = Scene(line(1.0, 4, 0.01), line(1.0, 4, 0.01, (0.0, -0.007)))
    with pytest.raises(InputError, match="overlap by"):
        scene.contact("all")
    with pytest.raises(InputError, match="self_contact=True"):
        Scene(line(1.0, 4, 0.01)).contact()
    with pytest.raises(InputError, match="no contact"):
        scene.state().contact()
    apart = Scene(line(1.0, 4, 0.01), line(1.0, 4, 0.01, (0.0, -0.1))).clamp("left", 0)
    with pytest.raises(InputError, match="use 'energy-momentum'"):
        apart.clamp("left", 1).contact("all").integrate(1e-3, 1e-3, scheme="radau")
