"""Moving loads: a force that moves along a beam, and a train of forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..beam.beam import Beam
from ..beam.distribution import Distribution, on_points
from ..beam.kinematics import locate
from ..beam.layout import WhichBeam
from ..core.errors import (InputError, ask, require_direction, require_finite,
                           require_finite_scalar, require_positive)
from ..core.types import Array, TimeFunction
from .loads import Load
from .off_axis import OffAxisForce, is_off_axis

_NONE = np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0)


class TimedLoad(Load):
    """A force that depends on time and not on the displacement.

    A subclass defines :meth:`places` or :meth:`at`. Single static solutions take the load at time
    1; :meth:`skfem_ancf.Scene.run` and motions take the current time.
    """

    constant = False
    # of the load at a time
    _time: float | None = None
    _vector: Any = None
    _distribution: Any = None
    _last: Any = None

    def places(self, t: float) -> Sequence[tuple[Array, int, Array]]:
        """Forces (2,) at time t, each with its element and reference point (2,)."""
        raise NotImplementedError

    def at(self, t: float) -> tuple[Array, Distribution]:
        """Force (N,) at time t and its distribution; by default from :meth:`places`."""
        return on_points(self.beam, self.places(t))

    @property
    def first_order(self) -> bool:
        return False

    def acting(self, t: float | None) -> tuple[float, Load]:
        last, time = self._last, 1.0 if t is None else float(t)
        if last is None or last._time != time:
            last = self._last = self._now(time)._with(_time=time)
        return self.factor(t), last

    def _now(self, time: float) -> Load:
        vector, distribution = self.at(time)
        return self._with(_vector=vector, _last=None, _distribution=distribution)

    def force(self, u: Array) -> Array:
        return self.acting(None)[1].force(u) if self._vector is None else self._vector

    def mean_force(self, u0: Array, u1: Array) -> Array:
        return self.force(u1)

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        return _NONE

    def potential(self, u: Array) -> float:
        return -float(self.force(u) @ u)

    def distribution(self, u: Array) -> Distribution | None:
        if self._distribution is None:
            return self.acting(None)[1].distribution(u)
        return self._distribution


class MovingForce(TimedLoad):
    """A dead force whose point moves over the body; ``scene.point_force(F, at=function)``.

    Parameters
    ----------
    force
        The force, shape (2,).
    at
        A function of time that returns the point (x, y) in the reference configuration, shape (2,);
        None while the force is not on the beam.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamCable(),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> scene = Scene(beam).pin("left").fix("right", "r^2")
    >>> scene = scene.point_force((0, -0.1), at=lambda t: (t, 0.0))
    >>> history = scene.run(1.0, increments=4)
    >>> history.reactions("left").force[:4, 1].round(3).tolist()
    [0.1, 0.075, 0.05, 0.025]
    """

    def __init__(self, force: ArrayLike, at: Callable[[float], ArrayLike], beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.total, self.where = require_finite("force", force, (2,)), at

    def places(self, t: float) -> Sequence[tuple[Array, int, Array]]:
        place = ask("at(t={:g})", self.where, t)
        if place is None:
            return []
        place = require_finite(f"what at(t={t:g}) returns", place, (2,))
        return [(self.total, *locate(self.beam, place))]

    def _now(self, time: float) -> Load:
        places = self.places(time)
        if places and is_off_axis(self.beam, places[0][2]):
            return OffAxisForce(*places[0], self.beam)
        return super()._now(time)


class Train(TimedLoad):
    """Forces at fixed distances that move along the axis of a beam, from its left end.

    Parameters
    ----------
    forces
        The force of each axle, shape (n,), along ``direction``.
    distances
        Distance of each from the first along the axis, shape (n,).
    speed
        Length per time, positive.
    beam
        The beam, its name or number.
    start
        Position of the first axle along the axis at time 0.
    direction
        Direction of the forces, of any length, shape (2,).
    amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.

    Examples
    --------
    Two axles of a lorry, 4 m apart, on a girder of 20 m:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff, Train
    >>> girder = Beam(MeshBeam.init_line(np.linspace(0, 20, 9), height=0.6), ElementBeamCable(),
    ...               StVenantKirchhoff(3e10, 0.2, 2500), width=0.4)
    >>> scene = Scene(girder).pin("left").fix("right", "r^2")
    >>> history = scene.add(Train([5e4, 8e4], [0.0, 4.0], speed=10.0)).run(2.4, increments=6)
    >>> history.reactions("left").force[2:4, 1].round(-2).tolist()
    [94000.0, 68000.0]
    """

    # of a bound one
    _ends: Array

    def __init__(self, forces: ArrayLike, distances: ArrayLike, speed: float,
                 beam: WhichBeam = None, start: float = 0.0, direction: ArrayLike = (0.0, -1.0),
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.forces = require_finite("forces", np.atleast_1d(forces), (None,))
        self.distances = require_finite("distances", np.atleast_1d(distances), (None,))
        if len(self.forces) != len(self.distances):
            raise InputError(f"each of the {len(self.forces)} forces has a distance from the "
                             f"first, got {len(self.distances)} distances")
        self.speed = require_positive("speed", speed)
        self.start = require_finite_scalar("start", start)
        self.direction = require_direction("direction", direction)

    def bind(self, beam: Beam) -> Load:
        return self._with(beam=beam, _ends=np.cumsum(np.append(0.0, beam.mesh.lengths)))

    def places(self, t: float) -> Sequence[tuple[Array, int, Array]]:
        s, ends, places = self.start + self.speed * t - self.distances, self._ends, []
        slack, along = 1e-12 * ends[-1], self.direction / np.hypot(*self.direction)
        for force, x in zip(self.forces, s):
            if -slack <= x <= ends[-1] + slack:
                x = min(max(x, 0.0), ends[-1])
                e = min(int(np.searchsorted(ends, x, side="right")) - 1, len(ends) - 2)
                xi = (x - ends[e]) / (ends[e + 1] - ends[e])
                places.append((force * along, e, np.array([xi, 0.5])))
        return places
