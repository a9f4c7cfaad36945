"""Derivatives of states by parameters of a scene by object and name."""

import pickle

import numpy as np
import pytest
from scipy.optimize import least_squares

from skfem_ancf import (Beam, Circle, Design, ElementBeamANCF, ElementBeamCable, Frame, InputError,
                        MeshBeam, NameUnknown, Parameters, PointForce, RigidBody, Scene, Section,
                        Spring, StVenantKirchhoff, Temperature)

S = np.linspace(0, 1, 6)


def beam_of(E=2e6, height=0.05, width=0.02, element=None, **more):
    mesh = height if isinstance(height, MeshBeam) else MeshBeam.init_line(S, height)
    return Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(
        E, 0.3, 1000.0, thermal_expansion=1e-4), width=width, **more)


def tip(state):
    return state.displacement((1, 0))


def quotient(solve, x, step=1e-3):
    """Of whole solutions, of fourth order, for each component of x: (r, ...)."""
    x = np.array(x, dtype=float)
    out = []
    for k in range(x.size):
        h = step * (abs(x.flat[k]) or 1.0)
        parts = []
        for factor, weight in ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12)):
            y = x.copy()
            y.flat[k] += factor * h
            parts.append(weight / h * np.ravel(solve(y if y.ndim else float(y))))
        out.append(sum(parts))
    return np.array(out).T.reshape(-1, *x.shape)


def close(found, expected, rtol=1e-6):
    assert found.shape == expected.shape or found.shape == expected.shape[1:]
    assert np.allclose(found, expected, rtol=rtol, atol=rtol * np.abs(expected).max() + 1e-11), (
        found / expected)


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)])
def test_numbers_by_object_and_name(element):
    def solve(E=2e6, nu=0.3, height=0.05, width=0.02, force=(0.1, -0.8), k=3.0, T=20.0, g=1.0):
        mesh = MeshBeam.init_line(S, height)
        beam = Beam(mesh, element, StVenantKirchhoff(E, nu, 1000.0, thermal_expansion=1e-4),
                    width=width)
        load, spring = PointForce(force, at=(1, 0)), Spring(k, ((0.6, 0), ("ground", (0.6, 0.5))))
        scene = Scene(beam).clamp("left").add(load).add(spring).add(Temperature(T))
        scene.gravity((0, -g))
        return scene, (beam, load, spring)

    scene, (beam, load, spring) = solve()
    state = scene.solve_static()
    wrt = [(beam, "E"), (beam.material, "nu"), (beam, "height"), (beam, "width"), (load, "force"),
           (spring, "k")]
    for name, found in zip(("E", "nu", "height", "width", "force", "k"),
                           state.gradient(tip, wrt)):
        start = {"E": 2e6, "nu": 0.3, "height": 0.05, "width": 0.02, "force": (0.1, -0.8),
                 "k": 3.0}[name]
        close(found, quotient(lambda x: tip(solve(**{name: x})[0].solve_static()), start))
    energy, = state.gradient(lambda s: s.strain_energy, [(beam, "E")])
    assert energy.shape == ()
    close(energy, quotient(lambda x: solve(E=x)[0].solve_static().strain_energy, 2e6))
    u, = state.sensitivity([(load, "force")])
    assert u.shape == (scene.N, 2)
    close(u, quotient(lambda x: solve(force=x)[0].solve_static().u, (0.1, -0.8)))


@pytest.mark.parametrize("field", ["nodes", "elements"])
def test_fields_of_a_beam(field):
    """Heights, moduli and widths at nodes or in elements, against whole solutions."""
    def solve(name, x):
        s = S if field == "nodes" else 0.5 * (S[1:] + S[:-1])

        def function(at, *_):
            if field == "nodes":
                return np.interp(at, s, x)
            return np.asarray(x)[np.clip(np.searchsorted(S, at) - 1, 0, len(x) - 1)]

        more = {name: function if np.ndim(x) else x}
        scene = Scene(beam_of(**more)).clamp("left").gravity((0, -3.0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    n = len(S) - (field == "elements")
    for name, value in (("height", 0.05), ("E", 2e6), ("width", 0.02)):
        if (name, field) == ("height", "elements"):
            continue  # heights that jump are no function: see below
        scene = solve(name, value)
        for J in ("tip", lambda s: s.strain_energy):
            found, = scene.solve_static().gradient(J, [(scene.beams[0], name, field)])
            close(found, quotient(lambda x: tip(solve(name, x).solve_static()) if J == "tip" else
                                  solve(name, x).solve_static().strain_energy,
                                  np.full(n, value)))


def test_heights_by_element():
    """The sum of all is the derivative by a common height; one counts its own bending."""
    scene = Scene(beam_of(element=ElementBeamCable(5))).clamp("left").point_force(
        (0, -1e-3), at=(1, 0))
    beam = scene.beams[0]
    each, whole = scene.solve_static().gradient(lambda s: tip(s)[1], [
        (beam, "height", "elements"), (beam, "height")])
    assert np.isclose(each.sum(), whole, rtol=1e-6)
    a, b = S[:-1], S[1:]
    bending = ((1 - a)**3 - (1 - b)**3)
    assert np.allclose(each / each.sum(), bending, rtol=1e-4)


def test_modulus_of_each_element_from_a_noisy_axis():
    """A weak spot is found from displacements with noise; the tip carries no moment."""
    n = 100
    x, mid = np.linspace(0, 1, n + 1), (np.arange(n) + 0.5) / n
    true = 2e9 * (1 - 0.4 * np.exp(-((mid - 0.35) / 0.12)**2))

    def solved(E):
        beam = Beam(MeshBeam.init_line(x, 0.02), ElementBeamCable(5), StVenantKirchhoff(
            lambda X, Y: E[np.clip((X * n).astype(int), 0, n - 1)], 0.3), 0.02)
        scene = Scene(beam).clamp("left").point_force((0, -20.0), at=(1, 0))
        return scene.sensor("axis", "displacement", at=np.array([x[1:], 0 * x[1:]]))

    measured = solved(true).solve_static().displacement(np.array([x[1:], 0 * x[1:]]))[1]
    measured = measured + 2e-5 * np.random.default_rng(1).standard_normal(n)
    smooth = np.diff(np.eye(n), 2, axis=0) * 0.003
    scene = solved(true).replace(material=StVenantKirchhoff(2e9, 0.3))
    design = Design(Parameters(scene, [(scene.beams[0], "E", "elements")]), ["axis"])

    def rest(p):
        return np.append(design.values(2e9 * np.exp(p))[n:] - measured, smooth @ p)

    def jacobian(p):
        return np.vstack([design.jacobian(2e9 * np.exp(p))[n:] * 2e9 * np.exp(p), smooth])

    found = least_squares(rest, np.zeros(n), jacobian, max_nfev=30)
    E = 2e9 * np.exp(found.x)
    assert np.all(np.abs(E / true - 1)[mid < 0.7] < 0.03)
    assert np.isclose(np.sqrt(np.mean(found.fun[:n]**2)), 2e-5, rtol=0.3)  # the noise is left


def test_a_gradient_of_many_heights_needs_few_scenes(monkeypatch):
    x = np.linspace(0, 1, 81)
    beam = Beam(MeshBeam.init_line(x, 0.02), ElementBeamANCF(2), StVenantKirchhoff(2e9, 0.3), 0.02)
    scene = Scene(beam).clamp("left").point_force((0, -3.0), at=(1, 0))
    state = scene.sensor("tip", "displacement", at=(1, 0)).solve_static()
    built, whole = [], type(scene)._rebuilt
    monkeypatch.setattr(type(scene), "_rebuilt", lambda *a: built.append(1) or whole(*a))
    found, = state.gradient("tip", [(beam, "height", "nodes")])
    assert found.shape == (2, 81) and len(built) < 20
    total, = state.gradient("tip", [(beam, "height")])
    assert np.allclose(found.sum(axis=1), total, rtol=1e-6)


def test_bodies_shapes_materials_and_frames():
    def solve(mass, radius, E):
        law = StVenantKirchhoff(E, 0.3, 1000.0)
        beam = Beam(MeshBeam.init_line(S, 0.05), ElementBeamANCF(2), law, width=0.03, name="beam")
        body = RigidBody(mass=mass, inertia=0.1, position=(1, 0))
        scene = Scene(beam, body).clamp("left", "beam")
        scene.weld(("beam", "right"), body)
        shape = Circle((0.5, -0.255), radius)
        scene.gravity((0, -9.81), body).obstacle(shape, stiffness=1e4)
        return scene, (body, shape, law)

    p = [3.0, 0.23, 2e8]
    scene, (body, shape, law) = solve(*p)
    state = scene.solve_static()
    assert np.any(state.contact().force)
    found = state.gradient(lambda s: s.displacement(s.bodies[0]), [
        (body, "mass"), (shape, "radius"), (law, "E")])

    def end(k, x):
        scene, (body, *_) = solve(*[x if i == k else y for i, y in enumerate(p)])
        return scene.solve_static().displacement(body)

    for k, one in enumerate(found):
        close(one, quotient(lambda x, k=k: end(k, x), p[k], 2e-5), rtol=2e-4)

    frame = Frame.from_lines([(0, 0), (0, 1), (1, 1), (1, 0)], [(0, 1), (1, 2), (2, 3)], elements=2,
                             material=StVenantKirchhoff(2e9, 0.3), height=0.02, width=0.02)
    frame.clamp([0, 3]).point_force((5.0, -20.0), at=(1.0, 1.0))
    by_E, = frame.solve_static().gradient(lambda s: s.strain_energy, [(frame.beams[0], "E")])
    other = frame.replace(material=StVenantKirchhoff(2e9 * (1 + 1e-5), 0.3)).solve_static()
    change = other.strain_energy - frame.solve_static().strain_energy
    assert np.isclose(by_E, change / 2e4, rtol=1e-3)


def test_one_beam_of_several_with_the_same_material():
    material = StVenantKirchhoff(2e6, 0.3, 1000.0)
    a, b = (Beam(MeshBeam.init_line(S, 0.05, origin=(x, 0)), ElementBeamANCF(2), material,
                 width=0.02) for x in (0.0, 1.0))
    scene = Scene(a, b).clamp("left", a)
    scene.weld((a, "right"), (b, "left"))
    state = scene.gravity((0, -1.0)).solve_static()

    def end(state):
        return state.displacement((2, 0), 1)[1]

    one, two, both = state.gradient(end, [(a, "E"), (b, "E"), (material, "E")])
    assert np.isclose(one + two, both, rtol=1e-6) and one > 2.0 * two > 0.0


def test_what_is_not_a_parameter_is_said():
    beam, load = beam_of(), PointForce((0, -1.0), at=(1, 0))
    scene = Scene(beam).clamp("left").add(load)
    state, profile = scene.solve_static(), beam_of(width=None, section=Section.profile(
        "I", width=0.03, web=0.004, flange=0.005))
    for wrt, match in (([(beam, "stiffness")], "no argument 'stiffness'"), ([beam], "wrt must be"),
                       ([(beam_of(), "E")], "no part of the scene"),
                       ([(load, "amplitude")], "no argument"),
                       ([(profile.section, "web")], "no argument 'web'"),
                       ([(load, "height", "nodes")], "fields are of beams")):
        with pytest.raises(InputError, match=match):
            state.gradient(tip, wrt)
    with pytest.raises(NameUnknown, match="field of a beam"):
        state.gradient(tip, [(beam, "nu", "nodes")])
    with pytest.raises(InputError, match="linear"):
        scene.solve_linear().gradient(tip, [(beam, "E")])
    with pytest.raises(InputError, match="does not know its scene"):
        pickle.loads(pickle.dumps(state)).gradient(tip, [(beam, "E")])


def test_a_state_has_the_derivatives_of_its_own_scene():
    """What is added to the scene after the solution does not act on the state."""
    beam = beam_of()
    scene = Scene(beam).clamp("left").point_force((0, -1.0), at=(1, 0))
    state = scene.solve_static()
    by_E = state.gradient(tip, [(beam, "E")])[0][1]
    scene.point_force((0, -1.0), at=(1, 0))
    np.testing.assert_allclose(state.gradient(tip, [(beam, "E")])[0][1], by_E, rtol=1e-9)
    twice = scene.solve_static().gradient(tip, [(beam, "E")])[0][1]
    assert abs(twice - by_E) > 0.1 * abs(by_E)
