"""Planar ANCF beams of any order as scikit-fem elements."""

from . import forms
from .beam import Beam, reference_coordinates
from .damping import KelvinVoigt
from .dynamics import HHT, EnergyMomentum, GeneralizedAlpha, Newmark
from .elements import (ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                       ElementBeamPatelShabana)
from .errors import (AncfError, CallbackError, CallError, ConvergenceError, FileError, InputError,
                     MeshError, MissingExtra, ModelWarning, NameUnknown, StabilityWarning,
                     SupportError)
from .materials import NeoHookean, StVenantKirchhoff
from .mesh import MeshBeam
from .rigid import RigidBody
from .scene import Scene
from .sections import Section

__version__ = "0.1.0"

__all__ = [
    "HHT", "AncfError", "Beam", "CallError", "CallbackError", "ConvergenceError",
    "ElementBeamANCF", "ElementBeamANCFCubic", "ElementBeamCable", "ElementBeamPatelShabana",
    "EnergyMomentum", "FileError", "GeneralizedAlpha", "InputError", "KelvinVoigt", "MeshBeam",
    "MeshError",
    "MissingExtra", "ModelWarning", "NameUnknown", "NeoHookean", "Newmark", "RigidBody",
    "Scene", "Section",
    "StVenantKirchhoff", "StabilityWarning", "SupportError", "forms", "reference_coordinates",
]
