"""Supports and joints: fixed degrees of freedom, and equations with multipliers."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from ..actions.joints.base import Joint
from ..actions.joints.director import UnitDirector
from ..actions.joints.nodes import Nodes
from ..actions.joints.part import Part
from ..actions.joints.settlements import HELD
from ..beam.beam import Beam
from ..beam.rigid import RigidBody
from ..core.errors import InputError, ModelWarning, SupportError, shown
from ..core.origin import ours
from ..core.types import Array
from .mobility import advice, free_rigid_motions, who
from .redundancy import repeated, shared
from .signature import DENSE, FREE, first_dependent

#: Multipliers whose derivatives are dense matrices, at most.
FEW = 96
#: By how much equations left out may be open, over their sizes.
OPENED = 1e-5
#: What is kept of the joints, and changes where equations are left out.
KEPT_OF_JOINTS = "slopes", "seconds", "tabled", "_still", "_at_rest", "frame", "_limited"
#: No rows, columns and values.
_NO_ENTRIES = np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0)


class Constraints:
    """The supports and joints of a scene.

    Joints that only fix coordinates are eliminated like supports; the others are equations
    ``Phi(u, t) = 0`` with multipliers.

    Parameters
    ----------
    members, slices
        The beams and behind them the rigid bodies, in order, and the coordinates of each.
    size
        Length of all beams together.
    fixed, values
        Numbers of the fixed coordinates and their displacements at full load, shape (n,).
    joints
        Joints, already bound.
    stiffness
        A function that returns that of force elements in the reference configuration, sparse, (N,
        N); None where there are none.

    Other Parameters
    ----------------
    u, v, t
        Displacement and a direction or velocity, shape (N,), and time; with 0 and 1 those at both
        ends of a step.
    multipliers
        Of the equations, shape (m,).
    load
        Factor on prescribed displacements.
    rows, columns, values
        Entries of a matrix, shape (k,).

    Attributes
    ----------
    all_joints, joints : list
        The joints, and those with multipliers.
    N, m : int
        Number of degrees of freedom and of multipliers.
    fixed
        Numbers of the coordinates that supports and joints fix, shape (n,).
    given
        Their displacements at full load, without what joints prescribe, shape (n,).
    free, mask
        For each coordinate whether it is free, as truth values and as 1 or 0; shape (N,).
    """

    def __init__(self, members: Sequence[Beam | RigidBody], slices: Sequence[slice], size: float,
                 fixed: Array, values: Array, joints: Sequence[Joint],
                 stiffness: Callable[[], Any] | None) -> None:
        self.members, self.slices, self.size, self._stiffness = members, slices, size, stiffness
        self.N = slices[-1].stop
        self._independent = self.passing = False
        self._eliminate(fixed, values, joints)
        #: numbers of equations left out, and those of each joint
        self._left_out = np.zeros(0, dtype=int)
        self._unasked: list[tuple[Joint, Array, Array]] = []
        self._leave_out()

    def _eliminate(self, fixed, values, joints):
        """Sort joints that only fix coordinates to the supports, the others to the multipliers."""
        self.free = np.ones(self.N, dtype=bool)
        self.free[fixed] = False
        self.fixed, self.given = np.array(fixed, np.int64), np.array(values, float)
        self.all_joints, self.joints, self._held = list(joints), [], np.zeros(len(fixed))
        self._fixing: list[Any] = []
        self._moving: list[Any] = []
        if joints:
            self._eliminate_joints(joints)
        self.mask = self.free.astype(float)
        self.m = sum([len(joint.equations) for joint in self.joints])

    def _eliminate_joints(self, joints):
        zero, fixed, held, first = np.zeros(self.N), [self.fixed], [self._held], len(self.fixed)
        for joint in joints:
            found = _fixes(joint, zero) if joint.constant else None
            if found is None:
                self.joints.append(joint)
                continue
            dofs, factors = found
            if not self.free.take(dofs).all():
                if not joint.moving:
                    self.joints.append(joint)
                    continue
                clash = np.sort(dofs[~self.free[dofs]])
                raise SupportError(
                    f"{joint!r} prescribes {self.describe_dof(clash[0])}, which a support or "
                    "another joint fixes already: remove one of them, as the second of two "
                    "clamps at one place")
            self._fixing.append((joint, first, factors))
            self.free[dofs] = False
            fixed.append(dofs)
            held.append(0.0 * factors if joint.moving else -joint.value(zero, 0.0) / factors)
            first += len(dofs)
        if len(fixed) > 1:
            self.fixed, self._held = np.concatenate(fixed), np.concatenate(held)
            self.given = np.concatenate([self.given, np.zeros(first - len(self.given))])
        self._moving = [item for item in self._fixing if item[0].moving]

    def _leave_out(self):
        """Leave out equations of joints that repeat others, and say so."""
        if not self.joints or self.condensable:
            return
        self._independent = self._apart or self._dependent() is None
        if self._independent:
            return
        found, self.passing = repeated(self)
        if found is None or not len(found):
            return
        parts, first, said, unasked = [], 0, [], []
        sizes = self.equation_sizes(*self.slopes)
        for joint in self.joints:
            m = len(joint.equations)
            out = found[(found >= first) & (found < first + m)] - first
            first, size = first + m, sizes[first + out]
            if not len(out):
                parts.append(joint)
                continue
            if isinstance(joint, Nodes):
                return
            unasked.append((joint, out, size))
            said.append(f"{joint!r} ({', '.join(joint.equations[k] for k in out)})")
            if len(out) < m:
                parts.append(Part(joint, np.setdiff1d(np.arange(m), out)))
        more = f" and {len(said) - 4} more" if len(said) > 4 else ""
        warnings.warn(
            f"{len(found)} of {self.m} equations of joints repeat others or supports: "
            f"{', '.join(said[:4])}{more}. The scene moves as without them; joint_force shares "
            "the forces by least squares", ModelWarning, stacklevel=5)
        self._whole = copy(self)
        self.joints, self.m = parts, self.m - len(found)
        self._left_out, self._unasked = found, unasked
        for name in KEPT_OF_JOINTS:
            vars(self).pop(name, None)

    def describe_dof(self, k: int) -> str:
        """What coordinate number k is, in words."""
        b = int(np.searchsorted([s.start for s in self.slices], k, side="right")) - 1
        member, k = self.members[b], k - self.slices[b].start
        node = "" if isinstance(member, RigidBody) else f" of node {k // member.nd}"
        return f"{member.dofnames[k % member.nd]}{node}{who(self.members, b)}"

    # fixed coordinates

    def values(self, load: float, t: float | None = None) -> Array:
        """Displacements of the fixed coordinates at a load factor and a time.

        Returns
        -------
        ndarray
            Shape (nfixed,).
        """
        values = load * self.given + self._held
        for joint, first, factors in self._moving:
            phi = joint.offset(np.array([load if t is None else t]), self.N)[0]
            values[first:first + len(factors)] = -phi / factors
        return values

    def values_at(self, times: Array) -> Array:
        """Displacements of the fixed coordinates at full load, at times (n,): (n, nfixed)."""
        values = np.tile(self.given + self._held, (len(times), 1))
        for joint, first, factors in self._moving:
            values[:, first:first + len(factors)] = -joint.offset(times, self.N) / factors
        return values

    @cached_property
    def moves(self) -> bool:
        """True if a fixed coordinate has a displacement that is not zero, now or later."""
        return bool(self._moving) or bool(np.any(self.given + self._held))

    # equations of joints

    @cached_property
    def coordinate_sizes(self) -> Array:
        """What coordinates change by where the scene moves by its size, shape (N,)."""
        out = np.concatenate([member.sizes for member in self.members])
        if len(self.members) > 1:
            for member, s in zip(self.members, self.slices):
                out[s].reshape(-1, member.nd)[:, :2] = self.size  # positions
        return out

    def equation_sizes(self, rows: Array, columns: Array, values: Array) -> Array:
        """The residual of equations where one of their coordinates changes by its size.

        Returns
        -------
        ndarray
            Shape (m,): the size of the scene where there is no such coordinate.
        """
        out = np.zeros(self.m)
        np.maximum.at(out, rows, np.abs(values) * self.coordinate_sizes[columns])
        out[out == 0.0] = self.size
        return out

    def constraint(self, u: Array, t: float | None) -> Array:
        """Phi of the joints with multipliers, shape (m,)."""
        if not self.tabled:
            return np.concatenate([np.zeros(0), *(joint.value(u, t) for joint in self.joints)])
        rows, columns, values = self._slopes_at(t)
        k, i, j, v = self.seconds
        return (self._offset(t) + np.bincount(rows, values * u[columns], self.m)
                + 0.5 * np.bincount(k, v * u[i] * u[j], self.m))

    @cached_property
    def seconds(self) -> tuple[Array, ...]:
        """Second derivatives of Phi in the reference configuration: equation, row, column, value.

        As :meth:`~skfem_ancf.actions.joints.Joint.second_entries` of the joints has them.
        """
        if not self.joints:
            return (*2 * _NO_ENTRIES[:1], *_NO_ENTRIES[1:])
        return self._in_order([joint.second_entries(self.N) for joint in self.joints])

    @cached_property
    def tabled(self) -> bool:
        """True if :attr:`slopes`, :attr:`seconds` and offsets give Phi and its derivatives."""
        if all(map(ours, self.joints)):
            return all(joint.tabled for joint in self.joints)
        return self._quadratic_at((0.0, 0.37))

    def _quadratic_at(self, times: Iterable[float]) -> bool:
        """True if Phi and its derivative are those of the tables: user-defined ones may not be."""
        sizes = self.coordinate_sizes
        of_equations, rng = self.equation_sizes(*self.slopes), np.random.default_rng(0)
        k, i, j, v = self.seconds
        for t in times:
            u = 0.1 * sizes * rng.standard_normal(self.N)
            slope = self._to_sparse(*self._slopes_at(t))
            J = slope + self._to_sparse(k, i, v * u[j])
            offset = np.concatenate([one.offset(np.array([t]), self.N)[0] for one in self.joints])
            phi = np.concatenate([one.value(u, t) for one in self.joints])
            gap = J - self._to_sparse(*self._in_order(one.entries(u, t) for one in self.joints))
            if not (np.all(np.abs(offset + 0.5 * (J + slope) @ u - phi) <= 1e-9 * of_equations)
                    and (abs(gap) @ sizes <= 1e-9 * (abs(J) @ sizes)).all()):
                return False
        return True

    @cached_property
    def _still(self):
        """Phi in the reference configuration, and whether its derivative there never changes."""
        offset = [joint.offset(np.zeros(1), self.N)[0] for joint in self.joints]
        return np.concatenate([np.zeros(0), *offset]), not any(j.turning for j in self.joints)

    def _offset(self, t):
        if not self.drives:
            return self._still[0]
        return np.concatenate([joint.offset(np.array([t]), self.N)[0] for joint in self.joints])

    def _slopes_at(self, t):
        if self._still[1]:
            return self.slopes
        found = [joint.slope_entries(np.array([t]), self.N) for joint in self.joints]
        return self._in_order((rows, columns, values[0]) for rows, columns, values in found)

    @property
    def drives(self) -> bool:
        """True if a joint with multipliers depends on time."""
        return any(joint.moving for joint in self.joints)

    def full_jacobian(self, u: Array, t: float) -> Array | sparse.csr_array:
        """Derivative of :meth:`constraint` by all coordinates, shape (m, N).

        Sparse where the multipliers are many.
        """
        return (self.to_dense if self.few else self._to_sparse)(*self._entries(u, t))

    def to_dense(self, rows: Array, columns: Array, values: Array) -> Array:
        """A matrix (m, N) by its entries (k,)."""
        J = np.zeros((self.m, self.N))
        np.add.at(J, (rows, columns), values)
        return J

    def _to_sparse(self, rows: Array, columns: Array, values: Array) -> sparse.csr_array:
        """The same as a scipy.sparse array."""
        return sparse.csr_array((values, (rows, columns)), shape=(self.m, self.N))

    def sparse_jacobian(self, u: Array, t: float) -> sparse.csr_array:
        """As :meth:`full_jacobian`, as a scipy.sparse array in CSR format."""
        return self._to_sparse(*self._entries(u, t))

    def jacobian_entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        """Rows, columns and values (k,) of :meth:`jacobian`; entries of one place are summed."""
        rows, columns, values = self._entries(u, t)
        return rows, columns, values * self.mask[columns]

    @cached_property
    def slopes(self) -> tuple[Array, ...]:
        """Rows, columns, values of :meth:`full_jacobian` in the reference configuration at time 0.

        As :meth:`~skfem_ancf.actions.joints.Joint.slope_entries` of the joints has them.
        """
        found = [joint.slope_entries(np.zeros(1), self.N) for joint in self.joints]
        return self._in_order((rows, columns, values[0]) for rows, columns, values in found)

    @cached_property
    def _at_rest(self):
        """The matrix of :attr:`slopes`, sparse where the coordinates are many."""
        return (self.to_dense if self.few and self.N <= DENSE else self._to_sparse)(*self.slopes)

    def _entries(self, u, t):
        """Rows, columns and values of :meth:`full_jacobian`."""
        if not self.tabled:
            return self._in_order(joint.entries(u, t) for joint in self.joints)
        (k, i, j, v), slopes = self.seconds, self._slopes_at(t)
        return tuple(np.append(a, b) for a, b in zip(slopes, (k, i, v * u[j])))

    def _in_order(self, entries: Iterable[tuple]) -> tuple[Array, ...]:
        """Tables of the joints one behind the other, their rows those of all equations.

        Parameters
        ----------
        entries
            For each joint rows and other columns, arrays of one shape (k,).
        """
        first, parts = 0, []
        for joint, (rows, *others) in zip(self.joints, entries):
            parts.append((first + rows, *others))
            first += len(joint.equations)
        return _joined(parts or [_NO_ENTRIES])

    def jacobian(self, u: Array, t: float) -> Array | sparse.csr_array:
        """As :meth:`full_jacobian`, zero at fixed coordinates."""
        return (self.to_dense if self.few else self._to_sparse)(*self.jacobian_entries(u, t))

    def quadratic(self, u: Array, t: float, v: Array) -> Array:
        """The second derivative of :meth:`constraint` in the direction v, shape (m,)."""
        return np.concatenate([np.zeros(0), *(joint.quadratic(u, t, v) for joint in self.joints)])

    def curvature(self, u: Array, t: float, multipliers: Array) -> sparse.csr_matrix:
        """sum_k multipliers[k] d^2 Phi_k / du^2 at free coordinates, sparse, shape (N, N)."""
        i, j, v = self.curvature_entries(u, t, multipliers)
        return sparse.csr_matrix((v, (i, j)), shape=(self.N, self.N))

    def curvature_entries(self, u: Array, t: float | None,
                          multipliers: Array) -> tuple[Array, Array, Array]:
        """Rows, columns and values of :meth:`curvature`."""
        i, j, v = self._curvature(u, t, multipliers)
        return i, j, v * (self.free[i] & self.free[j])

    def _curvature(self, u, t, multipliers):
        if self.tabled:
            k, i, j, v = self.seconds
            return i, j, multipliers[k] * v
        parts = [joint.curvature(u, t, part)
                 for joint, part in zip(self.joints, self.multipliers_of(multipliers))]
        return _joined([part for part in parts if part is not None] or [_NO_ENTRIES])

    def mean_jacobian(self, u0: Array, u1: Array, t: float) -> Array:
        """Discrete gradients of :meth:`constraint` in a step, shape (m, N)."""
        return self.to_dense(*self._in_order(
            joint.mean_entries(u0, u1, t) for joint in self.joints))

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        """What joints turn by in a step, see :meth:`~skfem_ancf.actions.joints.Joint.mean_turning`.
        """
        parts = zip(self.joints, self.multipliers_of(multipliers))
        return sum((joint.mean_turning(u0, u1, v0, v1, t, part) for joint, part in parts),
                   np.zeros(self.N))

    @cached_property
    def _limited(self) -> list[Joint]:
        """Joints that may be lost."""
        return [joint for joint in self.joints if type(joint).lost is not Joint.lost]

    def lost(self, u: Array) -> str:
        """Which joint cannot hold in a converged state, and why; "" if all can."""
        for joint, out, size in self._unasked:
            if (np.abs(joint.value(u, 0.0)[out]) > OPENED * size).any():
                return f"{joint!r} cannot hold beside the other joints: it contradicts them here"
        return next(filter(None, (joint.lost(u) for joint in self._limited)), "")

    def first_lost(self, rows: Array) -> tuple[int, str]:
        """How many states one after the other joints can hold, and why not the next one."""
        for k, u in enumerate(rows if self._limited or self._unasked else ()):
            text = self.lost(u)
            if text:
                return k, text
        return len(rows), ""

    def multipliers_of(self, multipliers: Array) -> list[Array]:
        """The multipliers joint by joint: a list in the order of :attr:`joints`."""
        if not self.joints:
            return []
        ends = np.cumsum([len(joint.equations) for joint in self.joints])[:-1]
        return np.split(multipliers, ends)

    def joint_force(self, joint: Joint, multipliers: Array, reaction: Array, u: Array,
                    t: float) -> Array:
        """What a joint does to its first beam, in the order of ``joint.equations``.

        Parameters
        ----------
        joint
            One of the scene's, as it was given.
        multipliers
            Of the equations, shape (m,).
        reaction
            Force of the supports on the coordinates, shape (N,).
        u, t
            Where joints act: displacement of the coordinates, shape (N,), and time.

        Returns
        -------
        ndarray
            A number for each equation.
        """
        if len(self._left_out):
            whole = self._whole
            sizes = whole.equation_sizes(*whole.slopes)
            rows = sparse.csr_array(sparse.diags(1.0 / sizes) @ whole.sparse_jacobian(u, t)
                                    @ sparse.diags(self.coordinate_sizes))
            all_of = np.zeros(whole.m)
            all_of[np.setdiff1d(np.arange(whole.m), self._left_out)] = multipliers
            inner = [isinstance(j, UnitDirector) for j in whole.joints for _ in j.equations]
            multipliers = shared(rows, sizes * all_of, self._left_out, np.array(inner)) / sizes
            return whole.joint_force(joint, multipliers, reaction, u, t)
        for known, part in zip(self.joints, self.multipliers_of(multipliers)):
            if known.same(joint):
                return -part
        for known, first, factors in self._fixing:
            if known.same(joint):
                return reaction[self.fixed[first:first + len(factors)]] / factors
        raise SupportError(f"{shown(joint)} is not a joint of this scene")

    def force_on(self, held: Array, multipliers: Array) -> tuple[Array, Array]:
        """What joints do that hold these coordinates alone by equations that do not change.

        They are as supports, which coordinates along the axes would be fixed for.

        Parameters
        ----------
        held
            Truth values of the coordinates, shape (N,).
        multipliers
            Of the equations, shape (m,).

        Returns
        -------
        force, touched
            The force on the coordinates, shape (N,), and which of them these joints hold.
        """
        force, touched, zero = np.zeros(self.N), np.zeros(self.N, dtype=bool), np.zeros(self.N)
        for joint, part in zip(self.joints, self.multipliers_of(multipliers)):
            if joint.constant:
                rows, columns, values = joint.entries(zero, 0.0)
                if held[columns].all():
                    np.subtract.at(force, columns, values * part[rows])
                    touched[columns] = True
        return force, touched

    # what is held

    def require_motion(self) -> None:
        """Raise InputError if something is given in proportion to the load of statics."""
        if self.frame is not None and np.any(self.frame.settled.numbers):
            node, k = np.argwhere(self.frame.settled.numbers)[0]
            value = self.frame.settled.numbers[node, k]
            raise InputError(
                f"node {node} is displaced by {HELD[k]}={value:g}, which grows with the load of a "
                "static solution: for a motion give a function of time, as "
                f"frame.settle({node}, {HELD[k]}=lambda t: {value:g} * min(t, 1.0)); or lambda t: "
                f"{value:g} if it stays as it was in the static state at the start")

    def _dependent(self):
        """The first equation that those before it hold, see :func:`.signature.first_dependent`."""
        zero = np.zeros(self.N)
        return first_dependent(self._at_rest * self.coordinate_sizes, self.free,
                               lambda: self.constraint(zero, 0.0))

    def require_independent_joints(self) -> None:
        """Raise SupportError if joints contradict each other or the supports, or depend on them."""
        if self._independent or not self.joints or self.condensable:
            return
        found = self._dependent()
        self._independent = found is None  # nothing of it changes in the life of a system
        if found is None:
            return
        k, gap = found
        joint, equation = [(joint, name) for joint in self.joints for name in joint.equations][k]
        size = self.equation_sizes(*self.slopes)[k]
        kind = "repeats" if abs(gap) <= 1e-9 * size else "contradicts"
        if self.passing and kind == "repeats":
            raise SupportError(f"{joint!r}, equation {equation!r}, depends in this position on "
                               "what the supports and the joints before it hold: begin in "
                               "another one, or solve in time with scene.integrate")
        raise SupportError(f"{joint!r}, equation {equation!r}, {kind} what the supports and the "
                           "joints before it hold already: remove one of them")

    @property
    def _apart(self):
        """True if no coordinate of an equation of joints is held or in another one."""
        rows, columns, values = self.slopes
        return (len(set(columns.tolist())) == len(columns) and len(set(rows.tolist())) == self.m
                and bool(self.free.take(columns).all()) and bool(values.all()))

    @property
    def few(self) -> bool:
        """True if derivatives of the equations are dense matrices."""
        return self.frame is None and self.m <= FEW

    @cached_property
    def frame(self) -> Nodes | None:
        """The joint of the nodes of a frame, or None."""
        return next((joint for joint in self.joints if isinstance(joint, Nodes)), None)

    @property
    def condensable(self) -> bool:
        """True if nothing holds but the nodes of a frame."""
        return self.frame is not None and len(self.joints) == 1 and not len(self.fixed)

    def free_rigid_motions(self) -> list[str]:
        """Descriptions of the rigid motions that nothing holds, one string each."""
        return free_rigid_motions(self, self._at_rest, self._stiffness)

    def require_supports(self) -> None:
        """Raise SupportError if a rigid motion is free, or joints are not independent."""
        self.require_independent_joints()
        if self.missing_supports:
            raise SupportError(self.missing_supports)

    @cached_property
    def missing_supports(self) -> str:
        """The rigid motions that are free, and what would hold them, in words; or empty."""
        free = self.free_rigid_motions()
        if not free:
            return ""
        return ("the supports leave rigid motions free: " + "; ".join(free)
                + (", along which the springs have no stiffness before the load"
                   if self._stiffness is not None else "")
                + f". Add a support, for example {advice(self)}, or solve in time with "
                "scene.integrate")

    @cached_property
    def adrift(self) -> bool:
        """True if nothing holds a translation of the whole scene, so that no load can either."""
        if self._stiffness is not None or not self.missing_supports:
            return False
        whole = np.concatenate([member.rigid_motions()[:, :2] for member in self.members])
        held = np.concatenate([whole[self.fixed], self._at_rest @ whole])
        sigma = np.linalg.svd(held, compute_uv=False)
        return len(sigma) < 2 or sigma[1] <= FREE * sigma[0]


def _joined(parts):
    """Rows, columns and values of several tables, one behind the other."""
    return parts[0] if len(parts) == 1 else tuple(map(np.concatenate, zip(*parts)))


def _fixes(joint, zero):
    """Coordinates that the equations of a joint fix, and their factors; None if it does more."""
    rows, dofs, factors = joint.entries(zero, 0.0)
    if len(rows) != len(joint.equations) or not factors.all():
        return None
    inorder = list(range(len(rows)))
    if rows.tolist() == inorder:
        return dofs, factors
    order = rows.argsort()
    if rows[order].tolist() != inorder:
        return None
    return dofs[order], factors[order]
