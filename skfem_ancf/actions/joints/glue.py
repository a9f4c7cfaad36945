"""Bond between a boundary of a domain and another member (mortar method)."""

from __future__ import annotations

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
from ...core.errors import InputError, MeshError, require_label, shown
from ...core.types import Array
from ...mesh.places import facets_of, is_point
from ..places import is_ground
from .base import Joint

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
                dofs, weights = _of_beam(other, x, self.place)
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


def _of_beam(beam: Beam, x: Array, place: Any) -> tuple[Array, Array]:
    """:meth:`Glue._surface` for a beam with sections."""
    e, X, _ = beam.finder.inside(x)
    if place is not None and not is_point(place):
        cells = np.unique(beam.mesh.f2t[:, facets_of(beam.mesh, place)])
        off = ~np.isin(e, cells)
        if np.any(off):
            raise MeshError(f"({x[0, off][0]:.6g}, {x[1, off][0]:.6g}) is in the beam elsewhere")
    found = BeamPoints(beam, 0, slice(0, beam.N), None, e, X)
    return found.dofs.swapaxes(0, 1), found.weights
