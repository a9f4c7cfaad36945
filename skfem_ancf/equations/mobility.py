"""Unconstrained rigid motions and their description."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
from scipy import sparse

from ..actions.joints.nodes import chain_ends
from ..beam.domain import Domain
from ..beam.rigid import RigidBody
from .signature import DENSE, null_space, row_sizes, unit_rows

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
    """Descriptions of the rigid motions that no support, joint or force element constrains.

    ``joints`` is the Jacobian (m, N) in the reference configuration; ``stiffness`` returns the
    sparse stiffness of force elements there, or is None.
    """
    c = constraints
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
    """Rigid motions of the bodies (N, 3 n), J times them, and a function that names the bodies.

    Bodies are beams, rigid bodies and, in a frame, rigidly connected parts. Each has two
    translations and a rotation in units of its size. Small matrices are dense.
    """
    if c.frame is not None:
        return _motions_of_frame(c, joints)
    values = [member.rigid_motions() / (1.0, 1.0, member.size) for member in c.members]
    if len(values) == 1:
        out = values[0]
    elif c.N <= DENSE:
        out = scipy.linalg.block_diag(*values)
    else:
        out = _sparse(np.concatenate(values), np.repeat(
            np.arange(len(values)), [member.N for member in c.members]))
    return out, joints @ out, lambda: [(who(c.members, k), b.origin, b.size)
                                       for k, b in enumerate(c.members)]


def _motions_of_frame(c, joints):
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
