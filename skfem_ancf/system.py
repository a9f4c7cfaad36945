"""A scene in numbers: free coordinates, loads, joints, residual, tangent and its solution."""

import logging
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .checks import Screen
from .constraints import first_dependent, null_space, unit_rows
from .errors import InputError, SupportError, shown
from .joints.base import same_joint
from .linalg import (INACCURATE, BandMatrix, BorderedMatrix, border, border_inertia,
                     border_negative, columns_product, dense, hold)
from .pickling import functions_of, require_picklable
from .points import Points

logger = logging.getLogger(__name__)
_NONE = np.zeros(0)
#: Columns of a border above which sparse LU is faster.
WIDE_BORDER = 96


class System:
    """The discrete equations of a scene.

    The unknown is the displacement ``u`` of all coordinates from the stress-free state, beam
    after beam, and a multiplier for each equation of a joint:
    ``M u'' + f(u) + J^T lambda = load Q(u)``, ``Phi(u, t) = 0``, ``J = dPhi / du``.

    Parameters
    ----------
    beams
        The beams, in order.
    loads
        The loads of all beams.
    fixed, values
        Numbers of the fixed coordinates and their displacements at full load.
    joints
        Joints, already bound.
    """

    def __init__(self, beams, loads, fixed, values, joints=()):
        self._given = tuple(beams), tuple(loads), fixed, values, tuple(joints)
        self.beams, self.loads = list(beams), list(loads)
        self.offsets = np.concatenate([[0], np.cumsum([b.N for b in self.beams])])
        self.N = int(self.offsets[-1])
        self.slices = [slice(int(a), int(b)) for a, b in zip(self.offsets[:-1], self.offsets[1:])]
        self._supported = False
        self._index = {id(b): k for k, b in enumerate(self.beams)}
        self._eliminate(fixed, values, joints)
        self.symmetric = all(load.symmetric for load in self.loads)
        self.size = float(sum(b.mesh.lengths.sum() for b in self.beams))
        self.constant_force, self._varying = np.zeros(self.N), []
        for load in self.loads:
            if load.constant and load.amplitude is None:
                self.constant_force[self.of(load)] += load.force(None)
            else:
                self._varying.append(load)

    @cached_property
    def points(self):
        """What finds material points, a :class:`~skfem_ancf.points.Points`."""
        return Points(self.beams, self.slices)

    def __getstate__(self):
        """What it was made of: work arrays and factors are made again."""
        require_picklable(functions_of([*self.loads, *self.all_joints]))
        return self._given

    def __setstate__(self, given):
        self.__init__(*given)

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self  # it is the same equations, however many states have them

    def _eliminate(self, fixed, values, joints):
        """Sort joints that only fix coordinates to the supports, the others to the multipliers."""
        fixed, values = np.array(fixed, dtype=np.int64), np.array(values, dtype=float)
        self.all_joints, self.joints, self._fixing, zero = list(joints), [], [], np.zeros(self.N)
        for joint in joints:
            rows = joint.jacobian(zero, 0.0)
            dofs = np.argmax(np.abs(rows), axis=1)
            if joint.constant and np.all(np.sum(rows != 0, axis=1) == 1):
                clash = np.intersect1d(dofs, fixed)
                if len(clash):
                    raise SupportError(
                        f"{joint!r} prescribes {self.describe_dof(clash[0])}, which a support or "
                        "another joint fixes already: remove one of them, as the second of two "
                        "clamps at one place")
                self._fixing.append((joint, len(fixed), rows[np.arange(len(dofs)), dofs]))
                fixed, values = np.append(fixed, dofs), np.append(values, np.zeros(len(dofs)))
            else:
                self.joints.append(joint)
        self.fixed, self._values, self._held = fixed, values, np.zeros(len(fixed))
        self._moving = [item for item in self._fixing if item[0].moving]
        for joint, first, factors in self._fixing:
            if not joint.moving:
                phi = joint.value(zero, 0.0)
                self._held[first:first + len(factors)] = -phi / factors
        self.free = np.ones(self.N, dtype=bool)
        self.free[fixed] = False
        self.mask = self.free.astype(float)
        self.m = sum(len(joint.equations) for joint in self.joints)

    def describe_dof(self, k):
        """What coordinate number k is, in words."""
        b = int(np.searchsorted(self.offsets, k, side="right")) - 1
        beam, node = self.beams[b], (k - self.offsets[b]) // self.beams[b].nd
        who = "" if len(self.beams) == 1 else f" of beam {beam.name or b}"
        return f"{beam.dofnames[(k - self.offsets[b]) % beam.nd]} of node {node}{who}"

    def of(self, load_or_beam):
        """The slice of the coordinates that a load or a beam has."""
        return self.slices[self._index[id(getattr(load_or_beam, "beam", load_or_beam))]]

    # supports and joints

    def values(self, load, t=None):
        """Displacements of the fixed coordinates at a load factor and a time."""
        values = load * self._values + self._held
        for joint, first, factors in self._moving:
            phi = joint.offset(np.array([load if t is None else t]), self.N)[0]
            values[first:first + len(factors)] = -phi / factors
        return values

    def values_at(self, times):
        """Displacements of the fixed coordinates at full load, at times (n,): (n, nfixed)."""
        values = np.tile(self._values + self._held, (len(times), 1))
        for joint, first, factors in self._moving:
            values[:, first:first + len(factors)] = -joint.offset(times, self.N) / factors
        return values

    @property
    def moves(self):
        """True if a fixed coordinate has a displacement that is not zero, now or later."""
        return bool(self._moving) or bool(np.any(self._values + self._held))

    def constraint(self, u, t):
        """Phi of the joints with multipliers, shape (m,)."""
        if not self.joints:
            return np.zeros(0)
        return np.concatenate([joint.value(u, t) for joint in self.joints])

    @property
    def drives(self):
        """True if a joint with multipliers depends on time."""
        return any(joint.moving for joint in self.joints)

    def full_jacobian(self, u, t):
        """Derivative of :meth:`constraint` by all coordinates, shape (m, N).

        Sparse where the multipliers are too many for a border.
        """
        if not self.bordered:
            return self.sparse_jacobian(u, t)
        J = np.zeros((self.m, self.N))
        rows, columns, values = self._entries(u, t)
        np.add.at(J, (rows, columns), values)
        return J

    def sparse_jacobian(self, u, t):
        """As :meth:`full_jacobian`, as a scipy.sparse array in CSR format."""
        rows, columns, values = self._entries(u, t)
        return sparse.csr_array((values, (rows, columns)), shape=(self.m, self.N))

    def _entries(self, u, t):
        """Rows, columns and values of :meth:`full_jacobian`."""
        first, parts = 0, [(np.zeros(0, dtype=int), np.zeros(0, dtype=int), _NONE)]
        for joint in self.joints:
            rows, columns, values = joint.entries(u, t)
            parts.append((first + rows, columns, values))
            first += len(joint.equations)
        return tuple(np.concatenate(column) for column in zip(*parts))

    def jacobian(self, u, t):
        """As :meth:`full_jacobian`, zero at fixed coordinates."""
        J = self.full_jacobian(u, t)
        if not self.bordered:
            J.data *= self.mask[J.indices]
            return J
        J[:, self.fixed] = 0.0
        return J

    def quadratic(self, u, t, v):
        """The second derivative of :meth:`constraint` in the direction v, shape (m,)."""
        out = []
        for joint in self.joints:
            for unit in np.eye(len(joint.equations)):
                second = joint.curvature(u, t, unit)
                out.append(0.0 if second is None else second[2] @ (v[second[0]] * v[second[1]]))
        return np.array(out)

    def curvature(self, u, t, multipliers):
        """sum_k multipliers[k] d^2 Phi_k / du^2 at free coordinates, sparse, shape (N, N)."""
        i, j, v = self._curvature(u, t, multipliers)
        v = v * (self.free[i] & self.free[j])
        return sparse.csr_matrix((v, (i, j)), shape=(self.N, self.N))

    def _curvature(self, u, t, multipliers):
        parts = [joint.curvature(u, t, part)
                 for joint, part in zip(self.joints, self.multipliers_of(multipliers))]
        parts = [part for part in parts if part is not None]
        if not parts:
            none = np.zeros(0, dtype=int)
            return none, none, np.zeros(0)
        return tuple(np.concatenate(column) for column in zip(*parts))

    def curvature_times(self, u, t, multipliers, v):
        """:meth:`curvature` times a vector (N,)."""
        i, j, values = self._curvature(u, t, multipliers)
        return np.bincount(i, values * v[j], self.N)

    def multipliers_of(self, multipliers):
        """The multipliers joint by joint: a list in the order of :attr:`joints`."""
        if not self.joints:
            return []
        ends = np.cumsum([len(joint.equations) for joint in self.joints])[:-1]
        return np.split(multipliers, ends)

    def joint_force(self, joint, multipliers, reaction):
        """What a joint does to its first beam, in the order of ``joint.equations``."""
        for known, part in zip(self.joints, self.multipliers_of(multipliers)):
            if same_joint(known, joint):
                return -part
        for known, first, factors in self._fixing:
            if same_joint(known, joint):
                return reaction[self.fixed[first:first + len(factors)]] / factors
        raise SupportError(f"{shown(joint)} is not a joint of this scene")

    def require_independent_joints(self):
        """Raise SupportError if joints repeat or contradict each other or the supports."""
        if not self.joints:
            return
        zero = np.zeros(self.N)
        found = first_dependent(self.sparse_jacobian(zero, 0.0), self.free,
                                self.constraint(zero, 0.0))
        if found is None:
            return
        k, gap = found
        joint, equation = [(joint, name) for joint in self.joints for name in joint.equations][k]
        kind = "repeats" if abs(gap) <= 1e-9 * self.size else "contradicts"
        raise SupportError(f"{joint!r}, equation {equation!r}, {kind} what the supports and the "
                           "joints before it hold already: remove one of them")

    # forces and energies

    def external_force(self, u, t=None):
        """The force of all loads at full size, shape (N,); at time ``t`` if it is given."""
        if not self._varying:
            return self.constant_force
        out = self.constant_force.copy()
        for load in self._varying:
            s = self.of(load)
            out[s] += load.factor(t) * load.force(u[s])
        return out

    def _require_coordinates(self, u):
        if u.shape != (self.N,):
            raise InputError(f"the displacement of the scene's coordinates has shape ({self.N},), "
                             f"got {u.shape}; the state of another mesh?")

    def internal_force(self, u):
        """The internal force, shape (N,)."""
        self._require_coordinates(u)
        return np.concatenate([b.kernel.force(u[s]) for b, s in zip(self.beams, self.slices)])

    def strains(self, u):
        """Strains at the integration points, for :meth:`mean_internal_force`."""
        return [b.kernel.strains(u[s]) for b, s in zip(self.beams, self.slices)]

    def mean_internal_force(self, u0, u1, strains0):
        """The internal force whose work from u0 to u1 is the change of the strain energy."""
        return np.concatenate([b.kernel.mean_force(u0[s], u1[s], e)
                               for b, s, e in zip(self.beams, self.slices, strains0)])

    def mean_external_force(self, u0, u1, t0, t1):
        """The loads' mean over a step from u0 to u1."""
        if not self._varying:
            return self.constant_force
        out = self.constant_force.copy()
        for load in self._varying:
            s = self.of(load)
            out[s] += load.factor(0.5 * (t0 + t1)) * load.mean_force(u0[s], u1[s])
        return out

    def momentum(self, v):
        """Linear momentum of the coordinates' velocities, shape (2,)."""
        p = self.mass.multiply(v)
        total = np.zeros(2)
        for beam, s in zip(self.beams, self.slices):  # a unit translation moves every r by one
            total += p[s].reshape(-1, beam.nd)[:, :2].sum(axis=0)
        return total

    def angular_momentum(self, u, v):
        """Angular momentum about the origin."""
        p, total = self.mass.multiply(v), 0.0
        for beam, s in zip(self.beams, self.slices):
            q, pb = (beam.q0 + u[s]).reshape(-1, 2), p[s].reshape(-1, 2)
            total += np.sum(q[:, 0] * pb[:, 1] - q[:, 1] * pb[:, 0])
        return float(total)

    def strain_energy(self, u):
        """Strain energy of all beams."""
        return float(sum(b.kernel.energy(u[s]) for b, s in zip(self.beams, self.slices)))

    def load_potential(self, u, t=None):
        """Potential of the loads; loads without one count as zero."""
        return float(sum(load.factor(t) * (load.potential(u[self.of(load)]) or 0.0)
                         for load in self.loads))

    @cached_property
    def stiffness_scale(self):
        """eps times the square root of modulus times volume: the round-off of strains of 1."""
        total = sum(b.kernel.volume * b.material.E for b in self.beams)
        return np.finfo(float).eps * np.sqrt(total)

    @cached_property
    def work_noise(self):
        """Round-off of a correction's work, as a square root.

        A displacement of the scene's size is known to eps times that size, its gradient in an
        element to that over the element's length.
        """
        total = sum(b.material.E * b.width * b.mesh.height * np.sum(1.0 / b.mesh.lengths)
                    for b in self.beams)
        return np.finfo(float).eps * self.size * np.sqrt(total)

    @cached_property
    def noise(self):
        """How much larger the round-off of a residual is than that of the strains."""
        return np.sqrt(max(b.nd for b in self.beams))

    def inverted(self, u):
        """True if a body is turned inside out somewhere."""
        return any(b.kernel.inverted(u[s]) for b, s in zip(self.beams, self.slices))

    @cached_property
    def structure(self):
        """The tables for whole compiled iterations, or None where not all is compiled."""
        if any(beam.kernel.compiled is None for beam in self.beams):
            return None
        from .compiled.structure import structure_of
        return structure_of(self)

    @cached_property
    def screen(self):
        """What tells whether a state may be out of the range of laws and meshes."""
        return Screen(self.beams)

    @property
    def constant_loads(self):
        """True if no load depends on displacement or time."""
        return not self._varying

    # mass

    @cached_property
    def mass(self):
        """The mass matrix, a :class:`~skfem_ancf.linalg.BandMatrix`; assembled once."""
        M = self.new_band()
        for beam, offset in zip(self.beams, self.offsets):
            for part in beam.kernel.chunks():
                M.add_elements(beam.mass_elements(part), int(offset), beam.nd, beam.mesh.t[0, part])
        return M

    @cached_property
    def mass_factors(self):
        """The factors of the mass matrix with its supports fixed; made once."""
        M = self.new_band().combine(1.0, self.mass, 0.0, self.mass)
        M.fix(self.fixed_positions)
        return M.factorize()

    def solve_mass(self, b, u=None, t=0.0, rate=None):
        """x and l with M x + J^T l = b at free coordinates and J x = rate; x is zero at fixed ones.

        Parameters
        ----------
        b
            Shape (N,); its fixed coordinates are ignored.
        u, t
            Where J is taken.
        rate
            Shape (m,).
        """
        x = self.mass_factors.solve(b * self.free)
        if not self.joints:
            return x, np.zeros(0)
        J = self.jacobian(u, t)
        Y = self.mass_factors.solve(dense(J.T))
        multipliers = np.linalg.solve(J @ Y, J @ x - rate)
        return x - Y @ multipliers, multipliers

    # tangent

    def new_band(self):
        """An empty band matrix of the scene."""
        return BandMatrix(self.N, self.bandwidth, self.symmetric)

    @property
    def bandwidth(self):
        """Subdiagonals of the tangent and of the mass matrix."""
        return max(2 * b.nd for b in self.beams) - 1

    @cached_property
    def K(self):
        """The tangent, filled by :meth:`assemble`."""
        return self.new_band()

    @cached_property
    def fixed_positions(self):
        """Where the fixed rows and columns are stored."""
        return self.K.fixed_positions(self.fixed)

    def assemble(self, u, load=1.0, carried=None, geometric=True, t=None):
        """Internal force, and the tangent of the residual into :attr:`K`.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        load
            Factor on the loads, which may have a stiffness.
        carried
            Stresses for the geometric part, as :meth:`stress_step` returns them.
        geometric
            Include the geometric part.
        t
            Time, for loads with an amplitude.

        Returns
        -------
        force, evaluations
            The internal force (N,), and the pieces that :meth:`stress_step` takes.
        """
        self._require_coordinates(u)
        self.K.clear()
        force = np.zeros(self.N)
        evaluations = []
        for k, (beam, s) in enumerate(zip(self.beams, self.slices)):
            evaluations.append((s, beam.kernel.assemble(
                u[s], self.K, s.start, force[s], None if carried is None else carried[k],
                geometric)))
        for item in self._varying:
            if item.constant:
                continue
            i, j, v = item.stiffness(u[self.of(item)])
            first = self.of(item).start
            self.K.add(first + i, first + j, -load * item.factor(t) * v)
        return force, evaluations

    @staticmethod
    def stress_step(evaluations, du):
        """Stresses carried to ``u + du`` by linearisation, for each beam."""
        return [assembly.carry(du[s]) for s, assembly in evaluations]

    def multiply(self, v):
        """The assembled tangent times a vector, before :meth:`factorize`."""
        return self.K.multiply(v)

    @cached_property
    def springs(self):
        """Coordinates that hold the beams which their own supports leave free to move.

        The positions of two nodes far apart, for each such beam.
        """
        out = []
        for beam, s in zip(self.beams, self.slices):
            held = self.fixed[(self.fixed >= s.start) & (self.fixed < s.stop)] - s.start
            motions = unit_rows(beam.rigid_motions()[held] / [1.0, 1.0, self.size])
            if len(motions) and np.linalg.matrix_rank(motions, 1e-9) == 3:
                continue
            p = beam.mesh.p
            far = int(np.argmax(np.sum((p - p[:, :1]) ** 2, axis=0)))
            out += [s.start + node * beam.nd + k for node in (0, far) for k in range(2)]
        out = np.array(out, dtype=int)
        return out[self.free[out]]

    @property
    def bordered(self):
        """True if the multipliers are few enough for a border about the band matrix."""
        return self.m + len(self.springs) <= WIDE_BORDER

    def factorize(self, u=None, t=0.0, multipliers=None):
        """Fix the supports in the tangent and factorise it, with the joints where there are any."""
        self.K.fix(self.fixed_positions)
        if not self.joints:
            self.K.factorize()
            return
        self._J = self.jacobian(u, t)
        i, j, v = self._curvature(u, t, multipliers)
        v = v * (self.free[i] & self.free[j])
        self._outside, self._sparse = (i, j, v), None
        if self.bordered:
            self._factors = BorderedMatrix(self.K, self._J, i, j, v, self.springs)
        else:
            self._sparse = self._sparse_factors(
                self.K.tocsc() + sparse.csc_matrix((v, (i, j)), shape=(self.N, self.N)))

    def inertia(self):
        """Signs of the eigenvalues of the tangent that :meth:`factorize` has factorised.

        Of the free coordinates, and with joints on the tangent space of their equations: how many
        directions there are in which the scene gives way. Of a tangent that is not symmetric they
        are those of its symmetric part.

        Returns
        -------
        Inertia
            With ``negative``, the number of negative eigenvalues, and ``singular``, whether one is
            zero to round-off.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(5),
        ...                    StVenantKirchhoff(2e8, 0.3), width=0.01)).pin("left").pin("right")
        >>> system = scene.system
        >>> u = np.zeros(system.N)
        >>> u.reshape(-1, 6)[:, 0] = [0, -1e-4, -2e-4]  # compressed by 2.4 times Euler's load
        >>> u.reshape(-1, 6)[:, 2] = -2e-4
        >>> _ = system.assemble(u)
        >>> system.factorize(u)
        >>> system.inertia()
        Inertia(negative=1, singular=False)
        """
        if not self.joints:
            K = self.K if self.symmetric else self.K.symmetric_part()
            return K.inertia()
        if self.bordered:
            return self._factors.inertia()
        K = self.K.symmetric_part()
        picked, S = hold(K, *self._outside, self.springs)
        return border_inertia(K, picked, S, dense(self._J))

    def stays(self, u, t, multipliers):
        """True if the factors left by an iteration say that no direction gives way.

        Those of its last tangent, which is that of the solution but for the last correction.

        Parameters
        ----------
        u, t, multipliers
            The solution.
        """
        K = self.K
        if not K.definite or (self.joints and not self.bordered):
            return False
        if not self.joints:
            return True
        K.to_cholesky()
        J = self.jacobian(u, t)
        i, j, v = self._curvature(u, t, multipliers)
        v = v * (self.free[i] & self.free[j])
        picked, S = border(K.bandwidth, i, j, v, self.springs,
                           0.5 * K.factored_diagonal(self.springs))
        return border_negative(0, columns_product(K, picked, J), S, self.m)[0] == 0

    def determinant_sign(self):
        """The sign of the determinant of what :meth:`inertia` counts: 1 or -1.

        -1 is an odd number of negative eigenvalues, of a tangent that is not symmetric too.
        """
        if not self.joints:
            return self.K.determinant_sign()
        if self.bordered:
            return self._factors.determinant_sign()
        free = np.nonzero(self.free)[0]
        i, j, v = self._outside
        K = self.K.tocsc() + sparse.csc_matrix((v, (i, j)), shape=(self.N, self.N))
        J = sparse.csr_matrix(self._J[:, free] * self._weight)
        A = sparse.bmat([[K[free][:, free], J.T], [J, None]]).toarray()
        return int(np.linalg.slogdet(A)[0]) * (-1) ** self.m

    def _sparse_factors(self, K):
        self._weight = float(np.mean(np.abs(K.diagonal()[self.free])))
        J = sparse.csr_matrix(self._J * self._weight)
        return splu(sparse.bmat([[K, J.T], [J, None]], format="csc"))

    def solve(self, residual, phi=None):
        """Solve with the factors.

        Parameters
        ----------
        residual
            Shape (N,); its fixed coordinates are ignored.
        phi
            What the constraints should change by, shape (m,), where there are joints.

        Returns
        -------
        du, multipliers
            The increments; the second is empty without joints.
        """
        b = residual * self.mask
        if not self.joints:
            return self.K.solve(b), _NONE
        if self._sparse is None:
            x, multipliers, error = self._factors.solve(b, phi)
            if error < INACCURATE:
                return x, multipliers
            logger.debug("border inaccurate by %.3g: sparse LU", error)
            self._sparse = self._sparse_factors(self._factors.tocsc())
        x = self._sparse.solve(np.append(b, self._weight * phi))
        return x[:self.N], self._weight * x[self.N:]

    # rigid motions

    def free_rigid_motions(self):
        """Descriptions of the rigid motions that nothing holds, one string each."""
        sizes = [float(beam.mesh.lengths.sum()) for beam in self.beams]
        values = np.concatenate([beam.rigid_motions() / [1.0, 1.0, size]
                                 for beam, size in zip(self.beams, sizes)])
        of_beam = np.repeat(np.arange(len(self.beams)), np.diff(self.offsets))
        motions = sparse.csr_array(
            (values.ravel(), (3 * of_beam[:, None] + np.arange(3)).ravel(),
             3 * np.arange(self.N + 1)), shape=(self.N, 3 * len(self.beams)))
        held = sparse.vstack([motions[self.fixed],
                              self.sparse_jacobian(np.zeros(self.N), 0.0) @ motions])
        return [self._describe(v, sizes) for v in null_space(unit_rows(held))]

    def _describe(self, v, sizes):
        parts = []
        for k, beam in enumerate(self.beams):
            a, b, c = v[3 * k:3 * k + 3]
            who = "" if len(self.beams) == 1 else f" of beam {beam.name or k}"
            if max(abs(a), abs(b), abs(c)) < 1e-8:
                continue
            if abs(c) < 1e-8:
                d = np.round(np.array([a, b]) / np.hypot(a, b), 8)
                d = (d if d[np.argmax(np.abs(d))] > 0 else -d) + 0.0  # no -0
                parts.append(f"translation along ({d[0]:.3g}, {d[1]:.3g}){who}")
            else:
                x = beam.origin + np.array([-b, a]) * sizes[k] / c
                x = np.where(np.abs(x) < 1e-9 * sizes[k], 0.0, x)
                parts.append(f"rotation about ({x[0]:.4g}, {x[1]:.4g}){who}")
        return " with ".join(parts)

    def require_supports(self):
        """Raise SupportError if a rigid motion is free, or joints are not independent."""
        if self._supported:  # nothing of it changes in the life of a system
            return
        self.require_independent_joints()
        free = self.free_rigid_motions()
        if free:
            raise SupportError(
                "the supports leave rigid motions free: " + "; ".join(free)
                + ". Add a support, for example scene.clamp('left'), or solve in time with "
                "scene.integrate")
        self._supported = True
