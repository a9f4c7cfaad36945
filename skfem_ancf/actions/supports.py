"""Supports: prescribed degrees of freedom."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..beam import Beam, Domain, Layout, WhichBeam, on_body, plane
from ..core import Place, SupportError, refuse, require_finite_scalar, require_option, shown
from ..mesh.places import is_point, node_of
from .item import Item
from .symbols import Symbol, supports_of
from .joints.weld import Hinge, PlaneSection, PrescribedDisplacement


class Support(Item):
    """Degrees of freedom with prescribed displacements, by their scikit-fem names.

    Parameters
    ----------
    boundary
        A place: the name of a boundary, a point (x, y) on the section of a node, a function of
        points x that returns truth values, or an integer array of facets. See
        :func:`skfem_ancf.mesh.places.facets_of`. A RigidBody is fixed as a whole.
    names
        As ``["r^1", "r_Y0^2"]``; ``"r"`` means both components; None means all.
    displacement
        Displacement at full load, in the unit of the degree of freedom, proportional to the load
        factor; or a function of time that returns it, in statics of the load factor.
    beam
        Beam, name or number, in a scene of several.
    """

    #: Of a bound one: numbers of the degrees of freedom in the scene.
    dofs: Any
    _member: Any

    def __init__(self, boundary: Place, names: str | Sequence[str] | None = None,
                 displacement: float | Callable[[float], float] = 0.0,
                 beam: WhichBeam = None) -> None:
        self.boundary, self.beam = on_body(boundary, beam)
        several = isinstance(names, (list, set, frozenset, np.ndarray))
        self.names = tuple(names) if several else names  # type: ignore[arg-type]
        self.displacement = displacement if callable(displacement) else (
            require_finite_scalar("displacement", displacement))

    def expand(self, layout: Layout) -> Sequence[Item]:
        if not callable(self.displacement):
            return (self,)
        return (PrescribedDisplacement(self.boundary, self.names, self.displacement, self.beam),)

    def bind(self, layout: Layout) -> "Support":
        beam, first = layout.beam(self.beam), layout.offset(self.beam)
        return self._with(dofs=beam.dofs(self.boundary, self.names) + first, _member=(beam, first))

    def bound_on(self, layout: Layout) -> list[Any]:
        return [self.bind(layout)]

    def hold(self, fixed: dict[int, float]) -> None:
        """Add its prescribed DOFs to ``fixed``; SupportError where two displacements conflict."""
        value: Any = self.displacement  # a number: functions are joints
        for d in self.dofs.tolist():
            if fixed.setdefault(d, value) != value:
                beam, first = self._member
                node, k = divmod(d - first, beam.nd)
                raise SupportError(f"degree of freedom {beam.dofnames[k]} of node {node} is fixed "
                                   f"twice, with displacements {fixed[d]!r} and {value!r}")

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        return supports_of(layout, self.beam, self.boundary, self.names)

    def __repr__(self) -> str:
        names = "all" if self.names is None else self.names
        return f"<{type(self).__name__} of {names} at {shown(self.boundary)}>"


class Pin(Support):
    """A pinned support: fixes the position of the axis, not the rotation of the section.

    Parameters
    ----------
    boundary, beam
        As for :class:`Support`; for a RigidBody a point, or None for its centre of mass.
    """

    def __init__(self, boundary: Place, beam: Any = None) -> None:
        super().__init__(boundary, "r", beam=beam)

    def expand(self, layout: Layout) -> Sequence[Item]:
        member = layout.beam(self.beam)
        face = isinstance(member, Domain) and not is_point(self.boundary)
        if face or isinstance(member, Beam):
            return (self,)
        at = tuple(map(float, member.place(self.boundary)))
        return (Hinge(("ground", layout.number(member)), at, "of a pin"),)

    def bind(self, layout: Layout) -> Support:
        beam, bound = layout.beam(self.beam), super().bind(layout)
        if is_point(self.boundary) and isinstance(beam, Beam):
            x = np.asarray(self.boundary, dtype=float)
            axis = np.round(beam.mesh.p[:, node_of(beam.mesh, self.boundary)], 12) + 0.0
            refuse(np.hypot(*(x - axis)) > 1e-3 * beam.mesh.height, 'pin fixes the axis, at '
                   '({:.9g}, {:.9g}), and not the point ({:.9g}, {:.9g}) of its section: give '
                   'that point of the axis, or fix the other with scene.joint("position", '
                   'at=..., r=lambda t: point)', axis[0], axis[1], x[0], x[1])
        return bound


class Clamp(Item):
    """A clamped section; a rigid body is fixed as a whole.

    Parameters
    ----------
    boundary, beam
        As for :class:`Support`; the beam may be a RigidBody.
    thickness
        "fixed": every material point of the face is fixed: ``r`` and the section slopes of the
        node. The slope ``r_X`` stays free, as it is a strain measure. "free": ``r`` is fixed and
        the section stays in its plane, with a free thickness. For nu not zero a fixed face causes a
        boundary layer of length h, which long elements exaggerate; a free thickness does not.
    """

    def __init__(self, boundary: Place, beam: Any = None, thickness: str = "fixed") -> None:
        self.boundary, self.beam = on_body(boundary, beam)
        self.thickness = require_option("thickness", thickness, ("fixed", "free"))

    def expand(self, layout: Layout) -> Sequence[Item]:
        k, member = layout.number(self.beam), layout.beam(self.beam)
        if not isinstance(member, Beam):
            return (Support(self.boundary, beam=k),)
        if member.has_sections and self.thickness == "fixed":
            return (Support(self.boundary, member.element.welded, beam=k),)
        t = member.mesh.p_X[:, node_of(member.mesh, self.boundary)]
        direction, slopes = plane(member, t)
        along, *others = [c for c in (0, 1) if abs(direction[c]) >= 1e-14]
        if others:
            return (Support(self.boundary, "r", beam=k),
                    PlaneSection(self.boundary, k, "of a clamp"))
        names = [f"{member.element.dofnames[s]}^{along + 1}" for s in slopes]
        return (Support(self.boundary, ["r", *names], beam=k),)

    def __repr__(self) -> str:
        return f"<Clamp at {shown(self.boundary)}>"
