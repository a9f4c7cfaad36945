"""Displacement, position and velocity of material points, for states, motions and paths."""

from __future__ import annotations

from typing import Any

from ..beam.layout import WhichMember, select_member
from ..beam.points import require_body
from ..core.linear import first_order
from ..core.near_misses import NearMisses
from ..core.types import Array
from ..equations.system import System


class MaterialPoints(NearMisses):
    """Methods for material points that use degrees of freedom only.

    For a motion or a path the first axis of arrays is that of instants, or of points of the path.

    Other Parameters
    ----------------
    point
        A material point (x, y) in the reference configuration, shape (2,); or many: a list of
        points, or an array (2, n) whose columns are points; for displacement, position and velocity
        also a RigidBody for its centre of mass.
    beam
        Beam or rigid body, name or number; by default found for each point.
    line
        Number of the line of a frame; by default found for each point. A point in several lines or
        beams belongs to the one with the nearest axis, here as in all loads and probes; to the
        first of them if several are equally near, as at a node.
    body
        A RigidBody, its name or number.
    """

    system: System
    u: Array
    v: Array

    @property
    def _places(self) -> Array:
        return self.u

    def _dofs(self, member):
        system = self.system
        return system.of(select_member(system.beams, system.members[len(system.beams):],
                                       member))

    def u_of(self, beam: WhichMember) -> Array:
        """Displacements of the DOFs (..., n) of one beam or rigid body."""
        return self.u[..., self._dofs(beam)]

    def displacement(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Displacement of material points, (..., 2) or (..., 2, n); MeshError outside the body."""
        return first_order(self.system.points.find(point, beam, line).displacement(self._places))

    def position(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Position of material points, (..., 2) or (..., 2, n)."""
        at = self.system.points.find(point, beam, line)
        return at.start + first_order(at.displacement(self._places))

    def velocity(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Velocity of material points, (..., 2) or (..., 2, n); zero where there is no motion."""
        return self.system.points.find(point, beam, line).velocity(self.u, self.v)

    def angle(self, body: WhichMember) -> Any:
        """Rotation (...) of a rigid body in radians, at most pi in magnitude."""
        found = require_body(self.system, body)
        return first_order(found.angle_at(self._places[..., self.system.of(found)]))

    def angular_velocity(self, body: WhichMember) -> Any:
        """Angular velocity (...) of a rigid body, counterclockwise; zero without motion."""
        found = require_body(self.system, body)
        s = self.system.of(found)
        return found.angular_velocity(self.u[..., s], self.v[..., s])
