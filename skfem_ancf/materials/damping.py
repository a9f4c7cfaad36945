"""Damping of materials and of a whole scene."""

import numpy as np

from ..core import ArrayLike, Immutable, refuse, require_finite, require_not_negative


class KelvinVoigt(Immutable):
    """Viscoelastic material with a stress proportional to the strain rate.

    ``S = S(eps) + time C : d eps / dt`` with the Green-Lagrange strain and the moduli C at zero
    strain. Rigid rotation causes no strain rate and no loss. A free vibration of angular frequency
    omega decays with the damping ratio ``time omega / 2``. The stabilisation of an element stays
    elastic. See Linn, Lang, Tuganov: "Geometrically exact Cosserat rods with Kelvin-Voigt type
    viscous damping", Mechanical Sciences 4 (2013).

    Parameters
    ----------
    time
        Retardation time: viscosity over modulus, in units of time; zero or positive.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, Scene,
    ...                         StVenantKirchhoff)
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamCable(5),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01, damping=KelvinVoigt(1e-3))
    >>> scene = Scene(beam).clamp("left").gravity((0, -9.81))
    >>> history = scene.integrate(t_end=0.02, dt=1e-3)
    >>> bool(np.ptp(history.total_energy + history.dissipated) < 1e-11)
    True
    """

    def __init__(self, time: float) -> None:
        self.time = require_not_negative("time", time)

    def __repr__(self) -> str:
        return f"<KelvinVoigt {self.time:g}>"


class Damping(Immutable):
    """Damping of a scene, see :meth:`skfem_ancf.Scene.damping` for its arguments."""

    def __init__(self, mass: float = 0.0, stiffness: float = 0.0,
                 modal: ArrayLike = ()) -> None:
        self.mass = require_not_negative("mass", mass)
        self.stiffness = require_not_negative("stiffness", stiffness)
        self.modal = require_finite("modal", modal, (None,))
        refuse(np.any(self.modal < 0.0), "modal must be damping ratios, zero or positive, of the "
               "lowest modes, got {!r}", modal)
        self._acts = bool(self.mass or self.stiffness or np.any(self.modal))

    def __bool__(self) -> bool:
        return self._acts

    def __repr__(self) -> str:
        return f"<Damping {self.mass:g} M, time {self.stiffness:g}, {len(self.modal)} modes>"


#: Default of a scene.
UNDAMPED = Damping()
