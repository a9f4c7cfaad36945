"""All that a scene can have in one: planned, copied, stopped and gone on with, written."""

import pickle

import meshio
import numpy as np
import pytest

from skfem_ancf import (Beam, Circle, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        KelvinVoigt, MeshBeam, RigidBody, Scene, Section, StVenantKirchhoff)

STEEL = StVenantKirchhoff(E=2.1e9, nu=0.3, density=7850.0, thermal_expansion=1e-5)
BRASS = StVenantKirchhoff(E=1e9, nu=0.3, density=8500.0, thermal_expansion=2e-5)
X = np.linspace(0, 1, 3)


def height(x):
    return 0.02 - 0.01 * x


def width(x, y):
    return 0.01 + 0.002 * x


def modulus(x, y):
    return 1e9 * (1.0 + x)


def heat(x, y):
    return 1000.0 * y


def pull(x, y, t):
    return 1e-2 * y * np.sin(t)


def load(x):
    return np.array([0.0 * x[0], -1e-2 * x[0]])


def angle(t):
    return 0.5 * t * t


def sections():
    """A beam of each kind of section, one above the other."""
    lines = [MeshBeam.init_line(X, height=0.02, origin=(0, y)) for y in range(1, 5)]
    graded = StVenantKirchhoff(E=modulus, nu=0.3, density=1000.0)
    return (Beam(MeshBeam.init_line(X, height=height), ElementBeamANCF(2), STEEL, width=width,
                 damping=KelvinVoigt(1e-4), name="taper"),
            Beam(lines[0], ElementBeamANCFCubic(2), name="layers", section=Section.layers(
                (0.01, STEEL), (None, BRASS), width=0.01)),
            Beam(lines[1], ElementBeamCable(5), BRASS, name="profile", section=Section.profile(
                "I", width=0.02, web=0.004, flange=0.004)),
            Beam(lines[2], ElementBeamCable(5), name="numbers", section=Section.numbers(
                EA=1e5, EI=3.0, rhoA=1.0)),
            Beam(lines[3], ElementBeamANCF(3), graded, width=0.01, name="graded"))


def everything():
    beams = sections()
    body = RigidBody(mass=0.05, inertia=1e-3, position=(1.2, 0.0), name="body")
    disk = RigidBody(mass=1.0, inertia=0.1, position=(-1.0, 0.0), name="disk")
    scene = Scene(*beams, body, disk)
    for beam in beams:
        scene.clamp("left", beam=beam)
    scene.weld(("taper", "right"), (body, (1.0, 0.0)))
    scene.damping(mass=0.1, stiffness=1e-5).drag(density=1.2, normal=1.2, tangential=0.01)
    scene.point_mass(0.5, at=(1, 1), inertia=0.01, beam="layers")
    scene.spring(10.0, between=(("layers", (1, 1)), ("profile", (1, 2))), damping=0.1)
    scene.spring(10.0, between=((body, (1.2, 0.0)), ("ground", (1.2, -1.0))), length=0.5)
    scene.torsional_spring(1.0, at="right", beam="profile", damping=0.01)
    scene.foundation(1e3, side="bottom", one_sided=True, beam="numbers")
    scene.follower_force((0, -1.0), at=(1, 2), beam="profile").line_load(load, beam="graded")
    scene.temperature(heat, beam="layers").eigenstrain(xx=pull, beam="taper")
    scene.pin((-1, 0), disk)
    scene.motor(disk, angle=angle)
    scene.obstacle(Circle((0.5, -0.5076), 0.5), friction=0.3, stiffness=1e8, beam="taper")
    return scene.gravity((0, -9.81)).sensor("tip", "displacement", at=(1, 2), beam="profile")


def test_its_plan_names_each_beam():
    plan = everything().plan("dynamic")
    assert all(repr(beam.name) in plan["elements"] for beam in everything().beams if beam.name)
    assert "'profile' of" in plan["elements"] and "2 layers" in plan["elements"]


def test_copies_go_on_from_its_checkpoint(interrupted, tmp_path):
    path = tmp_path / "run.npz"
    whole = everything().integrate(0.02, 2e-3)
    scene = pickle.loads(pickle.dumps(everything()))
    interrupted(lambda: scene.integrate(0.02, 2e-3, checkpoint=path, every=4), steps=4)
    on = everything().resume(path)
    for other in (on, pickle.loads(pickle.dumps(on))):
        assert np.array_equal(other.u, whole.u) and np.array_equal(other.v, whole.v)
        assert np.array_equal(other.sensors["tip"], whole.sensors["tip"])
    assert any(np.any(state.contact().force) for state in whole.states())


def test_all_of_it_is_written(tmp_path):
    state = everything().solve_static()
    state.save(tmp_path / "all.vtu")
    mesh = meshio.read(tmp_path / "all.vtu")
    outlines = meshio.read(tmp_path / "all_obstacles.vtu")
    assert {0, 1, 2, 3, 4, 5, 6} <= set(np.concatenate(mesh.cell_data["beam"]).tolist())
    assert np.ptp(outlines.points[:, 1]) == pytest.approx(1.0, rel=1e-2)
    assert state.converged and np.any(state.contact().force)
