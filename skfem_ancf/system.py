"""A scene in numbers: free coordinates, loads, residual, tangent and its solution."""

import logging

import numpy as np
from scipy.linalg import blas

from .errors import SupportError
from .linalg import BandMatrix

logger = logging.getLogger(__name__)


class System:
    """The discrete equations of a scene.

    The unknown is the displacement ``u`` of all coordinates from the stress-free state, beam
    after beam.

    Parameters
    ----------
    beams
        The beams, in order.
    loads
        The loads of all beams.
    fixed, values
        Numbers of the fixed coordinates and their displacements at full load.
    """

    def __init__(self, beams, loads, fixed, values):
        self.beams, self.loads = list(beams), list(loads)
        self.offsets = np.concatenate([[0], np.cumsum([b.N for b in self.beams])])
        self.N = int(self.offsets[-1])
        self.slices = [slice(a, b) for a, b in zip(self.offsets[:-1], self.offsets[1:])]
        order = np.argsort(fixed, kind="stable")
        self.fixed, self.values = np.asarray(fixed, dtype=int)[order], np.asarray(values)[order]
        self.free = np.ones(self.N, dtype=bool)
        self.free[self.fixed] = False
        self.symmetric = all(load.symmetric for load in self.loads)
        self.K = BandMatrix(self.N, max(2 * b.nd for b in self.beams) - 1, self.symmetric)
        self._fixed_positions = self.K.fixed_positions(self.fixed)
        self._index = {id(b): k for k, b in enumerate(self.beams)}
        self._constant = np.zeros(self.N)
        self._varying = []
        for load in self.loads:
            if load.constant:
                self._constant[self.of(load)] += load.force(None)
            else:
                self._varying.append(load)

    def of(self, load_or_beam):
        """The slice of the coordinates that a load or a beam has."""
        return self.slices[self._index[id(getattr(load_or_beam, "beam", load_or_beam))]]

    def external_force(self, u):
        """The force of all loads at full size, shape (N,)."""
        if not self._varying:
            return self._constant
        out = self._constant.copy()
        for load in self._varying:
            s = self.of(load)
            out[s] += load.force(u[s])
        return out

    def internal_force(self, u):
        """The internal force, shape (N,)."""
        return np.concatenate([b.kernel.force(u[s]) for b, s in zip(self.beams, self.slices)])

    def strain_energy(self, u):
        """Strain energy of all beams."""
        return float(sum(b.kernel.energy(u[s]) for b, s in zip(self.beams, self.slices)))

    def load_potential(self, u):
        """Potential of the loads at full size, or None if one has none."""
        parts = [load.potential(u[self.of(load)]) for load in self.loads]
        return None if any(p is None for p in parts) else float(sum(parts))

    def assemble(self, u, load=1.0, carried=None, geometric=True):
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

        Returns
        -------
        force, evaluations
            The internal force (N,), and the pieces that :meth:`stress_step` takes.
        """
        self.K.clear()
        force = np.zeros(self.N)
        evaluations = []
        carried = iter(carried) if carried is not None else None
        for beam, s, offset in zip(self.beams, self.slices, self.offsets):
            kernel, ub, fb = beam.kernel, u[s], force[s]
            for part in kernel.chunks():
                e = kernel.evaluate(kernel.gather(ub, part), part, geometric=geometric,
                                    carried=None if carried is None else next(carried))
                kernel.scatter(e.force, part, fb)
                self.K.add_elements(e.tangent, int(offset), beam.nd, beam.mesh.t[0, part])
                evaluations.append((kernel, s, part, e))
        for item in self._varying:
            i, j, v = item.stiffness(u[self.of(item)])
            first = self.of(item).start
            self.K.add(first + i, first + j, -load * v)
        return force, evaluations

    @staticmethod
    def stress_step(evaluations, du):
        """Stresses carried to ``u + du``: S(eps) + D B du, one list a chunk of elements."""
        out = []
        for kernel, s, part, e in evaluations:
            increments = e.step(kernel.gather(du[s], part))
            out.append([S + (np.tensordot(t.law.D, d, 1) if hasattr(t.law, "D")
                             else np.einsum("abep,bep->aep", t.law.moduli(eps), d))
                        for t, S, eps, d in zip(e._tables, e.stresses, e.strains, increments)])
        return out

    def multiply(self, v):
        """The assembled tangent times a vector, before :meth:`factorize`."""
        K = self.K
        if self.symmetric:
            return blas.dsbmv(K.bandwidth, 1.0, K.ab, v, lower=1)
        k = K.bandwidth
        return blas.dgbmv(self.N, self.N, k, k, 1.0, K.ab[k:], v)

    def factorize(self):
        """Fix the supports in the tangent and factorise it."""
        self.K.fix(self._fixed_positions)
        self.K.factorize()

    def solve(self, residual):
        """Solve with the factors; the fixed coordinates of ``residual`` are ignored."""
        b = residual.copy()
        b[self.fixed] = 0.0
        return self.K.solve(b)

    def stiffness_scale(self):
        """Round-off floor: eps times the square root of modulus times volume."""
        total = 0.0
        for beam in self.beams:
            for t in beam.kernel.tables:
                n = beam.mesh.nelements if t.shared else 1
                total += n * float(np.sum(t.w)) * beam.material.E
        return np.finfo(float).eps * np.sqrt(total)

    # supports

    def free_rigid_motions(self):
        """Descriptions of the rigid motions that nothing holds, one string each."""
        n = 3 * len(self.beams)
        motions = np.zeros((self.N, n))
        sizes = []
        for k, (beam, s) in enumerate(zip(self.beams, self.slices)):
            size = float(beam.mesh.lengths.sum())
            sizes.append(size)
            motions[s, 3 * k:3 * k + 3] = beam.rigid_motions() / np.array([1.0, 1.0, size])
        held = motions[self.fixed]
        # rows for slopes have another unit than rows for positions: scale each to its size
        norms = np.abs(held).max(axis=1, initial=0.0)
        held = held[norms > 0] / norms[norms > 0, None]
        if len(held):
            _, sigma, V = np.linalg.svd(held)
            rank = int(np.sum(sigma > 1e-9 * sigma[0]))
        else:
            V, rank = np.eye(n), 0
        return [self._describe(v, sizes) for v in V[rank:]] if rank else [
            self._describe(v, sizes) for v in V]

    def _describe(self, v, sizes):
        parts = []
        for k, beam in enumerate(self.beams):
            a, b, c = v[3 * k:3 * k + 3]
            c = c / sizes[k]
            if max(abs(a), abs(b), abs(c) * sizes[k]) < 1e-8:
                continue
            who = "" if len(self.beams) == 1 else f" of beam {beam.name or k}"
            if abs(c) * sizes[k] < 1e-8:
                d = np.array([a, b]) / np.hypot(a, b)
                d = d if d[np.argmax(np.abs(d))] > 0 else -d
                parts.append(f"translation along ({d[0]:.3g}, {d[1]:.3g}){who}")
            else:
                x = beam.origin + np.array([-b, a]) / c
                parts.append(f"rotation about ({x[0]:.4g}, {x[1]:.4g}){who}")
        return " with ".join(parts)

    def require_supports(self):
        """Raise SupportError if a rigid motion is free."""
        free = self.free_rigid_motions()
        if free:
            raise SupportError(
                "the supports leave rigid motions free: " + "; ".join(free)
                + ". Add a support, for example scene.clamp('left'), or solve in time with "
                "scene.integrate")
