"""Beams, rigid bodies and domains: strain energy and inertia; names for the other folders."""

from .masses import TURN, points_along, projected
from .beam import Beam, reference_coordinates
from .domain import (Domain, DomainPoints, PiolaForm, PiolaTangent, displacement_strain, drawn,
                     grade_of, moduli_at, scattered, tensor)
from .rigid import RigidBody, on_body
from .kinematics import (bent, direction, direction_weights, element_dofs, entries_of, locate,
                         plane, probe_reference)
from .distribution import (AXIS, BODY, LEFT, RIGHT, SNAP, UPPER, Distribution, Facets, Sampled,
                           add_nodal, divided, groups_of, on_facets, on_points, station_of_node,
                           stations_of_vector, surfaces_of)
from .layout import (BeamPoints, Layout, Located, PointLocator, WhichBeam, WhichMember,
                     require_body, select_beam, select_member)
from .strains import by_history, cable_forces, has_history, remembers, with_history

__all__ = ["Beam", "RigidBody", "reference_coordinates"]
