"""Pictures: what is drawn, without a display."""

import pickle
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_io import affine, bent, turn

from skfem_ancf import (Beam, Circle, ElasticPlastic, ElementBeamANCF, ElementBeamCable, Frame,
                        InputError, Line, MeshBeam, MissingExtra, NameUnknown, RigidBody, Scene,
                        Section, StVenantKirchhoff, Train)
from skfem_ancf.recovery.fields import DRAWN, FIELDS
from skfem_ancf.visuals.matplotlib import plot_state

STEEL = StVenantKirchhoff(E=1e6, nu=0.3, density=1.0)


def drawn(ax):
    """The coloured patches."""
    return next(c for c in ax.collections if type(c).__name__ == "TriMesh")


@pytest.fixture(scope="module")
def state():
    return bent()


@pytest.fixture(scope="module")
def yielding():
    beam = Beam(MeshBeam.init_line([0, 0.3, 1.0], height=0.1), ElementBeamANCF(2),
                ElasticPlastic(1e6, 0.3, yield_stress=1e4, hardening=1e5, strength=3e4), 0.1)
    return Scene(beam).clamp("left").moment("right", 2.4).solve_static()


@pytest.mark.parametrize("field", DRAWN)
def test_every_field_is_drawn_and_named(state, yielding, field):
    if field in ("plastic_strain", "yield_ratio", "dissipated", "utilisation"):
        state = yielding
    ax = state.plot(field)
    assert ax.get_title(loc="left") == FIELDS[field].title
    low, high = drawn(ax).get_clim()
    values = drawn(ax).get_array()
    start = FIELDS[field].neutral
    assert high - start == pytest.approx(abs(values - start).max())
    assert low == pytest.approx(2 * start - high if FIELDS[field].signed else start)
    assert ax.get_aspect() == 1.0


def test_picture_files(state, tmp_path):
    for suffix in ("png", "pdf", "svg"):
        path = tmp_path / "new" / f"beam.{suffix}"
        state.plot(filename=path, dpi=60)
        assert path.stat().st_size > 2000
    assert len(list(path.parent.iterdir())) == 3


def test_png_shows_both_signs(state, tmp_path):
    from matplotlib.image import imread

    state.plot("S_xx", colorbar=False, filename=tmp_path / "beam.png", dpi=80)
    rgb = imread(tmp_path / "beam.png")[..., :3]
    assert np.sum((rgb[..., 0] > 0.6) & (rgb[..., 2] < 0.3)) > 20   # red: tension
    assert np.sum((rgb[..., 2] > 0.5) & (rgb[..., 0] < 0.4)) > 20   # blue: compression


def test_slender_beams_are_drawn_thicker_and_say_so():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamANCF(2), STEEL, 1)
    state = affine(beam, turn(0.5))
    ax = state.plot()
    assert [t.get_text() for t in ax.texts] == ["section drawn 4 times as thick"]
    thick = drawn(state.plot(thickness=8))._triangulation
    # turned back, the section is 8 times 0.01 high
    across = turn(-0.5) @ np.array([thick.x, thick.y])
    assert_allclose([across[1].min(), across[1].max()], [-0.04, 0.04], atol=1e-14)
    assert_allclose([across[0].min(), across[0].max()], [0, 1], atol=1e-14)
    assert not state.plot(thickness=1).texts


def test_limits_clip_with_arrows(state):
    ax = state.plot("S_xx", limits=(-1, 2))
    image = drawn(ax)
    assert image.get_clim() == (-1, 2) and image.colorbar.extend == "both"
    assert drawn(state.plot("S_xx")).colorbar.extend == "neither"


@pytest.mark.parametrize("options, error, message", [
    (dict(field="eps_zz"), NameUnknown, "known: 'displacement'"),
    (dict(thickness=0), InputError, "thickness must be positive"),
    (dict(thickness="thick"), InputError, "thickness must be a number"),
    (dict(limits=(1, 1)), InputError, "must increase"),
    (dict(limits=1), InputError, "two numbers"),
    (dict(limits=(np.nan, 1)), InputError, "finite"),
    (dict(subdivide=(0, 1)), InputError, "positive integers"),
    (dict(scale=0), InputError, "scale must be positive"),
    (dict(scale="large"), InputError, "scale must be a number"),
    (dict(loads=1), InputError, "loads must be True or False"),
])
def test_bad_options(state, options, error, message):
    with pytest.raises(error, match=message):
        state.plot(**options)


def test_without_matplotlib(state, monkeypatch):
    for name in [m for m in sys.modules if m.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r'pip install "skfem-ancf\[plot\]"'):
        state.plot()


def test_colour_bars_say_the_unit(state):
    def labels(**options):
        ax = state.plot("S_xx", **options)
        return {text for bar in (*ax.figure.axes, *ax.child_axes)
                for text in (bar.get_xlabel(), bar.get_ylabel())} - {
                    "x", "y", "", "x (mm)", "y (mm)"}

    assert labels(unit="Pa") == {"$S_{xx}$ (Pa)"} and labels(unit="") == {"$S_{xx}$"}
    assert labels() == {"$S_{xx}$ (force / area)"}
    scene = Scene(line()).units("N", "mm")
    state = scene.state()
    assert labels() == {"$S_{xx}$ (MPa)"}
    state = scene.replace(beams=[line(4)]).state()
    assert labels() == {"$S_{xx}$ (MPa)"}
    with pytest.raises(InputError, match="length must be"):
        scene.units("N", "")
    with pytest.raises(InputError, match="unit must be a text"):
        state.plot("S_xx", unit=1)


def test_the_bar_of_a_function_without_a_name_says_the_unit(state):
    ax = state.plot(lambda v: 1e-6 * v["S_xx"], unit="MPa")
    found = {text for bar in ax.figure.axes for text in (bar.get_xlabel(), bar.get_ylabel())}
    assert "(MPa)" in found and not any("lambda" in text for text in found)


def test_several_states_share_a_picture():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamANCF(2),
                StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.02)
    history = Scene(beam).pin("left").gravity((0, -9.81)).integrate(0.2, 0.02)
    ax = history.plot("eps_xx", [0, 0.1, 0.199], thickness=1, subdivide=(4, 2))
    images = [c for c in ax.collections if c.get_array() is not None]
    outlines = [c for c in ax.collections if len(c.get_paths()) == 3]
    alone = [history.state(k).plot("eps_xx", thickness=1, subdivide=(4, 2)) for k in (0, 5, 10)]
    own = np.concatenate([c.get_array() for one in alone for c in one.collections
                          if c.get_array() is not None])
    assert len(images) == 3 and not outlines and len(ax.figure.axes) == 2
    np.testing.assert_allclose(np.concatenate([one.get_array() for one in images]), own,
                               atol=1e-12 + 1e-6 * np.abs(own).max())
    first, second, last = (one.get_alpha() for one in images)
    assert 0.1 < first < second < 0.9 and last is None
    rims = [c for c in ax.collections if type(c).__name__ == "LineCollection"]
    assert len(rims) == 3 and min(c.get_zorder() for c in rims) > max(
        c.get_zorder() for c in images)  # no state hides another
    assert len([c for c in ax.collections if type(c).__name__ == "PolyCollection"]) == 1
    assert len(history.plot(times=0.1, undeformed=False).collections) == 2
    assert len(history.plot().collections) == 1 + 2 * 8
    states = [history.state(k) for k in (0, 5, 10)]
    together = plot_state(states, "eps_xx", thickness=1, subdivide=(4, 2)).collections
    assert [c.get_alpha() for c in together] == [None] * 3
    with pytest.raises(InputError, match="no state to draw"):
        plot_state([])
    for wrong in (["x"], [], 0.3, [-1e-3, 0.1]):
        with pytest.raises(InputError, match="times"):
            history.plot(times=wrong)


def test_the_default_field_is_the_stress_along_the_beam_or_the_displacement(state):
    assert state.plot().get_title(loc="left") == FIELDS["S_xx"].title
    rest = Scene(line()).state()
    assert rest.plot().get_title(loc="left") == FIELDS["displacement"].title
    bare = Beam(MeshBeam.init_line([0, 1], 0.1), ElementBeamCable(5),
                section=Section.numbers(EA=1e5, EI=10.0))
    bent = Scene(bare).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    assert bent.plot().get_title(loc="left") == FIELDS["displacement"].title


def test_beside_obstacles_sections_are_to_scale_and_all_of_them_is_seen():
    thin = Beam(MeshBeam.init_line(np.linspace(0, 2, 9), 0.01), ElementBeamCable(5), STEEL, 0.1)
    ax = Scene(thin).clamp("left").gravity((0, -1e-3)).obstacle(Circle((1.0, -0.3), 0.25)).plot()
    assert not ax.texts or all("thick" not in text.get_text() for text in ax.texts)
    state = Scene(thin).clamp("left").obstacle(Circle((1.0, -0.3), 0.25)).state()
    low, high = state.plot().get_ylim()
    assert low < -0.55 and high > 0.0
    assert any("thick" in text.get_text() for text in Scene(thin).state().plot().texts)


def test_axes_and_loads_have_units():
    scene = Scene(line()).units("N", "mm").clamp("left").point_force((0, -25e3), at=(2, 0))
    ax = scene.moment("right", 7.0).pressure("top", 3.0).plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (mm)", "y (mm)")
    found = {text.get_text() for text in ax.texts}
    assert {"25 kN", "7 N mm", "p = 3 N/mm²"} <= found
    assert scene.state().plot().get_xlabel() == "x (mm)"


# symbols, and displacements that are magnified

def line(n=8, element=None, **options):
    return Beam(MeshBeam.init_line(np.linspace(0, 2, n + 1), height=0.1, **options),
                element or ElementBeamANCF(2), STEEL, width=0.1, name="arm")


def marked(ax, kind):
    """The artists of a kind of symbol."""
    return ax.findobj(lambda artist: artist.get_gid() == kind)


def arrows(ax, kind="force"):
    """Tail and tip of each arrow; of a moment all points of its arc."""
    return [np.array(a.get_path().vertices) if a._path_original is None else
            a._path_original.vertices for a in marked(ax, kind)
            if type(a).__name__ == "FancyArrowPatch"]


def texts(ax, kind=None):
    return [t.get_text() for t in ax.texts if kind in (None, t.get_gid())]


def test_a_scene_is_drawn_before_it_is_solved():
    scene = (Scene(line()).clamp("left").point_force((0, -2.5), at=(2, 0))
             .point_force((0, -5), at=(1, 0)).moment("right", -3))
    ax = scene.plot()
    (tail, tip), (far, middle) = arrows(ax)
    assert_allclose([tip, middle], [(2, 0), (1, 0)], atol=1e-12)
    assert_allclose([tail[0], far[0]], [2, 1], atol=1e-12)
    assert far[1] > tail[1] > 0.1  # from above, the larger force by the longer arrow
    arc, = arrows(ax, "moment")
    assert_allclose(np.hypot(*(arc - [2, 0]).T), np.hypot(*(arc[0] - [2, 0])))
    turned = np.unwrap(np.arctan2(*(arc - [2, 0]).T[::-1]))
    assert turned[-1] < turned[0] - np.pi  # clockwise
    assert texts(ax, "force") == ["2.5", "5"] and texts(ax, "moment") == ["3"]
    assert not texts(ax, "name") and not marked(ax, "node")
    support = np.vstack([a.get_xydata() for a in marked(ax, "support")])
    assert support[:, 0].max() < 1e-9 and abs(support[:, 1]).max() < 0.15
    ax = scene.plot(names=True, nodes=True, loads=False)
    assert texts(ax) == ["arm"] and not arrows(ax)
    assert_allclose(marked(ax, "node")[0].get_xydata()[:, 0], np.linspace(0, 2, 9))
    low, high = ax.get_xlim()
    assert low < support[:, 0].min() and high > 2


def test_a_displacement_that_follows_time_is_drawn_as_a_support():
    def supports(value):
        ax = Scene(line()).clamp("left").fix("right", "r^2", displacement=value).plot()
        return len(marked(ax, "support"))

    assert supports(lambda t: -0.1 * t) == supports(-0.1) > 0


def test_a_force_that_pulls_at_an_end_is_drawn_outside():
    (tail, tip), = arrows(Scene(line()).clamp("left").point_force((4, 0), at=(2, 0)).plot())
    assert_allclose(tail, (2, 0), atol=1e-12)
    assert tip[0] > 2.1


def test_distributed_loads_are_rows_of_arrows():
    ax = Scene(line()).clamp("left").line_load(lambda x: np.array([0 * x[0], -x[0]])).plot()
    found = np.array(arrows(ax))
    assert_allclose(found[:, 1], np.stack([found[:, 1, 0], np.zeros(len(found))], 1), atol=1e-12)
    length = found[:, 0, 1]
    assert_allclose(length / length.max(), found[:, 1, 0] / 2, atol=1e-12)  # as the load
    assert len(found) == 8 and texts(ax) == ["2"]
    below = np.array(arrows(Scene(line()).clamp("left").pressure("bottom", 7.0).plot()))
    assert len(below) == 9 and np.all(below[:, 0, 1] < below[:, 1, 1] - 0.05)
    assert_allclose(below[:, 1, 1], -0.05)
    end = np.array(arrows(Scene(line()).clamp("left").pressure("right", 7.0).plot()))
    assert_allclose(end[0, :, 1], 0, atol=1e-12)
    assert end[0, 1, 0] < end[0, 0, 0]


def test_follower_loads_turn_with_the_body():
    beam = line()
    for scene, start in ((Scene(beam).follower_force((0, -1), at=(2, 0)), (0, -1)),
                         (Scene(beam).pressure("top", 1.0), (0, -1)),
                         (Scene(beam).point_force((0, -1), at=(2, 0)), None)):
        scene.clamp("left")
        u = affine(beam, turn(0.5)).u
        found = np.array(arrows(scene.state(u).plot(loads=True)))
        d = (found[:, 1] - found[:, 0]).T
        wanted = (0, -1) if start is None else turn(0.5) @ start
        assert_allclose(d / np.hypot(*d), np.transpose([wanted] * len(found)), atol=1e-9)


def test_loads_of_a_state_have_its_load_factor():
    scene = Scene(line()).clamp("left").point_force((0, -8), at=(2, 0)).gravity((0, -9.81))
    assert texts(scene.state(load=0.5).plot(loads=True, thickness=1), "force") == ["4"]
    assert not texts(scene.state(load=0.5).plot(supports=True), "force")
    assert texts(scene.plot(), "weight") == ["g = 9.81"]


@pytest.mark.parametrize("hold, number", [
    (lambda s: s.clamp("left"), 7), (lambda s: s.clamp("left", thickness="free"), 7),
    (lambda s: s.pin("left"), 8), (lambda s: s.fix("left", "r^2"), 8),
    (lambda s: s.fix("left", "r^1").joint("plane", at="left"), 8),
    (lambda s: s.fix("left", "r^1").fix("left", "r^2"), 8)])
@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamCable(5)])
def test_what_is_held_at_one_place_is_one_symbol(hold, number, element):
    scene = Scene(line(element=element))
    hold(scene)
    ax = scene.plot()
    assert len(marked(ax, "support")) == number  # a line and six hatches, and one more


def test_joints_springs_masses_bodies_and_obstacles_are_drawn():
    body = RigidBody(1.0, 1.0, (2, 0), name="bob")
    beam = line()
    scene = Scene(beam, body).pin("left", 0).point_mass(3, at=(0.5, 0), beam=0)
    scene.hinge((0, "right"), (body, (2, 0)))
    scene.spring(40.0, ((0, (1, 0)), ("ground", (1, 0.5))))
    scene.torsional_spring(6.0, "left", beam=0).foundation(9.0, beam=0)
    scene.slider((body, (2, 0)), "ground", (0, 1))
    scene.obstacle(Circle((0.3, 0.5), 0.2))
    ax = scene.plot(names=True)
    assert texts(ax, "mass") == ["m = 3"] and texts(ax, "torsional spring") == ["k = 6"]
    assert texts(ax, "name") == ["arm", "bob"] and "k = 9" in texts(ax, "foundation")
    spring = marked(ax, "spring")[0].get_xydata()
    assert_allclose(spring[[0, -1]], [(1, 0), (1, 0.5)], atol=1e-12)
    for kind in ("joint", "mass"):
        at, = (a.get_xydata()[0] for a in marked(ax, kind) if hasattr(a, "get_xydata"))
        assert_allclose(at, {"joint": (2, 0), "mass": (0.5, 0)}[kind], atol=1e-12)
    assert len(marked(ax, "slider")) == 3
    wall = np.vstack([c.get_segments() for c in ax.collections
                      if len(c.get_paths()) > 20 and hasattr(c, "get_segments")])
    assert_allclose(np.hypot(*(wall.reshape(-1, 2) - [0.3, 0.5]).T), 0.2)


def test_frames_show_what_holds_and_loads_their_nodes():
    frame = Frame.from_lines([(0, 0), (0, 3), (4, 3), (4, 0)], [(0, 1), (1, 2), (2, 3)], hinges=[2],
                             nodes={"ground": [0, 3]}, material=STEEL, height=0.2, width=0.1)
    frame.clamp(0).pin(3).point_force((7, 0), at=1).moment(1, 2.0).line_load((0, -1))
    ax = frame.plot()
    assert sorted(texts(ax)) == ["1", "2", "7"]
    assert len(marked(ax, "support")) == 7 + 8
    assert_allclose([a.get_xydata()[0] for a in marked(ax, "joint")], [(4, 3)])
    assert any(np.allclose(tip, (0, 3)) for _, tip in arrows(ax))


def test_supports_of_frames_are_outside_of_them():
    def support(points, lines):
        frame = Frame.from_lines(points, lines, material=STEEL, height=0.2, width=0.1)
        return np.vstack([a.get_xydata() for a in marked(frame.clamp(0).plot(), "support")])

    assert support([(0, 0), (3, 0)], [(0, 1)])[:, 0].max() < 1e-9
    assert support([(0, 0), (0, 3)], [(0, 1)])[:, 1].max() < 1e-9
    assert support([(0, 0), (0, -3)], [(0, 1)])[:, 1].min() > -1e-9


def test_instants_of_a_motion_show_loads_of_their_time():
    scene = Scene(line()).clamp("left").point_force((0, -4), at=(2, 0), amplitude=lambda t: 10 * t)
    history = scene.integrate(0.1, 0.05)
    assert texts(history.plot(times=[0.05], loads=True, thickness=1), "force") == ["2"]


def test_loads_that_move_are_drawn_where_they_are():
    def tips(ax):
        return sorted(float(tip[0]) for _, tip in arrows(ax))

    scene = Scene(line()).clamp("left").point_force((0, -4), at=lambda t: (4 * t, 0))
    assert_allclose(tips(scene.plot()), [0], atol=1e-12)  # at the start; at the time 1 it is away
    history = scene.integrate(0.5, 0.25)
    assert_allclose(tips(history.plot(times=[0.25], loads=True, scale=1e-9)), [1], atol=1e-9)
    lorry = Scene(line()).clamp("left").add(Train([1, 2], [0, 0.5], speed=1.0, start=1.5))
    assert_allclose(tips(lorry.plot()), [1, 1.5], atol=1e-12)
    assert texts(lorry.plot()) == ["1", "2"]
    rising = Scene(line()).clamp("left").line_load(lambda x, t: np.array([0 * x[0], -t + 0 * x[0]]))
    assert texts(rising.plot()) == ["1"]  # nothing at the start
    history = rising.integrate(0.5, 0.25)
    assert texts(history.plot(times=[0.5], loads=True, thickness=1), "force") == ["0.5"]


def test_scale_magnifies_displacements_and_says_so():
    scene = Scene(line()).clamp("left").point_force((0, -0.02), at=(2, 0))
    state = scene.solve_static()
    one, ten = (drawn(state.plot("S_xx", thickness=1, scale=k)) for k in (1, 10))
    x, many = (np.array([c._triangulation.x, c._triangulation.y]) for c in (one, ten))
    start = drawn(scene.state().plot("S_xx", thickness=1))._triangulation
    start = np.array([start.x, start.y])
    assert_allclose(many - start, 10 * (x - start), atol=1e-12)
    assert_allclose(one.get_array(), ten.get_array())  # the field is that of the state
    assert texts(state.plot(thickness=1, scale=10)) == ["displacements 10 times as large"]
    ax = state.plot(thickness=1, scale="auto", loads=True)
    note = texts(ax)[-1]
    factor = float(note.split()[1])
    tip = state.displacement((2, 0))
    assert 0.04 < factor * abs(tip[1]) / 2 < 0.13
    assert_allclose(arrows(ax)[0][1], (2, 0) + factor * tip, atol=1e-12)
    large = Scene(line()).clamp("left").point_force((0, -5), at=(2, 0)).solve_static()
    assert not large.plot(thickness=1, scale="auto").texts


def test_zero_is_seen_on_white():
    image = drawn(Scene(line()).state().plot("S_xx"))
    assert np.dot(image.to_rgba(0.0)[:3], [0.3, 0.6, 0.1]) < 0.85


def test_layers_have_the_colours_of_their_materials():
    brass = StVenantKirchhoff(E=2e6, nu=0.3)
    strip = Beam(MeshBeam.init_line(np.linspace(0, 2, 5), height=0.3), ElementBeamANCF(2),
                 section=Section.layers((0.1, STEEL), (0.2, brass), width=0.1))
    ax = Scene(strip).clamp("left").plot(thickness=1)
    below, above = (np.concatenate([p.vertices for p in c.get_paths()])[:, 1]
                    for c in marked(ax, "layer"))
    assert_allclose([below.min(), below.max(), above.min(), above.max()],
                    [-0.15, -0.05, -0.05, 0.15], atol=1e-8)
    assert [t.get_text().split("\n")[1] for t in ax.get_legend().get_texts()] == [
        "E = 1e+06, ν = 0.3", "E = 2e+06, ν = 0.3"]
    colours = {tuple(c.get_facecolor()[0]) for c in marked(ax, "layer")}
    assert colours == {p.get_facecolor() for p in ax.get_legend().get_patches()}
    assert len(colours) == 2 and Scene(line()).plot().get_legend() is None
    many = [Beam(line().mesh.translated((0, k)), ElementBeamANCF(2),
                 StVenantKirchhoff(1e6 * (k + 1), 0.3), width=0.1) for k in range(9)]
    assert not marked(Scene(*many).plot(), "layer")  # no colour stands for two materials
    assert len(marked(Scene(*many[1:]).plot(), "layer")) == 8


def test_what_acts_along_a_body_is_written_beside_it():
    warm = StVenantKirchhoff(E=1e6, nu=0.3, density=1.0, thermal_expansion=1e-5)
    scene = Scene(Beam(line().mesh, ElementBeamANCF(2), warm, width=0.1, name="arm")).clamp("left")
    scene.temperature(20.0).eigenstrain(xx=lambda x, y: 1e-4 * x).drag(1.2, 1.0)
    scene.control(lambda t: 3.0 * t, at=(0, "right"), kind="moment")
    ax = scene.plot()
    assert texts(ax, "eigenstrain") == ["ΔT = 20, eps_xx(x, y)"] and texts(ax, "drag") == ["drag"]
    assert texts(ax, "control") == ["moment(t, ...)"]
    state = scene.state(load=0.5)
    assert texts(state.plot(loads=True), "eigenstrain") == ["ΔT = 10, eps_xx(x, y)"]
    assert not texts(state.plot(loads=True), "drag")
    places = [a.xy for a in scene.plot().texts if a.get_gid() in ("eigenstrain", "drag")]
    assert np.hypot(*np.subtract(*places)) > 0.05  # they do not lie over each other


def test_a_motor_is_not_a_clamp():
    scene = Scene(line()).pin("left")
    scene.motor((0, "left"), speed=-2.0)
    ax = scene.plot()
    arc, = arrows(ax, "motor")
    turned = np.unwrap(np.arctan2(*arc.T[::-1]))
    assert turned[-1] < turned[0] - np.pi and len(marked(ax, "support")) == 8
    still = Scene(line()).pin("left")
    still.joint("angle", at="left", angle=lambda t: 0.0)
    ax = still.plot()
    assert not arrows(ax, "motor") and len(marked(ax, "support")) == 7  # a clamp


def test_supports_within_a_beam_are_small():
    ax = Scene(line()).clamp((1, 0)).plot()
    wide = np.ptp(np.vstack([a.get_xydata() for a in marked(ax, "support")])[:, 0])
    assert wide < 0.2
    scene = Scene(line())
    scene.joint("position", at=(2, 0), r=lambda t: (2, 0))
    scene.joint("angle", at=(2, 0), angle=lambda t: 0.0)
    assert np.vstack([a.get_xydata() for a in marked(scene.plot(), "support")])[:, 0].min() > 1.999


def test_values_are_not_written_over_arrows():
    ax = (Scene(line()).clamp("left").point_force((0, -5), at=(1, 0)).pressure("top", 3)).plot()
    at = {a.get_text(): a.xy for a in ax.texts}
    assert abs(at["p = 3"][0] - 1) > 0.2 and abs(at["5"][0] - 1) < 1e-9


def test_obstacles_beside_the_body_are_seen():
    ax = Scene(line()).clamp("left").obstacle(Line((0, -0.7))).obstacle(
        Circle((1, 0.7), 0.2)).plot()
    low, high = ax.get_ylim()
    assert low < -0.7 and high > 0.9
    far = Scene(line()).clamp("left").obstacle(Line((0, -50))).plot()
    assert far.get_ylim()[0] > -1


def test_what_is_wrong_with_a_plot_of_a_scene_is_said():
    scene = Scene(line()).clamp("left")
    with pytest.raises(InputError, match="names must be True or False"):
        scene.plot(names="arm")
    with pytest.raises(InputError, match=r"scene\.plot\(\)"):
        pickle.loads(pickle.dumps(scene.state())).plot(loads=True)
