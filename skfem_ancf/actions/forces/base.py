"""Base class of force elements: forces on points and sections, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...beam.beam import Beam
from ...beam.distribution import Facets
from ...beam.layout import Layout
from ...core.errors import (InputError, explained, require_finite, require_slope, shown,
                            warnings_as_errors)
from ...core.origin import ours
from ...core.types import Array
from ..item import Item, beside
from ..places import Vector

#: Relative step of differences, where a force does not accept complex numbers.
STEP = 1e-6
#: Relative perturbation of the reference configuration for checks of user-defined elements.
ASIDE = 0.01
_COMPLEX = getattr(np, "exceptions", np).ComplexWarning


class Part(NamedTuple):
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

    Other Parameters
    ----------------
    layout
        The :class:`~skfem_ancf.beam.layout.Layout` of the scene.
    x, v, t
        Positions and velocities of the points, shape (n, 2) each; time, in statics the load factor.
    y
        Positions at the end of a step, shape (n, 2); ``x`` is its start and ``t`` its middle.

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

    def gain(self, x: Array, y: Array, t: float) -> float | None:
        """Change of the potential from x to y; None if there is none."""
        before = self.potential_at(x, t)
        after = None if before is None else self.potential_at(y, t)
        return None if before is None or after is None else after - before

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        """Mean force (n, 2) at zero velocity, whose work is minus the change of the potential.

        By default the force in the middle, corrected along the displacement (Gonzalez 1996): the
        work is exact, but the correction may have a moment. :class:`Spring` and
        :class:`TorsionalSpring` define means that conserve the angular momentum exactly.
        """
        d = y - x
        force = np.asarray(self.force(0.5 * (x + y), 0.0 * x, t), dtype=float)
        square = np.sum(d * d)
        gain = self.gain(x, y, t) if square > 0.0 else None
        if gain is None:
            return force
        return force - (gain + np.sum(force * d)) / square * d

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        """Derivative of the force by the positions, shape (n, 2, n, 2), the derivative's axes last.

        By default by a complex step or differences.
        """
        return derivative(lambda y: self.force(y, v, t), x)

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        """Derivative of the force by the velocities, as :meth:`stiffness`."""
        return derivative(lambda w: self.force(x, w, t), v)

    def mass_entries(self) -> tuple[Array, Array, Array] | None:
        """Rows, columns and values (k,) added to the mass matrix; None for none."""
        return None

    def parts(self) -> list[Part] | None:
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
        if bound.parts() is None:
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
    x = np.array([x.start for x in bound.links])
    n, zero = len(x), np.zeros_like(x)
    require_finite(f"force(x, v, t) of {bound!r}", bound.force(x, zero, 0.0), (n, 2))
    for name in ("stiffness", "resistance"):
        require_finite(f"{name}(x, v, t) of {bound!r}", getattr(bound, name)(x, zero, 0.0),
                       (n, 2, n, 2))
    # generic positions, as terms may vanish in the reference configuration
    sizes = max(1.0, float(np.abs(x).max())) if sizes is None else sizes
    y = x + ASIDE * sizes * np.cos(np.arange(2.0 * n)).reshape(n, 2)
    K = np.reshape(bound.stiffness(y, zero, 0.0), (2 * n, 2 * n))
    if not ours(getattr(bound, "item", bound)):
        beside(partial(_require_derivatives, bound, x), (sizes + 0.0 * x).ravel())
    if bound.symmetric and not np.allclose(K, K.T, rtol=0.0, atol=1e-4 * np.abs(K).max()):
        raise InputError(f"the derivative of force(x, v, t) of {bound!r} by the places is not "
                         "symmetric: it has no potential. Set symmetric = False in its class")
    if bound.potential_at(y, 0.0) is not None:
        beside(partial(_require_potential, bound, x), (sizes + 0.0 * x).ravel())


def _require_derivatives(bound, x, u, d):
    """Raise InputError unless stiffness and resistance are the derivatives of the force."""
    v, d = u.reshape(x.shape), d.reshape(x.shape)
    for name, at in (("stiffness", lambda s: (x + v + s * d, 0.0 * d, 0.0)),
                     ("resistance", lambda s: (x, v + s * d, 0.0))):
        before, now, after = (np.asarray(bound.force(*at(s))) for s in (-1.0, 0.0, 1.0))
        slope = np.tensordot(getattr(bound, name)(*at(0.0)), d, 2)
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
