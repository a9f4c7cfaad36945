"""Attributes that there are not, by names of other packages: the error says what is meant."""

import copy
import pickle

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, InputError, MeshBeam,
                        RigidBody, Scene, StVenantKirchhoff)
from skfem_ancf.core import FileError, MeshError, refuse, refuse_any, retold
from skfem_ancf.core.errors import SYNONYMS, NearMisses

STEEL = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)


@pytest.fixture(scope="module")
def things():
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.05), ElementBeamCable(3), STEEL, 0.05)
    scene = Scene(beam).clamp("left").gravity((0, -9.81))
    frame = Frame.from_lines([(0, 0), (0, 1)], [(0, 1)], height=0.1, width=0.1, material=STEEL)
    return {"Scene": scene, "State": scene.solve_static(), "MeshBeam": beam.mesh, "Frame": frame,
            "History": scene.integrate(0.002, 0.001), "Modes": scene.modes(1),
            "Path": scene.continuation(steps=1)}


@pytest.mark.parametrize("kind, names, right", [
    ("Scene", "solve run_static solve_statc", "solve_static"),
    ("Scene", "add_force force point_forces", "point_force"),
    ("Scene", "fixed support", "clamp"),
    ("Scene", "support", "clamp or pin or fix"),
    ("Scene", "load_case", "replace(loads=...)"),
    ("Scene", "eigenvalues eigenfrequencies", "modes"),
    ("Scene", "buckle", "buckling"),
    ("Scene", "simulate transient", "integrate"),
    ("Scene", "plot_deformed", "solve_static().plot"),
    ("Scene", "displacement", "solve_static().displacement"),
    ("Frame", "solve", "solve_static"),
    ("Frame", "node", "nodes"),
    ("State", "deflection displacements", "displacement"),
    ("State", "bending_moment", "resultants"),
    ("History", "time", "t"),
    ("History", "movie", "animate"),
    ("Path", "load_factors", "load"),
    ("Modes", "omega", "frequencies"),
    ("MeshBeam", "refine", "refined"),
    ("MeshBeam", "nodes", "p"),
])
def test_near_misses_name_what_is_meant(things, kind, names, right):
    for name in names.split():
        with pytest.raises(AttributeError) as error:
            getattr(things[kind], name)
        assert str(error.value).startswith(
            f"{kind} has no attribute '{name}'; did you mean {right}")


def test_what_is_suggested_is_there(things):
    """Each entry of the table names an attribute of one of the objects, and has synonyms."""
    there = {name for thing in things.values() for name in dir(thing)}
    for key, *words in map(str.split, SYNONYMS.split(";")):
        of_state = key.removeprefix("solve_static().")
        assert of_state.partition(".")[0].partition("(")[0] in there, key
        assert words and words == [word.lower() for word in words], key


def test_a_refusal_shows_values_on_one_short_line():
    refuse(False, "{!r} {:d}", object())  # a message that is not needed is not made
    with pytest.raises(MeshError) as error:
        refuse(True, "x of {!r} is {:.2f}, not {}", list(range(1000)), 0.125, "a b",
               error=MeshError)
    text = str(error.value)
    assert text.startswith("x of [0, 1, 2, ") and text.endswith("... is 0.12, not a b")
    assert len(text) < 120
    with pytest.raises(InputError, match="^give {'a': 1}$"):
        refuse(True, "give {'a': 1}")


def test_a_refusal_names_the_first_wrong_entry():
    x = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    refuse_any(x[0] < 0.0, "{k} {:d}", object())
    with pytest.raises(MeshError, match=r"^entry 1 of 3 is at \(1.0, 4.0\), \[1.0, 4.0\], not 7$"):
        refuse_any(x[0] > 0.5, "entry {k} of {} is at {:.1f}, {}, not {}", 3, x, x,
                   np.array([6, 7, 8]), error=MeshError)
    refuse([], "the first is {[0]}", [])  # there is none
    with pytest.raises(InputError, match="^the first is 5$"):
        refuse([5], "the first is {[0]}", [5])


def test_errors_are_told_in_other_words():
    with pytest.raises(MeshError, match=r"^'a' is no number: could not convert .*'a'$"), (
            retold(ValueError, "{!r} is no number: {error}", "a", error=MeshError)):
        float("a")
    with pytest.raises(KeyError), retold(ValueError, "{error}"):
        {}["a"]
    with pytest.raises(FileError, match="^once$"), retold(OSError, "again: {error}"):
        raise FileError("once")


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)])
def test_a_beam_is_probed_at_a_named_end(element):
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.05), element, STEEL, 0.05)
    for one, other in zip(beam.probe("right"), beam.probe((1.0, 0.0))):
        assert np.array_equal(one, other)


def test_what_is_like_nothing_is_just_said(things):
    with pytest.raises(AttributeError, match="^State has no attribute 'zzzz'$"):
        things["State"].zzzz
    assert getattr(things["Scene"], "solve", None) is None


@pytest.mark.parametrize("kind", ["Scene", "Frame", "State", "MeshBeam"])
def test_copies_and_pickles(things, kind):
    one = things[kind]
    for other in (copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
        assert type(other) is type(one)


def test_a_property_that_fails_says_so_itself():
    class Thing(NearMisses):
        @property
        def broken(self):
            return np.nothing

    with pytest.raises(AttributeError, match="numpy"):
        Thing().broken


def test_constructors_and_methods_that_add_items_name_their_arguments(things):
    for call, message in (
            (lambda: StVenantKirchhoff(E=1.0, nu=0.3, densty=1.0), "did you mean 'density'"),
            (lambda: RigidBody(1.0, 1.0, center=(0, 0)), "RigidBody has no option 'center'; known: "
             "'mass', 'inertia', 'position', "),
            (lambda: things["Scene"].point_force((0, 1), position=(1, 0)), "known: 'force', 'at'"),
            (lambda: Beam(things["MeshBeam"], ElementBeamCable(3), STEEL, with_=1), "'width'")):
        with pytest.raises(TypeError, match=message):
            call()
    with pytest.raises(InputError, match=r"'y'; known: .* did you mean 'r\^2'\?"):
        things["Scene"].fix("right", "y")
    with pytest.raises(InputError, match="'load'; known: 'loads', 'beams', 'mesh', .*'loads'"):
        things["Scene"].replace(load=[])
