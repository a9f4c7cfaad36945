"""Readings of motions as functions of parameters, with derivatives by forward sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.linalg import lsqr

from ..core.errors import (ConvergenceError, InputError, NameUnknown, require_flag,
                           require_positive)
from ..core.types import Array
from ..dynamics import GeneralizedAlpha, get_scheme
from ..dynamics.base import Motion, Scheme
from ..dynamics.history import state_of
from ..dynamics.run import integrator_of
from ..dynamics.sensors import locate, read
from ..equations.matrices import matrices_of
from .design import STENCIL, Design
from .linear_model import Bordered

#: Relative change of a sensitivity in the last iteration of a step, and the largest number of them.
CLOSED, MOST = 1e-10, 12
#: Change of a displacement by a step of a parameter, relative to the scene, that is round-off.
NOISE = 1e-13
#: Step of the parameters, relative to their size: what it moves of the motion must be small.
STEP = 1e-4
#: Time of differences for rates of joints, over that of a step.
INSTANT = 1e-2
#: The arrays of a motion that have sensitivities.
NAMES = ("u", "v", "acceleration", "algorithmic", "multipliers")


class MotionDesign(Design):
    """Readings of a motion as functions of few parameters, with derivatives.

    The derivatives are those of the discrete motion: each step is linearised with the tangent of
    the scheme and solved for all parameters [1]. They cost about as much as the motion for each
    parameter, so use it for up to ten. ``values``, ``jacobian`` and ``objective`` are those of a
    :class:`Design`, for readings at all steps.

    Parameters
    ----------
    build
        A function of the parameters, an array (n,), that returns a :class:`~skfem_ancf.Scene`;
        the number of degrees of freedom does not depend on them.
    readings
        Names of sensors of that scene.
    t_end, dt
        Time at the end, and the size of the steps.
    scheme
        "generalized-alpha", "hht", "newmark", or such a :class:`~skfem_ancf.Scheme`.
    static
        Start from the static solution, which depends on the parameters, too; by default from the
        reference configuration.
    sizes
        Typical sizes of the parameters, (n,), by default their absolute values.

    Attributes
    ----------
    history
        The last :class:`~skfem_ancf.History`. Readings are those at its instants, one after the
        other: ``design.values(p).reshape(len(design.history), -1)``.

    Raises
    ------
    InputError
        For other schemes; with contact, materials with a history, and prescribed motions that
        depend on the parameters.

    References
    ----------
    [1] Tortorelli, Michaleris: "Design sensitivity analysis: overview and review", Inverse Problems
    in Engineering 1 (1994).

    Examples
    --------
    The tip of a cantilever that gravity bends, by its modulus:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, MotionDesign, Scene
    >>> from skfem_ancf import StVenantKirchhoff
    >>> mesh = MeshBeam.init_line([0, 0.5, 1], height=0.01)
    >>> def build(p):
    ...     material = StVenantKirchhoff(p[0], 0.3, 7800)
    ...     scene = Scene(Beam(mesh, ElementBeamCable(5), material, width=0.01)).clamp("left")
    ...     return scene.gravity((0, -9.81)).sensor("tip", "displacement", at=(1, 0))
    >>> design = MotionDesign(build, ["tip"], t_end=0.1, dt=0.01)
    >>> design.jacobian([2e8]).shape, len(design.history)
    ((22, 1), 11)
    """

    def __init__(self, build: Callable[[Array], Any], readings: Sequence[str], t_end: float,
                 dt: float, scheme: str | Scheme | type[Scheme] = "generalized-alpha",
                 static: bool = False, sizes: ArrayLike | None = None) -> None:
        super().__init__(build, readings, sizes)
        self.t_end, self.dt = require_positive("t_end", t_end), require_positive("dt", dt)
        self.scheme, self.static = get_scheme(scheme), require_flag("static", static)
        if not isinstance(self.scheme, GeneralizedAlpha):
            raise InputError(f"derivatives of a motion need the scheme 'generalized-alpha', 'hht' "
                             f"or 'newmark', got {self.scheme!r}")
        self.history: Any = None
        self._static = self.static

    def _begin(self, p, scene, state):
        """Integrate at p."""
        system = scene.system
        if system.histories.values.size or system.forces.contacts.obstacles or (
                system.forces.changing):
            raise InputError("derivatives of a motion are of smooth forces without a history: this "
                             "scene has contact, friction or a material with a history")
        self._p, self._built, self.state, self._J = p, scene, state, None
        self.history = scene.integrate(self.t_end, self.dt, self.scheme, state)
        if self.history.substeps:
            raise InputError(f"{self.history.substeps} steps were halved, since they did not "
                             "converge: derivatives need equal steps, so give a smaller dt")
        own = self._located(scene)
        self._values = np.concatenate([self._seen(*own, self.history.state(k)._motion)
                                       for k in range(len(self.history))])

    def _located(self, scene):
        """The system of a scene, and the sensors read in it with their places."""
        for name in self.readings:
            if not isinstance(name, str) or name not in scene.sensors:
                raise NameUnknown("sensor", name, scene.sensors)
        return scene.system, [(one, locate(one, scene.system))
                              for one in map(scene.sensors.get, self.readings)]

    def _seen(self, system, located, y):
        """Readings at an instant."""
        state = state_of(system, self.scheme, y)
        return np.concatenate([np.ravel(read(one, place, state)) for one, place in located])

    def _jacobian(self, p, scene, state):
        sizes = np.abs(p) if self._sizes is None else self._sizes
        h = STEP * np.where(sizes > 0.0, sizes, sizes.max() or 1.0)
        moved = [[(c / step, s * step, self._scene(p + s * step * unit)) for s, c in STENCIL]
                 for step, unit in zip(h, np.eye(len(p)))]
        located = [[self._located(other) for _, _, other in some] for some in moved]
        change = self._start(moved)
        y, rows = self.history.state(0)._motion, []
        for k in range(len(self.history)):
            if k:
                y = self.history.state(k)._motion
                change = self._step(k, y, change, moved, h)
            rows.append(np.array([sum(c * self._seen(*own, _moved(y, s, change, i))
                                      for (c, s, _), own in zip(some, places))
                                  for i, (some, places) in enumerate(zip(moved, located))]).T)
        return np.concatenate(rows)

    def _start(self, moved):
        """Derivatives of the first instant, arrays (..., n) by name."""
        def first(scene):
            u = np.zeros(scene.N)
            if self.state is not None:  # near the one that is known
                u = np.array(scene.solve_static(start=scene.state(self.state.u)).u)
            return integrator_of(scene.system, self.scheme).start(u, scene._velocity, 0.0, self.dt)

        found = [[(c, first(scene)) for c, _, scene in some] for some in moved]
        return {name: np.column_stack([sum(c * getattr(y, name) for c, y in ends)
                                       for ends in found]) for name in NAMES}

    def _step(self, k, y, old, moved, h):
        """Derivatives of the instant k from those of the one before."""
        before, system = self.history.state(k - 1)._motion, self._built.system
        alpha_m, alpha_f, beta, _ = self.scheme.parameters
        dt, c, state = y.t - before.t, system.constraints, self.history.state(k)
        M, D, K, _, J = matrices_of(system, state)
        none = np.zeros((c.N, len(moved)))
        solver, inertia = Bordered([K, D, M], J, c, none), Bordered([M], J, c, none)
        kick = (1.0 - alpha_m) / (1.0 - alpha_f)
        factors = (1.0, self.scheme.parameters[3] / (beta * dt), kick / (beta * dt**2))
        # joints: multipliers of the corrections of velocity and acceleration
        raw = self._raw(y.u, vars(before), dt)
        impulse, force = (np.zeros(c.m) if not c.m else lsqr(
            J.T, M @ (end - x), atol=0.0, btol=0.0)[0] for end, x in (
                (raw[0], y.v), (raw[1], y.acceleration)))
        u, l, found = old["u"].copy(), old["multipliers"].copy(), {}
        sizes = c.coordinate_sizes[:, None]
        rate, bend = (partial(one, INSTANT * dt) for one in (_rate, _bend))

        def rest_of(equations, *parts):
            return np.column_stack([sum(factor * equations(other.system, *(
                x + s * dx[:, i] for x, dx in parts)) for factor, s, other in some)
                for i, some in enumerate(moved)])

        def project(of_joints, x, dx, end, multiplier):
            """Derivatives of what joints make of velocity or acceleration x, and multipliers."""
            out, d = dx.copy(), np.zeros((c.m, len(moved)))
            for _ in range(2 if c.m else 0):
                rest = rest_of(lambda system, x, end, m, u, v: np.concatenate([
                    system.mass.multiply(end - x) + system.constraints.sparse_jacobian(
                        u, y.t).T @ m, of_joints(system, u, v, end, y.t)]),
                    (x, dx), (end, out), (multiplier, d), (y.u, u), (y.v, found.get("v", out)))
                change, m = inertia.solve([1.0], -rest[:c.N], -rest[c.N:])
                out, d = out + change, d + m
            return out, d

        for _ in range(MOST):
            v, a, w = self._raw(u, old, dt)
            found = {}
            found["v"], _ = project(rate, raw[0], v, y.v, impulse)
            rest = rest_of(partial(_residual, y.t), (y.u, u), (raw[1], a),
                           (y.multipliers - force, l), (y.v, found["v"]))
            if np.any(np.abs(rest[c.fixed]) > 0.0):
                raise InputError("a prescribed motion depends on the parameters: derivatives of "
                                 "such motions are not available")
            du, dl = solver.solve(factors, -rest[:c.N], -rest[c.N:])
            u, l = u + du, l + dl
            left, size = (np.abs(x / sizes).max(axis=0) for x in (du, u))
            if np.all(left <= np.maximum(CLOSED * size, NOISE / h)):
                break
        else:
            raise ConvergenceError(f"the derivatives of the step to t = {y.t:.6g} do not converge: "
                                   "give a smaller dt", state)
        v, a, w = self._raw(u, old, dt)
        found["v"], _ = project(rate, raw[0], v, y.v, impulse)
        end, dl = project(bend, raw[1], a, y.acceleration, force)
        return dict(zip(NAMES, (u, found["v"], end, w + (end - a) / kick, l + dl)))

    def _raw(self, u, old, dt):
        """Velocity, acceleration and w of the scheme at the displacement u, without joints."""
        alpha_m, alpha_f, beta, gamma = self.scheme.parameters
        w = (u - old["u"] - dt * old["v"]) / (beta * dt**2) - (
            (0.5 - beta) / beta * old["algorithmic"])
        return (old["v"] + dt * ((1.0 - gamma) * old["algorithmic"] + gamma * w),
                ((1.0 - alpha_m) * w + alpha_m * old["algorithmic"]
                 - alpha_f * old["acceleration"]) / (1.0 - alpha_f), w)


def _moved(y: Motion, step: float, change: dict[str, Array], i: int) -> Motion:
    """A Motion changed by a step along the derivatives by parameter i."""
    return replace(y, **{name: getattr(y, name) + step * x[:, i] for name, x in change.items()})


def _residual(t, system, u, a, l, v):
    """The equations of motion at the end of a step, (N + m,); values of supports where fixed."""
    c = system.constraints
    rest = (system.mass.multiply(a) + system.internal_force(u, t) - system.external_force(u, t)
            + c.sparse_jacobian(u, t).T @ l)
    if system.damped:
        rest = rest + system.damping_force(u, v, t)
    rest[c.fixed] = c.values(t)
    return np.concatenate([rest, c.constraint(u, t)])


def _rate(instant, system, u, _, v, t):
    """The rate of the joints for a velocity v."""
    c = system.constraints
    late, early = (c.constraint(u, t + step) for step in (instant, -instant))
    return c.sparse_jacobian(u, t) @ v + (late - early) / (2.0 * instant)


def _bend(instant, system, u, v, a, t):
    """The second rate of the joints for an acceleration a."""
    late, early = (_rate(instant, system, u + step * v, v, v, t + step)
                   for step in (instant, -instant))
    return system.constraints.sparse_jacobian(u, t) @ a + (late - early) / (2.0 * instant)
