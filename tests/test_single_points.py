"""One material point alone is where it is among many, and has the same fields: to 1e-13."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from conftest import quarter_arc, s_curve
from test_points import STEEL, inside
from skfem_ancf.beam.strains import strain_at
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, NeoHookean, Scene, Section, StVenantKirchhoff)
from skfem_ancf.mesh import location as finder
from skfem_ancf.elements import ELEMENTS


METHODS = ("displacement", "position", "velocity", "strain", "stress")
MESHES = {"straight": lambda: MeshBeam.init_line([-1.0, -0.4, 0.3, 1.2], 0.1, angle=0.7),
          "arc": lambda: quarter_arc(height=0.1), "s-curve": lambda: s_curve(0.1)}
TAPERS = {True: lambda: MeshBeam.init_line([0.0, 0.5, 1.2], height=lambda x: 0.1 - 0.05 * x),
          False: lambda: MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                             [0.0, 0.5, 1.2], height=lambda s: 0.1 - 0.05 * s)}
SETTINGS = dict(max_examples=60, deadline=None, database=None, derandomize=True)
PART = st.floats(0.0, 1.0)


def agree(state, x, tol=1e-13, names=METHODS, beam=None):
    """All that is known at points, one by one and together."""
    for name in names:
        for options in ({}, {"recover": False}) if name in ("strain", "stress") else ({},):
            ask = getattr(state, name)
            many = ask(x, beam, **options)
            one = np.array([ask(tuple(p), beam, **options) for p in x.T.tolist()]).T
            assert_allclose(one, many, rtol=0, atol=tol * np.abs(many).max(),
                            err_msg=f"{name} {options}")


def loaded(beam):
    end = beam.mesh.p[:, -1]
    return Scene(beam).clamp("left").point_force((0.5, -1.5), at=end).solve_static()


@pytest.mark.parametrize("mesh", MESHES)
def test_every_element(mesh, element):
    """On faces, between elements, on the axis, and anywhere; at rest."""
    state = loaded(Beam(MESHES[mesh](), element, STEEL, 0.1))
    agree(state, inside(state.beams[0].mesh)[2])


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("formulation", ["assumed", "continuum", "ecm", "strain-split"])
@pytest.mark.parametrize("mesh", ["straight", "arc"])
@pytest.mark.parametrize("order", [1, 2])
def test_every_formulation(mesh, formulation, order, plane):
    mesh = MESHES[mesh]()
    material = StVenantKirchhoff(E=1e6, nu=0.3, plane=plane)
    beam = Beam(mesh, ElementBeamANCF(order), material, 0.1, formulation=formulation)
    agree(loaded(beam), inside(mesh, 30)[2], names=("strain", "stress"))


@pytest.mark.parametrize("mesh", ["straight", "arc"])
@pytest.mark.parametrize("kind", ["taper", "profile", "layers", "law", "tapered profile",
                                  "tapered layers"])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)], ids=repr)
def test_other_sections_and_laws(kind, element, mesh):
    mesh, material, section = MESHES[mesh](), STEEL, None
    if "taper" in kind:
        mesh = TAPERS[mesh.is_straight]()
    if "profile" in kind:
        section = Section.profile("I", width=0.1, web=0.04, flange=0.01)
    elif "layers" in kind:
        material, section = None, Section.layers(
            (0.02, STEEL), (None if "taper" in kind else 0.08, STEEL.replace(E=3e6)), width=0.1)
    elif kind == "law" and element.order:
        material = NeoHookean(1e6, 0.3)
    beam = Beam(mesh, element, material, None if section else 0.1, section=section)
    agree(loaded(beam), inside(mesh, 30)[2])


def test_of_a_heated_strip():
    mesh = MESHES["arc"]()
    beam = Beam(mesh, ElementBeamANCF(2), STEEL.replace(thermal_expansion=1e-4), 0.1)
    state = Scene(beam).clamp("left").temperature(lambda x, y: 10.0 * y / 0.1).solve_static()
    agree(state, inside(mesh, 30)[2], tol=1e-12, names=("strain", "stress"))


@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamCable(3)], ids=repr)
def test_of_a_motion_and_of_its_instants(element):
    mesh = MESHES["arc"]()
    scene = Scene(Beam(mesh, element, STEEL, 0.1)).pin("left").gravity((0, -9.81))
    history = scene.integrate(0.02, 0.005)
    x = inside(mesh, 20)[2]
    agree(history.state(3), x)
    for name in METHODS:
        one = np.array([getattr(history, name)(tuple(p)) for p in x.T.tolist()])
        many = getattr(history, name)(x)
        assert_allclose(np.moveaxis(one, 0, -1), many, atol=1e-13 * np.abs(many).max())


def test_of_several_beams_and_by_their_names():
    beams = [Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamANCF(3), STEEL, 0.1,
                  name="a"),
             Beam(quarter_arc(height=0.1).translated((2.0, 1.0)), ElementBeamCable(5), STEEL, 0.1,
                  name="b"),
             Beam(quarter_arc(height=0.1).translated((-2.0, 1.0)), ElementBeamANCFCubic(2), STEEL,
                  0.1, name="c")]
    scene = Scene(*beams)
    for beam in beams:
        scene = scene.clamp("left", beam=beam)
    state = scene.gravity((0, -9.81)).solve_static()
    x = [inside(beam.mesh, 20)[2] for beam in beams]
    agree(state, np.hstack(x))
    for beam, points in zip(beams, x):
        agree(state, points, beam=beam.name)


def test_a_changed_state_is_another():
    """What points have asked for is of one state."""
    state = loaded(Beam(MESHES["arc"](), ElementBeamANCF(2), STEEL, 0.1))
    x = tuple(inside(state.beams[0].mesh, 20)[2][:, 17].tolist())
    found = state.strain(x, recover=False), state.stress(x, recover=False)
    none = state.replace(u=0.0 * state.u)
    assert_allclose(none.strain(x, recover=False), 0.0, atol=1e-15)
    assert_allclose(none.stress(x, recover=False), 0.0, atol=1e-9)
    assert_allclose(state.strain(x, recover=False), found[0], atol=1e-13 * np.abs(found[0]).max())
    assert_allclose(state.stress(x, recover=False), found[1], atol=1e-13 * np.abs(found[1]).max())


@settings(**SETTINGS)
@given(xi=PART, eta=PART, bend=st.floats(-1.2, 1.2), height=st.floats(1e-3, 0.4),
       n=st.integers(1, 6), offset=st.sampled_from([0.0, 100.0]))
@example(xi=0.0, eta=0.0, bend=1.0, height=0.3, n=3, offset=0.0)
@example(xi=1.0, eta=1.0, bend=0.0, height=0.3, n=1, offset=0.0)
def test_a_point_of_a_parabola_is_found(xi, eta, bend, height, n, offset):
    """At the place that it was made from."""
    nodes = np.linspace(-0.5, 0.5, n + 1)
    mesh = MeshBeam.init_curve(lambda s: np.array([s + offset, bend * s * s]), nodes, height)
    find, e = finder.Finder(mesh), (n - 1) // 2
    x = mesh.mapping().F(np.array([[xi], [eta]]), np.array([e]))[:, 0]
    found, X, (outside,) = find(x)
    assert outside == 0
    at = mesh.mapping().F(X, found)[:, 0]
    assert_allclose(at, x, atol=1e-14 + 1e-15 * offset)


@settings(**SETTINGS)
@given(xi=PART, eta=PART, e=st.integers(0, 2), element=st.sampled_from(sorted(ELEMENTS)))
def test_fields_of_a_point_of_an_arc(xi, eta, e, element):
    state = STATES.get(element)
    if state is None:
        state = STATES[element] = loaded(Beam(quarter_arc(height=0.1), ELEMENTS[element](), STEEL,
                                              0.1))
    mesh = state.beams[0].mesh
    x = mesh.mapping().F(np.array([[xi], [eta]]), np.array([e]))[:, 0]
    # the size of the fields, which may vanish at one point
    agree(state, np.hstack([x, inside(mesh, 16, seed=1)[2][:, ::4]]))


STATES: dict = {}


@pytest.mark.parametrize("mesh", [quarter_arc(1, height=0.4), s_curve(0.4),
                                  MeshBeam.init_line([0.0, 3.0], 0.4, angle=0.3)], ids=repr)
def test_what_is_in_the_body_is_in_its_box(mesh):
    x0, x1, y0, y1 = finder.Finder(mesh).box
    x, y = inside(mesh, 500)[2]
    assert x0 < x.min() and x.max() < x1 and y0 < y.min() and y.max() < y1


@pytest.mark.parametrize("straight", [True, False])
@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamANCFCubic(2)], ids=repr)
def test_strain_of_a_tapered_beam_is_that_of_its_displacement_gradient(element, straight):
    beam = Beam(TAPERS[straight](), element, STEEL, 0.1, "continuum")
    u = 0.05 * np.random.default_rng(2).standard_normal(beam.N)
    e, X, _ = inside(beam.mesh)
    H, frame = beam.gradients(u, X[:, :, None], e)
    F = (H + frame)[..., 0]
    C = np.einsum("iJn,iKn->JKn", F, F)
    assert_allclose(strain_at(beam, u, e, X),
                    [0.5 * (C[0, 0] - 1.0), 0.5 * (C[1, 1] - 1.0), C[0, 1]],
                    atol=1e-12 * np.abs(C).max())


@pytest.mark.parametrize("degree", [3, 5, 7])
def test_points_of_the_exact_curve_are_points_of_a_cable(degree):
    """A force, a spring, a hinge between nodes at the place that the curve's function says; the
    elements of the mesh are cubics beside it."""
    def arc(s):
        return np.array([np.sin(s), 1 - np.cos(s)])

    mesh = MeshBeam.init_curve(arc, np.linspace(0, 1, 9), height=0.02)
    beam = Beam(mesh, ElementBeamCable(degree), StVenantKirchhoff(2e9, 0.3, 1000), width=0.02)
    at = tuple(arc(0.546875))
    force = np.array([0.03, -0.04])
    scene = Scene(beam).clamp("left").point_force(force, at)
    state = scene.solve_static(tol=1e-12)
    reaction = state.reactions("left")
    arm = state.position(at)
    assert np.allclose(reaction.force, -force, rtol=0, atol=1e-10)
    assert reaction.moment == pytest.approx(arm[1] * force[0] - arm[0] * force[1], rel=2e-5)
    Scene(beam).clamp("left").spring(1.0, between=((beam, at), ("ground", (0.5, 1.0)))).system
    with pytest.raises(InputError, match="off the axis"):
        Scene(beam).clamp("left").point_force(force, tuple(arc(0.546875) + [-1e-4, 1e-4]))
