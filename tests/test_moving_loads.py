"""Loads whose place depends on time: against series, Euler-Bernoulli, and standing ones."""

import pickle

import numpy as np
import pytest
from scipy.linalg import eigh

from skfem_ancf import (Beam, CallbackError, ElementBeamANCF, ElementBeamCable, InputError,
                        MeshBeam, MeshError, Scene, Section, StVenantKirchhoff, Train)

CONCRETE = StVenantKirchhoff(E=3e10, nu=0.2, density=2500)
HEIGHT, WIDTH = 0.6, 0.4
EI, MASS = CONCRETE.E * WIDTH * HEIGHT**3 / 12, CONCRETE.density * WIDTH * HEIGHT


def girder(ends, degree=3):
    """Without rotary inertia, which the references do not have."""
    return Beam(MeshBeam.init_line(ends, HEIGHT), ElementBeamCable(degree), section=Section.numbers(
        EA=CONCRETE.E * WIDTH * HEIGHT, EI=EI, rhoA=MASS, rhoI=1e-9 * MASS))


def krylov(span, speed, t, P):
    """The sag of the middle under a force that crosses a simple beam (Krylov, 1905)."""
    n = np.arange(1, 60)[:, None]
    passing, own = n * np.pi * speed / span, (n * np.pi / span)**2 * np.sqrt(EI / MASS)
    swing = (np.sin(passing * t) - passing / own * np.sin(own * t)) / (own**2 - passing**2)
    return np.sum(2 * P / (MASS * span) * swing * np.sin(n * np.pi / 2), axis=0)


@pytest.mark.parametrize("scheme", ["generalized-alpha", "energy-momentum"])
def test_a_force_crosses_a_simple_beam_as_krylov_says(scheme):
    span, P = 20.0, 500.0
    speed = 0.45 * np.pi / span * np.sqrt(EI / MASS)
    scene = Scene(girder(np.linspace(0, span, 9))).pin("left").fix("right", "r^2")
    scene.point_force((0, -P), at=lambda t: (speed * t, 0.0))
    end = 0.999 * span / speed
    history = scene.integrate(end, end / 200, scheme)
    sag = krylov(span, speed, history.t, P)
    found = -history.displacement((span / 2, 0))[:, 1]
    assert np.allclose(found, sag, atol=1.5e-3 * sag.max())


def hermite(length):
    """Stiffness and mass of an Euler-Bernoulli element, over E I and the mass per length."""
    L = length
    K = np.array([[12, 6 * L, -12, 6 * L], [6 * L, 4 * L * L, -6 * L, 2 * L * L],
                  [-12, -6 * L, 12, -6 * L], [6 * L, 2 * L * L, -6 * L, 4 * L * L]]) / L**3
    M = np.array([[156, 22 * L, 54, -13 * L], [22 * L, 4 * L * L, 13 * L, -3 * L * L],
                  [54, 13 * L, 156, -22 * L], [-13 * L, -3 * L * L, -22 * L, 4 * L * L]]) * L / 420
    return K, M


def bridge(span, n, axles, t, number):
    """Deflections (nt,) of the middle of three spans under a train, Euler-Bernoulli, by modes.

    Of each mode Duhamel's integral, by the midpoint rule in twenty parts of each step of t.
    """
    ne, L = 3 * n, span / n
    K, M = np.zeros((2, 2 * ne + 2, 2 * ne + 2))
    k, m = hermite(L)
    for e in range(ne):
        K[2 * e:2 * e + 4, 2 * e:2 * e + 4] += EI * k
        M[2 * e:2 * e + 4, 2 * e:2 * e + 4] += MASS * m
    free = np.setdiff1d(np.arange(2 * ne + 2), 2 * n * np.arange(4))
    values, modes = (x[..., :number] for x in eigh(K[np.ix_(free, free)], M[np.ix_(free, free)]))

    def load(time):
        out = np.zeros(2 * ne + 2)
        for force, x in axles(time):
            if 0.0 <= x <= ne * L:
                e = min(int(x / L), ne - 1)
                s = x / L - e
                out[2 * e:2 * e + 4] -= force * np.array([
                    1 - 3 * s**2 + 2 * s**3, L * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3,
                    L * (s**3 - s**2)])
        return modes.T @ out[free]

    dt, w = t[1] / 20, np.sqrt(values)[:, None]
    middles = dt * (np.arange(20 * (len(t) - 1)) + 0.5)
    pushes = dt * np.array([load(time) for time in middles]).T * np.exp(-1j * w * middles)
    sums = np.insert(np.cumsum(pushes, axis=1)[:, 19::20], 0, 0.0, axis=1)
    at = np.nonzero(free == 2 * (n + n // 2))[0][0]
    return modes[at] @ (np.imag(sums * np.exp(1j * w * t)) / w)


def test_a_train_crosses_a_bridge_of_three_spans():
    span, speed = 15.0, 40.0
    forces, distances = np.array([8e3, 5e3, 5e3]), np.array([0.0, 4.0, 9.0])
    beam = girder(np.linspace(0, 3 * span, 13), 5)
    scene = Scene(beam).pin("left").fix("right", "r^2")
    for x in (span, 2 * span):
        scene.fix((x, 0), "r^2")
    scene.add(Train(forces, distances, speed))
    end = (3 * span + 9.0) / speed
    history = scene.integrate(end, end / 200, "radau")
    found = history.displacement((1.5 * span, 0))[:, 1]
    expected = bridge(span, 16, lambda t: zip(forces, speed * t - distances), history.t, 40)
    assert np.allclose(found, expected, atol=1e-3 * abs(expected).max())


def test_section_forces_are_those_of_a_force_that_stands():
    span, P = 20.0, 500.0
    beam = girder(np.linspace(0, span, 17))
    held = Scene(beam).pin("left").fix("right", "r^2")
    history = Scene(beam).pin("left").fix("right", "r^2").point_force(
        (0, -P), at=lambda t: (span * t, 0.0)).run(1.0, increments=12)
    x = np.array([np.linspace(0.5, span - 0.5, 40), np.zeros(40)])
    a = span * history.t[5]
    M = history.state(5).resultants(x).M
    assert np.allclose(M, held.point_force((0, -P), at=(a, 0)).solve_static().resultants(x).M)
    expected = P * np.where(x[0] < a, x[0] * (span - a), a * (span - x[0])) / span
    assert np.allclose(M, expected, atol=0.02 * expected.max())


def test_the_moment_under_a_train_on_few_elements():
    """Forces inside of elements, two of them in one: exact on any mesh, by the lever of a beam."""
    span, forces, gap = 20.0, np.array([500.0, 800.0]), 1.5
    scene = Scene(girder(np.linspace(0, span, 4))).pin("left").fix("right", "r^2")
    history = scene.add(Train(forces, [0.0, gap], speed=span, start=gap)).run(0.9, increments=7)
    for state in history:
        axles = gap + span * state.t - np.array([0.0, gap])
        M = [np.sum(forces * np.where(x < axles, x * (span - axles), axles * (span - x))) / span
             for x in axles]
        found = state.resultants(np.array([axles, 0 * axles])).M
        assert np.allclose(found, M, atol=1e-4 * span * forces.sum())


def test_a_force_on_a_face_stands_where_it_is_told():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.05), ElementBeamANCF(2),
                StVenantKirchhoff(2e8, 0.3, 7800), width=0.05)
    moving = Scene(beam).clamp("left").point_force((3.0, -5.0), at=lambda t: (0.8 * t, 0.025))
    for t in (0.4, 1.0):
        still = Scene(beam).clamp("left").point_force((3.0, -5.0), at=(0.8 * t, 0.025))
        history = moving.run([t], increments=2)
        assert np.allclose(history.u[-1], still.solve_static().u, atol=1e-9)
    # in statics time is the load factor
    assert np.allclose(moving.solve_static().u, still.solve_static().u, atol=1e-9)


def test_an_axle_at_the_very_end_of_a_beam_is_on_it():
    scene = Scene(girder(np.linspace(0, 20, 9))).pin("left").fix("right", "r^2")
    history = scene.add(Train([5e4, 8e4], [0.0, 4.0], speed=10.0)).run(2.4, increments=6)
    assert np.allclose(history.t[[1, 5]], (0.4, 2.0))  # 0.4 * 10 - 4 is round-off, and 2 * 10 is 20
    left, right = (history.reactions(end).force[:, 1] for end in ("left", "right"))
    assert np.allclose(left[[1, 5]], (12e4, 1.6e4), rtol=1e-3)
    assert np.allclose((left + right)[[1, 5, 6]], (13e4, 13e4, 8e4), rtol=1e-3)


def test_a_line_load_may_depend_on_time():
    beam = girder(np.linspace(0, 10, 5))
    scene = Scene(beam).pin("left").fix("right", "r^2")
    scene.line_load(lambda x, t: np.array([0 * x[0], -100.0 * (1 + 0 * x[1]) * t]))
    history = scene.run(2.0, increments=2)
    assert np.allclose(history.reactions("left").force[:, 1], [0.0, 500.0, 1000.0], atol=1e-6)


def _swell(x, t):
    return np.array([0 * x[0], -100.0 * (1 + 0 * x[1]) * t])


def _walk(t):
    return 10.0 * t, 0.0


def test_loads_that_move_go_to_other_processes():
    scene = Scene(girder(np.linspace(0, 10, 5))).pin("left").fix("right", "r^2")
    scene.line_load(_swell).point_force((0, -5.0), at=_walk).add(Train([3.0], [0.0], speed=10.0))
    history = scene.run(1.0, increments=2)
    again, state = (pickle.loads(pickle.dumps(x)) for x in (scene, history.state(1)))
    assert np.array_equal(again.run(1.0, increments=2).u, history.u)
    assert np.array_equal(state.reactions("left").force, history.reactions("left").force[1])


def test_what_is_off_the_beam_is_said_or_left_out():
    beam = girder(np.linspace(0, 10, 5))
    scene = Scene(beam).pin("left").fix("right", "r^2")
    off = scene.point_force((0, -1.0), at=lambda t: None if t < 0.5 else (5.0, 0.0))
    force = off.run(1.0, increments=4).reactions("left").force[:, 1]
    assert np.allclose(force, [0, 0, 0.5, 0.5, 0.5], atol=1e-9)
    with pytest.raises((MeshError, CallbackError), match="outside"):
        Scene(beam).pin("left").fix("right", "r^2").point_force(
            (0, -1.0), at=lambda t: (20.0, 0.0)).solve_static()
    for wrong in (lambda t: np.nan, lambda t: "there", lambda t: 1 / 0, lambda: (1.0, 0.0)):
        with pytest.raises((InputError, CallbackError), match="at"):
            Scene(beam).pin("left").fix("right", "r^2").point_force(
                (0, -1.0), at=wrong).solve_static()
    with pytest.raises(InputError, match="distance"):
        Train([1.0, 2.0], [0.0], speed=1.0)
    with pytest.raises(InputError, match="speed"):
        Train([1.0], [0.0], speed=0.0)
