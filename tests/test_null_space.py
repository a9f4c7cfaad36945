"""Many joints: sparse factors on the null space of their equations."""

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamCable, Frame, MeshBeam, RigidBody, Scene,
                        StVenantKirchhoff)

STEEL, H = StVenantKirchhoff(E=2e9, nu=0.3, density=1000), 0.05


def lattice(n):
    """Nodes and lines of n x n squares on the ground."""
    nodes = [(x, y) for x in range(n + 1) for y in range(n + 1)]
    lines = [(a, b) for a, p in enumerate(nodes) for b, q in enumerate(nodes)
             if (q[0] - p[0], q[1] - p[1]) in ((1, 0), (0, 1)) and p[1] + q[1] > 0]
    return np.array(nodes, float), lines


def welded(nodes, lines, element):
    """The same as beams with a weld for every meeting."""
    ends, beams = {}, []
    for k, (a, b) in enumerate(lines):
        (x, y), angle = nodes[a], np.arctan2(*(nodes[b] - nodes[a])[::-1])
        mesh = MeshBeam.init_line(np.linspace(0, 1, 4), height=H, origin=(x, y), angle=angle)
        beams.append(Beam(mesh, element, STEEL, width=H))
        ends.setdefault(a, []).append((beams[k], "left"))
        ends.setdefault(b, []).append((beams[k], "right"))
    scene = Scene(*beams)
    for node, ((beam, end), *others) in ends.items():
        for other, place in others:
            scene.joint("weld", beams=(beam, other), at=(end, place))
        if nodes[node, 1] == 0:
            scene.clamp(end, beam=beam, thickness="free")
    return scene, ends


@pytest.mark.parametrize("n", [2, 5])
def test_welded_beams_are_a_frame(n):
    nodes, lines = lattice(n)
    frame = Frame.from_lines(nodes, lines, elements=3, height=H, width=H, material=STEEL)
    frame.clamp([k for k, p in enumerate(nodes) if p[1] == 0])
    scene, ends = welded(nodes, lines, frame.beams[0].element)
    top = len(nodes) - 1
    frame.point_force((2e3, -1e3), at=nodes[top])
    scene.point_force((2e3, -1e3), at=nodes[top], beam=ends[top][0][0])
    a, b = frame.solve_static(), scene.solve_static()
    there = [b.position(p, beam=ends[k][0][0]) for k, p in enumerate(nodes) if p[1] > 0]
    here = [a.position(p) for p in nodes if p[1] > 0]
    assert np.max(np.abs(b.displacement(nodes[top], beam=ends[top][0][0]))) > 0.1
    np.testing.assert_allclose(there, here, atol=1e-9)
    assert (a.stability, b.stability) == ("stable", "stable")


def test_frequencies_of_beams_that_only_joints_support():
    """A square of four welded beams, free: three rigid motions, then those of the frame."""
    nodes, lines = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), [(0, 1), (1, 2), (3, 2), (0, 3)]
    frame = Frame.from_lines(nodes, lines, elements=3, height=H, width=H, material=STEEL)
    scene, _ = welded(nodes + [0, 1], lines, frame.beams[0].element)
    a, b = (s.modes(6).frequencies for s in (frame, scene))
    np.testing.assert_allclose(b[3:], a[3:], rtol=1e-8)
    assert np.all(np.abs(b[:3]) < 1e-3 * b[3])


def test_a_chain_from_a_body_that_stands_on_nothing_else():
    """A rigid body hangs on a pinned cable: the pull at the pin is the weight of both."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamCable(3), STEEL,
                width=0.01)
    body = RigidBody(2.0, 0.01, (1.1, 0))
    scene = Scene(beam, body).pin("left").gravity((0, -9.81))
    scene.hinge((beam, "right"), (body, (1.0, 0)))
    state = scene.solve_static()
    weight = 9.81 * (2.0 + 1000 * 1e-4)
    np.testing.assert_allclose(state.reactions("left").force, [0, weight], atol=1e-6 * weight)
    np.testing.assert_allclose(state.position((1, 0), beam=beam)[0], 0, atol=1e-6)
