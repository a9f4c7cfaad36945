"""Layers that are bonded, each of a material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, require_positive, shown
from ..materials import Material
from .base import Section, Slab, slab_of
from .measure import Piece, Uniform
from .moving import Moving

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..mesh.mesh_beam import MeshBeam

#: Relative difference of the height of layers and that of a mesh.
FILLS = 1e-9


class Layers(Section):
    """Bonded layers, from the bottom to the top; :meth:`Section.layers` makes it.

    Parameters
    ----------
    *layers
        Pairs of a thickness and a material; a third entry is the width of that layer. The
        thickness of one may be None: what the others leave of the height.
    width
        Width of the others: a positive number, or a function of material coordinates (x, y).
    """

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

    def slabs(self, mesh: MeshBeam, material: Any) -> list[Slab]:
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
            return [slab_of(law, width, Moving(_Layer(given, k), mesh.height))
                    for k, (_, law, width) in enumerate(self.parts)]
        tops = np.cumsum([mesh.height - total if x is None else x for x in given])
        if abs(tops[-1] - mesh.height) > FILLS * mesh.height:
            raise InputError(f"the layers are {tops[-1]:.9g} high together, and the mesh "
                             f"{mesh.height:.9g}: they must fill it from the bottom to the top; "
                             "one of the thickness None takes what the others leave")
        ends = np.append(0.0, tops / tops[-1])
        ends[-1] = 1.0
        return [slab_of(law, width if callable(width) else width * (b - a), Uniform(a, b))
                for a, b, (_, law, width) in zip(ends[:-1].tolist(), ends[1:].tolist(),
                                                 self.parts)]

    def functions(self) -> list[tuple[str, Callable[..., Any]]]:
        return [(f"the function width(x, y) of layer {k}", width)
                for k, (_, _, width) in enumerate(self.parts) if callable(width)]

    def __repr__(self) -> str:
        return f"<{len(self.parts)} layers of " + ", ".join(
            "the rest" if thickness is None else f"{thickness:g}"
            for thickness, _, _ in self.parts) + ">"


class _Layer:
    """Where one of layers is, at heights (..., 1); of those one has the thickness None."""

    def __init__(self, given, number):
        self.given, self.number = given, number

    def __call__(self, h):
        k, rest = self.number, self.given.index(None)
        low = sum(self.given[:k]) / h if k <= rest else 1.0 - sum(self.given[k:]) / h
        high = sum(self.given[:k + 1]) / h if k < rest else 1.0 - sum(self.given[k + 1:]) / h
        return [Piece(low, high, 1.0)]
