"""Cantilevers and leaves that touch: against springs in series, a loop in closed form, two
dimensions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import block_diag, bmat, csr_matrix
from scipy.sparse.linalg import spsolve
from skfem import (Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm,
                   MeshQuad)
from skfem.helpers import ddot, eye, sym_grad, trace

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, StVenantKirchhoff)

E, B = 2e11, 0.02


def strip(length, n, height, origin, element, angle=0.0, nu=0.0):
    mesh = MeshBeam.init_line(np.linspace(0.0, length, n + 1), height=height, origin=origin,
                              angle=angle)
    return Beam(mesh, element, StVenantKirchhoff(E, nu), width=B)


def leaves(n, element, h, L, elements):
    """So many cantilevers on each other, and the stiffness of one."""
    scene = Scene(*(strip(L, elements, h, (0.0, -k * h), element) for k in range(n)))
    for k in range(n):
        scene.clamp("left", k)
    return scene, 3.0 * E * B * h**3 / 12.0 / L**3


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=repr)
def test_cantilevers_from_opposite_walls(element):
    """The end of the upper one rests on the middle of the lower one: two springs."""
    h, L, own, arm, F = 0.01, 1.0, 0.9, 0.6, 10.0
    scene = Scene(strip(L, 10, h, (0.0, 0.0), element),
                  strip(own, 9, h, (L + arm, -h), element, np.pi))
    scene.clamp("left", 0).clamp("left", 1).contact(0, 1)
    state = scene.point_force((0.0, -F), at=(L, 0.0), beam=0).solve_static()
    k, below = (3.0 * E * B * h**3 / 12.0 / length**3 for length in (L, arm))
    tip = F / (k + below)
    assert state.displacement("right", 0)[1] == pytest.approx(-tip, rel=1e-2)
    found = state.contact(on=1)
    assert found.total[1] == pytest.approx(-below * tip, rel=1e-2)
    assert found.force[1] @ found.points[0] / found.total[1] == pytest.approx(L, rel=2e-3)
    # beyond the contact the lower one is straight
    end = tip * (1.0 + 1.5 * (own - arm) / arm)
    assert state.displacement("right", 1)[1] == pytest.approx(-end, rel=1e-2)


@pytest.mark.parametrize("degrees", [60, 90, 120, 150])
@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(3)], ids=repr)
def test_a_cantilever_rests_on_the_corner_of_an_inclined_one(element, degrees):
    """Bending and compression of the lower one, with the arm of its corner: two springs."""
    h, L, a, own, F = 0.01, 1.0, 0.5, 0.5, 5.0
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    across = np.array([-along[1], along[0]])
    corner = 0.5 * h * across * (1.0 if degrees < 90 else -1.0)  # from its axis to what touches
    root = np.array([a, -0.5 * h]) - corner - own * along
    scene = Scene(strip(L, 10, h, (0.0, 0.0), element),
                  strip(own, 6, h, root, element, np.radians(degrees)))
    scene.clamp("left", 0).clamp("left", 1).contact(0, 1)
    state = scene.point_force((0.0, -F), at=(L, 0.0), beam=0).solve_static()
    EI, EA, push, arm = E * B * h**3 / 12.0, E * B * h, -across[1], -corner[0]
    give = (push**2 * own**3 / 3.0 + push * arm * own**2 + arm**2 * own) / EI + (
        along[1]**2 * own / EA)
    force = F * a**2 * (3.0 * L - a) / 6.0 / EI / (a**3 / 3.0 / EI + give)
    found = state.contact(on=1)
    assert found.total[1] == pytest.approx(-force, rel=1e-2)
    assert abs(found.total[0]) < 0.02 * force and found.penetration < 0.01 * h
    alone, tip = (F * L**3 - N * a**2 * (3.0 * L - a) / 2.0 for N in (0.0, force))
    assert state.displacement("right", 0)[1] == pytest.approx(
        -tip / (3.0 * EI), abs=5e-3 * alone / (3.0 * EI))


@pytest.mark.parametrize("element", [ElementBeamANCF(2), ElementBeamANCF(3),
                                     ElementBeamANCFCubic(2)], ids=repr)
def test_leaves_whose_faces_are_bonded_are_one_beam(element):
    """Hinges tie points of the faces: three leaves have 27 times the stiffness of one."""
    h, L, n = 0.01, 0.5, 16
    scene, k = leaves(3, element, h, L, n)
    for x in L * np.arange(1, n + 1) / n:
        for upper in (0, 1):
            face = (x, -(upper + 0.5) * h)
            scene.hinge((upper, face), (upper + 1, face))
    state = scene.point_force((0.0, -27e-3 * k), at=(L, 0.0), beam=0).solve_static()
    assert state.displacement("right", 0)[1] == pytest.approx(-1e-3, rel=1e-2)
    # the sections of all three turn as one: no slip at the end
    ends = [state.position((L, -0.5 * h), beam) for beam in (0, 1)]
    assert_allclose(*ends, atol=1e-12)


def test_the_loop_of_three_leaves_with_friction():
    """Faces slide by h times the slope of the end; the forces between n leaves add up to
    (n - 1) / 2 of the load. So friction takes the share s = 3 (n - 1) mu h / 4 L of it.
    """
    n, h, L, mu, low, parts = 3, 0.025, 0.5, 0.6, 0.2, 6
    scene, k = leaves(n, ElementBeamANCFCubic(1), h, L, 4)
    F, times = 1e-3 * n * k, [0.0, 1.0, 2.0, 3.0]

    def amplitude(t):
        return np.interp(t, times, [0.0, 1.0, low, 1.0])

    scene.contact("all", friction=mu)
    scene.point_force((0.0, -F), at="right", beam=0, amplitude=amplitude)
    run = scene.run(times[1:], increments=parts)
    P, tip = amplitude(run.t), -1e3 * run.displacement("right", 0)[:, 1]
    top, bottom, again = (int(np.argmin(np.abs(run.t - t))) for t in times[1:])
    s = 0.75 * (n - 1) * mu * h / L
    slopes = np.diff(P) / np.diff(tip)
    for last, sign in ((top, -1.0), (bottom, 1.0), (again, -1.0)):
        assert slopes[last - 1] == pytest.approx(1.0 / (1.0 + sign * s), rel=1.5e-2)
    assert tip[again] == pytest.approx(tip[top], rel=1e-6)  # it is closed
    stick = 37.0 / 13.0  # at corners: of leaves whose ends are tied, by their tension
    up, down = 1.0 / (1.0 - s), 1.0 / (1.0 + s)

    def corner(load, start, end):
        """From the line of slope `start` at a load to that of slope `end`, and the load there."""
        d = load / start
        x = (load - stick * d) / (end - stick)
        return (d, load), (x, end * x)

    x, y = np.array([*corner(1.0, up, down), *corner(low, down, up)]).T
    area = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) * F * 1e-3
    loop = slice(top, again + 1)
    work = np.sum(0.5 * (P[loop][1:] + P[loop][:-1]) * np.diff(tip[loop])) * F * 1e-3
    lost = run.dissipated[again] - run.dissipated[top]
    assert work == pytest.approx(area, rel=0.05) and lost == pytest.approx(area, rel=0.05)


def continuum(lengths, h, n, nu, q):
    """Two strips of Q2 elements on each other, clamped at x = 0, in plane stress with small
    displacements; a traction q, shape (2,), of which one part is on the end and one on the top of
    the upper one. Deflection of its end, and place and size of the forces between the strips.
    """
    @BilinearForm
    def stiffness(u, v, w):
        e = sym_grad(u)
        return E * B / (1.0 - nu**2) * ddot((1.0 - nu) * e + nu * eye(trace(e), 2), sym_grad(v))

    @LinearForm
    def traction(v, w):
        return -B * np.where(np.isclose(w.x[0], lengths[0]), *q) * v[1]

    upper, lower = (Basis(MeshQuad.init_tensor(
        np.linspace(0.0, a, round(a * n / h) + 1), np.linspace(-k * h, (1 - k) * h, n + 1)),
        ElementVector(ElementQuad2())) for k, a in enumerate(lengths))
    loaded = FacetBasis(upper.mesh, upper.elem, facets=upper.mesh.facets_satisfying(
        lambda x: np.isclose(x[0], lengths[0]) | np.isclose(x[1], h), boundaries_only=True))
    K = block_diag([stiffness.assemble(upper), stiffness.assemble(lower)]).tocsr()
    f = np.append(traction.assemble(loaded), np.zeros(lower.N))
    free, faces = np.ones(len(f), dtype=bool), []
    for basis, shift in ((upper, 0), (lower, upper.N)):
        x, y = basis.doflocs
        free[shift + np.flatnonzero(np.isclose(x, 0.0))] = False
        vertical = basis.get_dofs(elements=True).all(["u^2"])
        face = vertical[np.isclose(y[vertical], 0.0) & (x[vertical] > 1e-9)]
        face = face[np.argsort(x[face])]
        faces.append(shift + face[x[face] < min(lengths) + 1e-9])
    place = upper.doflocs[0, faces[0]]
    pairs = csr_matrix((np.repeat([1.0, -1.0], len(place)), (np.tile(np.arange(len(place)), 2),
                                                             np.concatenate(faces))),
                       shape=(len(place), len(f)))[:, free]
    touch = place > 0.5 * min(lengths)
    for _ in range(50):
        G = pairs[touch]
        x = spsolve(bmat([[K[free][:, free], G.T], [G, None]]).tocsc(),
                    np.append(f[free], np.zeros(touch.sum())))
        gap, force = pairs @ x[:free.sum()], np.zeros(len(place))
        force[touch] = x[free.sum():]
        now = np.where(touch, force < 0.0, gap < -1e-9 * np.abs(gap).max())
        if np.array_equal(now, touch):
            break
        touch = now
    else:
        raise AssertionError("the set of touching nodes is not found")
    u = np.zeros(len(f))
    u[free] = x[:free.sum()]
    end = np.flatnonzero(np.isclose(upper.doflocs[0], lengths[0]))
    end = end[np.isin(end, upper.get_dofs(elements=True).all(["u^2"]))]
    return u[end].mean(), place, force


@pytest.mark.parametrize("lengths, end, top", [((1.0, 0.6), 1.0, 0.0), ((1.0, 1.0), 0.0, 1.0),
                                               ((0.8, 1.0), 1.0, 0.2)])
@pytest.mark.parametrize("element", [ElementBeamANCF(3), ElementBeamANCFCubic(2)], ids=repr)
def test_thick_strips_against_two_dimensions(element, lengths, end, top):
    """Forces at an end, and along the faces. A contact stiffer than by default gives way less than
    the strips bend near their clamps.
    """
    h, nu, q = 0.1, 0.3, 5e6
    tip, place, force = continuum(lengths, h, 4, nu, (q * end, q * top))
    scene = Scene(*(strip(a, round(a / h), h, (0.0, (0.5 - k) * h), element, nu=nu)
                    for k, a in enumerate(lengths))).clamp("left", 0).clamp("left", 1)
    scene.contact("all", stiffness=1e3 * E / h)
    scene.line_load((0.0, -q * B * top), beam=0)
    state = scene.point_force((0.0, -q * B * h * end), at="right", beam=0).solve_static()
    assert state.displacement("right", 0)[1] == pytest.approx(tip, rel=2.5e-2)
    found = state.contact(on=1)
    assert found.total[1] == pytest.approx(force.sum(), rel=2.5e-2)
    where = found.force[1] @ found.points[0] / found.total[1]
    assert where == pytest.approx(force @ place / force.sum(), rel=2.5e-2)
