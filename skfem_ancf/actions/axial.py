"""Loads on the axis: follower forces, and forces per length."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..beam.beam import Beam
from ..beam.distribution import AXIS, Distribution, Sampled
from ..beam.kinematics import probe_reference
from ..beam.kernels.section import beam_gradients
from ..beam.masses import TURN
from ..beam.layout import Layout, WhichBeam, WhichMember
from ..beam.points import Points
from ..beam.rigid import RigidBody, on_body
from ..beam.surfaces import add_nodal
from ..core.errors import ask_field, require_finite
from ..core.quadrature import gauss
from ..core.types import Array, TimeFunction
from ..sections.across import Pieces, pieces
from ..mesh.places import as_point
from .item import Item
from .loads import DeadLoad, Load, number_at
from .point_force import TimedLoad, is_off_axis


class FollowerForce(Load):
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

    constant = False
    symmetric = False
    for_bodies = True
    # of a bound one: element and xi, coordinates and weights of its place and of the tangent
    _place: tuple[int, float] | None
    _dofs: Any
    _weights: Any
    _along: Any
    _slopes: Any
    _start: Any
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
        bound, lever = cast("FollowerForce", super().bind(cast("Beam", beam))), 0.0
        if isinstance(beam, RigidBody):
            bound._dofs, weights = beam.probe(self.at)
            bound._place, bound._start = None, beam.q0[2:]
            bound._along, bound._slopes = beam.direction()
        else:
            found = Points([beam], [slice(beam.N)]).find(as_point(self.at, beam.mesh), beam,
                                                         self.line, ask=True).parts[0]
            e, X = int(found.e[0]), found.X[:, 0]
            if is_off_axis(beam, X):
                lever = float(beam.mesh.mapping().offset(X.reshape(2, 1, 1), np.array([e]))[0, 0])
                X = np.array([X[0], 0.5])
            bound._dofs, weights = probe_reference(beam, e, X)
            bound._place, bound._along = (e, float(X[0])), bound._dofs
            slopes, frame = beam_gradients(beam.mesh, beam.element, np.array([X[:1], [0.5]]),
                                           np.array([e]))
            bound._slopes, bound._start = slopes[0, 0, 0], frame[0, 0, 0]
        bound._weights = np.broadcast_to(weights, bound._dofs.shape)
        # the force is a matrix times the unit tangent
        (x, y), n = self.total, bound._start / np.hypot(*bound._start)
        a, b = x * n[0] + y * n[1], x * n[1] - y * n[0]
        bound._turn = np.array([[a, b], [-b, a]])
        bound._couple = -a * lever  # of the component along the axis
        return bound

    def _tangent(self, u):
        return self._start + u[self._along] @ self._slopes

    def _force(self, u):
        d = self._tangent(u)
        force = (self._turn @ d / np.hypot(*d))[:, None] * self._weights
        if self._couple:
            force = force + self._couple * (TURN @ d / (d @ d))[:, None] * self._slopes
        return force

    def force(self, u: Array) -> Array:
        out = np.zeros(self.beam.N)
        np.add.at(out, self._dofs, self._force(u))
        return out

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        d = self._tangent(u)
        size = np.hypot(*d)
        D = self._turn @ (np.eye(2) - np.outer(d, d) / size**2) / size
        values = np.einsum("ij,ik,l->ikjl", D, self._weights, self._slopes)
        if self._couple:
            D = self._couple * (TURN - 2.0 * np.outer(TURN @ d, d) / size**2) / size**2
            values += np.einsum("ij,k,l->ikjl", D, self._slopes, self._slopes)
        rows = np.broadcast_to(self._dofs[:, :, None, None], values.shape)
        columns = np.broadcast_to(self._along[None, None], values.shape)
        return rows.ravel(), columns.ravel(), values.ravel()

    def distribution(self, u: Array) -> Distribution:
        if self._place is None:
            return Distribution()
        e, xi = self._place
        return Distribution(stations=(e + xi,), points=((e, xi, self._force(u).T),))


class LineLoad(Load):
    """A dead force per length of the reference axis.

    Parameters
    ----------
    force
        Force per length, shape (2,), or a function of points x (2, ...) of the reference axis that
        returns (2, ...); or of x and the time.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.
    """

    #: Numbers of the loaded chains of elements, shape (k,); None for all.
    chains: Any = None

    def __init__(self, force: ArrayLike | Callable[[Array], Array], beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.per_length = force if callable(force) else require_finite("force", force, (2,))

    def bind(self, beam: Beam) -> Load:
        given = self.per_length
        if of_place_and_time(given):
            return LineLoadInTime(beam, self.chains, given, self.amplitude)
        vector, distribution = _along_axis(beam, self.chains, given, "force(x)")
        return DeadLoad(beam, vector, self.amplitude, distribution)


def _along_axis(beam, chains, given, name):
    """Force (N,) and distribution of a force per length, on some chains of elements or on all."""
    mapping, (xi, w) = beam.mesh.mapping(), gauss(beam.element.axis_degree + 5)
    e = np.arange(beam.mesh.nelements)
    e = e if chains is None else e[np.isin(beam.mesh.chains, chains)]
    part, size = Pieces(e, np.zeros(len(e)), np.ones(len(e))), np.ones((len(e), 1))

    def at(X, e):
        return ask_field(name, given, mapping.F(X, e))

    if callable(given):
        part = pieces(at, e)
        size = (part.end - part.begin)[:, None]
    x = part.begin[:, None] + size * xi
    X = np.array([x, 0.5 + 0.0 * x])
    values = at(X, part.elements) if callable(given) else given[:, None, None]
    values = values * np.hypot(*mapping.DF(X, part.elements)[:, 0])
    vector = np.zeros(beam.N)
    functions = beam.element.of_mesh(mapping, X, part.elements)[0]
    add_nodal(beam, part.elements, np.einsum("kep,iep->eik", values * size * w, functions), vector)
    return vector, Distribution(sampled=(Sampled(
        AXIS, part.elements, xi, values, parts=np.array([part.begin, part.end])),))


class LineLoadInTime(TimedLoad):
    """A time-dependent force per length of a beam, bound."""

    def __init__(self, beam: Beam, chains: Any, force: Any,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.chains, self.per_length = chains, force

    def at(self, t: float) -> tuple[Array, Distribution]:
        return _along_axis(self.beam, self.chains, lambda x: self.per_length(x, t), "force(x, t)")


def of_place_and_time(force: Any) -> bool:
    """True for a function of two required arguments, x and the time."""
    if not callable(force):
        return False
    try:
        parameters = inspect.signature(force).parameters.values()
    except (TypeError, ValueError):  # of a built-in function
        return False
    return sum(p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
               for p in parameters) == 2
