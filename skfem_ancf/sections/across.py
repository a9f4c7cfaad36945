"""The section of one beam on its mesh: weights, stiffnesses, shear, inertias, jumps."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial, reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebinterpolate, chebval
from numpy.polynomial.legendre import legvander

from ..core import Array, Immutable, Rule, gauss, lagrange, refuse
from ..elements.base import ElementBeam
from ..materials import Material
from ..mesh.mesh_beam import MeshBeam
from .section import Layer, Rectangle, Section, evaluated

# places at which a function of material coordinates jumps along the axis

#: Distance from element ends at which functions are evaluated, relative to the length.
SIDE = 1e-7

#: Smallest jumps: of a function relative to its largest value, of the slope of the height, and of
#: the height times the curvature of the axis.
JUMP, KINK, BEND = 1e-3, 0.02, 0.05

#: Intervals of an element in which a jump is looked for, and how often one is halved.
INTERVALS, HALVED = 32, 50
#: Smallest distance of a jump from a node, relative to the length of the element.
INSIDE = 1e-5


class Pieces(NamedTuple):
    """Parts of elements from ``begin`` to ``end`` (n,), in xi, in order along the beam."""

    elements: Array
    begin: Array
    end: Array


def off_ends(X: Array) -> Array:
    """Reference points (2, ...), with those at element ends moved slightly inside."""
    return np.array([np.clip(X[0], SIDE, 1.0 - SIDE), X[1]])


def jumps(ask: Callable[[Array, Array], Array], n: int, eta: Array, size: float | None = None
          ) -> Array:
    """Elements at whose start a function ``ask(X, e)`` of reference points (2, n, k) jumps, by more
    than ``size`` or 1e-3 of its largest value."""
    e = np.arange(n)
    left, right = (ask(np.array([np.full((n, len(eta)), xi), np.tile(eta, (n, 1))]), e)
                   for xi in (SIDE, 1.0 - SIDE))
    axes = tuple(k for k in range(left.ndim) if k != left.ndim - 2)
    if size is None:
        size = JUMP * max(np.max(np.abs(left)), np.max(np.abs(right)))
    gap = np.max(np.abs(left[..., 1:, :] - right[..., :-1, :]), axis=axes, initial=0.0)
    return np.nonzero(gap > size)[0] + 1.0


def pieces(ask: Callable[[Array, Array], Array], e: Array, eta: float = 0.5) -> Pieces:
    """Elements e (n,) divided where a function jumps inside them; ``ask`` as for :func:`jumps`."""
    def at(xi, e):
        found = ask(np.array([xi, np.full(xi.shape, eta)]), e)
        return found.reshape(-1, *found.shape[-2:])

    grid = np.clip(np.linspace(0.0, 1.0, INTERVALS + 1), SIDE, 1.0 - SIDE)
    values = at(np.tile(grid, (len(e), 1)), e)
    size, steps = JUMP * np.max(np.abs(values), initial=0.0), np.diff(values, axis=-1)
    around = np.pad(steps, ((0, 0), (0, 0), (1, 1)), mode="edge")
    bent = np.abs(steps - 0.5 * (around[..., :-2] + around[..., 2:])).max(axis=0, initial=0.0)
    k, i = np.nonzero(bent > size)
    ends = np.array([grid[i], grid[i + 1]])
    sides = np.array([values[:, k, i], values[:, k, i + 1]])
    for _ in range(HALVED if len(k) else 0):
        middle = 0.5 * (ends[0] + ends[1])
        value = at(middle[:, None], e[k])[..., 0]
        near = np.abs(sides - value).max(axis=1).argmin(axis=0)  # the end that moves there
        n = np.arange(len(k))
        ends[near, n], sides[near, :, n] = middle, value.T
        on = np.abs(sides[1] - sides[0]).max(axis=0) > size
        k, ends, sides = k[on], ends[:, on], sides[..., on]
    where = 0.5 * (ends[0] + ends[1])
    on = (where > INSIDE) & (where < 1.0 - INSIDE)
    rows = np.concatenate([np.arange(len(e)), k[on]])
    begin = np.concatenate([np.zeros(len(e)), where[on]])
    order = np.lexsort((begin, rows))
    rows, begin = rows[order], begin[order]
    last = np.append(rows[1:] != rows[:-1], True)
    return Pieces(e[rows], begin, np.where(last, 1.0, np.append(begin[1:], 1.0)))


# shear correction of sections other than rectangles of one material

#: Points in each interval of a section.
SHEAR_POINTS = 24


def shear_factor(layers: Sequence[Layer], order: int) -> float:
    """Factor on the shear moduli of a section whose shear strain is a polynomial across it."""
    # The shear stress in bending is ``b tau = Q S / (E I)`` (Jourawski), with S the E-weighted
    # first moment of the area beyond. Sections of order N >= 1 represent it by polynomials of
    # degree N - 1, the best fit to ``tau / G`` in the energy, and are too stiff by the energy of
    # the remainder. A rectangle has 5/6 for N = 1 and 2, and 1 from N = 3 on.
    t, w = gauss(SHEAR_POINTS)
    till = np.array([b * (gauss(SHEAR_POINTS)[1] @ lagrange(t, b * t)) for b in t])
    found, one = [], np.ones(SHEAR_POINTS)
    for layer in layers:  # points in each interval with weights, widths and moduli
        law, m = layer.material, layer.measure
        for piece in m.pieces:
            eta, dy, width = piece.rule(SHEAR_POINTS)
            found.append((eta, dy, width * layer.width / m.mean, law.axial_modulus * one,
                          law.G * one))
    y, dy, b, E, G = (np.array(rows) for rows in zip(*found))
    EA = np.sum(dy * b * E)
    first = E * b * (y - np.sum(dy * b * E * y) / EA)
    S = np.cumsum(np.append(0.0, np.sum(dy * first, axis=1)))[:-1, None] + (
        first * dy / w) @ till.T
    tau, p = S / b, legvander(2.0 * y.ravel() - 1.0, order - 1)
    A = p.T @ ((dy * b * G).ravel()[:, None] * p)
    r = p.T @ (dy * b * tau).ravel()
    return float(r @ np.linalg.solve(A, r) / np.sum(dy * b * tau**2 / G))


#: Points across a layer for areas and moments.
POINTS = 4

#: Tolerance of interfaces, relative to the height.
EDGE = 1e-12

#: Functions of a layer and their names in messages.
NAMES = {"width": "width", "grade": "E", "density": "density"}

#: Moduli and factors of the integrals of :meth:`Across.moments`.
MODULI = {"stiffness": "axial_modulus", "E": "E"}
TIMES = {"stiffness": "grade", "E": "grade", "mass": "density", "area": ""}


class LayerPoints:
    """Points of a layer, from :meth:`Across.at`."""

    def __init__(self, across: "Across", layer: Layer, X: Array, tind: Array | None = None) -> None:
        self.across, self.layer, self.X, self.tind = across, layer, X, tind

    def moved(self, X: Array) -> "LayerPoints":
        """The same layer at other points, (2, npoints) or (2, nelements, npoints)."""
        return LayerPoints(self.across, self.layer, X, self.tind)

    @property
    def heights(self) -> Array:
        """Height of the section at the points, shape (nelements, npoints)."""
        return self.across.heights(self.X[0], self.tind)

    def evaluated(self, name: str) -> Array:
        """Values of a function of the layer named in :data:`NAMES`, (nelements, npoints)."""
        return evaluated(NAMES[name], getattr(self.layer, name),
                     *self.across.coordinates(self.X, self.tind))

    def factor(self, name: str, whole: bool = False) -> Any:
        """A property of the layer: a number, values at the points, or means over the section."""
        value = getattr(self.layer, name)
        if callable(value):
            return self.layer.measure.values(self, name, whole)
        if value is not None:
            return value
        refuse(name == "density", "{!r} has no density: give one to use mass or gravity",
               self.layer.material)
        return 1.0


class Across(Immutable):
    """A :class:`~skfem_ancf.sections.Section` on the mesh of a beam.

    Values at points have shape (nelements, npoints), or are numbers where they are constant.

    Parameters
    ----------
    mesh, element
        Mesh and element of the beam.
    section
        A Section.
    material
        Material of the beam; None if the section has materials.

    Other Parameters
    ----------------
    layer
        One of :attr:`layers`.
    X
        Reference points, shape (2, npoints) or (2, nelements, npoints).
    xi
        Axial coordinates in [0, 1], shape (npoints,) or (nelements, npoints).
    tind
        Elements, shape (nelements,), or None for all.
    whole
        Use means over the section: each point represents a whole section.
    times
        "grade" or "density" weights the integral by it; "" gives areas and volumes.

    Attributes
    ----------
    layers
        A tuple of :class:`~skfem_ancf.sections.section.Layer`, from bottom to top.
    plain, simple : bool
        A rectangle of constant width and one material; the same on a mesh of constant height.
    constant, uniform : bool
        The section is constant along the beam; one table serves all elements.
    moving : bool
        Interfaces of layers lie at different relative heights along the beam.
    """

    def __init__(self, mesh: MeshBeam, element: ElementBeam, section: Section,
                 material: Material | None) -> None:
        self.mesh, self.element = mesh, element
        self.layers: tuple[Layer, ...] = tuple(
            s if (measure := s.measure.of_order(element.order)) is s.measure else
            replace(s, measure=measure) for s in section.layers_on(mesh, material))
        varying, even = any(s.varies for s in self.layers), mesh.heights is None
        self.plain = isinstance(section, Rectangle) and not varying
        self.simple = self.plain and even
        self.constant = even and not varying
        self.uniform = self.constant and mesh.is_uniform
        self.moving = any(s.measure.moves for s in self.layers)
        if varying:  # evaluate all functions over the body, so that errors appear here
            X = np.array(np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 9))).reshape(2, -1)
            for layer in self.layers:
                low, *_, high = self._ends(layer, X[0])
                inside = self.at(layer, np.array([X[0] + 0.0 * low, low + (high - low) * X[1]]))
                for name in NAMES:
                    if callable(getattr(layer, name)):
                        inside.evaluated(name)

    @cached_property
    def jumps(self) -> Array:
        """Elements that begin with a jump of width, E, density, slope of the height or curvature.
        See :func:`~.across.jumps`."""
        n, found = self.mesh.nelements, [np.zeros(0)]
        for layer in self.layers:
            eta = np.linspace(layer.measure.low, layer.measure.high, POINTS + 1)
            found += [jumps(partial(self._given, name, layer), n, eta)
                      for name in NAMES if callable(getattr(layer, name))]
        if self.mesh.heights is not None:
            found.append(jumps(lambda X, e: self.mesh.mapping().height(X[0], e)[1]
                               / self.mesh.lengths[e, None], n, np.array([0.5]), KINK))
        return np.unique(np.concatenate([*found, self.bends]))

    @cached_property
    def bends(self) -> Array:
        """Elements that begin with a jump of the axis' curvature, from its cubic interpolation."""
        mesh = self.mesh
        if mesh.is_straight:
            return np.zeros(0)
        axis = mesh if mesh.sections == "linear" else mesh.with_sections("cubic")
        return jumps(axis.mapping().curvature, mesh.nelements, np.array([0.5]), BEND / mesh.height)

    def _given(self, name, layer, X, tind):
        return layer.measure.values(self.at(layer, X, tind), name)

    # points

    def coordinates(self, X: Array, tind: Array | None = None) -> tuple[Array, Array]:
        """Material coordinates: x, the parameter of the axis, and y, the distance from the axis."""
        s, t = self.mesh.parameters, self.mesh.t if tind is None else self.mesh.t[:, tind]
        a, b = s[t][:, :, None]
        x = a + np.asarray(X[0]) * (b - a)
        return x, np.broadcast_to(self.mesh.mapping().offset(X, tind), x.shape)

    def heights(self, xi: Array, tind: Array | None = None) -> Array:
        """Section heights at axial coordinates xi."""
        return self.mesh.mapping().height(xi, tind)[0]

    def _ends(self, layer, xi):
        """Interfaces of the intervals of a layer at axial coordinates, (npieces + 1, ...)."""
        return layer.measure.ends(self.heights(xi)) if self.moving else layer.measure.highest

    def which(self, X: Array, tind: Array | None = None) -> Array:
        """Layer number at points (2, ...); an interface belongs to the layer above it."""
        if self.moving:
            h = self.heights(X[0], tind)
            return sum((X[1] >= s.measure.ends(h)[-1] for s in self.layers[:-1]),
                       np.zeros(h.shape, dtype=int))
        tops = np.array([s.measure.high for s in self.layers[:-1]])
        return np.searchsorted(tops - EDGE, np.asarray(X[1]), side="right")

    def of_layers(self, X: Array, like: Array, of: Callable[[int], Array],
                  tind: Array | None = None, graded: bool = True) -> Array:
        """Assemble a field that each layer defines.

        Parameters
        ----------
        like
            An array of the field's shape, (..., nelements, npoints).
        of
            Function of the layer number that returns the field of that layer at all points.
        graded
            Multiply by the grade, as for quantities proportional to the energy.
        """
        if len(self.layers) == 1:
            graded = graded and self.layers[0].grade is not None
            return of(0) * self.grade(self.layers[0], X, tind) if graded else of(0)
        which = np.broadcast_to(self.which(X, tind), like.shape[-2:])
        out = np.empty(like.shape, like.dtype)
        for k, layer in enumerate(self.layers):
            on = which == k
            if np.any(on):
                found = of(k) * (self.grade(layer, X, tind) if graded else 1.0)
                out[..., on] = np.broadcast_to(found, like.shape)[..., on]
        return out

    def at(self, layer: Layer, X: Array, tind: Array | None = None) -> LayerPoints:
        """A layer at points, as its measure takes them."""
        return LayerPoints(self, layer, X, tind)

    def volume(self, layer: Layer, X: Array, W: Array, tind: Array | None = None,
               whole: bool = False, times: str = "", full: bool = False) -> Array:
        """Integration weights (volumes) of the points of a layer's rule.

        Parameters
        ----------
        W
            Weights on the reference cell, (npoints,).
        full
            Use section directors of unit length between nodes too, see
            :meth:`~skfem_ancf.mesh.mapping.MappingBeam.full_volume`.
        """
        mapping = self.mesh.mapping()
        of_cell = (mapping.full_volume if full else mapping.detDF)(X, tind)
        return self.breadth(layer, X, tind, whole, times) * W * of_cell

    def breadth(self, layer: Layer, X: Array, tind: Array | None = None, whole: bool = False,
                times: str = "") -> Any:
        """Area over height: the factor on the weights of a rule, whose sum is 1."""
        return layer.measure.breadth(self.at(layer, X, tind), whole, times)

    def width(self, layer: Layer, X: Array, tind: Array | None = None) -> Any:
        """Width at points of a layer."""
        return layer.measure.width(self.at(layer, X, tind))

    def grade(self, layer: Layer, X: Array, tind: Array | None = None) -> Any:
        """Factor on the energy density of a layer at points."""
        return self.at(layer, X, tind).factor("grade")

    def density(self, layer: Layer, X: Array, tind: Array | None = None) -> Any:
        """Mass per volume of a layer at points; InputError if its material has none."""
        return self.at(layer, X, tind).factor("density")

    def face(self, side: int, X: Array, tind: Array | None = None) -> Any:
        """Width of the bottom or the top face; InputError for a circle, which has none.

        Parameters
        ----------
        side
            0 for the bottom, 1 for the top.
        """
        layer = self.layers[-side]
        if layer.face is None:
            return self.width(layer, X, tind)
        refuse(layer.face[side] == 0.0, "this section has no width at its bottom and its top: load "
               "the axis, by scene.line_load")
        return layer.face[side]

    def outline(self, X: Array, tind: Array | None = None) -> Any:
        """Largest width of the section at points of the axis; for a function that at the point."""
        widths = (s.measure.outline(self.at(s, X, tind)) for s in self.layers)
        return reduce(np.maximum, widths, 0.0 * X[0])

    def ends(self, xi: Array | None = None) -> Array:
        """Ends of the intervals of one law and smooth width, bottom to top, (npieces + 1, ...).
        They are evaluated at axial coordinates xi (npoints,), or at the largest height for None."""
        found = [layer.measure.highest if xi is None else self._ends(layer, xi)
                 for layer in self.layers]
        return np.concatenate([found[0][:1], *(end[1:] for end in found)])

    # rules

    def rules(self, n: int, inertia: bool = False) -> list[tuple[Layer, Rule]]:
        """Pairs of each layer and its rule of n points across it.

        Parameters
        ----------
        n, inertia
            Number of points; True for the rules of the mass.
        """
        return [(layer, (layer.inertia if inertia and layer.inertia is not None else
                        layer.measure).gauss(n)) for layer in self.layers]

    def points(self, layer: Layer, e: Array, xi: Array, n: int) -> tuple[Array, Array]:
        """Points across a layer and their weights times the breadth, (nsections, q).

        Parameters
        ----------
        e, xi, n
            Elements and axial coordinates of the sections, shapes (nsections,); least number of
            points.
        """
        return layer.measure.sampled(self.at(layer, np.repeat(xi[None, :, None], 2, 0), e), n)

    def terms(self, formulation: Any) -> list[tuple[Layer, list[Any]]]:
        """Pairs of each layer and the terms of its strain energy in a formulation."""
        out = []
        for layer in self.layers:
            terms = list(formulation.terms(self.element_of(layer), layer.material))
            refuse(not terms, "terms(element, material) of {!r} must return a Term", formulation)
            out.append((layer, terms))
            if self.plain:
                return out
            eta, w = layer.measure.gauss(2)
            for term in terms:
                refuse(self.element.order and term.section_samples is not None
                       and layer.measure.moves, "formulation {!r} at order {} does not fit a taper "
                       "with constant thicknesses: use order 2 or more with 'assumed' or "
                       "'continuum', or nu = 0", formulation.name, self.element.order)
                (x, v), degree = term.section, max(layer.measure.spent, 1)
                off = v @ legvander(2.0 * x - 1.0, degree) - w @ legvander(2.0 * eta - 1.0, degree)
                refuse(len(x) > 1 and np.max(np.abs(off)) > 1e-9, "a rule of {!r} does not fit "
                       "{!r}: use self.full_rules(element)", formulation.name, layer.measure)
        return out

    def element_of(self, layer: Layer) -> ElementBeam:
        """The element with the rules across a layer, as formulations take it."""
        return self.element if self.plain else self.element.measured(layer.measure, self.shear)

    @cached_property
    def shear(self) -> float | None:
        """Shear factor for the element; None for a rectangle of one material."""
        if self.plain or self.element.order == 0 or any(s.varies for s in self.layers):
            return None
        if not self.moving:
            return shear_factor(self.layers, self.element.order)

        # a constant factor with the shear compliance of the varying sections under a uniform shear
        # force
        def at(height: float) -> tuple[float, float]:
            layers = [replace(s, measure=m, width=s.width * m.mean) for s, m in (
                (s, s.measure.at(height)) for s in self.layers)]
            return shear_factor(layers, self.element.order), height * sum(
                s.material.G * s.width for s in layers)

        heights: Any = self.mesh.heights
        high = self.mesh.height
        low = min(float(np.min(heights)), (1.0 - 1e-6) * high)
        factor, GA = (chebinterpolate(np.vectorize(partial(
            lambda z, k: at(low + (high - low) * (z + 1.0) / 2.0)[k], k=k)), 7)
            for k in range(2))
        x, w = gauss(POINTS)
        z = np.clip(2.0 * (self.heights(x) - low) / (high - low) - 1.0, -1.0, 1.0)
        soft = w * self.mesh.lengths[:, None] / chebval(z, GA)
        return float(np.sum(soft) / np.sum(soft / chebval(z, factor)))

    def stabilisation(self, formulation: Any) -> Array | None:
        """Stabilisation matrix of a formulation, (1 or nelements, 2 nb, 2 nb), or None. It is
        computed for unit width and the largest height, and is proportional to the width."""
        first = self.layers[0]
        K = formulation.stabilisation(self.mesh, self.element, first.material, 1.0)
        if K is None:
            return None
        if self.simple:
            return K * first.width
        width = 12.0 * self.bending / (first.material.E * self.mesh.height**3)
        return K * width[:, None, None]

    # integrals over the section

    def moments(self, xi: Array, tind: Array | None = None, what: str = "stiffness") -> Array:
        """Integrals of a quantity times 1, Y and Y^2 over the section, (3, nelements, npoints).

        Parameters
        ----------
        what
            "stiffness": the axial modulus, which gives EA, ES and EI; "E": Young's modulus; "mass":
            the density; "area": 1.
        """
        ne, n = self.mesh.nelements if tind is None else len(tind), xi.shape[-1]
        if self.plain:
            layer, h, out = self.layers[0], self.heights(xi, tind), np.zeros((3, ne, n))
            times = self.at(layer, xi).factor(TIMES[what]) if TIMES[what] else 1.0
            if what in MODULI:
                times = times * getattr(layer.material, MODULI[what])
            out[0] = size = h * layer.width * times
            out[2] = size * h * h / 12.0
            return out
        mapping, out = self.mesh.mapping(), np.zeros((3, ne, n))
        for layer, (eta, w) in self.rules(POINTS, what == "mass"):
            X = np.array(np.broadcast_arrays(np.repeat(xi, len(eta), -1), np.tile(eta, n)))
            h, y = mapping.height(X[0], tind)[0], mapping.offset(X, tind)
            size = np.tile(w, n) * h * self.breadth(layer, X, tind, times=TIMES[what])
            if what in MODULI:
                size = size * getattr(layer.material, MODULI[what])
            size, y = (np.broadcast_to(a, (ne, X.shape[-1])).reshape(ne, n, -1) for a in (size, y))
            out += np.array([np.sum(size * y**k, axis=-1) for k in range(3)])
        out[1, np.abs(out[1]) <= 1e-13 * np.sqrt(out[0] * out[2])] = 0.0  # as symmetric as it is
        return out

    @cached_property
    def bending(self) -> Array:
        """Bending stiffness E I about the centroid at mid-element, (nelements,) or (1,)."""
        tind = np.zeros(1, dtype=int) if self.uniform else None
        EA, ES, EI = self.moments(np.array([0.5]), tind, "E")[:, :, 0]
        return EI - ES**2 / EA
