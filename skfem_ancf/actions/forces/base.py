"""What every force element shares: points of beams, what it does there, and derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.errors import AncfError, InputError, require_finite, shown, warnings_as_errors
from ...core.frozen import Sealable
from ..joints.base import Vector

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ...beam.beam import Beam
    from ...beam.layout import Layout
    from ...beam.distribution import Facets
    from ...core.types import Array

#: Relative step of differences, where a force takes no complex numbers.
STEP = 1e-6
#: Where an element of one's own is tried besides the stress-free state: off by so much.
ASIDE = 0.01
_COMPLEX = getattr(np, "exceptions", np).ComplexWarning


class Link(NamedTuple):
    """A plane vector ``start + sum(u[dofs] * weights, axis=1)``, perhaps constant.

    Attributes
    ----------
    start
        Shape (2,).
    dofs, weights
        Shape (2, k) both; weights (k,) are those of both components.
    """

    start: Any
    dofs: Any = np.zeros((2, 0), dtype=int)
    weights: Any = np.zeros((2, 0))


def link(vector: Vector | Link) -> Link:
    """A Vector of joints as a :class:`Link`."""
    return Link(np.asarray(vector.start, dtype=float), vector.dofs,
                np.broadcast_to(vector.weights, np.shape(vector.dofs)))


def difference(a: Vector | Link, b: Vector | Link) -> Link:
    """The Link of b - a.

    Parameters
    ----------
    a, b
        Vectors or Links.
    """
    return Link(np.asarray(b.start, dtype=float) - a.start,
                np.concatenate([a.dofs, b.dofs], axis=1),
                np.concatenate([-link(a).weights, link(b).weights], axis=1))


class Part(NamedTuple):
    """An element of a kind that texts know.

    Attributes
    ----------
    kind
        Of :mod:`skfem_ancf.actions.forces.texts`.
    d, e
        Its two Links.
    numbers
        Its five numbers.
    """

    kind: int
    d: Link
    e: Link
    numbers: tuple[float, ...]


class ForceElement(Sealable):
    """A force on points and sections of beams, of their places, velocities and time.

    An element of your own is a subclass that defines :meth:`bind` and :meth:`force`, and perhaps
    :meth:`potential`, :meth:`stiffness` and :meth:`resistance`; :meth:`skfem_ancf.Scene.add` takes
    it. It works in statics, where velocities are zero and time is the load factor, in motions, in
    natural frequencies, and in compiled loops, which call it. It is not scaled with the loads.

    The energy-momentum scheme keeps the energy if there is a :meth:`potential`; the work of what
    depends on velocities is in ``history.dissipated``.

    Attributes
    ----------
    symmetric : bool
        The derivative of the force by the places is symmetric: it has a potential. Where it is
        not, say so in the class: tangents keep their other half then, and modes may be complex.
    distributed : bool
        It acts all along a beam, not on a few points.
    along
        Of such a one, bound: the beam, where its parts are, and stations, as
        :func:`skfem_ancf.beam.surfaces.groups_of` returns them; None if that is not known.
    links
        What :meth:`bind` has returned, once it is bound.
    groups
        Points of the surface that it may touch, of an obstacle.

    Examples
    --------
    A spring to the ground that hardens, with a dashpot:

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

    symmetric = True
    distributed = False
    along: tuple[Beam, list[Facets], tuple[float, ...]] | None = None
    links: Any = ()
    groups: Any = ()

    def bind(self, layout: Layout) -> Sequence[Vector | Link]:
        """The points and sections on which it acts, found in the scene's coordinates.

        Parameters
        ----------
        layout
            Has ``beam(which)``, the Beam meant by a Beam, a name, a number or None,
            ``offset(which)``, the number of its first coordinate, and ``N``.

        Returns
        -------
        list
            What :func:`skfem_ancf.actions.forces.point` and
            :func:`skfem_ancf.actions.forces.section` return.
        """
        raise NotImplementedError

    def force(self, x: Array, v: Array, t: float) -> Array:
        """The force on each point; on the direction of a section what works on its change.

        Parameters
        ----------
        x, v
            Places and velocities of the points, shape (n, 2) each.
        t
            Time; in statics the load factor.

        Returns
        -------
        ndarray
            Shape (n, 2).
        """
        raise NotImplementedError

    def potential(self, x: Array) -> float | None:
        """The potential of the force without velocities; None if there is none.

        Parameters
        ----------
        x
            Places of the points, shape (n, 2).
        """
        return None

    def gain(self, x: Array, y: Array) -> float | None:
        """The potential at y less that at x; None if there is none.

        Parameters
        ----------
        x, y
            Places of the points at the start and the end of a step, shape (n, 2) each.
        """
        before = self.potential(x)
        after = None if before is None else self.potential(y)
        return None if before is None or after is None else after - before

    def mean_force(self, x: Array, y: Array, t: float) -> Array:
        """A mean of the force without velocities whose work is what the potential loses.

        By default that in the middle, corrected along the change of the places (Gonzalez 1996):
        the work is exact, but the correction may have a moment. What keeps angular momentum
        exactly is a mean of its own, as of :class:`Spring` and :class:`TorsionalSpring`.

        Parameters
        ----------
        x, y
            Places of the points at the start and the end of a step, shape (n, 2) each.
        t
            Time in the middle of it.

        Returns
        -------
        ndarray
            Shape (n, 2).
        """
        zero, d = 0.0 * x, y - x
        force = np.asarray(self.force(0.5 * (x + y), zero, t), dtype=float)
        square = np.sum(d * d)
        gain = self.gain(x, y) if square > 0.0 else None
        if gain is None:
            return force
        return force - (gain + np.sum(force * d)) / square * d

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        """Derivative of the force by the places; by a complex step or differences by default.

        Parameters
        ----------
        x, v, t
            As for :meth:`force`, shapes (n, 2), (n, 2) and ().

        Returns
        -------
        ndarray
            Shape (n, 2, n, 2), the derivative's last.
        """
        return _derivative(lambda y: self.force(y, v, t), x)

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        """Derivative of the force by the velocities, as :meth:`stiffness`.

        Parameters
        ----------
        x, v, t
            As for :meth:`force`, shapes (n, 2), (n, 2) and ().

        Returns
        -------
        ndarray
            Shape (n, 2, n, 2).
        """
        return _derivative(lambda w: self.force(x, w, t), v)

    def unheld(self) -> ForceElement:
        """Itself as it is at the start of a motion: without what it has kept of one."""
        return self

    def parts(self) -> list[Part] | None:
        """Of what the texts know, once it is bound; None for an element of your own."""
        return None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}>"


def differences(function: Callable[[Array], Any], x: Array) -> Array:
    """The derivative of a function of places by differences, shape (n, 2, n, 2).

    Parameters
    ----------
    function
        From (n, 2) to (n, 2).
    x
        Where, shape (n, 2).
    """
    n = len(x)
    out, units = np.zeros((n, 2, n, 2)), np.eye(2 * n).reshape(2 * n, n, 2)
    step = STEP * max(1.0, float(np.abs(x).max(initial=0.0)))
    for k in range(2 * n):
        out[:, :, k // 2, k % 2] = (np.asarray(function(x + step * units[k]))
                                    - function(x - step * units[k])) / (2 * step)
    return out


def _derivative(function, x):
    """As :func:`differences`, by complex steps where those agree."""
    out = differences(function, x)
    for k, unit in enumerate(np.eye(x.size).reshape(-1, *x.shape)):
        rough = out[:, :, k // 2, k % 2]
        try:
            with warnings_as_errors(_COMPLEX):
                found = np.imag(function(x + 1e-30j * unit)) / 1e-30
            if np.allclose(found, rough, rtol=1e-4, atol=1e-4 * np.abs(rough).max(initial=0.0)):
                out[:, :, k // 2, k % 2] = found
        except (TypeError, ValueError, _COMPLEX):
            pass
    return out


def bind_force(element: ForceElement, layout: Layout) -> ForceElement:
    """A copy of a force element, bound to a scene and tried there.

    Parameters
    ----------
    element
        A :class:`ForceElement`.
    layout
        The :class:`~skfem_ancf.Scene`.

    Raises
    ------
    InputError
        If the element does not keep to the interface of :class:`ForceElement`.
    """
    bound = element._unsealed()
    own = element.parts.__func__ is ForceElement.parts  # type: ignore[attr-defined]
    try:
        bound.links = _links(element, bound.bind(layout))
        if bound.parts() is None:
            _try(bound)
    except AncfError:
        raise
    except Exception as error:
        if not own:
            raise
        raise InputError(  # it is the user's: it may raise anything
            f"{element!r} fails in the stress-free state: {type(error).__name__}: {error}; a force "
            "element defines bind(scene), which returns a list of points, and force(x, v, t) of "
            "shape (points, 2)") from error
    bound._seal()
    return bound


def _links(element, links):
    if not isinstance(links, (list, tuple)) or not links or not all(
            isinstance(x, (Vector, Link)) for x in links):
        raise InputError(f"bind(scene) of {element!r} must return a list of points and sections, "
                         "as [point(scene, None, (1, 0))] with "
                         "skfem_ancf.actions.forces.point, got "
                         f"{shown(links)}")
    return [link(x) for x in links]


def _try(bound):
    x = np.array([x.start for x in bound.links])
    n, zero = len(x), np.zeros_like(x)
    require_finite(f"force(x, v, t) of {bound!r}", bound.force(x, zero, 0.0), (n, 2))
    for name in ("stiffness", "resistance"):
        require_finite(f"{name}(x, v, t) of {bound!r}", getattr(bound, name)(x, zero, 0.0),
                       (n, 2, n, 2))
    # where nothing is zero by chance, as it may be in the stress-free state
    y = x + ASIDE * max(1.0, float(np.abs(x).max())) * np.cos(np.arange(2.0 * n)).reshape(n, 2)
    K = np.reshape(bound.stiffness(y, zero, 0.0), (2 * n, 2 * n))
    if bound.symmetric and not np.allclose(K, K.T, rtol=0.0, atol=1e-4 * np.abs(K).max()):
        raise InputError(f"the derivative of force(x, v, t) of {bound!r} by the places is not "
                         "symmetric: it has no potential. Say so in its class: symmetric = False")
    if bound.potential(y) is not None:
        _require_potential(bound, y)


def _require_potential(bound, x):
    """Raise InputError unless the force without velocities is minus the slope of the potential."""
    step, zero = STEP * max(1.0, float(np.abs(x).max())), np.zeros_like(x)
    units = step * np.eye(x.size).reshape(-1, *x.shape)
    slope = [(bound.potential(x + d) - bound.potential(x - d)) / (2.0 * step) for d in units]
    slope = require_finite(f"the slope of potential(x) of {bound!r}", slope, (x.size,))
    noise = 1e-15 * abs(bound.potential(x)) / step
    for t in (0.0, ASIDE):
        force = np.ravel(bound.force(x, zero, t))
        if not np.allclose(-slope, force, rtol=0.0, atol=1e-3 * np.abs(force).max() + 10.0 * noise):
            raise InputError(
                f"potential(x) of {bound!r} does not fit its force: at x = {shown(x.tolist())} and "
                f"t = {t:g} the force is {shown(force.tolist())}, minus the slope of the potential "
                f"{shown((-slope).tolist())}. Without potential(x), as for a force that depends on "
                "time, the energy balance is that of the scheme")
