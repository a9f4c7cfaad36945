"""Profiles: full sections of one material whose width depends on the distance from the axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import CallError, InputError, require_flag, require_option, require_positive
from .base import Section, Slab, slab_of
from .measure import Piece, Weighted
from .moving import Moving

if TYPE_CHECKING:
    from ..mesh.mesh_beam import MeshBeam

#: Sizes that a profile has besides the height, which is that of the mesh.
SIZES = {"rectangle": ("width",), "I": ("width", "web", "flange"), "T": ("width", "web", "flange"),
         "box": ("width", "wall"), "tube": ("wall",), "circle": ()}


class Profile(Section):
    """A section of one material by its width; :meth:`Section.profile` makes it.

    Parameters
    ----------
    name
        One of :data:`SIZES`.
    scaled
        On a tapered mesh what lies across the height is the same part of it everywhere; else
        flanges and walls keep their thickness.
    **sizes
        Its sizes.
    """

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
        """The width, piece by piece from the bottom to the top.

        Parameters
        ----------
        h
            Height, or several (..., 1): then ends of the pieces are of this shape.

        Raises
        ------
        InputError
            If a thickness does not fit in the height or the width.
        """
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
            outer = _Chord(h, 0.5)
            if name == "circle":
                return [Piece(0.0, 1.0, outer)]
            a = thickness
            return [Piece(0.0, a, outer), Piece(a, 1.0 - a, _Chord(h, 0.5, 0.5 - a)),
                    Piece(1.0 - a, 1.0, outer)]
        web = 2.0 * s["wall"] if name == "box" else s["web"]
        flange = Piece(1.0 - thickness, 1.0, width)
        if name == "T":
            return [Piece(0.0, 1.0 - thickness, web), flange]
        return [Piece(0.0, thickness, width), Piece(thickness, 1.0 - thickness, web), flange]

    def slabs(self, mesh: MeshBeam, material: Any) -> list[Slab]:
        pieces = self.pieces(mesh.height)
        if self.name == "rectangle":
            return [slab_of(material, self.sizes["width"])]
        round_ = self.name in ("circle", "tube")
        face = (0.0, 0.0) if round_ else (pieces[0].width, pieces[-1].width)
        outer = self.sizes.get("width", mesh.height)
        if mesh.heights is not None and not self.scaled and self.name != "circle":
            self.pieces(mesh.heights)
            return [slab_of(material, 1.0, Moving(self.pieces, mesh.height), face=face,
                            by_height=round_, outer=outer)]
        measure = Weighted(pieces)
        return [slab_of(material, measure.mean, measure, face=face, by_height=round_, outer=outer)]

    def __repr__(self) -> str:
        sizes = "".join(f", {k}={v:g}" for k, v in self.sizes.items())
        return f"Section.profile({self.name!r}{', scaled=True' * self.scaled}{sizes})"


class _Chord:
    """The width of a circle at eta, less that of a smaller one; radii in heights h."""

    def __init__(self, h, *radii):
        self.h, self.radii = h, radii

    def __call__(self, eta):
        first, *less = (2.0 * self.h * np.sqrt(np.maximum(r * r - (eta - 0.5) ** 2, 0.0))
                        for r in self.radii)
        return first - sum(less)
