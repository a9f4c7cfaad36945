"""Quasi-static steps: against closed forms of snaps, friction and cycles."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp, trapezoid

from skfem_ancf import (Beam, CallbackError, Circle, ConvergenceError, ElementBeamANCF,
                        ElementBeamANCFCubic, ElementBeamCable, InputError, Line, MeshBeam,
                        ModelWarning, NameUnknown, Ramp, Scene, Section, StepHistory, Steps,
                        StVenantKirchhoff, SupportError)
from skfem_ancf.scene import quasistatic
from skfem_ancf.solvers.iteration import LoadStepFailed

SOFT = StVenantKirchhoff(2e8, 0.3, 7800)


def cantilever(n=5):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n), height=0.01)
    return Beam(mesh, ElementBeamANCF(2), SOFT, width=0.01)


# functions of time


def test_ramps_take_numbers_vectors_and_many_times():
    steps = Steps(press=1.0, hold=0.5, release=2.0)
    force = steps.ramp(press=4.0, release=0.0)
    assert [force(t) for t in (0.0, 0.5, 1.0, 1.25, 2.5, 9.0)] == [0.0, 2.0, 4.0, 4.0, 2.0, 0.0]
    assert np.array_equal(force(np.array([0.5, 2.5])), [2.0, 2.0])
    place = steps.ramp((1.0, 0.0), press=(3.0, 2.0))
    assert np.array_equal(place(0.5), [2.0, 1.0]) and place(np.zeros(4)).shape == (2, 4)
    assert np.array_equal(steps.step_at(np.array([0.0, 1.0, 1.1, 3.5])), [0, 0, 1, 2])
    assert repr(steps) == "Steps(press=1, hold=0.5, release=2)"


@pytest.mark.parametrize("wrong, error, says", [
    (lambda: Steps(), InputError, "durations by name"),
    (lambda: Steps(press=0.0), InputError, "press"),
    (lambda: Steps(press=1.0).ramp(pres=2.0), NameUnknown, "press"),
    (lambda: Steps(press=1.0).ramp(press=np.nan), InputError, "press"),
    (lambda: Ramp([0, 0], [1, 2]), InputError, "increase"),
    (lambda: Ramp([0, 1], [1, 2, 3]), InputError, "as many"),
    (lambda: Ramp([0, 1], ["a", "b"]), InputError, "values"),
    (lambda: Ramp([0], 1.0), InputError, "as many"),
])
def test_wrong_steps_are_explained(wrong, error, says):
    with pytest.raises(error, match=says):
        wrong()


# loads that come and go


def test_a_run_ends_where_statics_does_and_comes_back():
    steps = Steps(load=1.0, unload=1.0)
    scene = Scene(cantilever()).clamp("left").sensor("tip", "displacement", at=(1, 0))
    loaded = scene.point_force((0, -0.5), at="right", amplitude=steps.ramp(load=1.0, unload=0.0))
    history = loaded.run(steps, increments=6)
    assert isinstance(history, StepHistory) and history.plan is steps
    there = history.during("load")[-1]
    assert history.t[there] == 1.0 and history.during("unload")[0] == there
    # Mattiasson (1981), Numerical results from large deflection beam and frame problems analysed by
    # means of elliptic integrals: P L^2 / (E I) = 3
    assert np.allclose(history.displacement((1, 0))[there], (-0.25442, -0.60325), atol=5e-3)
    assert np.allclose(history.reactions("left").force[there], (0, 0.5), atol=1e-8)
    assert abs(history.u[-1]).max() < 1e-8 and not len(history.jumps)
    assert history.iterations == history.iterations_at.sum() > 0
    assert np.array_equal(history.sensors["tip"], history.displacement((1, 0)))
    assert np.allclose(history.kinetic_energy, 0.0)


def test_loads_that_stay_act_from_the_start():
    history = Scene(cantilever()).clamp("left").line_load((0, -0.8)).run(1.0, increments=2)
    assert np.allclose(history.reactions("left").force, [[0, 0.8]] * 3, atol=1e-8)


def test_joints_follow_their_functions():
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.05)
    beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.0, 7800), width=0.05)
    scene = Scene(beam).clamp("left")
    end = scene.joint("position", at=(1, 0), r=lambda t: (1.0, 2e-4 * t))
    history = scene.run([1.0, 2.0], increments=2)
    assert np.allclose(history.t, [0, 0.5, 1, 1.5, 2])
    expected = 3 * 2e8 * 0.05**4 / 12 * 2e-4 * history.t  # 3 E I / L^3
    assert np.allclose(history.joint_force(end)[:, 1], expected, atol=0.03 * expected[-1])


def test_a_motion_goes_on_from_a_run_and_a_run_from_an_instant():
    scene = Scene(cantilever()).clamp("left").point_force(
        (0, -0.2), at="right", amplitude=Ramp([0.0, 1.0], [0.0, 1.0]))
    history = scene.run(1.0, increments=4)
    motion = scene.integrate(1.02, 2e-3, start=history.state(-1 % len(history)))
    assert motion.t[0] == 1.0 and abs(motion.u - history.u[-1]).max() < 1e-6
    more = scene.run([1.5], increments=2, start=history.state(2))
    assert more.t[0] == history.t[2] and np.allclose(more.u[-1], history.u[-1], atol=1e-8)


# snaps


def test_a_truss_snaps_through_at_its_limit_loads():
    rise, span, E, A = 0.3, 1.0, 1e6, 0.03
    length = np.hypot(rise, span)
    mesh = MeshBeam.init_line([0, length / 2, length], 0.3, angle=np.arctan2(rise, span))
    bar = Beam(mesh, ElementBeamANCF(1), StVenantKirchhoff(E, 0.0, 1000.0), width=0.1)
    limit = E * A * rise**3 / (3 * np.sqrt(3) * length**3)
    steps = Steps(down=1.0, up=1.0)
    load = steps.ramp(down=1.5, up=-1.5)
    scene = Scene(bar).pin("left").fix("right", "r^1").point_force(
        (0, -limit), at="right", amplitude=load)
    history = scene.run(steps)
    assert len(history.t) > 41  # increments were cut, and came back to the grid
    assert np.isin(np.linspace(0, 2, 41).round(6), history.t.round(9)).all()
    z = rise + history.displacement((span, rise))[:, 1]
    force = E * A * z * (rise**2 - z**2) / (2 * length**3)
    assert np.allclose(force, load(history.t) * limit, atol=1e-7 * limit)
    assert np.allclose(load(history.jumps), (1.0, -1.0), atol=1e-3)
    assert np.allclose([np.diff(z).min(), np.diff(z).max()], [-0.52, 0.52], atol=0.01)


def shallow_arch(span, height, rise, slope, modes=39):
    """Temperatures at which a pinned sine arch snaps that heat bends, by its sine modes.

    ``w_k = (a k^4 w0_k - T q_k) / (a k^4 + N k^2)`` with ``4 N = sum k^2 (w_k^2 - w0_k^2)``: T of
    the thrust N has a maximum, or N reaches -4 a, where the first antisymmetric mode buckles.
    """
    k, a = np.arange(1, modes + 1, 2.0), height**2 / 12
    w0 = np.where(k == 1, rise, 0.0)
    q = a * 4 / np.pi * (span / np.pi) ** 2 * slope * k

    def temperatures(N):
        d = a * k**4 + N * k**2
        A, B = a * k**4 * w0 / d, -q / d
        return np.roots([np.sum(k**2 * B * B) / 4, np.sum(k**2 * A * B) / 2,
                         np.sum(k**2 * (A * A - w0**2)) / 4 - N])

    T = np.sort(np.real_if_close([temperatures(N) for N in a * np.linspace(-3.9999, -1.01, 4000)]))
    return T[:, 1].max(), T[:, 0].min()


def test_a_thermostat_switches_back_at_a_lower_temperature():
    span, height, rise, alpha = 30.0, 0.2, 0.25, 9e-6
    below, above = (StVenantKirchhoff(E=1.4e5, nu=0.3, thermal_expansion=x)
                    for x in (alpha, -alpha))
    mesh = MeshBeam.init_curve(lambda s: (span * s, rise * np.sin(np.pi * s)),
                               np.linspace(0, 1, 9), height)
    strip = Beam(mesh, ElementBeamANCFCubic(2), section=Section.layers(
        (height / 2, below), (height / 2, above), width=4.0))
    steps = Steps(heat=1.0, cool=1.0)
    heat = steps.ramp(heat=45.0, cool=-15.0)
    scene = Scene(strip).pin("left").pin("right").temperature(1.0, amplitude=heat)
    history = scene.run(steps, increments=8, min_step=1e-3)
    # Timoshenko: two layers of one modulus bend by 3/2 of the difference of strains over the height
    there, back = shallow_arch(span, height, rise, 1.5 * 2 * alpha / height)
    assert np.allclose(heat(history.jumps), (there, back), atol=0.3)


# contact


def test_a_snap_fit_is_pressed_in_and_pulled_out_against_friction():
    mesh = MeshBeam.init_line(np.linspace(0, 20, 9), height=lambda s: 2.0 - s / 20.0)
    arm = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2000.0, 0.35, 1e-9), width=5.0)
    steps = Steps(insert=1.0, pull=1.0)
    stroke = steps.ramp(insert=8.0, pull=0.0)

    def run(friction):
        scene = Scene(arm).clamp("left").obstacle(
            Circle((22.5, -1.5), 1.5), friction=friction, points=60,
            position=lambda t: (-stroke(t), 0.0))
        return scene.run(steps, increments=10)

    def angle(history):
        Fx, Fy = history.reactions("left").force.T
        return np.arctan2(Fx, -Fy)

    smooth, rough = run(0.0), run(0.2)
    for step, sign in (("insert", 1), ("pull", -1)):
        at = [k for k in rough.during(step) if 5.5 < stroke(rough.t[k]) < 7.5]
        turned = angle(rough)[at] - np.interp(rough.t[at], smooth.t, angle(smooth))
        assert len(at) > 1 and np.allclose(np.tan(turned), sign * 0.2, atol=0.02)
    assert abs(rough.reactions("left").force[-1]).max() < 1e-9


def test_a_strip_is_bent_around_a_drum_drawn_over_it_and_springs_back():
    """Friction takes what hand and weight give and the strip does not store; then it is straight.
    """
    radius, height, pull = 0.15, 0.005, 20.0
    mesh = MeshBeam.init_line(np.linspace(-0.15, 0.3, 15), height)
    strip = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e8, 0.0, 1000), width=0.02)
    steps = Steps(bend=1.0, draw=1.0, release=1.0)
    way, weight = steps.ramp(draw=0.05), steps.ramp(bend=pull, release=0.0)

    def run(friction):
        drum = Circle((0.0, -radius - height / 2), radius)
        scene = Scene(strip).obstacle(drum, friction=friction)
        scene.joint("angle", at="left", angle=lambda t: 0.0)
        hand = scene.joint("position", at="left", r=lambda t: (-0.15 - way(t), 0.0))
        scene.point_force((0, -1.0), at="right", amplitude=weight)
        history = scene.run(steps, increments=6)
        return history, -history.joint_force(hand)[:, 0], history.displacement("right")[:, 1]

    smooth, rough = run(0.0), run(0.2)
    for history, force, down in (smooth, rough):
        bent, drawn = history.during("bend")[-1], history.during("draw")[-1]
        k = np.arange(bent, drawn + 1)
        given = trapezoid(force[k], way(history.t[k])) - pull * (down[drawn] - down[bent])
        stored, rubbed = (x[drawn] - x[bent] for x in (history.strain_energy, history.dissipated))
        assert np.isclose(given - stored, rubbed, atol=1e-3 * pull * 0.05)
        assert np.all(np.diff(history.dissipated) >= 0.0)
        ends = history.displacement(np.array([[-0.15, 0.0, 0.3], 3 * [0.0]]))[-1]
        assert np.allclose(ends, [3 * [-0.05], 3 * [0.0]], atol=1e-8)
    assert np.all(smooth[0].dissipated == 0.0) and rubbed > 0.2 * pull * 0.05
    # Eytelwein; the strip leaves the drum at the angle at which it hangs, but for its bending
    angle = -history.state(drawn).resultants("right").angle
    assert np.isclose(force[drawn] / pull, np.exp(0.2 * angle), rtol=0.03)


# phases of an assembly


def elastica_bow(string, places):
    """Draw forces over EI / L^2 and energies over EI / L of a bow, by shooting.

    Both halves are an inextensible elastica of length 1 and a straight ``string``, whose lower end,
    the nock, is at a place (n,): theta'' = -T sin(theta + beta), with the angles theta of the limb
    and beta of the string, and the tension T.
    """
    s, out = np.linspace(0, 1, 41), []
    y, p = np.array([0.4 * np.sin(np.pi * s / 2), 0.6 * np.cos(np.pi * s / 2), 0.25 * s**2,
                     s - 0.04 * s**2]), np.array([2.6, 0.0])
    for x in places:
        result = solve_bvp(
            lambda s, y, p: [y[1], -p[0] * np.sin(y[0] + p[1]), np.sin(y[0]), np.cos(y[0])],
            lambda a, b, p: np.array([a[0], a[2], a[3], b[1], b[2] + string * np.sin(p[1]) - x,
                                      b[3] - string * np.cos(p[1])]), s, y, p, tol=1e-6)
        assert result.success
        s, y, p = result.x, result.y, result.p
        out.append((2 * p[0] * np.sin(p[1]), trapezoid(y[1]**2, s)))
    return np.array(out).T


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=repr)
def test_a_bow_is_bent_strung_and_drawn(element):
    """Three phases, each from the equilibrium of the one before: half of a bow and its string."""
    length, string, height, E, width = 0.8, 0.77, 0.01, 1e10, 0.03
    limb = Beam(MeshBeam.init_line(np.linspace(0, length, 9), height, angle=np.pi / 2), element,
                StVenantKirchhoff(E, 0.0), width=width, name="limb")
    cord = Beam(MeshBeam.init_line([0, string], 2e-3, origin=(0.16, 0), angle=np.pi / 2),
                ElementBeamCable(), StVenantKirchhoff(1e13, 0.0), width=2e-3, name="cord")
    steps = Steps(bend=1.0, draw=1.0)
    tip, end = (0.0, length), (0.16, string)
    bending = Scene(limb, cord).clamp("left", "limb").clamp("left", "cord")
    bending.joint("position", at=tip, beam="limb", r=steps.ramp(tip, bend=end))
    bent = bending.run(1.0, increments=8)
    strung = Scene(limb, cord).clamp("left", "limb").fix("left", "r^2", beam="cord")
    strung.hinge(("limb", tip), ("cord", end))
    strung.point_force((25.0, 0), at="left", beam="cord", amplitude=steps.ramp(draw=1.0))
    history = strung.run(steps, increments=8, start=bent.state(-1))
    assert history.t[0] == 1.0 and not len(history.jumps)
    nock, force = history.position((0.16, 0.0), beam="cord")[:, 0], 50.0 * (history.t - 1.0)
    EI = E * width * height**3 / 12
    exact, energy = elastica_bow(string / length, nock / length)
    assert np.allclose(force, exact * EI / length**2, atol=1e-3 * force.max())
    energy *= EI / length
    assert np.allclose(2 * history.strain_energy, energy, atol=1e-3 * energy.max())
    assert nock[0] > 0.19 and nock[-1] > 0.6


def test_a_phase_remembers_friction_and_what_lets_go_slips_as_it_would():
    """A slab on a floor is pulled until it slips: by one scene, and by two of which the second has
    another load in place of the first at the moment of the change.
    """
    slab = Beam(MeshBeam.init_line([0, 0.5, 1], 0.1), ElementBeamCable(),
                StVenantKirchhoff(2e8, 0.0, 1000), width=0.1)
    weight, friction = 1000 * 0.1 * 0.1 * 9.81, 0.3

    def lying():
        return Scene(slab).gravity((0, -9.81)).obstacle(Line((0, -0.05)), friction=friction).spring(
            2e3, between=((0, 0), (-1.0, 0)), length=1.0)

    pull = Ramp([0.0, 1.0, 2.0], [0.0, 2.0 * friction * weight, 0.0])
    one = lying().point_force((1, 0), at="right", amplitude=pull).run([1.0, 2.0], increments=10)
    first = lying().point_force((1, 0), at="right", amplitude=pull).run(1.0, increments=10)
    second = lying().point_force((1, 0), at=(0.5, 0), amplitude=pull)
    again = second.run([2.0], increments=10, start=first.state(-1))
    middle = (0.5, 0.0)
    pulled = one.displacement(middle)[:, 0]
    moved, last = pulled[one.t == 1.0][0], pulled[-1]
    assert np.isclose(moved, friction * weight / 2e3, rtol=0.01) and last > 0.9 * moved
    assert np.isclose(again.displacement(middle)[-1, 0], last, rtol=0.01)
    assert again.dissipated[0] == first.dissipated[-1] > 0.0
    assert np.isclose(again.dissipated[-1], one.dissipated[-1], rtol=0.02)


# what goes wrong


def test_what_has_converged_is_kept():
    scene = Scene(cantilever()).clamp("left").point_force(
        (0, -0.5), at="right", amplitude=Ramp([0.0, 1.0], [0.0, 1.0]))
    with pytest.raises(ConvergenceError, match="error's state is the history") as caught:
        scene.run(1.0, max_iterations=1, increments=1, min_step=1.0)
    kept = caught.value.state
    assert isinstance(kept, StepHistory) and len(kept) >= 1 and kept.t[-1] < 1e-3


@pytest.mark.parametrize("steps, options, says", [
    (-1.0, {}, "not after the start"), ([], {}, "at least one"),
    (1.0, {"increments": 0}, "increments"), ("press", {}, "steps"),
    (1.0, {"min_step": 0.0}, "min_step"),
])
def test_wrong_runs_are_explained(steps, options, says):
    with pytest.raises(InputError, match=says):
        Scene(cantilever()).clamp("left").run(steps, **options)
    with pytest.raises(SupportError):
        Scene(cantilever()).run(1.0)


def test_curves_of_sensors_are_drawn():
    pytest.importorskip("matplotlib")
    scene = Scene(cantilever()).clamp("left").sensor("tip", "displacement", at=(1, 0))
    scene.sensor("force", lambda state: state.reactions("left").force[1])
    scene.point_force((0, -0.5), at="right", amplitude=Ramp([0.0, 1.0], [0.0, 1.0]))
    history = scene.run(1.0, increments=3)
    ax = history.plot_curve(("tip", 1), "force", label="up")
    line, = ax.get_lines()
    assert np.array_equal(line.get_ydata(), history.sensors["force"])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("tip 1", "force")
    with pytest.raises(InputError, match="its name and a component"):
        history.plot_curve("t", "tip")
    with pytest.raises(InputError, match="component"):
        history.plot_curve("t", ("tip", 5))
    with pytest.raises(NameUnknown, match="force"):
        history.plot_curve("t", "forse")
    with pytest.raises(InputError, match="same instants"):
        history.plot_curve("t", [1.0, 2.0])


# prescribed displacements


def test_one_component_follows_a_function_of_time():
    """The tip of a cantilever goes down and back: the force is 3 EI d / L^3, to d^2 / L^2."""
    beam, d = cantilever(), 0.01
    steps = Steps(down=1.0, up=1.0)
    scene = Scene(beam).clamp("left").fix("right", "r^2", displacement=steps.ramp(down=-d, up=0.0))
    scene.sensor("force", lambda state: state.reactions("right").force[1])
    history = scene.run(steps, increments=4)
    ramp, found = steps.ramp(down=-d, up=0.0)(history.t), history.displacement("right")
    assert np.allclose(found[:, 1], ramp, atol=1e-12)
    forced = Scene(beam).clamp("left").point_force((0, -1.0), at="right").solve_linear()
    stiffness = 1.0 / -forced.displacement("right")[1]
    assert np.allclose(history.sensors["force"], stiffness * ramp, atol=1e-3 * stiffness * d)
    assert history.reactions("right").force[-1] == pytest.approx([0, 0], abs=1e-8 * stiffness * d)


def test_statics_takes_the_function_at_the_load_factor_and_motions_at_the_time():
    beam = cantilever()
    scene = Scene(beam).clamp("left").fix("right", "r^2", displacement=lambda t: -0.01 * t)
    assert scene.solve_static().displacement("right")[1] == pytest.approx(-0.01, abs=1e-12)
    shaken = Scene(beam).fix("left", "r_Y0").pin("left").fix(
        "right", "r^2", displacement=lambda t: 0.01 * np.sin(t) ** 2)
    history = shaken.integrate(0.2, 0.01)
    assert np.allclose(history.displacement("right")[:, 1], 0.01 * np.sin(history.t) ** 2)
    with pytest.raises(CallbackError, match="displacement"):
        Scene(beam).clamp("left").fix("right", "r^2", displacement=lambda t: (t, t)).solve_static()


# increments that stay small


def slow_path(monkeypatch, whole):
    """A cantilever that is followed only by increments of a thousandth; or as a whole."""
    follow, asked = quasistatic._next, []

    def only_small(system, last, t, rules, stable, smallest, *more):
        asked.append(t - last.t)
        if smallest and not whole:
            raise ConvergenceError("none", None)
        if not smallest and t - last.t > 2e-4:
            raise LoadStepFailed("far")
        return follow(system, last, t, rules, stable, smallest, *more)

    monkeypatch.setattr(quasistatic, "_next", only_small)
    scene = Scene(cantilever()).clamp("left").point_force(
        (0, -1.0), at="right", amplitude=lambda t: t)
    return scene, asked


def test_a_rope_over_a_pulley_that_turns_against_the_slip():
    """At first the tip's force slides the rope, then the pulley turns and it slides back.

    Moments about the axis: the force at the surface is T R / (R + h / 2) times the friction.
    """
    R, h, mu, straight = 0.1, 0.004, 0.2, 0.2
    r = R + 0.5 * h

    def axis(s):
        turn, end = np.clip((s - straight) / r, 0.0, np.pi), straight + np.pi * r
        y = r * np.sin(turn) + np.minimum(s - straight, 0.0) - np.maximum(s - end, 0.0)
        return np.array([-r * np.cos(turn), y])

    mesh = MeshBeam.init_curve(axis, np.linspace(0.0, 2 * straight + np.pi * r, 25), h)
    rope = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(1e6, 0.3, 1000.0), width=0.01)
    scene = Scene(rope).pin("left").point_force(
        (0, -2.0), at="right", amplitude=lambda t: min(t / 0.2, 1.0))
    scene.obstacle(Circle((0, 0), R), friction=mu, angle=lambda t: -max(t - 0.2, 0.0))
    history = scene.run([0.2, 1.0], increments=10)
    pulls = -history.reactions("left").force[:, 1]
    slid = int(np.argmin(np.abs(history.t - 0.2)))
    ratio = np.exp(mu * np.pi * R / r)
    assert pulls[slid] == pytest.approx(2.0 / ratio, rel=2e-2)
    assert pulls[-1] == pytest.approx(2.0 * ratio, rel=5e-3)
    assert len(history.t) < 80 and not len(history.jumps)


def test_a_run_that_stalls_says_so_and_goes_on_as_statics_does(monkeypatch):
    scene, asked = slow_path(monkeypatch, True)
    with pytest.warns(ModelWarning, match="only increments of .* succeed, where 0.1 was asked"):
        history = scene.run(0.3, increments=3)
    assert history.t[-1] == 0.3 and len(asked) < 300
    monkeypatch.undo()
    alone = Scene(cantilever()).clamp("left").point_force((0, -0.3), at="right").solve_static()
    assert np.allclose(history.state(-1).u, alone.u, rtol=0, atol=1e-7)


def test_a_run_that_stalls_where_statics_finds_nothing_ends_with_what_it_has(monkeypatch):
    scene, asked = slow_path(monkeypatch, False)
    with pytest.warns(ModelWarning, match="only increments of"), pytest.raises(
            ConvergenceError, match="no equilibrium found after t = 0.0") as error:
        scene.run(1.0, increments=10)
    assert len(asked) < 100 and len(error.value.state) > 20
