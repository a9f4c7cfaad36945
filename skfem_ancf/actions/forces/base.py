"""Base class of force elements: forces on points and sections, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from ...beam.beam import Beam
from ...beam.distribution import Facets
from ...beam.layout import Layout
from ...core.errors import (InputError, explained, require_finite, require_slope, shown,
                            warnings_as_errors)
from ...core.immutable import is_builtin
from ...core.types import Array
from ..item import Item, at_generic_displacements
from ..places import Vector

#: Relative step of differences, where a force does not accept complex numbers.
STEP = 1e-6
#: Relative round-off of a potential.
ROUND_OFF = 1e-14
#: Relative perturbation of the reference configuration for checks of user-defined elements.
ASIDE = 0.01
#: The span of a mean at one time.
TINY = 1e-300
_COMPLEX = getattr(np, "exceptions", np).ComplexWarning


class KernelElement(NamedTuple):
    """An element of a kind that kernels know: its kind, two vectors and five numbers."""

    kind: int
    d: Vector
    e: Vector
    numbers: tuple[float, ...]


class ForceElement(Item):
    """Forces on points and sections of beams as functions of positions, velocities and time.

    A user-defined element, for :meth:`skfem_ancf.Scene.add`, is a subclass that defines
    :meth:`bind` and :meth:`force`, and optionally :meth:`potential`, :meth:`stiffness` and
    :meth:`resistance`. In statics velocities are zero. Load factors do not scale it. The
    energy-momentum scheme conserves the energy if there is a :meth:`potential`; the work of
    velocity-dependent forces is in ``history.dissipated``.

    An element with a memory, such as friction or a controller that integrates, defines
    ``start()``, its history at rest, shape (k,), and ``evaluate(x, v, t, history, dt)`` instead of
    :meth:`force`. That returns the force and the history at the end of an increment of time
    ``dt`` from ``history``, and changes nothing: all solvers, states and checkpoints keep the
    history. What it dissipates is the work of the mean of its forces at both ends of an increment
    minus what it stores: in the example below 0.2 % too little with 20 increments, 0.04 % with 80.
    Its ``stiffness(x, v, t, history, dt)``, ``resistance(x, v, t, history, dt)`` and
    ``potential(x, history)``, the stored energy, are optional. A further increment of ``dt = 0``
    should give the same force. Set ``symmetric = False`` where what slips has no potential.
    ``mean(x, y, t, history, dt)``, a mean force of a step with exact work, is optional, and by
    default that of both ends. So is ``corrected(x, t, history)``: a history with which to repeat an
    increment of statics, or None, as for a penalty that has to grow.

    Attributes
    ----------
    distributed : bool
        It acts along a beam instead of on a few points.
    along
        For a distributed element, once bound: the beam and the location of its parts, as returned
        by :func:`skfem_ancf.beam.surfaces.groups_of`; None if not known.
    links
        The result of :meth:`bind`, once bound.
    groups
        Surface points that an obstacle may touch.
    entries
        For a sparse stiffness, once bound: rows and columns of its values, numbers of components of
        neighbouring links; None for the shape (n, 2, n, 2).
    changing : bool
        Stiffness and resistance are sparse matrices (2 n, 2 n) whose entries may be anywhere, and
        elsewhere at each call, as in contact. Each link is then a pair of degrees of freedom. The
        scene is solved by sparse factors while there are entries, and searches along corrections.

    Other Parameters
    ----------------
    layout
        The :class:`~skfem_ancf.beam.layout.Layout` of the scene.
    x, v, t
        Positions and velocities of the points, shape (n, 2) each; time, in statics the load factor.
    y
        Positions at the end of a step, shape (n, 2); ``x`` is its start and ``t`` its middle.
    history, dt, past
        History at the start of an increment, (k,), and its time; ``past`` are both.

    Examples
    --------
    A hardening spring to the ground with a dashpot:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.actions.forces import ForceElement, point
    >>> class Hardening(ForceElement):
    ...     def __init__(self, k, c, at):
    ...         self.k, self.c, self.at = k, c, at
    ...     def bind(self, scene):
    ...         return [point(scene, None, self.at)]
    ...     def force(self, x, v, t):
    ...         d = x[0] - np.array(self.at)
    ...         return -np.array([self.k * (1.0 + d @ d) * d + self.c * v[0]])
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamANCF(2),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> scene = Scene(beam).clamp("left").gravity((0, -9.81)).add(Hardening(10.0, 1.0, (1, 0)))
    >>> tip = scene.solve_static().displacement((1, 0))
    >>> history = scene.integrate(t_end=0.02, dt=1e-3)
    >>> bool(-0.3 < tip[1] < -0.2), bool(history.dissipated[-1] > 0)
    (True, True)

    Dry friction along x: the force of a spring from an anchor that slips at a limit.

    >>> class Rubbing(ForceElement):
    ...     symmetric = False
    ...     def __init__(self, k, most, at):
    ...         self.k, self.most, self.at = k, most, at
    ...     def bind(self, scene):
    ...         return [point(scene, None, self.at)]
    ...     def start(self):
    ...         return np.array([self.at[0]])
    ...     def evaluate(self, x, v, t, history, dt):
    ...         pull = np.clip(self.k * (x[0, 0] - history[0]), -self.most, self.most)
    ...         return np.array([[-pull, 0.0]]), np.array([x[0, 0] - pull / self.k])
    ...     def potential(self, x, history):
    ...         return 0.5 * self.k * (x[0, 0] - history[0]) ** 2
    >>> bar = Scene(beam).clamp("left").add(Rubbing(1e6, 1.0, (1, 0)))
    >>> bar = bar.fix("right", "r^1", displacement=lambda t: 1e-5 * np.sin(np.pi * t / 2))
    >>> run = bar.run([1.0, 3.0, 5.0], increments=20)  # a cycle of hysteresis
    >>> lost = run.dissipated[-1] - run.dissipated[20]
    >>> bool(np.isclose(lost, 4 * 1.0 * (1e-5 - 1e-6), rtol=0.01))
    True
    """

    distributed = False
    #: It is the internal force of a member of the scene.
    internal = False
    #: Its force may depend on velocities.
    resists = True
    along: tuple[Beam, list[Facets], tuple[float, ...]] | None = None
    links: Any = ()
    groups: Any = ()
    entries: tuple[Array, Array] | None = None
    changing = False

    def bind(self, layout: Layout) -> Sequence[Vector]:
        """The points and sections on which it acts, called on a copy.

        Returns
        -------
        list
            Results of :func:`skfem_ancf.actions.forces.point` and
            :func:`skfem_ancf.actions.forces.section`.
        """
        raise NotImplementedError

    def force(self, x: Array, v: Array, t: float) -> Array:
        """Force on each point, (n, 2); on section directions the conjugate force."""
        raise NotImplementedError

    def potential(self, x: Array) -> float | None:
        """Potential of the force at zero velocity; None if there is none."""
        return None

    def potential_at(self, x: Array, t: float) -> float | None:
        """Potential at a time, for time-dependent energies."""
        return self.potential(x)

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        """Mean force (n, 2) at zero velocity, whose work is minus the change of the potential.

        By default the force in the middle, corrected along the displacement (Gonzalez 1996): the
        work is exact, but the correction may have a moment. :class:`Spring` and
        :class:`TorsionalSpring` define means that conserve the angular momentum exactly.
        """
        d = y - x
        force = np.asarray(self.force(0.5 * (x + y), 0.0 * x, t), dtype=float)
        before = self.potential_at(x, t) if np.any(d) else None
        after = None if before is None else self.potential_at(y, t)
        if before is None or after is None:
            return force
        excess = after - before + np.sum(force * d)
        if abs(excess) <= ROUND_OFF * (abs(before) + abs(after)):
            return force  # next to rest round-off, divided by |d|, would be a large force
        return force - excess / np.sum(d * d) * d

    def stiffness(self, x: Array, v: Array, t: float) -> Any:
        """Derivative of the force by the positions, shape (n, 2, n, 2), the derivative's axes last.

        By default by a complex step or differences.
        """
        return derivative(lambda y: self.force(y, v, t), x)

    def mean_stiffness(self, x: Array, y: Array, t: float, *past: Any) -> Any:
        """Twice the derivative of :meth:`mean_force` by y, if ``changing``.

        By default the stiffness in the middle.
        """
        return self.stiffness(0.5 * (x + y), 0.0 * x, t, *past)

    def resistance(self, x: Array, v: Array, t: float) -> Any:
        """Derivative of the force by the velocities, as :meth:`stiffness`."""
        return derivative(lambda w: self.force(x, w, t), v)

    def stride(self, x: Array, y: Array) -> float:
        """Number of intervals in which a line search looks at the force from x to y."""
        return 1.0

    def corrected(self, x: Array, t: float, history: Array) -> Array | None:
        """In statics, a history with which to repeat an increment that ends at x, or None."""
        return None

    def passed(self, x: Array, y: Array, t: float) -> str | None:
        """Why a step must not lead from x to y, as through a body; None if it may."""
        return None

    def mass_entries(self) -> tuple[Array, Array, Array] | None:
        """Rows, columns and values (k,) added to the mass matrix; None for none."""
        return None

    def parts(self) -> list[KernelElement] | None:
        """Its parts of kinds that kernels know, once bound; None for a user-defined element."""
        return None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}>"


def differences(function: Callable[[Array], Any], x: Array) -> Array:
    """Derivative of a function of an array by central differences."""
    step = STEP * max(1.0, float(np.abs(x).max(initial=0.0)))
    units = step * np.eye(x.size).reshape(x.size, *x.shape)
    columns = [(np.asarray(function(x + d)) - function(x - d)) / (2.0 * step) for d in units]
    return np.stack(columns, axis=-1).reshape(*np.shape(columns[0]), *x.shape)


def derivative(function: Callable[[Array], Any], x: Array) -> Array:
    """As :func:`differences`, by complex steps where both agree; for complex x by these only."""
    if np.iscomplexobj(x):
        raise TypeError("complex steps of complex steps")
    out = differences(function, x)
    for k in np.ndindex(x.shape):
        column = (..., *k)
        step, rough = np.zeros(x.shape, dtype=complex), out[column]
        step[k] = 1e-30j
        try:
            with warnings_as_errors(_COMPLEX):
                found = np.imag(function(x + step)) / 1e-30
            if np.allclose(found, rough, rtol=1e-4, atol=1e-4 * np.abs(rough).max(initial=0.0)):
                out[column] = found
        except (TypeError, ValueError, _COMPLEX):
            pass
    return out


class Remembering:
    """A bound force element with a memory, at one history: as one without memory.

    ``history`` (k,) is that at the start of an increment, ``span`` (1,) the time since.
    """

    def __init__(self, element: Any) -> None:
        self.element = element
        self.start = np.array(require_finite(f"start() of {element!r}", element.start(), (None,)))
        self._at(self.start, np.zeros(1))

    def __getattr__(self, name):
        return getattr(vars(self)["element"], name)

    def __repr__(self) -> str:
        return repr(self.element)

    def after(self, history: Array, span: Array) -> Remembering:
        """A copy at another history and span, of which it has views."""
        other = object.__new__(Remembering)
        vars(other).update(vars(self))
        other._at(history, span)
        return other

    def _at(self, history, span):
        self._values, self.history, self.span = history, history.view(), span
        self.history.flags.writeable = False

    def evaluate(self, x: Array, v: Array, t: float, dt: float | None = None
                 ) -> tuple[Array, Array]:
        """Force and history after ``dt``, by default the span."""
        dt = float(self.span[0]) if dt is None else dt
        force, after = self.element.evaluate(x, v, t, self.history, dt)
        if np.shape(after) != self.start.shape:
            raise InputError(f"evaluate(x, v, t, history, dt) of {self!r} must return the force "
                             f"and a history of the shape of start(), {self.start.shape}, got "
                             f"{np.shape(after)}")
        return np.asarray(force), np.asarray(after)

    def force(self, x: Array, v: Array, t: float) -> Array:
        return self.evaluate(x, v, t)[0]

    def mean_force(self, x: Array, y: Array, t: float, span: float) -> Array:
        """The mean force (n, 2) of a step about t: of its ends; with the span 0 that at the end."""
        if span and hasattr(self.element, "mean"):
            return self.element.mean(x, y, t, self.history, float(self.span[0]))
        end = self.force(y, 0.0 * y, t + 0.5 * span)
        return 0.5 * (self.evaluate(x, 0.0 * x, t - 0.5 * span, 0.0)[0] + end) if span else end

    def _derivative(self, name, function, at, *x):
        own = getattr(self.element, name)
        if own.__func__ is not getattr(ForceElement, name):
            return own(*x, self.history, float(self.span[0]))
        return derivative(function, at)

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        return self._derivative("stiffness", lambda y: self.force(y, v, t), x, x, v, t)

    def mean_stiffness(self, x: Array, y: Array, t: float) -> Any:
        return self.element.mean_stiffness(x, y, t, self.history, float(self.span[0]))

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        return self._derivative("resistance", lambda w: self.force(x, w, t), v, x, v, t)

    def potential_at(self, x: Array, t: float, history: Array | None = None) -> float | None:
        own = self.element.potential
        if own.__func__ is ForceElement.potential:
            return None
        found = own(x, self.history if history is None else history)
        return None if found is None else float(found)

    def accept(self, x: Array, y: Array, v: Array, t: float) -> float:
        """Set the history at the end of an increment from x to y; returns what it dissipates."""
        dt, after = float(self.span[0]), self.evaluate(y, v, t)[1]
        mean = self.mean_force(x, y, t - 0.5 * dt, dt or TINY)
        lost = -np.sum(mean * (y - x)) + (self.potential_at(x, t) or 0.0) - (
            self.potential_at(y, t, after) or 0.0)
        self._values[:] = after
        return float(lost)

    def settle(self, u0: Array, u: Array, t: float) -> float:
        """As :meth:`accept` in statics, between displacements (N,)."""
        x, y = (positions(self, w) for w in (u0, u))
        return self.accept(x, y, 0.0 * y, t)

    def relax(self, u: Array) -> None:
        """Set a history with less stiffness, of contact between members at u (N,)."""
        if hasattr(self.element, "relaxed"):
            self._values[:] = self.element.relaxed(positions(self, u), self.history)

    def correct(self, u: Array, t: float) -> bool:
        """Set a history with which to repeat an increment that ends at u (N,); False for none."""
        new = self.element.corrected(positions(self, u), t, self.history)
        if new is not None:
            self._values[:] = new
        return new is not None


def positions(element: Any, u: Array) -> Array:
    """Positions (n, 2) of the links of a bound element at displacements (N,)."""
    if not element.changing:
        return np.array([link(u) for link in element.links])
    return u[[link.dofs[:, 0] for link in element.links]]


def recalled(element: Any) -> Any:
    """A bound force element as solvers see it: one with a memory is :class:`Remembering`."""
    return Remembering(element) if hasattr(element, "start") else element


def bind_force(element: ForceElement, layout: Layout) -> ForceElement:
    """A copy of a force element, bound to a scene and checked.

    Parameters
    ----------
    element, layout
        The unbound element, and the :class:`~skfem_ancf.beam.layout.Layout` of the scene.
    """
    bound = element._thawed()
    own = element.parts.__func__ is ForceElement.parts  # type: ignore[attr-defined]
    hint = ("a force element defines bind(scene), which returns a list of points, and force(x, v, "
            "t) of shape (points, 2)")
    with explained("{!r} fails in the reference configuration", hint, InputError,
                   element) if own else nullcontext():
        bound.links = _links(element, bound.bind(layout))
        if bound.parts() is None and bound.entries is None:
            try_force(bound)
    bound._freeze()
    return bound


def _links(element, links):
    if not isinstance(links, (list, tuple)) or not links or not all(
            isinstance(x, Vector) for x in links):
        raise InputError(f"bind(scene) of {element!r} must return a list of points and sections, "
                         "as [point(scene, None, (1, 0))] with "
                         "skfem_ancf.actions.forces.point, got "
                         f"{shown(links)}")
    return list(links)


def try_force(bound: Any, sizes: Any = None) -> None:
    """Raise InputError unless the methods of a user-defined force element are consistent."""
    bound = recalled(bound)
    x = np.array([x.start for x in bound.links])
    n, zero = len(x), np.zeros_like(x)
    require_finite(f"force(x, v, t) of {bound!r}", bound.force(x, zero, 0.0), (n, 2))
    own = not is_builtin(getattr(bound, "item", bound))
    if bound.changing:
        _require_pairs(bound)
        if not own:
            return
    else:
        for name in ("stiffness", "resistance"):
            require_finite(f"{name}(x, v, t) of {bound!r}", getattr(bound, name)(x, zero, 0.0),
                           (n, 2, n, 2))
    # generic positions, as terms may vanish in the reference configuration
    sizes = max(1.0, float(np.abs(x).max())) if sizes is None else sizes
    y = x + ASIDE * sizes * np.cos(np.arange(2.0 * n)).reshape(n, 2)
    K = _matrix(bound.stiffness(y, zero, 0.0), 2 * n)
    if own:
        at_generic_displacements(partial(_require_derivatives, bound, x), (sizes + 0.0 * x).ravel())
    if bound.symmetric and not abs(K - K.T).max() <= 1e-4 * abs(K).max():
        raise InputError(f"the derivative of force(x, v, t) of {bound!r} by the places is not "
                         "symmetric: it has no potential. Set symmetric = False in its class")
    if not hasattr(bound, "start") and bound.potential_at(y, 0.0) is not None:
        at_generic_displacements(partial(_require_potential, bound, x), (sizes + 0.0 * x).ravel())


def _matrix(K, n):
    """A derivative as a matrix (n, n)."""
    return K if sparse.issparse(K) else np.reshape(K, (n, n))


def _require_pairs(bound):
    """Raise InputError unless the links of a changing element are pairs of DOFs."""
    x, n = np.array([x.start for x in bound.links]), len(bound.links)
    K = bound.stiffness(x, 0.0 * x, 0.0)
    if not sparse.issparse(K) or K.shape != (2 * n, 2 * n):
        raise InputError(f"the stiffness of {bound!r}, with changing = True, must be a sparse "
                         f"matrix of shape {(2 * n, 2 * n)}, got {shown(K)}")
    if any(link.dofs.shape != (2, 1) or np.any(link.weights != 1.0) for link in bound.links):
        raise InputError(f"{bound!r} has changing = True: each of its links must be a pair of "
                         "degrees of freedom, as Vector(np.zeros(2), [[0], [1]], 1.0)")


def _require_derivatives(bound, x, u, d):
    """Raise InputError unless stiffness and resistance are the derivatives of the force."""
    v, d = u.reshape(x.shape), d.reshape(x.shape)
    for name, at in (("stiffness", lambda s: (x + v + s * d, 0.0 * d, 0.0)),
                     ("resistance", lambda s: (x, v + s * d, 0.0))):
        before, now, after = (np.asarray(bound.force(*at(s))) for s in (-1.0, 0.0, 1.0))
        slope = (_matrix(getattr(bound, name)(*at(0.0)), d.size) @ d.ravel()).reshape(d.shape)
        require_slope(f"{name}(x, v, t) of {bound!r}", "force(x, v, t)", after - before,
                      2.0 * slope, 1e-12 * np.abs(now).max())


def _require_potential(bound, x, u, d):
    """Raise InputError unless the force without velocities is minus the slope of the potential."""
    x, d = x + u.reshape(x.shape), d.reshape(x.shape)
    for t in (0.0, ASIDE):
        now, before, after = (bound.potential_at(x + s * d, t) for s in (0.0, -1.0, 1.0))
        work = 2.0 * np.sum(bound.force(x, 0.0 * x, t) * d)
        require_slope(f"minus force(x, v, t) of {bound!r}", "potential(x)", after - before, -work,
                      1e-12 * abs(now), ". Without potential(x), as for a force that depends on "
                      "time, the energy balance is that of the scheme")


# a load that load factors do not scale, as a force element

class Unscaled(ForceElement):
    """A bound ``load`` on the degrees of freedom of its beam, in a scene with a ``layout``."""

    distributed, resists = True, False

    def __init__(self, load: Any, layout: Layout) -> None:
        self.load, self.symmetric, self.name = load, load.symmetric, load.name
        self._key, beam = load._key, load.beam
        self.along, dofs = (beam, [], ()), layout.offset(beam) + np.arange(beam.N).reshape(-1, 2, 1)
        self.links = [Vector(np.zeros(2), pair, 1.0) for pair in dofs]
        i, j, _ = self._entries(np.zeros(beam.N))
        self.entries = np.array(i), np.array(j)

    def _entries(self, u, t=0.0):
        none = np.zeros(0, dtype=int)
        return (none, none, 0.0 * none) if self.load.constant else (
            self.load.acting(t)[1].stiffness(u))

    def force(self, x: Array, v: Array, t: float) -> Array:
        return self.load.acting(t)[1].force(x.ravel()).reshape(-1, 2)

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        if np.array_equal(x, y):
            return self.force(x, x, t)
        return self.load.acting(t)[1].mean_force(x.ravel(), y.ravel()).reshape(-1, 2)

    def potential_at(self, x: Array, t: float) -> float | None:
        return self.load.acting(t)[1].potential(x.ravel())

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        return self._entries(x.ravel(), t)[2]

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        return 0.0 * self.stiffness(x, v, t)

    def __repr__(self) -> str:
        return repr(self.load)
