"""Derivatives of frequencies, buckling loads and critical loads."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from skfem_ancf import (Beam, BucklingLoad, CriticalLoad, Design, ElementBeamANCF,
                        ElementBeamANCFCubic, ElementBeamCable, Frequency, InputError, MeshBeam,
                        Parameters, RigidBody, Scene, StabilityWarning, StVenantKirchhoff,
                        Weight)
from tests.test_design import agree, beam_of, difference

S = np.linspace(0, 1, 5)


def relative(design, p):
    """Logarithmic derivatives, (r, n)."""
    values, found = design(p)
    return found * np.array(p) / values[:, None]


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCFCubic(2),
                                     ElementBeamCable(5)])
def test_frequencies_at_rest(element):
    """omega ~ h sqrt(E / rho), independent of the width; exact for cables."""
    def build(p):
        E, height, width, density = p
        return Scene(Beam(MeshBeam.init_line(S, height), element,
                          StVenantKirchhoff(E, 0.3, density), width=width)).clamp("left")

    p = [2e6, 0.02, 0.02, 1000.0]
    design = Design(build, [Frequency(0), Frequency(2)])
    agree(design, p)
    found = relative(design, p)
    assert np.allclose(found[:, [0, 2, 3]], [0.5, 0.0, -0.5], rtol=1e-7, atol=1e-7)
    assert np.allclose(found[0, 1], 1.0, atol=1e-6 if element == ElementBeamCable(5) else 0.02)


def test_frequencies_by_heights_at_nodes():
    def build(p):
        return Scene(beam_of(mesh=MeshBeam.init_line(S, lambda x: np.interp(x, S, p)))
                     ).clamp("left")

    agree(Design(build, [Frequency(0), Frequency(1)]), 0.05 + 0.01 * np.cos(3 * S))


def test_fields_by_name_beside_static_readings():
    """Frequencies and buckling loads of heights and moduli by name, alone and beside a sensor."""
    x = np.linspace(0, 1, 9)

    def build(p):
        mesh = MeshBeam.init_line(x, lambda s: np.interp(s, x, p))
        scene = Scene(beam_of(mesh=mesh, element=ElementBeamCable(5))).clamp("left")
        scene.point_force((-0.1, -0.01), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    p = 0.03 - 0.01 * x
    scene = build(p)
    for readings in ([Frequency(0), BucklingLoad(0)], ["tip", Frequency(0, loaded=True)]):
        found = Design(Parameters(scene, [(scene.beams[0], "height", "nodes")]), readings)
        assert np.allclose(found.jacobian(p), Design(build, readings).jacobian(p), rtol=1e-6,
                           atol=1e-6 * np.abs(found.jacobian(p)).max())


def test_frequency_about_a_loaded_state():
    """The state and its stress change with the parameters."""
    def build(p):
        E, height, F = p
        return Scene(beam_of(E, height=height, element=ElementBeamCable(5))).pin("left").fix(
            "right", "r^2").point_force((0, -F), at=(0.5, 0)).spring(
                200.0, (((1.0, 0.0)), ("ground", (1.5, 0.0))))

    p = [2e6, 0.02, 0.5]
    agree(Design(build, [Frequency(0, loaded=True), Frequency(1, loaded=True)]), p)
    free = Design(build, [Frequency(0)]).jacobian(p)
    assert free[0, 2] == 0.0 and abs(Design(build, [Frequency(0, loaded=True)]).jacobian(p)[0, 2]
                                     ) > 0.1


def test_frequency_with_joints():
    def build(p):
        E, mass, x = p
        beam = Beam(MeshBeam.init_line(S, 0.05), ElementBeamANCF(2),
                    StVenantKirchhoff(E, 0.3, 1000.0), width=0.02, name="beam")
        body = RigidBody(mass=mass, inertia=0.01, position=(x, 0.2), name="body")
        scene = Scene(beam, body).clamp("left", "beam").gravity((0, -9.81), body)
        scene.weld(("beam", "right"), (body, (1.0, 0.0)))
        return scene

    agree(Design(build, [Frequency(0), Frequency(1, loaded=True)]), [2e6, 0.3, 1.1])


@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamCable(5)])
def test_buckling(element):
    """Euler's load: P ~ E b h^3; the height at the clamped end counts more."""
    def build(p):
        E, height, width = p
        scene = Scene(beam_of(E, 0.0, height, width, element)).clamp("left")
        return scene.point_force((-1.0, 0.0), at=(1, 0))

    p = [2e6, 0.02, 0.02]
    design = Design(build, [BucklingLoad(0), BucklingLoad(1)])
    agree(design, p)
    assert np.allclose(relative(design, p)[0], [1.0, 3.0, 1.0], atol=2e-3)

    def tapered(p):
        mesh = MeshBeam.init_line(S, lambda x: np.interp(x, S, p))
        return Scene(beam_of(mesh=mesh, element=element)).clamp("left").point_force(
            (-1.0, 0.0), at=(1, 0)).gravity((-0.1, 0))

    design = Design(tapered, [BucklingLoad(0)])
    agree(design, 0.02 - 0.005 * S)
    found = relative(design, 0.02 - 0.005 * S)[0]
    assert found[0] > found[3] > found[4] > 0.0


def test_buckling_of_a_portal_with_joints():
    def build(p):
        E, height, k = p
        turned = MeshBeam.init_line([0, 0.5, 1], height, angle=np.pi / 2)
        law = StVenantKirchhoff(E, 0.3, 1000.0)
        column = Beam(turned, ElementBeamCable(5), law, width=0.02, name="column")
        top = Beam(MeshBeam.init_line([0, 0.5, 1], height, origin=(0, 1)), ElementBeamCable(5), law,
                   width=0.02, name="top")
        scene = Scene(column, top).clamp("left", "column")
        scene.weld(("column", "right"), ("top", "left"))
        scene.spring(k, (("top", (1.0, 1.0)), ("ground", (1.0, 2.0))))
        return scene.point_force((0, -1.0), at=(0.0, 1.0), beam="column").point_force(
            (0, -0.1), at=(0.5, 1.0), beam="top")

    agree(Design(build, [BucklingLoad()]), [2e6, 0.02, 3.0])


def test_limit_point_of_an_arch():
    """The snap load of a shallow arch by modulus, heights, rise and load."""
    def build(p):
        E, height, rise, F = p
        mesh = MeshBeam.init_curve(lambda s: np.array([s, rise * np.sin(np.pi * s)]),
                                   np.linspace(0, 1, 7), height)
        scene = Scene(beam_of(E, 0.3, height, mesh=mesh, element=ElementBeamCable(5)))
        return scene.clamp("left").clamp("right").point_force((0.3 * F, -F), at=(0.5, rise))

    p, options = [2e6, 0.01, 0.05, 0.3], {"ds": 0.03, "until": lambda point: point.rate < 0.0}
    design = Design(build, [CriticalLoad(0, **options)])
    value, _ = design(p)
    points = build(p).continuation(**options).critical_points
    assert points[0].kind == "limit" and np.isclose(points[0].load, value[0])
    agree(design, p)
    # the load of the snap is proportional to the modulus
    assert np.allclose(relative(design, p)[0, [0, 3]], [1.0, -1.0], atol=1e-6)


def test_a_bistable_switch_with_a_prescribed_snap_force():
    """An arch of given rise is made to snap at a load; it carries less and holds beyond."""
    rise = 0.065

    def build(p, share=1.0):
        mesh = MeshBeam.init_curve(lambda s: np.array([s, rise * np.sin(np.pi * s)]),
                                   np.linspace(0, 1, 7), 0.01 * p[0])
        scene = Scene(Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(2e6, 0.3), width=0.02))
        return scene.pin("left").pin("right").point_force((0, -0.2 * share), at=(0.5, rise))

    snap = CriticalLoad(ds=0.03, steps=40, until=lambda point: point.negative > 0)
    design = Design(build, [snap])
    found = least_squares(lambda p: design.values(p) - 1.0, [1.5], design.jacobian, xtol=1e-12)
    assert abs(found.fun[0]) < 1e-6 and found.nfev < 20
    states = [build(found.x, 0.98).solve_static()]
    with pytest.warns(StabilityWarning, match="loses its stability"):
        states.append(build(found.x, 1.02).solve_static())
    states.append(build(found.x, 0.0).solve_static(start=states[1]))
    up, through, rest = (state.displacement((0.5, rise))[1] / rise for state in states)
    assert up > -0.5 > -1.5 > through and rest < -1.5 and states[2].stability == "stable"


def test_bifurcation_of_a_column():
    """Euler's load with the compression before it; a side force disturbs the symmetry."""
    def build(p):
        E, height, F, side = p
        scene = Scene(beam_of(E, 0.0, height, element=ElementBeamCable(5))).clamp("left")
        return scene.point_force((-F, side), at=(1, 0))

    p, options = [2e6, 0.02, 1.0], {"until": lambda point: point.negative > 0, "ds": 0.003}
    design = Design(lambda q: build([*q, 0.0]), [CriticalLoad(0, **options)])
    agree(design, p)
    h = 0.02
    strain = np.pi**2 / 4 * h**2 / 12
    assert np.allclose(relative(design, p)[0], [1.0, 3.0 + 2.0 * strain, -1.0], atol=1e-3)
    with pytest.raises(InputError, match="parameter 3 disturbs the symmetry"):
        Design(build, [CriticalLoad(0, **options)], sizes=[1e6, 0.02, 1.0, 0.1])([*p, 0.0])


def test_what_has_no_derivative_is_said():
    def double(p):
        beams = [Beam(MeshBeam.init_line(S, 0.02, origin=(0, y)), ElementBeamCable(5),
                      StVenantKirchhoff(p[0], 0.3, 1000.0), width=0.02) for y in (0.0, 1.0)]
        scene = Scene(*beams)
        for k in (0, 1):
            scene.clamp("left", beam=k).point_force((-1, 0), at="right", beam=k)
        return scene

    for one in (Frequency(0), BucklingLoad(1)):
        with pytest.raises(InputError, match="not simple"):
            Design(double, [one])([2e6])
        assert Design(double, [one]).values([2e6]).shape == (1,)

    def loose(p):
        return Scene(beam_of(p[0])).add(Weight((0, -1)))

    with pytest.raises(InputError, match="rigid motion"):
        Design(loose, [Frequency(0)])([2e6])
    with pytest.raises(InputError, match="does not exist"):
        Design(lambda p: Scene(beam_of(p[0])).clamp("left").point_force((-1e-9, 0), at=(1, 0)),
               [CriticalLoad(max_load=2.0)])([2e6])


def test_a_frequency_beside_a_sensor():
    def build(p):
        scene = Scene(beam_of(p[0], height=p[1])).clamp("left").point_force((0, -1), at=(1, 0))
        return scene.sensor("tip", "displacement", at=(1, 0))

    design = Design(build, ["tip", Frequency(0), Frequency(0, loaded=True)])
    values, found = design([2e6, 0.05])
    assert values.shape == (4,) and found.shape == (4, 2)
    agree(design, [2e6, 0.05])
    assert np.allclose(found, difference(design, [2e6, 0.05]), rtol=1e-5)
