"""Frames of many beams: what holds them is found, and solved for, without dense matrices."""

import itertools
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, Frame, MeshBeam, Scene,
                        StVenantKirchhoff)
from skfem_ancf.core.errors import ModelWarning

E, RHO, H = 2e11, 7800.0, 0.02
EI = E * H**4 / 12


def bar(a, b, ne=1, name=None):
    a, d = np.array(a, dtype=float), np.array(b, dtype=float) - a
    mesh = MeshBeam.init_line(np.linspace(0, np.hypot(*d), ne + 1), H, origin=a,
                              angle=np.arctan2(d[1], d[0]))
    return Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(E, 0.3, RHO), H, name=name)


def chain(number, length=1.0, ne=1):
    """A straight beam in pieces that are welded, none of them held."""
    x = np.linspace(0, length, number + 1)
    beams = [bar((a, 0), (b, 0), ne) for a, b in itertools.pairwise(x)]
    scene = Scene(*beams)
    for a, b in itertools.pairwise(beams):
        scene.joint("weld", beams=(a, b), at=("right", "left"))
    return scene


def frame(bays, storeys):
    """Columns and girders of one element, welded where they meet and clamped to the ground."""
    beams, ends = [], {}
    for i in range(bays + 1):
        for j in range(storeys + 1):
            for other in ((i + 1, j), (i, j + 1)):
                if other[0] > bays or other[1] > storeys or other == (i + 1, 0):
                    continue
                ends.setdefault((i, j), []).append((len(beams), "left"))
                ends.setdefault(other, []).append((len(beams), "right"))
                beams.append(bar((i, j), other))
    scene = Scene(*beams)
    for (_, j), ((k, end), *others) in ends.items():
        if j == 0:
            scene.clamp(end, beam=k)
        else:
            for other, its_end in others:
                scene.joint("weld", beams=(k, other), at=(end, its_end))
    return scene.gravity((0, -9.81))


# frames


def test_a_welded_chain_bends_like_one_beam():
    """So many joints that there is no border: P L^3 / (3 EI), and the first frequency."""
    scene, P = chain(48), 1.0
    scene.clamp("left", beam=0).point_force((0, -P), (1, 0), beam=47)
    assert not scene.system.constraints.few
    assert sparse.issparse(scene.system.constraints.full_jacobian(np.zeros(scene.layout.N), 0.0))
    state = scene.solve_static()
    assert state.displacement((1, 0), beam=47)[1] == pytest.approx(-P / (3 * EI), rel=2e-4)
    assert str(state.verdict) == "stable"
    ratio = scene.modes(1).frequencies[0] / (3.516015 * np.sqrt(EI / (RHO * H**2)))
    assert ratio == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(3)])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_members_of_one_length_have_directions_of_their_own(element, angle):
    """Two bars that lean on each other: F = 2 EA sin(a)^2 v / L, turned with the picture."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = np.array([[0.0, 0.0], [4.0, 3.0], [8.0, 0.0]]) @ turn.T
    frame = Frame.from_lines(points, [[0, 1], [1, 2]], material=StVenantKirchhoff(E, 0.0, RHO),
                             height=H, width=H, element=element)
    frame.pin([0, 2]).point_force(turn @ (0.0, -10.0), at=1)
    moved = turn.T @ frame.solve_linear().displacement(tuple(points[1]))
    assert_allclose(moved, [0.0, -10.0 * 5.0 / (2 * E * H**2 * 0.36)], rtol=1e-3, atol=1e-13)


def test_a_large_frame_stands_without_dense_matrices():
    scene = frame(9, 9)
    system = scene.system
    dense = 8 * system.constraints.m * system.N
    tracemalloc.start()
    try:
        system.constraints.require_supports()
        held = tracemalloc.get_traced_memory()[1]
        state = scene.solve_static()
        solved = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(scene.beams) == 171 and system.constraints.m > 600
    assert held < 0.2 * dense and solved < 0.8 * dense
    weight = sum(beam.total_mass for beam in scene.beams) * 9.81
    ground = [k for k, beam in enumerate(scene.beams) if beam.mesh.p[1, 0] == 0.0]
    assert sum(state.reactions("left", beam=k).force[1] for k in ground) == pytest.approx(weight)
    assert np.abs(system.constraints.constraint(state.u, 1.0)).max() < 1e-12


def test_a_weld_too_many_in_a_large_frame_is_named_and_shares():
    scene = frame(7, 7)
    first = scene.joints[40]
    scene.joint("weld", beams=first.beams, at=first.at, name="twice")
    with pytest.warns(ModelWarning, match="^3 of .*repeat.*Weld twice.*force along x, "):
        state = scene.solve_static()
    plain = frame(7, 7)
    one = plain.solve_static()
    assert_allclose(state.u, one.u, rtol=0, atol=1e-9 * np.abs(one.u).max())
    pull = one.joint_force(plain.joints[40])
    for joint in (scene.joints[40], scene.joints[-1]):
        assert_allclose(2.0 * state.joint_force(joint), pull, rtol=0, atol=1e-6 * max(abs(pull)))
