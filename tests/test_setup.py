"""What replaced scenes share, and what joints hold."""

import gc
from weakref import ref

import numpy as np
import pytest

from noise import alike
from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, KelvinVoigt, MeshBeam, NeoHookean, Scene,
                        StVenantKirchhoff)
from skfem_ancf.actions.joints import OnLine
from skfem_ancf.core.errors import ModelWarning


def cantilever(element, n=4, length=1.0, height=0.01, E=2e9, angle=0.0):
    mesh = MeshBeam.init_line(length * np.linspace(0, 1, n + 1), height=height, angle=angle)
    beam = Beam(mesh, element, StVenantKirchhoff(E, 0.3, 7800.0), width=0.01)
    return Scene(beam).clamp("left", thickness="free").gravity((0.0, -9.81))


@pytest.mark.parametrize("more", ["same", "opposite", "apart"])
def test_equations_that_share_coordinates_are_still_tried(more):
    scene = cantilever(ElementBeamCable(5), angle=0.6)
    if more == "apart":
        scene.joint("angle", at="right", angle=lambda t: 0.0)
        return scene.system.constraints.require_supports()
    scene.clamp((0.0, 0.0) if more == "same" else "left", thickness="free")
    with pytest.warns(ModelWarning, match="^1 of 2 equations of joints are redundant"):
        state = scene.solve_static()
    one = cantilever(ElementBeamCable(5), angle=0.6).solve_static()
    np.testing.assert_allclose(state.u, one.u, rtol=0, atol=1e-10)


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
        assert changed.solve_static().system.backend.tables.system is changed.system
        assert [x() for x in gone] == 3 * [None]
        mesh = ref(cantilever(element).solve_static().system.beams[0].mesh)
        assert mesh() is None
    finally:
        gc.enable()


def same(a, b):
    """Solutions, and what is read of them, of scenes made in two ways."""
    x, y = a.solve_static(), b.solve_static()
    assert np.allclose(x.u, y.u, rtol=0, atol=1e-8) and alike(x.iterations, y.iterations)
    for read in (lambda s: s.reactions("left").force, lambda s: s.stress((0.3, 0.0)),
                 lambda s: s.strain_energy, lambda s: s.position((1.0, 0.0))):
        assert np.allclose(read(x), read(y), rtol=1e-5, atol=1e-8)
    assert np.allclose(a.modes(2).frequencies, b.modes(2).frequencies, rtol=1e-8)


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
    assert found.iterations < 24
    rest = system.external_force(found.u) - system.internal_force(found.u)
    rest -= found.multipliers @ system.constraints.full_jacobian(found.u, 1.0)
    assert np.allclose(rest * system.constraints.mask, 0.0, rtol=0, atol=1e-3 * 1e4 * height**3)
    assert np.max(np.abs(system.constraints.constraint(found.u, 1.0))) < 1e-12
