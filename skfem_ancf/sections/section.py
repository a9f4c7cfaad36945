"""Sections: rectangles, bonded layers, profiles, and those given by their stiffnesses.

A section is a list of layers from bottom to top, each of a material and a width.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..core.errors import (CallError, InputError, ask_array, require_flag, require_option,
                           require_positive, shown)
from ..core.immutable import Immutable
from ..core.types import Array, HasShear
from ..materials import Material, StVenantKirchhoff
from ..mesh.mesh_beam import MeshBeam
from .measure import MORE, WHOLE, Piece, Uniform, Weighted
from .moving import Moving


@dataclass(frozen=True)
class Layer:
    """A layer of a section, all along the beam.

    Attributes
    ----------
    material
        Its material, of numbers.
    width
        Area over the height of the beam: a number, or a function of material coordinates (x, y).
    measure
        Its rules across, places eta in [0, 1].
    face
        Widths of its bottom and its top; None for ``width``.
    outer
        Its largest width; None for ``width``.
    by_height
        The width grows with the height of a tapered beam.
    grade
        A function of (x, y) that multiplies its energy, or None.
    density
        Mass per volume: a number, a function of (x, y), or None.
    inertia
        The measure of its mass, if that is another.
    shear
        Factor on the shear modulus under the shear stress that equilibrium asks for.
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
        """Of the height of the beam, that it takes."""
        return self.measure.high - self.measure.low

    @property
    def varies(self) -> bool:
        """True if something is a function of material coordinates."""
        return callable(self.width) or callable(self.grade) or callable(self.density)


class Section(Immutable):
    """The section of a beam: what lies across it. It does not change.

    Sections are made by :meth:`profile`, :meth:`layers` and :meth:`numbers`, and given to
    ``Beam(mesh, element, section=...)``. A user-defined subclass gives :meth:`layers_on`.

    Attributes
    ----------
    has_materials : bool
        It has materials of its own: the beam is given none.
    has_fields : bool
        Strain and stress across it are known; not so of numbers.
    """

    has_materials = False
    has_fields = True

    @staticmethod
    def profile(name: str, scaled: bool = False, **sizes: float) -> Section:
        """A profile of one material, as high as the mesh.

        Rules across it are Gauss rules of its width, exact to round-off for the polynomials of the
        element, jumps of the width and the ends of circles included: see
        :class:`~skfem_ancf.sections.measure.Weighted`. The axis is in the middle of the height,
        which of a T is not the centroid: its extension and bending are coupled.

        Parameters
        ----------
        name
            "rectangle" (width), "I" and "T" (width, web, flange; the flange of a T is at the top),
            "box" (width, wall), "tube" (wall) or "circle".
        scaled
            Of a mesh whose height varies. False: flanges and walls keep their thickness. True:
            sizes are those where it is largest, and flanges and the lower and upper walls of a box
            are the same part of the height everywhere; webs and widths stay. A tube is scaled as a
            whole, a circle always.
        **sizes
            Width over all, thickness of the web, of a flange and of the walls.

        Raises
        ------
        NameUnknown
            If the name is not known.
        CallError
            If it has other sizes.
        InputError
            If a size is not positive, or walls do not fit; in a Beam also in the height.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Section, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850),
        ...             section=Section.profile("I", width=0.05, web=0.005, flange=0.008))
        >>> round(beam.total_mass, 6)  # (2 * 0.05 * 0.008 + 0.084 * 0.005) * 2 * 7850
        19.154
        """
        return Profile(name, scaled, **sizes)

    @staticmethod
    def layers(*layers: Any, width: float | Callable[..., Any] | None = None) -> Section:
        """Bonded layers, from the bottom to the top; together as high as the mesh.

        Strains are continuous, and the stress of each layer is that of its own law: it jumps
        between two.

        Parameters
        ----------
        *layers
            Pairs of a thickness and a material; a third entry is the width of that layer. The
            thickness of one may be None: it takes what the others leave of the height, which may
            vary along the mesh.
        width
            Width of the others: a positive number, or a function of material coordinates (x, y).

        Raises
        ------
        InputError
            If a layer is no such pair or is not positive; in a Beam if they do not fill the height.

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
                rhoI: float | None = None, width: float = 1.0) -> Section:
        """A section given by its stiffnesses and inertias about the axis.

        Parameters
        ----------
        EA, EI
            Stiffnesses against extension and bending.
        GA
            Against shear, its factor included; None for that of a rectangle, 5/12 EA. A cable does
            not shear: a ModelWarning says where that is felt.
        rhoA, rhoI
            Mass per length, and its moment of inertia; None for rhoI is rhoA EI / EA.
        width
            Of the faces, where pressures and tractions act.

        Raises
        ------
        InputError
            If a number is not positive.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Section
        >>> beam = Beam(MeshBeam.init_line([0, 2], height=0.01), ElementBeamCable(5),
        ...             section=Section.numbers(EA=1e5, EI=2.0, rhoA=0.3))
        >>> round(beam.total_mass, 12)
        0.6
        """
        return Numbers(EA, EI, GA, rhoA, rhoI, width)

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        """What it is made of in a beam, from the bottom to the top.

        Parameters
        ----------
        mesh, material
            Those of the beam; the material is None if the section has its own.

        Raises
        ------
        InputError
            If it does not fit the height of the mesh.
        """
        raise NotImplementedError


class Rectangle(Section):
    """A full section of one width: what ``Beam(..., width=...)`` has.

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
    """The Layer of a material that may be graded; without a measure the whole height."""
    uneven = callable(width) or material.graded
    if measure is None:
        measure = Uniform(more=MORE) if uneven else WHOLE
    elif uneven and isinstance(measure, Uniform):
        measure = Uniform(measure.low, measure.high, MORE)
    reference, grade = material.reference()
    return Layer(reference, width, measure, grade=grade, density=material.density, **more)


def asked(what: str, function: Callable[..., Any], x: Array, y: Array) -> Array:
    """Positive values of a function of material coordinates, which messages call ``what``."""
    x, y = (np.ascontiguousarray(a) for a in np.broadcast_arrays(x, y))
    out = ask_array(f"{what}(x, y)", x.shape, function, x, y, number=True)
    if not np.all(out > 0.0):
        k = np.unravel_index(np.argmin(out), out.shape)
        raise InputError(f"the {what} must be positive all over the body: the function returns "
                         f"{out[k]:.6g} at x = {x[k]:.6g}, y = {y[k]:.6g}")
    return out


#: Relative difference of the height of layers and that of a mesh.
FILLS = 1e-9


class Layers(Section):
    """Bonded layers; :meth:`Section.layers` makes it, and has the parameters."""

    has_materials = True

    def __init__(self, *layers: Any, width: float | Callable[..., Any] | None = None) -> None:
        if not layers:
            raise InputError("layers are pairs of a thickness and a material, as Section.layers("
                             "(0.001, steel), (0.002, brass), width=0.01); got none")
        found = []
        for k, layer in enumerate(layers):
            if not isinstance(layer, (tuple, list)) or len(layer) not in (2, 3) or not isinstance(
                    layer[1], Material):
                raise InputError(f"layer {k} must be a thickness and a material, and perhaps a "
                                 f"width, as (0.001, steel), got {shown(layer)}")
            own = layer[2] if len(layer) == 3 else width
            if own is None:
                raise InputError(f"layer {k} has no width: give width= for all layers, or one of "
                                 f"its own, as ({shown(layer[0])}, material, 0.01)")
            found.append((
                None if layer[0] is None else require_positive(f"the thickness of layer {k}",
                                                               layer[0]),
                layer[1],
                own if callable(own) else require_positive(f"the width of layer {k}", own)))
        if sum(thickness is None for thickness, _, _ in found) > 1:
            raise InputError("only one layer can take what the others leave of the height: give "
                             "the others a thickness in place of None")
        if len({material.plane for _, material, _ in found}) > 1:
            raise InputError("the layers of a section are all in plane stress or all in plane "
                             "strain")
        self.parts = tuple(found)

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        given = [thickness for thickness, _, _ in self.parts]
        total = sum(thickness for thickness in given if thickness is not None)
        least = mesh.height if mesh.heights is None else float(np.min(mesh.heights))
        if None in given and total >= least * (1.0 - FILLS):
            raise InputError(f"the layers are {total:.9g} high together, and the mesh "
                             f"{least:.9g}{' where it is least' * (mesh.heights is not None)}: "
                             f"nothing is left for layer {given.index(None)}, whose thickness is "
                             "None")
        if mesh.heights is not None:
            if None not in given:
                raise InputError(f"{self!r} has thicknesses that stay, and does not fill a tapered "
                                 "mesh: give one layer the thickness None, by which it takes what "
                                 "the others leave, or use a mesh of constant height")
            return [layer_of(law, width, Moving(partial(_layer, given, k), mesh.height))
                    for k, (_, law, width) in enumerate(self.parts)]
        tops = np.cumsum([mesh.height - total if x is None else x for x in given])
        if abs(tops[-1] - mesh.height) > FILLS * mesh.height:
            raise InputError(f"the layers are {tops[-1]:.9g} high together, and the mesh "
                             f"{mesh.height:.9g}: they must fill it from the bottom to the top; "
                             "one of the thickness None takes what the others leave")
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
    """Where layer k is, at heights (..., 1); one of the thicknesses that are given is None."""
    rest = given.index(None)
    low = sum(given[:k]) / h if k <= rest else 1.0 - sum(given[k:]) / h
    high = sum(given[:k + 1]) / h if k < rest else 1.0 - sum(given[k + 1:]) / h
    return [Piece(low, high, 1.0)]


class Numbers(Section):
    """A section by its numbers; :meth:`Section.numbers` makes it, and has the parameters.

    It is a rectangle of the material E = EA / (b h), nu = 0, whose height sqrt(12 EI / EA) need
    not be that h of the mesh: this is where section coordinates are, and what pictures show.
    """

    has_materials = True
    has_fields = False

    def __init__(self, EA: float, EI: float, GA: float | None = None, rhoA: float | None = None,
                 rhoI: float | None = None, width: float = 1.0) -> None:
        self.EA, self.EI = require_positive("EA", EA), require_positive("EI", EI)
        self.GA = None if GA is None else require_positive("GA", GA)
        self.rhoA = None if rhoA is None else require_positive("rhoA", rhoA)
        self.rhoI = None if rhoI is None else require_positive("rhoI", rhoI)
        self.width_of_faces = require_positive("width", width)
        if rhoI is not None and rhoA is None:
            raise InputError("rhoI is given without rhoA: give both, or neither of them")

    def layers_on(self, mesh: MeshBeam, material: Any) -> list[Layer]:
        b, h = self.width_of_faces, mesh.height
        if mesh.heights is not None:
            raise InputError("the numbers of a section are the same all along: use a mesh of "
                             "constant height")
        E = self.EA / (b * h)
        GA = 5.0 / 12.0 * self.EA if self.GA is None else self.GA
        density = None if self.rhoA is None else self.rhoA / (b * h)
        law = _Given(E=E, nu=0.0, density=density, shear_correction=2.0 * GA / self.EA)
        part = np.sqrt(12.0 * self.EI / self.EA) / h
        own = part if self.rhoI is None or self.rhoA is None else (
            np.sqrt(12.0 * self.rhoI / self.rhoA) / h)
        return [Layer(law, b, Uniform(0.5 - 0.5 * part, 0.5 + 0.5 * part), face=(b, b), outer=b,
                     density=density, shear=2.4 * GA / self.EA,
                     inertia=Uniform(0.5 - 0.5 * own, 0.5 + 0.5 * own))]

    def __repr__(self) -> str:
        return f"Section.numbers(EA={self.EA:g}, EI={self.EI:g})"


class _Given(StVenantKirchhoff):
    """Hooke's law whose shear factor gives a section of any order one stiffness against shear."""

    def shear_factor(self, element: HasShear) -> float:
        return super().shear_factor(element) * (1.2 if element.carries_shear_parabola else 1.0)


#: Sizes that a profile has besides the height, which is that of the mesh.
SIZES = {"rectangle": ("width",), "I": ("width", "web", "flange"), "T": ("width", "web", "flange"),
         "box": ("width", "wall"), "tube": ("wall",), "circle": ()}


class Profile(Section):
    """A section of one material; :meth:`Section.profile` makes it, and has the parameters."""

    def __init__(self, name: str, scaled: bool = False, **sizes: float) -> None:
        self.name = require_option("profile", name, SIZES)
        self.scaled = require_flag("scaled", scaled)
        wanted = SIZES[name]
        if set(sizes) != set(wanted):
            raise CallError(
                f"a profile {name!r} has the sizes {', '.join(wanted) or 'of the mesh alone'}; got "
                f"{', '.join(sizes) or 'none'}. Its height is that of the mesh")
        self.sizes = {k: require_positive(k, v) for k, v in sizes.items()}
        if self.sizes.get("web", 0.0) > self.sizes.get("width", np.inf):
            raise InputError(f"the web, {sizes['web']:g}, is wider than the profile, "
                             f"{sizes['width']:g}")

    def pieces(self, h: Any) -> list[Piece]:
        """The width, piece by piece from the bottom to the top, at heights h, one or (..., 1)."""
        s, name = self.sizes, self.name
        width = s.get("width", h)
        thickness = s.get("flange", s.get("wall", 0.0)) / h
        if np.any(thickness * (1 if name == "T" else 2) >= 1.0) or (
                name == "box" and 2.0 * s["wall"] >= width):
            raise InputError(f"{self!r} does not fit in a height of {np.min(h):g}: its walls or "
                             f"flanges of {s.get('flange', s.get('wall')):g} fill it; use thinner "
                             "ones or a higher mesh")
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


def _chord(h, inner, eta):
    """The width at eta of a circle of height h, less that of a radius in heights h."""
    outer, inner = (2.0 * h * np.sqrt(np.maximum(r * r - (eta - 0.5) ** 2, 0.0))
                    for r in (0.5, inner))
    return outer - inner
