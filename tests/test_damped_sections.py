"""Damping of tapers, profiles and layers: decrements of theory, and what it takes."""

import numpy as np
import pytest
from numpy.polynomial import Legendre, Polynomial
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from test_damping import decay

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, KelvinVoigt, MeshBeam, NeoHookean,
                        Scene, Section, StVenantKirchhoff)
from skfem_ancf.core.quadrature import gauss

H = 0.02
STEEL = StVenantKirchhoff(2e8, 0.3, 7800.0)
BRASS = StVenantKirchhoff(1e8, 0.3, 8500.0)
SIZES = dict(width=0.012, web=0.002, flange=0.002)


def height(x):
    return H * (1.0 - 0.5 * x)


def constant(x):
    return H + 0.0 * x


#: Arguments of the beam, its height, its pieces from bottom to top, and its width on average.
BODIES = {
    "taper": (dict(material=STEEL, width=0.01), height,
              lambda h: [(-h / 2, h / 2, STEEL, 0.01)], 0.01),
    "I": (dict(material=STEEL, section=Section.profile("I", **SIZES)), height,
          lambda h: [(-h / 2, 0.002 - h / 2, STEEL, 0.012), (0.002 - h / 2, h / 2 - 0.002, STEEL,
                                                             0.002),
                     (h / 2 - 0.002, h / 2, STEEL, 0.012)], 0.012),
    "bimetal": (dict(section=Section.layers((0.005, STEEL), (0.015, BRASS), width=0.01)), constant,
                lambda h: [(-h / 2, 0.005 - h / 2, STEEL, 0.01), (0.005 - h / 2, h / 2, BRASS,
                                                                  0.01)], 0.01),
    "coating": (dict(section=Section.layers((None, BRASS), (0.002, STEEL), width=0.01)), height,
                lambda h: [(-h / 2, h / 2 - 0.002, BRASS, 0.01), (h / 2 - 0.002, h / 2, STEEL,
                                                                  0.01)], 0.01),
    "rubber": (dict(section=Section.layers((None, STEEL), (0.002, NeoHookean(2e8, 0.3, 1000.0)),
                                           width=0.01)), height, None, 0.01),
}
bodies = pytest.mark.parametrize("body", BODIES)


def beam_of(body, element, time=0.0, n=4):
    arguments, h, _, _ = BODIES[body]
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), h if h is height else H)
    return Beam(mesh, element, damping=KelvinVoigt(time), **arguments)


def frequencies(body):
    """Those of the cantilever by Ritz: both displacements of the axis polynomials, with the
    coupling and the rotary inertia of its sections.
    """
    x, w = gauss(40)
    _, h, pieces, _ = BODIES[body]
    E, M = (np.array([sum(of(law) * b * (top**(k + 1) - low**(k + 1)) / (k + 1)
                          for low, top, law, b in pieces(h(x))) * w for k in range(3)])
            for of in (lambda law: law.E, lambda law: law.density))
    X, powers = Polynomial([0, 1]), [Legendre.basis(k, [0, 1]).convert(kind=Polynomial)
                                     for k in range(13)]
    u, u1 = (np.array([(X * p).deriv(d)(x) for p in powers]) for d in (0, 1))
    v, v1, v2 = (np.array([(X * X * p).deriv(d)(x) for p in powers]) for d in range(3))
    K = np.block([[u1 * E[0] @ u1.T, -u1 * E[1] @ v2.T], [-v2 * E[1] @ u1.T, v2 * E[2] @ v2.T]])
    m = np.block([[u * M[0] @ u.T, -u * M[1] @ v1.T],
                  [-v1 * M[1] @ u.T, v * M[0] @ v.T + v1 * M[2] @ v1.T]])
    return np.sqrt(eigh(K, m, eigvals_only=True)[:3])


@pytest.mark.parametrize("k", [0, 1, 2])
@pytest.mark.parametrize("body", ["taper", "I", "bimetal", "coating"])
def test_logarithmic_decrements(body, k):
    """All three at once: their ratios add up."""
    omega = frequencies(body)
    scene = Scene(beam_of(body, ElementBeamCable(5), 5e-5, 6)).clamp("left")
    assert_allclose(scene.modes(3).frequencies, omega, rtol=2e-5)
    scene.damping(mass=0.4, stiffness=5e-5, modal=[0.01, 0.02, 0.03])
    zeta = 0.5e-4 * omega[k] + 0.2 / omega[k] + 0.01 * (k + 1)
    assert decay(scene, k, omega[k], 2) == pytest.approx(zeta, rel=1e-3)


@bodies
def test_drag_is_that_of_the_width(body):
    for element in (ElementBeamCable(5), ElementBeamANCF(2)):
        if body != "rubber" or element.order:
            scene = Scene(beam_of(body, element)).drag(10.0, 1.2)
            rise = scene.beams[0].rigid_motions()[:, 1]
            force = scene.system.forces.part_forces(
                scene.system.backend.tables.plain.forces, 0.0 * rise, 3.0 * rise)
            assert abs(force.sum()) == pytest.approx(0.5 * 10.0 * 1.2 * BODIES[body][3] * 9.0)


@pytest.mark.parametrize("thickness, h", [(0.015, H), (None, height)])
def test_drag_is_that_of_the_widest_layer(thickness, h):
    """One of a width that is a function, 0.01 to 0.03 along the beam, one of 0.02."""
    layers = Section.layers((thickness, STEEL, lambda x, y: 0.01 + 0.02 * x), (0.005, BRASS, 0.02))
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), h)
    scene = Scene(Beam(mesh, ElementBeamCable(5), section=layers)).drag(10.0, 1.2)
    rise = scene.beams[0].rigid_motions()[:, 1]
    force = scene.system.forces.part_forces(scene.system.backend.tables.plain.forces,
                                            0.0 * rise, 3.0 * rise)
    assert abs(force.sum()) == pytest.approx(0.5 * 10.0 * 1.2 * 0.0225 * 9.0)


def test_a_blade_comes_to_rest_where_statics_say():
    beam = beam_of("coating", ElementBeamCable(5), 0.02)
    scene = Scene(beam).clamp("left").gravity((0, -9.81)).damping(mass=5.0)
    end = scene.integrate(4.0, 0.05, scheme="generalized-alpha").displacement((1, 0))[-1]
    assert_allclose(end, scene.solve_static().displacement((1, 0)), rtol=2e-4)
