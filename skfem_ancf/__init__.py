"""Planar ANCF beams of any order as scikit-fem elements."""

from .actions.eigenstrain import EigenStrain, Temperature
from .actions.energy import Energy, check_derivatives
from .actions.forces import (Control, Drag, ForceElement, Foundation, PointMass, RotatingFrame,
                             Spring, TorsionalSpring)
from .actions.item import Item
from .actions.joints import (Hinge, Joint, Motor, OnCircle, OnLine, PlaneSection, PrescribedAngle,
                             PrescribedPosition, PrescribedTurn, Sleeve, Slot, Weld)
from .actions.form_load import FormLoad
from .actions.loads import DeadLoad, EndMoment, LineLoad, Load, Pressure, Traction, Weight
from .actions.point_force import FollowerForce, MovingForce, PointForce, Train
from .actions.pairs import BodyContact
from .actions.obstacles import Circle, Contact, Line, Obstacle, Polygon, SignedDistance
from .actions.supports import Clamp, Pin, Support
from .beam import Beam, Domain, RigidBody, reference_coordinates
from .core import (AncfError, CallError, CallbackError, CheckpointError, ConvergenceError,
                   FileError, InputError, Interrupted, MeshError, MissingExtra, ModelWarning,
                   NameUnknown, StabilityWarning, SupportError)
from .dynamics import EnergyMomentum, Gauss, GeneralizedAlpha, HHT, Newmark, Radau, Scheme
from .dynamics.history import History
from .dynamics.sensors import Readings
from .equations.matrices import SceneMatrices
from .equations.stability import Verdict
from .scene.quasistatic import Ramp, StepHistory, Steps
from .elements import (ElementBeam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                       ElementBeamCable, ElementBeamPatelShabana)
from . import forms
from .formulations import Formulation
from .materials import (ElasticPlastic, HistoryMaterial, Material, NeoHookean, PointwiseMaterial,
                        Prony, StVenantKirchhoff, Voce)
from .materials.damping import KelvinVoigt
from .mesh.mesh_beam import MeshBeam
from .recovery.resultants import Resultants
from .results.checks import Checks
from .results.path import CriticalPoint, Path
from .results import Extreme, Reaction, State
from .scene.cases import Envelope, LoadCases
from .scene.control import LinearModel, StateSpace, Stepper
from .scene.design import BucklingLoad, CriticalLoad, Design, Frequency
from .scene.motion_design import MotionDesign
from .scene.parameters import Parameters
from .scene import Frame, Scene
from .scene.solve import Plan
from .sections import Section
from .results.modes import Buckling, FrequencyResponse, Modes
from .sweeps import Sweep, sweep
from .visuals.pyvista import Explorer

__version__ = "0.1.0"

__all__ = ["HHT", "AncfError", "Beam", "BodyContact", "Buckling", "BucklingLoad", "CallError",
           "CallbackError", "CheckpointError", "Checks", "Circle", "Clamp", "Contact", "Control",
           "ConvergenceError", "CriticalLoad", "CriticalPoint", "DeadLoad", "Design", "Domain",
           "Drag", "EigenStrain", "ElasticPlastic", "ElementBeam", "ElementBeamANCF",
           "ElementBeamANCFCubic", "ElementBeamANCFHermite", "ElementBeamCable",
           "ElementBeamPatelShabana", "EndMoment", "Energy", "EnergyMomentum", "Envelope",
           "Explorer", "Extreme", "FileError", "FollowerForce", "ForceElement", "FormLoad",
           "Formulation", "Foundation", "Frame", "Frequency", "FrequencyResponse", "Gauss",
           "GeneralizedAlpha", "Hinge", "History", "HistoryMaterial", "InputError", "Interrupted",
           "Item", "Joint", "KelvinVoigt", "Line", "LineLoad", "LinearModel", "Load", "LoadCases",
           "Material", "MeshBeam", "MeshError", "MissingExtra", "ModelWarning", "Modes",
           "MotionDesign", "Motor", "MovingForce", "NameUnknown", "NeoHookean", "Newmark",
           "Obstacle", "OnCircle", "OnLine", "Parameters", "Path", "Pin", "Plan", "PlaneSection",
           "PointForce", "PointMass", "PointwiseMaterial", "Polygon", "PrescribedAngle",
           "PrescribedPosition", "PrescribedTurn", "Pressure", "Prony", "Radau", "Ramp", "Reaction",
           "Readings", "Resultants", "RigidBody", "RotatingFrame", "Scene", "SceneMatrices",
           "Scheme", "Section", "SignedDistance", "Sleeve", "Slot", "Spring", "StVenantKirchhoff",
           "StabilityWarning", "State", "StateSpace", "StepHistory", "Stepper", "Steps", "Support",
           "SupportError", "Sweep", "Temperature", "TorsionalSpring", "Traction", "Train",
           "Verdict", "Voce", "Weight", "Weld", "check_derivatives", "forms",
           "reference_coordinates", "sweep"]
