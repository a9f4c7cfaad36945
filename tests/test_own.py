"""Laws, loads, joints and elements of one's own whose parts do not fit each other."""

import numpy as np
import pytest

from skfem_ancf import Beam, ElementBeamANCF, InputError, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.elements import ElementBeam
from skfem_ancf.elements.base import SectionFunctions
from skfem_ancf.actions.joints import Joint
from skfem_ancf.actions.forces import point
from skfem_ancf.actions.loads import Load
from skfem_ancf.materials import Material
from skfem_ancf.materials.base import hooke


class Springs(Load):
    """k (w + w^3) at each node."""

    constant = False

    def bind(self, beam):
        bound = super().bind(beam)
        bound.dofs = np.arange(1, beam.N, beam.nd)
        return bound

    def force(self, u):
        out, w = np.zeros(self.beam.N), u[self.dofs]
        out[self.dofs] = -5.0 * (w + w**3)
        return out

    def stiffness(self, u):
        return self.dofs, self.dofs, -5.0 * (1.0 + 3.0 * u[self.dofs] ** 2)

    def potential(self, u):
        return 5.0 * float(np.sum(u[self.dofs] ** 2 / 2 + u[self.dofs] ** 4 / 4))


class Ground(Springs):
    """k w at each node that is below the ground, nothing above: a kink where it touches."""

    def force(self, u):
        out, w = np.zeros(self.beam.N), u[self.dofs]
        out[self.dofs] = -5.0 * np.minimum(w, 0.0)
        return out

    def stiffness(self, u):
        return self.dofs, self.dofs, -5.0 * (u[self.dofs] < 0.0)

    def potential(self, u):
        return 2.5 * float(np.sum(np.minimum(u[self.dofs], 0.0) ** 2))


class Frozen(Springs):
    constant = True


class Negative(Springs):
    def stiffness(self, u):
        i, j, v = super().stiffness(u)
        return i, j, -v


class Sideways(Springs):
    """Pushed up by what moves along: without a potential, and it does not say so."""

    def force(self, u):
        out = np.zeros(self.beam.N)
        out[self.dofs] = -5.0 * u[self.dofs - 1]
        return out

    def stiffness(self, u):
        return self.dofs, self.dofs - 1, np.full(len(self.dofs), -5.0)

    def potential(self, u):
        return None


class Gaining(Springs):
    def potential(self, u):
        return -super().potential(u)


class Tether(Joint):
    """A distance, written with its square root."""

    equations = ("tension",)

    def bind(self, scene):
        p = point(scene, None, (1.0, 0.0))
        self.rows = np.array([p.row((1, 0), scene.N), p.row((0, 1), scene.N)])

    def d(self, u):
        return np.array([0.3, -0.4]) + self.rows @ u

    def value(self, u, t):
        return np.array([np.hypot(*self.d(u)) - 0.5])

    def jacobian(self, u, t):
        d = self.d(u)
        return (d / np.hypot(*d))[None] @ self.rows

    def curvature(self, u, t, multipliers):
        d, size = self.d(u), np.hypot(*self.d(u))
        H = multipliers[0] / size * (np.eye(2) - np.outer(d, d) / size**2)
        A = self.rows.T @ H @ self.rows
        i, j = A.nonzero()
        return i, j, A[i, j]


class Slack(Tether):
    def jacobian(self, u, t):
        return 1.1 * super().jacobian(u, t)


class Straight(Tether):
    def curvature(self, u, t, multipliers):
        return None


class Law(Material):
    def energy(self, strain):
        return 0.5 * np.sum(strain * self.stress(strain), axis=0)

    def stress(self, strain):
        return np.tensordot(hooke(self.E, self.nu, self.plane), strain, 1)


class Doubled(Law):
    def energy(self, strain):
        return 2.0 * super().energy(strain)

    def stress(self, strain):
        return super().stress(strain)


class Stiffer(Law):
    def moduli(self, strain):
        return 2.0 * super().moduli(strain)


class Twisted(Law):
    """Its stress has no energy."""

    def stress(self, strain):
        S = super().stress(strain)
        return S + 0.3 * self.E * np.array([strain[1], 0 * strain[1], 0 * strain[1]])


class NoEnergy(Material):
    def stress(self, strain):
        return np.tensordot(hooke(self.E, self.nu, self.plane), strain, 1)


def scene(law=StVenantKirchhoff):
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), 0.05)
    beam = Beam(mesh, ElementBeamANCF(2), law(E=2e8, nu=0.3, density=7800), width=0.05)
    return Scene(beam).clamp("left").gravity((0, -9.81))


def test_those_that_fit_are_taken():
    known = scene().solve_static().u
    assert np.allclose(scene(Law).solve_static().u, known, rtol=0, atol=1e-9)
    assert scene().add(Springs()).solve_static().converged
    line = MeshBeam.init_line(np.linspace(0, 1, 5), 0.05)
    for n in (1, 2, 3, 4):  # a kink may lie where it is looked
        beam = Beam(line, ElementBeamANCF(n), StVenantKirchhoff(2e8, 0.3), width=0.05)
        assert Scene(beam).clamp("left").add(Ground()).solve_static().converged
    state = scene().add(Tether()).solve_static()
    assert np.hypot(*(state.position((1, 0)) - (0.7, 0.4))) == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("thing, message", [
    (Frozen, "constant = False"), (Negative, r"stiffness\(u\).*not the derivative of force"),
    (Sideways, "symmetric = False"), (Gaining, r"force\(u\).*derivative of potential"),
    (Slack, r"jacobian\(u, t\).*derivative of value"),
    (Straight, r"curvature\(u, t, multipliers\).*zero with constant = True")])
def test_derivatives_of_loads_and_joints(thing, message):
    """Frequencies, energies and states were wrong without a word."""
    with pytest.raises(InputError, match=message):
        scene().add(thing())


@pytest.mark.parametrize("law, message", [
    (Doubled, r"stress\(strain\) of Doubled is not the derivative of energy"),
    (Stiffer, r"moduli\(strain\) of Stiffer"), (Twisted, r"moduli\(strain\), transposed, of Twist"),
    (NoEnergy, r"must define energy\(strain\)")])
def test_derivatives_of_laws(law, message):
    with pytest.raises(InputError, match=message):
        scene(law).solve_static()


def test_coordinates_of_elements_are_counted():
    for names, functionals in ((["r_Y", "x"], [(0.0, 0, 1)]), (["r_Y", "x"], 2 * [(0.0, 0, 1)])):
        with pytest.raises(InputError, match="across the section, which has"):
            ElementBeam(SectionFunctions([[1.0]]), names, functionals, ["r_Y"])
    with pytest.raises(InputError, match="derivatives"):
        SectionFunctions([[1.0], [0.0, 1.0]])
