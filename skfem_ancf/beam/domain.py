"""A body of somebody's own: a stock basis of scikit-fem with its forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from skfem import Basis, BilinearForm, ElementVector, LinearForm
from skfem.assembly.dofs import DofsView

from ..core.errors import (CallbackError, InputError, MeshError, NameUnknown, explained,
                           require_finite, require_label, require_slope, shown)
from ..core.immutable import Immutable, read_only
from ..core.quadrature import gauss
from ..core.types import Array
from ..mesh.places import as_point, is_point

#: Gauss points of the way from rest along which the residual works, and of that in a time step.
WORK, STEP = 6, 3
#: How far a point may be outside of the reference cell, and iterations that find it there.
OUTSIDE, ITERATIONS = 1e-6, 12


class Domain(Immutable):
    """A plane body by a basis and forms of scikit-fem, a member of a Scene beside beams.

    Its degrees of freedom (DOFs) are those of the basis, its unknown is the displacement from the
    reference configuration: in the forms ``w["u"]``, with ``w["u"].grad``. The forms contain the
    thickness. ``scene.weld((domain, "right"), (beam, "left"))`` glues a boundary of its mesh to the
    end or a side of a beam.

    Parameters
    ----------
    basis
        A ``Basis`` of a plane mesh and an ``ElementVector``, as ``Basis(MeshQuad(),
        ElementVector(ElementQuad2()))``.
    residual
        ``LinearForm`` of the internal virtual work: what resists the displacement ``w["u"]``.
    tangent
        ``BilinearForm``: its derivative by the displacement.
    mass
        ``BilinearForm`` of the mass, ``rho * dot(u, v)``, for weight, modes and motion.
    name
        What messages call it.

    Raises
    ------
    InputError
        If the basis is not one of plane vectors, or the tangent not the derivative of the residual.

    Notes
    -----
    In the scene the DOFs are renumbered, by reverse Cuthill-McKee or along x or y, so that matrices
    are narrow bands; :meth:`of_basis` puts them into the order of the basis.

    The energy is the work of the residual on the straight way from the reference configuration, by
    Gauss points: exact for polynomials, as of St. Venant-Kirchhoff. The mean of the residual over a
    time step, by which the energy-momentum scheme keeps the energy, is found in the same way (the
    averaged vector field). Linear momentum is kept, too; the error of the angular momentum of a
    domain is of second order in the step. A tangent that is not symmetric has no energy, and that
    scheme refuses it.

    References
    ----------
    Averaged vector field: Quispel, McLaren: "A new class of energy-preserving numerical integration
    methods", Journal of Physics A 41 (2008).

    Examples
    --------
    A cantilever of linear elasticity that carries a beam:

    >>> import numpy as np
    >>> from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, LinearForm, MeshQuad
    >>> from skfem.helpers import ddot, sym_grad
    >>> from skfem_ancf import (Beam, Domain, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff)
    >>> mesh = MeshQuad.init_tensor(np.linspace(0, 1, 9), np.linspace(-0.05, 0.05, 3))
    >>> mesh = mesh.with_defaults()
    >>> E, width = 1e6, 0.1
    >>> domain = Domain(
    ...     Basis(mesh, ElementVector(ElementQuad2())),
    ...     LinearForm(lambda v, w: width * E * ddot(sym_grad(w["u"]), sym_grad(v))),
    ...     BilinearForm(lambda u, v, w: width * E * ddot(sym_grad(u), sym_grad(v))), name="root")
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1, origin=(1, 0)),
    ...             ElementBeamANCF(2), StVenantKirchhoff(E, 0.0), width)
    >>> scene = Scene(beam, domain).clamp("left", domain).point_force((0, -0.001), at=(2, 0))
    >>> weld = scene.weld((domain, "right"), (beam, "left"))
    >>> state = scene.solve_static()
    >>> bool(abs(state.displacement((2, 0))[1] / (-0.001 * 8 / (3 * E * 0.1**4 / 12)) - 1) < 0.01)
    True
    """

    nd = 2

    def __init__(self, basis: Basis, residual: LinearForm, tangent: BilinearForm,
                 mass: BilinearForm | None = None, name: str | None = None) -> None:
        _require_plane(basis)
        for what, form, kind in (("residual", residual, LinearForm),
                                 ("tangent", tangent, BilinearForm), ("mass", mass, BilinearForm)):
            if not (isinstance(form, kind) or (form is None and what == "mass")):
                raise InputError(f"{what} of a Domain is a {kind.__name__} of scikit-fem, got "
                                 f"{shown(form)}")
        self.basis, self.residual, self.tangent, self.mass = basis, residual, tangent, mass
        self.name = require_label("name", name)
        self.N: int = basis.N
        self._order = _narrow(basis)
        self._rank = np.argsort(self._order)
        self._require_derivatives()

    def __repr__(self):
        who = "" if self.name is None else f"{self.name} "
        mesh = self.basis.mesh
        return f"<Domain {who}of {mesh.nelements} {type(mesh).__name__} cells, {self.N} DOFs>"

    def of_basis(self, u: Array) -> Array:
        """Degrees of freedom of the scene (..., N) in the order of the basis.

        Parameters
        ----------
        u
            As ``state.u_of(domain)`` has them.
        """
        return np.asarray(u)[..., self._rank]

    def numbers(self, dofs: Array) -> Array:
        """Numbers in the scene, from the first of the domain, of DOFs (...) of the basis."""
        return self._rank[dofs]

    # forms

    def load(self, form: LinearForm, boundary: Any = None) -> Array:
        """The force (N,) of a form on all of it, or on a boundary.

        Parameters
        ----------
        form
            It knows ``w.x``, ``w.h`` and, on a boundary, ``w.n``.
        boundary
            What scikit-fem takes for facets; None for the body.
        """
        basis = self.basis if boundary is None else self.trace(boundary)
        return self._ask("load", form.assemble, basis)[self._order]

    def _with(self, u):
        return {"u": self.basis.interpolate(np.asarray(u)[self._rank])}

    def _ask(self, name, function, *args, **options):
        hint = ("residual and tangent know w['u'], the displacement, w['u'].grad, w.x and w.h; "
                "mass and loads w.x, w.h and, on a boundary, w.n")
        with explained("the {} of {!r} fails", hint, CallbackError, name, self), np.errstate(
                all="ignore"):  # an iterate may be turned inside out
            return function(*args, **options)

    def force(self, u: Array) -> Array:
        """The internal force at a displacement of the scene's DOFs, (N,) both."""
        return self._ask("residual", self.residual.assemble, self.basis,
                         **self._with(u))[self._order]

    def stiffness(self, u: Array) -> Array:
        """The values (k,) of the tangent at the entries :attr:`pattern`."""
        data = self._ask("tangent", self.tangent.coo_data, self.basis, **self._with(u)).data
        return np.bincount(self._entries[2], data, len(self._entries[0]))

    @cached_property
    def _entries(self):
        i, j = self._rank[self.tangent.coo_data(self.basis, **self._with(np.zeros(self.N))).indices]
        places, which = np.unique(i * np.int64(self.N) + j, return_inverse=True)
        return places // self.N, places % self.N, which

    @property
    def pattern(self) -> tuple[Array, Array]:
        """Rows and columns (k,) of the tangent's entries."""
        return self._entries[0], self._entries[1]

    def matrix(self, u: Array | None = None) -> sparse.csr_array:
        """The tangent at a displacement (N,), by default at rest, sparse."""
        values = self.stiffness(np.zeros(self.N) if u is None else u)
        return sparse.csr_array((values, self.pattern), shape=(self.N, self.N))

    def energy(self, u: Array) -> float:
        """The work of the residual from rest to a displacement (N,)."""
        return float(sum(w * (self.force(s * u) @ u) for s, w in zip(*gauss(WORK))))

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """The mean of the internal force on a straight way.

        Parameters
        ----------
        u0, u1
            Displacements of the DOFs from which and to which, shape (N,).
        """
        d = u1 - u0
        return sum((w * self.force(u0 + s * d) for s, w in zip(*gauss(STEP))), np.zeros(self.N))

    def inverted(self, u: Array) -> bool:
        """True if a cell is turned inside out by a displacement (N,)."""
        (a, b), (c, d) = self._with(u)["u"].grad
        return bool(np.any((1.0 + a) * (1.0 + d) <= b * c))

    def _require_derivatives(self):
        mesh = self.basis.mesh  # strains are small in the thinnest cell
        thin = np.min(self.basis.dx.sum(axis=1) / np.ptp(mesh.p[:, mesh.t], axis=1).max(axis=0))
        u, v = thin * np.array([[1e-2], [1e-4]]) * np.cos(np.arange(2.0 * self.N)).reshape(2, -1)
        before, now, after = (require_finite(f"the residual of {self!r}", self.force(u + s * v))
                              for s in (-1.0, 0.0, 1.0))
        K = self.matrix(u)
        require_slope(f"the tangent of {self!r}", "the residual", after - before, 2.0 * (K @ v),
                      1e-12 * np.abs(now).max())
        self.symmetric = bool(abs(K - K.T).max() <= 1e-10 * abs(K).max())

    # what a scene asks of a beam, too

    @property
    def dofnames(self) -> list[str]:
        """Names of both components."""
        return ["u^1", "u^2"]

    @property
    def bandwidth(self) -> int:
        """Subdiagonals of its matrices."""
        return int(np.max(np.ptp(self.numbers(self.basis.element_dofs), axis=0)))

    @cached_property
    def q0_local(self) -> Array:
        """The DOFs of the place of the points, from :attr:`origin`, (N,)."""
        return self.velocity_of(lambda x: x - self.origin[:, None])

    @property
    def q0(self) -> Array:
        """The DOFs of the place of the points, (N,)."""
        return self.q0_local + self.rigid_motions()[:, :2] @ self.origin

    @property
    def origin(self) -> Array:
        """The mean of the vertices, shape (2,)."""
        return np.asarray(self.basis.mesh.p.mean(axis=1))

    @property
    def size(self) -> float:
        """The larger one of width and height."""
        return float(np.max(np.ptp(self.basis.mesh.p, axis=1)))

    @property
    def sizes(self) -> Array:
        """Changes of the DOFs where it moves by its size, (N,)."""
        return np.full(self.N, self.size)

    @cached_property
    def scale(self) -> float:
        """The energy of a strain of one, about: modulus times volume."""
        return float(abs(self.q0_local @ (self.matrix() @ self.q0_local)))

    @cached_property
    def held(self) -> bool:
        """True if its forms resist a rigid motion, as bedding does."""
        K, motions = self.matrix(), self.rigid_motions()
        return bool(np.any(np.abs(K @ motions) > 1e-9 * (abs(K) @ np.abs(motions))))

    @cached_property
    def _mass(self):
        if self.mass is None:
            raise InputError(f"{self!r} has no mass: give its form, Domain(..., mass=BilinearForm("
                             "lambda u, v, w: rho * width * dot(u, v)))")
        M = self._ask("mass", self.mass.assemble, self.basis)
        return sparse.csr_array(M)[self._order][:, self._order]

    @property
    def total_mass(self) -> float:
        """The mass."""
        along = self.rigid_motions()[:, 0]
        return float(along @ (self._mass @ along))

    def mass_entries(self) -> tuple[Array, Array, Array]:
        """The mass matrix: rows, columns and values, shapes (k,)."""
        M = self._mass.tocoo()
        return M.row, M.col, M.data

    def weight(self, g: ArrayLike) -> Array:
        """The dead load of an acceleration ``g`` (2,), shape (N,)."""
        return self._mass @ (self.rigid_motions()[:, :2] @ require_finite("g", g, (2,)))

    def velocity_of(self, field: Callable[[Array], Array]) -> Array:
        """The DOFs (N,) of a field of vectors, a function of points (2, n), by L2 projection."""
        def at_points(x):
            return np.reshape(field(np.reshape(x, (2, -1))), x.shape)

        return self.basis.project(at_points)[self._order]

    @cached_property
    def _rigid(self):
        one, turn = np.array([[1.0], [0.0]]), np.array([[0.0, -1.0], [1.0, 0.0]])
        return read_only(np.column_stack([
            self.velocity_of(lambda x: one + 0.0 * x),
            self.velocity_of(lambda x: one[::-1] + 0.0 * x),
            self.velocity_of(lambda x: turn @ (x - self.origin[:, None]))]))

    def rigid_motions(self) -> Array:
        """Two translations and the rotation about :attr:`origin`, (N, 3)."""
        return self._rigid

    # boundaries

    def _facets(self, boundary: Any) -> Array:
        """Numbers of facets, of what scikit-fem takes for a boundary: a name, a function of x."""
        mesh = self.basis.mesh
        if isinstance(boundary, str) and boundary not in (mesh.boundaries or {}):
            raise NameUnknown("boundary", boundary, list(mesh.boundaries or {}))
        if is_point(boundary):
            raise InputError(f"this is asked of a boundary of {self!r}, got the point "
                             f"{shown(boundary)}; scene.pin supports a point, and "
                             "scene.hinge joins it to another one")
        found = mesh.normalize_facets(boundary)
        if not len(found):
            raise MeshError(f"no facet of the boundary of {self!r} is at {shown(boundary)}")
        return np.asarray(found)

    def dofs(self, boundary: Any = None, names: str | Sequence[str] | None = None) -> Array:
        """Numbers of degrees of freedom, shape (n,).

        Parameters
        ----------
        boundary
            What ``basis.get_dofs`` takes, or what it returns; None for all.
        names
            Of :attr:`dofnames`, or without component, as ``"u"``; None for all.
        """
        if boundary is None or boundary is self:
            found = np.arange(self.N)
        else:
            view = boundary if isinstance(boundary, DofsView) else self.basis.get_dofs(
                self._facets(boundary))
            found = np.sort(self.numbers(view.all()))
        names = ["u"] if names is None else [names] if isinstance(names, str) else list(names)
        for one in names:
            if one not in ("u", "r", *self.dofnames):
                raise NameUnknown("degree of freedom", one, ["u", *self.dofnames])
        kept = [c for c in range(2) if {"u", "r", f"u^{c + 1}"} & set(names)]
        return found[np.isin(found % 2, kept)]

    def trace(self, boundary: Any) -> Any:
        """The ``FacetBasis`` of a boundary."""
        return self.basis.boundary(self._facets(boundary))

    def moments(self, boundary: Any) -> tuple[Array, Array, Array, Array]:
        """Mean and best straight line of a boundary, as weights of the DOFs of a component.

        Returns
        -------
        x, d
            Place (2,) of the mean, and the line from one end to the other, (2,).
        mean, line
            Weights (N / 2,) of the DOFs of one component.
        """
        basis = self.trace(boundary)
        x, dx = np.asarray(basis.global_coordinates()), basis.dx
        length, centre = np.sum(dx), np.sum(x * dx, axis=(1, 2)) / np.sum(dx)
        off = x - centre[:, None, None]
        values, axes = np.linalg.eigh(np.einsum("iep,jep,ep->ij", off, off, dx) / length)
        if values[0] > 1e-9 * values[1]:
            raise InputError(f"the boundary {shown(boundary)} of {self!r} is not straight: it is "
                             "no section to weld a cable to")
        along = axes[:, 1]
        s = np.einsum("i,iep->ep", along, off)
        weights = [LinearForm(lambda v, w: w["f"] * v[0]).assemble(basis, f=f)[self._order][::2]
                   for f in (1.0 / length + 0.0 * s, s / np.sum(s**2 * dx))]
        return centre, along, weights[0], weights[1]

    # points

    def place(self, at: Any) -> Array:
        """A point (x, y) of the reference configuration as an array (2,)."""
        return as_point(at)

    def locate(self, x: Array) -> tuple[Array, Array]:
        """Cells (n,) and coordinates (2, n) in them of points (2, n); -1 for those outside."""
        mesh, mapping = self.basis.mesh, self.basis.mapping
        nodes = mesh.p[:, mesh.t] if mesh.doflocs.shape[1] == mesh.p.shape[1] else (
            mesh.doflocs[:, mesh.dofs.element_dofs])
        low, high = nodes.min(axis=1), nodes.max(axis=1)
        pad = 0.1 * (high - low).max(axis=0)
        cells, local = np.full(x.shape[1], -1), np.zeros(x.shape)
        for k, point in enumerate(x.T):
            near = np.flatnonzero(np.all((low - pad <= point[:, None])
                                         & (point[:, None] <= high + pad), axis=0))
            if not len(near):
                continue
            X = _local(mapping, point, near)
            out = np.maximum(-X.min(axis=0), (X.sum(axis=0) if mesh.t.shape[0] == 3 else
                                              X.max(axis=0)) - 1.0)
            best = int(np.argmin(np.where(np.isfinite(out), out, np.inf)))
            if out[best] <= OUTSIDE:
                cells[k], local[:, k] = near[best], X[:, best]
        return cells, local

    def contains(self, x: ArrayLike) -> Array:
        """Whether points (2, n) of the reference configuration are in it or on it, shape (n,)."""
        return self.locate(require_finite("x", x, (2, None)))[0] >= 0

    def probe(self, at: Any) -> tuple[Array, Array]:
        """Numbers and weights, shape (2, k) both, of the DOFs in the displacement of a point."""
        dofs, weights = self.probes(self.place(at)[:, None])
        return dofs[..., 0], np.tile(weights[:, 0], (2, 1))

    def probes(self, x: Array) -> tuple[Array, Array]:
        """Numbers (2, k, n) and weights (k, n) of the DOFs in the displacement of points (2, n)."""
        cells, X = self.locate(x)
        if np.any(cells < 0):
            k = int(np.argmax(cells < 0))
            raise MeshError(f"the point ({x[0, k]:.6g}, {x[1, k]:.6g}) is outside of {self!r}")
        dofs = self.numbers(self.basis.element_dofs[:, cells]).reshape(-1, 2, len(cells))
        return dofs.swapaxes(0, 1), self._functions(X[:, :, None], cells)[..., 0]

    def _functions(self, X, cells=None):
        """The scalar local functions (k, n, points) at points of the reference cell."""
        basis = self.basis
        return np.array([np.asarray(basis.elem.gbasis(basis.mapping, X, k, tind=cells)[0])[0]
                         for k in range(0, basis.Nbfun, 2)])

    def drawn(self, u: Array, parts: int = 1) -> tuple[Array, Array, Array, Array]:
        """What pictures show of a displacement of the DOFs, shape (N,).

        Parameters
        ----------
        u
            The displacement.
        parts
            Times that a cell is halved.

        Returns
        -------
        x, moved, gradient, cells
            Points of each cell, (2, n), their displacement and its gradient, (2, 2, n), and
            triangles or quads as rows of point numbers.
        """
        mesh, basis = self.basis.mesh, self.basis
        cell = mesh.init_refdom().refined(parts)
        x = np.asarray(basis.mapping.F(cell.p))
        dofs = self.numbers(basis.element_dofs).reshape(-1, 2, mesh.nelements)
        grads = np.array([np.asarray(basis.elem.gbasis(basis.mapping, cell.p, k)[0].grad)[0]
                          for k in range(0, basis.Nbfun, 2)])
        moved = np.einsum("kep,kce->cep", self._functions(cell.p), u[dofs])
        gradient = np.einsum("kjep,kce->cjep", grads, u[dofs])
        first = cell.p.shape[1] * np.arange(mesh.nelements)
        cells = (first[:, None, None] + cell.t.T).reshape(-1, len(cell.t))
        return x.reshape(2, -1), moved.reshape(2, -1), gradient.reshape(2, 2, -1), cells


class DomainPoints:
    """Points of one domain; attributes as of :class:`~skfem_ancf.beam.points.BeamPoints`."""

    off_axis = False

    def __init__(self, domain: Domain, dofs: slice, index: Array | None, start: Array) -> None:
        self.body, self.slice, self.index, self.start = domain, dofs, index, start
        self._dofs, self._weights = domain.probes(start)

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for degrees of freedom ``u`` (..., N) of the scene."""
        return np.sum(u[..., self.slice][..., self._dofs] * self._weights, axis=-2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n) for degrees of freedom and their rates, (..., N)."""
        return self.displacement(v)

    @property
    def number(self) -> int:
        """Raises InputError: fields of a domain are a matter of its basis."""
        raise InputError(f"the strain and stress of {self.body!r} are those of its own forms: "
                         "basis.interpolate(domain.of_basis(state.u_of(domain))) has the gradient")


def _require_plane(basis):
    """Raise InputError unless a basis is one of plane vectors on all cells of a mesh."""
    if not isinstance(basis, Basis):
        raise InputError(f"a Domain is made of a Basis of scikit-fem, got {shown(basis)}")
    if basis.mesh.dim() != 2:
        raise InputError(f"a Domain is plane, as beams are, got a mesh of dimension "
                         f"{basis.mesh.dim()}: {shown(basis.mesh)}")
    if not isinstance(basis.elem, ElementVector) or basis.elem.dim != 2:
        raise InputError("the unknown of a Domain is a displacement with two components: wrap the "
                         f"element, as ElementVector(ElementQuad2()), got {shown(basis.elem)}")
    if len(np.unique(basis.element_dofs)) < basis.N:
        raise InputError("a Domain is all of its mesh, and the basis has degrees of freedom in no "
                         "cell: for a part of it take mesh.restrict(elements)")


def _narrow(basis):
    """Numbers of the DOFs in an order in which those of one cell are near to each other.

    By reverse Cuthill-McKee, or along x or y: in cells of many nodes that may be narrower.
    """
    pairs, n = basis.element_dofs[::2] // 2, basis.N // 2
    k = len(pairs)
    i, j = np.repeat(pairs, k, axis=0).ravel(), np.tile(pairs, (k, 1)).ravel()
    graph = sparse.csr_matrix((np.ones(len(i)), (i, j)), shape=(n, n))
    x, y = basis.doflocs[:, ::2]
    orders = [reverse_cuthill_mckee(graph, symmetric_mode=True), np.lexsort((y, x)),
              np.lexsort((x, y))]
    order = min(orders, key=lambda order: np.max(np.ptp(np.argsort(order)[pairs], axis=0)))
    return (2 * order[:, None] + np.arange(2)).ravel()


def _local(mapping, point, cells):
    """The coordinates (2, n) of a point in cells (n,), by Newton's method; not of far ones."""
    X = np.full((2, len(cells), 1), 1.0 / 3.0)
    with np.errstate(all="ignore"):
        for _ in range(ITERATIONS):
            rest = point[:, None] - mapping.F(X, tind=cells)[..., 0]
            D = np.moveaxis(mapping.DF(X, tind=cells)[..., 0], -1, 0)
            X = X + np.linalg.solve(D, rest.T[..., None]).transpose(1, 0, 2)
    return X[..., 0]
