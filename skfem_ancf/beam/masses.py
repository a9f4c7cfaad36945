"""Mass of a beam: shape functions and masses at points."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..core import Array, BandMatrix, Rule, gauss, product_rule, tensor
from ..formulations import AXIS

#: Additional points along an element of variable section.
MORE = 4

#: Rotation by 90 degrees.
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


class Masses(NamedTuple):
    """Masses at points of the elements, or of one element if all are equal. ``functions`` are shape
    functions (nb, nelements, npoints), ``mass`` the masses, (nelements, npoints). For cables, with
    velocity ``v + Y v_X`` turned by 90 degrees off the axis, ``slopes`` are axial derivatives of
    the functions, and ``moments`` masses times Y and Y^2, (2, nelements, npoints)."""

    functions: Array
    mass: Array
    slopes: Array | None = None
    moments: Any = None

    def matrices(self, elements: Any) -> Array:
        """Mass matrices of a slice of the elements, shape (n, 2 nb, 2 nb)."""
        N, m = self.functions[:, elements], self.mass[elements]
        size = 2 * len(N)

        def product(A, B, weights, turn):
            scalar = (A * weights).transpose(1, 0, 2) @ B.transpose(1, 2, 0)
            return (scalar[:, :, None, :, None] * turn[:, None]).reshape(-1, size, size)

        out = product(N, N, m, np.eye(2))
        if self.slopes is not None:
            S, (first, second) = self.slopes[:, elements], self.moments[:, elements]
            coupling = product(N, S, first, TURN)
            out = out + product(S, S, second, np.eye(2)) + coupling + coupling.transpose(0, 2, 1)
        return out

    def weights(self, g: Array) -> Array:
        """Nodal forces of an acceleration g (2,), shape (nelements, nb, 2)."""
        out = (self.functions * self.mass).sum(axis=2).T[:, :, None] * g
        if self.slopes is not None and self.moments[0].any():
            out = out + np.einsum("iep,ep->ei", self.slopes, self.moments[0])[:, :, None] * (
                g @ TURN)
        return out


def exact_rule(beam: Any) -> Rule:
    """Points (2, n) and weights (n,), exact for products of two DOFs."""
    n = beam.element.axis_degree + 1 + (0 if beam.mesh.is_straight else 1)
    return tensor(gauss(n), gauss(beam.element.order + 1) if beam.has_sections else AXIS)


def points_along(beam: Any) -> int:
    """Number of axial Gauss points for products of two DOFs."""
    more = (0 if beam.mesh.is_straight else 1) + (0 if beam.across.constant else MORE)
    return beam.element.axis_degree + 1 + more


@lru_cache(64)
def _unit(element, n, measure):
    """Points and weights, and functions (nb, 1, points) of an element of unit length and height."""
    X, W = product_rule(gauss(n), measure.gauss(element.order + 1))
    return X, W, element.local(X, 1.0)[0][:, None]


@lru_cache(64)
def _at_gauss(element, n):
    """Functions and slopes of an element of unit length at n Gauss points, (2, nb, 1, n)."""
    xi, _ = gauss(n)
    return np.array(element.local(np.array([xi, 0.5 + 0.0 * xi]), 1.0)[:2])[:, :, None]


def masses_of(beam: Any) -> Masses:
    """The Masses of a beam; cables have rotary inertia."""
    across, element, mesh, n = beam.across, beam.element, beam.mesh, points_along(beam)
    mapping, tind, parts = mesh.mapping(), np.array([0]) if across.uniform else None, []
    length = mesh.lengths[slice(None) if tind is None else tind, None]
    if beam.has_sections:
        similar = mesh.is_straight and mesh.heights is None and element.by_reference
        for layer in across.layers:
            measure = layer.measure if layer.inertia is None else layer.inertia
            X, W, N = _unit(element, n, measure)
            N = (N * element.powers(mesh.height, length).T[:, :, None] if similar else
                 element.values(mapping, X, tind))
            parts.append((N, across.volume(layer, X, W, tind, times="density", full=True)))
        return Masses(*(np.concatenate(part, axis=-1) for part in zip(*parts)))
    xi, w = gauss(n)
    moments = across.moments(xi, tind, "mass") * w
    if mesh.is_straight and element.by_reference:
        N, d_xi = _at_gauss(element, n) * element.powers(1.0, length).T[:, :, None]
        moments *= length
        return Masses(N, moments[0], d_xi / length, moments[1:])
    X = np.array([xi, 0.5 + 0.0 * xi])
    N, d_xi, _ = element.of_mesh(mapping, X, tind)
    # arc length, since the interpolated tangent is shorter than one
    speed = np.hypot(*mapping.DF(X, tind)[:, 0])
    mass, first, second = moments * speed
    # volume of a curved beam: that of its axis times 1 - Y / R
    faces = np.array([np.tile(xi, 2), np.repeat([0.0, 1.0], len(xi))])
    bottom, top = np.split(mapping.full_volume(faces, tind), 2, axis=-1)
    bend = 2.0 * (bottom - top) / ((bottom + top) * mapping.height(xi, tind)[0])
    return Masses(N, mass - bend * first, d_xi / speed, np.array([first - bend * second, second]))


def projected(beam: Any, field: Callable[[Array], Array]) -> Array:
    """L2 projection (N,) of a velocity field, a function of points (2, nelements, npoints)."""
    X, W = exact_rule(beam)
    mesh, mapping, element, nd = beam.mesh, beam.mesh.mapping(), beam.element, beam.nd
    N = element.values(mapping, X).transpose(1, 0, 2)
    weighted, back = N * (mapping.full_volume(X) * W)[:, None], N.transpose(0, 2, 1)
    gram = BandMatrix.zeros(beam.N // 2, nd - 1)  # of one component
    gram.add_elements(weighted @ back, 0, nd // 2, mesh.t[0])
    rest, v = field(mapping.F(X)).transpose(1, 2, 0), np.zeros((beam.N // 2, 2))
    for _ in range(2):  # refined, since masses of high degree are ill-conditioned
        parts = weighted @ rest
        dv = gram.solve(beam.kernel.scatter(parts).reshape(-1, 2))
        left, right = dv.reshape(-1, nd)[mesh.t]
        of_elements = np.concatenate([left, right], axis=1).reshape(parts.shape)
        rest, v = rest - back @ of_elements, v + dv
    return v.ravel()
