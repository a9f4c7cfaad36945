"""Base class of force elements: forces on points and sections, and their derivatives."""

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any, NamedTuple

from ...beam import Layout
from ...core import InputError, explained, is_builtin, refuse
from ..bound import BoundForce, try_force, user_parts
from ..item import Item
from ..places import Vector


class KernelElement(NamedTuple):
    """An element of a kind that kernels know: its kind, two vectors and five numbers."""

    kind: int
    d: Vector
    e: Vector
    numbers: tuple[Any, ...]


class ForceElement(BoundForce, Item):
    """Forces on points and sections of beams as functions of positions, velocities and time.

    A user-defined element, for :meth:`skfem_ancf.Scene.add`, is a subclass that defines
    :meth:`bind` and :meth:`force` or :meth:`potential`, and optionally :meth:`stiffness` and
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
        by :func:`skfem_ancf.beam.distribution.groups_of`; None if not known.
    links
        The result of :meth:`bind`, once bound.
    groups
        Surface points that an obstacle may touch.
    entries
        For a sparse stiffness, once bound: rows and columns of its values, numbers of components of
        neighbouring links; None for the shape (n, 2, n, 2).
    dissipates : bool
        As of an :class:`~skfem_ancf.Item`: False for a load with a memory.
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

    def bind(self, layout: Layout) -> Sequence[Vector]:
        """Points and sections on which it acts, called on a copy: a list of results of
        :func:`skfem_ancf.actions.forces.point` and :func:`skfem_ancf.actions.forces.section`."""
        raise NotImplementedError

    def bound_on(self, layout: Layout) -> list[Any]:
        bound = self._thawed()
        known = is_builtin(self) and bound.parts.__func__ is not BoundForce.parts
        hint = ("a force element defines bind(scene), which returns a list of points, and force(x, "
                "v, t) of shape (points, 2)")
        with nullcontext() if known else explained(
                "{!r} fails in the reference configuration", hint, InputError, self):
            bound.links = links = bound.bind(layout)
            refuse(not known and (not isinstance(links, (list, tuple)) or not links or not all(
                        isinstance(x, Vector) for x in links)), "bind(scene) of {!r} must return a "
                   "list of points and sections, as [point(scene, None, (1, 0))] with "
                   "skfem_ancf.actions.forces.point, got {!r}", self, links)
            if bound.parts() is None and bound.entries is None:  # also for a user's law of a spring
                try_force(bound)
            bound._freeze()
            return [bound, *user_parts(bound, layout, force=False)]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}>"
