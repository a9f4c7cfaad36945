"""Obstacles: a shape, its motion and its contact law."""

from typing import Any

import numpy as np

from ...beam.kernels.section import beam_gradients
from ...beam import Layout, WhichBeam, select_beam
from ...core import (Array, ModelWarning, ask_array, gauss_lobatto, refuse, require_function,
                     require_integer, require_not_negative, require_option, require_positive, warn)
from ..contact.contacts import LARGEST_FACTOR, Group
from ..contact.tables import Law, carried, taken_back
from ..forces.base import ForceElement, KernelElement
from ..places import Vector
from .shapes import Shape

#: Least length of indentation of a strip under a point force, relative to its extent: meshes do not
#: resolve shorter ones, and Newton's method fails.
SPREAD = 1.0 / 200.0
#: Width of the transition from no pressure to proportional pressure, relative to the height.
WIDTH = 1e-3
#: Tolerance of the augmented Lagrangian: penetration relative to the height.
TOLERANCE = 1e-5
#: Addition to the stiffness in a time step with the augmented Lagrangian, relative to the mass per
#: area over the squared step.
HARDER = 100.0
#: Depth to which the path of a point within a step may cut an obstacle unnoticed, relative to the
#: height or to half the obstacle's thickness.
THROUGH = 0.1
#: Relative step in time for the velocity of an obstacle.
STEP = 1e-6
#: Points across an end.
ACROSS = 3
#: Depth to which a circle may sink in between two points of a straight surface, relative to the
#: height; largest distance of points relative to its radius R, as forces along the surface are
#: wrong by d / (2 R) of the normal ones; largest number of points along an element.
SINK, RIPPLE, MOST = 1e-2, 0.05, 200


class Obstacle(ForceElement):
    """A rigid obstacle in contact with the surface of beams: bottom, top and both ends.

    Each quadrature point on the surface has the pressure ``stiffness`` times penetration per
    reference area; see :mod:`skfem_ancf.actions.contact.points`. The surface of a cable is its axis
    plus or minus half the height along the normal.

    Parameters
    ----------
    shape
        A :class:`~skfem_ancf.Circle`, :class:`~skfem_ancf.Line`, :class:`~skfem_ancf.Polygon` or
        :class:`~skfem_ancf.SignedDistance`.
    friction
        Coulomb's coefficient, zero or positive.
    stiffness
        Pressure per penetration, positive; by default ``E / height`` of each beam, but for strips
        thinner than a hundredth of their extent L at most ``E height^3 / (12 (L / 200)^4)``, so
        that meshes resolve the indentation. A static solution increases it, up to ``E / height``,
        under deep penetration, and beyond that at ends of beams and at stout bodies, until the
        answer depends on it by less than 1 %. Motions and paths of ``continuation`` keep it;
        ``state.checks.findings`` say where it yields more.
    beam
        Beam, name or number; all by default.
    method
        "penalty", or "augmented": each load or time step is repeated with updated multipliers until
        the penetration is less than ``tolerance``.
    position
        A function of time that returns the displacement (x, y) of the shape from its given place;
        in statics time is the load factor.
    angle
        A function of time that returns its rotation, counterclockwise, about its ``pivot``: center,
        point or mean of the corners.
    damping
        Relative increase of the pressure per approach velocity in a motion (Hunt and Crossley),
        time per length, zero or positive; the pressure stays positive.
    points
        Points along each element on bottom and top, at least 2, of a Gauss-Lobatto rule. By default
        two more than the degree of the axis, in as many intervals as a shape of small radius needs,
        up to 200: it sinks in between points by at most a hundredth of the height, and these are
        at most a twentieth of the radius apart, so that it slides without a ripple.
    width
        Length of the transition from no pressure to proportional pressure; by default a thousandth
        of the height.
    tolerance
        Penetration tolerated by "augmented", a length; by default 1e-5 of the height.

    References
    ----------
    Wriggers: "Computational Contact Mechanics", Springer 2006; Laursen, Chawla: "Design of energy
    conserving algorithms for frictionless dynamic contact problems", International Journal for
    Numerical Methods in Engineering 40 (1997); Hunt, Crossley: "Coefficient of restitution
    interpreted as damping in vibroimpact", Journal of Applied Mechanics 42 (1975).
    """

    distributed = True

    def __init__(self, shape: Shape, friction: float = 0.0, stiffness: float | None = None,
                 beam: WhichBeam = None, method: str = "penalty", position: Any = None,
                 angle: Any = None, damping: float = 0.0, points: int | None = None,
                 width: float | None = None, tolerance: float | None = None) -> None:
        refuse(not isinstance(shape, Shape), "an obstacle is a Circle, Line, Polygon or "
               "SignedDistance of skfem_ancf.actions.obstacles, got {!r}", shape)
        self.shape, self.beam = shape, beam
        self.friction = require_not_negative("friction", friction, False)
        self.damping = require_not_negative("damping", damping)
        self.penalty = None if stiffness is None else require_positive("stiffness", stiffness)
        self.method = require_option("method", method, ("penalty", "augmented"))
        self.points = None if points is None else require_integer("points", points, 2, MOST)
        self.position, self.angle = position, angle
        for name, function in (("position", position), ("angle", angle)):
            if function is not None:
                require_function(name, function, "of time")
        self.width = None if width is None else require_positive("width", width)
        self.tolerance = 0.0 if tolerance is None else require_positive("tolerance", tolerance)
        self.symmetric = self.friction == 0.0

    @property
    def moves(self) -> bool:
        """True if its pose depends on time."""
        return self.position is not None or self.angle is not None

    def pose(self, t: float, rates: bool = True) -> Array:
        """Displacement, cosine and sine, pivot, velocities, time; shape (10,).

        Parameters
        ----------
        t, rates
            The time; False for zero velocities.
        """
        out = np.array([0.0, 0.0, 1.0, 0.0, *self.shape.pivot, 0.0, 0.0, 0.0, t])
        if self.moves:
            now, h = self._at(t), STEP * max(1.0, abs(t))
            out[:2], out[2:4] = now[:2], (np.cos(now[2]), np.sin(now[2]))
            if rates:
                out[6:9] = (self._at(t + h) - self._at(t - h)) / (2.0 * h)
        return out

    def _at(self, t):
        place = np.zeros(2) if self.position is None else ask_array(
            "position(t={:g})", (2,), self.position, t)
        turn = 0.0 if self.angle is None else ask_array("angle(t={:g})", (), self.angle, t)
        return np.append(place, turn)

    def outline(self, box: Array, t: float = 0.0) -> tuple[Array, Array]:
        """Its surface as straight segments: points (2, n), and both ends of each, (m, 2).

        Parameters
        ----------
        box
            Lower left and upper right corner of the view, one a column, shape (2, 2).
        t
            Time; in statics the load factor.
        """
        if not self.moves:
            return self.shape.outline(box, t)
        pose = self.pose(t)
        corners = taken_back(pose, np.array(
            [[box[0, i], box[1, j]] for i in (0, 1) for j in (0, 1)]).T)
        points, pieces = self.shape.outline(
            np.array([corners.min(axis=1), corners.max(axis=1)]).T, t)
        return carried(pose, points), pieces

    def bind(self, layout: Layout) -> list[Vector]:
        refuse(not layout.beams, "an obstacle is touched by surfaces of beams, and the scene has "
               "none: use one-sided springs, or add a beam")
        beams = layout.beams if self.beam is None else [select_beam(layout.beams, self.beam)]
        height = min(beam.mesh.height for beam in beams)
        self.tolerance = self.tolerance or TOLERANCE * height
        groups = [self._group(beam, layout.offset(beam)) for beam in beams]
        places = np.concatenate([group.starts[:2] for group in groups], axis=1)
        self.shape = self.shape.fitted(places, height)
        self.groups = tuple(groups)
        return [Vector(np.zeros(2))]

    def parts(self) -> list[KernelElement]:
        return []

    # points of the surface

    def _group(self, beam, first):
        """Points of bottom, top and both ends; an end counts as an element."""
        mesh, h = beam.mesh, beam.mesh.height
        rule = lobatto(self.points or beam.element.axis_degree + 2)
        bend, longest = self.shape.bend, float(mesh.lengths.max())
        apart = longest * float(np.max(np.diff(rule[0])))
        if self.points is None and bend > 0.0:
            wanted = np.ceil(apart / min(np.sqrt(8.0 * SINK * bend * h), RIPPLE * bend))
            pieces = int(np.clip(wanted, 1, MOST // len(rule[0])))
            (x, w), apart = rule, apart / pieces
            places = np.add.outer(np.arange(pieces), x)[:, :-1].ravel() / pieces
            weights = np.tile(w[:-1], pieces) / pieces
            weights[len(w) - 1::len(w) - 1] += w[-1] / pieces  # two meet
            rule = np.append(places, 1.0), np.append(weights, w[-1] / pieces)
        if apart > 2.0 * bend > 0.0:
            warn(
                f"{self!r} has a radius of {bend:.4g}, and the points of {beam!r} that touch it "
                f"are {apart:.4g} apart: it passes between them unseen. Use shorter elements where "
                "it is, or a larger points=", ModelWarning)
        xi, along = rule
        m = 2 * len(xi)
        eta, across = lobatto(ACROSS)  # as many points as an element has: some are shared
        which = np.arange(m) % ACROSS
        eta, across = eta[which], across[which] / np.bincount(which)[which]
        parts = [self._points(beam, first, np.array([np.tile(xi, 2), np.repeat([0, 1], len(xi))]),
                              np.tile(along, 2), None)]
        parts += [self._points(beam, first, np.array([np.full(m, end), eta]), across, np.array([e]))
                  for end, e in ((0.0, 0), (1.0, mesh.nelements - 1))]
        nodes, weights, slopes, areas, offsets, starts = (
            np.concatenate(arrays, axis=-1) for arrays in zip(*parts))
        places = starts[:2].reshape(2, -1, m)
        radius = np.hypot(*(places - places.mean(axis=2, keepdims=True))).ravel() + np.abs(offsets)
        E, density = stiffest(beam.across, np.arange(mesh.nelements))
        extent, augmented = float(np.hypot(*np.ptp(mesh.p, axis=1))), self.method == "augmented"
        k = self.penalty or E / h * min(1.0, h**4 / (12.0 * (SPREAD * extent)**4))
        factor = 1.0 if self.penalty or augmented else LARGEST_FACTOR * max(1.0, E / (h * k))
        law = Law(k, self.width or WIDTH * h, self.friction, self.damping,
                  HARDER * density * h * augmented, float(radius.max()),
                  -1.0 if self.shape.hollow else 1.0, self.tolerance * augmented)
        return Group(nodes, weights, slopes, areas, offsets, starts, mesh.nelements + 2, m,
                     np.inf if self.shape.inner == np.inf else THROUGH * min(h, self.shape.inner),
                     h, law, factor)

    def _points(self, beam, first, X, w, tind):
        """Data of a Group for points of both sides of all elements, or of an end."""
        mesh, mapping = beam.mesh, beam.mesh.mapping()
        elements = np.arange(mesh.nelements) if tind is None else tind
        n, m = len(elements), X.shape[1]
        offsets, slopes = np.zeros((n, m)), np.zeros((0, n * m))
        at, starts = X, np.zeros((4, n, m))
        if not beam.has_sections:
            offsets[:] = mapping.offset(X, elements)
            at = np.array([X[0], np.full(m, 0.5)])
            G, frame = beam_gradients(mesh, beam.element, at, elements)
            slopes = np.moveaxis(G[0], -1, 0).reshape(-1, n * m)
            starts[2:] = np.moveaxis(frame[0], -1, 0)
        starts[:2] = mapping.F(at, elements)
        weights = beam.element.values(mapping, at, elements)
        if tind is None:  # lengths of both sides, by xi, and their widths
            half, length = m // 2, np.hypot(*mapping.DF(at, elements)[:, 0])
            width = [np.broadcast_to(face_width(beam.across, side, part, elements), (n, half))
                     for side, part in ((0, X[:, :half]), (1, X[:, half:]))]
            areas = w * length * np.concatenate(width, axis=1)
        else:
            areas = w * mapping.height(X[0], elements)[0] * beam.across.outline(X, elements)
        nodes = first + mesh.t[0, elements] * beam.nd
        return (np.repeat(nodes, m), weights.reshape(-1, n * m), slopes,
                np.broadcast_to(areas, (n, m)).ravel(), offsets.ravel(), starts.reshape(4, -1))

    def __repr__(self) -> str:
        return f"<Obstacle {self.shape!r}>"


def stiffest(across: Any, elements: Array) -> tuple[float, float]:
    """Largest modulus and largest density of the layers at mid-element."""
    E, density = [], []
    for layer in across.layers:
        X = np.array([[0.5], layer.measure.gauss(1)[0]])
        E.append(np.max(layer.material.E * across.grade(layer, X, elements)))
        density.append(0.0 if layer.density is None else np.max(across.density(layer, X, elements)))
    return float(max(E)), float(max(density))


def face_width(across: Any, side: int, X: Array, elements: Array) -> Any:
    """Width of bottom or top; the largest width of a section without faces, as a circle."""
    layer = across.layers[-side]
    if layer.face is not None and layer.face[side] == 0.0:
        return across.outline(X, elements)
    return across.face(side, X, elements)


def lobatto(n: int) -> tuple[Array, Array]:
    """Gauss-Lobatto points and weights on [0, 1]."""
    x = gauss_lobatto(n)
    P = np.polynomial.legendre.Legendre.basis(n - 1)(x)
    return 0.5 * (x + 1.0), 1.0 / (n * (n - 1) * P**2)
