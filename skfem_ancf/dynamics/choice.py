"""Which scheme a motion takes by ``scheme="auto"``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..equations.system import System
from .base import Scheme
from .energy_momentum import EnergyMomentum
from .gauss import Gauss
from .generalized_alpha import GeneralizedAlpha
from .radau import Radau

#: Tolerance up to which steps of high order are the cheaper ones.
FINE = 1e-4
#: Ratio of the fastest vibration to the slowest beyond which a beam is stiff.
STIFF = 1e3
#: The tolerance of motions where none is asked for.
RTOL = 1e-5


class Choice(NamedTuple):
    """A scheme, and why."""

    scheme: Scheme
    reason: str


def choose_scheme(system: System, rtol: float = RTOL) -> Choice:
    """The scheme for a scene.

    Obstacles take the scheme that conserves energy with them; so do coarse tolerances of scenes
    that lose nothing, others generalised-alpha. Finer ones take collocation: Radau, which damps
    what steps do not resolve, where there are joints, damping or stiff beams, and Gauss else.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    rtol
        The tolerance asked for, relative to the size of the scene.

    Examples
    --------
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.dynamics import choose_scheme
    >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamCable(3),
    ...                    StVenantKirchhoff(2e8, 0.3, 7800.0), width=0.1)).clamp("left")
    >>> choose_scheme(scene.system)
    Choice(scheme=<Gauss, 3 points>, reason='rtol = 1e-05, nothing is lost, no joints')
    >>> choose_scheme(scene.system, 1e-3).scheme
    <EnergyMomentum>
    """
    asked = f"rtol = {rtol:g}"
    if system.forces.contacts.obstacles:
        return Choice(EnergyMomentum(), "obstacles: touching is a kink, and energy is kept")
    if system.mass_solver.by_nodes:
        return Choice(EnergyMomentum(), "a frame: its nodes are eliminated")
    if not all(domain.symmetric for domain in system.domains):
        return Choice(GeneralizedAlpha(), "a domain without an energy")
    if rtol > FINE:
        if system.damped:
            return Choice(GeneralizedAlpha(), f"{asked}, damping")
        return Choice(EnergyMomentum(), f"{asked}, nothing is lost")
    found = [text for text, there in (("joints", system.constraints.m > 0),
                                      ("damping", system.damped)) if there]
    if not found and stiffness_ratio(system) > STIFF:
        found = ["vibrations that no step resolves"]
    if found:
        return Choice(Radau(), f"{asked}, " + ", ".join(found))
    return Choice(Gauss(3), f"{asked}, nothing is lost, no joints")


def stiffness_ratio(system: System) -> float:
    """The frequency of the fastest vibration over that of bending, about, of the stiffest beam.

    A wave along an element of the length L / n takes ``L / (n c)``, bending has the frequency
    ``pi^2 c h / (sqrt(12) L^2)``: the ratio is ``0.7 n L / h``, whatever the material is.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    """
    return max((0.7 * b.mesh.nelements * float(np.sum(b.mesh.lengths)) / b.mesh.height
                for b in system.beams), default=1.0)
