"""Supports and joints: fixed degrees of freedom, and equations with Lagrange multipliers."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from typing import Any

import numpy as np
import scipy.linalg
from scipy import sparse

from ..actions.bound import BoundConstraint, everywhere, is_table
from ..actions.joints.base import IndependentPart, UnitDirector
from ..actions.joints.nodes import COMPONENTS, Nodes
from ..beam import Beam, RigidBody
from ..core.band import dense
from ..core import (Array, InputError, ModelWarning, SupportError, cached_property, is_builtin,
                    refuse, shown)
from .mobility import advice, first_of, free_rigid_motions, repeated, shared, who
from .rank import DENSE, DEPENDENT, FREE, groups

#: Largest number of multipliers with dense Jacobians.
FEW = 96
#: Cached properties that change when redundant equations are removed.
CACHED = "slopes", "seconds", "tabled", "_still", "_at_rest", "frame", "_limited"
#: Empty rows, columns and values.
_NO_ENTRIES = np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0)


class Constraints:
    """The supports and joints of a scene. Joints that only fix DOFs are eliminated like supports;
    the others, :attr:`joints`, are equations ``Phi(u, t) = 0`` with m multipliers. Methods take a
    displacement u (N,), a time t and multipliers (m,); sparse matrices are rows, columns and values
    (k,). ``free`` and ``mask`` (N,) are bool and float; ``given`` are the displacements of the
    ``fixed`` DOFs at full load, without motions of joints; ``stiffness()`` is that of force
    elements at rest, sparse (N, N), or None."""

    def __init__(self, members: Sequence[Beam | RigidBody], slices: Sequence[slice], size: float,
                 fixed: Array, values: Array, joints: Sequence[BoundConstraint],
                 stiffness: Callable[[], Any] | None) -> None:
        self.members, self.slices, self.size, self._stiffness = members, slices, size, stiffness
        self.N = slices[-1].stop
        self._independent = self.passing = False
        self._eliminate(fixed, values, joints)
        #: redundant equations, and those of each joint
        self._left_out = np.zeros(0, dtype=int)
        self._unasked: list[tuple[BoundConstraint, Array, Array]] = []
        self._leave_out()

    def _eliminate(self, fixed, values, joints):
        """Sort joints into those that fix degrees of freedom and those with multipliers."""
        self.free = np.ones(self.N, dtype=bool)
        self.free[fixed] = False
        self.fixed, self.given = np.array(fixed, np.int64), np.array(values, float)
        self.all_joints, self.joints, self._held = list(joints), [], np.zeros(len(fixed))
        self._fixing: list[Any] = []
        zero, fixed, held, first = np.zeros(self.N), [self.fixed], [self._held], len(self.fixed)
        for joint in joints:
            rows, dofs, factors = joint.entries(zero, 0.0) if joint.constant else _NO_ENTRIES
            order = rows.argsort()
            fixes = (joint.constant and rows[order].tolist() == list(range(len(joint.equations)))
                     and factors.all())  # one DOF in each equation
            dofs, factors = dofs[order], factors[order]
            held_already = not self.free.take(dofs).all()
            if not fixes or held_already and not joint.moving:
                self.joints.append(joint)
                continue
            if held_already:
                clash = np.sort(dofs[~self.free[dofs]])
                raise SupportError(
                    f"{joint!r} prescribes {self.describe_dof(clash[0])}, which a support or "
                    "another joint fixes already: remove one of them")
            self._fixing.append((joint, first, factors))
            self.free[dofs] = False
            fixed.append(dofs)
            held.append(0.0 * factors if joint.moving else -joint.value(zero, 0.0) / factors)
            first += len(dofs)
        if len(fixed) > 1:
            self.fixed, self._held = np.concatenate(fixed), np.concatenate(held)
            self.given = np.concatenate([self.given, np.zeros(first - len(self.given))])
        self._moving = [item for item in self._fixing if item[0].moving]
        self.mask = self.free.astype(float)
        self.m = sum([len(joint.equations) for joint in self.joints])

    def _leave_out(self):
        """Remove redundant equations of joints, with a warning."""
        if not self.joints or self.condensable:
            return
        rows, columns, values = self.slopes
        # each DOF of the joints is free and occurs in one equation only
        apart = (len(set(columns.tolist())) == len(columns) and len(set(rows.tolist())) == self.m
                 and bool(self.free.take(columns).all()) and bool(values.all()))
        self._independent = apart or self._dependent() is None
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
                parts.append(IndependentPart(joint, np.setdiff1d(np.arange(m), out)))
        more = f" and {len(said) - 4} more" if len(said) > 4 else ""
        warnings.warn(
            f"{len(found)} of {self.m} equations of joints are redundant, they repeat others or "
            f"supports: {', '.join(said[:4])}{more}. They do not change the motion; joint_force "
            "returns the least-squares forces", ModelWarning, stacklevel=5)
        self._whole = copy(self)
        self.joints, self.m = parts, self.m - len(found)
        self._left_out, self._unasked = found, unasked
        for name in CACHED:
            vars(self).pop(name, None)

    def describe_dof(self, k: int) -> str:
        """Name of the degree of freedom number k."""
        b = int(np.searchsorted([s.start for s in self.slices], k, side="right")) - 1
        member, k = self.members[b], k - self.slices[b].start
        node = "" if isinstance(member, RigidBody) else f" of node {k // member.nd}"
        return f"{member.dofnames[k % member.nd]}{node}{who(self.members, b)}"

    # fixed degrees of freedom

    def values(self, load: float, t: float | None = None) -> Array:
        """Displacements of the fixed DOFs (nfixed,) at a load factor and a time."""
        values = load * self.given + self._held
        for joint, first, factors in self._moving:
            phi = joint.offset(np.array([load if t is None else t]), self.N)[0]
            values[first:first + len(factors)] = -phi / factors
        return values

    def values_at(self, times: Array) -> Array:
        """Displacements of the fixed DOFs at full load, at times (n,): (n, nfixed)."""
        values = np.tile(self.given + self._held, (len(times), 1))
        for joint, first, factors in self._moving:
            values[:, first:first + len(factors)] = -joint.offset(times, self.N) / factors
        return values

    @cached_property
    def moves(self) -> bool:
        """True if a fixed DOF has a nonzero displacement at any time."""
        return bool(self._moving) or bool((self.given + self._held).any())

    # equations of joints

    @cached_property
    def coordinate_sizes(self) -> Array:
        """Typical magnitudes of the DOFs when the scene moves by its size, shape (N,)."""
        out = np.concatenate([member.sizes for member in self.members])
        if len(self.members) > 1:
            for member, s in zip(self.members, self.slices):
                out[s].reshape(-1, member.nd)[:, :2] = self.size  # positions
        return out

    def equation_sizes(self, rows: Array, columns: Array, values: Array) -> Array:
        """Typical magnitudes of the equations (m,); the size of the scene for empty rows."""
        out = np.zeros(self.m)
        np.maximum.at(out, rows, np.abs(values) * self.coordinate_sizes[columns])
        out[out == 0.0] = self.size
        return out

    def constraint(self, u: Array, t: float | None) -> Array:
        """Phi, shape (m,)."""
        return self._by_tables(u, t) if self.tabled else self._by_joints(u, t)

    def _by_joints(self, u, t):
        return np.concatenate([np.zeros(0), *(joint.value(u, t) for joint in self.joints)])

    def _by_tables(self, u, t):
        (rows, columns, values), (k, i, j, v) = self._slopes_at(t), self.seconds
        offset = self.offsets(np.array([t]))[0] if self.drives else self._still[0]
        return (offset + np.bincount(rows, values * u[columns], self.m)
                + 0.5 * np.bincount(k, v * u[i] * u[j], self.m))

    @cached_property
    def seconds(self) -> tuple[Array, ...]:
        """Second derivatives of Phi in the reference configuration: equation, i, j, value."""
        if not self.joints:
            return (*2 * _NO_ENTRIES[:1], *_NO_ENTRIES[1:])
        return self._in_order([joint.second_entries(self.N) for joint in self.joints])

    @cached_property
    def tabled(self) -> bool:
        """True if Phi is quadratic and given by :attr:`slopes`, :attr:`seconds` and offsets."""
        if all(is_builtin(getattr(joint, "item", joint)) for joint in self.joints):
            return all(joint.tabled for joint in self.joints)
        # test user-defined joints against the tables at a random displacement
        times = (0.0, 0.37)
        sizes = self.coordinate_sizes
        of_equations, rng = self.equation_sizes(*self.slopes), np.random.default_rng(0)
        k, i, j, v = self.seconds
        for t in times:
            u = 0.1 * sizes * rng.standard_normal(self.N)
            J = self._to_sparse(*self._slopes_at(t)) + self._to_sparse(k, i, v * u[j])
            gap = J - self._to_sparse(*self._in_order(one.entries(u, t) for one in self.joints))
            phi = self._by_tables(u, t) - self._by_joints(u, t)
            if not (np.all(np.abs(phi) <= 1e-9 * of_equations)
                    and (abs(gap) @ sizes <= 1e-9 * (abs(J) @ sizes)).all()):
                return False
        d = everywhere(sizes)
        return is_table(self._by_joints, d, lambda s, t: self._by_tables(s * d, t), of_equations)

    @cached_property
    def _still(self):
        """Phi in the reference configuration, and whether its Jacobian there is constant."""
        return self.offsets(np.zeros(1))[0], not any(j.turning for j in self.joints)

    def offsets(self, times: Array) -> Array:
        """Phi in the reference configuration at times (n,), shape (n, m)."""
        return np.hstack([np.zeros((len(times), 0)),
                          *(joint.offset(times, self.N) for joint in self.joints)])

    def _slopes_at(self, t):
        return self.slopes if self._still[1] else self._new_slopes(t)

    def _new_slopes(self, t):
        found = [joint.slope_entries(np.array([t]), self.N) for joint in self.joints]
        return self._in_order((rows, columns, values[0]) for rows, columns, values in found)

    @property
    def drives(self) -> bool:
        """True if a joint with multipliers depends on time."""
        return any(joint.moving for joint in self.joints)

    def full_jacobian(self, u: Array, t: float) -> Array | sparse.csr_array:
        """J = dPhi/du for all DOFs, shape (m, N); sparse unless :attr:`few`."""
        return (self.to_dense if self.few else self._to_sparse)(*self._entries(u, t))

    def to_dense(self, rows: Array, columns: Array, values: Array) -> Array:
        """A dense matrix (m, N) from its entries."""
        J = np.zeros((self.m, self.N))
        np.add.at(J, (rows, columns), values)
        return J

    def _to_sparse(self, rows: Array, columns: Array, values: Array) -> sparse.csr_array:
        return sparse.csr_array((values, (rows, columns)), shape=(self.m, self.N))

    def sparse_jacobian(self, u: Array, t: float) -> sparse.csr_array:
        """:meth:`full_jacobian` in CSR format."""
        return self._to_sparse(*self._entries(u, t))

    def jacobian_entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        """Entries of J, zero at fixed DOFs; duplicates are summed."""
        rows, columns, values = self._entries(u, t)
        return rows, columns, values * self.mask[columns]

    @cached_property
    def slopes(self) -> tuple[Array, ...]:
        """Entries of :meth:`full_jacobian` in the reference configuration at time 0."""
        return self._new_slopes(0.0)

    @cached_property
    def _at_rest(self):
        """The matrix of :attr:`slopes`, dense if it is small."""
        if not self.m:
            return np.zeros((0, self.N))
        return (self.to_dense if self.few and self.N <= DENSE else self._to_sparse)(*self.slopes)

    def _entries(self, u, t):
        """Entries of :meth:`full_jacobian`."""
        if not self.tabled:
            return self._in_order(joint.entries(u, t) for joint in self.joints)
        (k, i, j, v), slopes = self.seconds, self._slopes_at(t)
        return tuple(np.append(a, b) for a, b in zip(slopes, (k, i, v * u[j])))

    def _in_order(self, entries: Iterable[tuple]) -> tuple[Array, ...]:
        """Concatenate the entries of all joints, with row numbers of all equations."""
        first, parts = 0, []
        for joint, (rows, *others) in zip(self.joints, entries):
            parts.append((first + rows, *others))
            first += len(joint.equations)
        return _joined(parts or [_NO_ENTRIES])

    def add_custom_joints(self, what: int, t: float, u: Array, v: Array, out: Array) -> None:
        """Evaluate joints without tables for kernels; results are added to ``out``."""
        # ``what`` is 0: Phi, 1: J v, 2: J^T v with v (m,), 3: J, 4: v^T Phi'' v. For the
        # energy-momentum scheme, 5: the discrete gradient from v to u, 6: the force of impulses,
        # with u at the end of the step and v = (v0, v1, u0, impulses). 7 and 8 are 0 and 1 of the
        # joints that depend on time, with zeros for the others.
        N, first = self.N, 0
        if what == 0:
            out[:] = self.constraint(u, t)
        elif what == 1:
            out += self.full_jacobian(u, t) @ v
        elif what == 2:
            out += v @ self.full_jacobian(u, t)
        elif what == 3:
            out += dense(self.full_jacobian(u, t)).ravel()
        elif what == 5:
            out += self.to_dense(*self._in_order(
                joint.mean_entries(v, u, t) for joint in self.joints)).ravel()
        elif what == 6:
            v0, v1, u0 = v[:3 * N].reshape(3, N)
            out += self.mean_turning(u0, u, v0, v1, t, v[3 * N:])
        for joint in self.joints if what in (4, 7, 8) else ():
            part = out[first:first + len(joint.equations)]
            first += len(part)
            if what == 4:
                part += joint.quadratic(u, t, v)
            elif joint.moving and what == 7:
                part += joint.value(u, t)
            elif joint.moving:
                rows, columns, values = joint.entries(u, t)
                part += np.bincount(rows, values * v[columns], len(part))

    def curvature(self, u: Array, t: float, multipliers: Array) -> sparse.csr_matrix:
        """sum_k multipliers[k] d^2 Phi_k / du^2 between free DOFs, sparse (N, N)."""
        i, j, v = self.curvature_entries(u, t, multipliers)
        return sparse.csr_matrix((v, (i, j)), shape=(self.N, self.N))

    def curvature_entries(self, u: Array, t: float | None,
                          multipliers: Array) -> tuple[Array, Array, Array]:
        """Entries of :meth:`curvature`."""
        if self.tabled:
            k, i, j, v = self.seconds
            v = multipliers[k] * v
        else:
            parts = [joint.curvature(u, t, part)
                     for joint, part in zip(self.joints, self.multipliers_of(multipliers))]
            i, j, v = _joined([part for part in parts if part is not None] or [_NO_ENTRIES])
        return i, j, v * (self.free[i] & self.free[j])

    def mean_turning(self, u0: Array, u1: Array, v0: Array, v1: Array, t: float,
                     multipliers: Array) -> Array:
        """The correction of conserving steps for joints that are not quadratic, shape (N,)."""
        parts = zip(self.joints, self.multipliers_of(multipliers))
        return sum((joint.mean_turning(u0, u1, v0, v1, t, part) for joint, part in parts),
                   np.zeros(self.N))

    @cached_property
    def _limited(self) -> list[BoundConstraint]:
        """Joints with a limited range."""
        return [joint for joint in self.joints if type(joint).lost is not BoundConstraint.lost]

    def lost(self, u: Array) -> str:
        """Why a joint cannot act in a converged state, or ""."""
        for joint, out, size in self._unasked:
            # redundant equations are opened
            if (np.abs(joint.value(u, 0.0)[out]) > 1e-5 * size).any():
                return f"{joint!r} contradicts the other joints in this position"
        return next(filter(None, (joint.lost(u) for joint in self._limited)), "")

    def first_lost(self, rows: Array) -> tuple[int, str]:
        """How many of consecutive states (n, N) the joints allow, and why not the next one."""
        for k, u in enumerate(rows if self._limited or self._unasked else ()):
            text = self.lost(u)
            if text:
                return k, text
        return len(rows), ""

    def multipliers_of(self, multipliers: Array) -> list[Array]:
        """Split the multipliers by joint."""
        if not self.joints:
            return []
        ends = np.cumsum([len(joint.equations) for joint in self.joints])[:-1]
        return np.split(multipliers, ends)

    def joint_force(self, joint: BoundConstraint, multipliers: Array, reaction: Array, u: Array,
                    t: float) -> Array:
        """Force of a joint on its first beam, one number for each of ``joint.equations``."""
        # ``reaction`` (N,) are the forces of the supports.
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
        rows, dofs, factors = self._places(joint)
        return reaction[dofs] / factors if rows is None else -multipliers[rows]

    def driven(self, joint: BoundConstraint, change: Array) -> tuple[Array, Array]:
        """Changes of J u (m,) and of fixed displacements (N,) for a change of Phi of a joint."""
        of_rows, fixed, (rows, dofs, factors) = (
            np.zeros(self.m), np.zeros(self.N), self._places(joint))
        if rows is None:
            fixed[dofs] = -change / factors
        else:
            of_rows[rows] = -change
        return of_rows, fixed

    def _places(self, joint):
        """Rows of the equations of a joint, or None, the DOFs that it fixes, and their factors."""
        end = 0
        for known in self.joints:
            first, end = end, end + len(known.equations)
            if known.same(joint):
                return slice(first, end), None, None
        for known, first, factors in self._fixing:
            if known.same(joint):
                return None, self.fixed[first:first + len(factors)], factors
        raise SupportError(f"{shown(joint)} is not a joint of this scene")

    def force_on(self, selected: Array, multipliers: Array, rest: Array) -> tuple[Array, Array]:
        """Support-like forces (N,), of constant joints of selected DOFs alone, and which DOFs they
        have. As the force of fixed DOFs, that of these joints balances the ``rest`` (N,) of all
        forces that a scheme with the equations of motion inside of steps leaves at their end."""
        force, touched, zero = np.zeros(self.N), np.zeros(self.N, dtype=bool), np.zeros(self.N)
        found = []
        for joint, part in zip(self.joints, self.multipliers_of(multipliers)):
            if joint.constant:
                rows, columns, values = joint.entries(zero, 0.0)
                if selected[columns].all():
                    np.subtract.at(force, columns, values * part[rows])
                    touched[columns] = True
                    found.append(joint.jacobian(zero, 0.0))
        at = np.flatnonzero(touched & self.free)
        if len(at):
            J, sizes = np.concatenate(found)[:, at], self.coordinate_sizes[at]
            force[at] += J.T @ np.linalg.lstsq((J * sizes).T, rest[at] * sizes, rcond=None)[0]
        return force, touched

    # independence and rigid motions

    def require_motion(self) -> None:
        """Raise InputError if a settlement is proportional to the load factor of statics."""
        if self.frame is not None and np.any(self.frame.settlements.numbers):
            node, k = np.argwhere(self.frame.settlements.numbers)[0]
            value, name = self.frame.settlements.numbers[node, k], COMPONENTS[k]
            raise InputError(
                f"node {node} is displaced by {name}={value:g}, in proportion to the load of "
                "a static solution. In a motion it has to be a function of time, such as "
                f"frame.settle({node}, {name}=lambda t: {value:g} * min(t, 1.0)), or lambda t: "
                f"{value:g} if the motion starts from the displaced static state")

    def _dependent(self):
        """The first equation that depends on those before it at free DOFs, or None; with its
        residual when those before it are met."""
        # Rows are orthogonalised by QR in order, in groups without a common column.
        J, first = self._at_rest * self.coordinate_sizes, None
        size = np.sqrt((J * J).sum(axis=1))
        for rows, _, A in groups(J * self.free):
            if first is not None and rows[0] > first[0]:
                continue
            R = scipy.linalg.lapack.dgeqrf(A.T)[0] if A.size else A.T  # in the upper triangle
            rest, k = np.zeros(len(rows)), min(R.shape)
            rest[:k] = np.abs(R.diagonal())
            small = rest <= DEPENDENT * size[rows]
            k = int(small.argmax())
            if small[k] and (first is None or rows[k] < first[0]):
                gap = self.constraint(np.zeros(self.N), 0.0)[rows]
                known = scipy.linalg.solve_triangular(R[:k, :k], gap[:k], trans="T")
                first = int(rows[k]), float(gap[k] - R[:k, k] @ known)
        return first

    def require_independent_joints(self) -> None:
        """Raise SupportError if equations of joints and supports are dependent."""
        if self._independent or not self.joints or self.condensable:
            return
        found = self._dependent()
        self._independent = found is None
        if found is None:
            return
        k, gap = found
        joint, equation = [(joint, name) for joint in self.joints for name in joint.equations][k]
        size = self.equation_sizes(*self.slopes)[k]
        kind = "repeats" if abs(gap) <= 1e-9 * size else "contradicts"
        if self.passing and kind == "repeats":
            raise SupportError(f"{joint!r}, equation {equation!r}, depends in this position on "
                               "the supports and the joints before it: start from another "
                               "position, or solve in time with scene.integrate")
        raise SupportError(f"{joint!r}, equation {equation!r}, {kind} what the supports and the "
                           "joints before it prescribe already: remove one of them")

    @property
    def few(self) -> bool:
        """True if Jacobians are dense matrices."""
        return self.frame is None and self.m <= FEW

    @cached_property
    def frame(self) -> Nodes | None:
        """The joint of the nodes of a frame, or None."""
        return next((joint for joint in self.joints if isinstance(joint, Nodes)), None)

    @property
    def condensable(self) -> bool:
        """True if the nodes of a frame are the only constraints."""
        return self.frame is not None and len(self.joints) == 1 and not len(self.fixed)

    def free_rigid_motions(self) -> list[str]:
        """Descriptions of unconstrained rigid motions."""
        return free_rigid_motions(self)

    def require_supports(self) -> None:
        """Raise SupportError if a rigid motion is unconstrained, or joints are dependent."""
        self.require_independent_joints()
        refuse(self.missing_supports, self.missing_supports, error=SupportError)

    @cached_property
    def missing_supports(self) -> str:
        """The unconstrained rigid motions and a support to add, in words; or ""."""
        free = self.free_rigid_motions()
        if not free:
            return ""
        return ("the supports leave rigid motions free: " + first_of(free, "; ")
                + (", along which the springs have no stiffness before the load"
                   if self._stiffness is not None else "")
                + f". Add a support, for example {advice(self)}, or solve in time with "
                "scene.integrate")

    @cached_property
    def adrift(self) -> bool:
        """True if a translation of the whole scene is unconstrained."""
        if self._stiffness is not None or not self.missing_supports:
            return False
        whole = np.concatenate([member.rigid_motions()[:, :2] for member in self.members])
        held = np.concatenate([whole[self.fixed], self._at_rest @ whole])
        sigma = np.linalg.svd(held, compute_uv=False)
        return len(sigma) < 2 or sigma[1] <= FREE * sigma[0]


def _joined(parts):
    """Concatenate rows, columns and values of several tables."""
    return parts[0] if len(parts) == 1 else tuple(map(np.concatenate, zip(*parts)))
