"""Displacement, position and velocity of material points, of one state or of many."""

from __future__ import annotations

from typing import Any

from ..beam.layout import WhichMember, select_member
from ..beam.points import require_body
from ..core.linear import first_order
from ..core.near_misses import NearMisses
from ..core.types import Array
from ..equations.system import System


class MaterialPoints(NearMisses):
    """What a solution knows of material points by its degrees of freedom alone.

    Arrays of a motion and of a path have the instants, or the points of the path, as their first
    axis.

    Other Parameters
    ----------------
    point
        A material point by its place (x, y) in the reference configuration, shape (2,); or many: a
        list of points, or an array (2, n) whose columns are points; of displacement, position and
        velocity also a RigidBody for its centre of mass.
    beam
        The beam or rigid body, its name or its number; found for each point if it is not given.
    line
        The number of the line, of a frame; found for each point if it is not given. A point that is
        in several lines or beams is one of that whose axis is nearest, here as in all loads and
        probes; of the first of them if several are as near, as at a node.
    body
        A RigidBody, its name or its number.
    """

    system: System
    u: Array
    v: Array

    @property
    def _places(self) -> Array:
        """Displacement of the degrees of freedom, of a linear solution a step."""
        return self.u

    def _dofs(self, member):
        system = self.system
        return system.of(select_member(system.beams, system.members[len(system.beams):],
                                       member))

    def u_of(self, beam: WhichMember) -> Array:
        """Coordinate displacements (..., n) of one beam or rigid body."""
        return self.u[..., self._dofs(beam)]

    def displacement(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Displacement of material points, (..., 2) or (..., 2, n).

        Raises
        ------
        MeshError
            If a point is outside the body.
        """
        return first_order(self.system.points.find(point, beam, line).displacement(self._places))

    def position(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Position of material points, (..., 2) or (..., 2, n)."""
        at = self.system.points.find(point, beam, line)
        return at.start + first_order(at.displacement(self._places))

    def velocity(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Velocity of material points, (..., 2) or (..., 2, n); zero where there is no motion."""
        return self.system.points.find(point, beam, line).velocity(self.u, self.v)

    def angle(self, body: WhichMember) -> Any:
        """The angle (...) of a rigid body, in radians, no more than pi from that of the start."""
        found = require_body(self.system, body)
        return first_order(found.angle_at(self._places[..., self.system.of(found)]))

    def angular_velocity(self, body: WhichMember) -> Any:
        """The angular velocity (...) of a rigid body, counterclockwise; zero without motion."""
        found = require_body(self.system, body)
        s = self.system.of(found)
        return found.angular_velocity(self.u[..., s], self.v[..., s])
