"""Beams, rigid bodies and domains: strain energy and inertia; names for the other folders."""

from .masses import TURN, points_along, projected
from .beam import Beam, reference_coordinates
from .solid import PiolaForm, PiolaTangent, displacement_strain, moduli_at, scattered, tensor
from .domain import Domain, DomainPoints, drawn, grade_of
from .rigid import RigidBody, on_body
from .layout import Layout, WhichBeam, WhichMember, select_beam, select_member
from .points import BeamPoints, Located, PointLocator, require_body
from .remembered import by_history, cable_forces, has_history, remembers, with_history

__all__ = ["Beam", "RigidBody", "reference_coordinates"]
