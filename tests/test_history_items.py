"""Items of one's own with a memory: a law, a contact law, controllers, each in one class here.

They need nothing but ``start`` and ``evaluate``; all solvers keep their history.
"""

import copy
import pickle
import warnings
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from skfem_ancf import (Beam, Circle, ElasticPlastic, ElementBeamANCF, ElementBeamCable, InputError,
                        Item, Line, MeshBeam, PointForce, Prony, RigidBody, Scene,
                        StVenantKirchhoff, sweep)
from skfem_ancf.actions.forces import ForceElement, point

MATERIAL = StVenantKirchhoff(2e7, 0.3, 1000.0)
TIP = (1.0, 0.0)


class Maxwell(ForceElement):
    """A law: spring and dashpot in series along y; the history is place and force."""

    def __init__(self, k, tau, at=TIP):
        self.k, self.tau, self.at = k, tau, at

    def bind(self, scene):
        return [point(scene, None, self.at)]

    def start(self):
        return np.array([self.at[1], 0.0])

    def evaluate(self, x, v, t, history, dt):
        s = dt / self.tau
        a, b = np.exp(-s), -np.expm1(-s) / s if s > 0.0 else 1.0
        F = a * history[1] + self.k * b * (x[0, 1] - history[0])
        return np.array([[0.0, -1.0]]) * F, np.array([x[0, 1], F])

    def potential(self, x, history):
        return 0.5 * history[1] ** 2 / self.k


class Ground(ForceElement):
    """A contact law: the end on a floor by penalty, with Coulomb friction from an anchor."""

    symmetric = False

    def __init__(self, floor=-0.01, k=1e5, mu=0.5, at=TIP):
        self.floor, self.k, self.mu, self.at = floor, k, mu, at

    def bind(self, scene):
        return [point(scene, None, self.at)]

    def start(self):
        return np.array([self.at[0], 1.0])  # the anchor, and 1 if it was in contact

    def evaluate(self, x, v, t, history, dt):
        N = self.k * np.maximum(self.floor - x[0, 1], 0.0)
        if not N > 0.0:
            return np.zeros((1, 2)) * x, np.array([self.at[0], 0.0])
        anchor = history[0] if history[1] > 0.0 else x[0, 0]
        T = np.clip(self.k * (x[0, 0] - anchor), -self.mu * N, self.mu * N)
        return np.array([[-T, N]]), np.array([x[0, 0] - T / self.k, 1.0])


class Integral(ForceElement):
    """A controller: proportional and integral; the history is the integral and the last error."""

    symmetric = False

    def __init__(self, target, kp, ki, at=TIP):
        self.target, self.kp, self.ki, self.at = target, kp, ki, at

    def bind(self, scene):
        return [point(scene, None, self.at)]

    def start(self):
        return np.array([0.0, self.target])

    def evaluate(self, x, v, t, history, dt):
        error = self.target - x[0, 1]
        total = history[0] + 0.5 * dt * (history[1] + error)
        return np.array([[0.0, 1.0]]) * (self.kp * error + self.ki * total), np.array(
            [total, error])


class Ratchet(Item):
    """On all degrees of freedom: it holds the end at its highest place, by an item's energy."""

    def __init__(self, k):
        self.k = k

    def bind(self, layout):
        bound = super().bind(layout)
        bound.r = point(layout, 0, TIP)
        bound.dofs, bound.row = bound.r.dofs, bound.r.row((0.0, 1.0), layout.N)
        return bound

    def start(self):
        return np.zeros(1)

    def evaluate(self, u, v, t, history, dt):
        up = self.row @ u
        top = np.maximum(history, up)
        return -self.k * (up - top[0]) * self.row, top

    def stiffness(self, u, v, t, history, dt):
        return -self.k * (self.row @ u < history[0]) * np.outer(self.row, self.row)

    def energy(self, u, history):
        return 0.5 * self.k * (self.row @ u - history[0]) ** 2


ITEMS = {"law": lambda: Maxwell(50.0, 0.05), "contact": Ground, "controller": lambda: Integral(
    -0.02, 50.0, 400.0), "item": lambda: Ratchet(200.0)}


def bare(n=4):
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, n + 1), height=0.05), ElementBeamANCF(2),
                MATERIAL, width=0.05)
    return Scene(beam).clamp("left")


def down_and_up(t):
    return np.interp(t, [0.0, 1.0, 2.0], [0.0, 3.0, 1.0])


def loaded(name, n=4):
    up = 1.0 if name == "item" else -1.0
    return bare(n).point_force((0.2, up), at=TIP, amplitude=down_and_up).add(ITEMS[name]())


@pytest.mark.parametrize("name", ITEMS)
def test_statics_and_what_is_asked_about_its_states(name):
    scene = loaded(name)
    run = scene.run([1.0, 2.0], increments=24)
    assert np.any(run.state(-1).memory != scene.system.histories.rest)
    state = run.state(24)
    for one in (state, copy.copy(state), pickle.loads(pickle.dumps(state))):
        again = scene.run(2.0, increments=24, start=one)
        assert_allclose(again.u[-1], run.u[-1], rtol=0, atol=1e-6)
        assert_allclose(again.state(0).memory, state.memory, rtol=0, atol=1e-9)
    # a state has its forces: reactions and loads are in balance
    applied = 3.0 * np.array([0.2, 1.0 if name == "item" else -1.0])
    own = state.reactions("left").force + applied
    bound = scene.system.after(state.memory).forces.remembering[0]
    x = np.array([link(state.u) for link in bound.links])
    ours = bound.force(x, 0.0 * x, 1.0).sum(axis=0)
    assert_allclose(own + ours, 0.0, atol=1e-5)
    assert np.all(scene.modes(2, state).frequencies > 0.0)
    at_once = scene.solve_static()
    assert str(at_once.verdict).startswith("stable")
    path = scene.continuation(max_load=1.0, ds=1e-3)
    assert path.load[-1] == 1.0 and path.state(-1).memory is not None


def test_increments_that_are_cut_start_from_the_history_before():
    fine, rough = (loaded("law").run([1.0, 2.0], increments=n, max_iterations=most)
                   for n, most in ((24, 30), (4, 3)))
    assert len(rough) > 2 * 9
    assert_allclose(rough.u[-1], fine.u[-1], rtol=0, atol=2e-4)


@pytest.mark.parametrize("name", ITEMS)
@pytest.mark.parametrize("scheme", ["generalized-alpha", "hht", "newmark", "energy-momentum",
                                    "gauss", "radau"])
def test_motions_go_on_from_states_and_checkpoints(name, scheme, tmp_path):
    scene, options = loaded(name), {"dt": 2e-3, "scheme": scheme}
    whole = scene.integrate(0.08, **options)
    assert len(np.unique(whole.state(-1).memory)) > 0 and np.all(np.isfinite(whole.total_energy))
    half = scene.integrate(0.04, **options)
    state = half.state(-1)  # another system starts with other accelerations
    for one, slack in ((state, 1e-9), (pickle.loads(pickle.dumps(state)), 2e-5)):
        rest = scene.integrate(0.08, start=one, **options)
        assert_allclose(rest.u[-1], whole.u[-1], rtol=0, atol=slack)
    file = tmp_path / "run.npz"
    scene.integrate(0.08, checkpoint=file, every=10, **options)
    assert_allclose(scene.resume(file).state(-1).memory, whole.state(-1).memory, atol=1e-10)
    fine = scene.integrate(0.08, 1e-3, scheme=scheme)
    assert_allclose(fine.displacement(TIP)[-1], whole.displacement(TIP)[-1], atol=2e-3)


def test_the_scheme_that_goes_back_in_time_names_those_that_know_histories():
    with pytest.raises(InputError, match="use 'energy-momentum', 'generalized-alpha', 'gauss' or"):
        loaded("law").integrate(0.01, 1e-3, scheme="energy-momentum-4")


def tip_of(k):
    return bare().point_force((0.0, -1.0), at=TIP, amplitude=down_and_up).add(Maxwell(k, 0.5)).run(
        [1.0, 2.0], increments=4)


def test_a_sweep_and_other_meshes():
    found = sweep(tip_of, {"k": [10.0, 20.0]}, lambda run: run.displacement(TIP)[-1, 1])
    assert not found.failures and found["value"][0] != found["value"][1]
    scene = loaded("law")
    finer = scene.replace(beams=[b.replace(mesh=b.mesh.refined()) for b in scene.beams])
    a, b = (s.run(1.0, increments=4).displacement(TIP)[-1, 1] for s in (scene, finer))
    assert_allclose(b, a, rtol=3e-2)
    # another scene of the same items knows the state
    other = copy.copy(scene).gravity((0.0, 0.0))
    state = scene.run(1.0, increments=4).state(-1)
    assert_allclose(other.system.histories.of_state(state), state.memory)


# values

@pytest.mark.parametrize("scheme", ["generalized-alpha", "energy-momentum", "radau"])
def test_a_mass_on_a_maxwell_element_moves_as_its_equation_says(scheme):
    """m x'' = -F, F' = k x' - F / tau; stored, kinetic and dissipated energy are constant."""
    m, k, tau, v = 2.0, 30.0, 0.7, 1.5
    body = RigidBody(mass=m, inertia=0.1, position=(1.0, 0.0))
    scene = Scene(body).initial_velocity((0.0, v)).add(Maxwell(k, tau))
    history = scene.integrate(4.0, 5e-3, scheme=scheme)
    exact = solve_ivp(lambda t, y: [y[1], -y[2] / m, k * y[1] - y[2] / tau], (0.0, 4.0),
                      [0.0, v, 0.0], rtol=1e-10, atol=1e-12, t_eval=history.t).y
    assert_allclose(history.displacement(TIP)[:, 1], exact[0], atol=2e-4)
    total = history.total_energy + history.dissipated
    assert np.ptp(total) < (1e-10 if scheme == "energy-momentum" else 2e-3) * total[0]
    lost = total[0] - 0.5 * m * exact[1] ** 2 - 0.5 * exact[2] ** 2 / k
    assert_allclose(history.dissipated, lost, atol=1e-3 * total[0])


def test_buckling_and_modes_have_the_stiffness_at_once():
    """A column that a Maxwell element holds sideways: tan x = x - x^3 E I / (k L^3)."""
    E, h, k = 2e9, 0.01, 20.0
    EI = E * h**4 / 12.0
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 7), height=h), ElementBeamCable(5),
                StVenantKirchhoff(E, 0.3, 1000.0), width=h)
    scene = Scene(beam).clamp("left").point_force((-1.0, 0.0), at=TIP).add(Maxwell(k, 0.05))
    x = brentq(lambda x: np.sin(x) - (x - x**3 * EI / k) * np.cos(x), 1.6, 4.4)
    assert 2.0 < x < 4.0  # between free and fixed
    assert_allclose(scene.buckling(1).factors[0], EI * x**2, rtol=1e-3)
    # after a while the force has relaxed; a new disturbance still meets k
    state = scene.run(1.0, increments=2).state(-1)
    omega = scene.modes(1, state).frequencies[0]
    plain = Scene(beam).clamp("left").point_force((-1.0, 0.0), at=TIP).spring(k, (TIP, (1.0, 1e6)))
    known = plain.modes(1, plain.solve_static()).frequencies[0]
    assert_allclose(omega, known, rtol=1e-3)


def test_an_integral_controller_reaches_its_target():
    """Of an elastic beam: the error decays as e_0 exp(-ki t / (kp + K))."""
    E, h, kp, ki, target = 2e7, 0.05, 5.0, 40.0, 1e-3
    beam = Beam(MeshBeam.init_line([0.0, 0.5, 1.0], height=h), ElementBeamCable(3),
                StVenantKirchhoff(E, 0.3), width=h)
    K = 3.0 * E * h**4 / 12.0
    run = Scene(beam).clamp("left").add(Integral(target, kp, ki)).run(1.0, increments=200)
    error = target - run.displacement(TIP)[:, 1]
    assert_allclose(error, error[0] * np.exp(-ki * run.t / (kp + K)), rtol=2e-4)
    assert_allclose(error[0], target * K / (kp + K), rtol=1e-4)


@pytest.mark.parametrize("scheme", ["generalized-alpha", "energy-momentum", "radau"])
def test_a_body_slides_on_friction_of_ones_own_and_stops(scheme):
    """After v^2 / (2 mu g); its energy is dissipated."""
    m, g, mu, v, k = 2.0, 10.0, 0.3, 0.5, 1e5
    body = RigidBody(mass=m, inertia=0.1, position=(1.0, 0.0))
    scene = Scene(body).gravity((0.0, -g)).initial_velocity((v, 0.0)).add(
        Ground(m * g / k, k, mu))
    history = scene.integrate(0.4, 1e-3, scheme=scheme)
    x = history.displacement(TIP)
    assert_allclose(x[-1, 0], v**2 / (2.0 * mu * g), rtol=1e-2)
    assert np.ptp(x[300:, 0]) < 2.0 * mu * m * g / k
    assert_allclose(history.dissipated[-1], 0.5 * m * v**2, rtol=2e-2)


def test_a_ratchet_holds_what_was_reached():
    scene = bare().add(Ratchet(1e6)).point_force((0.0, 1.0), at=TIP, amplitude=lambda t: np.interp(
        t, [0.0, 1.0, 2.0], [0.0, 1.0, -1.0]))
    w = scene.run([1.0, 2.0], increments=5).displacement(TIP)[:, 1]
    assert_allclose(w[6:], w[5], rtol=1e-3)
    assert_allclose(w[5], bare().point_force((0.0, 1.0), at=TIP).solve_static().displacement(
        TIP)[1], rtol=1e-6)


class Latch(Item):
    """A ratchet that says nothing of its energy: all of its work counts as dissipated."""

    start, evaluate = Ratchet.start, Ratchet.evaluate

    def __init__(self, k):
        self.k = k

    def bind(self, layout):
        bound, r = super().bind(layout), point(layout, 0, TIP)
        bound.dofs, bound.row = r.dofs, r.row((0.0, 1.0), layout.N)
        return bound


def test_an_item_with_a_memory_needs_no_energy():
    def run(item):
        scene = bare().add(item).point_force((0.0, 1.0), at=TIP, amplitude=down_and_up)
        return scene.run([1.0, 2.0], increments=8)

    one, other = run(Latch(200.0)), run(Ratchet(200.0))
    assert_allclose(one.u, other.u, rtol=0, atol=1e-7)
    assert_allclose(one.dissipated + one.strain_energy, other.dissipated + other.strain_energy,
                    rtol=1e-6, atol=1e-9)


class Fading(ForceElement):
    """A load with a memory: it decays with the way that its point has gone."""

    symmetric = dissipates = False

    def __init__(self, f, length):
        self.f, self.length = f, length

    def bind(self, scene):
        return [point(scene, None, TIP)]

    def start(self):
        return np.zeros(2)

    def evaluate(self, x, v, t, history, dt):
        way = history[1] + np.abs(x[0, 1] - history[0])
        return np.array([[0.0, t * self.f * np.exp(-way / self.length)]]), np.array([x[0, 1], way])


def test_a_load_with_a_memory_brings_work_in():
    """K w = t f exp(-w / length) at each increment, and nothing is dissipated."""
    E, h, f, length = 2e7, 0.05, 1.0, 0.02
    beam = Beam(MeshBeam.init_line([0.0, 0.5, 1.0], height=h), ElementBeamCable(3),
                StVenantKirchhoff(E, 0.3), width=h)
    K = 3.0 * E * h**4 / 12.0
    run = Scene(beam).clamp("left").add(Fading(f, length)).run(1.0, increments=5)
    w = run.displacement(TIP)[:, 1]
    exact = [brentq(lambda w, t=t: K * w - t * f * np.exp(-w / length), 0.0, 0.1) for t in run.t]
    assert_allclose(w, exact, rtol=5e-3)
    assert np.all(run.dissipated == 0.0)


# what it refuses

class Odd(Maxwell):
    def __init__(self, what):
        super().__init__(50.0, 0.05)
        self.what = what

    def evaluate(self, x, v, t, history, dt):
        force, after = super().evaluate(x, v, t, history, dt)
        if self.what == "changes":
            history[:] = after
        return (force[0] if self.what == "force" else force,
                after[:1] if self.what == "history" else after)


@pytest.mark.parametrize("what, words", [
    ("changes", "read-only"), ("force", "shape"), ("history", "shape of start")])
def test_what_is_wrong_with_an_item_is_said(what, words):
    with pytest.raises(InputError, match=words):
        bare().add(Odd(what))


# what a state takes along into another scene


@pytest.mark.parametrize("more", ["obstacle", "spring"])
def test_a_wound_spring_keeps_its_turns_beside_something_new(more):
    beam = Beam(MeshBeam.init_line([0.0, 0.5, 1.0], 0.01), ElementBeamCable(3), MATERIAL, 0.01)

    def wound(angle):
        scene = Scene(beam).pin("left").torsional_spring(2.0, at="left")
        scene.joint("angle", at="left", angle=angle)
        return scene

    state = wound(lambda t: 4.0 * np.pi * t).run(1.0, increments=20).state(-1)
    scene = wound(lambda t: 4.0 * np.pi)
    if more == "obstacle":
        scene.obstacle(Circle((0.0, -5.0), 1.0))
    else:
        scene.torsional_spring(0.0, at="right")
    for end in scene.run(2.0, increments=1, start=state), scene.integrate(
            1.01, 0.005, start=state):
        assert_allclose(abs(end.state(-1).multipliers[-1]), 2.0 * 4.0 * np.pi, rtol=1e-9)


def test_friction_goes_on_where_another_obstacle_comes_or_goes():
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 5), 0.02), ElementBeamCable(3),
                StVenantKirchhoff(2e9, 0.0, 1000.0), 0.01)

    def scene(more):
        made = Scene(beam).obstacle(Line((0.0, -0.01), (0.0, 1.0)), friction=0.5)
        if more:
            made.obstacle(Circle((5.0, 5.0), 0.1), friction=0.2)
        made.point_force((20.0, 0.0), at="right", amplitude=lambda t: min(t, 1.0))
        return made.line_load((0.0, -100.0))

    for more in (True, False):
        first = scene(more).run(1.0, increments=4)
        held = first.displacement("left")[-1]
        assert 1e-8 < held[0] < 1e-7  # friction holds by its springs
        last = scene(not more).run(2.0, increments=2, start=first.state(-1))
        assert_allclose(last.displacement("left")[-1], held, rtol=1e-6)


def test_friction_begins_where_a_new_obstacle_is_added():
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 5), 0.02), ElementBeamCable(3),
                StVenantKirchhoff(2e9, 0.0, 1000.0), 0.01)

    def scene(*frictions):
        made = Scene(beam).line_load((0.0, -100.0)).point_force(
            (1.0, 0.0), at="right", amplitude=lambda t: max(t - 1.0, 0.0))
        for y, friction in zip((5.0, -0.01), frictions):
            made.obstacle(Line((0.0, y), (0.0, -np.sign(y))), friction=friction)
        return made

    state = scene(0.0, 0.0).fix("left", "r^1").run(1.0, increments=1).state(-1)
    last = scene(0.0, 0.5).run(2.0, increments=2, start=state)
    slid = last.displacement("left")[-1, 0] - state.displacement("left")[0]
    assert 0.0 < slid < 1e-8  # it sticks where it is


@pytest.mark.parametrize("name", ITEMS)
def test_an_item_made_anew_has_the_history_of_its_place(name):
    first = loaded(name)
    state = first.run(1.0, increments=12).state(-1)
    anew = Scene(*first.beams).clamp("left").add(ITEMS[name]())
    anew.point_force((0.2, 1.0 if name == "item" else -1.0), at=TIP, amplitude=down_and_up)
    whole, last = (one.run(2.0, increments=12, start=state) for one in (first, anew))
    assert_allclose(last.u[-1], whole.u[-1], rtol=0, atol=1e-7)
    assert_allclose(last.state(0).memory, state.memory, rtol=1e-9)


def test_a_history_that_a_beam_cannot_take_over_is_said():
    steel = ElasticPlastic(2e11, 0.3, 2.5e8, 2e9, density=7850.0)
    strip = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 5), 0.02), ElementBeamCable(3), steel,
                 0.01)
    bent = Scene(strip).clamp("left").point_force(
        (0.0, -200.0), at="right", amplitude=lambda t: t).run(1.0, increments=3).state(-1)
    assert bent.field("plastic_strain", (0.0, 0.01)) > 1e-4
    for other in (steel.replace(points=20), StVenantKirchhoff(2e11, 0.3, 7850.0)):
        free = Scene(strip.replace(material=other)).clamp("left")
        for solve in (free.solve_static, partial(free.run, 2.0),
                      partial(free.integrate, 1.1, 0.1)):
            with pytest.raises(InputError, match="cannot take over the history.*points="):
                solve(start=bent)
        flat = free.solve_static(start=free.state(bent.u))
        assert np.max(np.abs(flat.u)) < 1e-9
    same, harder = (Scene(strip.replace(material=steel.replace(yield_stress=y))).clamp(
        "left").solve_static(start=bent).displacement("right")[1] for y in (2.5e8, 3e8))
    assert -1e-3 < same < -1e-4
    assert_allclose(harder, same, rtol=1e-6)


def test_linear_models_say_what_relaxes():
    elastic = StVenantKirchhoff(2e9, 0.3, 1000.0)
    made = {"Prony": Prony(elastic, [0.5], [0.01]), "Maxwell": elastic, "": ElasticPlastic(
        2e9, 0.3, 1e6, density=1000.0)}
    for words, material in made.items():
        scene = Scene(Beam(MeshBeam.init_line([0.0, 1.0], 0.02), ElementBeamCable(3), material,
                           0.01)).clamp("left").sensor("tip", "displacement", at=TIP)
        if words == "Maxwell":
            scene.add(Maxwell(2e3, 1.0)).add(Ratchet(10.0))
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            scene.frequency_response([1.0], [PointForce((0.0, 1.0), at=TIP)])
        assert [words in str(one.message) for one in found] == [True] * bool(words)
