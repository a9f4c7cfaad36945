"""Connections of beams, bodies and domains: hinge, weld, glue."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from scipy import sparse
from skfem import BilinearForm
from skfem.helpers import dot

from ...beam.beam import Beam
from ...beam.domain import Domain
from ...beam.layout import Layout
from ...beam.points import BeamPoints
from ...beam.rigid import RigidBody
from ...core.errors import InputError, MeshError, require_flag, require_label, shown
from ...core.types import Array
from ...mesh.places import facets_of, is_point
from ..item import Item
from ..places import Vector, each, is_ground, point, section, several
from ..symbols import Symbol, boundary_of, support_of
from .base import Affine, Aligned, ComposedJoint, Joint, angle_to, equations_of, rotation


# hinge between two or more beams


class Hinge(ComposedJoint):
    """r_a = r_b for a material point of two beams, and of further ones; rotations are free.

    Parameters
    ----------
    beams
        Two or more, each a Beam or a RigidBody, its name or number, or "ground".
    at
        The point (x, y) in the reference configuration; or one point for each beam, if they are
        apart. None is the centre of mass of a rigid body.
    """

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None) -> None:
        self.beams = several(beams)
        self.at = each(at, "the point at=", len(self.beams))
        self.name = require_label("name", name)
        self.equations = equations_of(("force along x", "force along y"), len(self.beams))

    def bind(self, layout: Layout) -> None:
        first, *others = (point(layout, beam, at) for beam, at in zip(self.beams, self.at))
        self.parts = [Affine((first, n), (other, -n)) for other in others for n in np.eye(2)]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        return symbol_of(self, layout, "hinge", "x y", point)


# bond between a boundary of a domain and another member (mortar method)

#: Round-off relative to the largest entry of an equation.


ROUND_OFF = 1e-14


class Glue(Joint):
    """The boundary of a domain bonded to the surface of another member: the mortar method.

    For each test function of the domain on the boundary, its integral times the difference of the
    displacements is zero: the trace of the domain is the L2 projection of the other displacement.
    The other member may be the end or a side of a beam with sections, a rigid body, another domain
    or the ground. The equations are linear and constant.

    Parameters
    ----------
    domain, boundary
        The :class:`~skfem_ancf.Domain`, its name or number, and a boundary of its mesh.
    other, place
        The other member, and for a beam its place, as "left" or "top".
    name
        Name in messages.

    Raises
    ------
    InputError
        If a point of the boundary is not on the other member at that place.

    References
    ----------
    Bernardi, Maday, Patera: "A new nonconforming approach to domain decomposition: the mortar
    element method", in: Nonlinear partial differential equations and their applications (1994).
    """

    def __init__(self, domain: Any, boundary: Any, other: Any, place: Any = None,
                 name: str | None = None) -> None:
        self.domain, self.boundary = domain, boundary
        self.other, self.place, self.name = other, place, require_label("name", name)

    def bind(self, layout: Layout) -> None:
        domain = layout.beam(self.domain)
        if not isinstance(domain, Domain):
            raise InputError(f"a Glue needs the boundary of a Domain, got {domain!r}")
        basis, first = domain.trace(self.boundary), layout.offset(domain)
        tests = domain.dofs(self.boundary)
        M = BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis).tocoo()
        rows, columns = domain.numbers(M.row), domain.numbers(M.col)
        keep = np.isin(rows, tests)
        row = np.searchsorted(tests, rows[keep])
        one = domain.rigid_motions()[:, :2].sum(axis=1)[columns[keep]]
        size, largest = (np.bincount(row, v) for v in (M.data[keep] * one, np.abs(M.data[keep])))
        size = np.where(size > 1e-6 * largest, size, largest)  # multipliers add up to the force
        found = [(row, first + columns[keep], M.data[keep])]
        if not is_ground(self.other):
            dofs, weights = self._surface(layout, np.reshape(basis.global_coordinates(), (2, -1)))
            for k in range(basis.Nbfun):  # test function k at the points, in component k % 2
                value = (np.asarray(basis.basis[k][0])[k % 2] * basis.dx).ravel()
                test = np.repeat(domain.numbers(basis.element_dofs[k]), basis.dx.shape[1])
                used, = np.nonzero(np.isin(test, tests) & (value != 0.0))
                at, w = dofs[k % 2][:, used], weights[k % 2][:, used]
                found.append((np.broadcast_to(np.searchsorted(tests, test[used]), at.shape).ravel(),
                              at.ravel(), -(value[used] * w).ravel()))
        i, j, v = map(np.concatenate, zip(*found))
        A = sparse.coo_array((v / size[i], (i, j)), shape=(len(tests), layout.N)).tocsr().tocoo()
        keep = np.abs(A.data) > ROUND_OFF
        self.found = A.row[keep], A.col[keep], A.data[keep]
        self.equations = tuple(f"force along {'xy'[c]}" for c in tests % 2)

    def _surface(self, layout: Layout, x: Array) -> tuple[Array, Array]:
        """DOFs and weights in the displacement of points, (2, k, n) both."""
        other, domain = layout.beam(self.other), layout.beam(self.domain)
        try:
            if isinstance(other, Domain):
                dofs, weights = other.probes(x)
            elif isinstance(other, RigidBody):
                dofs, weights = np.moveaxis(np.array([other.probe(p) for p in x.T]), 0, -1)
                dofs = dofs.astype(int)
            else:
                e, X, _ = other.finder.inside(x)
                if self.place is not None and not is_point(self.place):
                    cells = np.unique(other.mesh.f2t[:, facets_of(other.mesh, self.place)])
                    off = x[:, ~np.isin(e, cells)].T
                    if len(off):
                        raise MeshError(f"({off[0, 0]:.6g}, {off[0, 1]:.6g}) is in the beam "
                                        "elsewhere")
                found = BeamPoints(other, 0, slice(0, other.N), None, e, X)
                dofs, weights = found.dofs.swapaxes(0, 1), found.weights
        except MeshError as error:
            raise InputError(f"the boundary {shown(self.boundary)} of {domain!r} does not meet "
                             f"{other!r} at {shown(self.place)}: {error}. Both have to be at one "
                             "place in the reference configuration, and the beam as high as the "
                             "boundary is long: name facets by mesh.with_boundaries({...}), or "
                             "move a mesh by mesh.translated(...)") from None
        return layout.offset(other) + dofs, np.broadcast_to(weights, dofs.shape)

    def value(self, u: Array, t: float) -> Array:
        i, j, v = self.found
        return np.bincount(i, v * u[j], len(self.equations))

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        return self.found

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        at = boundary_of(layout, layout.beam(self.domain), self.boundary)
        return (Symbol("joint", (at,), text="weld"),)


class Weld(ComposedJoint):
    """Sections that coincide and keep their relative angles of the reference configuration.

    The direction of a section is its best-fit line, so it may warp and change its thickness; for a
    cable it is the tangent.

    Parameters
    ----------
    beams
        Two or more, each a Beam or a RigidBody, its name or number, or "ground".
    at
        The section of each beam, as ``("right", "left")``, or a material point (x, y), also inside
        an element; or one place for all, as a common point ``(1, 0)``.
    apart
        Allow a distance between the points in the reference configuration, which the weld closes.
    """

    constant = False

    def __init__(self, beams: Sequence[Any], at: Any, name: str | None = None,
                 apart: bool = False) -> None:
        self.beams, self.name = several(beams), require_label("name", name)
        self.apart = require_flag("apart", apart)
        self.at = each(at, "the section of each beam", len(self.beams))
        self.equations = equations_of(("force along x", "force along y", "moment"),
                                      len(self.beams))

    def expand(self, layout: Layout) -> Sequence[Item]:
        """The weld, or a Glue between a boundary of a domain and a member that is not a cable."""
        members = [None if is_ground(beam) else layout.beam(beam) for beam in self.beams]
        which = [k for k, one in enumerate(members) if isinstance(one, Domain)]
        if not which or any(isinstance(one, Beam) and not one.has_sections for one in members):
            return (self,)
        k = which[0]
        return [Glue(layout.number(self.beams[k]), self.at[k], beam, at, self.name)._with(
            _key=self._key) for n, (beam, at) in enumerate(zip(self.beams, self.at)) if n != k]

    def bind(self, layout: Layout) -> None:
        (a, d), *others = (section(layout, beam, at) for beam, at in zip(self.beams, self.at))
        self.parts = []
        for b, e in others:
            gap = b.start - a.start
            beams = [layout.beam(beam) for beam in self.beams if not is_ground(beam)]
            if not self.apart and np.hypot(*gap) > 1e-6 * min(beam.size for beam in beams):
                centre = next((f": of {beam!r} alone it is the centre of mass that is meant, name "
                               "the point, as (body, (x, y)); or" for beam, at in
                               zip(self.beams, self.at) if at is None), ":")
                raise InputError(
                    f"the sections to weld are {np.hypot(*gap):.6g} apart, one at "
                    f"({a.start[0]:.6g}, {a.start[1]:.6g}), the other at "
                    f"({b.start[0]:.6g}, {b.start[1]:.6g}){centre} name sections that meet, move a "
                    f"mesh by mesh.translated(({0 - gap[0]:.6g}, {0 - gap[1]:.6g})), or weld with "
                    "apart=True to draw them together")
            self.parts += [*(Affine((a, n), (b, -n)) for n in np.eye(2)),
                           Aligned(d, e, rotation(angle_to(d.start, e.start)))]

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        return symbol_of(self, layout, "weld", "x y angle",
                         lambda layout, beam, at: section(layout, beam, at)[0])


def symbol_of(joint: Any, layout: Layout, text: str, fixed: str,
              place: Callable[..., Vector]) -> Iterable[Symbol]:
    """The symbol of a hinge or a weld: on the ground a support with its fixed motions."""
    beam, at = next((b, a) for b, a in zip(joint.beams, joint.at) if not is_ground(b))
    if any(map(is_ground, joint.beams)):
        return (support_of(layout, beam, place(layout, beam, at), fixed),)
    return (Symbol("joint", (place(layout, beam, at),), text=text),)
