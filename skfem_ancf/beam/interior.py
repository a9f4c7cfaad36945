"""What the kinematics of sections and cables, strains and masses read of a beam."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from ..elements.base import ElementBeam
    from ..mesh.mesh_beam import MeshBeam
    from ..sections import Across
    from ..core.types import Array


class Interior(Protocol):
    """The parts of a :class:`~skfem_ancf.Beam` that the modules below it work with.

    Attributes
    ----------
    mesh, element, across
        The mesh, the element, and the section on the mesh.
    kernel
        Energies, forces and tangents of all elements.
    terms
        The integrals of the strain energy.
    N, nd
        Number of degrees of freedom, of the beam and of one node.
    scales, series
        Local functions as products of polynomials.
    """

    @property
    def mesh(self) -> MeshBeam: ...

    @property
    def element(self) -> ElementBeam: ...

    @property
    def across(self) -> Across: ...

    @property
    def kernel(self) -> Any: ...

    @property
    def terms(self) -> Any: ...

    @property
    def layers(self) -> Any: ...

    @property
    def N(self) -> int: ...

    @property
    def nd(self) -> int: ...

    @property
    def scales(self) -> Any: ...

    @property
    def series(self) -> Any: ...

    @property
    def exact_rule(self) -> Any: ...

    @property
    def gradients(self) -> Callable[..., tuple[Array, Array]]: ...

    @property
    def sampled_strain(self) -> Callable[..., Any]: ...

    @property
    def strain_of(self) -> Callable[..., Any]: ...
