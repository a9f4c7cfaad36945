"""Planar ANCF beams of any order as scikit-fem elements."""

from .forms import weak as forms
from .beam.beam import Beam, reference_coordinates
from .materials.damping import KelvinVoigt
from .dynamics import HHT, EnergyMomentum, Gauss, GeneralizedAlpha, Newmark, Radau
from .elements import (ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                       ElementBeamCable, ElementBeamPatelShabana)
from .core.errors import (AncfError, CallbackError, CallError, ConvergenceError, FileError,
                          InputError, MeshError, MissingExtra, ModelWarning, NameUnknown,
                          StabilityWarning, SupportError)
from .scene.frame import Frame
from .materials import NeoHookean, StVenantKirchhoff
from .mesh.mesh_beam import MeshBeam
from .actions.obstacles import Circle, Line, Polygon, SignedDistance
from .beam.rigid import RigidBody
from .scene.scene import Scene
from .sections import Section
from .sweeps.parameter_sweep import sweep

__version__ = "0.1.0"

__all__ = [
    "HHT", "AncfError", "Beam", "CallError", "CallbackError", "Circle", "ConvergenceError",
    "ElementBeamANCF", "ElementBeamANCFCubic", "ElementBeamANCFHermite", "ElementBeamCable",
    "ElementBeamPatelShabana", "EnergyMomentum", "FileError", "Frame", "Gauss", "GeneralizedAlpha",
    "InputError", "KelvinVoigt", "Line", "MeshBeam", "MeshError", "MissingExtra", "ModelWarning",
    "NameUnknown", "NeoHookean", "Newmark", "Polygon", "Radau", "RigidBody", "Scene", "Section",
    "SignedDistance", "StVenantKirchhoff", "StabilityWarning", "SupportError", "forms",
    "reference_coordinates", "sweep",
]
