"""Linear and angular momentum of a scene."""

from __future__ import annotations

import numpy as np

from ..beam.domain import Domain
from ..core.types import Array
from .system import System


def momentum(system: System, v: Array) -> Array:
    """Linear momentum of a velocity (N,), shape (2,)."""
    p, total = system.mass.multiply(v), np.zeros(2)
    for member, s in zip(system.members, system.slices):  # a unit translation moves r alone
        total += (member.rigid_motions()[:, :2].T @ p[s] if isinstance(member, Domain) else
                  p[s].reshape(-1, member.nd)[:, :2].sum(axis=0))
    return total


def angular_momentum(system: System, u: Array, v: Array) -> float:
    """Angular momentum about the origin, for displacement and velocity (N,)."""
    p, total = system.mass.multiply(v), 0.0
    for member, s in zip(system.members, system.slices):
        q, pb = (member.q0 + u[s]).reshape(-1, 2), p[s].reshape(-1, 2)
        total += np.sum(q[:, 0] * pb[:, 1] - q[:, 1] * pb[:, 0])
    return float(total)
