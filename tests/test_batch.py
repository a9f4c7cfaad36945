"""Members of one topology, solved together: against themselves alone, and closed forms."""

import itertools
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, InputError,
                        MeshBeam, NeoHookean, Scene, StVenantKirchhoff, batch, members, sweep)
from skfem_ancf.alike import Unlike
from skfem_ancf.batch import Batch, Lane
from skfem_ancf.errors import NameUnknown, PickleError, StabilityWarning, SweepWarning
from skfem_ancf.joints import OnLine
from skfem_ancf.members import Sweep
from skfem_ancf.obstacles import Circle
from skfem_ancf.polynomials import MOST, Polynomial
from skfem_ancf.readings import Readings

TIP = {"tip": ("displacement", "right"), "end": ("position", "right")}
ELEMENTS = {"section": ElementBeamANCF(2), "cubic": ElementBeamANCFCubic(2),
            "cable": ElementBeamCable(5)}


def cantilever(E=2e8, b=0.01, h=0.02, L=1.0, F=1e-3, kind="cable", law=StVenantKirchhoff, n=4):
    mesh = MeshBeam.init_line(np.linspace(0, L, n + 1), height=h)
    beam = Beam(mesh, ELEMENTS[kind], law(E, 0.3, 1000.0), width=b)
    return Scene(beam).clamp("left").gravity((0, -1.0)).point_force((0, -F), at=(L, 0))


def guided(E=2e8, L=1.0, turn=0.5, F=1e-3, hold="clamp", n=4):
    """A cable at an angle, held by equations of joints."""
    mesh = MeshBeam.init_line(np.linspace(0, L, n + 1), height=0.02, angle=turn)
    beam, tip = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(E, 0.3, 1000.0), 0.01), mesh.p[
        :, -1]
    scene = Scene(beam).gravity((0, -1.0)).point_force((0, -F), at=tuple(tip))
    if hold == "clamp":
        return scene.clamp("left")
    way = np.cos(turn + 0.7), np.sin(turn + 0.7)
    return scene.pin("left").add(OnLine(tuple(tip), way, through=tip + (0.01, 0.0)))


def arc(R, M, kind="cubic"):
    mesh = MeshBeam.init_curve(lambda s: (R * np.sin(s), R * (1 - np.cos(s))),
                               np.linspace(0, np.pi / 2, 5), 0.05)
    return Scene(Beam(mesh, ELEMENTS[kind], StVenantKirchhoff(2e8, 0.3), width=0.02)
                 ).clamp("left").moment("right", M)


def column(force, E=2e8):
    """Pushed beyond Euler's load, and aside by a force of either sign."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.02)
    return Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(E, 0.3), width=0.01)
                 ).clamp("left").point_force((-4.5, force), at=(1, 0))


def drawn(n, **ranges):
    rng = np.random.default_rng(2)
    return {name: rng.uniform(*ends, n) for name, ends in ranges.items()}


def alone(build, table, k):
    scene = build(**{name: values[k] for name, values in table.items()})
    return scene.solve_static().displacement(tuple(scene.beams[0].mesh.p[:, -1]))


def test_what_is_solved_together_stays_in_arrays(monkeypatch):
    apart, dicts = members._with_blocks, []
    monkeypatch.setattr(members, "_with_blocks",
                        lambda *args: dicts.append(args) or apart(*args))
    result = sweep(cantilever, drawn(40, E=(2e8, 3e8)), TIP, workers=1)
    assert not dicts and result["tip"].shape == (40, 2) and len(result) == 40
    assert set(result.status) == {"done"} and not result.failures


def test_blocks_and_members_by_themselves_are_one_sweep():
    x = np.arange(5.0)
    blocks = [(np.array([3, 0]), {"a": np.array([[3.0, 30.0], [0.0, 0.5]])})]
    found = [None, {"a": np.array([1.0, 10.0])}, "Error: why", None, None]
    both = Sweep({"x": x}, found, "", blocks)
    assert both.status.tolist() == ["done", "done", "failed", "done", "open"]
    assert_array_equal(both["a"], [[0, 0.5], [1, 10], [np.nan] * 2, [3, 30], [np.nan] * 2])
    assert [(f.member, f.error) for f in both.failures] == [(2, "Error: why")]
    alone = Sweep({"x": x}, 5 * [None], "", blocks)
    assert alone.status.tolist() == ["done", "open", "open", "done", "open"]
    assert_array_equal(alone["a"][[0, 3, 4]], [[0, 0.5], [3, 30], [np.nan] * 2])
    other = (np.array([1]), {"b": np.array([1.0])})
    assert [f.member for f in Sweep({"x": x}, 5 * [None], "", [*blocks, other]).failures] == [1]


def compare(build, table, n, rtol=1e-8, least=None):
    result = sweep(build, table, TIP, workers=1)
    together = int(result.report.split(" of ")[0])
    assert together >= (n if least is None else least), result.report
    for k in (0, n // 2, n - 1):
        assert_allclose(result["tip"][k], alone(build, table, k), rtol=rtol, atol=1e-12)
    return result


@pytest.mark.parametrize("hold", ["clamp", "line"])
@pytest.mark.parametrize("ranges", [{"E": (2e8, 3e8), "F": (-1e-3, 1e-3)},
                                    {"turn": (0.3, 0.6), "L": (1.0, 1.2)}])
def test_what_is_held_at_an_angle(hold, ranges):
    def build(**floats):
        return guided(**floats, hold=hold)

    compare(build, drawn(400, **ranges), 400)


def test_joints_of_their_own_place_that_rest_keep_members_together():
    scene = guided(F=0.0)
    assert scene.system.m and not scene.system.machine.tables.alone

    def unloaded(E):
        scene = guided(E=E)
        return scene.replace(loads=[])

    result = sweep(unloaded, drawn(20, E=(2e8, 3e8)), TIP, workers=1)
    assert "20 of 20 members were solved together" in result.report
    assert_array_equal(result["tip"], 0.0)
    scene.joint("angle", at="right", angle=lambda t: 0.1 * t)
    assert "joints move" in scene.system.machine.tables.alone


@pytest.mark.parametrize("kind, law", [("section", StVenantKirchhoff), ("cable", StVenantKirchhoff),
                                       ("cubic", NeoHookean)])
def test_material_width_and_load(kind, law):
    table = drawn(48, E=(1.6e8, 2.4e8), b=(0.008, 0.012), F=(0.0, 0.01))
    result = compare(lambda **p: cantilever(kind=kind, law=law, n=2, **p), table, 48)
    assert_allclose(result["end"] - result["tip"], np.tile([1.0, 0.0], (48, 1)), atol=1e-15)


@pytest.mark.parametrize("kind", ["section", "cable"])
def test_geometry(kind):
    """Lengths and heights, in powers of which tables are not short polynomials."""
    table = drawn(400, h=(0.018, 0.022), L=(0.9, 1.1))
    result = compare(lambda **p: cantilever(kind=kind, n=2, **p), table, 400)
    assert_allclose((result["end"] - result["tip"])[:, 0], table["L"], rtol=1e-13)


def test_curves_and_their_radius():
    compare(arc, drawn(160, R=(0.9, 1.1), M=(0.0, 0.02)), 160)


def test_small_deflections():
    b, h = 0.01, 0.02
    table = drawn(300, E=(1e9, 2e9), F=(1e-4, 2e-4), L=(0.9, 1.1))
    result = sweep(lambda **p: cantilever(**p).replace(
        material=StVenantKirchhoff(p["E"], 0.3, 1e-9)), table, ("displacement", "right"))
    E, F, L = table.values()
    assert_allclose(-result["value"][:, 1], F * L**3 / (3 * E * b * h**3 / 12), rtol=1e-4)
    assert "300 of 300" in result.report


def test_threads_and_chunks_change_nothing(monkeypatch):
    table = drawn(300, E=(1e8, 2.4e8), F=(0.0, 0.01))
    one = sweep(cantilever, table, TIP, workers=1)
    monkeypatch.setattr(batch, "CHUNK", 50)
    three = sweep(cantilever, table, TIP, workers=3)
    assert_array_equal(one["tip"], three["tip"])
    assert one.report == three.report and "from a polynomial" in one.report
    assert ", 0 from zero" in one.report


def test_no_branch_is_changed(monkeypatch):
    """Beyond Euler's load the column leans to the side of its small force: no polynomial."""
    monkeypatch.setattr(batch, "STARTS", 1)
    forces = np.linspace(-0.11, 0.1, 24)
    result = sweep(column, {"force": forces}, ("displacement", (1, 0)))
    assert_array_equal(np.sign(result["value"][:, 1]), np.sign(forces))
    assert np.min(np.abs(result["value"][:, 1])) > 0.3
    for k in (0, 12, 23):
        assert_allclose(result["value"][k], alone(column, {"force": forces}, k), rtol=1e-7)


def upright(load, kind):
    """Pushed along its axis, by a part of Euler's load."""
    mesh = MeshBeam.init_line(np.linspace(0, 1, 4), height=0.02)
    beam = Beam(mesh, ELEMENTS[kind], StVenantKirchhoff(2e8, 0.3), width=0.01)
    return Scene(beam).clamp("left").point_force((-load * EULER, 0), at=(1, 0))


EULER = np.pi**2 / 4 * 2e8 * 0.01 * 0.02**3 / 12


@pytest.mark.parametrize("kind", ["section", "cable"])
def test_a_sweep_through_a_buckling_load_says_what_each_member_says_alone(kind):
    """The straight column is in equilibrium, and its tangent the one thing that tells."""
    loads = np.append(np.linspace(0.5, 0.98, 41), np.linspace(1.06, 1.2, 9))
    with pytest.warns(StabilityWarning) as said:
        result = sweep(lambda load: upright(load, kind), {"load": loads}, ("position", "right"))
    assert "41 of 50 members were solved together" in result.report and not result.failures
    assert len([w for w in said if w.category is StabilityWarning]) == 9
    aside = np.abs(result["value"][:, 1])
    assert np.all(aside[:41] < 1e-12) and np.all(aside[41:] > 0.2)
    for k in (20, 41, 49):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StabilityWarning)
            its = upright(loads[k], kind).solve_static().displacement((1, 0)) + [1, 0]
        assert_allclose(result["value"][k], its, rtol=1e-7, atol=1e-12)


def test_a_start_far_from_the_branch_is_not_followed():
    """Starts that are wrong are seen, and those members are solved from zero."""
    x = np.linspace(1e8, 2e8, 300)[:, None]
    made = Batch(lambda x: cantilever(E=float(x[0])), Readings(TIP).items, x)
    which = np.arange(40)
    u, found, good, _ = made.solve(made.lane, which)
    assert good.all() and (found[:, 2] == 1).all() and found[:, 1].max() <= 2
    start = made.start
    made.start = lambda x: start(x) * np.where(x > x[20], 3.0, 1.0)
    again, found, good, _ = made.solve(Lane(made.family), which)
    assert good.all() and (found[21:, 2] != 1).all()
    assert_allclose(again, u, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("kind", ["section", "cubic"])
def test_members_turned_inside_out_are_those_that_their_beams_call_so(kind):
    """Of lengths, heights and directions of their own: tables and frames differ."""
    def build(x):
        mesh = MeshBeam.init_line(np.linspace(0, x[0], 3), height=x[1], angle=x[2])
        return Scene(Beam(mesh, ELEMENTS[kind], StVenantKirchhoff(2e8, 0.3), 0.01)).clamp("left")

    rng = np.random.default_rng(4)
    x = rng.uniform([0.9, 0.018, -0.1], [1.1, 0.022, 0.1], (400, 3))
    made = Batch(build, Readings(TIP).items, x)
    which = np.arange(40)
    u = rng.standard_normal((40, made.family.one.scene.system.N)) * np.linspace(0, 1, 40)[:, None]
    good, _ = made._checked(u, made.family.values(x[which]))
    alone = [not build(x[k]).beams[0].kernel.inverted(u[k]) for k in which]
    assert_array_equal(good, alone)
    assert 3 < np.sum(good) < 37


def test_how_far_solutions_are_apart():
    u, v = np.array([[[1.0, 2.0], [0.0, 0.0], [0.1, 0.0]], [[1.0, 4.0], [0.0, 0.0], [0.0, 0.0]]])
    found = batch._apart(u, v)
    assert_allclose(found[:2], [0.5, 0.0])
    assert found[2] > 1e10


def test_points_of_one_of_several_beams():
    """By the name of an end, which each beam has, with the beam behind it."""
    def build(E):
        low, high = (Beam(MeshBeam.init_line(np.linspace(0, L, 3), 0.02), ELEMENTS["cable"],
                          StVenantKirchhoff(E, 0.3), 0.01, name=name)
                     for L, name in ((1.0, "low"), (0.5, "high")))
        scene = Scene(low, high).clamp("left", beam="low").clamp("left", beam="high")
        return scene.moment("right", 0.01, beam="low").moment("right", 0.01, beam="high")

    table = {"E": np.linspace(1e8, 2e8, 20)}
    result = sweep(build, table, {"low": ("displacement", "right", "low"),
                                  "high": ("displacement", "right", "high")})
    assert "20 of 20 members were solved together" in result.report
    kappa = 0.01 / (table["E"] * 0.01 * 0.02**3 / 12)
    for name, L in (("low", 1.0), ("high", 0.5)):
        assert_allclose(result[name][:, 1], (1 - np.cos(kappa * L)) / kappa, rtol=1e-3)


def test_what_is_not_alike_is_grouped_or_alone():
    table = [dict(E=E, n=n) for n, E in itertools.product([1, 2], np.linspace(1e9, 2e9, 20))]
    result = sweep(cantilever, [*table, dict(E=1e9, n=3)], TIP)
    assert result.report.count("20 of 20 members") == 2
    assert "1 members were solved alone: fewer than 16 are alike" in result.report
    assert_allclose(result["tip"][25], alone(cantilever, {"E": [1e9 + 5e9 / 19], "n": [2]}, 0))
    assert not result.failures and "sweep" in str(cantilever().plan())


def beside_a_circle(E):
    return cantilever(E).obstacle(Circle((5.0, 5.0), 0.1))


def stepped(E):
    return cantilever(1e9 if E < 1.5e9 else 2e9)


def rough(E):
    return cantilever(1e9 * (2.0 + abs(E - 1.51e9) / 1e9))


def restless(E):
    if 1.2e9 < E < 1.8e9:
        raise ValueError("not there")
    return cantilever(E)


@pytest.mark.parametrize("build, reason", [
    (beside_a_circle, "there are obstacles"), (stepped, "polynomials|did not suffice"),
    (rough, "polynomials|did not suffice"), (restless, "not there")])
def test_why_members_are_alone(build, reason):
    x = np.linspace(1e9, 2e9, 40)[:, None]
    with pytest.raises(Unlike, match=reason):
        Batch(lambda x: build(float(x[0])), Readings(TIP).items, x)


@pytest.mark.parametrize("first", np.linspace(1.02e9, 1.88e9, 7))
def test_a_choice_for_a_tenth_of_the_members_is_seen(first):
    """Between the places at which scenes are built to know all."""
    def build(E):
        return cantilever(E if not first < E < first + 1e8 else 2.0 * E)

    x = np.linspace(1e9, 2e9, 200)[:, None]
    with pytest.raises(Unlike, match="polynomials|did not suffice"):
        Batch(lambda x: build(float(x[0])), Readings(TIP).items, x)


def test_members_that_are_tried_are_spread_over_each_parameter():
    x = np.random.default_rng(0).uniform(size=(400, 3))
    some = batch.evenly(x, 16)
    assert 10 <= len(some) <= 15
    for column in x.T:
        assert np.max(np.diff(np.sort(column[some]), prepend=0.0, append=1.0)) < 0.3


def up_to(E):
    return cantilever(E) if E < 1.9e9 else cantilever(E).replace(width=-1.0)


@pytest.mark.parametrize("build, bad, text", [
    (cantilever, [np.nan, np.inf], "2 members were solved alone: a parameter is not finite"),
    (cantilever, [-1e9], "1 members were solved alone: build, or what is read, fails at an end"),
    (up_to, [2e9, 2.1e9], "2 members were solved alone: build, or what is read, fails at an end")])
def test_what_fails_alone_is_listed_and_the_others_stay_together(build, bad, text):
    """Members that have no value of a parameter, and those whose scene is refused."""
    E = np.insert(np.linspace(1e9, 1.8e9, 20), 7, bad)
    with pytest.warns(SweepWarning, match=f"{len(bad)} of {len(E)} members failed"):
        result = sweep(build, {"E": E}, TIP)
    assert [f.member for f in result.failures] == list(range(7, 7 + len(bad)))
    assert [str(f.parameters["E"]) for f in result.failures] == [str(x) for x in bad]
    assert np.isnan(result["tip"][7]).all() and np.isfinite(np.delete(
        result["tip"], np.s_[7:7 + len(bad)], axis=0)).all()
    assert "20 of 20 members were solved together" in result.report and text in result.report


def test_many_that_cannot_be_built_are_tried_alone():
    def build(E):
        return cantilever(E if E < 1.5e9 else -E)

    with pytest.warns(SweepWarning, match="20 of 40"):
        result = sweep(build, {"E": np.linspace(1e9, 2e9, 40)}, TIP)
    assert "40 members were solved alone: build, or what is read, failed" in result.report
    assert np.isfinite(result["tip"][:20]).all() and len(result.failures) == 20


def test_nothing_is_lost_where_functions_cannot_be_sent():
    """What is left of members solved together is solved here, though processes are asked for."""
    with pytest.warns(SweepWarning, match="1 of 21 members failed"):
        result = sweep(lambda E: cantilever(E), {"E": [*np.linspace(1e9, 2e9, 20), np.nan]}, TIP,
                       workers=2)
    assert np.isfinite(result["tip"][:20]).all() and "cannot be pickled" in result.report
    with pytest.raises(PickleError, match="cannot be pickled"):
        sweep(lambda E: cantilever(E), {"E": [1e9, 2e9]}, TIP, workers=2)


@pytest.mark.parametrize("kind", [np.array, tuple, list])
def test_parameters_that_are_vectors(kind):
    def build(force, E):
        assert isinstance(force, np.ndarray if kind is np.array else kind)
        return cantilever(E).point_force(tuple(force), at=(1, 0))

    forces = np.random.default_rng(0).uniform(-0.01, 0.01, (40, 2))
    table = [dict(force=kind(force), E=1e9 + 1e7 * k) for k, force in enumerate(forces)]
    result = sweep(build, table, ("displacement", "right"))
    assert "40 of 40 members were solved together" in result.report
    for k in (0, 39):
        assert_allclose(result["value"][k],
                        build(**table[k]).solve_static().displacement((1, 0)), rtol=1e-8)


def test_functions_of_the_state_and_a_file(tmp_path):
    measure = {"tip": ("displacement", (1, 0)),
               "root": lambda state: state.reactions("left").moment}
    result = sweep(cantilever, {"E": [1e9, 2e9]}, measure, path=tmp_path / "a.npz")
    assert result["root"].shape == (2,) and "function of the State" in result.report
    table = {"E": np.linspace(1e9, 2e9, 20)}
    first = sweep(cantilever, table, TIP, path=tmp_path / "b.npz")
    again = sweep(cantilever, table, TIP, path=tmp_path / "b.npz")
    assert_array_equal(first["tip"], again["tip"])
    assert "20 of 20" in first.report and again.report == ""


@pytest.mark.parametrize("measure, error, text", [
    ("tip", InputError, "function of the scene"), ({}, InputError, "empty"),
    (("speed", (1, 0)), NameUnknown, "displacement"), (("position",), InputError, "a pair"),
    ({"x": 3}, InputError, "a pair"), (("position", None), InputError, "needs a point")])
def test_measures_that_are_none(measure, error, text):
    with pytest.raises(error, match=text):
        sweep(cantilever, {"E": [1e9]}, measure)


def test_polynomials_grow_where_they_have_to():
    asked = []

    def function(x):
        asked.append(x)
        return np.array([1.0 + x[0] * x[1] * x[2], np.exp(x[1])])

    p = Polynomial(function, np.zeros(3), np.full(3, 2.0),
                   lambda surplus, largest: np.max(np.abs(surplus)) / 1e-13, 200)
    x = np.random.default_rng(0).uniform(0, 2, (20, 3))
    assert_allclose(p(x), np.array([1.0 + np.prod(x, axis=1), np.exp(x[:, 1])]).T, rtol=1e-12)
    assert p.rest <= 1.0 and len(asked) == p.asked < 45  # of 17 along one axis
    steep = Polynomial(lambda x: np.array([np.sqrt(max(x[0], 0.0))]), -np.ones(1), np.ones(1),
                       lambda surplus, largest: np.max(np.abs(surplus)) / 1e-13, 200)
    assert steep.asked == MOST and steep.rest > 1e10  # there are no more points, and it is far off
    few = Polynomial(function, np.zeros(3), np.full(3, 2.0),
                     lambda surplus, largest: np.max(np.abs(surplus)) / 1e-13, 10)
    assert few.asked == 10 and few.rest > 1.0


def options(E, given, read):
    return cantilever(E, F=1e-3 * read(given))


class Load:
    """Compared by its value, and shown without: not hashed."""

    def __init__(self, F):
        self.F = F

    def __eq__(self, other):
        return self.F == other.F

    def __repr__(self):
        return "<Load>"


@pytest.mark.parametrize("values, read", [
    ([{"F": np.where(np.arange(2000) == 1500, k, 0.0)} for k in (1, 2)], lambda x: x["F"][1500]),
    ([Load(1), Load(2)], lambda x: x.F), ([True, 1, None], lambda x: 2 if x is True else 1),
    ([True, 0.5], lambda x: 2 if x is True else 1), (["1", 1], lambda x: 2 if x == 1 else 1),
    ([np.ones((1, 2)), np.ones((2, 1))], lambda x: x.shape[0])],
    ids=["long arrays in a dict", "objects", "truth and one", "truth and floats", "texts and one",
         "equal bytes"])
def test_values_that_look_the_same_are_not_taken_for_each_other(values, read):
    table = [dict(E=2e8 + 1e6 * k, given=values[k % len(values)]) for k in range(20 * len(values))]
    result = sweep(lambda E, given: options(E, given, read), table, TIP)
    for k in range(len(values)):
        its = options(table[k]["E"], values[k], read).solve_static().displacement((1, 0))
        assert_allclose(result["tip"][k], its, rtol=1e-8)


@pytest.mark.parametrize("kind", ["cable", "section"])
@pytest.mark.parametrize("unit", [1e-6, 1e3])
@pytest.mark.parametrize("vary", ["h", "L"])
def test_members_in_other_units_are_the_same(vary, unit, kind):
    """Rows and columns of tables are powers of the unit then: the small ones are no round-off."""
    def build(h=1.0, L=1.0):
        mesh = MeshBeam.init_line(np.linspace(0, L * unit, 3), 0.1 * h * unit)
        beam = Beam(mesh, ELEMENTS[kind], StVenantKirchhoff(1e9, 0.3), width=0.1 * unit)
        force = 2e9 * 0.1 * unit * (0.1 * h * unit)**3 / 12 / unit**2
        return Scene(beam).clamp("left").point_force((0, -force), at=(L * unit, 0))

    table = drawn(100, **{vary: (0.8, 1.2)})
    result = sweep(build, table, ("displacement", "right"))
    assert "members were solved together" in result.report
    for k in range(0, 100, 10):
        scene = build(**{vary: table[vary][k]})
        its = scene.solve_static().displacement(tuple(scene.beams[0].mesh.p[:, -1]))
        assert_allclose(result["value"][k], its, rtol=1e-7, atol=1e-12 * unit)


def pulled(F, E=2e8):
    """Without a weight."""
    beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.02), ELEMENTS["cable"],
                StVenantKirchhoff(E, 0.3), width=0.01)
    return Scene(beam).clamp("left").point_force((0, -F), at=(1, 0))


def test_small_numbers_beside_large_ones_keep_their_digits():
    """Loads over twelve decades: those that would lose digits are solved alone."""
    F = np.logspace(-14, -2, 240)
    result = sweep(pulled, {"F": F}, ("displacement", "right"))
    assert_allclose(-result["value"][:100, 1] / F[:100], 4 / (2e8 * 0.01 * 0.02**3), rtol=1e-8)
    assert "digits would be lost" in result.report and "solved together" in result.report


def test_members_without_a_load_are_solved_with_the_others():
    """Of a parameter that is 0 numbers are nothing, and lose no digits."""
    table = {"F": np.tile([0.0, 1e-3, 2e-3, 4e-3], 20), "E": np.linspace(1e8, 2e8, 80)}
    result = sweep(pulled, table, TIP)
    assert "80 of 80 members were solved together" in result.report
    assert np.max(np.abs(result["tip"][::4])) < 1e-14
    assert_allclose(result["tip"][1], alone(pulled, table, 1), rtol=1e-8)


def test_members_that_are_all_the_same():
    result = sweep(cantilever, {"E": np.full(20, 2e8)}, TIP)
    assert "they are all the same" in result.report and not result.failures
    assert_array_equal(result["tip"], np.tile(alone(cantilever, {"E": [2e8]}, 0), (20, 1)))


def test_parameters_stay_what_they_are():
    values = [["1", 1], [True, 0.5], [(None, 1), (None, 2)]]
    for given in values:
        result = sweep(lambda x: 1.0, {"x": given}, lambda scene: scene)
        assert result["x"].tolist() == given
        assert [type(x) for x in result["x"]] == [type(x) for x in given]
