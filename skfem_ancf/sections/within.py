"""Points of a slab on a mesh: what its measure asks of the body there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from ..core.errors import InputError
from .section import asked

if TYPE_CHECKING:
    from ..core.types import Array
    from .section import Slab

#: What messages call the functions of a slab.
NAMES = {"width": "width", "grade": "E", "density": "density"}


class OnMesh(Protocol):
    """What points of a slab ask of the section on the mesh, an Across."""

    mesh: Any

    def heights(self, xi: Array, tind: Array | None = None) -> Array:
        """Heights of sections, shape (nelements, npoints)."""

    def coordinates(self, X: Array, tind: Array | None = None) -> Any:
        """Material coordinates of reference points, as functions of the user take them."""


class Within:
    """Points of a slab on a mesh.

    Parameters
    ----------
    body
        The section on the mesh.
    slab
        One of its slabs.
    X
        Reference points, shape (2, npoints) or (2, nelements, npoints).
    tind
        Elements, shape (nelements,), or None for all.
    """

    __slots__ = "X", "body", "slab", "tind"

    def __init__(self, body: OnMesh, slab: Slab, X: Array,
                 tind: Array | None = None) -> None:
        self.body, self.slab, self.X, self.tind = body, slab, X, tind

    def moved(self, X: Array) -> Within:
        """Other points of the slab.

        Parameters
        ----------
        X
            Reference points, shape (2, npoints) or (2, nelements, npoints).
        """
        return Within(self.body, self.slab, X, self.tind)

    @property
    def heights(self) -> Array:
        """Of the sections, shape (nelements, npoints)."""
        return self.body.heights(self.X[0], self.tind)

    def asked(self, name: str) -> Array:
        """What a function of the slab returns there, shape (nelements, npoints).

        Parameters
        ----------
        name
            One of :data:`NAMES`, of which the slab has a function.
        """
        return asked(NAMES[name], getattr(self.slab, name),
                     *self.body.coordinates(self.X, self.tind))

    def factor(self, name: str, whole: bool = False) -> Any:
        """A number of the slab, or what its function is there: a number, or (nelements, npoints).

        Parameters
        ----------
        name
            One of :data:`NAMES`.
        whole
            The points stand for their sections: of a function the mean of each.

        Raises
        ------
        InputError
            If the slab has no density.
        """
        value = getattr(self.slab, name)
        if callable(value):
            return self.slab.measure.values(self, name, whole)
        if value is None and name == "density":
            raise InputError(f"{self.slab.material!r} has no density: give one to use mass or "
                             "gravity")
        return 1.0 if value is None else value
