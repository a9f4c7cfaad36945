"""The tables of a scene, for whole compiled iterations and time steps."""

from functools import cached_property

import numpy as np
from scipy import sparse

from ..linalg import INACCURATE
from ..loads import DeadLoad, EndMoment
from ..sampling import sample
from .band import factorize
from .body import append, new_list
from .equilibrium import equilibrium


class Structure:
    """A scene in the tables that the compiled loops take; :func:`structure_of` makes it.

    Attributes
    ----------
    cables, beams, moments, joints
        As :mod:`~skfem_ancf.compiled.body`, :mod:`~skfem_ancf.compiled.moments` and
        :mod:`~skfem_ancf.compiled.constraints` say; None where there are none.
    vectors
        The loads of constant direction, shape (k, N): the first are all those without an
        amplitude together.
    """

    def __init__(self, system):
        self.system = system
        cables = [(p, s) for b, s in zip(system.beams, system.slices)
                  for p in b.kernel.compiled.packs if b.kernel.compiled.cable]
        beams = [(p, s) for b, s in zip(system.beams, system.slices)
                 for p in b.kernel.compiled.packs if not b.kernel.compiled.cable]
        self._many = len(cables) + len(beams) > 1
        self.cables, self.beams = self._packs(cables), self._packs(beams)
        self.shapes = [[shape for b in system.beams for shape in b.kernel.compiled.shapes
                        if b.kernel.compiled.cable == cable] for cable in (True, False)]
        varying = [load for load in system.loads if load.amplitude is not None]
        self._amplitudes = [load for load in varying if isinstance(load, DeadLoad)]
        self.vectors = np.zeros((1 + len(self._amplitudes), system.N))
        self.vectors[0] = system.constant_force
        for row, load in zip(self.vectors[1:], self._amplitudes):
            row[system.of(load)] = load.vector
        self._dead = self.vectors.sum(axis=0)  # in statics an amplitude counts as one
        self._turning = [load for load in system.loads if isinstance(load, EndMoment)]
        self.moments = self._moment_tables()
        self.joints = self._joint_tables()
        self.border = None if self.joints is None or not system.bordered else self._border_tables()

    def _collect(self, items):
        """A typed list; a tuple where there is one item, which Numba takes in much less time."""
        if not self._many:
            return tuple(items)
        out = new_list(items[0])
        for item in items[1:]:
            append(out, item)
        return out

    def _packs(self, packs):
        """The tables of each term of each beam, and their coordinates; None for none."""
        if not packs:
            return None
        at = np.array([(s.start, s.stop) for _, s in packs], dtype=np.int64)
        return self._collect([pack for pack, _ in packs]), at

    @cached_property
    def _work(self):
        return self.stresses(), self.stresses()

    def stresses(self):
        """Room for the stresses of cables and of beams."""
        return tuple(self._collect([np.zeros(shape) for shape in shapes]) if shapes else None
                     for shapes in self.shapes)

    def _moment_tables(self):
        n = len(self._turning)
        if not n:
            return None
        most = max(load.dofs.shape[1] for load in self._turning)
        dofs, c = np.zeros((n, 2, most), dtype=np.int64), np.zeros((n, most))
        start = np.zeros((n, 2))
        for k, load in enumerate(self._turning):
            size, first = load.dofs.shape[1], self.system.of(load).start
            dofs[k] = first + load.dofs[:, :1]  # what is left over has no weight
            dofs[k, :, :size], c[k, :size] = first + load.dofs, load.c
            start[k] = load.direction(np.zeros(load.beam.N))
        return dofs, c, start, np.array([load.M for load in self._turning], dtype=float)

    def _joint_tables(self):
        """Second derivatives, and the columns that the first has in the stress-free state."""
        s, second, first, at = self.system, [], [], 0
        if not s.joints:
            return None
        zero, probe = np.zeros(s.N), np.zeros(1)
        for joint in s.joints:
            for unit in np.eye(len(joint.equations)):
                found = joint.curvature(zero, 0.0, unit)
                if found is not None:
                    i, j, v = (np.asarray(x) for x in found)
                    keep = v != 0
                    second.append((np.full(keep.sum(), at), i[keep], j[keep], v[keep]))
                at += 1
        at = 0
        for joint in s.joints:
            columns = joint.slope(probe, s.N)[0]
            rows = np.arange(at, at + len(joint.equations))
            first.append((np.repeat(rows, len(columns)), np.tile(columns, len(rows))))
            at += len(rows)
        none = np.zeros(0)
        k, i, j, v = (np.concatenate(x) for x in zip(*second)) if second else [none] * 4
        gk, gi = (np.concatenate(x) for x in zip(*first)) if first else [none] * 2
        return (*(x.astype(np.int64) for x in (k, i, j)), v.astype(float),
                gk.astype(np.int64), gi.astype(np.int64))

    def _border_tables(self):
        """Coordinates picked, springs first, and where the second derivatives are among them."""
        s, (_, i, j, *_) = self.system, self.joints
        outside = np.abs(i - j) > s.bandwidth
        far = np.unique(np.append(i[outside], j[outside]))
        springs, ns = s.springs.astype(np.int64), len(s.springs)
        row, column = (np.where(outside, ns + np.searchsorted(far, x), -1) for x in (i, j))
        return np.append(springs, far), ns, row, column

    # what depends on time

    @property
    def motion_varies(self):
        """True if a joint moves or turns with time."""
        return any(joint.moving for joint in self.system.joints)

    @property
    def turns(self):
        """True if a joint's derivative in the stress-free state depends on time."""
        return any(joint.moving and not joint.constant for joint in self.system.joints)

    def offsets(self, times):
        """c of all joints at the times, shape (n, m)."""
        s = self.system
        return np.hstack([np.zeros((len(times), 0))] + [j.offset(times, s.N) for j in s.joints])

    def slopes(self, times):
        """g of all joints at the times, shape (n, k)."""
        s = self.system
        return np.hstack([np.zeros((len(times), 0))] + [
            j.slope(times, s.N)[1].reshape(len(times), -1) for j in s.joints])

    def factors(self, times):
        """Factors of :attr:`vectors`, shape (n, k); of one row where no load has an amplitude."""
        if not self._amplitudes:
            return np.ones((1, 1))
        return np.stack([np.ones(len(times))] + [_amplitude(load, times)
                                                 for load in self._amplitudes], axis=1)

    def moment_factors(self, times):
        """Factors of the moments, shape (n, k); of one row where none has an amplitude."""
        if all(load.amplitude is None for load in self._turning):
            return np.ones((1, len(self._turning)))
        return np.stack([_amplitude(load, times) for load in self._turning], axis=1)

    # statics

    def equilibrium(self, u, multipliers, factor, at, gap, prescribed, mixed, tol, max_iterations,
                    floor, force_floor):
        """Displacement, multipliers, force, and residuals of each iteration; or None.

        None where the iteration does not converge, or meets a tangent without factors: the
        caller's own iteration then finds out more. ``at`` is the time of the joints; the other
        arguments are those of :func:`skfem_ancf.compiled.equilibrium.equilibrium`.
        """
        s = self.system
        if s.joints and self.border is None:
            return None
        u, multipliers, f = u.copy(), multipliers.copy(), np.empty(s.N)
        record = np.zeros((max_iterations + 1, 2))
        carried, stresses = self._work
        motion = None
        if s.joints:
            at = np.array([at])
            motion = tuple(np.ascontiguousarray(x(at)[0]) for x in (self.offsets, self.slopes))
        n = equilibrium(self.cables, self.beams, self.moments, self.joints, motion, self.border,
                        mixed, u, multipliers, self._dead, factor,
                        np.full(len(self._turning), factor), gap, s.fixed, prescribed, s.mask,
                        s.K._flat, s.K._ld, s.K.bandwidth, tol, floor, force_floor, 1e-12 * s.size,
                        INACCURATE, carried, stresses, f, record)
        return None if n < 0 else (u, multipliers, f, record[:n + 1, 0], record[:n, 1])

    # mass

    def mass_factor(self):
        """The factor of the mass matrix with its supports fixed, in the same band."""
        s = self.system
        M = s.new_band().combine(1.0, s.mass, 0.0, s.mass)
        M.fix(s.fixed_positions)
        if not factorize(M._flat, M._ld, M.bandwidth, s.N):
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        return M._flat


def _amplitude(load, times):
    if load.amplitude is None:
        return np.ones(len(times))
    return sample(load.amplitude, times).reshape(len(times))


def structure_of(system):
    """The Structure of a system, or None where something in it is not compiled."""
    if not (system.symmetric and all(b.kernel.compiled is not None for b in system.beams)
            and all(type(load) in (DeadLoad, EndMoment) for load in system.loads)):
        return None
    structure = Structure(system)
    return structure if _is_quadratic(structure) else None


def _is_quadratic(structure):
    """True if the tables give Phi and its derivative: joints of others may not be quadratic."""
    s = structure.system
    if not s.joints:
        return True
    k, i, j, v, gk, gi = structure.joints
    t, start = 0.0, np.zeros(1)
    c, g = structure.offsets(start)[0], structure.slopes(start)[0]
    for u in 0.1 * np.random.default_rng(0).standard_normal((2, s.N)):
        slope = sparse.csr_array((g, (gk, gi)), shape=(s.m, s.N))
        J = slope + sparse.csr_array((v * u[j], (k, i)), shape=slope.shape)
        phi, gap = c + 0.5 * (J + slope) @ u, J - s.sparse_jacobian(u, t)
        if not (np.allclose(phi, s.constraint(u, t), rtol=0, atol=1e-9 * s.size)
                and abs(gap).max() <= 1e-9 * abs(J).max()):
            return False
    return True
