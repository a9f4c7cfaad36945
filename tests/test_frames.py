"""Frames of many beams: what holds them is found, and solved for, without dense matrices."""

import tracemalloc

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from scipy import sparse

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.equations import constraints, signature as rank
from skfem_ancf.core.errors import ModelWarning
from skfem_ancf.actions.joints import Joint, OnCircle
from skfem_ancf.actions.joints.base import point
import itertools

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


# the interface of joints


def test_a_joint_gives_its_entries_or_its_dense_rows():
    class Dense(Joint):
        equations = ("force",)

        def bind(self, scene):
            self.r = point(scene, 0, (0.5, 0))
            self.rows = self.r.row((0.0, 1.0), scene.N)[None]

        def value(self, u, t):
            return self.jacobian(u, t) @ u

        def jacobian(self, u, t):
            return self.rows

    class Entries(Dense):
        def entries(self, u, t):
            return np.zeros(2, dtype=int), self.r.dofs[1, :2], self.r.weights[1, :2]

    class Nothing(Dense):
        jacobian = Joint.jacobian

    scene = Scene(bar((0, 0), (1, 0)))
    u = np.zeros(scene.layout.N)
    full, part = scene.joint(Dense()), scene.joint(Entries())
    _, columns, values = full.entries(u, 0.0)
    assert set(columns) == set(full.r.dofs[1]) and np.all(values == full.rows[0, columns])
    assert np.count_nonzero(part.jacobian(u, 0.0)) == 2  # of its own entries, not the rows above
    with pytest.raises(NotImplementedError, match="entries"):
        Nothing().jacobian(u, 0.0)


def test_dense_rows_of_a_subclass_replace_the_entries_above():
    class Tilted(OnCircle):
        def value(self, u, t):
            return 2.0 * super().value(u, t)

        def jacobian(self, u, t):
            return 2.0 * super().jacobian(u, t)

        def curvature(self, u, t, multipliers):
            return super().curvature(u, t, 2.0 * multipliers)

    scene = Scene(bar((0, 0), (1, 0)))
    joints = [scene.joint(kind((1, 0), (0, 1))) for kind in (OnCircle, Tilted)]
    one, two = (joint.entries(np.zeros(scene.layout.N), 0.0) for joint in joints)
    assert_allclose(two[2], 2.0 * one[2])


# sparse matrices


def test_groups_rank_and_null_space_are_those_of_the_dense_matrix():
    rng = np.random.default_rng(0)
    blocks = [rng.standard_normal((k, n)) for k, n in ((1, 1), (2, 5), (4, 7), (1, 3))]
    rows, columns = rng.permutation(8), rng.permutation(20)
    J = scipy.linalg.block_diag(*blocks, np.zeros((0, 4)))[rows][:, columns]
    found = list(rank.groups(sparse.csr_array(J)))
    assert sorted(A.shape for _, _, A in found) == sorted(A.shape for A in blocks)
    again = np.zeros_like(J)
    for i, j, A in found:
        again[np.ix_(i, j)] = A
    assert np.array_equal(again, J)
    T = rank.null_basis(sparse.csr_array(J))
    assert T.shape == (20, 12)
    assert_allclose(J @ T.toarray(), 0.0, atol=1e-13)
    assert np.linalg.matrix_rank(T.toarray()) == 12


@pytest.mark.parametrize("form", [np.array, sparse.csr_array])
def test_the_first_dependent_row_and_how_far_it_is_open(form):
    rng = np.random.default_rng(1)
    J = rng.standard_normal((5, 9))
    J[3] = 2.0 * J[0] - J[1]
    J[4] = J[0]
    free, phi = np.ones(9, dtype=bool), np.array([1.0, 2.0, 3.0, 0.25, 1.0])
    k, gap = rank.first_dependent(form(J), free, lambda: phi)
    assert k == 3 and gap == pytest.approx(0.25, abs=1e-12)  # 2 * 1 - 2 = 0 is what it repeats
    assert rank.first_dependent(form(J[:3]), free, lambda: phi[:3]) is None
    apart = np.vstack([np.eye(9)[0], J[:3] * (np.arange(9) > 0), np.eye(9)[0]])
    assert rank.first_dependent(form(apart), free, lambda: phi) == (4, 0.0)
    free[np.abs(J[1]) > 0] = False
    assert rank.first_dependent(form(J[:3]), free, lambda: phi[:3])[0] == 0


@pytest.mark.parametrize("seed", range(6))
def test_inertia_and_determinant_of_sparse_matrices(seed):
    rng = np.random.default_rng(seed)
    A = sparse.random(60, 60, 0.05, random_state=seed)
    A = A + A.T + sparse.diags(rng.standard_normal(60))
    values = np.linalg.eigvalsh(A.toarray())
    assert rank.inertia_of(A) == (np.sum(values < 0), False)
    P = sparse.eye(60, format="csr")[rng.permutation(60)]
    assert rank.determinant_sign(P @ A) == np.sign(np.linalg.slogdet((P @ A).toarray())[0])


def test_a_singular_matrix_is_called_so():
    A = np.diag([2.0, 3.0, 1.0])
    A[0, 1] = A[1, 0] = np.sqrt(6.0)
    assert rank.inertia_of(sparse.csr_array(A)).singular


# frames


def test_a_welded_chain_bends_like_one_beam():
    """So many joints that there is no border: P L^3 / (3 EI), and the first frequency."""
    scene, P = chain(48), 1.0
    scene.clamp("left", beam=0).point_force((0, -P), (1, 0), beam=47)
    assert not scene.system.constraints.few
    assert sparse.issparse(scene.system.constraints.jacobian(np.zeros(scene.layout.N), 0.0))
    state = scene.solve_static()
    assert state.displacement((1, 0), beam=47)[1] == pytest.approx(-P / (3 * EI), rel=2e-4)
    assert str(state.verdict) == "stable"
    ratio = scene.modes(1).frequencies[0] / (3.516015 * np.sqrt(EI / (RHO * H**2)))
    assert ratio == pytest.approx(1.0, rel=1e-3)


def test_sparse_and_dense_paths_agree(monkeypatch):
    states = []
    for width in (0, 1000):
        monkeypatch.setattr(constraints, "FEW", width)
        scene = frame(2, 2)
        assert scene.system.constraints.few == (width > 0)
        states.append(scene.solve_static())
    a, b = states
    assert_allclose(a.u, b.u, rtol=0, atol=1e-9 * np.abs(b.u).max())
    assert_allclose(a.multipliers, b.multipliers, rtol=0, atol=1e-7 * np.abs(b.multipliers).max())
    assert a.verdict == b.verdict


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


def test_free_motions_of_many_beams():
    """By sparse factors: of a chain all three, of one with a hinge the rotation about it."""
    scene = chain(rank.DENSE // 3 + 20)
    assert len(scene.system.constraints.free_rigid_motions()) == 3
    scene.clamp("left", beam=0)
    assert scene.system.constraints.free_rigid_motions() == []
    last = scene.beams[-1]
    loose = bar((1, 0), (1, 0.5), name="loose")
    hinged = Scene(*scene.beams, loose)
    for joint in scene.joints[:-1]:  # the last is of the clamp
        hinged.joint("weld", beams=joint.beams, at=joint.at)
    hinged.clamp("left", beam=0)
    hinged.joint("hinge", beams=(last, loose), at=(1, 0))
    assert hinged.system.constraints.free_rigid_motions() == ["rotation about (1, 0) of beam loose"]


def test_many_loose_beams_are_not_all_described():
    scene = Scene(*(bar((k, 0), (k + 0.5, 0)) for k in range(rank.DENSE // 3 + 1)))
    assert len(scene.system.constraints.free_rigid_motions()) == rank.MOST
