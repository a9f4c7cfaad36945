"""Forces on material points, at rest or moving, dead or follower, on the axis or off it."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, cast

import numpy as np

from ..beam import (TURN, Beam, Distribution, Layout, PointLocator, RigidBody, WhichBeam,
                    WhichMember, locate, on_body, on_points, probe_reference)
from ..beam.kernels.section import beam_gradients
from ..core import (Array, ArrayLike, TimeFunction, ask, refuse, require_direction, require_finite,
                    require_finite_scalar, require_positive)
from ..mesh.places import as_point
from .item import Item
from .places import dense_entries, point, section
from .symbols import Symbol, force_symbol, inside
from .loads import DeadLoad, Load, TimedLoad, number_at

# a dead force on a point of a cable beside its axis: a force on the axis and a couple

def is_off_axis(beam: Beam, X: Array) -> bool:
    """True for a point X (2,) of the reference cell of a cable that is not on its axis."""
    return not beam.has_sections and bool(abs(X[1] - 0.5) > beam.finder.allowed)


class DirectedForce(Load):
    """A force F(d) on a point and a couple G(d) on the tangent d there, (2,) each; bound. A
    subclass defines :meth:`both` and :meth:`slopes_of_both`."""

    constant = False
    # element and xi of a beam; DOFs and weights of the point and of the tangent, and its start
    _place: tuple[int, float] | None
    _dofs: Any
    _weights: Any
    _along: Any
    _slopes: Any
    _start: Any

    def _put(self, beam: Any, e: int, X: Array) -> None:
        """Place it at a point (2,) of an element."""
        self._place, here = (e, float(X[0])), np.array([e])
        self._dofs, self._weights = probe_reference(beam, e, X)
        slopes, frame = beam_gradients(beam.mesh, beam.element, np.array([X[:1], [0.5]]), here)
        self._along, self._slopes, self._start = self._dofs, slopes[0, 0, 0], frame[0, 0, 0]

    def both(self, d: Array) -> tuple[Array, Array]:
        """F and G."""
        raise NotImplementedError

    def slopes_of_both(self, d: Array) -> tuple[Array, Array]:
        """Their derivatives, (2, 2) each."""
        raise NotImplementedError

    def _tangent(self, u: Array) -> Array:
        return self._start + u[self._along] @ self._slopes

    def _spread(self, force: Array, couple: Array) -> Array:
        out = np.zeros(self.beam.N, couple.dtype)
        np.add.at(out, self._dofs, force[:, None] * self._weights)
        np.add.at(out, self._along, couple[:, None] * self._slopes)
        return out

    def force(self, u: Array) -> Array:
        return self._spread(*self.both(self._tangent(u)))

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        weights = np.broadcast_to(self._weights, self._dofs.shape)
        found = [dense_entries(dofs, self._along, np.einsum("ij,ik,l->ikjl", D, w, self._slopes))
                 for dofs, w, D in zip(
                     (self._dofs, self._along),
                     (weights, np.broadcast_to(self._slopes, self._along.shape)),
                     self.slopes_of_both(self._tangent(u)))]
        i, j, values = map(np.concatenate, zip(*found))
        return i, j, values

    def distribution(self, u: Array) -> Distribution:
        if self._place is None:
            return Distribution()
        (e, xi), nodal = self._place, self.force(u)[self._dofs]
        return Distribution(stations=(e + xi,), points=((e, xi, nodal.T),))


class OffAxisForce(DirectedForce):
    """A dead force (2,) at ``r + Y n`` of a cable, n the unit normal of the axis, with its
    potential; at the reference point X (2,) of element ``e``."""

    def __init__(self, force: Array, e: int, X: Array, beam: Any, amplitude: Any = None) -> None:
        super().__init__(beam, amplitude)
        self.total = force
        self._put(beam, e, np.array([X[0], 0.5]))
        Y = float(beam.mesh.mapping().offset(X.reshape(2, 1, 1), np.array([e]))[0, 0])
        #: minus the potential of the couple is this vector times the unit tangent
        self._arm = Y * np.array([force[1], -force[0]])

    def both(self, d: Array) -> tuple[Array, Array]:
        size = np.sqrt(d @ d)
        return self.total, (self._arm - d * (self._arm @ d) / size**2) / size

    def slopes_of_both(self, d: Array) -> tuple[Array, Array]:
        a, size, along = self._arm, np.sqrt(d @ d), self._arm @ d
        return np.zeros((2, 2)), (3.0 * along / size**2 * np.outer(d, d) - np.outer(a, d)
                                  - np.outer(d, a) - along * np.eye(2)) / size**3

    def mean_force(self, u0: Array, u1: Array) -> Array:
        a, b = self._tangent(u0), self._tangent(u1)
        p, q = np.sqrt(a @ a), np.sqrt(b @ b)
        couple = 0.5 * (1.0 / p + 1.0 / q) * self._arm - 0.5 * (self._arm @ (a + b)) * (a + b) / (
            (p + q) * p * q)
        return self._spread(self.total, couple)

    def potential(self, u: Array) -> float:
        now, before = (d / np.sqrt(d @ d) for d in (self._tangent(u), self._start))
        return -float(np.sum(self.total[:, None] * self._weights * u[self._dofs])
                      + self._arm @ (now - before))


class PointForce(Load):
    """A dead force on a material point.

    Parameters
    ----------
    force
        The force, shape (2,).
    at
        The point (x, y) in the reference configuration, shape (2,), or "right" for the axis at that
        end; None for the centre of mass of a rigid body. At a point of a cable beside its axis the
        force has a couple. For a function of time see
        :class:`~skfem_ancf.actions.point_force.MovingForce`.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`; the beam may be a RigidBody.
    """

    for_bodies = for_domains = True

    def __init__(self, force: ArrayLike, at: Any, beam: WhichMember = None,
                 amplitude: TimeFunction = None) -> None:
        at, beam = on_body(at, beam)
        super().__init__(beam, amplitude)
        self.total, self.at = require_finite("force", force, (2,)), at

    def expand(self, layout: Layout) -> Sequence[Item]:
        if callable(self.at):
            return MovingForce(self.total, self.at, self.beam, self.amplitude).expand(layout)
        return (self._with(beam=number_at(layout, self.at, self.beam)),)

    def bind(self, beam: Beam | RigidBody) -> Load:
        if not isinstance(beam, Beam):
            vector = np.zeros(beam.N)
            dofs, weights = beam.probe(self.at)
            np.add.at(vector, dofs, self.total[:, None] * weights)
            return DeadLoad(beam, vector, self.amplitude)
        e, X = locate(beam, self.at)
        if is_off_axis(beam, X):
            return OffAxisForce(self.total, e, X, beam, self.amplitude)
        vector, distribution = on_points(beam, [(self.total, e, X)])
        return DeadLoad(beam, vector, self.amplitude, distribution)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield force_symbol([_place(self, layout)], self.total)


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
        refuse(len(self.forces) != len(self.distances), "each of the {} forces has a distance from "
               "the first, got {} distances", len(self.forces), len(self.distances))
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


class FollowerForce(DirectedForce):
    """A point force that rotates with the tangent of the axis, or with a rigid body.

    It has no potential and may cause flutter. On the face of a cable it has the couple of its
    distance from the axis.

    Parameters
    ----------
    force
        The force in the reference configuration, shape (2,).
    at
        The material point (x, y), shape (2,).
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`; the beam may be a RigidBody.
    line
        Number of the chain of elements whose tangent is used, where several meet.
    """

    symmetric = False
    for_bodies = True
    # of a bound one: F is a matrix times the unit tangent
    _turn: Any
    _couple: float = 0.0

    def __init__(self, force: ArrayLike, at: Any, beam: WhichMember = None,
                 amplitude: TimeFunction = None, line: int | None = None) -> None:
        at, beam = on_body(at, beam)
        super().__init__(beam, amplitude)
        self.total, self.at, self.line = require_finite("force", force, (2,)), at, line

    def expand(self, layout: Layout) -> Sequence[Item]:
        return (self._with(beam=number_at(layout, self.at, self.beam)),)

    def bind(self, beam: Beam | RigidBody) -> Load:
        bound, lever = cast("FollowerForce", super().bind(beam)), 0.0
        if isinstance(beam, RigidBody):
            bound._dofs, bound._weights = beam.probe(self.at)
            bound._place, bound._start = None, beam.q0[2:]
            bound._along, bound._slopes = beam.direction()
        else:
            found = PointLocator([beam], [slice(beam.N)]).find(as_point(self.at, beam.mesh), beam,
                                                         self.line, ask=True).parts[0]
            e, X = int(found.e[0]), found.X[:, 0]
            if is_off_axis(beam, X):
                lever = float(beam.mesh.mapping().offset(X.reshape(2, 1, 1), np.array([e]))[0, 0])
                X = np.array([X[0], 0.5])
            bound._put(beam, e, X)
        (x, y), n = self.total, bound._start / np.hypot(*bound._start)
        a, b = x * n[0] + y * n[1], x * n[1] - y * n[0]
        bound._turn = np.array([[a, b], [-b, a]])
        bound._couple = -a * lever  # of the component along the axis
        return bound

    def both(self, d: Array) -> tuple[Array, Array]:
        return self._turn @ d / np.hypot(*d), self._couple * (TURN @ d) / (d @ d)

    def slopes_of_both(self, d: Array) -> tuple[Array, Array]:
        square = d @ d
        along = np.outer(d, d) / square
        return (self._turn @ (np.eye(2) - along) / np.sqrt(square),
                self._couple * (TURN - 2.0 * TURN @ along) / square)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield force_symbol([_place(self, layout)], self.total,
                           [section(layout, self.beam, self.at)[1]])


def _place(load, layout):
    """Position of a force, in a picture."""
    beam = layout.beam(load.beam)
    if not isinstance(beam, Beam):
        return point(layout, load.beam, load.at)
    e, X = locate(beam, load.at)
    return inside(layout, beam, e, *X)
