"""Rank, null spaces and inertia of sparse matrices; with them unconstrained rigid motions,
redundant joints, and their description."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..actions.joints.nodes import chain_ends
from ..beam import Domain, RigidBody
from ..core import Array
from ..core.band import SMALL, Inertia, beside_zero, dense

logger = logging.getLogger(__name__)

#: Relative remainder of a dependent row.
DEPENDENT = 1e-9
#: Ratio of singular values that is zero to round-off.
FREE = 1e-9
#: Largest entry of L, with a unit diagonal of the matrix, for trusted pivots.
LARGEST = 1e6
#: Largest number of columns for dense matrices.
DENSE = 300
#: Largest number of null vectors of a sparse matrix, and number of iterations for them.
MOST, ITERATIONS = 8, 6


def first_dependent(J: Array | sparse.csr_array, free: Array,
                    phi: Callable[[], Array]) -> tuple[int, float] | None:
    """The first row of J (m, N) that depends on those before it at free DOFs, or None; with its
    residual of ``phi()`` (m,) when those before it are met. Rows are orthogonalised by QR in order,
    in groups without a common column."""
    size = np.sqrt((J * J).sum(axis=1))
    first = None
    for rows, _, A in groups(J * free):
        if first is not None and rows[0] > first[0]:
            continue
        R = scipy.linalg.lapack.dgeqrf(A.T)[0] if A.size else A.T  # in the upper triangle
        rest, k = np.zeros(len(rows)), min(R.shape)
        rest[:k] = np.abs(R.diagonal())
        small = rest <= DEPENDENT * size[rows]
        k = int(small.argmax())
        if small[k] and (first is None or rows[k] < first[0]):
            gap = phi()[rows]
            known = scipy.linalg.solve_triangular(R[:k, :k], gap[:k], trans="T")
            first = int(rows[k]), float(gap[k] - R[:k, k] @ known)
    return first


def groups(J: Array | sparse.csr_array) -> Iterator[tuple[Array, Array, Array]]:
    """Yield rows, columns and dense submatrices of groups of rows without a common column."""
    if isinstance(J, np.ndarray):
        columns, = J.any(axis=0).nonzero()
        if len(J):
            yield np.arange(len(J)), columns, J[:, columns]
        return
    J = sparse.csr_array(J)
    J.eliminate_zeros()
    entries = J.tocoo()
    found: list[Any] = []
    for block in blocks(entries.row, entries.col, *J.shape):
        shape = *block.rows.shape, block.columns.shape[1]
        A = np.bincount(block.places, entries.data[block.entries], int(np.prod(shape)))
        found += zip(block.rows, block.columns, A.reshape(shape))
    yield from sorted(found, key=lambda group: group[0][0])


class Block(NamedTuple):
    """Groups of equations of one size without a common DOF."""

    rows: Array  # equations of each group, (g, k)
    columns: Array  # DOFs of each group, (g, c)
    entries: Array  # numbers of the entries of J in these groups
    places: Array  # their positions in a flat array of shape (g, k, c)


def blocks(rows: Array, columns: Array, m: int, n: int) -> list[Block]:
    """Independent groups of the rows of a matrix (m, n) with entries (k,)."""
    links = sparse.coo_array((np.ones(len(rows)), (rows, m + columns)), (m + n, m + n))
    number, group = connected_components(links, directed=False)
    (all_rows, row), (all_columns, column) = (_members(x, number) for x in (group[:m], group[m:]))
    shape = np.array([[len(x) for x in all_of] for all_of in (all_rows, all_columns)]).T
    out = []
    for k, c in np.unique(shape[shape[:, 0] > 0], axis=0):
        some = np.flatnonzero(np.all(shape == (k, c), axis=1))
        place = np.full(number, -1)
        place[some] = np.arange(len(some))
        entries = np.flatnonzero(place[group[rows]] >= 0)
        i, j = rows[entries], columns[entries]
        out.append(Block(np.array([all_rows[g] for g in some]),
                         np.array([all_columns[g] for g in some]).reshape(len(some), c), entries,
                         (place[group[i]] * k + row[i]) * c + column[j]))
    return out


def _members(group, number):
    """Members of each group, and the position of each member in its group."""
    order, count = np.argsort(group, kind="stable"), np.bincount(group, minlength=number)
    place, ends = np.empty(len(group), dtype=int), np.cumsum(count)
    place[order] = np.arange(len(group)) - np.repeat(ends - count, count)
    return [order[last - n:last] for n, last in zip(count, ends)], place


def inertia_of(A: Array | sparse.csr_array) -> Inertia:
    """The Inertia of a symmetric matrix, by pivots if it is sparse; LinAlgError if these fail."""
    size = np.abs(A.diagonal())
    if not len(size):
        return Inertia(0, False)
    size[size == 0.0] = np.max(size)
    if isinstance(A, np.ndarray):
        root = np.sqrt(size)
        values = np.linalg.eigvalsh(A / (root[:, None] * root))
        largest = max(1.0, values[-1])  # scale of the round-off
        return beside_zero(lambda shift: int(np.sum(values < -shift * largest)))
    scale, positive = sparse.diags(1.0 / np.sqrt(size)), np.all(A.diagonal() > 0.0)
    A, one = scale @ A @ scale, sparse.eye(len(size))
    try:
        if positive and np.all(_pivots(A) > SMALL):
            return Inertia(0, False)
    except np.linalg.LinAlgError:
        logger.debug("not definite")
    return beside_zero(lambda shift: int(np.sum(_pivots(A + shift * one) < 0.0)))


def diagonal_factors(A: sparse.csc_array, order: str) -> Any:
    """Sparse LU of a symmetric matrix with all pivots on the diagonal, or None."""
    # ``order`` is a column ordering of :func:`scipy.sparse.linalg.splu`.
    try:
        lu = splu(A, order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # a pivot is zero
        return None
    return lu if np.array_equal(lu.perm_r, lu.perm_c) else None


def _pivots(A):
    """Pivots of a symmetric matrix with unit diagonal; LinAlgError if they are unreliable."""
    for order in ("MMD_AT_PLUS_A", "COLAMD"):
        lu = diagonal_factors(A.tocsc(), order)
        if lu is not None and np.max(np.abs(lu.L.data)) < LARGEST:
            return lu.U.diagonal()
    raise np.linalg.LinAlgError("the matrix is singular")


def determinant_sign(A: Array | sparse.csr_array) -> int:
    if isinstance(A, np.ndarray):
        return -1 if np.linalg.slogdet(A)[0] < 0.0 else 1
    lu, one = splu(A.tocsc()), sparse.eye(A.shape[0], format="csr")
    odd = np.sum(lu.U.diagonal() < 0.0)
    for order in (lu.perm_r, lu.perm_c):  # parity: a cycle of length k is k - 1 exchanges
        odd += len(order) - connected_components(one[order])[0]
    return -1 if odd % 2 else 1


def row_sizes(A: Array | sparse.csr_array) -> Array:
    """The largest absolute value of each row, shape (m,)."""
    if isinstance(A, np.ndarray) or not A.nnz:
        return np.zeros(A.shape[0]) if not A.size else np.abs(A).max(axis=1)
    return np.asarray(abs(A).max(axis=1).toarray()).ravel()


def unit_rows(A: Array | sparse.csr_array) -> Array | sparse.csr_array:
    """Scale rows to a largest entry of 1 and drop zero rows."""
    size = row_sizes(A)
    keep = size > 0.0
    if not keep.all():
        A, size = A[keep], size[keep]
    return A / size[:, None] if isinstance(A, np.ndarray) else sparse.diags(1.0 / size) @ A


def null_space(H: Array | sparse.csr_array) -> Array:
    """Orthonormal vectors (k, n) of the null space of H (r, n), whose rows have unit size."""
    # With more than :data:`DENSE` columns at most :data:`MOST` vectors are found.
    n = H.shape[1]
    if not H.shape[0]:
        return np.eye(n)[:n if n <= DENSE else MOST]
    if n <= DENSE:
        H = H if isinstance(H, np.ndarray) else dense(H)
        _, sigma, V, info = scipy.linalg.lapack.dgesdd(
            H if len(H) <= 4 * n else np.linalg.qr(H, mode="r"))
        if info != 0:
            raise np.linalg.LinAlgError("the singular values were not found")
        return V[np.count_nonzero(sigma > FREE * sigma[0]):]
    # inverse iteration with H^T H + small^2, in a form with the root of its condition number
    small = 0.1 * FREE
    lu = splu(sparse.bmat([[small * sparse.eye(H.shape[0]), H],
                                  [H.T, -small * sparse.eye(n)]], format="csc"))
    X = np.random.default_rng(0).standard_normal((n, MOST))
    for _ in range(ITERATIONS):
        X = np.linalg.qr(lu.solve(np.vstack([np.zeros((H.shape[0], MOST)), X]))[H.shape[0]:])[0]
    _, sigma, V = np.linalg.svd(np.linalg.qr(H @ X, mode="r"))
    largest = np.sqrt(sparse.linalg.norm(H, 1) * sparse.linalg.norm(H, np.inf))
    X = X @ V[sigma <= FREE * largest].T
    # sparse vectors, with few beams in each
    _, R, pivots = scipy.linalg.qr(X.T, mode="economic", pivoting=True)
    k = len(R)
    out = np.empty((k, n))
    out[:, pivots] = scipy.linalg.solve_triangular(R[:, :k], R)
    return out / np.linalg.norm(out, axis=1)[:, None]


# redundant equations of joints

#: Relative size of a remainder, compared with the largest, from which a row may be the next pivot.
MUCH = 0.5
#: Relative size of the trial motion.
MOVED = 3e-3
#: Largest relative residual of closed equations.
CLOSED = 1e-10
#: Largest number of Newton corrections.
CORRECTIONS = 12
#: Relative lever of a support that prevents a rotation for certain.
HELD = 1e-3


def repeated(constraints: Any) -> tuple[Array | None, bool]:
    """The redundant equations of joints, and whether they are dependent in this position only."""
    # A redundant equation is closed, and a linear combination of others in J at the start and after
    # a small random motion that the joints allow: a linkage in a singular position has such rows at
    # the start only. None involved may depend on time; None for dependent equations of another
    # kind.
    c, found, passing = constraints, [], False
    start = np.zeros(c.N)
    start[c.fixed] = c.values(1.0)
    J = _scaled(c, start)
    moving = np.array([joint.moving for joint in c.joints for _ in joint.equations])
    driven = np.zeros(c.N, dtype=bool)
    driven[c.fixed[c.given != 0.0]] = True
    for joint, first, factors in c._moving:
        driven[c.fixed[first:first + len(factors)]] = True
    # entries may be zero at the start only
    move = np.random.default_rng(0).uniform(-MOVED, MOVED, c.N) * c.free
    pattern = abs(J) + abs(_scaled(c, start + c.coordinate_sizes * move))
    for rows, _, _ in groups(pattern * c.free):
        size = np.sqrt((J[rows] * J[rows]).sum(axis=1))
        size[size == 0.0] = 1.0
        kept = _basis(J[rows].toarray() * c.free / size[:, None])
        rest = np.setdiff1d(np.arange(len(rows)), kept)
        if not len(rest):
            continue
        u = _beside(c, start, move, rows, len(kept))
        if u is None and _closed(c, start, rows, len(kept)) is None:
            return None, False
        if u is None:
            passing = True
            continue
        for J1 in (J, _scaled(c, u)):
            A = J1[rows].toarray() / size[:, None]
            C = np.linalg.lstsq(A[kept][:, c.free].T, A[rest][:, c.free].T, rcond=None)[0].T
            gap = A[rest] - C @ A[kept]
            if (np.abs(gap[:, c.free]).max(initial=0.0) > 1e3 * DEPENDENT
                    or np.abs(gap[:, driven]).max(initial=0.0) > DEPENDENT
                    or moving[rows[rest]].any()
                    or moving[rows[kept]][np.abs(C).max(axis=0) > DEPENDENT].any()):
                return None, False
        found.append(rows[rest])
    if passing:
        return None, True
    return np.sort(np.concatenate([np.zeros(0, dtype=int), *found])), False


def shared(J: sparse.csr_array, multipliers: Array, left: Array, inner: Array) -> Array:
    """The smallest multipliers (m,) with the same forces as given ones."""
    # Multipliers of internal equations (``inner``, bool (m,)) are not minimised; ``left`` are the
    # redundant equations.
    out = multipliers.copy()
    for rows, columns, A in groups(J):
        if np.isin(rows, left).any() and A.size:
            own, rows = A[inner[rows]], rows[~inner[rows]]
            A = J[rows].toarray()[:, columns]
            Q = np.linalg.qr(own.T)[0]
            A = A - (A @ Q) @ Q.T
            out[rows] = np.linalg.lstsq(A.T, A.T @ multipliers[rows], rcond=DEPENDENT)[0]
    return out


def _scaled(c, u):
    """The Jacobian in units of DOFs and equations, sparse."""
    sizes = c.equation_sizes(*c.slopes)
    return sparse.csr_array(
        sparse.diags_array(1.0 / sizes) @ c.sparse_jacobian(u, 0.0)
        @ sparse.diags_array(c.coordinate_sizes))


def _basis(A):
    """Rows that span all rows, by pivoted Gram-Schmidt."""
    kept: list[int] = []
    A = A.copy()
    for _ in range(min(A.shape)):
        left = np.linalg.norm(A, axis=1)
        left[kept] = 0.0
        if not left.max() > DEPENDENT:
            break
        k = int((left >= MUCH * left.max()).argmax())
        q = A[k] / left[k]
        kept.append(k)
        for _ in range(2):  # reorthogonalise
            A -= np.outer(A @ q, q)
    return np.sort(np.array(kept, dtype=int))


def _beside(c, start, move, rows, rank):
    """A position near the start in which equations of this rank are closed, or None."""
    found = _closed(c, start, rows, rank)
    if found is None:
        return None
    u, V = found
    found = _closed(c, u + c.coordinate_sizes * (move - V.T @ (V @ move)), rows, rank)
    return None if found is None else found[0]


def _closed(c, u, rows, rank):
    """Close equations of this rank by Newton's method; position and row space, or None."""
    sizes = c.equation_sizes(*c.slopes)[rows]
    for _ in range(CORRECTIONS):
        A, phi = _scaled(c, u)[rows].toarray() * c.free, c.constraint(u, 0.0)[rows] / sizes
        W, sigma, V = np.linalg.svd(A, full_matrices=False)
        if rank and not sigma[rank - 1] > 0.0:
            return None
        if np.abs(phi).max() <= CLOSED:
            independent = (sigma[rank:] > 1e3 * DEPENDENT * sigma[:1]).any()
            return None if independent else (u, V[:rank])
        u = u - c.coordinate_sizes * (V[:rank].T @ (W[:, :rank].T @ phi / sigma[:rank]))
    return None


#: Largest number of motions, and of parts of each, that a message names.
SHOWN = 4


def who(members: Any, k: int) -> str:
    """Name of beam or body number k for messages."""
    member = members[k]
    for kind, name in ((RigidBody, "rigid body"), (Domain, "domain")):
        if isinstance(member, kind):
            return f" of the {name} {member.name or k}"
    return "" if len(members) == 1 else f" of beam {member.name or k}"


def free_rigid_motions(constraints: Any, joints: Any,
                       stiffness: Callable[[], Any] | None) -> list[str]:
    """Descriptions of the rigid motions that no support, joint or force element constrains."""
    # ``joints`` is the Jacobian (m, N) in the reference configuration; ``stiffness`` returns the
    # sparse stiffness of force elements there, or is None.
    c = constraints
    if len(c.members) == 1 and _held(c):
        return []
    motions, of_joints, bodies = _motions(c, joints)
    parts = [motions[c.fixed], of_joints]
    if stiffness is not None:
        K = stiffness()
        pushed = K @ motions
        size, terms = (row_sizes(x) * c.coordinate_sizes for x in (pushed, abs(K) @ abs(motions)))
        parts.append(pushed[size > 1e-9 * np.maximum(terms, size.max(initial=0.0))])
    dense = isinstance(motions, np.ndarray)
    free = null_space(unit_rows(np.concatenate(parts) if dense else sparse.vstack(parts)))
    bodies = bodies() if len(free) else []
    return [_describe(v, bodies) for v in free]


def _held(c):
    """True if supports hold a node of the only member, and something that turns about it."""
    (member,), held, sizes = c.members, set(c.fixed.tolist()), c.coordinate_sizes
    node = next((d for d in held if d % member.nd == 0 and d + 1 in held), None)
    if node is None:
        return False
    q = member.q0_local
    levers = ((q[d ^ 1] - (q[node + (d ^ 1) % 2] if d % member.nd < 2 else 0.0), sizes[d])
              for d in held)
    return any(abs(lever) > HELD * size for lever, size in levers)


def _motions(c, joints):
    """Rigid motions of the bodies (N, 3 n), J times them, and a function that names the bodies."""
    # Bodies are beams, rigid bodies and, in a frame, rigidly connected parts. Each has two
    # translations and a rotation in units of its size. Small matrices are dense.
    if c.frame is not None:
        frame, origin = c.frame, c.members[0].origin
        parts = frame.parts()
        of_part, values, first = np.zeros(c.N, dtype=int), [], 0
        for beam, s in zip(c.members, c.slices):
            ends = chain_ends(beam)
            of = np.repeat(parts[first:first + len(ends)], ends[:, 1] - ends[:, 0] + 1)
            of_part[s], first = np.repeat(of, beam.nd), first + len(ends)
            motions, shift = beam.rigid_motions().copy(), beam.origin - origin
            motions[:, 2] += shift[0] * motions[:, 1] - shift[1] * motions[:, 0]
            values.append(motions / (1.0, 1.0, c.size))
        motions, number = np.concatenate(values), int(parts.max()) + 1
        if number > 1:
            motions = _sparse(motions, of_part)
        held = frame.fixed_motions(parts, origin, c.size, number)
        if joints.shape[0] > len(frame.equations):
            others = joints[len(frame.equations):] @ motions
            held = sparse.vstack([held, others]) if number > 1 else np.concatenate([held, others])
        return motions, held, lambda: [(name, origin, c.size) for name in frame.describe(parts)]
    values = [member.rigid_motions().copy() for member in c.members]
    for motions, member in zip(values, c.members):
        motions[:, 2] /= member.size
    if len(values) == 1:
        out = values[0]
    elif c.N <= DENSE:
        out = scipy.linalg.block_diag(*values)
    else:
        out = _sparse(np.concatenate(values), np.repeat(
            np.arange(len(values)), [member.N for member in c.members]))
    return out, joints @ out, lambda: [(who(c.members, k), b.origin, b.size)
                                       for k, b in enumerate(c.members)]


def _sparse(values, of_body):
    """Rigid motions (N, 3) of the bodies as a sparse matrix."""
    n = len(values)
    return sparse.csr_array((values.ravel(), (3 * of_body[:, None] + np.arange(3)).ravel(),
                             3 * np.arange(n + 1)), shape=(n, 3 * int(of_body.max() + 1)))


def advice(constraints: Any) -> str:
    """A support to add, in words."""
    if constraints.frame is not None:
        points = constraints.frame.graph.points
        x = "({:.6g}, {:.6g})".format(*points[:, np.lexsort(points)[0]])
        return (f"frame.clamp({x}), the name or number of a node in place of its point, or as "
                f"a roller frame.hold({x}, 'y')")
    member = constraints.members[0]
    if isinstance(member, RigidBody):
        name = repr(0 if member.name is None else member.name)
        x = "({:.6g}, {:.6g})".format(*member.position)
        return (f"scene.clamp({x}, beam={name}) for all of a body, scene.pin({x}, beam={name}) "
                "for a point, or springs")
    if isinstance(member, Domain):
        return "scene.clamp('left', domain), by the name of a boundary of its mesh"
    return "scene.clamp('left'), scene.pin('right') or, as a roller, scene.fix('right', 'r^2')"


def _describe(v, bodies):
    """Describe a rigid motion of bodies (name, origin, size)."""
    parts = []
    for k, (who, origin, size) in enumerate(bodies):
        a, b, c = v[3 * k:3 * k + 3]
        if max(abs(a), abs(b), abs(c)) < 1e-8:
            continue
        if abs(c) < 1e-8:
            d = np.round(np.array([a, b]) / np.hypot(a, b), 8)
            d = (d if d[np.argmax(np.abs(d))] > 0 else -d) + 0.0  # no -0
            parts.append(f"translation along ({d[0]:.3g}, {d[1]:.3g}){who}")
        else:
            x = origin + np.array([-b, a]) * size / c
            x = np.where(np.abs(x) < 1e-9 * size, 0.0, x)
            parts.append(f"rotation about ({x[0]:.4g}, {x[1]:.4g}){who}")
    return first_of(parts, " with ")


def first_of(texts: list[str], between: str) -> str:
    """The first of some texts, joined, and how many others there are."""
    others = f"{between}{len(texts) - SHOWN} others" if len(texts) > SHOWN else ""
    return between.join(texts[:SHOWN]) + others
