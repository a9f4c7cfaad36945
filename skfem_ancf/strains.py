"""The strain of the elements at points, by tables of what it is sampled from."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from .formulations import COMPONENTS
from .kept import kept
from .mapping import cross
from .series import chebyshev

if TYPE_CHECKING:
    from collections.abc import Callable

    from .beam import Beam
    from .formulations.base import Term
    from .types import Array

#: Points that are evaluated at once.
CHUNK = 2048

#: Points of which tables are kept.
POINTS = 64

#: Which derivatives of the position make each strain component.
PAIRS = ((0, 0), (1, 1), (0, 1))


class PointStrain(NamedTuple):
    """The strain at one point as a function of the coordinates of its element.

    Attributes
    ----------
    slopes
        Derivatives of the local functions along the axis and across it where the strain is
        sampled, shape (2 places, nb).
    frame
        The beam's frame there, (places, along which, component).
    weights
        Of products of derivatives in the strain, shape (3, 4 places).
    """

    slopes: Array
    frame: Array
    weights: Array

    def __call__(self, u_e: Array) -> Array:
        """(eps_xx, eps_yy, 2 eps_xy) for displacements (2, nb) of the coordinates, shape (3,)."""
        H = (self.slopes @ u_e.T).reshape(-1, 2, 2)  # places, along which it is derived, component
        return self.weights @ ((self.frame + 0.5 * H) @ H.swapaxes(-1, -2)).ravel()


class TaperedStrain:
    """As :class:`ElementStrain`, of a tapered beam: its local functions are none of all elements.

    Parameters
    ----------
    beam, term
        As for :class:`ElementStrain`.
    """

    def __init__(self, beam: Beam, term: Term) -> None:
        self.beam, self.term = beam, term

    def __call__(self, u: Array, e: Array, X: Array) -> Array:
        """(eps_xx, eps_yy, 2 eps_xy) at points.

        Parameters
        ----------
        u
            Displacement of the coordinates of the beam, shape (N,).
        e, X
            Elements (n,) and reference points (2, n).

        Returns
        -------
        ndarray
            Shape (3, n).
        """
        return self._of(self.beam.kernel.gather(u, e), e, X)

    def at(self, e: int, xi: float, eta: float) -> Callable[[Array], Array]:
        """What gives the strain at one point in many states.

        Parameters
        ----------
        e, xi, eta
            Element and reference point.
        """
        at, X = np.array([e]), np.array([[xi], [eta]])
        return lambda u_e: self._of(u_e.T[None], at, X)[:, 0]

    def _of(self, u_e, e, X):
        found = {}

        def products(xi):
            key = None if xi is None else float(xi)
            if key not in found:
                at = X if xi is None else np.array([0.0 * X[0] + xi, X[1]])
                H, g = (part[..., 0] for part in self.beam.element.gradients(
                    self.beam.mesh.mapping(), at[:, :, None], e, u_e))
                C = np.einsum("iJn,iKn->JKn", g + 0.5 * H, H)
                found[key] = np.array([C[0, 0], C[1, 1], C[0, 1] + C[1, 0]])
            return found[key]

        out = []
        for row, name in enumerate(COMPONENTS):
            weights = self.term.interpolation(name, X[0])
            out.append(products(None)[row] if weights is None else sum(
                w * products(xi)[row] for xi, w in zip(self.term.nodes(name), weights.T)))
        return np.array(out)


class ElementStrain:
    """The strain of a term of a formulation: interpolated samples.

    A component is sampled at places along the axis that are the same in all elements: there the
    slopes of the position are polynomials across the section. One that is not sampled is
    evaluated at the points themselves.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    term
        A :class:`~skfem_ancf.formulations.Term`.
    """

    def __init__(self, beam: Beam, term: Term) -> None:
        self._points: dict = {}
        self._elements: dict = {}
        self.beam, self.term, series = beam, term, beam.series
        self.places = sorted({float(xi) for name in term.samples for xi in term.samples[name]})
        self.here = any(name not in term.samples for name in COMPONENTS)
        count = len(self.places) + self.here
        p = max([len(xi) for xi in term.samples.values()], default=1)
        self._samples = np.zeros((3, count, p))  # how much a place has in a component
        for row, name in enumerate(COMPONENTS):
            if name not in term.samples:
                self._samples[row, -1, 0] = 1.0
                continue
            nodes = np.asarray(term.samples[name])
            lagrange = np.linalg.inv(chebvander(2.0 * nodes - 1.0, len(nodes) - 1)).T
            for xi, coefficients in zip(nodes, lagrange):
                self._samples[row, self.places.index(float(xi)), :len(nodes)] = coefficients
        self._used = [np.nonzero(np.any(s, axis=1))[0] for s in self._samples]
        self._rows = np.zeros((3, count, 2, 2, p))  # of all products of derivatives at one point
        for row, (J, K) in enumerate(PAIRS):
            self._rows[row, :, J, K] += self._samples[row]
            if J != K:
                self._rows[row, :, K, J] += self._samples[row]
        both = series.along, series.across
        # by xi, by eta of each place: (places, 2, m, nb); of the points (1, 2, p m, nb)
        self._fixed = np.array([[np.einsum("bpm,p->mb", table, chebyshev(
            xi, table.shape[1])) for table in both] for xi in self.places]).reshape(
                -1, 2, series.value.shape[2], len(series.value))
        self._free = np.array([[table.reshape(len(table), -1).T for table in both]])
        self._tables = [self._fixed] * bool(self.places) + [self._free] * self.here
        self._shape, self._scaled = series.value.shape[1:], (2, len(series.value))

    # at many points

    def __call__(self, u: Array, e: Array, X: Array) -> Array:
        """(eps_xx, eps_yy, 2 eps_xy) at points.

        Parameters
        ----------
        u
            Displacement of the coordinates of the beam, shape (N,).
        e, X
            Elements (n,) and reference points (2, n).

        Returns
        -------
        ndarray
            Shape (3, n).
        """
        beam, n = self.beam, len(e)
        if n == 1:
            u_e = u[beam.mesh.t[0, e[0]] * beam.nd + beam.rows]
            return self.at(int(e[0]), float(X[0, 0]), float(X[1, 0]))(u_e)[:, None]
        few = n < beam.mesh.nelements
        of = e if few else np.arange(beam.mesh.nelements)
        scale = beam.scales[of].T
        u_e = beam.kernel.gather(u, of).transpose(1, 2, 0) * scale[:, None]
        # polynomials of the derivatives by xi and eta: (places, 2, m, 2, elements)
        groups = [table @ u_e.reshape(len(u_e), -1) for table in self._tables]
        groups = [table.reshape(*table.shape[:3], 2, len(of)) for table in groups]
        out = np.empty((3, n), u_e.dtype)
        for first in range(0, n, CHUNK):
            part = slice(first, first + CHUNK)
            at = np.arange(n)[part] if few else e[part]
            out[:, part] = self._chunk(groups, at, e[part], X[:, part])
        return out

    def _chunk(self, groups, at, e, X):
        """The strain at points, from the polynomials of their elements, number ``at`` there."""
        p, m = self._shape
        T = chebyshev(X[1], m)
        found = []
        for table in groups:
            basis = T
            if table is not groups[0] or not self.places:
                basis = (chebyshev(X[0], p)[:, None] * T).reshape(p * m, -1)
            value = table[:, :, 0].take(at, axis=-1) * basis[0]
            for j in range(1, len(basis)):
                value += table[:, :, j].take(at, axis=-1) * basis[j]
            found.append(value)
        H = np.concatenate(found) if len(found) > 1 else found[0]  # (places, 2, component, n)
        frame = self._turn(H, e, X)
        W = np.tensordot(self._samples, chebyshev(X[0], self._samples.shape[2]), 1)
        out = np.empty((3, len(e)), H.dtype)
        for row, (J, K) in enumerate(PAIRS):
            used = self._used[row]
            D, g = H[used], frame if len(frame) == 1 else frame[used]
            E = np.sum((g[:, J] + 0.5 * D[:, J]) * D[:, K], axis=1)
            if J != K:
                E += np.sum((g[:, K] + 0.5 * D[:, K]) * D[:, J], axis=1)
            out[row] = np.sum(W[row, used] * E, axis=0)
        return out

    def _turn(self, H, e, X):
        """From derivatives by xi and eta, in place, to those along the axis and across it.

        Returns the beam's frame (1 or places, along which, component, n).
        """
        mesh = self.beam.mesh
        if mesh.is_straight:
            t = mesh.p_X[:, mesh.t[0]].take(e, axis=-1)
            H[:, 0] /= mesh.lengths[e]
            H[:, 1] /= mesh.height
            return np.array([[t, [-t[1], t[0]]]])
        parts = [self._bottom[..., e] + X[1] * self._rise[..., e]] if self.places else []
        if self.here:
            parts.append(_turning(*mesh.mapping().derivatives(e, *X))[:, None])
        det, a, b, c, d, x, y = np.concatenate(parts, axis=1)
        along = (a[:, None] * H[:, 0] + b[:, None] * H[:, 1]) / det[:, None]
        H[:, 1] = (c[:, None] * H[:, 0] + d[:, None] * H[:, 1]) / det[:, None]
        H[:, 0] = along
        return np.array([[x, y], [-y, x]]).transpose(2, 0, 1, 3)

    @cached_property
    def _bottom(self):
        """What :func:`_turning` says of the places at the bottom of all elements."""
        return self._turning_at(0.0)

    @cached_property
    def _rise(self):
        """How much more it is at the top."""
        return self._turning_at(1.0) - self._bottom

    def _turning_at(self, eta):
        xi, ne = np.array(self.places)[:, None], self.beam.mesh.nelements
        return _turning(*self.beam.mesh.mapping().derivatives(np.arange(ne), xi, eta))

    # at one point

    def at(self, e: int, xi: float, eta: float) -> PointStrain:
        """What gives the strain at one point in many states.

        Parameters
        ----------
        e, xi, eta
            Element and reference point.
        """
        return kept(self._points, (e, xi, eta), lambda: self._at(e, xi, eta), POINTS)

    def _at(self, e, xi, eta):
        p, m = self._shape
        (fixed, free, rows), T = self._flat, chebyshev(eta, m)
        slopes = fixed @ T
        if self.here:
            slopes = np.concatenate([slopes, free @ (chebyshev(xi, p)[:, None] * T).ravel()])
        scale, frame = kept(self._elements, e, lambda: self._element(e), POINTS)
        slopes = slopes.reshape(-1, *self._scaled) * scale  # (places, 2, nb)
        if frame is None:
            at = [self._bottom[..., e] + eta * self._rise[..., e]] if self.places else []
            if self.here:
                at.append(_turning(*self.beam.mesh.mapping().derivatives(e, xi, eta))[:, None])
            turning = np.concatenate(at, axis=1) if len(at) > 1 else at[0]
            slopes = (turning[1:5] / turning[0]).T.reshape(-1, 2, 2) @ slopes
            frame = (turning[_OF_FRAME] * _SIGN).T.reshape(-1, 2, 2)
        weights = rows @ chebyshev(xi, rows.shape[1])
        return PointStrain(slopes.reshape(-1, slopes.shape[2]), frame, weights.reshape(3, -1))

    @cached_property
    def _flat(self):
        """The tables as matrices: (2 nb places, m), (2 nb, p m), and the weights (12 places, .)."""
        fixed, free = (np.moveaxis(table, 2, -1) for table in (self._fixed, self._free))
        return (fixed.reshape(-1, fixed.shape[-1]), free.reshape(-1, free.shape[-1]),
                self._rows.reshape(-1, self._rows.shape[-1]))

    def _element(self, e):
        """What an element multiplies slopes by, (2 or 1, nb), and the frame of a straight one."""
        mesh, scale = self.beam.mesh, self.beam.scales[e]
        if not mesh.is_straight:
            return scale, None
        x, y = mesh.p_X[:, mesh.t[0, e]]
        return (scale / np.array([[mesh.lengths[e]], [mesh.height]]),
                np.array([[[x, y], [-y, x]]]))


#: Where the frame (x, y), (-y, x) is in what :func:`_turning` returns, and with which sign.
_OF_FRAME, _SIGN = [5, 6, 6, 5], np.array([[1.0], [1.0], [-1.0], [1.0]])


def _turning(J0, J1, t):
    """What takes derivatives by xi and eta to those along the frame, shape (7, ...).

    The determinant of the map; times that, how much of both is in the one along the axis, and in
    the one across it; the tangent. All are linear in eta.

    J0, J1 and t are the derivatives of the map and the tangent, (2, ...).
    """
    n = -t[1], t[0]
    return np.array([cross(J0, J1), *(part for v in (t, n)
                                      for part in (cross(v, J1), cross(J0, v))), *t])
