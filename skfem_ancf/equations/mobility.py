"""Unconstrained rigid motions, redundant joints, and their description."""

from typing import Any

import numpy as np
import scipy.linalg
from scipy import sparse

from ..actions.joints.nodes import chain_ends
from ..beam import Domain, RigidBody
from ..core import Array
from .rank import DENSE, DEPENDENT, groups, null_space, row_sizes, unit_rows

# redundant equations of joints

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
        closed = _closed(c, start, rows, len(kept))
        if closed is None:
            return None, False
        u, V = closed
        beside = _closed(c, u + c.coordinate_sizes * (move - V.T @ (V @ move)), rows, len(kept))
        if beside is None:
            passing = True
            continue
        for J1 in (J, _scaled(c, beside[0])):
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
        k = int((left >= 0.5 * left.max()).argmax())  # the first that is large enough
        q = A[k] / left[k]
        kept.append(k)
        for _ in range(2):  # reorthogonalise
            A -= np.outer(A @ q, q)
    return np.sort(np.array(kept, dtype=int))


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


def free_rigid_motions(constraints: Any) -> list[str]:
    """Descriptions of the rigid motions that no support, joint or force element constrains."""
    c, joints, stiffness = constraints, constraints._at_rest, constraints._stiffness
    if len(c.members) == 1:
        # a node of the only member is held, and something that turns about it
        (member,), held, sizes = c.members, set(c.fixed.tolist()), c.coordinate_sizes
        node = next((d for d in held if d % member.nd == 0 and d + 1 in held), None)
        q = member.q0_local
        if node is not None and any(
                abs(q[d ^ 1] - (q[node + (d ^ 1) % 2] if d % member.nd < 2 else 0.0))
                > HELD * sizes[d] for d in held):
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
        return motions, held, lambda: [
            (f" of the part with line {frame.lines[k]}" if number > 1 else "", origin, c.size)
            for k in np.unique(parts, return_index=True)[1]]
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
