"""Planar ANCF beams of any order as scikit-fem elements."""

from . import forms
from .beam import Beam, reference_coordinates
from .damping import KelvinVoigt
from .dynamics import HHT, EnergyMomentum, Gauss, GeneralizedAlpha, Newmark, Radau
from .elements import (ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                       ElementBeamCable, ElementBeamPatelShabana)
from .errors import (AncfError, CallbackError, CallError, ConvergenceError, FileError, InputError,
                     MeshError, MissingExtra, ModelWarning, NameUnknown, StabilityWarning,
                     SupportError)
from .frame import Frame
from .materials import NeoHookean, StVenantKirchhoff
from .mesh import MeshBeam
from .obstacles import Circle, Line, Polygon, SignedDistance
from .rigid import RigidBody
from .scene import Scene
from .sections import Section
from .sweeps import sweep

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
