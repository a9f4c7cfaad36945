"""The axis of a beam as a curve, and the closest point on it.

The parameter s of a point is the number of its element plus its xi in [0, 1].
"""

from __future__ import annotations

from math import factorial, floor

import numpy as np

from ...beam.beam import Beam
from ...core.types import Array
from ...mesh.reference_cell import hermite_basis

#: Least number of sample points of an element for the initial search.
SAMPLES = 5
#: Largest number of iterations for the closest point.
ITERATIONS = 40


class Axis:
    """The axis of a beam, a polynomial of s in each element; ``first`` is the beam's first DOF."""

    def __init__(self, beam: Beam, first: int) -> None:
        self.beam, self.first, degree = beam, first, beam.element.axis_degree
        # DOFs of the axis in the order of the Hermite functions
        along = np.array([-1 if across else a for _, a, across in beam.element.functionals])
        m, nb = (degree + 1) // 2, len(along)
        one = np.array([int(np.flatnonzero(along == k)[0]) for k in range(m)])
        used = np.concatenate([one, nb + one])
        # coefficients of the functions and their derivatives by s, (4, nb, degree + 1), in powers
        # of the distance from the middle of the element
        self._powers = np.zeros((4, len(used), degree + 1))
        for k in range(degree + 1):
            self._powers[0, :, k] = hermite_basis(m, 0.5, k) / factorial(k)
        for k in range(1, 4):
            self._powers[k, :, :-1] = self._powers[k - 1, :, 1:] * np.arange(1, degree + 1)
        self._start = np.asarray(beam.q0)
        x = np.linspace(0.0, 1.0, max(SAMPLES, degree))
        self._samples = self._powers[0] @ (x - 0.5) ** np.arange(degree + 1)[:, None]
        starts = (beam.mesh.t[0] * beam.nd)[:, None, None]
        self._dofs = first + starts + 2 * used + np.arange(2)[:, None]  # (ne, 2, nb)
        self._scales = beam.mesh.lengths[:, None] ** np.tile(np.arange(m), 2)
        self._range = np.arange(degree + 1)

    def element(self, s: float) -> int:
        """The element at s; the end element beyond the ends."""
        return min(max(floor(s), 0), len(self._dofs) - 1)

    def weights(self, s: float) -> tuple[Array, Array]:
        """DOFs of the scene, and their weights in the axis and its derivatives by s."""
        e = self.element(s)
        return self._dofs[e], (self._powers @ (s - e - 0.5) ** self._range) * self._scales[e]

    def between(self, s0: float, s1: float) -> tuple[Array, Array, Array]:
        """Weights at two parameters, and their divided differences."""
        (one, a), (two, b) = self.weights(s0), self.weights(s1)
        e, f = self.element(s0), self.element(s1)
        nb = one.shape[1]
        weights = np.zeros((2, 2, 2 * nb))
        weights[0, :, :nb] = a[:2] / self.beam.mesh.lengths[e] ** np.arange(2)[:, None]
        weights[1, :, nb:] = b[:2] / self.beam.mesh.lengths[f] ** np.arange(2)[:, None]
        dofs = np.hstack([one, two])
        if e != f:
            return dofs, weights, (weights[1] - weights[0]) / (self.length(s1) - self.length(s0))
        x, y, n = s0 - e - 0.5, s1 - e - 0.5, self._powers.shape[2]
        powers = [sum(x**j * y**(k - 1 - j) for j in range(k)) for k in range(n)]
        quotients = np.zeros((2, 2 * nb))
        quotients[:, :nb] = ((self._powers[:2] @ powers) * self._scales[e]
                             / self.beam.mesh.lengths[e] ** np.arange(1, 3)[:, None])
        return dofs, weights, quotients

    def at(self, u: Array, s: float) -> Array:
        """Position and its first three derivatives by s, shape (4, 2)."""
        dofs, weights = self.weights(s)
        return weights @ self.places(u, dofs).T

    def nearest(self, u: Array, p: Array) -> float:
        """Parameter of the closest point of the axis to p."""
        x = (self.places(u, self._dofs) * self._scales[:, None]) @ self._samples
        gap = np.sum((x - p[:, None]) ** 2, axis=1)
        e, k = np.unravel_index(int(np.argmin(gap)), gap.shape)
        s, n = float(e + k / (gap.shape[1] - 1)), self.beam.mesh.nelements
        for _ in range(ITERATIONS):
            c, d, dd, _ = self.at(u, s)
            gap, size = c - p, float(d @ d)
            slope = size + float(gap @ dd)
            step = -float(gap @ d) / (slope if slope > 0.1 * size else size)
            inside = min(max(s + min(max(step, -0.5), 0.5), -0.5), n + 0.5)
            done, s = abs(inside - s) <= 1e-15 * n, inside
            if done:
                break
        return s

    def places(self, u: Array, dofs: Array) -> Array:
        """Nodal coordinates at a displacement."""
        return self._start[dofs - self.first] + u[dofs]

    def length(self, s: float) -> float:
        """Length of the reference axis from its start to s."""
        e = self.element(s)
        return float(np.sum(self.beam.mesh.lengths[:e]) + (s - e) * self.beam.mesh.lengths[e])
