"""All that acts, of the package and of a user's, through every solver."""

import copy
import inspect
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse
from skfem import LinearForm

from skfem_ancf import (Beam, Circle, ElasticPlastic, ElementBeamANCF, ElementBeamCable, Energy,
                        FormLoad, InputError, Item, MeshBeam, PointMass, Prony, Scene, Spring,
                        StVenantKirchhoff, sweep)
from skfem_ancf.actions.bound import BoundConstraint
from skfem_ancf.actions.forces import ForceElement, point
from skfem_ancf.actions.joints import JOINTS, Joint, Motor
from skfem_ancf.dynamics import SCHEMES
from skfem_ancf.scene.model import Model

#: What a scene has a method for, and joints by name.
ITEMS = {**{name: method.item for name, method in vars(Model).items() if hasattr(method, "item")},
         "motor": Motor, **JOINTS}
# the two beams of "contact" overlap, with nothing between them
pytestmark = pytest.mark.filterwarnings("ignore:beam 0 meets beam 1 .* nothing joins them")

MATERIAL = StVenantKirchhoff(2e7, 0.3, 1000.0, thermal_expansion=1e-5)


def ramp(t):
    return 0.02 * np.asarray(t) ** 2


def rising(t):
    return np.array([1.0 + 0.0 * np.asarray(t), ramp(t)])


def law(t, tip):
    return 0.1 - 2.0 * tip.position - 0.1 * tip.velocity


@LinearForm
def upwards(v, w):
    return 100.0 * v[1]


def bedding(r, F, X, t):
    return 500.0 * np.sum((r - X) ** 2, axis=0)


#: Arguments of each item on the first of two beams that overlap from (0.5, 0) to (1, 0).
ARGUMENTS = {
    "clamp": ("right", 0), "pin": ("right", 0), "fix": ("right", "r^2", 0.0, 0),
    "motor": ((0, "right"), ramp), "gravity": ((0.0, -9.81),),
    "point_force": ((0.0, 1.0), (1.0, 0.0), 0), "follower_force": ((0.0, 1.0), (1.0, 0.0), 0),
    "line_load": ((0.0, 1.0), 0), "traction": ("top", (0.0, 10.0), 0), "pressure": ("top", 10.0, 0),
    "temperature": (10.0, 0), "eigenstrain": (1e-4, None, None, 0), "moment": ("right", 0.1, 0),
    "load": (upwards, None, 0), "energy": (bedding, None, None, "cells", 0),
    "spring": (50.0, ((0, (1.0, 0.0)), (1.0, 1.0)), 1.0),
    "torsional_spring": (1.0, "right", 0.1, 0), "control": (law, (0, (1.0, 0.0)), "force", None,
                                                            {"tip": (0, (1.0, 0.0))}),
    "foundation": (1e3, "bottom", False, 1.0, 0), "drag": (1.0, 1.0, 0.1),
    "point_mass": (0.5, (1.0, 0.0), 0.01, 0), "obstacle": (Circle((1.0, -0.2), 0.14),),
    "contact": (0, 1),
    "hinge": ((0, 1), (1.0, 0.0)), "weld": ((0, 1), (1.0, 0.0)),
    "line": ((1.0, 0.0), (1.0, 0.5), 0), "circle": ((1.0, 0.0), (1.0, -1.0), 0),
    "position": ((1.0, 0.0), rising, 0), "angle": ("right", ramp, 0),
    "turn": ((0, "right"), (1, "left"), ramp), "plane": ("right", 0),
    "sleeve": ((0, (1.0, 0.0)), 1), "slot": ((0, (1.0, 0.0)), "ground", (1.0, 0.2)),
}


class Tip(Item):
    """On the end of the first beam; perhaps all degrees of freedom are named."""

    named = True

    def bind(self, layout):
        bound = super().bind(layout)
        bound.r = point(layout, 0, (1.0, 0.0))
        if self.named:
            bound.dofs = bound.r.dofs
        return bound

    def way(self, u):
        return self.r(u) - self.r.start


class Quartic(Tip):
    def energy(self, u, t):
        d = self.way(u)
        return 30.0 * (d @ d) + 500.0 * (d @ d) ** 2


class Everywhere(Quartic):
    named = False


class QuarticPoint(ForceElement):
    """The same on a point, by its potential alone."""

    def bind(self, scene):
        return [point(scene, 0, (1.0, 0.0))]

    def potential(self, x):
        d = x[0] - np.array([1.0, 0.0])
        return 30.0 * (d @ d) + 500.0 * (d @ d) ** 2


class Forced(Tip):
    """Its force alone."""

    def force(self, u, v, t):
        d = self.way(u)
        f = -(60.0 + 2000.0 * (d @ d)) * d
        return f[0] * self.r.row((1.0, 0.0), len(u)) + f[1] * self.r.row((0.0, 1.0), len(u))


class Pull(Tip):
    """The same by its force and derivatives, with a dashpot; t is the load factor in statics."""

    def force(self, u, v, t):
        d = self.way(u)
        out = np.zeros(u.shape, dtype=np.result_type(u, v))
        for k, f in enumerate(-(60.0 + 2000.0 * (d @ d)) * d + t * np.array([0.0, 0.5])
                              - self.way(v)):
            out[self.r.dofs[k]] += f * self.r.weights[k]
        return out

    def stiffness(self, u, v, t):
        d = self.way(u)
        K = -(60.0 + 2000.0 * (d @ d)) * np.eye(2) - 4000.0 * np.outer(d, d)
        rows = np.array([self.r.row(e, len(u)) for e in np.eye(2)])
        return rows.T @ K @ rows


class Bob(Tip):
    def bind(self, layout):
        bound = super().bind(layout)
        bound.rows = np.array([bound.r.row(e, layout.N) for e in np.eye(2)])
        return bound

    def mass(self):
        return 0.5 * self.rows.T @ self.rows


class Rail(Tip):
    """The end stays on a parabola."""

    moving = False

    def constraint(self, u, t):
        x, y = self.way(u)
        return np.array([y - 0.3 * x * x])


class Lift(Tip):
    """The end is raised by a function of time."""

    def constraint(self, u, t):
        return np.array([self.way(u)[1] - ramp(t)])

    def jacobian(self, u, t):
        return self.r.row((0.0, 1.0), len(u))[None]


@LinearForm
def across(v, w):
    """A force that turns with the axis."""
    return 100.0 * (w.F[0, 0] * v[1] - w.F[1, 0] * v[0])


class Slip(Tip):
    """A spring of the end that slips, with a sparse stiffness; its history is its slip."""

    symmetric, k, most = False, 30.0, 0.05

    def start(self):
        return np.zeros(2)

    def trial(self, u, history):
        f = -self.k * (self.way(u) - history)
        return f, max(1.0, np.sqrt(f @ f) / self.most)

    def evaluate(self, u, v, t, history, dt):
        f, beyond = self.trial(u, history)
        rows = np.array([self.r.row(e, len(u)) for e in np.eye(2)])
        return f / beyond @ rows, self.way(u) + f / beyond / self.k

    def stiffness(self, u, v, t, history, dt):
        f, beyond = self.trial(u, history)
        K = -self.k / beyond * (np.eye(2) - (beyond > 1.0) * np.outer(f, f) / (f @ f + 1e-300))
        rows = np.array([self.r.row(e, len(u)) for e in np.eye(2)])
        return sparse.csr_array(rows.T @ K @ rows)

    def energy(self, u, history):
        d = self.way(u) - history
        return 0.5 * self.k * (d @ d)


class DragRail(Joint):
    """The end moves along x only, given by the equation alone, with dry friction: one class."""

    equations = ("height",)
    symmetric, k, most = False, 1e4, 0.05

    def __init__(self, at=(1.0, 0.0)):
        self.at = at

    def bind(self, layout):
        self.r = point(layout, 0, self.at)
        self.dofs = self.r.dofs

    def value(self, u, t):
        return np.array([self.r(u)[1] - self.at[1]])

    def start(self):
        return np.zeros(1)

    def evaluate(self, u, v, t, history, dt):
        way = self.r(u)[0] - self.at[0]
        pull = np.clip(self.k * (way - history[0]), -self.most, self.most)
        return -pull * self.r.row((1.0, 0.0), len(u)), np.array([way - pull / self.k])

    def energy(self, u, history):
        return 0.5 * self.k * (self.r(u)[0] - self.at[0] - history[0]) ** 2


class Feeler(Tip):
    """The end clings to whichever point of the other beam is nearest, and slips along y, with a
    dashpot, a mass and a path that moves: of all that an item may have something."""

    symmetric, k, most, c = False, 40.0, 0.3, 0.5

    def bind(self, layout):
        bound, unit = super().bind(layout), (0.0, 1.0)
        others = [point(layout, 1, (x, 0.0)) for x in np.linspace(0.5, 1.5, 7)]
        bound.others, bound.up = others, bound.r.row(unit, layout.N)
        bound.gaps = np.array([bound.up - one.row(unit, layout.N) for one in others])
        bound.dofs = np.unique(np.concatenate([one.dofs.ravel() for one in (bound.r, *others)]))
        return bound

    def gap(self, u):
        far = [np.sum((self.r(u) - one(u)) ** 2) for one in self.others]
        return self.gaps[np.argmin(np.real(far))]

    def start(self):
        return np.zeros(1)

    def evaluate(self, u, v, t, history, dt):
        row = self.gap(u)
        f = -self.k * (row @ u - history[0])
        f = f / max(1.0, abs(np.real(f)) / self.most)
        return (f - self.c * (row @ v)) * row, np.array([row @ u + f / self.k])

    def stiffness(self, u, v, t, history, dt):
        row = sparse.csr_array(self.gap(u)[None])
        sticks = abs(self.k * ((row @ u)[0] - history[0])) < self.most
        return -self.k * sticks * (row.T @ row)

    def damping(self, u, v, t, history, dt):
        row = sparse.csr_array(self.gap(u)[None])
        return -self.c * (row.T @ row)

    def energy(self, u, history):
        return 0.5 * self.k * (self.gap(u) @ u - history[0]) ** 2

    def mass(self):
        return 0.2 * sum(np.outer(row, row) for row in (
            self.up, self.r.row((1.0, 0.0), len(self.up))))

    def constraint(self, u, t):
        x, y = self.way(u)
        return np.array([x + 0.3 * y * y - 1e-4 * t])


def unscaled():
    return Energy(bedding, beam=0, scaled=False)


def following():
    return FormLoad(across, beam=0)


CUSTOM = (Quartic, Pull, Slip, Bob, Rail, Lift, DragRail, Feeler, unscaled, following)


def item_of(name):
    return ITEMS[name](*ARGUMENTS[name]) if name in ITEMS else name()


def bare(n=2, material=MATERIAL):
    """Two beams, the first clamped at its left end, the second at its right end."""
    beams = [Beam(MeshBeam.init_line(x + np.linspace(0.0, 1.0, n + 1), height=0.1),
                  ElementBeamANCF(2), material, width=0.1) for x in (0.0, 0.5)]
    return Scene(*beams).clamp("left", 0).clamp("right", 1)


def through(item):
    """What all solvers make of a scene with the item."""
    return bare().gravity((0.0, -1.0)).add(item)


def test_every_item_has_arguments_here():
    assert set(ARGUMENTS) == set(ITEMS)


@pytest.mark.parametrize("name", [*ITEMS, *CUSTOM])
def test_items_through_all_solvers(name):
    scene = through(item_of(name))
    state = scene.solve_static()
    assert state.converged and str(state.verdict).startswith("stable")
    assert np.abs(scene.system.constraints.constraint(state.u, 1.0)).max(initial=0.0) < 1e-9
    assert np.all(scene.modes(2, state).frequencies > 0)
    path = scene.continuation(max_load=1.0, ds=0.5)
    assert_allclose(path.u[-1], state.u, rtol=0, atol=1e-6)
    assert path.stable[-1] is not False
    for scheme in SCHEMES:
        try:
            history = scene.integrate(2e-3, 1e-3, scheme=scheme)
        except InputError as error:  # of damping, of joints that move
            known = ("energy-momentum-4", "gauss", *["radau"] * bool(scene.system.forces.changing))
            assert scheme in known and " use '" in str(error)
            continue
        assert len(history) == 3 and np.all(np.isfinite(history.total_energy))
        last = scheme
    again = scene.integrate(2e-3, 1e-3, scheme=last, start=history.state(1), t_start=1e-3)
    assert_allclose(again.u[-1], history.u[-1], rtol=0, atol=1e-9)


#: Laws with a history, one of which yields under the weight.
HISTORIES = {"plastic": ElasticPlastic(2e7, 0.3, 2e3, 1e6, 1e6, 1000.0, points=4),
             "polymer": Prony(StVenantKirchhoff(2e7, 0.3, 1000.0), [0.3], [0.01])}


@pytest.mark.parametrize("law", HISTORIES)
@pytest.mark.parametrize("name", [n for n in [*ITEMS, *CUSTOM]
                                  if n not in ("temperature", "eigenstrain")])
def test_items_on_materials_with_a_history(name, law):
    """Runs and motions go on from a state, its pickle and its copy; what is dissipated grows."""
    scene = bare(material=HISTORIES[law]).gravity((0.0, -9.81)).add(item_of(name))
    run = scene.run([0.5, 1.0], increments=2)
    assert np.all(np.diff(run.dissipated) >= -1e-12) and np.any(run.state(2).memory)
    state = run.state(2)
    for one in (state, copy.copy(state), pickle.loads(pickle.dumps(state))):
        again = scene.run(1.0, increments=2, start=one)
        assert_allclose(again.u[-1], run.u[-1], rtol=0, atol=1e-6)
        assert_allclose(again.state(0).memory, state.memory, rtol=1e-5,
                        atol=1e-5 * max(1.0, np.abs(state.memory).max()))
    assert np.all(scene.modes(2, state).frequencies > 0)
    for scheme in ("generalized-alpha", "energy-momentum"):
        history = scene.integrate(2e-3, 1e-3, scheme=scheme)
        again = scene.integrate(2e-3, 1e-3, scheme=scheme, start=history.state(1), t_start=1e-3)
        assert_allclose(again.u[-1], history.u[-1], rtol=0, atol=1e-9)
        assert history.dissipated[-1] > history.dissipated[0] - 1e-12


@pytest.mark.parametrize("name", [*ITEMS, *CUSTOM])
def test_items_are_kept_and_put_on_other_meshes(name):
    scene = through(item_of(name))
    known = scene.solve_linear() if name != "obstacle" else scene.solve_static()
    for other in (copy.copy(scene), pickle.loads(pickle.dumps(scene))):
        solve = other.solve_linear if name != "obstacle" else other.solve_static
        assert np.array_equal(solve().u, known.u)
    finer = scene.replace(beams=[b.replace(mesh=b.mesh.refined()) for b in scene.beams])
    assert [type(one) for one in finer.items] == [type(one) for one in scene.items]
    coarse, fine = (s.solve_static().position((1.0, 0.0), 0) for s in (scene, finer))
    assert_allclose(fine, coarse, rtol=0, atol=1e-2)
    scene.state().plot("displacement")


@pytest.mark.parametrize("name", ITEMS)
def test_methods_of_a_scene_add_items(name):
    added, method = through(item_of(name)), bare().gravity((0.0, -1.0))
    if hasattr(Scene, name) and name not in ("hinge", "weld"):
        getattr(method, name)(*ARGUMENTS[name])
        names = list(inspect.signature(getattr(Scene, name)).parameters)[1:]
        assert names == list(inspect.signature(ITEMS[name]).parameters)
    else:
        arguments = zip(inspect.signature(ITEMS[name]).parameters, ARGUMENTS[name])
        method.joint(name, **dict(arguments))
    assert np.array_equal(added.solve_static().u, method.solve_static().u)
    assert repr(added.items[-1]) == repr(method.items[-1])


def pulled(load):
    return bare().add(Quartic()).point_force((0.0, load), at=(1.0, 0.0), beam=0).solve_static()


def measured(state):
    return state.displacement((1.0, 0.0), 0)[1]


def test_a_sweep_of_a_custom_item():
    found = sweep(pulled, {"load": [1.0, 2.0]}, measured)
    assert not found.failures and 1.5 < found["value"][1] / found["value"][0] < 2.0


def test_an_energy_and_its_force_are_one():
    """By differences of the energy, by the force alone, and with its stiffness."""
    scenes = [bare().gravity((0.0, -9.81)).add(item) for item in (
        Quartic(), Everywhere(), Forced(), QuarticPoint())]
    known = scenes[0].solve_static()
    for scene in scenes[1:]:
        assert_allclose(scene.solve_static().u, known.u, rtol=0, atol=1e-9)
    history = scenes[0].integrate(0.02, 1e-3)
    assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy.max()


class Wall(Tip):
    """A penalty in place of a wall above the end, whose stiffness is its history, and grows until
    the end is at most 1e-6 in the wall."""

    symmetric, dissipates, at = False, False, 0.01

    def start(self):
        return np.array([1e3])

    def depth(self, u):
        return np.maximum(self.way(u)[1] - self.at, 0.0)

    def evaluate(self, u, v, t, history, dt):
        return -history[0] * self.depth(u) * self.r.row((0.0, 1.0), len(u)), history

    def corrected(self, u, t, history):
        return 10.0 * history if self.depth(u) > 1e-6 else None


class WallPoint(ForceElement):
    """The same on a point."""

    symmetric, dissipates, at, start = False, False, Wall.at, Wall.start

    def bind(self, scene):
        return [point(scene, 0, (1.0, 0.0))]

    def evaluate(self, x, v, t, history, dt):
        depth = np.maximum(x[0, 1] - self.at, 0.0)
        return np.array([[0.0, -1.0]]) * history[0] * depth, history

    def corrected(self, x, t, history):
        return 10.0 * history if x[0, 1] - self.at > 1e-6 else None


def test_an_item_may_repeat_an_increment_with_another_history():
    """As a force element: the stiffness of a wall is the least power of ten that holds."""
    made = {}
    for kind in (Wall, WallPoint):
        scene = bare().add(kind()).point_force((0.0, 40.0), at=(1.0, 0.0), beam=0)
        made[kind] = scene.solve_static()
    one, other = made.values()
    assert_allclose(one.u, other.u, rtol=0, atol=1e-12)
    assert np.array_equal(one.memory, other.memory)
    depth = one.displacement((1.0, 0.0), 0)[1] - Wall.at
    power = np.log10(one.memory[0])
    assert power == round(power) and 1e-7 < depth < 1e-6
    known = bare().fix("right", "r^2", displacement=Wall.at + depth, beam=0).solve_static()
    held = 40.0 - known.reactions("right", 0).force[1]
    assert one.memory[0] * depth == pytest.approx(held, rel=1e-5)


class Midway(Tip):
    """A hardening spring of the end, whose mean force has the work of its energy."""

    def energy(self, u, t):
        return 1e4 * self.way(u)[1] ** 4

    def force(self, u, v, t):
        return -4e4 * self.way(u)[1] ** 3 * self.r.row((0.0, 1.0), len(u))

    def mean_force(self, u, w, t):
        a, b = self.way(u)[1], self.way(w)[1]
        type(self).asked = True
        return -1e4 * (a + b) * (a * a + b * b) * self.r.row((0.0, 1.0), len(u))


def test_an_item_may_have_a_mean_force():
    history = bare().gravity((0.0, -9.81)).add(Midway()).integrate(0.02, 1e-3)
    assert Midway.asked
    assert np.ptp(history.total_energy) < 1e-9 * history.kinetic_energy.max()


def test_a_constraint_is_that_of_a_joint():
    one = bare().gravity((0.0, -9.81)).add(item := Lift())
    two = bare().gravity((0.0, -9.81))
    joint = two.joint("position", at=(1.0, 0.0), beam=0, r=rising)
    a, b = one.solve_static(), two.solve_static()
    assert a.displacement((1.0, 0.0), 0)[1] == pytest.approx(0.02, abs=1e-12)
    assert a.joint_force(item)[0] == pytest.approx(b.joint_force(joint)[1], rel=0.05)


class Inside(Item):
    """A spring from a point inside an element to (0.7, -0.6), or a mass there, or a line."""

    def __init__(self, what):
        self.what = what

    def bind(self, layout):
        bound = super().bind(layout)
        bound.r = r = point(layout, 0, (0.7, 0.0))
        bound.rows, bound.dofs = np.array([r.row(e, layout.N) for e in np.eye(2)]), r.dofs
        return bound

    def __getattr__(self, name):
        those = {"force": ("force", "sparse"), "stiffness": ("sparse",), "mass": ("mass",),
                 "constraint": ("line",)}.get(name, ())
        if vars(self).get("what") not in those:
            raise AttributeError(name)
        return getattr(self, "_" + name)

    def _force(self, u, v, t):
        d = self.r(u) - np.array([0.7, -0.6])
        return -40.0 * (1.0 - 0.6 / np.sqrt(d @ d)) * d @ self.rows

    def _stiffness(self, u, v, t):
        d = self.r(u) - np.array([0.7, -0.6])
        n, size = d / np.sqrt(d @ d), np.sqrt(d @ d)
        K = -40.0 * ((1.0 - 0.6 / size) * np.eye(2) + 0.6 / size * np.outer(n, n))
        return sparse.csr_array(self.rows.T @ K @ self.rows)

    def _mass(self):
        return 0.05 * self.rows.T @ self.rows

    def _constraint(self, u, t):
        return self.r(u)[1:]


@pytest.mark.parametrize("what, known", [
    ("force", lambda: Spring(40.0, ((0.7, 0.0), ("ground", (0.7, -0.6))))),
    ("sparse", lambda: Spring(40.0, ((0.7, 0.0), ("ground", (0.7, -0.6))))),
    ("mass", lambda: PointMass(0.05, (0.7, 0.0))),
    ("line", lambda: JOINTS["line"]((0.7, 0.0), (1.0, 0.0)))])
def test_section_forces_know_where_a_custom_item_acts(what, known):
    """Also within its element, in statics and in motion; what it prescribes is as of a joint."""
    def states(item):
        beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 7), height=0.03), ElementBeamCable(3),
                    MATERIAL, width=0.03)
        scene = Scene(beam).clamp("left").point_force((0.1, -1.0), at=(1.0, 0.0)).add(item)
        return scene.solve_static(), scene.integrate(0.05, 2e-3).state(-1)

    for one, other in zip(states(Inside(what)), states(known())):
        assert_allclose(one.u, other.u, rtol=0, atol=1e-9 * np.abs(other.u).max())
        for x in (0.3, 0.68, 0.7, 0.72, 0.9):
            a, b = ([found.N, found.Q, found.M] for found in (
                state.resultants((x, 0.0)) for state in (one, other)))
            assert_allclose(a, b, rtol=0, atol=1e-5 * max(1.0, np.abs(b).max()))
        assert one.recovered == other.recovered


class Profile(Item):
    """The end slides along y = f(x), which is straight at first."""

    moving = False

    def __init__(self, profile):
        self.profile = profile

    def bind(self, layout):
        bound = super().bind(layout)
        bound.r = point(layout, 0, (1.0, 0.0))
        return bound

    def constraint(self, u, t):
        x, y = self.r(u) - self.r.start
        return np.array([y - self.profile(x)])


class ProfileJoint(Joint):
    equations, constant = ("force normal to the profile",), False

    def __init__(self, profile):
        self.profile = profile

    def bind(self, layout):
        self.r = point(layout, 0, (1.0, 0.0))

    def value(self, u, t):
        x, y = self.r(u) - self.r.start
        return np.array([y - self.profile(x)])

    def curvature(self, u, t, multipliers):
        x, h = (self.r(u) - self.r.start)[0], 1e-4
        second = (self.profile(x + h) - 2.0 * self.profile(x) + self.profile(x - h)) / h**2
        a = self.r.row((1.0, 0.0), len(u))
        k = np.flatnonzero(a)
        K = -multipliers[0] * second * np.outer(a[k], a[k])
        return np.repeat(k, len(k)), np.tile(k, len(k)), K.ravel()


class ProfileAlone(ProfileJoint):
    """Its curvature by differences."""

    curvature = BoundConstraint.curvature


def rising_from(x0):
    return lambda x: 5.0 * np.where(np.real(x) > x0, x - x0, 0.0 * x) ** 2


def bump(x):
    inside = (np.real(x) > 0.1) & (np.real(x) < 0.3)
    return np.where(inside, 0.5 * (1.0 - np.cos(10.0 * np.pi * (x - 0.1))), 0.0 * x) * 0.02


@pytest.mark.parametrize("kind", [Profile, ProfileJoint, ProfileAlone])
@pytest.mark.parametrize("profile, x", [(rising_from(0.05), 0.1), (rising_from(0.3), 0.35),
                                        (bump, 0.2)])
def test_a_profile_may_be_straight_at_first(kind, profile, x):
    """A constraint is not taken for linear because it is so about the reference configuration."""
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 9), height=0.02), ElementBeamCable(3),
                MATERIAL, width=0.02)
    scene = Scene(beam).clamp("left").add(kind(profile)).fix(
        "right", "r^1", displacement=lambda t: x * t)
    assert_allclose(scene.run(1.0, increments=8).displacement((1.0, 0.0))[-1], [x, profile(x)],
                    rtol=0, atol=1e-9)


@pytest.mark.filterwarnings("ignore:a support moves")
def test_a_joint_with_friction_is_one_class():
    """A bar to and fro on a rail: friction is all that the cycle of its end loses."""
    scene = bare().add(item := DragRail()).fix("right", "r^1", beam=0, displacement=lambda t: (
        1e-4 * np.sin(np.pi * t / 2)))
    assert len(scene.joints) == 2 and scene.elements[0].same(item)
    run = scene.run([1.0, 3.0, 5.0], increments=20)
    assert np.abs(run.displacement((1.0, 0.0), 0)[:, 1]).max() < 1e-12
    lost = run.dissipated[-1] - run.dissipated[20]
    assert lost == pytest.approx(4 * 0.05 * (1e-4 - 0.05 / 1e4), rel=0.01)


class Wrong(Tip):
    """A spring along y, or a force along y of what moves along x, that is wrong in one way."""

    def __init__(self, what):
        self.what, self.symmetric = what, what != "unsymmetric"

    def bind(self, layout):
        bound = super().bind(layout)
        bound.x, bound.y = (bound.r.row(e, layout.N) for e in np.eye(2))
        return bound

    def force(self, u, v, t):
        if self.what == "raises":
            raise KeyError("x")
        return np.zeros(3) if self.what == "shape" else -50.0 * self.y * (
            (self.x if "symm" in self.what else self.y) @ u)

    def stiffness(self, u, v, t):
        size = 40.0 if self.what == "stiffness" else 50.0
        return -size * np.outer(self.y, self.x if "symm" in self.what else self.y)


@pytest.mark.parametrize("what, words", [
    ("shape", "must have the shape"), ("symmetry", "symmetric = False"),
    ("stiffness", "not the derivative of force"), ("raises", "fails in the reference")])
def test_what_does_not_fit_is_said(what, words):
    scene = bare()
    with pytest.raises(InputError, match=words):
        scene.add(Wrong(what))
    assert len(scene.items) == 2
    assert scene.add(Wrong("unsymmetric")).solve_linear().converged


@pytest.mark.parametrize("thing", [3, None, Beam, Tip()])
def test_what_is_no_item_is_said(thing):
    with pytest.raises(InputError, match=r"derive yours from|does nothing"):
        bare().add(thing)
