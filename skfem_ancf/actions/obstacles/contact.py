"""Where a body touches obstacles, and how hard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InputError, require_index
from ...core.types import Array


@dataclass(frozen=True)
class Contact:
    """The points of bodies that press on obstacles.

    Attributes
    ----------
    points
        Where they are, shape (2, n).
    force
        What obstacles do to each of them, shape (2, n); their sum is ``total``.
    pressure
        The force normal to the obstacle by the area of the stress-free surface, shape (n,).
    gap
        Distance from the obstacle, negative by the penetration, shape (n,).
    nearest
        The smallest distance of all points, of those too that do not touch.
    """

    points: Array
    force: Array
    pressure: Array
    gap: Array
    nearest: float

    @property
    def total(self) -> Array:
        """The sum of the forces, shape (2,)."""
        return self.force.sum(axis=1)

    @property
    def penetration(self) -> float:
        """The largest penetration; zero without contact."""
        return max(0.0, -self.nearest)

    def __len__(self) -> int:
        return self.points.shape[1]

    def __repr__(self) -> str:
        return (f"<Contact at {len(self)} points, penetration {self.penetration:.3g}, nearest "
                f"{self.nearest:.3g}>")


def contact_of(state: Any, obstacle: Any = None) -> Contact:
    """The Contact of a state."""
    contacts = state.system.forces.contacts
    if not contacts.obstacles:
        raise InputError("the scene has no obstacle: scene.obstacle(Circle((0, -1), 0.5)) adds one")
    which = None if obstacle is None else require_index("obstacle", obstacle,
                                                        len(contacts.obstacles))
    found, nearest = [], np.inf
    t = state.load if state.t is None else state.t
    v = None if state.t is None else np.array(state.v)
    for k, *values in contacts.pushes(np.array(state.u), v, t):
        if which is None or k == which:
            nearest = min(nearest, float(values[3].min()))
            found.append([x[..., values[2] > 0.0] for x in values])
    places, force, pressure, gap = (np.concatenate(x, axis=-1) for x in zip(*found))
    return Contact(places, force, pressure, gap, nearest)
