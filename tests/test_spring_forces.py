"""The force in a spring: against equilibrium, in states and over motions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamCable, InputError, MeshBeam, Scene, Spring,
                        StVenantKirchhoff)

E, H = 2e9, 0.05
EI = E * H**4 / 12


def cantilever():
    return Scene(Beam(MeshBeam.init_line([0, 0.5, 1], H), ElementBeamCable(5),
                      StVenantKirchhoff(E, 0.0, 1000.0), width=H)).clamp("left")


def hardening(e):
    return 5e3 * e + 1e6 * e**3


@pytest.mark.parametrize("k", [5e3, hardening])
def test_a_propped_cantilever(k):
    """The tip's shear force is what the spring takes of the load."""
    F = 300.0
    scene = cantilever().point_force((0, -F), at=(1, 0)).spring(k, ((1, 0), (1, 1)))
    linear = scene.solve_linear()
    R = 5e3 * F / (3 * EI + 5e3)
    assert_allclose(linear.spring_force(), R, rtol=1e-6)
    state = scene.solve_static()
    (x, y), right = state.position((1, 0)), np.array([1.0, 1.0])
    d = right - (x, y)
    length = np.hypot(*d)
    law = hardening if callable(k) else lambda e: k * e
    assert_allclose(state.spring_force(), law(length - 1.0), rtol=1e-9)
    tip = state.resultants((1, 0)).force
    assert_allclose(tip, [0, -F] + state.spring_force() * d / length, rtol=1e-6, atol=1e-6 * F)


def test_torsional_springs_and_several():
    """Numbers count springs in their order; elements name them, too."""
    M, k = 40.0, 900.0
    scene = cantilever().spring(1e3, ((0.5, 0), (0.5, 2)), length=1.9).moment("right", M)
    scene.torsional_spring(k, "right").point_mass(1.0, (1, 0))
    for state in (scene.solve_linear(), scene.solve_static()):
        angle = state.resultants((1, 0)).angle
        assert_allclose(state.spring_force(1), k * angle, rtol=1e-6)
        assert_allclose(state.resultants((1, 0)).M, M - state.spring_force(1), rtol=1e-5)
        spring = next(one for one in scene.elements if isinstance(one, Spring))
        assert state.spring_force(spring) == state.spring_force(0)
        assert 90.0 < state.spring_force(0) < 110.0
    with pytest.raises(InputError, match="from 0 to 1, got 2"):
        state.spring_force(2)
    with pytest.raises(InputError, match="not one of scene.elements"):
        state.spring_force(Spring(1.0, ((1, 0), (1, 1))))
    with pytest.raises(InputError, match="no springs"):
        cantilever().point_force((0, 1), at=(1, 0)).solve_static().spring_force()


def test_a_motion():
    """With the dashpot."""
    k, c = 2e3, 40.0
    scene = cantilever().spring(k, ((1, 0), (1, 1)), damping=c)
    scene.point_force((0, -50.0), at=(1, 0))
    history = scene.integrate(t_end=0.1, dt=1e-3)
    d = np.array([1.0, 1.0]) - [1.0, 0.0] - history.displacement((1, 0))
    length = np.hypot(*d.T)
    rate = -np.sum(d * history.velocity((1, 0)), axis=1) / length
    assert_allclose(history.spring_force(), k * (length - 1.0) + c * rate, rtol=1e-9, atol=1e-9)
    assert_allclose(history.spring_force(0)[-1], history.state(-1).spring_force(0), rtol=1e-12)
    run = scene.run(1.0, increments=2)
    assert_allclose(run.spring_force()[-1], scene.solve_static().spring_force(), rtol=1e-6)
