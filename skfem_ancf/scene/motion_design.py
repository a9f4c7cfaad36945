"""Readings of motions as functions of parameters, with derivatives forward or by the adjoint."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import lsqr

from ..actions.bound import BoundConstraint, BoundForce, MemberForce, slope_at_zero
from ..actions.tables import mean_external_force
from ..beam import element_dofs, entries_of
from ..core import (Array, ArrayLike, refuse, require_flag, require_integer, require_option,
                    require_positive)
from ..dynamics import GeneralizedAlpha, get_scheme
from ..dynamics.base import Motion, Scheme, in_steps
from ..dynamics.history import state_of
from ..dynamics.run import integrator_of
from ..dynamics.sensors import locate, read
from ..equations.matrices import matrices_of
from .control import Factors, rows_of
from .design import STENCIL, Design, Differences, require_same_size, residual
from .parameters import Parameters

#: Step of the parameters, relative to their size: what it moves of the motion must be small.
STEP = 1e-4
#: Time of differences for rates of joints, over that of a step.
INSTANT = 1e-2
#: Step of displacements for derivatives of damping forces, relative to the scene.
SMALL = 1e-3
#: The same for mean forces that are no polynomials: it must be small compared with a time step.
TINY = 1e-5
#: Relative change of an equation that is no round-off.
CHANGED = 1e-9
#: Part of a force along a direction that its pattern may miss.
MISSED = 1e-6
#: The arrays of a motion on which the next step depends, and what else readings depend on.
NAMES, READ = ("u", "v", "acceleration", "algorithmic", "force"), ("multipliers",)
#: Their sizes: those of DOFs or of joints.
START, END = "uuuum", "uuuumm"


class MotionDesign(Design):
    """Readings of a motion as functions of parameters, with derivatives.

    The derivatives are those of the discrete motion, whose steps are linearised with the tangent of
    the scheme [1]. ``jacobian`` has those of all readings at all steps, forward in time, at the
    cost of about a motion for each parameter: use it for up to ten. ``objective`` has those of one
    number, as a final value or an integral, by one adjoint solution backward in time for any number
    of parameters. Both are as in a :class:`Design`, for readings at all steps. Raises InputError
    for other schemes; with contact, materials with a history, and prescribed motions that depend on
    the parameters; for "energy-momentum" also with sliders.

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
        "generalized-alpha", "hht", "newmark", "energy-momentum", or such a
        :class:`~skfem_ancf.Scheme`.
    static
        Start from the static solution, which depends on the parameters, too; by default from the
        reference configuration.
    sizes
        Typical sizes of the parameters, (n,), by default their absolute values.
    every
        Keep the states after this number of steps; derivatives compute those between again. About
        the root of the number of steps needs the least memory.

    Attributes
    ----------
    history
        The last :class:`~skfem_ancf.History`. Readings are those of its sensors at all steps, one
        after the other: ``design.values(p).reshape(len(design.history.sensors.t), -1)``.

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
    >>> value, gradient = design.objective(lambda y: y[-1])([2e8])      # the last height
    >>> bool(abs(gradient[0] / design.jacobian([2e8])[-1, 0] - 1) < 1e-6)
    True
    """

    def __init__(self, build: Callable[[Array], Any], readings: Sequence[str], t_end: float,
                 dt: float, scheme: str | Scheme | type[Scheme] = "generalized-alpha",
                 static: bool = False, sizes: ArrayLike | None = None, every: int = 1) -> None:
        super().__init__(build, readings, sizes)
        self.every = require_integer("every", every, 1)
        self.t_end, self.dt = require_positive("t_end", t_end), require_positive("dt", dt)
        self.scheme, self.static = get_scheme(scheme), require_flag("static", static)
        refuse(not (isinstance(self.scheme, GeneralizedAlpha) or self.scheme.conserving
                    and in_steps(self.scheme)), "derivatives of a motion need 'generalized-alpha', "
               "'hht', 'newmark' or 'energy-momentum', got {!r}", self.scheme)
        self.history: Any = None
        self._static = self.static

    def _begin(self, p, scene, state):
        """Integrate at p."""
        system = scene.system
        refuse(system.histories.values.size or system.forces.contacts.obstacles or (
            system.forces.changing), "derivatives of a motion are of smooth forces, without "
            "contact, friction or a material with a history")
        own = [joint for joint in system.constraints.joints if self.scheme.conserving and (
            type(joint).mean_entries is not BoundConstraint.mean_entries)]
        refuse(own, "{[0]!r} has a Jacobian of its own in steps that conserve energy, without "
               "derivatives: use the scheme 'generalized-alpha'", own)
        for name in self.readings:
            require_option("sensor", name, scene.sensors)
        self._p, self._built, self.state, self._J, self._coloured = p, scene, state, None, {}
        n = max(1, round(self.t_end / self.dt))
        kept = None if self.every == 1 else self.dt * np.append(np.arange(0, n, self.every), n)
        self.history = scene.integrate(self.t_end, self.dt, self.scheme, state, t_eval=kept)
        refuse(self.history.substeps, "{} steps were halved, since they did not converge: "
               "derivatives need equal steps, so give a smaller dt", self.history.substeps)
        seen = self.history.sensors
        self._values = np.concatenate([np.reshape(seen[name], (len(seen.t), -1))
                                       for name in self.readings], axis=1).ravel()

    def _steps(self, back: bool = False) -> Iterator[tuple[Motion | None, Motion]]:
        """Pairs of instants from the start, which is (None, first), or back from the end."""
        start, order = (None, self.history.state(0)._motion), -1 if back else 1
        if not back:
            yield start
        for j in range(len(self.history) - 1)[::order]:
            first, last = (self.history.state(k)._motion for k in (j, j + 1))
            n, between = round((last.t - first.t) / self.dt), list[Motion]()
            if n > 1:  # those between kept states are computed again
                between = [*integrator_of(self._built.system, self.scheme).run(
                    first, self.dt, n - 1)]
                refuse(len(between) < n - 1, "the steps after t = {:.6g} do not converge a second "
                       "time: give a smaller dt, or every=1", first.t)
            yield from list(pairwise([first, *between, last]))[::order]
        if back:
            yield start

    def _located(self, p):
        """The scene at p, and its sensors that are read, with their places."""
        scene = self._scene(p)
        return scene, [(one, locate(one, scene.system))
                       for one in map(scene.sensors.get, self.readings)]

    def _read_in(self, scene, located, y):
        """Readings of a scene at an instant, (r,)."""
        state = state_of(scene.system, self.scheme, y)
        return np.concatenate([np.ravel(read(one, at, state)) for one, at in located])

    def _linear_step(self, y, before):
        return (_MeanStep if self.scheme.conserving and before is not None else _Step)(
            self, y, before)

    # forward

    def _jacobian(self, p, scene, state):
        h = STEP * self._typical(p)
        moved = [[(c / step, s * step, self._located(p + s * step * unit)) for s, c in STENCIL]
                 for step, unit in zip(h, np.eye(len(p)))]

        def by(equations):
            """Derivatives of equations of a scene, (rows, n)."""
            return np.column_stack([sum(c * equations(other) for c, _, (other, _) in some)
                                    for some in moved])

        rows, old = [], None
        for before, y in self._steps():
            step = self._linear_step(y, before)
            old = step.forward(by(step.equations), old)
            rows.append(np.array([sum(c * self._read_in(*other, replace(y, **{
                name: getattr(y, name) + s * x[:, i] for name, x in step.named(old)}))
                for c, s, other in some) for i, some in enumerate(moved)]).T)
        return np.concatenate(rows)

    # backward

    def _weighted(self, weights):
        """The derivative by the parameters of the sum of weighted readings (r,), (n,)."""
        p, c = self._p, self._built.system.constraints
        h = STEP * self._typical(p)
        weights = weights.reshape(len(self.history.sensors.t), -1)
        groups = [([k], np.full(c.N + c.m, k)) for k in range(len(p))]
        if isinstance(self.build, Parameters):
            groups = self.build.groups(c.N + c.m)
        out, bars = np.zeros(len(p)), np.zeros(4 * c.N + c.m)
        others: dict[bytes, Any] = {}

        def equations(step, w, q):
            if q.tobytes() not in others:
                others[q.tobytes()] = self._located(q)
            scene, located = others[q.tobytes()]
            seen = [w @ self._read_in(scene, located, step.y)] if w.any() else []
            return np.append(step.equations(scene), seen)

        for (before, y), w in zip(self._steps(back=True), weights[::-1]):
            step, pull, read_here = self._linear_step(y, before), np.zeros(c.m), int(w.any())
            if read_here:
                rows = [rows_of(self._built.system, state_of(self._built.system, self.scheme, y),
                                self._built.sensors[name]) for name in self.readings]
                *by, pull = (w @ np.concatenate(parts) for parts in zip(*rows))
                bars[:3 * c.N] += np.concatenate(by)
            adjoint, bars = step.backward(np.append(bars, pull))
            size = np.append(step.magnitudes(), [np.abs(w).max()] * read_here)
            found = Differences(partial(equations, step, w), p, h, STENCIL, CHANGED * size).of(
                [(members, np.append(np.tile(of, len(adjoint) // len(of)), np.full(read_here, -1)))
                 for members, of in groups])
            step.require_held(found[c.fixed].toarray())
            out += np.append(-adjoint, [1.0] * read_here) @ found
        return out


class _Step:
    """The equations of a step, or of the start, and their linearisation. Unknowns and equations are
    in the order u, l; v, impulses; a, forces: the motion with l, what joints make of the velocity
    of the scheme, and of its acceleration. At the start the first are those of the static solution,
    or nothing."""

    def __init__(self, design: MotionDesign, y: Motion, before: Motion | None) -> None:
        system = self._system = design._built.system
        c, self.y, self._design = system.constraints, y, design
        self._before: tuple[Any, ...] = ()  # none at the start
        self._kept: Any = None
        self._h = h = design.dt if before is None else y.t - before.t
        alpha_m, alpha_f, beta, gamma = design.scheme.parameters
        b, self._kick, q = 1.0 / (beta * h**2), (1.0 - alpha_m) / (1.0 - alpha_f), 1.0 - alpha_f
        w = np.array([-b, -b * h, 0.0, -(0.5 - beta) / beta])
        # velocity, acceleration and w of the scheme by u, v, a, w before
        self._v = h * gamma * w + [0.0, 1.0, 0.0, h * (1.0 - gamma)]
        self._a = self._kick * w + [0.0, 0.0, -alpha_f / q, alpha_m / q]
        self._w = np.array([0.0, 0.0, alpha_f / q, -alpha_m / q]) / self._kick
        if before is None:
            # the velocity that is given may violate supports and joints
            self._raw = None
            v, a = design._built._velocity, y.acceleration
        else:
            parts = [getattr(before, name) for name in NAMES]
            v, a = (np.where(c.free, factor * y.u + sum(map(np.multiply, row, parts)), end)
                    for factor, row, end in ((h * gamma * b, self._v, y.v),
                                             (self._kick * b, self._a, y.acceleration)))
            self._raw = v, a
        M = system.mass.multiply
        sides = [M(start - end)[c.free] for start, end in ((v, y.v), (a, y.acceleration))]
        J = c.sparse_jacobian(y.u, y.t)
        self._impulse, self._force = (lsqr(J[:, c.free].T, x, atol=0.0, btol=0.0)[0]
                                      if c.m else np.zeros(0) for x in sides)
        self._solver = self._linearised(h * gamma * b, self._kick * b)

    def equations(self, scene: Any) -> Array:
        """The equations of a scene with other parameters at this step, (3 (N + m),)."""
        system, y = scene.system, self.y
        c = require_same_size(system, len(y.u), len(y.multipliers))
        J, M, static = c.sparse_jacobian(y.u, y.t), system.mass.multiply, self._design.state
        instant = INSTANT * self._h
        rate = _rate(instant, system, y.u, y.v, y.t)
        bend = J @ y.acceleration + slope_at_zero(  # the second rate
            lambda s: _rate(instant, system, y.u + s * y.v, y.v, y.t + s), instant)
        if self._raw is not None:
            v, a = self._raw
            # forces of damping are those of the velocity of the scheme, before the joints
            first = _residual(y.t, system, y.u, a, y.multipliers - self._force, v)
            last = M(y.acceleration - a) + J.T @ self._force
        else:
            v, first = scene._velocity, np.zeros(c.N + c.m)
            if static is not None:
                first = residual(system, y.u, static.multipliers, static.load)
            last = _residual(y.t, system, y.u, y.acceleration, y.multipliers, y.v)[:c.N]
        return np.concatenate([first, M(y.v - v) + J.T @ self._impulse, rate, last, bend])

    def require_held(self, change: Array) -> None:
        """Raise InputError if derivatives of supports by parameters are not zero."""
        refuse(np.any(np.abs(change) > 0.0), "a prescribed motion depends on the parameters: "
               "derivatives of such motions are not available")

    def magnitudes(self) -> Array:
        """Typical magnitudes of the equations."""
        y, c, s = self.y, self._system.constraints, self._system.constraints.coordinate_sizes
        force = self._system.internal_force(y.u, y.t) + self._system.mass.multiply(y.acceleration)
        work = max(np.abs(force * s).max(), np.finfo(float).tiny)
        speed = np.full(c.m, self._system.size / self._h)
        return np.concatenate([work / s, speed * self._h, self._h * work / s, speed, work / s,
                               speed / self._h])[:len(self._solver.keep)]

    def _linearised(self, to_v, to_a):
        """The factors of the derivatives of the equations by the unknowns."""
        y, system, design, h = self.y, self._system, self._design, self._h
        c, held = system.constraints, y
        if self._raw is not None:
            held = replace(y, v=self._raw[0], multipliers=y.multipliers - self._force)
        M, D, K, _, J = matrices_of(system, state_of(system, design.scheme, held))
        K = K + _turning(design, held)
        turned = [c.curvature(y.u, y.t, x) for x in (self._impulse, self._force)]
        s = INSTANT * h
        early, late = (c.sparse_jacobian(y.u + x * y.v + 0.5 * x * x * y.acceleration, y.t + x)
                       for x in (-s, s))
        slope, bend = (late - early) / (2.0 * s), (late - 2.0 * J + early) / s**2
        none, out = [None, None], {(0, 0): 1.0, (1, 2): 1.0, (2, 4): 1.0, (3, 4): 1.0, (4, 5): 1.0,
                                   (5, 5): 1.0}
        if self._raw is not None:
            first, second, third = K + to_v * D + to_a * M, turned[0] - to_v * M, [
                turned[1] - to_a * M, None, *none]
            joints, free = J, sparse.diags_array(c.free * 1.0)
            by_v, by_a = D @ free, sparse.csr_array(system.mass.tocsc()) @ free
            rates = {(i, k): x for i, row in enumerate((self._v, self._a))
                     for k, x in enumerate(row)}
            self._before = (self._map(rates, "uu", START), self._map(
                {(0, 0): by_v, (0, 1): by_a, (2, 0): -by_a, (4, 1): -by_a}, "umumum", "uu"))
            self._kept = self._map({(3, k): x for k, x in enumerate(self._w)}, END, START)
            out |= {(3, 4): 1.0 / self._kick, (5, 1): 1.0}
        else:
            first, joints = (M, J) if design.state is None else matrices_of(
                system, design.state)[2::2]
            second, third = turned[0], [K, None, D, None]
        self._after = self._map(out, END, "umumum")
        return _factors([
            [first, joints.T, *none, *none], [joints, *none, *none, None],
            [second, None, M, J.T, *none], [slope, None, J, None, *none],
            [*third, M, J.T], [bend, None, 2.0 * slope, None, J, None]], K + M / h**2, c, h)

    def _map(self, blocks, rows, columns):
        """A function of x, also transposed, by blocks: numbers or sparse matrices, with rows and
        columns "u" of DOFs or "m" of joints."""
        sizes = {"u": len(self.y.u), "m": len(self.y.multipliers)}

        def applied(x, back=False):
            to, of = (columns, rows) if back else (rows, columns)
            parts = np.split(x, np.cumsum([sizes[one] for one in of])[:-1])
            out = [np.zeros((sizes[one], *x.shape[1:])) for one in to]
            for (i, j), A in blocks.items():
                i, j, A = (j, i, getattr(A, "T", A)) if back else (i, j, A)
                out[i] += A @ parts[j] if sparse.issparse(A) else A * parts[j]
            return np.concatenate(out)

        return applied

    # With F_z dz + B dy0 + F_p dp = 0 for the unknowns z, the instant is dy = A dz + K dy0, where
    # y0 is the one before, in the order of NAMES.

    def named(self, found: Array) -> Iterator[tuple[str, Array]]:
        """The parts of an instant by name."""
        N, m = len(self.y.u), len(self.y.multipliers)
        return zip(NAMES + READ, np.split(found, [N, 2 * N, 3 * N, 4 * N, 4 * N + m]))

    def forward(self, change: Array, old: Array | None) -> Array:
        """Derivatives of this instant (..., n), from those of the equations and of the instant
        before."""
        c, right = self._system.constraints, -change
        self.require_held(change[:c.N][c.fixed])
        if old is None:
            return self._after(self._solver.solve(right))
        moved = old = old[:4 * c.N + c.m]
        for one in self._before:
            moved = one(moved)
        return self._after(self._solver.solve(right - moved)) + self._kept(old)

    def backward(self, bars: Array) -> tuple[Array, Array]:
        """The adjoint of the equations, and derivatives by the instant before, from those by this
        instant."""
        moved = found = self._solver.solve(self._after(bars, True), "T")
        for one in self._before[::-1]:
            moved = one(moved, True)
        return found, self._kept(bars, True) - moved if self._before else bars


class _MeanStep(_Step):
    """A step of :class:`~skfem_ancf.EnergyMomentum`, with mean forces; as _Step, but for u, l; v,
    impulses. Accelerations and multipliers at the end are extrapolated from those in the middle of
    this step and the one before, w and "force"."""

    def __init__(self, design: MotionDesign, y: Motion, before: Motion) -> None:
        system = self._system = design._built.system
        c, h, self.y, self._begin, self._design = (
            system.constraints, y.t - before.t, y, before, design)
        self._h, more = h, 1.0 + h / (h + before.before)
        self._middle = u = 0.5 * (before.u + y.u)
        self._t = t = 0.5 * (before.t + y.t)
        self._speed, turn = (y.u - before.u) / h, 0.25 * (before.v + y.v)
        self._velocity = np.where(c.free, 2.0 * self._speed - before.v, y.v)  # before joints act
        self._J = J = c.sparse_jacobian(self._middle, self._t)
        self._impulse = lsqr(J[:, c.free].T, system.mass.multiply(self._velocity - y.v)[c.free],
                             atol=0.0, btol=0.0)[0] if c.m else np.zeros(0)
        self._force = y.force - self._impulse / h
        M, force = sparse.csr_array(system.mass.tocsc()), partial(_mean, system, t)
        late = _by_columns(design, lambda x: force(before.u, x), y.u, t, True)
        early = _by_columns(design, lambda x: force(x, y.u), before.u, t, True)
        if system.damped:
            held = replace(y, t=t, u=u, v=self._speed)
            D = matrices_of(system, state_of(system, design.scheme, held)).D / h
            turning = 0.5 * _turning(design, held)
            late, early = late + turning + D, early + turning - D
        s, kick = INSTANT * h, c.curvature(u, t, self._impulse)
        # derivatives along the mean velocity: of J, and of the curvature if Phi is not quadratic
        by_impulse = slope_at_zero(lambda x: c.sparse_jacobian(u + x * turn, t), s)
        third = slope_at_zero(lambda x: c.curvature(u + x * turn, t, self._impulse), s)
        turned = 0.5 * (c.curvature(u, t, self._force) + third)
        A = late + turned + 2.0 / h**2 * M
        self._before = (self._map({
            (0, 0): early + turned - 2.0 / h**2 * M, (0, 1): 0.25 * kick - 2.0 / h * M,
            (2, 0): 0.5 * kick + 2.0 / h * M, (2, 1): M}, "umum", START),)
        self._after = self._map({
            (0, 0): 1.0, (1, 2): 1.0, (2, 2): more / h, (3, 2): 1.0 / h, (4, 1): 1.0,
            (4, 3): 1.0 / h, (5, 1): more, (5, 3): more / h}, END, "umum")
        self._kept = self._map({(2, 1): -more / h, (2, 3): 1.0 - more, (3, 1): -1.0 / h,
                                (5, 4): 1.0 - more}, END, START)
        J = c.sparse_jacobian(y.u, y.t)
        slope = slope_at_zero(lambda x: c.sparse_jacobian(y.u + x * y.v, y.t + x), s)
        self._solver = _factors([
            [A, self._J.T, 0.25 * kick, by_impulse.T], [J, None, None, None],
            [0.5 * kick - 2.0 / h * M, None, M, self._J.T], [slope, None, J, None]], A, c, h)

    def equations(self, scene: Any) -> Array:
        """The equations of a scene with other parameters at this step, (2 (N + m),)."""
        system, y, start, M = scene.system, self.y, self._begin, scene.system.mass.multiply
        c = require_same_size(system, len(y.u), len(y.multipliers))
        J = c.sparse_jacobian(self._middle, self._t)
        first = (M((self._velocity - start.v) / self._h) + _mean(system, self._t, start.u, y.u)
                 + J.T @ self._force - c.mean_turning(start.u, y.u, start.v, y.v, self._t,
                                                      self._impulse))
        if system.damped:
            first = first + system.damping_force(self._middle, self._speed, self._t)
        first[c.fixed] = c.values(1.0, y.t)
        return np.concatenate([
            first, c.constraint(y.u, y.t), M(y.v - self._velocity) + J.T @ self._impulse,
            _rate(INSTANT * self._h, system, y.u, y.v, y.t)])


def _factors(rows, K, c, h):
    """The factors of equations and unknowns in blocks u, l; v, impulses; a, forces, or the first.
    They are scaled by the sizes of coordinates, a stiffness K and the time h."""
    sizes, n = c.coordinate_sizes, len(rows)
    scale = np.full(c.m, np.abs(K.diagonal() * sizes**2)[c.free].max())
    both = [sizes, scale, sizes / h]
    left = np.concatenate([*both, scale * h, sizes, scale * h * h][:n])
    right = np.concatenate([*both, scale * h, sizes / h**2, scale][:n])
    return Factors.of(rows, left, right, np.tile(np.append(c.free, np.ones(c.m, bool)), n // 2))


def _turning(design, y):
    """The derivative of the damping force by the displacement, sparse (N, N)."""
    system = design._built.system
    if not (system.viscous or system.forces.resists) or not y.v.any():
        return sparse.csr_array((system.N, system.N))
    return _by_columns(design, lambda u: system.damping_force(u, y.v, y.t), y.u, y.t, False)


def _by_columns(design, force, u, t, mean):
    """The derivative of a force, a mean one or of damping, by the displacement at u, sparse (N, N).
    By differences; columns without common rows are moved at once, see [2] of Design."""
    system = design._built.system
    if mean not in design._coloured:
        design._coloured[mean] = _colours(system, u, t, mean)
    (i, j, colours, step), sizes = design._coloured[mean], system.constraints.coordinate_sizes
    values = np.zeros(len(i))

    def along(d):
        return sum(c * force(u + x * step * sizes * d) for x, c in STENCIL) / step

    for colour in range(colours.max() + 1):
        change, own = along(colours == colour), colours[j] == colour
        values[own] = change[i[own]] / sizes[j[own]]
    found, d = sparse.csr_array((values, (i, j)), shape=2 * (system.N,)), np.cos(np.arange(len(u)))
    missed = np.abs(found @ (sizes * d) - along(d)) * sizes
    refuse(missed.max() > MISSED * np.max(sizes * (abs(found) @ sizes)), "a force couples degrees "
           "of freedom that share no element: derivatives of its motions are not available")
    return found


def _colours(system, u, t, mean):
    """Rows and columns (k,) of the derivative of a force, colours (N,) of columns, and a step."""
    # Mean forces of loads with an energy of their own couple all DOFs of a beam, those of torques
    # both ends; they are no polynomials, nor are those of nonlinear laws.
    n, elements, own, pairs = len(system.beams), system.forces.elements, [], []
    pattern = [entries_of(s.start + element_dofs(beam)) for beam, s in zip(
        system.beams, system.slices) if mean or system.viscous]
    if elements:
        pattern.append(system.forces.entries(system.backend.tables.plain.forces, t, u, u, 1.0)[:2])
    if mean:
        own = [load for load in system.loads if not (
            load.constant or load.turning or load.linear or load.eigen_stresses)]
        own += [e.load for e in elements if isinstance(e, MemberForce) and e.load]
        pairs = [system.of(load).start + np.ravel(load.dofs) for load in system.loads
                 if load.turning and load.couple is not None]
        blocks = [system.of(load) for load in own] + system.slices[
            n:len(system.members) - len(system.domains)]
        pattern += [entries_of(np.arange(system.N)[s][None]) for s in blocks]
        pattern += [entries_of(np.concatenate(pairs)[None])] if pairs else []
    i, j = (np.concatenate([np.ravel(part) for part in parts]) for parts in zip(*pattern))
    touched = sparse.csr_array((np.ones(len(i)), (i, j)), shape=(system.N, system.N))
    touched.sum_duplicates()
    i, j = touched.nonzero()
    near, colours = sparse.csr_array(touched.T @ touched), np.full(system.N, -1)
    for k in np.unique(j):
        used = colours[near.indices[near.indptr[k]:near.indptr[k + 1]]]
        colours[k] = np.setdiff1d(np.arange(len(used) + 1), used)[0]
    smooth = not own and all(beam.kernel.linear for beam in system.beams) and not any(
        getattr(type(e), "mean_force", None) is BoundForce.mean_force for e in elements)
    return i, j, colours, SMALL if smooth or not mean else TINY


def _mean(system, t, u0, u1):
    """The mean of internal forces less loads over a step about t, (N,)."""
    tables, loads = system.backend.tables, np.zeros(system.N)
    mean_external_force(tables.plain.loads, tables.factors(np.array([t]))[0], t, u0, u1, loads)
    return system.mean_internal_force(u0, u1, t) - loads


def _residual(t, system, u, a, l, v):
    """The equations of motion at the end of a step, (N + m,)."""
    out, force = residual(system, u, l, 1.0, None, t), system.mass.multiply(a)
    if system.damped:
        force = force + system.damping_force(u, v, t)
    out[:system.N] += np.where(system.constraints.free, force, 0.0)
    return out


def _rate(instant, system, u, v, t):
    """The rate of the joints for a velocity v."""
    c = system.constraints
    return c.sparse_jacobian(u, t) @ v + slope_at_zero(lambda s: c.constraint(u, t + s), instant)
