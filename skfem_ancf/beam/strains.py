"""The strain of the elements at points, by tables of what it is sampled from."""

from __future__ import annotations

from operator import mul
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from ..formulations import COMPONENTS
from ..core.kept import cached_property
from .kernels.along import from_first_node
from ..elements.series import chebyshev, derivatives, polynomials

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .interior import Interior
    from ..formulations.base import Term
    from ..core.types import Array, Rule

#: Points that are evaluated at once.
CHUNK = 3072

#: Which derivatives of the position each strain component needs: along the axis 0, across it 1.
NEEDS = ((0,), (1,), (0, 1))


def along_axis(a: Any, b: Any, x: Any, y: Any) -> Any:
    """Green-Lagrange strain eps_xx.

    Parameters
    ----------
    a, b
        Derivatives of the displacement along the axis and across it, each a pair of numbers or
        arrays (n,).
    x, y
        The tangent of the stress-free axis.
    """
    return (x + 0.5 * a[0]) * a[0] + (y + 0.5 * a[1]) * a[1]


def across_axis(a: Any, b: Any, x: Any, y: Any) -> Any:
    """Green-Lagrange strain eps_yy; parameters are those of :func:`along_axis`.

    Parameters
    ----------
    a, b, x, y
        As there, pairs of arrays of shape (n,), and of shape (n,).
    """
    return (0.5 * b[0] - y) * b[0] + (x + 0.5 * b[1]) * b[1]


def shear(a: Any, b: Any, x: Any, y: Any) -> Any:
    """Twice the Green-Lagrange strain eps_xy; parameters are those of :func:`along_axis`.

    Parameters
    ----------
    a, b, x, y
        As there, pairs of arrays of shape (n,), and of shape (n,).
    """
    return (x + a[0]) * b[0] + (y + a[1]) * b[1] - y * a[0] + x * a[1]


#: The components in their order.
STRAINS = along_axis, across_axis, shear


def turned(turning: Sequence[Any], by_xi: Any, by_eta: Any) -> list[Any]:
    """Derivatives along the axis and across it.

    Parameters
    ----------
    turning
        What :func:`_turning` returns.
    by_xi, by_eta
        Derivatives by xi and by eta, pairs of numbers or arrays (n,).
    """
    det, a, b, c, d = turning[:5]
    return [((a * by_xi[0] + b * by_eta[0]) / det, (a * by_xi[1] + b * by_eta[1]) / det),
            ((c * by_xi[0] + d * by_eta[0]) / det, (c * by_xi[1] + d * by_eta[1]) / det)]


def sampled(terms: Sequence[Any], slopes: Sequence[Any], frames: Sequence[Any]) -> list[Any]:
    """The samples of the strain: of each term its component at its place.

    Parameters
    ----------
    terms
        As ``ElementStrain.terms``.
    slopes
        Derivatives of the displacement, each a pair of numbers or arrays (n,).
    frames
        The tangent of the stress-free axis at each place, pairs of numbers or arrays.
    """
    return [STRAINS[row](slopes[a], slopes[b], *frames[place]) for row, place, a, b in terms]


def interpolated(terms: Sequence[Any], weights: Sequence[Any], samples: Sequence[Any]
                 ) -> list[Any]:
    """The strain (eps_xx, eps_yy, 2 eps_xy): of each component the sum of weighted samples.

    Parameters
    ----------
    terms
        As ``ElementStrain.terms``.
    weights, samples
        Of each term, numbers or arrays (n,).
    """
    out: list[Any] = [0.0, 0.0, 0.0]
    for weight, sample, (row, _, _, _) in zip(weights, samples, terms):
        out[row] = out[row] + weight * sample
    return out


class ElementStrain:
    """The strain of a term of a formulation: interpolated samples.

    A component is sampled at places along the axis that are the same in all elements: there the
    derivatives of the position along the axis and across it are polynomials across the section,
    divided by the determinant of the map of a curved element. A component that is not sampled is
    evaluated at the points themselves.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    term
        A :class:`~skfem_ancf.formulations.Term`.
    rows
        The components that are asked for; the others are zero.

    Attributes
    ----------
    terms : list
        For each sample of a component: the component, the place, and which of the derivatives are
        those along the axis and across it there.
    """

    def __init__(self, beam: Interior, term: Term, rows: Sequence[int] = (0, 1, 2)) -> None:
        self.beam, series = beam, beam.series
        names = [COMPONENTS[row] for row in rows]
        self.places = sorted({float(xi) for name in names for xi in term.samples.get(name, ())})
        self.here = any(name not in term.samples for name in names)
        self.terms: list[tuple[int, int, int, int]] = []
        self._pairs: list[tuple[int, int]] = []  # places and derivatives there that are needed
        most = max(len(term.samples.get(name, (0.0,))) for name in names)
        weights = []
        if self.here:
            self._pairs += [(len(self.places), 0), (len(self.places), 1)]
        for row, name in zip(rows, names):
            nodes = np.asarray(term.samples.get(name, ()))
            lagrange = np.linalg.inv(chebvander(2.0 * nodes - 1.0, len(nodes) - 1)).T if len(
                nodes) else np.ones((1, 1))
            at = [self.places.index(float(xi)) for xi in nodes] or [len(self.places)]
            for place, coefficients in zip(at, lagrange):
                pairs = [self._pair(place, J) for J in NEEDS[row]]
                self.terms.append((row, place, pairs[0], pairs[-1]))
                weights.append(np.append(coefficients, np.zeros(most - len(coefficients))))
        self._weights, self._degree = np.array(weights), most
        self._sort()
        #: The terms, and their components, that are evaluated at the points themselves.
        self.at_points = [(k, row) for k, (row, place, _, _) in enumerate(self.terms)
                          if place == len(self.places)]
        self._shape = series.shape
        self._basis = np.array([chebyshev(xi, series.shape[0]) for xi in self.places]).reshape(
            -1, series.shape[0])
        #: Of straight elements of one height, whose map is linear.
        self._linear = beam.mesh.is_straight and beam.mesh.heights is None

    def _pair(self, place, J):
        if (place, J) not in self._pairs:
            self._pairs.append((place, J))
        return self._pairs.index((place, J))

    def _sort(self):
        """Pairs by their places, and as arrays those that are the same in all elements."""
        order = sorted(range(len(self._pairs)), key=lambda k: self._pairs[k])
        new = {old: k for k, old in enumerate(order)}
        self.terms = [(row, place, new[a], new[b]) for row, place, a, b in self.terms]
        self._pairs = [self._pairs[k] for k in order]
        fixed = np.array([pair for pair in self._pairs if pair[0] < len(self.places)], dtype=int)
        self._at, self._which = fixed.reshape(-1, 2).T

    # derivatives at places, as polynomials across the section

    def _turned(self, tables, e):
        """Along the axis and across it, from derivatives by xi and eta: (pairs, M, k, n).

        Tables (places, 2, m, k, n) for elements (n,).
        """
        mesh, at, which = self.beam.mesh, self._at, self._which
        if not len(at):
            return []
        if self._linear:
            size = np.array([mesh.lengths[e], np.full(len(e), mesh.height)])
            table = tables[at, which]
            return table / size[which].reshape(len(at), 1, 1, len(e))
        return sum(_times(self._map[1 + 2 * which + k, at][..., e], tables[at, k]) for k in (0, 1))

    @cached_property
    def _map(self):
        """What :func:`_turning` says of the places, linear in 2 eta - 1, (7, places, 2, ne)."""
        return self._turning_across(np.arange(self.beam.mesh.nelements),
                                    np.array(self.places)[:, None])

    def _turning_across(self, e, xi):
        """What :func:`_turning` says at places (..., n) of elements (n,): (7, ..., 2, n)."""
        low, high = (np.array(_turning(*self.beam.mesh.mapping().derivatives(e, xi, eta)))
                     for eta in (0.0, 1.0))
        return np.stack([0.5 * (low + high), 0.5 * (high - low)], axis=-2)

    # at many points

    def __call__(self, u: Array, e: Array, X: Array, across: Rule | None = None) -> Array:
        """(eps_xx, eps_yy, 2 eps_xy) at points.

        Parameters
        ----------
        u
            Displacement of the coordinates of the beam, shape (N,).
        e, X
            Elements (n,) and reference points (2, n).
        across
            Points and weights across sections, for the mean over those of the points.

        Returns
        -------
        ndarray
            Shape (3, n).
        """
        beam, n = self.beam, len(e)
        few = n < beam.mesh.nelements
        of = e if few else np.arange(beam.mesh.nelements)
        u_e = from_first_node(beam.kernel.gather(u, of)).transpose(1, 2, 0)
        u_e = u_e * beam.scales[of].T[:, None]
        fixed, free = self._derivatives(u_e, of)
        turned = self._turned(fixed, of)
        means = None if across is None else self._means(turned, of, across)
        out = np.empty((3, n), u_e.dtype)
        for first in range(0, n, CHUNK):
            part = slice(first, first + CHUNK)
            at = np.arange(n)[part] if few else e[part]
            if means is None:
                samples = self._samples(turned, free, at, e[part], X[:, part])
            else:
                samples = [mean.take(at) for mean in means]
                for (k, _), mean in zip(self.at_points, self._means_here(
                        free, at, e[part], X[0, part], across)):
                    samples[k] = mean
            weights = self._weights @ chebyshev(X[0, part], self._weights.shape[1])
            for row, values in zip(out, interpolated(self.terms, list(weights), samples)):
                row[part] = values
        return out

    def _samples(self, turned, free, at, e, X):
        """The samples (n,) of each term at the places across of points."""
        T = polynomials(X[1], self._shape[1] + 1)
        slopes, frames = self._slopes(turned, at, e, T), self._frames(e)
        if self.here:
            found, tangent = self._slopes_here(free, at, e, X, T)
            slopes += found
            frames.append(tangent)
        return sampled(self.terms, slopes, frames)

    def _means(self, turned, of, across):
        """The means over the section of samples at fixed places, for all elements (terms, ne)."""
        at, frames = np.arange(len(of)), self._frames(of)
        total = np.zeros((len(self.terms), len(of)), np.result_type(*turned, float))
        for eta, weight in zip(*across):
            slopes = self._slopes(turned, at, of, polynomials(0.0 * of + eta, self._shape[1] + 1))
            for mean, (row, place, a, b) in zip(total, self.terms):
                if place < len(self.places):
                    mean += weight * STRAINS[row](slopes[a], slopes[b], *frames[place])
        return total

    def _means_here(self, free, at, e, xi, across):
        """The means of what is evaluated at the points over their sections."""
        if not self.here:
            return []
        turning, tables, means = self._turning_across(e, xi), {}, [0.0] * len(self.at_points)
        by_xi, by_eta = (self._at_xi(table, at, xi)[None] for table in free)
        for J in {J for _, row in self.at_points for J in NEEDS[row]}:
            a, b = turning[1 + 2 * J:3 + 2 * J, None]
            tables[J] = (_times(a, by_xi) + _times(b, by_eta))[0]
        for eta, weight in zip(*across):
            T = polynomials(eta, self._shape[1] + 1)
            inverse = 1.0 / (turning[0, 0] + T[1] * turning[0, 1])
            slopes = {J: inverse * sum(map(mul, table, T)) for J, table in tables.items()}
            for k, (_, row) in enumerate(self.at_points):
                means[k] += weight * STRAINS[row](slopes.get(0), slopes.get(1), *turning[5:, 0])
        return means

    def _derivatives(self, u_e, e):
        """Derivatives by xi and eta of displacements (nb, k, n) of elements, polynomials.

        At the places (places, 2, m, k, n), and everywhere (2, p, m, k, n). Elements e are an array
        (n,), or a number.
        """
        heights = self.beam.mesh.mapping().heights_of(e)
        free = derivatives(self.beam.series.in_elements(u_e, heights))
        return np.tensordot(self._basis, free, (1, 1)), free

    def _slopes(self, turned, at, e, T):
        """Derivatives at places, (2, n) each, from polynomials of elements, number ``at`` there."""
        inverse = [] if self._linear else [1.0 / (d[0].take(e) + T[1] * d[1].take(e))
                                           for d in self._map[0]]
        out = []
        for (place, _), table in zip(self._pairs, turned):
            value = table[0].take(at, axis=-1)
            for c, basis in zip(table[1:], T[1:]):
                value += c.take(at, axis=-1) * basis
            if not self._linear:
                value *= inverse[place]
            out.append(value)
        return out

    def _at_xi(self, table, at, xi):
        """Of a table (p, m, 2, elements) polynomials across, (m, 2, n), at places xi (n,)."""
        value = table[0].take(at, axis=-1)
        for c, T in zip(table[1:], polynomials(xi, len(table))[1:]):
            value += c.take(at, axis=-1) * T
        return value

    def _slopes_here(self, free, at, e, X, T):
        """Derivatives at the points themselves, (2, n) each, and the tangent of the axis there."""
        turning, both = self._turning(e, *X), []
        for table in free:
            first, *others = self._at_xi(table, at, X[0])
            for c, basis in zip(others, T[1:]):
                first += c * basis
            both.append(first)
        return turned(turning, *both), turning[5:]

    def _turning(self, e, xi, eta):
        """What :func:`turned` takes, at points, and the tangent of the axis there."""
        mesh = self.beam.mesh
        if not self._linear:
            return _turning(*mesh.mapping().derivatives(e, xi, eta))
        return 1.0, 1.0 / mesh.lengths[e], 0.0, 0.0, 1.0 / mesh.height, *self._tangents(e)

    def _frames(self, e):
        """The tangent of the axis at all places."""
        if self._linear:
            return [self._tangents(e)] * len(self.places)
        return [self._map[5:, place, 0].take(e, axis=-1) for place in range(len(self.places))]

    def _tangents(self, e):
        """Those of straight elements, (2, n)."""
        mesh = self.beam.mesh
        return mesh.p_X[:, mesh.t[0]].take(e, axis=-1)

def _times(linear, table):
    """Products of linear functions (pairs, 2, n) of z and polynomials (pairs, m, k, n).

    All are sums of Chebyshev polynomials of z; the products have m + 1 terms.
    """
    c, d = linear[:, 0, None, None], linear[:, 1, None, None]
    out = np.zeros((table.shape[0], table.shape[1] + 1, table.shape[2], linear.shape[-1]),
                   table.dtype)
    out[:, :-1] += c * table
    out[:, 1:2] += d * table[:, :1]
    out[:, 2:] += 0.5 * d * table[:, 1:]
    out[:, :-2] += 0.5 * d * table[:, 1:]
    return out


def _turning(J0, J1, t):
    """What takes derivatives by xi and eta to those along the frame, a list of seven.

    The determinant of the map; times that, how much of both is in the one along the axis, and in
    the one across it; the tangent. All are linear in eta.

    J0, J1 and t are the derivatives of the map and the tangent, (2, ...).
    """
    (a, b), (c, d), (x, y) = J0, J1, t
    return [a * d - b * c, x * d - y * c, a * y - b * x, -x * c - y * d, a * x + b * y, x, y]
