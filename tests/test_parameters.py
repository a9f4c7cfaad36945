"""Derivatives of states by parameters of a scene by object and name."""

import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares, minimize

from skfem_ancf import (Beam, Circle, Design, EigenStrain, ElementBeamANCF, ElementBeamCable,
                        EndMoment, Energy, FollowerForce, Foundation, Frame, InputError, Item, Line,
                        LineLoad, MeshBeam, NameUnknown, Obstacle, Parameters, PointForce,
                        PointMass, PointwiseMaterial, PrescribedAngle, PrescribedPosition,
                        PrescribedTurn, Pressure, RigidBody, RotatingFrame, Scene, Section, Spring,
                        StVenantKirchhoff, Support, Temperature, TorsionalSpring, Traction, Weight)

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


class Press(Energy):
    """A potential of one's own: a pull to the axis."""

    def __init__(self, k):
        self.k = k
        super().__init__(lambda r, F, X, t: k * r[1]**2, beam=0)


class Tip(Item):
    """Forces of one's own at the last node."""

    def __init__(self, k):
        self.k = k

    def bind(self, layout):
        bound = super().bind(layout)
        bound.dofs = np.arange(layout.N - 12, layout.N)
        return bound

    def energy(self, u, t):
        return self.k / 4 * np.sum(u[-12:-10]**2)**2 + self.k * u[-11]**2


class Cubic(PointwiseMaterial):
    """A law of one's own, with a parameter."""

    def __init__(self, E, nu, c):
        super().__init__(E, nu)
        self.c = c

    def stress(self, strain):
        lame, mu = self.E * self.nu / (1 - self.nu**2), 0.5 * self.E / (1 + self.nu)
        x, y, z = strain
        return np.array([lame * (x + y) + 2 * mu * x + self.c * x**3, lame * (x + y) + 2 * mu * y,
                         2 * mu * z])


def _loaded(F=1.0, **options):
    scene = Scene(beam_of(**options)).clamp("left").point_force((0.1, -F), at="right")
    return scene, scene.beams[0]


def _with_item(make, F=1.0):
    """A case of an item beside a load, without one for F = 0."""
    def build(x):
        item = make(x)
        scene = Scene(beam_of()).clamp("left").add(item)
        return (scene.point_force((0.1, -F), at="right") if F else scene), item
    return build


def _layered(thickness, width, E, rest=False):
    laws = [StVenantKirchhoff(one, 0.3, 1000.0) for one in E]
    parts = list(zip(thickness, laws, width))
    if rest:
        parts.insert(1, (None, laws[0], 0.02))
    beam = Beam(MeshBeam.init_line(S, 0.05 if rest else float(sum(thickness))), ElementBeamANCF(2),
                section=Section.layers(*parts))
    return Scene(beam).clamp("left").point_force((0.1, -1), at="right"), beam


def _law_of_a_layer(x):
    scene, beam = _layered((0.02, 0.03), (0.02, 0.02), (2e6, x))
    return scene, beam.section.parts[1][1]


def _point_mass(x):
    scene, item = _with_item(lambda x: PointMass(x, (1, 0)), 0)(x)
    return scene.gravity((0, -1.0)), item


def _profile(**changed):
    sizes = {"width": 0.03, "web": 0.004, "flange": 0.006} | changed
    return _loaded(width=None, section=Section.profile("I", **sizes))


def _numbers(EA=200.0, EI=0.05):
    beam = Beam(MeshBeam.init_line(S, 0.05), ElementBeamANCF(1), section=Section.numbers(EA, EI))
    return Scene(beam).clamp("left").point_force((0, -0.02), at="right"), beam


def _turned(x):
    a, b = (Beam(MeshBeam.init_line(S, 0.05, origin=(o, 0)), ElementBeamANCF(2),
                 StVenantKirchhoff(2e6, 0.3, 1000.0), width=0.02) for o in (0, 1))
    scene = Scene(a, b).clamp("left", 0)
    scene.hinge((1, 0))
    turn = PrescribedTurn((0, "right"), (1, "left"), lambda t: x * t)
    return scene.add(turn).gravity((0, -0.3)), turn


def _axis(x):
    spline = CubicSpline(S, x[0]), CubicSpline(S, x[1])
    mesh = MeshBeam.init_curve(lambda s: np.array([one(s) for one in spline]), S, 0.05,
                               lambda s: np.array([one(s, 1) for one in spline]))
    return _loaded(height=mesh)


def _law(x):
    law = Cubic(2e6, 0.3, x)
    beam = Beam(MeshBeam.init_line(S, 0.05), ElementBeamANCF(2), law, width=0.02)
    return Scene(beam).clamp("left").point_force((0.1, -1), at="right"), law


def _spring(ground=(0.6, 0.5), point=0.6, **options):
    return _with_item(lambda _: Spring(20.0, ((point, 0.0), ("ground", ground)), **options))(0)


#: Scenes and owners for a value, names, values and the step of differences.
NAMED = {
    "thickness": (lambda x: _layered(x, (0.02, 0.03), (2e6, 4e6)), "thickness", (0.02, 0.03)),
    "thickness of some": (lambda x: _layered(x, (0.02, 0.03), (2e6, 4e6), True), "thickness",
                          (0.02, 0.01)),
    "widths": (lambda x: _layered((0.02, 0.03), x, (2e6, 4e6)), "width", (0.02, 0.03)),
    "one width": (lambda x: _layered((0.02, 0.03), (x, 0.02), (2e6, 4e6)),
                  "section.parts.0.2", 0.03),
    "law of a layer": (_law_of_a_layer, "E", 4e6),
    "web": (lambda x: _profile(web=x), "web", 0.004),
    "flange": (lambda x: _profile(flange=x), "flange", 0.006),
    "EA": (lambda x: _numbers(EA=x), "EA", 200.0),
    "EI": (lambda x: _numbers(EI=x), "EI", 0.05),
    "place": (_with_item(lambda x: PointForce((0, -1.0), at=tuple(x)), 0), "at", (0.7, 0.0)),
    "follower": (_with_item(lambda x: FollowerForce(x, at=(1, 0)), 0), "force", (0.3, -0.8)),
    "moment": (_with_item(lambda x: EndMoment("right", x)), "M", 0.03),
    "pressure": (_with_item(lambda x: Pressure("top", x), 0), "p", 30.0),
    "traction": (_with_item(lambda x: Traction("top", x), 0), "t", (1.0, -30.0)),
    "line load": (_with_item(lambda x: LineLoad(x), 0), "force", (0.2, -1.0)),
    "weight": (_with_item(lambda x: Weight(x), 0), "g", (0.2, -3.0)),
    "settlement": (_with_item(lambda x: Support("right", "r^2", x), 0), "displacement", 0.02),
    "angle": (_with_item(lambda x: PrescribedAngle("right", lambda t: x * t)), "angle", 0.2),
    "position": (_with_item(lambda x: PrescribedPosition(
        (1, 0), lambda t: np.array([1, 0]) + x * t), 0), "r", (0.02, 0.03)),
    "turn": (_turned, "angle", 0.3),
    "stiffness": (_with_item(lambda x: Spring(x, ((0.6, 0), ("ground", (0.6, 0.5))))), "k", 20.0),
    "free length": (lambda x: _spring(length=x), "length", 0.45),
    "end of a spring": (lambda x: _spring(ground=tuple(x)), "between.1.1", (0.6, 0.5)),
    "torsion": (_with_item(lambda x: TorsionalSpring(0.1, "right", angle=x)), "angle", 0.2),
    "foundation": (_with_item(lambda x: Foundation(x)), "k", 1000.0),
    "rotation": (_with_item(lambda x: RotatingFrame(x)), "speed", 3.0),
    "point mass": (_point_mass, "mass", 0.05),
    "eigenstrain": (_with_item(lambda x: EigenStrain(xx=x)), "xx", 2e-3),
    "temperature": (_with_item(lambda x: Temperature(x)), "change", 20.0),
    "centre of a circle": (_with_item(lambda x: Obstacle(Circle(x, 0.15)), 4.0), "shape.center",
                           (0.5, -0.2), 1e-5),
    "floor": (_with_item(lambda x: Obstacle(Line(x)), 4.0), "shape.point", (0.0, -0.06), 1e-5),
    "moved obstacle": (_with_item(lambda x: Obstacle(
        Circle((0.5, -0.2), 0.15), position=lambda t: t * np.asarray(x)), 4.0), "position",
        (0.01, 0.005), 1e-5),
    "stiffness of contact": (_with_item(lambda x: Obstacle(Line((0, -0.05)), stiffness=x), 2.0),
                             "stiffness", 2e6, 1e-5),
    "energy": (_with_item(lambda x: Press(x)), "k", 30.0),
    "item": (_with_item(lambda x: Tip(x)), "k", 3.0),
    "law": (_law, "c", 3e9),
    "axis": (_axis, "nodes", (S, 0.05 * np.sin(3 * S))),
}


@pytest.mark.parametrize("case", NAMED)
def test_every_kind_of_parameter(case):
    """By object and name, against differences of whole solutions; numbers and arrays."""
    build, name, x, step = (*NAMED[case], 1e-3)[:4]
    x = np.array(x, dtype=float)

    def readings(state):
        return np.append(np.array(state.u)[-12:-8], state.strain_energy)

    scene, owner = build(x if x.ndim else float(x))
    found, = scene.solve_static().gradient(readings, [(owner, name)])
    expected = quotient(lambda y: readings(build(y)[0].solve_static()), x, step)
    assert found.shape == expected.shape
    for one, other in zip(found, expected):  # contact: differences of small steps are rough
        assert np.allclose(one, other, rtol=1e-6, atol=(1e-6 if step == 1e-3 else 1e-5) * np.abs(
            expected).max() + 1e-10)


def test_coefficients_of_functions():
    """Heights, moduli and eigenstrains as sums of functions, from those of the scene."""
    def solve(a=(0.0, 0.0), b=(0.0, 0.0), c=(0.0,)):
        mesh = MeshBeam.init_line(S, lambda s: 0.05 + np.interp(s, S, a[0] + a[1] * S * S))
        law = StVenantKirchhoff(lambda X, Y: 2e6 + b[0] + b[1] * X, 0.3)
        strain = EigenStrain(xx=lambda X, Y: c[0] * Y)
        beam = Beam(mesh, ElementBeamANCF(2), law, width=0.02)
        scene = Scene(beam).clamp("left").point_force((0.1, -1), at="right").add(strain)
        return scene, beam, strain

    scene, beam, strain = solve()
    found = scene.solve_static().gradient(tip, [
        (beam, "height", lambda s: np.array([1 + 0 * s, s * s])),
        (beam, "E", lambda X, Y: np.array([1 + 0 * X, X])), (strain, "xx", lambda X, Y: [Y])])
    for name, one, size in zip("abc", found, (0.05, 2e6, 0.1)):
        n = one.shape[1]
        close(one, quotient(lambda x: tip(solve(**{name: size * (x - 1.0)})[0].solve_static()),
                            np.ones(n)) / size)
    with pytest.raises(InputError, match="must return shape \\(k, \\.\\.\\., n\\)"):
        scene.solve_static().gradient(tip, [(beam, "E", lambda X, Y: 1.0)])
    with pytest.raises(InputError, match="no number or array"):
        scene.solve_static().gradient(tip, [(strain, "xx")])


def test_heights_free_at_nodes_find_zigzags_and_few_coefficients_do_not():
    """The least sag of a cantilever of given weight is 16/27 of that of a prism."""
    x, mean = np.linspace(0, 1, 13), 0.02

    def scene_of(h, parts=1):
        mesh = MeshBeam.init_line(np.linspace(0, 1, 12 * parts + 1), lambda s: np.interp(s, x, h))
        beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), width=0.01)
        scene = Scene(beam).clamp("left").point_force((0, -1e-3), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    def hats(s):
        return np.array([np.interp(s, np.linspace(0, 1, 6), one) for one in np.eye(6)])

    prism = scene_of(mean + 0 * x)
    sag = tip(prism.solve_static())[1]

    def least(field, start, functions):
        design = Design(Parameters(prism, [(prism.beams[0], "height", field)]), ["tip"])
        share = functions @ np.r_[0.5, np.ones(11), 0.5] / 12

        def goal(p):
            size = share @ p
            value, g = design.objective(lambda y: y[1] / sag)(mean * p / size - start)
            return value, mean / size * (g - (g @ p) / size * share)

        n = len(functions)
        p = minimize(goal, np.ones(n), jac=True, bounds=[(0.15, 3)] * n,
                     options={"maxiter": 40}).x
        return [tip(scene_of(mean / (share @ p) * p @ functions, parts).solve_static())[1] / sag
                for parts in (1, 4)]

    claimed, true = least("nodes", 0.0, np.eye(13))
    assert claimed < 0.9 * 16 / 27 and true > 2.0
    claimed, true = least(hats, mean, hats(x))
    assert 16 / 27 < claimed < 1.05 * 16 / 27 and np.isclose(claimed, true, rtol=0.03)


def test_a_grid_of_struts_becomes_a_gripper():
    """From a standstill: a push closes a jaw that it first opened."""
    points = np.array([(x, y) for x in range(7) for y in range(4)])
    lines = [(a, b) for a in range(28) for b in range(28) if tuple(points[b] - points[a]) in (
        (1, 0), (0, 1), (1, 1), (1, -1)) and (sum(points[[a, b], 0]) <= 9 or sum(
            points[[a, b], 1]) >= 2)]
    used = np.unique(lines)
    lines, points = np.searchsorted(used, lines), 0.01 * points[used]
    push, jaw = (0, 0), (0.06, 0.01)

    def grid(heights, elements=1):
        frame = Frame.from_lines(points, lines, height=heights, width=5e-3, elements=elements,
                                 material=StVenantKirchhoff(2e9, 0.4))
        frame.clamp([int(np.argmin(np.hypot(*(points - [0, 0.03]).T)))])
        frame.hold([k for k, (_, y) in enumerate(points) if y == 0.0], "y", "angle")
        frame.spring(1e4, (push, ("ground", (-0.05, 0.0))))
        frame.spring(2e3, (jaw, ("ground", (0.06, -0.05)))).point_force((0.02, 0.0), at=push)
        return frame.sensor("jaw", "displacement", at=jaw)

    frame = grid(0.5e-3)
    design = Design(Parameters(frame, [(frame.beams[0], "height", "elements")]), ["jaw"])
    n = len(lines)
    start, goal = np.full(n, np.log(0.5e-3)), design.objective(lambda y: 1e7 * y[1])

    def by_logarithms(p):
        value, gradient = goal(np.exp(p))
        return value, np.exp(p) * gradient

    p = minimize(by_logarithms, start, jac=True, bounds=[(np.log(0.1e-3), np.log(1e-3))] * n,
                 options={"maxiter": 12}).x
    before, after = (design.values(np.exp(x))[1] for x in (start, p))
    assert after < -3.0 * abs(before)
    fine = grid(np.exp(p).tolist(), 3).solve_static().displacement(jaw)[1]
    assert np.isclose(fine, after, rtol=1e-3)  # thicknesses within a strut cannot alternate


def test_layers_and_their_laws_change_together():
    """Values of several parameters at once reach the same section."""
    scene, beam = _layered((0.02, 0.03), (0.02, 0.02), (2e6, 4e6))
    law = beam.section.parts[1][1]
    made = Parameters(scene, [(beam, "thickness"), (law, "E"), (beam, "width")])
    p = made.start * [1.1, 0.8, 1.3, 1.0, 0.9]
    direct, _ = _layered((0.022, 0.024), (0.02, 0.018), (2e6, 5.2e6))
    assert np.allclose(made(p).solve_static().u, direct.solve_static().u, rtol=1e-9, atol=1e-14)


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
                       ([(beam_of(), "E")], "is not in scene.beams"),
                       ([(load, "amplitude")], "no argument"),
                       ([(profile.section, "web")], "is not in scene.beams"),
                       ([(profile.section, "wall")], "no argument 'wall'"),
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
