"""Doors: states of other meshes, objects that do not change, laws and loads of one's own."""

import textwrap

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, NameUnknown, NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.core.errors import ImmutableError
from skfem_ancf.actions.joints import Joint
from skfem_ancf.actions.loads import Load
from skfem_ancf.materials import Material

MATERIAL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
E, NU = 2e8, 0.3


def line(n=8, **options):
    return MeshBeam.init_line(np.linspace(0, 1, n + 1), 0.01, **options)


def cantilever(mesh=None, element=None, material=MATERIAL, **options):
    beam = Beam(line() if mesh is None else mesh, element or ElementBeamANCF(2), material, 0.01,
                **options)
    return Scene(beam).clamp("left").gravity((0, -9.81))


# states of other meshes

def others():
    """Scenes of as many coordinates as the cantilever, or not; and why their states do not fit."""
    graded = MeshBeam.init_line(np.linspace(0, 1, 9) ** 1.1, 0.01)
    arc = MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1 - np.cos(s)]), np.linspace(0, 1, 9),
                              0.01)
    two = Scene(Beam(line(), ElementBeamANCF(2), MATERIAL, 0.01),
                Beam(line(), ElementBeamANCF(2), MATERIAL, 0.01))
    return {
        "finer": (cantilever(line(16)), "16 elements, that of the scene 8"),
        "coarser": (cantilever(line(4)), "4 elements"),
        "graded": (cantilever(graded), "nodes lie elsewhere"),
        "turned": (cantilever(line(angle=0.3)), "nodes lie elsewhere"),
        "curved": (cantilever(arc), "nodes lie elsewhere"),
        "thicker": (cantilever(line().replace(height=0.02)), "its height is 0.02"),
        "order": (cantilever(element=ElementBeamANCF(3)), "its element is"),
        "points": (cantilever(element=ElementBeamANCFCubic(1)), "its element is"),
        "beams": (two, "a state of 2 beams"),
    }


@pytest.mark.parametrize("name", list(others()))
def test_a_state_of_another_mesh_is_refused(name):
    other, why = others()[name]
    scene, state = cantilever(), other.state()
    for call in (lambda: scene.solve_static(start=state), lambda: scene.modes(2, state),
                 lambda: scene.integrate(0.01, 0.01, start=state)):
        with pytest.raises(InputError, match=why):
            call()
    if state.system.N != scene.layout.N:
        for call in (lambda: scene.state(state.u), lambda: scene.initial_velocity(state.u),
                     lambda: scene.system.internal_force(state.u),
                     lambda: scene.system.assemble(state.u)):
            with pytest.raises(InputError, match="shape"):
                call()


def test_a_state_of_an_equal_scene_is_taken():
    first, again = cantilever(), cantilever()
    state = first.solve_static()
    assert_array_equal(again.modes(2, state).frequencies, first.modes(2, state).frequencies)
    assert again.solve_static(start=state).iterations < state.iterations
    assert again.integrate(1e-3, 1e-3, start=state).state(0).strain_energy == state.strain_energy
    # another law and other loads: the body is the same
    harder = cantilever(material=MATERIAL.replace(E=3e8)).point_force((0, -0.01), at=(1, 0))
    assert harder.solve_static(start=state).converged


def test_what_is_no_state_is_refused():
    scene = cantilever()
    for start in (np.zeros(scene.layout.N), "state", 3, scene):
        with pytest.raises(InputError, match=r"is a State.*scene.state\(u\)"):
            scene.solve_static(start=start)
        with pytest.raises(InputError, match="is a State"):
            scene.modes(1, start)
    with pytest.raises(InputError, match="without start"):
        scene.solve_static(start=scene.state(), adapt=1e-2)
    with pytest.raises(InputError, match="u has a value that is NaN"):
        scene.state(np.full(scene.layout.N, np.nan))
    with pytest.raises(InputError, match="multipliers must have shape"):
        scene.state(multipliers=np.zeros(3))


def test_coordinates_are_taken_over_by_hand():
    graded, scene = others()["graded"][0], cantilever()
    state = graded.solve_static()
    found = scene.solve_static(start=scene.state(state.u))
    assert_allclose(found.u, scene.solve_static().u, atol=1e-9)


def test_multipliers_of_other_joints_are_refused():
    a, b = cantilever(), cantilever()
    a.joint("line", at=(1, 0), direction=(1, 1))
    b.joint("circle", at=(1, 0), center=(1, 1))
    with pytest.raises(InputError, match="multipliers of other joints"):
        a.modes(1, b.state())


DOORS = """
    import numpy as np
    import pytest
    from skfem_ancf import (Beam, ElementBeamANCF, InputError, MeshBeam, Scene, StVenantKirchhoff)
    from skfem_ancf.results import State

    def scene(n):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), 0.01), ElementBeamANCF(1),
                    StVenantKirchhoff(2e8, 0.0, 7800), 0.01)
        return Scene(beam).clamp("left").gravity((0, -9.81))

    one, more, fewer = scene(4), scene(7), scene(2)
    state = one.solve_static()
    strided = State(one.system, np.repeat(state.u, 2)[::2])
    for same in (state, one.state(state.u), strided):
        assert np.allclose(one.solve_static(start=same).u, state.u)
        assert np.allclose(one.system.internal_force(same.u), state.internal_force)
    single = state.u.astype(np.float32)
    assert np.allclose(one.system.internal_force(single), one.system.internal_force(1.0 * single))
    for other in (more, fewer):
        wrong = other.state()
        for call in (lambda: one.solve_static(start=wrong), lambda: one.modes(2, wrong),
                     lambda: one.integrate(1e-3, 1e-3, start=wrong),
                     lambda: one.initial_velocity(wrong.u), lambda: one.state(wrong.u),
                     lambda: one.system.internal_force(wrong.u),
                     lambda: one.system.assemble(wrong.u),
                     lambda: State(one.system, wrong.u).internal_force):
            with pytest.raises(InputError):
                call()
"""


@pytest.mark.filterwarnings("ignore::skfem_ancf.ModelWarning")  # of a coarse mesh
def test_what_passes_the_doors():
    """Its own memory only is read: with ``make test-settings`` compiled code checks each index."""
    exec(textwrap.dedent(DOORS), {})


# what does not change

def things():
    scene = cantilever()
    state = scene.solve_static()
    beam = scene.beams[0]
    return {"beam": (beam, "width"), "material": (beam.material, "E"),
            "mesh": (beam.mesh, "height"),
            "element": (beam.element, "section"), "formulation": (beam.formulation, "alpha"),
            "state": (state, "load"), "own": (Cubed(E, NU), "E")}


@pytest.mark.parametrize("name", ["beam", "material", "mesh", "element", "formulation", "state",
                                  "own"])
def test_attributes_do_not_change(name):
    thing, attribute = things()[name]
    before = getattr(thing, attribute)
    with pytest.raises(ImmutableError, match="does not change"):
        setattr(thing, attribute, 2 * before if isinstance(before, float) else before)
    with pytest.raises(AttributeError):
        delattr(thing, attribute)
    with pytest.raises(ImmutableError):
        thing.widht = 3.0
    assert getattr(thing, attribute) is before
    for key, value in vars(thing).items():
        assert key[0] == "_" or not (isinstance(value, np.ndarray) and value.flags.writeable)
    if hasattr(thing, "replace"):
        with pytest.raises(ImmutableError, match=r"replace\("):
            setattr(thing, attribute, before)


def test_arrays_do_not_change():
    x = np.linspace(0, 1, 5)
    mesh = MeshBeam.init_line(x, 0.01)
    x[2] = 99.0  # still the caller's own
    assert mesh.p[0, 2] == 0.5 and mesh.s[2] == 0.5
    scene = cantilever()
    state, beam = scene.solve_static(), scene.beams[0]
    for array in (mesh.p, mesh.t, mesh.lengths, mesh.boundaries["left"], state.u,
                  state.multipliers, beam.q0, beam.element.section_points,
                  scene.loads[0].vector):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(TypeError, match="does not support item assignment"):
        mesh.boundaries["middle"] = np.array([2])
    assert "middle" in mesh.with_boundaries({"middle": np.array([2])}).boundaries
    for things in (scene.loads, scene.joints, scene.items, scene.beams):
        assert isinstance(things, tuple)
    with pytest.raises(AttributeError):
        scene.loads = []
    with pytest.raises(ImmutableError):
        scene.loads[0].vector = np.zeros(scene.layout.N)


def test_replace_returns_a_changed_copy():
    scene = cantilever()
    beam = scene.beams[0]
    tip = scene.solve_linear().displacement((1, 0))[1]
    for changed, factor in ((beam.replace(material=beam.material.replace(E=4e8)), 2.0),
                            (beam.replace(mesh=beam.mesh.replace(height=0.02)), 4.0),
                            (beam.replace(width=0.02), 1.0)):
        other = scene.replace(beams=[changed]).solve_linear().displacement((1, 0))[1]
        assert_allclose(tip / other, factor, rtol=2e-3)
    assert beam.width == 0.01 and beam.material.E == 2e8 and beam.mesh.height == 0.01
    assert_allclose(scene.solve_linear().displacement((1, 0))[1], tip, rtol=1e-12)
    for thing, known in ((beam, "'material'"), (beam.material, "'density'"),
                         (beam.mesh, "'height'"),
                         (scene.state(), "'message'")):
        with pytest.raises(NameUnknown, match=known):
            thing.replace(lenght=3)
    with pytest.raises(InputError, match="E must be positive"):
        beam.material.replace(E=-1)


# laws that are honoured or refused

class Cubed(Material):
    """Hooke's law and the cube of the strain: a law of one's own."""

    def energy(self, strain):
        D = StVenantKirchhoff(self.E, self.nu).D
        return 0.5 * np.sum(strain * np.tensordot(D, strain, 1), axis=0) + 0.25 * self.E * np.sum(
            strain**4, axis=0)

    def stress(self, strain):
        return (np.tensordot(StVenantKirchhoff(self.E, self.nu).D, strain, 1)
                + self.E * np.asarray(strain)**3)


class Half(StVenantKirchhoff):
    """Half the stress: as half of Young's modulus."""

    def stress(self, strain):
        return 0.5 * super().stress(strain)


class HalfNeoHookean(NeoHookean):
    def stress(self, strain):
        return 0.5 * super().stress(strain)


class RealOnly(StVenantKirchhoff):
    def stress(self, strain):
        return 0.5 * super().stress(np.real(strain))


class OtherModuli(StVenantKirchhoff):
    def moduli(self, strain):
        return 1.5 * super().moduli(strain)


class EnergyOnly(StVenantKirchhoff):
    def energy(self, strain):
        return 2.0 * super().energy(strain)


class Softer(StVenantKirchhoff):
    @property
    def D(self):
        return 0.5 * super().D


@pytest.mark.parametrize("own, base", [(Half, StVenantKirchhoff), (Softer, StVenantKirchhoff),
                                       (HalfNeoHookean, NeoHookean)])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_an_overridden_law_is_honoured(own, base, plane):
    found = cantilever(material=own(E, NU, 7800, plane=plane), formulation="continuum")
    wanted = cantilever(material=base(0.5 * E, NU, 7800, plane=plane), formulation="continuum")
    a, b = found.solve_static(), wanted.solve_static()
    assert_allclose(a.u, b.u, atol=1e-7)
    assert_allclose(a.strain_energy, b.strain_energy, rtol=1e-6)
    assert_allclose(a.stress((0, 0.004)), b.stress((0, 0.004)), rtol=1e-5, atol=1.0)
    assert_allclose(found.modes(2, a).frequencies, wanted.modes(2, b).frequencies, rtol=1e-6)
    motions = [s.integrate(4e-3, 1e-3) for s in (found, wanted)]
    assert_allclose(motions[0].u, motions[1].u, rtol=0, atol=1e-8 * np.abs(motions[1].u).max())
    assert np.ptp(motions[0].total_energy) < 1e-10
    if plane == "stress" and own is not Softer:
        with pytest.raises(InputError, match="thickness_stretch"):
            found.beams[0].material.thickness_stretch(np.zeros((3, 1)))


def test_overrides_that_do_not_fit_together():
    with pytest.raises(InputError, match=r"moduli\(strain\) of OtherModuli is not the derivative"):
        cantilever(material=OtherModuli(E, NU, 7800)).solve_static()
    with pytest.raises(InputError, match="overrides energy and not stress"):
        cantilever(material=EnergyOnly(E, NU, 7800)).solve_static()
    with pytest.raises(InputError, match=r"moduli\(strain\) of RealOnly"):
        cantilever(material=RealOnly(E, NU, 7800)).solve_static()


@pytest.mark.parametrize("material", [NeoHookean(E, NU), Cubed(E, NU), Half(E, NU), Softer(E, NU)])
def test_a_cable_has_hookes_law(material):
    with pytest.raises(InputError, match="a cable has Hooke's law.*ElementBeamANCFCubic"):
        Beam(line(), ElementBeamCable(3), material, 0.01)
    assert Beam(line(), "auto", material, 0.01).element.order >= 2
    assert not Beam(line(), "auto", MATERIAL, 0.01).has_sections


# loads and joints of one's own

class Springs(Load):
    """A bed of springs of k N/m^2 below the axis: one at each node, of the length it has."""

    constant = False

    def __init__(self, k, beam=None, amplitude=None):
        super().__init__(beam, amplitude)
        self.k = k

    def bind(self, beam):
        bound = super().bind(beam)
        share = np.zeros(beam.mesh.p.shape[1])
        for end in beam.mesh.t:
            share[end] += 0.5 * beam.mesh.lengths
        bound.dofs, bound.stiff = np.arange(1, beam.N, beam.nd), self.k * share
        return bound

    def force(self, u):
        out = np.zeros(self.beam.N)
        out[self.dofs] = -self.stiff * u[self.dofs]
        return out

    def stiffness(self, u):
        return self.dofs, self.dofs, -self.stiff

    def potential(self, u):
        return 0.5 * float(self.stiff @ u[self.dofs] ** 2)


class Tie(Joint):
    """Two points of a beam keep their distance along x."""

    equations = ("force along x",)

    def __init__(self, first, second, name=None):
        self.first, self.second, self.name = first, second, name

    def bind(self, scene):
        beam = scene.beam(None)
        self.row = np.zeros((1, scene.N))
        for point, sign in ((self.first, -1.0), (self.second, 1.0)):
            dofs, weights = beam.probe(point)
            self.row[0, dofs[0]] += sign * weights

    def value(self, u, t):
        return self.row @ u

    def jacobian(self, u, t):
        return self.row


def test_a_load_of_ones_own_works_everywhere():
    k = 3.0
    scene = cantilever(line(64), ElementBeamCable(3)).add(Springs(k))
    tip = scene.solve_linear().displacement((1, 0))[1]
    # E I w_xxxx + k w = q: a particular solution, and four exponentials that meet the ends
    EI, q = E * 0.01**4 / 12, -7800 * 9.81 * 1e-4
    lam = (k / (4 * EI)) ** 0.25
    roots = np.array([(-1 + 1j), (-1 - 1j), (1 + 1j), (1 - 1j)]) * lam
    rows = np.array([np.ones(4), roots, roots**2 * np.exp(roots), roots**3 * np.exp(roots)])
    c = np.linalg.solve(rows, np.array([-q / k, 0, 0, 0], dtype=complex))
    assert_allclose(tip, np.real(q / k + c @ np.exp(roots)), rtol=2e-3)
    state = scene.solve_static()
    assert -0.903 < state.displacement((1, 0))[1] < -0.05
    # on another mesh
    fine = cantilever(line(8), ElementBeamCable(3)).add(Springs(k)).solve_static(adapt=1e-3)
    assert len(fine.scene.loads) == 2 and fine.refinements
    assert_allclose(fine.displacement((1, 0)), state.displacement((1, 0)), rtol=5e-3)
    # in a motion, with energy
    history = scene.integrate(0.05, 1e-3)
    assert np.ptp(history.total_energy) < 1e-8
    assert history.displacement((1, 0))[-1, 1] < -1e-3
    driven = cantilever(line(8), ElementBeamCable(3)).add(Springs(k, amplitude=lambda t: 0.0))
    free = cantilever(line(8), ElementBeamCable(3))
    assert_allclose(driven.integrate(0.02, 1e-3).u[-1], free.integrate(0.02, 1e-3).u[-1],
                    atol=1e-9)


def test_a_joint_of_ones_own_works_everywhere():
    tie = Tie((0, 0), (1, 0), "tie")
    scene = cantilever(line(4)).add(tie)
    state = scene.solve_static()
    assert abs(state.displacement((1, 0))[0]) < 1e-12 and abs(state.joint_force(tie)[0]) > 1e-3
    fine = scene.solve_static(adapt=0.05)
    assert fine.beams[0].mesh.nelements > 4 and abs(fine.displacement((1, 0))[0]) < 1e-12
    assert_allclose(fine.joint_force(tie), state.joint_force(tie), rtol=0.2)
    history = scene.integrate(0.01, 1e-3)
    assert np.abs(history.displacement((1, 0))[:, 0]).max() < 1e-12
    assert history.joint_force(tie).shape == (len(history), 1)
    with pytest.raises(ImmutableError, match="'first' cannot be set: make a new one"):
        tie.first = (0.5, 0)


def test_names_of_coordinates_given_as_a_list_are_kept():
    names = ["r"]
    scene = Scene(Beam(line(2), ElementBeamANCF(2), MATERIAL, 0.01)).fix("left", names)
    names.append("r_X")
    fine = scene.replace(mesh=line(4))
    assert len(fine.system.constraints.fixed) == 2
