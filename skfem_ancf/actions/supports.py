"""Supports: coordinates held at a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..mesh.places import node_of
from ..core.errors import InputError, SupportError
from ..mesh.places import is_point

if TYPE_CHECKING:
    from ..beam.beam import Beam


@dataclass(frozen=True)
class Support:
    """Coordinates at a place that are given a displacement.

    Attributes
    ----------
    beam : int
        Number of the beam in its scene.
    boundary
        A place, see :func:`skfem_ancf.mesh.places.facets_of`.
    names
        Names of coordinates, or None for all.
    displacement : float
        At full load.
    on_axis : bool
        What is held is on the axis: a point that names the place must be, too.
    welded : bool or None
        Of a welded face, whether the beam has sections: all their coordinates are held, of
        whatever element it has.
    """

    beam: int
    boundary: Any
    names: Any = None
    displacement: float = 0.0
    on_axis: bool = False
    welded: bool | None = None

    def bind(self, beam: Beam, fixed: dict[tuple[int, int], float]) -> None:
        """Add what is held of a beam to what is held already.

        Parameters
        ----------
        beam
            The beam, of this number in its scene.
        fixed
            From (number of the beam, number of the coordinate) to displacement; it is added to.

        Raises
        ------
        InputError
            If the face of a beam with sections was welded and this one has none, or the reverse.
        SupportError
            If a coordinate is given two displacements.
        """
        if self.welded is not None and self.welded != beam.has_sections:
            raise InputError("clamp holds beams with sections and cables by different equations: "
                             f"describe the scene of {beam!r} anew")
        dofs = beam.dofs(self.boundary, beam.element.welded if self.welded else self.names)
        if self.on_axis and is_point(self.boundary):
            self._require_on_axis(beam)
        for d in map(int, dofs):
            before = fixed.get((self.beam, d))
            if before is not None and before != self.displacement:
                raise SupportError(
                    f"coordinate {beam.dofnames[d % beam.nd]} of node {d // beam.nd} is fixed "
                    f"twice, with displacements {before!r} and {self.displacement!r}")
            fixed[self.beam, d] = self.displacement

    def _require_on_axis(self, beam: Beam) -> None:
        x = np.asarray(self.boundary, dtype=float)
        axis = np.round(beam.mesh.p[:, node_of(beam.mesh, self.boundary)], 12) + 0.0
        if np.hypot(*(x - axis)) > 1e-3 * beam.mesh.height:
            raise InputError(
                f"pin holds the axis, at ({axis[0]:.9g}, {axis[1]:.9g}), and not the point "
                f"({x[0]:.9g}, {x[1]:.9g}) of its section: give that point of the axis, or hold "
                'the other with scene.joint("position", at=..., r=lambda t: point)')
