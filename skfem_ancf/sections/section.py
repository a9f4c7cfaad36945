"""Sections: rectangles, bonded layers, profiles, and sections given by stiffnesses. A section is a
list of layers from bottom to top, each with a material, a width, and a measure b(Y) dY, fixed or
moving, whose Gauss rules integrate across it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import legval, legvander

from ..core import (Array, CallError, Immutable, InputError, Rule, ask_array, gauss, refuse,
                    refuse_any, require_flag, require_option, require_positive, shown)
from ..elements.base import ElementBeam
from ..materials import Material
from ..materials.library import LENGTHS
from ..materials.pointwise import PlaneSections
from ..mesh.mesh_beam import MeshBeam
from .library import pieces_of

#: Additional points where the width is not a polynomial of Y.
MORE = 4


class Piece(NamedTuple):
    """An interval with smooth width, a number or a function of eta (n,); at its ends maybe a square
    root."""

    low: float
    high: float
    width: float | Callable[[Array], Array]

    def rule(self, n: int) -> tuple[Array, Array, Array]:
        """Points (n,), weights and widths; square roots at the ends are smooth in their angle."""
        (t, w), half = gauss(n), 0.5 * (self.high - self.low)
        eta = 0.5 * (self.low + self.high) - half * np.cos(np.pi * t)
        return (eta, half * np.sin(np.pi * t) * np.pi * w,
                self.width(eta) if callable(self.width) else self.width + 0.0 * eta)


class Measure(Immutable):
    """Width and quadrature across a layer, between relative heights ``low`` and ``high``. Rules use
    up the degree ``spent`` of exactness on the width. Methods take points from :meth:`.Across.at`.
    """

    low: float
    high: float
    pieces: tuple[Piece, ...]
    spent: int = 0
    moves = False

    def gauss(self, n: int) -> Rule:
        """Points eta (m,) and weights (m,) of sum 1, exact to degree 2 n - 1."""
        raise NotImplementedError

    def of_order(self, order: int) -> "Measure":
        """The measure for elements of order N, whose strain energy has degree 4 N across."""
        return self

    def at(self, height: float) -> "Measure":
        return self

    @property
    def highest(self) -> Array:
        """Interval ends at the largest height, bottom to top, (n + 1,)."""
        return np.array([self.pieces[0].low, *(p.high for p in self.pieces)])

    def ends(self, h: Array) -> Array:
        """Interval ends at heights h (...), (npieces + 1, ...)."""
        return np.multiply.outer(self.highest, np.ones(h.shape))

    def values(self, at: Any, name: str, whole: bool = False) -> Array:
        """A function of the layer at points, or with ``whole`` its means over the sections."""
        if not whole:
            return at.evaluated(name)
        X, (eta, w) = at.X, self.gauss(8)
        points = np.array([np.repeat(X[0][..., None], len(eta), -1),
                           np.broadcast_to(eta, X[0].shape + eta.shape)])
        values = at.moved(points.reshape(X.shape[:-1] + (-1,))).evaluated(name)
        return values.reshape(values.shape[0], -1, len(eta)) @ w

    def breadth(self, at: Any, whole: bool = False, times: str = "") -> Any:
        """Factor on the weights of rules: area over height, or a weighted integral over height."""
        layer, mesh, size = at.layer, at.across.mesh, at.factor("width", whole)
        if callable(layer.width):
            size = size * layer.part
        elif layer.by_height and mesh.heights is not None:
            size = size * at.heights / mesh.height
        return size * at.factor(times, whole) if times else size

    def width(self, at: Any) -> Any:
        return self.breadth(at) / at.layer.part

    def outline(self, at: Any) -> Any:
        """Largest width of the sections; for a function the width at the points."""
        layer = at.layer
        scale = layer.outer * layer.part / layer.width if layer.outer else 1.0
        return scale * self.breadth(at) / layer.part

    def sampled(self, at: Any, n: int) -> tuple[Array, Array]:
        """At least n points across each section and weights times the breadth, (nsections, q)."""
        eta, w = self.gauss(n)
        eta = np.repeat(eta[None], at.X.shape[1], 0)
        return eta, self.breadth(at.moved(np.array([at.X[0] + 0.0 * eta, eta]))) * w + 0.0 * eta


class Uniform(Measure):
    """Constant width: Gauss rules with ``more`` points than requested."""

    def __init__(self, low: float = 0.0, high: float = 1.0, more: int = 0) -> None:
        self.low, self.high, self.more = low, high, more
        self.pieces, self.mean = (Piece(low, high, 1.0),), high - low

    def gauss(self, n: int) -> Rule:
        x, w = gauss(n + self.more if n > 1 else n)
        return (x if (self.low, self.high) == (0.0, 1.0) else
                self.low + (self.high - self.low) * x), w

    def __repr__(self) -> str:
        return f"<one width from {self.low:.4g} to {self.high:.4g} of the height>"


#: The measure of a full section.
WHOLE = Uniform()


class Weighted(Measure):
    """Width that varies across: Gauss rules of the measure b(Y) dY. They are exact, to round-off,
    for polynomials of degree 2 n - 1 times the width, jumps and square roots at the ends of circles
    included. The measure is discretised interval by interval with ``Y = middle - half cos t`` and
    Gauss points in t (Gautschi: "Orthogonal Polynomials: Computation and Approximation", Oxford
    University Press, 2004)."""

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self.pieces = tuple(pieces)
        self.low, self.high = self.pieces[0].low, self.pieces[-1].high
        #: Integral of the width over eta, the mean width of a section that fills [0, 1].
        self.mean = float(np.sum(self._discrete(20)[1]))

    def __repr__(self) -> str:
        return f"<{len(self.pieces)} widths, one above the other>"

    def _discrete(self, n):
        """Points and weights of the discretised measure, exact for degree n."""
        eta, w, b = map(np.concatenate, zip(*(piece.rule(n + 40) for piece in self.pieces)))
        return eta, w * b

    def gauss(self, n: int) -> Rule:
        x, w = self._discrete(2 * n)
        # Golub and Welsch: eigenvalues of the product with eta of orthonormal polynomials
        Q, _ = np.linalg.qr(np.sqrt(w / np.sum(w))[:, None] * legvander(2.0 * x - 1.0, n - 1))
        points, vectors = np.linalg.eigh(Q.T @ (x[:, None] * Q))
        return points, vectors[0] ** 2


# tapered sections with constant thicknesses: their interfaces move in relative height

#: Least degree of the series of a width, and additional points for a square root.
LEAST, ROUND = 8, 40


class Moving(Measure):
    """Width with interval ends ``a + b / h``: constant thicknesses on a varying height.
    Formulations sample strains at constant relative heights, so the points eta are the same along
    the beam and the weights vary: Gauss weights times the Legendre series of the width, which
    reproduces its moments up to ``degree``. Single weights may be negative."""

    low, high, moves = 0.0, 1.0, True

    def __repr__(self) -> str:
        return f"<{len(self.pieces)} widths, whose thicknesses stay along a taper>"

    def __init__(self, pieces_of: Callable[[Any], Sequence[Piece]], height: float,
                 degree: int = LEAST) -> None:
        self.pieces_of, self.height, self.degree = pieces_of, height, degree
        largest = self.at(height)
        self.pieces, self.mean = largest.pieces, largest.mean
        self.spent = 2 * ((degree + 1) // 2)

    def of_order(self, order: int) -> "Moving":
        return Moving(self.pieces_of, self.height, max(LEAST, 4 * order))

    def at(self, height: float) -> Weighted:
        return Weighted(self.pieces_of(height))

    def gauss(self, n: int) -> Rule:
        """Points eta and weights, exact to degree 2 n - 1 times the series; one for n = 1."""
        if n == 1:
            return np.array([0.5 * (self.pieces[0].low + self.pieces[-1].high)]), np.ones(1)
        return gauss(n + (self.degree + 1) // 2)

    def ends(self, h: Array) -> Array:
        found = self.pieces_of(h[..., None])
        return np.array([np.broadcast_to(end, h.shape + (1,))[..., 0]
                         for end in (found[0].low, *(p.high for p in found))])

    def values(self, at: Any, name: str, whole: bool = False) -> Array:
        low, *_, high = self.ends(at.heights)  # points outside of the layer are moved to its ends
        return at.moved(np.array([np.broadcast_to(at.X[0], low.shape),
                                  np.clip(at.X[1], low, high)])).evaluated(name)

    def width(self, at: Any) -> Array:
        eta, h = (x[..., None] for x in np.broadcast_arrays(at.X[1], at.heights))
        found = self.pieces_of(h)
        out = 0.0 * eta
        for piece in found:
            inside = (eta >= piece.low) & (eta < piece.high if piece is not found[-1] else True)
            out = np.where(inside, piece.width(eta) if callable(piece.width) else piece.width, out)
        return at.factor("width") * out[..., 0]

    def outline(self, at: Any) -> Any:
        if at.layer.by_height:  # a tube
            return at.heights
        return at.layer.outer or at.factor("width")

    def breadth(self, at: Any, whole: bool = False, times: str = "") -> Array:
        xi = np.asarray(at.X[0])
        back: Any = slice(None)
        if xi.ndim == 1:
            xi, back = np.unique(xi, return_inverse=True)
        elif np.all(xi == xi[:, :1]):
            xi, back = xi[:, :1], np.zeros(xi.shape[1], dtype=int)
        names = ("width", times) if times else ("width",)
        functions = [name for name in names if callable(getattr(at.layer, name))]
        # coefficients (degree + 1, ...) of the Legendre series of the width times the functions
        eta, w = self.points(at.across.heights(xi, at.tind),
                             self.degree // 2 + 1 + (2 * MORE if functions else 0))
        if functions:
            X = np.array([np.broadcast_to(xi[..., None], eta.shape), eta])
            there = at.moved(X.reshape(2, len(eta), -1))
            values = np.prod([there.evaluated(name) for name in functions], axis=0)
            w = w * values.reshape(eta.shape)
        c = (2 * np.arange(self.degree + 1) + 1) * np.einsum(
            "...q,...qk->...k", w, legvander(2.0 * eta - 1.0, self.degree))
        c = np.moveaxis(c, -1, 0) * np.prod([at.factor(name) for name in names
                                             if name not in functions])
        return c[0][:, back] if whole else legval(2.0 * np.asarray(at.X[1]) - 1.0, c[:, :, back],
                                                  tensor=False)

    def sampled(self, at: Any, n: int) -> tuple[Array, Array]:
        eta, w = self.points(at.heights[:, 0], n)
        there = at.moved(np.array([at.X[0] + 0.0 * eta, eta]))
        return eta, w * (there.evaluated("width") if callable(at.layer.width) else at.layer.width)

    def points(self, h: Array, n: int) -> tuple[Array, Array]:
        """n points in each interval of smooth width, and weights that include it, (..., q)."""
        places, weights = [], []
        for low, high, width in self.pieces_of(h[..., None]):
            t, w = gauss(n + ROUND * callable(width))
            if callable(width):  # its square roots at the ends are smooth in an angle
                t, w = 0.5 - 0.5 * np.cos(np.pi * t), 0.5 * np.pi * np.sin(np.pi * t) * w
            eta = low + (high - low) * t + 0.0 * h[..., None]
            places.append(eta)
            weights.append((high - low) * w * (width(eta) if callable(width) else width)
                           + 0.0 * eta)
        return np.concatenate(places, axis=-1), np.concatenate(weights, axis=-1)


@dataclass(frozen=True)
class Layer:
    """A layer of a section.

    Attributes
    ----------
    material
        Its material, with constant properties.
    width
        Area over the height of the beam: a number, or a function of material coordinates (x, y).
    measure
        Its quadrature across, with eta in [0, 1].
    face
        Widths of its bottom and top face; None for ``width``.
    outer
        Its largest width; None for ``width``.
    by_height
        The width is proportional to the height of a tapered beam.
    grade
        A function of (x, y) that multiplies the energy density, or None.
    density
        Mass per volume: a number, a function of (x, y), or None.
    inertia
        The measure of its mass, if it differs from ``measure``.
    shear
        Factor on the shear modulus for the shear stress in equilibrium with bending.
    """

    material: Material
    width: Any
    measure: Any
    face: tuple[float, float] | None = None
    outer: float | None = None
    by_height: bool = False
    grade: Callable[..., Any] | None = None
    density: Any = None
    inertia: Any = None
    shear: float = 1.0

    @property
    def part(self) -> float:
        """Thickness relative to the height of the beam."""
        return self.measure.high - self.measure.low

    @property
    def varies(self) -> bool:
        """True if a property is a function of material coordinates."""
        return callable(self.width) or callable(self.grade) or callable(self.density)


class Section(Immutable):
    """The cross-section of a beam, immutable.

    Use :meth:`profile`, :meth:`layers` or :meth:`numbers`, and pass the result to
    ``Beam(mesh, element, section=...)``. A user-defined subclass implements :meth:`layers_on`.

    Attributes
    ----------
    has_materials : bool
        The section has materials; the beam then takes none.
    has_fields : bool
        Strain and stress across it are defined; False for :meth:`numbers`.
    """

    has_materials = False
    has_fields = True

    @staticmethod
    def profile(name: str, scaled: bool = False, unit: str = "m", **sizes: float) -> "Section":
        """A profile of one material: by its standard name, or by sizes with the mesh's height.

        Standard profiles have their root radii and tapers, and a ``height``, for the mesh: "IPE
        200", "HEA 200", "HEB 200", "UPN 200" (EN 10365), "L 50x50x5" (EN 10056-1), "T 50" (EN
        10055), "RHS 100x50x4", "SHS 100x5" and "CHS 60.3x3.2" (EN 10210), "CFRHS", "CFSHS" and
        "CFCHS" (cold formed, EN 10219). They stand upright and bend about their horizontal axis; an
        L is taken as guided sideways.

        The rules across are Gauss rules of the width, exact to round-off for the polynomials of the
        element: see :class:`~skfem_ancf.sections.section.Weighted`. The axis is at half the height,
        which is not the centroid of a T: its extension and bending are coupled. Raises NameUnknown
        if the name is not known, CallError if it takes other sizes, InputError if a size is not
        positive or walls do not fit; for the height when the Beam is made.

        Parameters
        ----------
        name
            A standard name; or "rectangle" (width), "I" and "T" (width, web, flange; the flange of
            a T is at the top), "box" (width, wall), "tube" (wall) or "circle".
        scaled
            For tapered meshes. False: flanges and walls keep their thickness. True: sizes are those
            at the largest height, and the thickness of flanges and of the lower and upper walls of
            a box is proportional to the height; webs and widths are constant. A tube is scaled as a
            whole, a circle always.
        unit
            Unit of length of a standard profile: "m", "cm", "mm" or "in".
        **sizes
            Overall width, thickness of the web, of a flange and of the walls, in units of length.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Section, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850),
        ...             section=Section.profile("I", width=0.05, web=0.005, flange=0.008))
        >>> round(beam.total_mass, 6)  # (2 * 0.05 * 0.008 + 0.084 * 0.005) * 2 * 7850
        19.154
        >>> ipe = Section.profile("IPE 200")
        >>> beam = beam.replace(mesh=MeshBeam.init_line([0, 1], ipe.height), section=ipe)
        >>> round(beam.total_mass, 2)  # 22.4 kg per metre in the standard
        22.36
        """
        if name not in SIZES and any(c.isdigit() for c in str(name)):
            return Standard(name, unit, **sizes)
        return Profile(name, scaled, **sizes)

    @staticmethod
    def layers(*layers: Any, width: float | Callable[..., Any] | None = None) -> "Section":
        """Bonded layers from bottom to top, whose total thickness is the height of the mesh.

        Strains are continuous. Each layer has the stress of its material. Raises InputError if a
        layer is no such pair or is not positive; when the Beam is made, if the thicknesses do not
        add up to the height.

        Parameters
        ----------
        *layers
            Pairs of a thickness and a material; a third entry is the width of that layer. One
            thickness may be None: that layer fills the remaining height, which may vary along the
            mesh.
        width
            Width of the other layers: a positive number, or a function of material coordinates (x,
            y).

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Section, StVenantKirchhoff
        >>> steel, brass = (StVenantKirchhoff(E=E, nu=0.3, density=8000) for E in (2e11, 1e11))
        >>> strip = Section.layers((0.001, steel), (0.002, brass), width=0.01)
        >>> beam = Beam(MeshBeam.init_line([0, 1], height=0.003), ElementBeamANCF(2), section=strip)
        >>> round(beam.total_mass, 6)
        0.24
        """
        return Layers(*layers, width=width)

    @staticmethod
    def numbers(EA: float, EI: float, GA: float | None = None, rhoA: float | None = None,
                rhoI: float | None = None, width: float = 1.0) -> "Section":
        """A section given by stiffnesses and inertias about the axis: the beam of Reissner.

        Sections stay plane and keep their size. So an element with sections of a higher order is
        replaced by that of order 1 with the same axis; ``beam.element`` is the one in use. The
        formulation is "assumed". Raises InputError if a number is not positive; when the Beam is
        made, if a user-defined element has an order above 1. See Simo: "A finite strain beam
        formulation. The three-dimensional dynamic problem. Part I", Computer Methods in Applied
        Mechanics and Engineering 49 (1985).

        Parameters
        ----------
        EA, EI
            Axial and bending stiffness.
        GA
            Shear stiffness, shear factor included; None for that of a rectangle, 5/12 EA. A cable
            is rigid in shear and warns where the value would matter (ModelWarning).
        rhoA, rhoI
            Mass per length, and rotary inertia per length; rhoI is rhoA EI / EA by default.
        width
            Width of the faces, on which pressures and tractions act.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Section
        >>> beam = Beam(MeshBeam.init_line([0, 2], height=0.01), ElementBeamCable(5),
        ...             section=Section.numbers(EA=1e5, EI=2.0, rhoA=0.3))
        >>> round(beam.total_mass, 12)
        0.6
        """
        return Numbers(EA, EI, GA, rhoA, rhoI, width)

    def element_for(self, element: ElementBeam) -> ElementBeam:
        """The element of a beam with this section, from the one that the user gives."""
        return element

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        """The layers on the mesh of a beam, from bottom to top.

        Raises InputError if the section does not fit the height of the mesh.

        Parameters
        ----------
        mesh, material
            Those of the beam; the material is None if the section has materials.
        """
        raise NotImplementedError


class Rectangle(Section):
    """A full section of one width, as made by ``Beam(..., width=...)``.

    Parameters
    ----------
    width
        A positive number, or a function of material coordinates (x, y).
    """

    def __init__(self, width: float | Callable[..., Any]) -> None:
        self.width = width if callable(width) else require_positive("width", width)

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        return [layer_of(material, self.width)]

    def __repr__(self) -> str:
        return f"<rectangle of width {shown(self.width)}>"


def layer_of(material: Material, width: Any, measure: Any = None, **more: Any) -> Layer:
    """The Layer of a material, which may be graded; by default over the whole height."""
    uneven = callable(width) or material.graded
    if measure is None:
        measure = Uniform(more=MORE) if uneven else WHOLE
    elif uneven and isinstance(measure, Uniform):
        measure = Uniform(measure.low, measure.high, MORE)
    reference, grade = material.reference()
    return Layer(reference, width, measure, grade=grade, density=material.density, **more)


def evaluated(what: str, function: Callable[..., Any], x: Array, y: Array) -> Array:
    """Values of a function of material coordinates, checked to be positive; ``what`` names it."""
    x, y = (np.ascontiguousarray(a) for a in np.broadcast_arrays(x, y))
    out = ask_array(f"{what}(x, y)", x.shape, function, x, y, number=True)
    refuse_any(out.ravel() <= 0.0, "{}(x, y) must be positive, got {:.6g} at x = {:.6g}, y = "
               "{:.6g}", what, out.ravel(), x.ravel(), y.ravel())
    return out


#: Relative tolerance between the total thickness and the height of a mesh.
FILLS = 1e-9


class Layers(Section):
    """Bonded layers, see :meth:`Section.layers`."""

    has_materials = True

    def __init__(self, *parts: Any, width: float | Callable[..., Any] | None = None) -> None:
        refuse(not parts, "there are no layers: give some, as Section.layers((0.001, steel), "
               "(0.002, brass), width=0.01)")
        found = []
        for k, layer in enumerate(parts):
            refuse(not isinstance(layer, (tuple, list)) or len(layer) not in (2, 3)
                   or not isinstance(layer[1], Material), "layer {} must be a thickness and a "
                   "material, and perhaps a width, as (0.001, steel), got {!r}", k, layer)
            own = layer[2] if len(layer) == 3 else width
            refuse(own is None, "layer {} has no width: give width= for all layers, or a third "
                   "entry, as ({!r}, material, 0.01)", k, layer[0])
            found.append((
                None if layer[0] is None else require_positive(f"the thickness of layer {k}",
                                                               layer[0]),
                layer[1],
                own if callable(own) else require_positive(f"the width of layer {k}", own)))
        refuse(sum(thickness is None for thickness, _, _ in found) > 1, "only one layer can fill "
               "the remaining height: give the others a thickness instead of None")
        refuse(len({material.plane for _, material, _ in found}) > 1, "materials of a section must "
               "all be in plane stress, or all in plane strain")
        self.parts = tuple(found)

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        given = [thickness for thickness, _, _ in self.parts]
        total = sum(thickness for thickness in given if thickness is not None)
        least = mesh.height if mesh.heights is None else float(np.min(mesh.heights))
        refuse(None in given and total >= least * (1.0 - FILLS), "layers of {:.9g} in a height of "
               "{:.9g} leave nothing for that of thickness None", total, least)
        if mesh.heights is not None:
            refuse(None not in given, "{!r} does not fill a tapered mesh: give one layer the "
                   "thickness None", self)
            return [layer_of(law, width, Moving(partial(_layer, given, k), mesh.height))
                    for k, (_, law, width) in enumerate(self.parts)]
        tops = np.cumsum([mesh.height - total if x is None else x for x in given])
        refuse(abs(tops[-1] - mesh.height) > FILLS * mesh.height, "the thicknesses add up to "
               "{:.9g}, the height of the mesh is {:.9g}: None fills the rest", tops[-1],
               mesh.height)
        ends = np.append(0.0, tops / tops[-1])
        ends[-1] = 1.0
        return [layer_of(law, width if callable(width) else width * (b - a), Uniform(a, b))
                for a, b, (_, law, width) in zip(ends[:-1].tolist(), ends[1:].tolist(),
                                                 self.parts)]

    def __repr__(self) -> str:
        return f"<{len(self.parts)} layers of " + ", ".join(
            "the rest" if thickness is None else f"{thickness:g}"
            for thickness, _, _ in self.parts) + ">"


def _layer(given, k, h):
    """Interval of layer k at heights (..., 1); one of the given thicknesses may be None."""
    rest = given.index(None)
    low = sum(given[:k]) / h if k <= rest else 1.0 - sum(given[k:]) / h
    high = sum(given[:k + 1]) / h if k < rest else 1.0 - sum(given[k + 1:]) / h
    return [Piece(low, high, 1.0)]


class Numbers(Section):
    """A section given by stiffnesses, see :meth:`Section.numbers`. Two Gauss points at a distance
    of sqrt(EI / EA) from the axis have its stiffnesses. Masses at sqrt(rhoI / rhoA) have its
    inertias. The height of the mesh serves section coordinates and plots only."""

    has_materials = True
    has_fields = False

    def __init__(self, EA: float, EI: float, GA: float | None = None, rhoA: float | None = None,
                 rhoI: float | None = None, width: float = 1.0) -> None:
        self.EA, self.EI = require_positive("EA", EA), require_positive("EI", EI)
        self.GA = None if GA is None else require_positive("GA", GA)
        self.rhoA = None if rhoA is None else require_positive("rhoA", rhoA)
        self.rhoI = None if rhoI is None else require_positive("rhoI", rhoI)
        self.width = require_positive("width", width)
        refuse(rhoI is not None and rhoA is None, "rhoI is given without rhoA: give both, or none")

    def element_for(self, element: ElementBeam) -> ElementBeam:
        plane = element if element.order < 2 else element.plane()
        if plane is None:
            raise InputError(f"{self!r} has plane sections: it takes cables and elements of order "
                             f"1, got {type(element).__name__} of order {element.order}")
        return plane

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        b, h = self.width, mesh.height
        refuse(mesh.heights is not None, "a section given by numbers needs a constant height")
        GA = 5.0 / 12.0 * self.EA if self.GA is None else self.GA
        density = None if self.rhoA is None else self.rhoA / (b * h)
        law = PlaneSections(self.EA / (b * h), GA / (b * h), density)
        part = np.sqrt(12.0 * self.EI / self.EA) / h
        own = part if self.rhoI is None or self.rhoA is None else (
            np.sqrt(12.0 * self.rhoI / self.rhoA) / h)
        return [Layer(law, b, Uniform(0.5 - 0.5 * part, 0.5 + 0.5 * part), face=(b, b), outer=b,
                      density=density, shear=1.2,
                      inertia=Uniform(0.5 - 0.5 * own, 0.5 + 0.5 * own))]

    def __repr__(self) -> str:
        return f"Section.numbers(EA={self.EA:g}, EI={self.EI:g})"


#: Sizes of a profile besides the height, which is that of the mesh.
SIZES = {"rectangle": ("width",), "I": ("width", "web", "flange"), "T": ("width", "web", "flange"),
         "box": ("width", "wall"), "tube": ("wall",), "circle": ()}


class Profile(Section):
    """A section of one material, see :meth:`Section.profile`."""

    def __init__(self, name: str, scaled: bool = False, **sizes: float) -> None:
        self.name = require_option("profile", name, SIZES)
        self.scaled = require_flag("scaled", scaled)
        wanted = SIZES[name]
        refuse(set(sizes) != set(wanted), "a profile {!r} has, besides the height of the mesh, the "
               "sizes ({}), got ({})", name, ", ".join(wanted), ", ".join(sizes), error=CallError)
        self.sizes = s = {k: require_positive(k, v) for k, v in sizes.items()}
        refuse(s.get("web", 0.0) > s.get("width", np.inf), "the web, {:g}, is wider than the "
               "profile, {:g}", s.get("web"), s.get("width"))

    def pieces(self, h: Any) -> list[Piece]:
        """The width in intervals from bottom to top, at heights h, a number or (..., 1)."""
        s, name = self.sizes, self.name
        width = s.get("width", h)
        thickness = s.get("flange", s.get("wall", 0.0)) / h
        refuse(np.any(thickness * (1 if name == "T" else 2) >= 1.0) or (
            name == "box" and 2.0 * s["wall"] >= width), "walls or flanges of {!r} do not fit in a "
            "height of {:g}", self, np.min(h))
        if name == "rectangle":
            return [Piece(0.0, 1.0, width)]
        if name in ("circle", "tube"):
            outer = partial(_chord, h, 0.0)
            if name == "circle":
                return [Piece(0.0, 1.0, outer)]
            a = thickness
            return [Piece(0.0, a, outer), Piece(a, 1.0 - a, partial(_chord, h, 0.5 - a)),
                    Piece(1.0 - a, 1.0, outer)]
        web = 2.0 * s["wall"] if name == "box" else s["web"]
        flange = Piece(1.0 - thickness, 1.0, width)
        if name == "T":
            return [Piece(0.0, 1.0 - thickness, web), flange]
        return [Piece(0.0, thickness, width), Piece(thickness, 1.0 - thickness, web), flange]

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        pieces = self.pieces(mesh.height)
        if self.name == "rectangle":
            return [layer_of(material, self.sizes["width"])]
        round_ = self.name in ("circle", "tube")
        face = (0.0, 0.0) if round_ else (pieces[0].width, pieces[-1].width)
        outer = self.sizes.get("width", mesh.height)
        if mesh.heights is not None and not self.scaled and self.name != "circle":
            self.pieces(mesh.heights)
            return [layer_of(material, 1.0, Moving(self.pieces, mesh.height), face=face,
                            by_height=round_, outer=outer)]
        measure = Weighted(pieces)
        return [layer_of(material, measure.mean, measure, face=face, by_height=round_, outer=outer)]

    def __repr__(self) -> str:
        sizes = "".join(f", {k}={v:g}" for k, v in self.sizes.items())
        return f"Section.profile({self.name!r}{', scaled=True' * self.scaled}{sizes})"


class Standard(Section):
    """A profile by its standard name, see :meth:`Section.profile`, with its ``height``."""

    def __init__(self, name: str, unit: str = "m", **sizes: float) -> None:
        refuse(sizes, '{!r} has its sizes by its name, got {}: others have Section.profile("I", '
               'width=..., ...)', name, ", ".join(sizes), error=CallError)
        self.name, self.unit = name, require_option("unit", unit, tuple(LENGTHS))
        self.height, pieces = pieces_of(name, unit)
        self._pieces = [Piece(*piece) for piece in pieces]

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        refuse(mesh.heights is not None or abs(mesh.height - self.height) > FILLS * self.height,
               '{} is {:g} {} high, and the mesh {:g}: make it by height=section.height, with '
               'unit="mm" or another one of the section', self.name, self.height, self.unit,
               mesh.height)
        measure = Weighted(self._pieces)
        widths = [np.max(piece.width(np.linspace(*piece[:2], 9))) if callable(piece.width) else
                  piece.width for piece in self._pieces]
        return [layer_of(material, measure.mean, measure, outer=float(max(widths)),
                         face=(float(widths[0]), float(widths[-1])))]

    def __repr__(self) -> str:
        return f"<{self.name}>"


def _chord(h, inner, eta):
    """Width at eta of a circle of height h, minus that of a hole of relative height ``inner``."""
    outer, inner = (2.0 * h * np.sqrt(np.maximum(r * r - (eta - 0.5) ** 2, 0.0))
                    for r in (0.5, inner))
    return outer - inner
