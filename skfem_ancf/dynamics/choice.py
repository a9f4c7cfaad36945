"""Schemes by name, and the choice of one by ``scheme="auto"``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core import require_option
from ..equations.system import System
from .base import Scheme
from .collocation import Gauss, Radau
from .energy_momentum import EnergyMomentum, EnergyMomentum4
from .generalized_alpha import HHT, GeneralizedAlpha, Newmark

#: The schemes by name.
SCHEMES = {cls.name: cls for cls in (EnergyMomentum, EnergyMomentum4, GeneralizedAlpha, HHT,
                                    Newmark, Gauss, Radau)}


def get_scheme(scheme: str | Scheme | type[Scheme]) -> Scheme:
    """A :class:`Scheme` from its name, its class or itself.

    Raises
    ------
    NameUnknown
        If the name is not known; the message lists the known ones.
    """
    if isinstance(scheme, Scheme):
        return scheme
    if isinstance(scheme, type) and issubclass(scheme, Scheme):
        return scheme()
    return SCHEMES[require_option("scheme", scheme, SCHEMES)]()
#: Tolerance below which schemes of high order are cheaper.
FINE = 1e-4
#: Ratio of axial to bending frequencies above which a beam is stiff.
STIFF = 1e3
#: Default tolerance.
RTOL = 1e-5


class Choice(NamedTuple):
    """A scheme, and the reason for it."""

    scheme: Scheme
    reason: str


def choose_scheme(system: System, rtol: float = RTOL) -> Choice:
    """Choose the scheme for a system.

    * obstacles, frames, materials with a history: ``energy-momentum``,
    * ``rtol`` above 1e-4: ``energy-momentum`` without damping, else ``generalized-alpha``,
    * joints, damping or stiff beams: ``radau``, which damps what steps do not resolve,
    * all others: ``gauss`` with three points.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    rtol
        Tolerance, relative to the size of the scene.

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
    if system.histories.lasting > 1:
        return Choice(EnergyMomentum(), "a material with a history")
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
    """Largest ratio of the highest axial frequency to the lowest bending frequency of a beam."""
    # A wave crosses an element of length L / n in ``L / (n c)``, bending has the frequency ``pi^2 c
    # h / (sqrt(12) L^2)``: the ratio is about ``0.7 n L / h``.
    return max((0.7 * b.mesh.nelements * float(np.sum(b.mesh.lengths)) / b.mesh.height
                for b in system.beams), default=1.0)
