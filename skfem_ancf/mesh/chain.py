"""A chain of elements, as maps, places and refinements read it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from ..core.types import Array


class Chain(Protocol):
    """What the modules below :class:`~skfem_ancf.MeshBeam` read of it.

    Attributes
    ----------
    p, t
        Nodes, shape (2, nvertices), and the two nodes of each element, (2, nelements).
    p_X, p_Y, p_XY
        Tangent and director of the axis at the nodes, and the derivative of the director along
        the axis, shape (2, nvertices).
    s
        Arc length at the nodes, shape (nvertices,).
    height, heights
        The largest height of a section, and the heights at the nodes or of the elements.
    lengths
        Lengths of the elements, shape (nelements,).
    is_chain, chains
        Whether each element begins where the one before ends; the chain that each is in.
    curve, taper, sections
        What the mesh was made from: a curve, heights that vary, planes of the sections.
    """

    p: Any
    t: Any
    elem: Any

    @property
    def p_X(self) -> Array: ...

    @property
    def p_Y(self) -> Array: ...

    @property
    def p_XY(self) -> Array: ...

    @property
    def s(self) -> Array: ...

    @property
    def height(self) -> float: ...

    @property
    def heights(self) -> Array: ...

    @property
    def lengths(self) -> Array: ...

    @property
    def curve(self) -> Any: ...

    @property
    def taper(self) -> Any: ...

    @property
    def sections(self) -> Any: ...

    @property
    def is_straight(self) -> Any: ...

    @property
    def is_chain(self) -> bool: ...

    @property
    def chains(self) -> Array: ...

    @property
    def nelements(self) -> int: ...

    @property
    def nfacets(self) -> int: ...

    @property
    def boundaries(self) -> Any: ...

    def mapping(self) -> Any:
        """The map from the reference cell to the reference configuration."""

    def with_sections(self, sections: Any) -> Any:
        """The mesh with other planes of the sections."""
