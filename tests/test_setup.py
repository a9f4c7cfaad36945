"""What making and solving a scene computes, by counts of calls."""

import gc
from weakref import ref

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic,
                        ElementBeamANCFHermite, ElementBeamCable, ElementBeamPatelShabana,
                        InputError, KelvinVoigt, MeshBeam, MeshError, NeoHookean, Scene,
                        StVenantKirchhoff)
from skfem_ancf.elements import base
from skfem_ancf.equations.tables import Tables
from skfem_ancf.core.errors import CallbackError, ModelWarning
from skfem_ancf.mesh.location import Finder
from skfem_ancf.beam.masses import points_along
from skfem_ancf.actions.joints import OnLine
from skfem_ancf.actions.joints.base import Joint
from skfem_ancf.actions.loads import EndMoment, PointForce, Pressure, Weight
from skfem_ancf.mesh.mapping import MappingBeam
from skfem_ancf.core.quadrature import gauss, product_rule


NO_ROWS = np.zeros((0, 3), np.int64)


def cantilever(element, n=4, length=1.0, height=0.01, E=2e9, angle=0.0):
    mesh = MeshBeam.init_line(length * np.linspace(0, 1, n + 1), height=height, angle=angle)
    beam = Beam(mesh, element, StVenantKirchhoff(E, 0.3, 7800.0), width=0.01)
    return Scene(beam).clamp("left", thickness="free").gravity((0.0, -9.81))


def counted(monkeypatch, owner, name):
    calls, function = [], getattr(owner, name)

    def call(*args, **kwargs):
        calls.append(args)
        return function(*args, **kwargs)

    monkeypatch.setattr(owner, name, call)
    return calls


@pytest.mark.parametrize("degree", [3, 5, 9])
@pytest.mark.parametrize("x", [[0.0, 1.7], [0.0, 0.4, 0.8], [0.0, 0.3, 1.0]])
def test_tables_of_cables_are_derivatives_along_the_axis(degree, x):
    mesh, element = MeshBeam.init_line(x, 0.02, angle=0.7), ElementBeamCable(degree)
    kernel = Beam(mesh, element, StVenantKirchhoff(2e9, 0.3), 0.01).kernel
    t, step, xi = kernel.tables[0], 1e-30j, kernel.points
    L, slope = mesh.lengths[:len(t.G), None, None], np.array([
        f[1] for f in element.functionals] * 2)
    d_xi = element.local(np.array([xi + step, 0.5 + 0.0 * xi]), 0.02)[1].T * L**(slope - 1.0)
    both = np.concatenate([d_xi.real, d_xi.imag / step.imag / L], axis=1)[:, :, 1:]
    assert np.allclose(t.G, both, rtol=1e-12, atol=1e-12 * np.max(np.abs(both)))
    assert kernel.shared == (len(x) == 2 or x[1] == 0.4) and len(t.G) in (1, mesh.nelements)
    a, b = np.split(t.frame[0], 2)
    assert np.allclose(a, [np.cos(0.7), np.sin(0.7)], rtol=0, atol=1e-14) and not np.any(b)
    assert kernel.volume == pytest.approx(0.01 * 0.02 * x[-1], rel=1e-13)


@pytest.mark.parametrize("plane, formulation", [("stress", "assumed"), ("strain", "assumed"),
                                                ("stress", "continuum"), ("strain", "ecm")])
@pytest.mark.parametrize("element", [ElementBeamANCF(1), ElementBeamANCF(3),
                                     ElementBeamANCF(4, "equispaced"), ElementBeamANCFCubic(2),
                                     ElementBeamANCFHermite(2, 5), ElementBeamCable(3)])
def test_equal_elements_have_the_forces_of_elements_one_by_one(monkeypatch, element, plane,
                                                                formulation):
    def beam(alike):
        mesh = MeshBeam.init_line(np.linspace(0.5, 2.0, 4), 0.07, angle=0.6)
        if not alike:
            vars(mesh)["is_uniform"] = False
        return Beam(mesh, element, StVenantKirchhoff(2e9, 0.3, 7800.0, plane), 0.02, formulation)

    one, other = beam(True), beam(False)
    apart = other.kernel
    monkeypatch.setattr(base.ElementBeam, "by_reference", False)  # by the mapping of the mesh
    other = beam(False)
    a, b = apart.tables[0].G, other.kernel.tables[0].G
    assert a.shape == b.shape and np.allclose(a, b, rtol=1e-12, atol=1e-13 * np.max(np.abs(b)))
    if element.order:
        assert one.kernel.shared and not other.kernel.shared
    rng = np.random.default_rng(1)
    scale = 0.07 ** np.array([f[1] + f[2] for f in element.functionals])
    u = 0.02 * (rng.standard_normal((4, element.nodal_dofs, 2)) / scale[:, None]).ravel()
    for make in (lambda k: k.force(u), lambda k: k.tangents(u), lambda k: k.energies(u),
                 lambda k: np.array([k.volume, k.scale])):
        a, b = make(one.kernel), make(other.kernel)
        assert np.allclose(a, b, rtol=1e-11, atol=1e-11 * np.max(np.abs(b)))
    assert np.allclose(one.weight((1.0, 2.0)), other.weight((1.0, 2.0)), rtol=1e-12, atol=1e-12)
    a, b = (x.mass_elements() for x in (one, other))
    assert np.allclose(a, b, rtol=1e-12, atol=1e-12 * np.max(np.abs(b)))


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamCable(9), ElementBeamANCF(1),
                                     ElementBeamANCF(3), ElementBeamANCFCubic(2)])
def test_weights_are_the_integrals_of_the_functions(element):
    beam = cantilever(element, 3, 1.7, 0.3, angle=0.4).beams[0]
    found, g = beam.weight((2.0, -3.0)), np.array([2.0, -3.0])
    load = np.broadcast_to(beam.masses.weights(g), (3, 2 * element.nodal_dofs, 2))
    assert np.allclose(found, beam.kernel.scatter(load), rtol=1e-12,
                       atol=1e-13 * np.max(np.abs(found)))
    total = found.reshape(-1, element.nodal_dofs, 2)[:, 0].sum(axis=0)  # on the positions
    assert np.allclose(total, beam.total_mass * g, rtol=1e-12)


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(3),
                                     ElementBeamANCFCubic(2)], ids=repr)
def test_masses_of_equal_elements_are_integrals_of_products(monkeypatch, element):
    mesh = MeshBeam.init_line(np.linspace(0.0, 2.0, 4), height=0.3)
    beam = Beam(mesh, element, StVenantKirchhoff(2e9, 0.3, 7800.0), width=0.02)
    one, = beam.masses.matrices(slice(None))
    maps = counted(monkeypatch, MeshBeam, "mapping")
    found = beam.mass_elements(slice(1, 3))
    assert found.shape == (2, *one.shape) and not maps
    scale = np.sqrt(np.diag(one))
    assert np.abs((found - one) / np.outer(scale, scale)).max() < 1e-14


def test_joints_at_rest_are_asked_once(monkeypatch):
    """Static solutions have their tables from the first; joints that move are asked at each."""
    asked, times = counted(monkeypatch, Tables, "slopes"), []
    scene, moved = cantilever(ElementBeamANCF(2)), cantilever(ElementBeamANCF(2))
    scene.joint("line", at=(1.0, 0.0), direction=(1.0, 1.0))
    first, second = scene.solve_static(), scene.solve_static()
    assert len(asked) == 1 and np.array_equal(first.u, second.u)
    moved.joint("angle", at=(1.0, 0.0), angle=lambda t: times.append(t) or 0.1 * t)
    first = moved.solve_static()
    times.clear()
    assert np.array_equal(moved.solve_static().u, first.u) and set(times) == {1.0}


@pytest.mark.parametrize("origin, angle", [((0.0, 0.0), 0.0), ((3e3, -1.0), 0.7)])
@pytest.mark.parametrize("x", [[0.0, 0.5], [0.5, 1.0, 1.5, 2.0], [0.0, 0.3, 1.0]])
def test_a_line_is_the_mesh_that_its_nodes_make(x, origin, angle):
    mesh = MeshBeam.init_line(x, 0.1, origin=origin, angle=angle)
    given = {name: getattr(mesh, name) for name in ("p_X", "p_Y", "p_XY", "lengths")}
    anew = MeshBeam(mesh.p, mesh.t, height=0.1, **given)
    for name in ("p", "t", "p_X", "p_Y", "p_XY", "lengths"):
        a, b = getattr(mesh, name), getattr(anew, name)
        assert a.dtype == b.dtype and np.allclose(a, b, rtol=0, atol=1e-11) and (
            not a.flags.writeable)
    assert mesh.is_straight and anew.is_straight and mesh.is_uniform == anew.is_uniform
    assert np.allclose(mesh.parameters, x)
    point = mesh.p @ np.full(len(x), 1.0 / len(x)) + 0.03 * mesh.p_Y[:, 0]
    (e, X, _), other = (Finder(m)(point[:, None]) for m in (mesh, anew))
    assert e == other[0] and np.allclose(X, other[1], rtol=0, atol=1e-9)
    with pytest.raises(MeshError, match="no length"):
        MeshBeam.init_line([0.0, 1e-14], 0.1, origin=(3e3, 0.0))


def test_curves_are_asked_at_all_points_at_once():
    asked = []

    def r(s):
        asked.append(np.iscomplexobj(s))
        return np.array([np.sin(s), 1.0 - np.cos(s)])

    x = np.linspace(0, 1, 6)
    mesh = MeshBeam.init_curve(r, x, 0.1)
    assert asked == [True, False, False, True]  # the complex step tried, places, derivatives
    asked.clear()
    other = MeshBeam.init_curve(r, x, 0.1, dr=lambda s: np.array([np.cos(s), np.sin(s)]))
    assert asked == [False] and np.allclose(mesh.lengths, other.lengths, rtol=1e-15)
    for name in ("p", "p_X", "p_Y", "p_XY", "lengths", "s"):
        kept = getattr(mesh, name)
        assert not kept.flags.writeable and kept.flags.c_contiguous
    assert np.allclose(mesh.p_XY, mesh.curve.turning(x), rtol=1e-15, atol=1e-15)
    assert np.allclose(mesh.lengths, mesh.curve.lengths(x[:-1], x[1:]), rtol=1e-15)


def test_rigid_motions_of_some_degrees_of_freedom():
    beam = cantilever(ElementBeamANCF(2), 3, angle=0.3).beams[0]
    for held in ([0, 1, 2], [0, 1, 5], [0, 1, 4, 7], [8, 9, 11], [0, 2, 9], [0, 1], [0, 8, 16],
                 [0, 1, 6]):
        assert np.array_equal(beam.rigid_motions(np.array(held)), beam.rigid_motions()[held])


@pytest.mark.parametrize("more", ["same", "opposite", "apart"])
def test_equations_that_share_coordinates_are_still_tried(more):
    scene = cantilever(ElementBeamCable(5), angle=0.6)
    if more == "apart":
        scene.joint("angle", at="right", angle=lambda t: 0.0)
        return scene.system.constraints.require_supports()
    scene.clamp((0.0, 0.0) if more == "same" else "left", thickness="free")
    with pytest.warns(ModelWarning, match="^1 of 2 equations of joints repeat"):
        state = scene.solve_static()
    one = cantilever(ElementBeamCable(5), angle=0.6).solve_static()
    np.testing.assert_allclose(state.u, one.u, rtol=0, atol=1e-10)


@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamANCFHermite(2, 5),
                                     ElementBeamCable(5)])
def test_values_alone_are_those_that_come_with_derivatives(element):
    X = np.random.default_rng(0).random((2, 5))
    for height in (0.1, lambda x: 0.1 - 0.02 * x):
        mesh = MeshBeam.init_line([0.0, 0.4, 1.0], height)
        for at, tind in ((X, None), (X, np.array([1])), (np.stack([X, X + 0.01], 1), None)):
            values = element.of_mesh(mesh.mapping(), at, tind)[0]
            assert np.array_equal(values, element.functions(mesh.mapping(), at, tind)[0])


@pytest.mark.parametrize("shape", ["line", "taper", "arc"])
def test_what_is_turned_inside_out_is_seen_by_determinants(shape):
    x, rng = np.linspace(0, 1, 4), np.random.default_rng(0)
    mesh = (MeshBeam.init_line(x, 0.1) if shape == "line" else
            MeshBeam.init_line(x, lambda s: 0.1 - 0.04 * s) if shape == "taper" else
            MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1.0 - np.cos(s)]), x, 0.1))
    beam = Beam(mesh, ElementBeamANCF(3), StVenantKirchhoff(2e9, 0.3), 0.01)
    kernel, found, (term,) = beam.kernel, set(), beam.terms
    points = product_rule(*((x, x) for x in (term.nodes("xy"), term.section_nodes)))[0]
    for size in np.geomspace(1e-3, 1.0, 12):
        u = size * rng.standard_normal(beam.N) * beam.sizes
        H, frame = beam.gradients(u, points)
        F = np.einsum("iJep,iKep->JKep", frame, H + frame)
        det = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
        found.add(kernel.inverted(u))
        assert kernel.inverted(u) == bool(np.any(det <= 0.0))
    assert found == {True, False}


def test_a_tapered_beam_has_slopes_of_its_height():
    X, step = np.array([[0.2, 0.7], [0.1, 0.9]]), 1e-30j
    element, h, rate = ElementBeamANCF(3), np.array([0.3, 0.2]), np.array([0.05, -0.1])
    _, d_xi, d_eta, _ = element.local(X, h, rate=rate)
    along = element.local(X + np.array([[step], [0.0]]), h + step * rate)[0]
    across = element.local(X + np.array([[0.0], [step]]), h)[0]
    assert np.allclose(along.imag / step.imag, d_xi, rtol=1e-12, atol=1e-14)
    assert np.allclose(across.imag / step.imag, d_eta, rtol=1e-12, atol=1e-14)


def test_straight_maps_are_those_of_the_general_formula():
    mesh = MeshBeam.init_line([0.0, 0.4, 1.0], 0.2, origin=(3.0, -1.0), angle=0.7)
    X = np.random.default_rng(0).random((2, 5))
    few = mesh.mapping()
    found = few.DF(X), few.frame(X), few.DF(X, np.array([1])), few.invDF(X)
    vars(few)["_constant"] = None  # as of a curve
    general = few.DF(X), few.frame(X), few.DF(X, np.array([1])), few.invDF(X)
    for a, b in zip(found, general):
        assert a.shape == b.shape and np.allclose(a, b, rtol=1e-13, atol=1e-13 * np.max(np.abs(b)))


def test_elements_of_other_points_share_nothing():
    X = np.array([[0.2, 0.7], [0.1, 0.9]])
    one, other = ElementBeamANCF(5), ElementBeamANCF(5, "equispaced")
    assert one.section == ElementBeamANCF(5).section != other.section
    assert not np.allclose(one.local(X, 0.1)[0], other.local(X, 0.1)[0])


def test_a_replaced_width_or_mesh_is_no_old_one():
    scene = cantilever(ElementBeamANCF(3), 8)
    force = scene.solve_static().beams[0].kernel.force
    u = 1e-3 * np.random.default_rng(0).standard_normal(scene.layout.N)
    wider, thicker = scene.replace(width=0.02), scene.replace(
        mesh=scene.beams[0].mesh.replace(height=0.011))
    assert np.allclose(wider.beams[0].kernel.force(u), 2.0 * force(u), rtol=1e-12)
    assert wider.beams[0].total_mass == pytest.approx(2.0 * scene.beams[0].total_mass)
    assert thicker.beams[0].total_mass == pytest.approx(1.1 * scene.beams[0].total_mass)
    assert thicker.beams[0].q0.shape == scene.beams[0].q0.shape
    assert -0.05 > thicker.solve_static().displacement((1, 0))[1] > (
        scene.solve_static().displacement((1, 0))[1])


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)])
def test_scenes_go_when_nobody_asks_for_them(element):
    """No circle of references is left for the garbage collection, which many scenes would wait for.
    """
    cantilever(element).solve_static()  # what is compiled keeps its callers for a while
    gc.collect()
    gc.disable()
    try:
        scene = cantilever(element)
        state = scene.solve_static()
        state.displacement((1.0, 0.0))
        gone = [ref(scene), ref(scene.system), ref(state)]
        changed = scene.replace(material=scene.beams[0].material.replace(E=3e9))
        del scene, state
        assert changed.solve_static().system.machine.tables.system is changed.system
        assert [x() for x in gone] == 3 * [None]
    finally:
        gc.enable()


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau", "gauss"])
@pytest.mark.parametrize("dt", [0.01, "auto"])
def test_scenes_go_after_motions(scheme, dt):
    """Nothing that a motion makes keeps its scene or its equations."""
    def moved(scene):
        return scene.integrate(0.05, dt, scheme=scheme, rtol=1e-2, t_eval=[0.013, 0.05])

    moved(cantilever(ElementBeamCable(5)))  # what is compiled keeps its callers for a while
    gc.collect()
    gc.disable()
    try:
        scene = cantilever(ElementBeamCable(5))
        scene.sensor("tip", "position", at=(1.0, 0.0))
        history = moved(scene)
        history.displacement((1.0, 0.0))
        assert np.array_equal(moved(scene).u, history.u)
        gone = [ref(x) for x in (scene, scene.system, history)]
        del scene, history
        assert [x() for x in gone] == len(gone) * [None]
    finally:
        gc.enable()


def same(a, b):
    """Solutions, and what is read of them, of scenes made in two ways."""
    x, y = a.solve_static(), b.solve_static()
    assert np.allclose(x.u, y.u, rtol=0, atol=1e-8) and x.iterations == y.iterations
    for read in (lambda s: s.reactions("left").force, lambda s: s.stress((0.3, 0.0)),
                 lambda s: s.strain_energy, lambda s: s.position((1.0, 0.0))):
        assert np.allclose(read(x), read(y), rtol=1e-5, atol=1e-8)
    assert np.allclose(a.modes(2).frequencies, b.modes(2).frequencies, rtol=1e-8)


@pytest.mark.parametrize("element", [lambda: ElementBeamANCF(2), lambda: ElementBeamCable(5)])
def test_replaced_scenes_are_those_built_anew(element):
    """One after the other from one scene, which stays what it was."""
    def weight(made, g=-9.81):
        return made.gravity((0.0, g))

    def pull(made):
        return made.point_force((0.0, 0.3), at=(1.0, 0.0))

    def anew(*add, E=2e9, width=0.01, density=7800.0):
        beam = Beam(scene.beams[0].mesh, element(), StVenantKirchhoff(E, 0.3, density), width=width)
        made = Scene(beam).clamp("left", thickness="free")
        for load in add:
            load(made)
        return made

    scene = cantilever(element())
    first = scene.solve_static().u
    material, force = scene.beams[0].material, PointForce((0.0, 0.3), at=(1.0, 0.0))
    pairs = [
        (dict(material=material.replace(E=3e9)), anew(weight, E=3e9)),
        (dict(width=0.02), anew(weight, width=0.02)),
        (dict(material=material.replace(density=5000.0)), anew(weight, density=5000.0)),
        (dict(loads=[force]), anew(pull)),
        (dict(loads=[Weight((0.0, -4.0)), force], material=material.replace(E=1e9)),
         anew(lambda made: weight(made, -4.0), pull, E=1e9)),
        (dict(loads=[EndMoment("right", 0.02, 0)]),
         anew(lambda made: made.moment("right", 0.02))),
        (dict(loads=[*scene.loads, force]), anew(weight, pull))]
    changed = [scene.replace(**changes) for changes, _ in pairs]
    for other, (_, expected) in reversed(list(zip(changed, pairs))):
        same(other, expected)
    assert np.array_equal(scene.solve_static().u, first)
    same(changed[0].replace(width=0.02).replace(loads=[force]), anew(pull, E=3e9, width=0.02))


def test_replaced_loads_and_laws_are_those_of_a_scene_built_anew():
    scene = cantilever(ElementBeamANCF(2))
    scene.solve_static()
    beam = scene.beams[0]
    pushed = scene.replace(loads=[Pressure("top", 50.0, beam)])
    other = Scene(beam).clamp("left", thickness="free").pressure("top", 50.0)
    assert np.allclose(pushed.solve_static().u, other.solve_static().u, atol=1e-9)
    soft = scene.replace(material=NeoHookean(2e9, 0.3, 7800.0))
    other = Scene(beam.replace(material=NeoHookean(2e9, 0.3, 7800.0)))
    other.clamp("left", thickness="free").gravity((0.0, -9.81))
    assert np.allclose(soft.solve_static().u, other.solve_static().u, atol=1e-9)
    for wrong in (2.0, [(0.0, -2.0)]):
        with pytest.raises(InputError, match="list of Loads"):
            scene.replace(loads=wrong)


def changed_at_random(rng, given):
    """One argument of a scene changed, and the arguments of the same scene built anew."""
    kind = rng.choice(["E", "nu", "density", "plane", "width", "weight", "force", "more", "pushed",
                       "mesh", "both"])
    x, given = float(rng.uniform(0.5, 1.5)), dict(given)
    material = given["material"]
    new = {"E": dict(E=2e9 * x), "nu": dict(nu=0.25 * x), "density": dict(density=5000.0 * x),
           "plane": dict(plane="strain" if material.plane == "stress" else "stress"),
           "both": dict(E=3e9 * x, density=4000.0 * x)}.get(kind)
    changes = {}
    if new is not None:
        changes["material"] = material.replace(**new)
    if kind in ("width", "both"):
        changes["width"] = 0.01 * x
    if kind == "mesh":
        nodes = np.linspace(0.0, 1.0, int(4.5 + x))
        nodes[1] += 0.05 * (x > 1.2)  # unequal elements
        changes["mesh"] = MeshBeam.init_line((0.9 + 0.1 * x) * nodes, 0.02 * x, angle=0.3 * x)
    tip = given["mesh"].p[:, -1]
    loads = {"weight": lambda beam: [Weight((0.4, -6.0 * x))],
             "force": lambda beam: [PointForce((0.1, -0.2 * x), at=tip)],
             "more": lambda beam: [Weight((0.0, -4.0)), PointForce((0.1, 0.2 * x), at=0.3 * tip)],
             "pushed": lambda beam: [Pressure("top", 20.0 * x, beam),
                                     EndMoment("right", 0.01 * x, beam)]}
    if kind in loads or kind == "mesh":  # where points are that were loaded, there may be none
        changes["loads"] = loads.get(kind, loads["weight"])
    return changes, {**given, **changes}


@pytest.mark.parametrize("element", [lambda: ElementBeamANCF(3), lambda: ElementBeamCable(3),
                                     lambda: ElementBeamCable(7)])
@pytest.mark.parametrize("seed", range(2))
def test_any_changes_one_after_the_other_are_a_scene_built_anew(element, seed):
    def built(mesh, material, width, loads):
        scene = Scene(Beam(mesh, element(), material, width)).clamp("left", thickness="free")
        for load in loads(scene.beams[0]):
            scene.add(load)
        return scene

    rng = np.random.default_rng(seed)
    given = dict(mesh=MeshBeam.init_line(np.linspace(0, 1, 5), 0.02, angle=0.3), width=0.01,
                 material=StVenantKirchhoff(2e9, 0.3, 7800.0), loads=lambda beam: [
                     Weight((0.0, -9.81))])
    scenes = [(built(**given), given)]
    for _ in range(8):
        scene, before = scenes[rng.integers(len(scenes))]
        if rng.random() < 0.7:
            scene.solve_static()
        changes, given = changed_at_random(rng, before)
        if "loads" in changes:
            changes["loads"] = given["loads"](scene.beams[0])
        scenes.append((scene.replace(**changes), given))
    for k in rng.permutation(len(scenes)):
        scene, given = scenes[k]
        a, b = scene.solve_static(), built(**given).solve_static()
        assert a.iterations == b.iterations and np.allclose(a.u, b.u, rtol=0, atol=1e-8)
        assert np.allclose(a.reactions("left").force, b.reactions("left").force, rtol=1e-6,
                           atol=1e-6)
        assert scene.beams[0].total_mass == pytest.approx(built(**given).beams[0].total_mass)
        assert a.strain_energy == pytest.approx(b.strain_energy, rel=1e-6)


def test_a_driven_motion_whose_function_fails_is_kept_up_to_there():
    def angle(t):
        if np.any(np.asarray(t) > 0.055):
            raise ValueError("no more")
        return 0.1 * t**2

    mesh = MeshBeam.init_line(np.linspace(0, 1, 3), height=0.02)
    scene = Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e8, 0.3, 7800.0), width=0.02))
    scene.pin("left").joint("angle", at="left", angle=angle)
    with pytest.raises(CallbackError, match=r"angle\(t=0.0[56]\d*\) raised V") as failure:
        scene.integrate(0.1, 0.01)
    assert np.allclose(failure.value.state.t, 0.01 * np.arange(6))


def test_masses_of_a_tapered_cable_ask_the_map_once(monkeypatch):
    mesh = MeshBeam.init_curve(lambda s: np.array([np.sin(s), 1.0 - np.cos(s)]),
                               np.linspace(0, 1, 4), lambda s: 0.12 - 0.04 * s)
    beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e7, 0.3, 7800.0), 0.01)
    asked = counted(monkeypatch, MappingBeam, "_derivatives")
    inertia = beam.masses
    assert len(asked) == 1
    X = np.array([points_along(beam) * [0.0], points_along(beam) * [0.5]])
    X[0] = gauss(X.shape[1])[0]
    slopes = beam.element.slopes(mesh.mapping(), X)[0][:, 0]
    assert np.allclose(inertia.slopes, slopes, rtol=1e-13, atol=1e-13 * np.abs(slopes).max())


#: Arguments of a Beam, some of each.
ARGUMENTS = {
    "mesh": [MeshBeam.init_line([0, 0.4, 1], 0.08), MeshBeam.init_line([0, 0.3, 0.6, 1], 0.06),
             MeshBeam.init_line([0, 0.5, 1], lambda x: 0.08 - 0.03 * x),
             MeshBeam.init_curve(lambda t: (t, 0.2 * t * (1 - t)), [0, 0.5, 1], 0.07)],
    "material": [StVenantKirchhoff(1e6, 0.3, 1000.0), StVenantKirchhoff(2e6, 0.0, 900.0),
                 StVenantKirchhoff(1e6, 0.3, 1000.0, plane="strain"), NeoHookean(1e6, 0.3, 1000.0)],
    "width": [0.05, 0.07, lambda x, y: 0.05 + 0.02 * x],
    "formulation": ["assumed", "continuum"],
    "damping": [None, KelvinVoigt(1e-2)],
    "element": [ElementBeamANCF(2), ElementBeamANCFCubic(2), ElementBeamCable(5)]}


@pytest.mark.parametrize("seed", range(8))
def test_any_argument_of_a_beam_is_replaced_as_if_made_so(seed):
    """Statics, stresses, frequencies and motions, with a spring, a follower or modal damping."""
    def scene(given):
        made = Scene(Beam(**given)).clamp("left", thickness="free").gravity((0.0, -1.0))
        tip = (1.0, 0.0)
        return [lambda: made.point_mass(0.1, at=tip),
                lambda: made.follower_force((0, -0.1), at=tip),
                lambda: made.damping(modal=[0.01, 0.02]),
                lambda: made.foundation(5.0)][seed % 4]()

    def found(made):
        state = made.solve_static()
        at = tuple(0.97 * made.beams[0].mesh.p[:, 1])
        return [state.u, [state.strain_energy], state.stress(at), state.stress(at, recover=False),
                np.abs(made.modes(2, state).frequencies), made.integrate(0.02, 0.005).u[-1]]

    rng = np.random.default_rng(seed)
    given = {name: values[0] for name, values in ARGUMENTS.items()}
    scenes = [(scene(given), given)]
    for _ in range(3):
        made, before = scenes[rng.integers(len(scenes))]
        if rng.random() < 0.7:
            found(made)
        names = rng.choice(list(ARGUMENTS), 2, replace=False)
        changes = {str(k): ARGUMENTS[k][rng.integers(len(ARGUMENTS[k]))] for k in names}
        given = {**before, **changes}
        if isinstance(given["element"], ElementBeamCable) and (
                given["formulation"] != "assumed" or isinstance(given["material"], NeoHookean)):
            continue  # which cables have not
        scenes.append((made.replace(**changes), given))
    for k in rng.permutation(len(scenes)):
        made, given = scenes[k]
        for a, b in zip(found(made), found(scene(given))):
            assert np.allclose(a, b, rtol=1e-7, atol=1e-7 * np.max(np.abs(b)))


@pytest.mark.parametrize("before, after", [
    (ElementBeamANCF(1), ElementBeamANCF(3)), (ElementBeamANCF(3), ElementBeamANCF(1)),
    (ElementBeamANCF(2), ElementBeamPatelShabana())], ids=repr)
def test_a_weld_holds_the_sections_of_another_element(before, after):
    def clamped(element):
        beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.1), element,
                    StVenantKirchhoff(1e6, 0.3, 1000.0), 0.1)
        return Scene(beam).clamp("left").gravity((0, -0.5))

    scene, anew = clamped(before).replace(element=after), clamped(after)
    assert np.allclose(scene.solve_static().u, anew.solve_static().u, rtol=1e-9, atol=1e-14)
    cable = ElementBeamCable(3)
    assert np.array_equal(scene.replace(element=cable).solve_static().u,
                          clamped(cable).solve_static().u)


@pytest.mark.parametrize("height", [0.01, 1e-4])
@pytest.mark.parametrize("hold", [
    lambda scene: scene.clamp("left"),
    lambda scene: scene.pin("left").add(OnLine((0.4, 0.3), (1.0, 0.2), through=(0.4, 0.301)))])
def test_what_joints_hold_at_an_angle(height, hold):
    mesh = MeshBeam.init_line(0.25 * np.arange(5), height, angle=np.arctan(0.75))
    scene = hold(Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e9, 0.3), width=0.01)))
    scene.point_force((0.0, -1e4 * height**3), at=tuple(mesh.p[:, -1]))
    system = scene.system
    found = scene.solve_static()
    assert found.iterations < 8
    rest = system.external_force(found.u) - system.internal_force(found.u)
    rest -= found.multipliers @ system.constraints.full_jacobian(found.u, 1.0)
    assert np.allclose(rest * system.constraints.mask, 0.0, rtol=0, atol=1e-3 * 1e4 * height**3)
    assert np.max(np.abs(system.constraints.constraint(found.u, 1.0))) < 1e-12


def test_a_first_solve_asks_its_joints_once(monkeypatch):
    scene = cantilever(ElementBeamCable(5), angle=0.6)
    asked = counted(monkeypatch, Joint, "slope_entries")
    for _ in range(2):
        scene.solve_static()
        assert len(asked) == len(scene.system.constraints.joints) > 0
