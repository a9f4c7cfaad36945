"""A dead force on a point of a cable beside its axis: a force on the axis and a couple."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..beam.beam import Beam
from ..beam.distribution import Distribution
from ..beam.kernels.section import beam_gradients
from ..beam.kinematics import probe_reference
from ..core.types import Array
from .loads import Load


def is_off_axis(beam: Beam, X: Array) -> bool:
    """True for a point X (2,) of the reference cell of a cable that is not on its axis."""
    return not beam.has_sections and bool(abs(X[1] - 0.5) > beam.finder.allowed)


class OffAxisForce(Load):
    """A dead force F at ``r + Y n``, n the unit normal of the axis, with its potential.

    Parameters
    ----------
    force
        The force, shape (2,).
    e, X
        Element of the cable, and reference point (2,).
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`; the beam is a Beam.
    """

    constant = False

    def __init__(self, force: Array, e: int, X: Array, beam: Any, amplitude: Any = None) -> None:
        super().__init__(beam, amplitude)
        self.total, self._place, here = force, (e, float(X[0])), np.array([e])
        self._dofs, self._weights = probe_reference(beam, e, np.array([X[0], 0.5]))
        slopes, frame = beam_gradients(beam.mesh, beam.element, np.array([X[:1], [0.5]]), here)
        self._slopes, self._start = slopes[0, 0, 0], frame[0, 0, 0]
        Y = float(beam.mesh.mapping().offset(X.reshape(2, 1, 1), here)[0, 0])
        #: minus the potential of the couple is this vector times the unit tangent
        self._arm = Y * np.array([force[1], -force[0]])

    def _tangent(self, u: Array) -> tuple[Array, Any]:
        d = self._start + u[self._dofs] @ self._slopes
        return d, np.sqrt(d @ d)

    def _nodal(self, couple: Array) -> Array:
        return self.total[:, None] * self._weights + couple[:, None] * self._slopes

    def _at(self, u: Array) -> Array:
        d, size = self._tangent(u)
        return self._nodal((self._arm - d * (self._arm @ d) / size**2) / size)

    def _spread(self, nodal: Array) -> Array:
        out = np.zeros(self.beam.N, nodal.dtype)
        out[self._dofs] = nodal
        return out

    def force(self, u: Array) -> Array:
        return self._spread(self._at(u))

    def mean_force(self, u0: Array, u1: Array) -> Array:
        (a, p), (b, q) = self._tangent(u0), self._tangent(u1)
        couple = 0.5 * (1.0 / p + 1.0 / q) * self._arm - 0.5 * (self._arm @ (a + b)) * (a + b) / (
            (p + q) * p * q)
        return self._spread(self._nodal(couple))

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        (d, size), a = self._tangent(u), self._arm
        along = a @ d
        D = (3.0 * along / size**2 * np.outer(d, d) - np.outer(a, d) - np.outer(d, a)
             - along * np.eye(2)) / size**3
        values = np.einsum("ij,k,l->ikjl", D, self._slopes, self._slopes)
        rows = np.broadcast_to(self._dofs[:, :, None, None], values.shape)
        columns = np.broadcast_to(self._dofs[None, None], values.shape)
        return rows.ravel(), columns.ravel(), values.ravel()

    def potential(self, u: Array) -> float:
        (d, size), (start, before) = self._tangent(u), self._tangent(0.0 * u)
        return -float(np.sum(self.total[:, None] * self._weights * u[self._dofs])
                      + self._arm @ (d / size - start / before))

    def distribution(self, u: Array) -> Distribution:
        e, xi = self._place
        return Distribution(stations=(e + xi,), points=((e, xi, self._at(u).T),))
