"""Frames whose lines are condensed to their nodes, against welded beams and closed forms."""

import meshio
import numpy as np
import pytest
from noise import alike
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, MeshBeam, Scene,
                        StVenantKirchhoff, Weight)
from skfem_ancf.core.errors import (CallbackError, FileError, InputError, MeshError, NameUnknown,
                                    SupportError)
from skfem_ancf.equations import linear_solver

E, H = 2e11, 0.02
STEEL = StVenantKirchhoff(E, 0.3, density=7800.0)
EA, EI = E * H**2, E * H**4 / 12
PORTAL = [(0, 0), (0, 1), (1, 1), (1, 0)], [(0, 1), (1, 2), (2, 3)]


def portal(clamp=True, points=PORTAL[0], **options):
    frame = Frame.from_lines(points, PORTAL[1], nodes={"ground": [0, 3], "corners": [1, 2]},
                             **{"material": STEEL, "height": H, "width": H, **options})
    return frame.clamp("ground") if clamp else frame


def square(n, size=1.0, **options):
    """A frame of n times n cells on the ground."""
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    y, x = np.divmod(number.ravel(), n + 1)
    lines = np.hstack([[number[:-1].ravel(), number[1:].ravel()],
                       [number[1:, :-1].ravel(), number[1:, 1:].ravel()]]).T
    return Frame.from_lines(size * np.column_stack([x, y]), lines, **{
        "nodes": {"ground": number[0], "side": number[1:, 0]}, "height": H, "width": H,
        "material": STEEL, **options}).clamp("ground")


def welded(frame, loads, **options):
    """The same of a beam for each line, with multipliers, and forces on its first end at nodes."""
    element = options.get("element", ElementBeamCable(5))
    n, beams, ends = options.get("elements", 1), [], {}
    for k, (i, j) in enumerate(frame.graph.lines.T):
        a, d = frame.points[:, i], frame.points[:, j] - frame.points[:, i]
        mesh = MeshBeam.init_line(np.linspace(0, np.hypot(*d), n + 1), H, a,
                                  np.arctan2(d[1], d[0]))
        beams.append(Beam(mesh, element, STEEL, width=H))
        ends.setdefault(i, []).append((k, "left"))
        ends.setdefault(j, []).append((k, "right"))
    scene = Scene(*beams)
    for node, ((k, end), *others) in ends.items():
        if node in frame.nodes("ground"):
            at = tuple(frame.points[:, node])
            scene.joint("weld", beams=("ground", k), at=(at, end))
        for other, its_end in others:
            scene.joint("weld", beams=(k, other), at=(end, its_end))
        for place, force in loads:
            if node in frame.nodes(place):
                scene.point_force(force, tuple(frame.points[:, node]), beam=k)
    return scene, {node: found[0][0] for node, found in ends.items()}


def stiffness_method(points, lines, held, forces, hinged=False):
    """Displacements (n, 3) of straight members by linear theory, Przemieniecki (1968)."""
    points, n = np.array(points, dtype=float), len(points)
    K, f = np.zeros((3 * n, 3 * n)), np.zeros(3 * n)
    for i, j in lines:
        d = points[j] - points[i]
        L = np.hypot(*d)
        c, s = d / L
        a, b = EA / L, 0.0 if hinged else EI / L**3
        k = np.array([[a, 0, 0, -a, 0, 0], [0, 12 * b, 6 * b * L, 0, -12 * b, 6 * b * L],
                      [0, 6 * b * L, 4 * b * L**2, 0, -6 * b * L, 2 * b * L**2],
                      [-a, 0, 0, a, 0, 0], [0, -12 * b, -6 * b * L, 0, 12 * b, -6 * b * L],
                      [0, 6 * b * L, 2 * b * L**2, 0, -6 * b * L, 4 * b * L**2]])
        T = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
        at = np.append(3 * i + np.arange(3), 3 * j + np.arange(3))
        K[np.ix_(at, at)] += T.T @ k @ T
    for node, force in forces.items():
        f[3 * node:3 * node + len(force)] = force
    if hinged:
        held = [*held, *range(2, 3 * n, 3)]
    free = np.setdiff1d(np.arange(3 * n), held)
    u = np.zeros(3 * n)
    u[free] = np.linalg.solve(K[np.ix_(free, free)], f[free])
    return u.reshape(n, 3)


def at_nodes(frame, state):
    return state.displacement(frame.points).T


# statics


@pytest.mark.parametrize("elements", [1, 3])
def test_small_displacements_are_those_of_the_stiffness_method(elements):
    points, lines = [(0, 0), (0.2, 1), (1.4, 1.3), (1.2, 0)], [(0, 1), (2, 1), (2, 3), (0, 2)]
    frame = Frame.from_lines(points, lines, elements=elements, material=STEEL, height=H, width=H)
    state = frame.clamp(0).pin(3).point_force((3.0, -5.0), at=1).moment(2, 1.5).solve_linear()
    exact = stiffness_method(points, lines, [0, 1, 2, 9, 10], {1: (3.0, -5.0), 2: (0, 0, 1.5)})
    size = np.abs(exact).max()
    assert_allclose(at_nodes(frame, state), exact[:, :2], rtol=0, atol=1e-6 * size)
    assert_allclose(frame.rotations(state), exact[:, 2], rtol=0, atol=1e-6 * size)


@pytest.mark.parametrize("element, elements", [
    (ElementBeamCable(5), 1), (ElementBeamCable(3), 3), (ElementBeamANCF(2), 2),
    (ElementBeamANCF(3), 2)])
def test_a_frame_is_that_of_welded_beams(element, elements):
    """Large displacements; also where the directions of sections and the axis are apart."""
    frame = square(2, element=element, elements=elements)
    loads = [("side", (600.0, 0.0)), (8, (0.0, -300.0))]
    for place, force in loads:
        frame.point_force(force, at=place)
    state = frame.solve_static(tol=1e-10)
    scene, of_node = welded(frame, loads, element=element, elements=elements)
    other = scene.solve_static(tol=1e-10)
    expected = np.array([other.displacement(tuple(p), beam=of_node[k])
                         for k, p in enumerate(frame.points.T)])
    assert np.abs(expected).max() > 0.02
    assert_allclose(at_nodes(frame, state), expected, rtol=0, atol=1e-8)
    assert state.strain_energy == pytest.approx(other.strain_energy, rel=1e-8)


def test_a_truss_has_no_moments_and_the_forces_of_its_bars():
    points, lines = [(0, 0), (1, 0), (2, 0), (0.5, 0.8), (1.5, 0.8)], [
        (0, 1), (1, 2), (3, 4), (0, 3), (1, 3), (1, 4), (2, 4)]
    frame = Frame.from_lines(points, lines, hinges="all", elements=2, material=STEEL, height=H,
                             width=H).pin(0).hold(2, "y").point_force((0, -100.0), at=1)
    state = frame.solve_linear()
    exact = stiffness_method(points, lines, [0, 1, 7], {1: (0, -100.0)}, hinged=True)
    assert_allclose(at_nodes(frame, state), exact[:, :2], rtol=0, atol=1e-12)
    assert np.all(np.isnan(frame.rotations(state)))
    diagonal = 50.0 * np.hypot(0.5, 0.8) / 0.8
    found = frame.solve_static().resultants((0.25, 0.4))
    assert found.N == pytest.approx(-diagonal, rel=1e-4) and abs(found.M) < 1e-6


def test_lees_frame_snaps_through():
    """Limit loads in E I / L^2 of the stiffness of A = 6, I = 2, L = 120 by an extensible elastica.

    18.556728 and -9.414432; Lee, Manuel, Rossow (1968) found 18.55 with others.
    """
    soft = StVenantKirchhoff(720.0, 0.3)
    frame = Frame.from_lines([(0, 0), (0, 120), (24, 120), (120, 120)], [(0, 1), (1, 2), (2, 3)],
                             elements=[4, 1, 4], material=soft, height=2.0, width=3.0)
    unit = 720.0 * 2.0 / 120.0**2
    path = frame.pin([0, 3]).point_force((0.0, -18.7 * unit), at=2).continuation()
    found = [18.7 * point.state.load for point in path.critical_points[:2]]
    assert_allclose(found, [18.556728, -9.414432], rtol=2e-4)


def test_a_square_is_pulled_to_a_line_as_the_elastica():
    """A square frame pulled at opposite corners is four clamped-guided elasticas.

    Under P at a corner each half of a side is a cantilever with P / 2 at its tip at 45 degrees to
    it: Bisshopp and Drucker (1945) with inclined load, integrated here by shooting.
    """
    h, L = 0.001, 1.0
    soft = StVenantKirchhoff(2e11, 0.3)
    EI, side = 2e11 * h**4 / 12, L * np.sqrt(0.5)
    points = [(0, side), (side, 0), (0, -side), (-side, 0)]
    frame = Frame.from_lines(points, [(0, 1), (1, 2), (2, 3), (3, 0)], elements=6, height=h,
                             width=h, material=soft)
    P = 8.0 * EI / L**2
    frame.hold(2, "x", "y", "angle").hold(0, "x", "angle")
    state = frame.point_force((0.0, P), at=0).solve_static()
    # half a side: theta'' = -(P / 2 E I) sin(theta) of its angle to the load, pi / 4 at the corner
    from scipy.integrate import solve_ivp

    def half(k0):
        return solve_ivp(lambda s, y: [y[1], 0.5 * P / EI * np.sin(y[0]), np.cos(y[0])],
                         (0.0, L / 2), [np.pi / 4, k0, 0.0], rtol=1e-11, atol=1e-12)

    k0 = brentq(lambda k: half(k).y[1, -1], -6.0, 0.0)
    stretched = 4.0 * half(k0).y[2, -1] - 2.0 * side
    assert state.displacement((0.0, side))[1] == pytest.approx(stretched, rel=1e-5)


def test_a_curved_line_is_a_beam_on_a_curve():
    def arc(s):
        return np.array([-np.cos(np.pi * s), np.sin(np.pi * s)])

    frame = Frame.from_lines([(-1, 0), (1, 0)], [(0, 1)], curves={0: arc}, elements=8,
                             material=STEEL, height=H, width=H)
    tip = frame.clamp(0).point_force((0, -50.0), at=1).solve_static().displacement((1, 0))
    mesh = MeshBeam.init_curve(arc, np.linspace(0, 1, 9), H)
    scene = Scene(Beam(mesh, ElementBeamCable(5), STEEL, width=H)).clamp("left", thickness="free")
    assert_allclose(tip, scene.point_force((0, -50.0), (1, 0)).solve_static().displacement((1, 0)),
                    rtol=1e-8)


# modes and buckling


def test_a_free_frame_has_three_zero_modes():
    frame = Frame.from_lines([(0, 0), (0, 1), (1, 1), (1.5, 0.2)], [(0, 1), (1, 2), (2, 3), (0, 2)],
                             material=STEEL, height=H, width=H)
    frequencies = frame.modes(4).frequencies
    assert np.all(np.abs(frequencies[:3]) < 1e-6 * frequencies[3])
    assert len(frame.system.constraints.free_rigid_motions()) == 3


def test_modes_of_a_portal_frame_by_beam_theory():
    """Sway and first symmetric mode of an inextensible clamped portal frame of equal members.

    From the dynamic stiffnesses of Bernoulli's beam, Clough and Penzien (1975).
    """
    def functions(b):
        c, s, C, S = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        D = 1 - c * C
        return np.array([b * (s * C - c * S), b * (S - s), b**2 * s * S,
                         b**3 * (s * C + c * S)]) / D

    def sway(b):  # rotation of both corners alike, translation of the girder with its mass
        near, far, coupled, shear = functions(b)
        return (2 * near + far) * (2 * shear - b**4) - 2 * coupled**2

    def symmetric(b):
        near, far, *_ = functions(b)
        return 2 * near - far

    exact = [brentq(sway, 1.5, 2.0), brentq(symmetric, 3.0, 3.9)]
    h = 1e-3
    frequencies = portal(height=h, width=h, elements=2).modes(2).frequencies
    assert_allclose(frequencies / np.sqrt(E * h**2 / (12 * 7800.0)), np.square(exact), rtol=1e-4)


def test_a_portal_frame_buckles_sideways():
    """k L tan(k L) = ... of a clamped portal under loads on its columns: 7.379 E I / L^2.

    The sway of a column with a girder of stiffness 6 E I / L at its top, Timoshenko and Gere
    (1961), 2.4: k L / tan(k L) = -6.
    """
    h = 1e-3
    frame = portal(height=h, width=h, elements=2).point_force((0, -1.0), at="corners")
    exact = brentq(lambda x: x / np.tan(x) + 6.0, 2.0, 3.0) ** 2
    assert frame.buckling(1).factors[0] / (E * h**4 / 12) == pytest.approx(exact, rel=1e-4)


def swinging(eliminated, monkeypatch, scheme, n=60, dt=1e-3, **options):
    """A frame of two times two cells, two hinged ends in it, after a step load."""
    monkeypatch.setattr(linear_solver, "MANY", 0 if eliminated else 10**9)
    frame = square(2, hinges=[(0, 3), (7, 4)]).point_force((3000.0, 0), at="side")
    assert frame.system.mass_solver.by_nodes == eliminated
    return frame.integrate(n * dt, dt, scheme=scheme, **options)


@pytest.mark.parametrize("scheme, error", [("energy-momentum", 1e-10), ("generalized-alpha", 1e-7)])
def test_motion_by_elimination_is_that_by_multipliers(scheme, error, monkeypatch):
    """The same equations, solved by nodes: histories agree to the tolerance of the iteration."""
    ours, dense = (swinging(on, monkeypatch, scheme) for on in (True, False))
    assert np.abs(dense.u).max() > 0.3  # large, of cells of size one
    for name in ("u", "v", "multipliers"):
        a, b = np.array(getattr(ours, name)), np.array(getattr(dense, name))
        assert np.abs(a - b).max() < 100 * error * np.abs(b).max()
    assert np.abs(ours.u - dense.u).max() < error
    assert alike(ours.iterations, dense.iterations)
    assert max(np.abs(ours.system.constraints.constraint(u, 0.0)).max() for u in ours.u) < 1e-11
    if scheme == "energy-momentum":
        assert np.ptp(ours.total_energy[1:]) < 1e-10 * ours.kinetic_energy.max()


def test_a_frame_swings_in_its_first_mode(monkeypatch):
    monkeypatch.setattr(linear_solver, "MANY", 0)
    frame = square(4)
    modes = frame.modes(1)
    period = 2.0 * np.pi / modes.frequencies[0]
    start = modes.mode(0, 1e-6 / np.abs(modes.shapes[0]).max())
    history = frame.integrate(period, period / 200, start=start)
    x = np.array(history.u) @ frame.system.mass.multiply(modes.shapes[0])
    assert_allclose(x / x[0], np.cos(2.0 * np.pi * history.t / period), atol=2e-3)
    assert np.ptp(history.total_energy) < 1e-9 * history.total_energy[0]


def test_a_frame_at_rest_under_its_weight_stays_there(monkeypatch):
    """All forces cancel, so that accelerations are round-off: no reason to give up."""
    monkeypatch.setattr(linear_solver, "MANY", 0)
    x = np.linspace(0.0, 60.0, 11)
    cable, k = np.column_stack([x, 24.0 * (x / 60.0 - 0.5)**2]), np.arange(10)
    frame = Frame.from_lines(cable, np.column_stack([k, k + 1]), material=STEEL, height=0.05,
                             width=0.05).pin([0, 10]).gravity((0, -9.81))
    history = frame.integrate(0.2, 0.05, start=frame.solve_static())
    assert np.ptp(history.displacement((30.0, 0.0)), axis=0).max() < 1e-9


def test_a_motion_by_elimination_goes_on_from_its_checkpoint(monkeypatch, tmp_path):
    whole = swinging(True, monkeypatch, "energy-momentum", n=12, checkpoint=tmp_path / "a.npz",
                     every=5)
    frame = square(2, hinges=[(0, 3), (7, 4)]).point_force((3000.0, 0), at="side")
    assert np.array_equal(frame.resume(tmp_path / "a.npz").u, whole.u)


# settlements

def test_settled_supports_bend_as_linear_theory_says():
    """A clamped girder, 6 E I w / L^2 and 4 E I a / L at the support that sinks and turns."""
    girder = Frame.from_lines([(0, 0), (2, 0)], [(0, 1)], material=STEEL, height=H, width=H)
    girder.clamp([0, 1]).settle(1, y=-1e-5, angle=2e-5)
    for state in (girder.solve_static(), girder.solve_linear()):
        moment = EI * (6 * 1e-5 / 2**2 + 4 * 2e-5 / 2)
        force = EI * (-12 * 1e-5 / 2**3 - 6 * 2e-5 / 2**2)
        assert_allclose(state.reactions(1).moment, moment, rtol=1e-5)
        assert_allclose(state.reactions(1).force[1], force, rtol=1e-5)
        assert_allclose(state.reactions(0).force[1], -force, rtol=1e-5)
        assert_allclose(girder.rotations(state)[1], 2e-5, rtol=1e-7)


def test_settlements_that_cannot_be():
    frame = portal(clamp=False, hinges=[0]).pin(0).clamp(3)
    with pytest.raises(InputError, match="give x=, y= or angle="):
        frame.settle(3)
    with pytest.raises(InputError, match="no rotation to hold"):
        frame.settle(0, angle=0.1)
    with pytest.raises(InputError, match=r"frame.settle\(3, y=lambda t: -0.01"):
        frame.settle(3, y=-0.01).integrate(0.01, 1e-3)


# adaption

def loaded(elements=1, **options):
    """A portal whose girder may be curved, with every kind of load and a settlement."""
    frame = Frame.from_lines(*PORTAL, groups={"girder": [1]}, nodes={"ground": [0, 3]},
                             elements=elements, material=STEEL, height=H, width=H, **options)
    frame.clamp("ground").point_force((800.0, -300.0), at=1).moment(2, 200.0)
    return frame.line_load((0, -500.0), beam="girder").settle(3, y=-0.05, angle=0.1)


@pytest.mark.parametrize("options, degrees", [
    ({}, True), ({"element": ElementBeamCable(3), "max_degree": 3}, False),
    ({"curves": {1: lambda s: np.array([s, 1 + 0.1 * np.sin(np.pi * s)])}}, False)])
def test_frames_adapt(options, degrees):
    """By higher degrees, on finer lines, and on lines that follow their curves."""
    fine = loaded(16, **{k: v for k, v in options.items() if k == "curves"})
    exact = fine.solve_static()
    most = {"max_degree": options["max_degree"]} if "max_degree" in options else {}
    options = {k: v for k, v in options.items() if k != "max_degree"}
    state = loaded(**options).solve_static(adapt=1e-3, **most)
    frame = state.scene
    assert isinstance(frame, Frame) and max(state.error_estimate.values()) <= 1e-3
    girder = frame.beams[0]
    assert (girder.element.axis_degree > 5) == degrees
    assert (girder.mesh.nelements > 1) != degrees
    for place in ((1, 1), (0, 1)):
        assert_allclose(state.displacement(place), exact.displacement(place), atol=1e-5)
    assert_allclose(frame.rotations(state), fine.rotations(exact), atol=1e-4)


def test_a_frame_with_other_loads_before_it_is_solved():
    frame = portal().point_force((1e4, 0), at=1).replace(loads=[Weight((0, -9.81))])
    assert len(frame.items) == 2
    weight = 9.81 * sum(beam.total_mass for beam in frame.beams)
    assert_allclose(frame.solve_linear().reactions("ground").force, [0.0, weight],
                    atol=1e-6 * weight)


def test_a_frame_on_other_beams():
    frame = loaded(2)
    stiffer = frame.replace(beam="girder", material=STEEL.replace(E=4e11))
    assert isinstance(stiffer, Frame) and len(stiffer.loads) == len(frame.loads)
    twice = loaded(2, sections={"girder": {"material": STEEL.replace(E=4e11)}})
    assert np.array_equal(stiffer.solve_static().u, twice.solve_static().u)
    with pytest.raises(InputError, match="must have the lines of .* between the same points"):
        frame.replace(beams=frame.beams[::-1])
    with pytest.raises(InputError, match="list of 2 Beam"):
        frame.replace(beams=[frame.beams[0]])


# tapers


def haunch(s):
    """0.04 at both ends, 0.02 in between."""
    return 0.02 + 0.08 * np.maximum(np.abs(s - 0.5) - 0.25, 0.0)


def slim(s):
    return 0.02 * (1.0 - 0.5 * s)


def flexibility_method(points, lines, heights, held, force):
    """Displacements (n, 3) by beam theory, whose members are integrals over their lengths."""
    points = np.array(points, dtype=float)
    K = np.zeros((3 * len(points),) * 2)
    x, w = np.polynomial.legendre.leggauss(30)
    s = (np.arange(4)[:, None] + 0.5 * (x + 1)).ravel() / 4
    for (i, j), height in zip(lines, heights):
        d, h = points[j] - points[i], height(s)
        L = np.hypot(*d)
        arm, dx = L * (1 - s), np.tile(w, 4) * L / 8
        a, b = dx / (E * H * h), dx / (E * H * h**3 / 12)  # of the end j, with i held
        F = np.array([[a.sum(), 0, 0], [0, b @ arm**2, b @ arm], [0, b @ arm, b.sum()]])
        to_i = np.array([[-1.0, 0, 0], [0, -1, 0], [0, -L, -1]])  # forces at i of those at j
        T = np.kron(np.eye(2), [[d[0] / L, d[1] / L, 0], [-d[1] / L, d[0] / L, 0], [0, 0, 1]])
        B = np.vstack([to_i, np.eye(3)])
        at = np.append(3 * i + np.arange(3), 3 * j + np.arange(3))
        K[np.ix_(at, at)] += T.T @ B @ np.linalg.solve(F, B.T) @ T
    free = np.setdiff1d(np.arange(len(K)), held)
    u = np.zeros(len(K))
    u[free] = np.linalg.solve(K[np.ix_(free, free)], force[free])
    return u.reshape(-1, 3)


@pytest.mark.parametrize("sections", [
    {"columns": {"height": slim}, "lines": {"height": haunch}}, None])
def test_tapered_frames_by_integrals(sections):
    """A haunched portal, its columns thin at their feet; heights by group, and line by line."""
    points, lines = [(0, 1), (0, 0), (1.5, 1.2), (1.5, 0)], [(0, 1), (0, 2), (2, 3)]
    law, heights = STEEL.replace(nu=0.0), [slim, haunch, slim]
    frame = Frame.from_lines(points, lines, groups={"columns": [0, 2]}, elements=8, material=law,
                             height=heights, width=H, sections=sections).clamp([1, 3])
    state = frame.point_force((3.0, -5.0), at=0).moment(2, 0.5).solve_linear()
    force = np.zeros(12)
    force[[0, 1, 8]] = 3.0, -5.0, 0.5
    exact = flexibility_method(points, lines, heights, [3, 4, 5, 9, 10, 11], force)
    assert_allclose(at_nodes(frame, state), exact[:, :2], rtol=0, atol=2e-7 * np.abs(exact).max())
    assert_allclose(frame.rotations(state), exact[:, 2], rtol=0, atol=2e-7 * np.abs(exact).max())


def test_refined_tapers_have_the_heights_of_their_functions():
    def height(s):
        return 0.02 + 0.01 * np.sin(3.0 * s)

    frame = Frame.from_lines(*PORTAL, elements=2, height=[height, 0.02, slim], width=H,
                             material=STEEL)
    mesh = frame.beams[0].mesh.refined(2)
    at = np.linspace(0, 1, 8, endpoint=False) + np.arange(4)[:, None] / 24
    assert_allclose(mesh.heights[:, :8], height(at), rtol=1e-15)
    assert_allclose(mesh.heights[:, 8:16], 0.02)
    assert_allclose(mesh.heights[:, 16:], slim(at), rtol=1e-14)
    mesh = mesh.replace(height=lambda s: 2 * slim(s))
    assert_allclose(mesh.heights, np.tile(2 * slim(at), 3), rtol=1e-15)
    assert frame.clamp([0, 3]).point_force((10.0, 0.0), at=1).solve_static(adapt=1e-6).converged


@pytest.mark.parametrize("height, error, message", [
    ([0.1, 0.2], InputError, "height has 2 entries for 3"),
    ([0.1, 0.2, "x"], InputError, "height of line 2"), ([0.1, -0.2, 0.1], InputError, "line 1"),
    (lambda s: s - 0.5, MeshError, "positive, got -0.5 at 0"),
    ([0.1, 0.1, lambda s: 0.1 + (s > 0.5)], MeshError, "line 2: .*differs from a cubic"),
    (lambda s: 1 / 0, CallbackError, "ZeroDivisionError")])
def test_heights_that_cannot_be(height, error, message):
    with pytest.raises(error, match=message):
        Frame.from_lines(*PORTAL, groups={"columns": [0, 2]}, height=height, width=H,
                         material=STEEL)


# its parts


def test_a_frame_of_meshio(tmp_path):
    points = [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0], [0.5, 1.1, 0], [9, 9, 9]]
    mesh = meshio.Mesh(points, [("vertex", [[0], [3]]), ("line", [[0, 1], [2, 3]]),
                                ("line3", [[1, 2, 4]])],
                       cell_sets={"columns": [[], [0, 1], []], "girder": [[], [], [0]],
                                  "ground": [[0, 1], [], []]}, point_sets={"top": [1, 2]})
    options = {"material": STEEL, "height": H, "width": H}
    frame = Frame.from_meshio(mesh, **options).clamp("ground")
    assert {beam.name for beam in frame.beams} == {"columns", "girder"}
    assert frame.points.shape == (2, 4) and frame.nodes("top").tolist() == [1, 2]
    parabola = MeshBeam.init_curve(lambda s: np.array([s, 1 + 0.4 * s * (1 - s)]), [0, 1], H)
    assert frame.beam("girder").mesh.lengths == pytest.approx(parabola.lengths)
    numbers = [np.array([7, 7]), np.array([1, 1]), np.array([2])]
    mesh = meshio.Mesh(points[:5], mesh.cells, cell_data={"gmsh:physical": numbers,
                                                          "gmsh:geometrical": numbers},
                       field_data={"columns": np.array([1, 1]), "girder": np.array([2, 1]),
                                   "ground": np.array([7, 0])})
    mesh.write(tmp_path / "portal.msh", file_format="gmsh22", binary=False)
    again = Frame.from_meshio(tmp_path / "portal.msh", **options).clamp("ground")
    force = {"force": (100.0, 0.0), "at": (0.0, 1.0)}
    assert_allclose(again.point_force(**force).solve_static().u,
                    frame.point_force(**force).solve_static().u, atol=1e-12)


# what is refused


@pytest.mark.parametrize("points, lines, options, error, message", [
    (PORTAL[0], [(0, 1), (1, 7)], {}, MeshError, "line 1 joins the points .1, 7.*0 to 3"),
    (PORTAL[0], [*PORTAL[1], (1, 1)], {}, MeshError, "line 3 joins the point 1 to itself"),
    (PORTAL[0], [*PORTAL[1], (2, 1)], {}, MeshError, "lines 1 and 3 are the same"),
    ([*PORTAL[0], (5, 5)], PORTAL[1], {}, MeshError, "point 4 at .5, 5. is in no line"),
    ([*PORTAL[0], (0, 1), (2, 2)], [*PORTAL[1], (4, 5)], {"tol": 0}, MeshError,
     "1 and 4 are both at"),
    (*PORTAL, {"groups": {"a": [0, 1], "b": [1]}}, InputError, "line 1 is in the groups 'a' and"),
    (*PORTAL, {"groups": {"a": [3]}}, MeshError, "'a' holds the number 3"),
    (*PORTAL, {"sections": {"column": {}}, "groups": {"columns": [0]}}, NameUnknown, "columns"),
    (*PORTAL, {"hinges": [(0, 3)]}, InputError, "line 0 does not end at node 3"),
    (*PORTAL, {"elements": 0}, InputError, "elements must be an integer from 1"),
    (*PORTAL, {"height": None}, InputError, "need a height"),
    (*PORTAL, {"curves": {0: lambda s: np.array([s, s])}}, MeshError, "curve of line 0 runs from"),
    ("text", PORTAL[1], {}, InputError, "points must be an array"),
    (np.zeros((2, 4)), PORTAL[1], {}, InputError, "transpose"),
    (PORTAL[0], np.transpose(PORTAL[1]), {}, InputError, "transpose"),
    ([(0, 0), (1, [2, 3])], [(0, 1)], {}, InputError, "points must be an array of numbers"),
    ([(0, 0), (1, 0, 2)], [(0, 1)], {}, InputError, "points must be an array of numbers"),
    (PORTAL[0], [(0, 1), (1, [2, 3])], {}, InputError, "lines must be an array of numbers"),
    (PORTAL[0], [(0, 0.5)], {}, InputError, "lines are numbers of points"),
])
def test_lines_that_make_no_frame(points, lines, options, error, message):
    with pytest.raises(error, match=message):
        Frame.from_lines(points, lines, **{"material": STEEL, "height": H, "width": H, **options})


def test_what_is_not_held_is_said():
    parts = Frame.from_lines([(0, 0), (1, 0), (5, 1), (6, 1)], [(0, 1), (2, 3)], material=STEEL,
                             height=H, width=H).clamp(0)
    with pytest.raises(SupportError, match="translation along.*of the part with line 1"):
        parts.point_force((1, 0), at=2).solve_static()
    mechanism = Frame.from_lines([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1), (1, 2), (2, 3), (3, 0)],
                                 hinges="all", material=STEEL, height=H, width=H).pin([0, 1])
    with pytest.raises(SupportError, match=r"rotation about.*frame\.hold\(\(0, 0\), 'y'\)"):
        mechanism.point_force((1, 0), at=2).solve_linear()
    alone = Frame.from_lines([(0, 0), (1, 0)], [(0, 1)], material=STEEL, height=H, width=H)
    with pytest.raises(SupportError, match=r"translation along \(1, 0\)"):
        alone.point_force((1, 0), at=1).solve_static()
    flight = alone.point_force((3.0, 0), at=0).integrate(0.01, 1e-3)
    assert flight.position((0.5, 0))[-1, 0] - 0.5 == pytest.approx(
        0.5 * 4.0 / (7800 * H**2) * 1e-4, rel=1e-2)


@pytest.mark.parametrize("call, error, message", [
    (lambda f: f.clamp("grund"), NameUnknown, "did you mean 'ground'"),
    (lambda f: f.clamp((0.5, 0.5)), MeshError, "no node .* nearest is number"),
    (lambda f: f.clamp(9), InputError, "number of a node"),
    (lambda f: f.clamp(0, beam=0), InputError, "supported and loaded at nodes"),
    (lambda f: f.clamp(0, thickness="fixed"), NameUnknown, "thickness.*known: 'free'"),
    (lambda f: f.hold(0, "z"), NameUnknown, "fixed component"),
    (lambda f: f.clamp(lambda x: x[0] > 7), MeshError, "selects none of the 4 nodes"),
    (lambda f: f.clamp(lambda x: 1), InputError, "returns n truth values"),
    (lambda f: Frame.from_meshio(meshio.Mesh([[0, 0]], []), material=STEEL), MeshError, "no lines"),
    (lambda f: Frame.from_meshio("nothing.msh", material=STEEL), FileError, "nothing.msh"),
    (lambda f: Frame.from_lines(*PORTAL, hinges="all", material=STEEL, height=H, width=H).clamp(0),
     InputError, "pin it"),
    (lambda f: Frame.from_lines(*PORTAL, hinges=[1], material=STEEL, height=H,
                                width=H).moment(1, 2.0), InputError, "no line takes a moment"),
    (lambda f: f.solve_static().reactions("left", beam=0), InputError, "give its nodes, without"),
])
def test_calls_that_mean_nothing(call, error, message):
    with pytest.raises(error, match=message):
        call(portal())
