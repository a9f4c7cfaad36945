"""Two-dimensional bodies: a basis of scikit-fem with its forms, and weak forms of hyperelastic
bodies for all local functions at once."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import sparse
from skfem import Basis, BilinearForm, DofsView, ElementVector, Functional, LinearForm
from skfem.assembly.form.form import FormExtraParams
from skfem.helpers import dot

from ..core import (Array, ArrayLike, CallbackError, Immutable, InputError, MeshError,
                    cached_property, explained, gauss, read_only, refuse, refuse_any,
                    require_finite, require_label, require_like, require_option, require_positive,
                    require_slope)
from ..materials import HistoryMaterial, Material
from ..mesh.places import as_point, is_point
from ..sections.section import evaluated


def tensor(S: Array) -> Array:
    """The symmetric tensor (2, 2, ...) of components (xx, yy, xy), shape (3, ...)."""
    return np.array([[S[0], S[2]], [S[2], S[1]]])


def moduli_at(law: Any, F: Array, strain: Array) -> Array:
    """Derivatives (2, 2, 2, 2, ...) of the first Piola-Kirchhoff stress by F, at a Green strain."""
    k = np.array([[0, 2], [2, 1]])
    D = law.moduli(strain)[k][:, :, k]
    A = np.einsum("iI...,IJKL...,kK...->iJkL...", F, D, F, optimize=True)
    return A + np.einsum("ik,JL...->iJkL...", np.eye(2), tensor(law.stress(strain)))


def displacement_strain(H: Array) -> Array:
    """Green-Lagrange strain (eps_xx, eps_yy, 2 eps_xy) of a displacement gradient (2, 2, ...)."""
    # It has no cancellation at small strain.
    square = np.einsum("ki...,kj...->ij...", H, H)
    return np.array([H[0, 0] + 0.5 * square[0, 0], H[1, 1] + 0.5 * square[1, 1],
                     H[0, 1] + H[1, 0] + square[0, 1]])


class PiolaForm(LinearForm):
    """A linear form ``int P : grad v``; the decorated function of ``w`` returns P (2, 2, ...)."""

    def _parameters(self, basis, kwargs):
        return FormExtraParams({**basis.default_parameters(),
                                **self._normalize_asm_kwargs(kwargs, basis)})

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        P = self.form(self._parameters(ubasis, kwargs)) * ubasis.dx
        nq, ne = ubasis.Nbfun, ubasis.nelems
        B = _gradient_table(ubasis).reshape(ne, nq, -1)
        P = np.moveaxis(P, (2, 3), (0, 1)).reshape(ne, -1, 1)
        data = (B @ P)[..., 0].T
        return np.array([ubasis.element_dofs.ravel()]), data.ravel(), (ubasis.N,), (nq,)


class PiolaTangent(BilinearForm):
    """A bilinear form ``int grad v : A : grad u``; the function returns A (2, 2, 2, 2, ...)."""

    _parameters = PiolaForm._parameters

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        A = self.form(self._parameters(ubasis, kwargs)) * ubasis.dx
        nq, ne = ubasis.Nbfun, ubasis.nelems
        B = _gradient_table(ubasis).reshape(ne, nq, -1, 4)
        A = np.moveaxis(A.reshape(4, 4, ne, -1), (2, 3), (0, 1))
        AB = A @ B.transpose(0, 2, 3, 1)  # (ne, np, 4, nq)
        K = B.reshape(ne, nq, -1) @ AB.reshape(ne, -1, nq)  # rows v, columns u
        return scattered(K, ubasis)


def _gradient_table(basis):
    return np.ascontiguousarray(np.moveaxis(np.array([b[0].grad for b in basis.basis]),
                                            (0, 3, 4, 1, 2), (1, 0, 2, 3, 4)))


def scattered(K: Array, basis: Any) -> tuple[Any, Array, tuple[int, int], tuple[int, int]]:
    """Element matrices (ne, nq, nq), rows v and columns u, as COO data of scikit-fem."""
    nq, dofs = basis.Nbfun, basis.element_dofs
    rows, cols = np.tile(dofs, (nq, 1)), np.repeat(dofs, nq, axis=0)
    return (np.array([rows.ravel(), cols.ravel()]), K.transpose(2, 1, 0).ravel(),
            (basis.N, basis.N), (nq, nq))


class SolidForms:
    """Energy, force, tangent and mass of a material without a history at the displacement
    ``w["u"]``. Functions of the material are of global coordinates; ``mass`` is None without
    density."""

    def __init__(self, material: Material, width: float) -> None:
        require_like("material", material, "Material", "law", "reference")
        refuse(isinstance(material, HistoryMaterial), "a Domain has no history of its material, "
               "got {!r}: only beams can be plastic or viscoelastic. Use StVenantKirchhoff or "
               "NeoHookean", material)
        one, self.grade = material.reference()
        self.law, self.width, self.material = one.law(), require_positive("width", width), material
        self.energy = Functional(self._energy)
        self.residual, self.tangent = PiolaForm(self._force), PiolaTangent(self._tangent)
        self.mass = None if material.density is None else BilinearForm(self._mass)

    def _factor(self, w):
        return self.width * grade_at(self.grade, np.asarray(w.x), "E")

    def _energy(self, w):
        return self._factor(w) * self.law.energy(displacement_strain(w["u"].grad))

    def _force(self, w):
        S = tensor(self.law.stress(displacement_strain(w["u"].grad)))
        return self._factor(w) * (S + np.einsum("iJ...,JK...->iK...", w["u"].grad, S))

    def _tangent(self, w):
        H = w["u"].grad
        F = H + np.eye(2)[:, :, None, None]
        return self._factor(w) * moduli_at(self.law, F, displacement_strain(H))

    def _mass(self, u, v, w):
        density = self.material.density
        rho = grade_at(density, np.asarray(w.x), "density") if callable(density) else density
        return self.width * rho * dot(u, v)


def grade_at(function: Any, x: Array, what: str) -> Any:
    """A positive function of coordinates at points (2, ...); 1 for None."""
    if function is None:
        return 1.0
    return evaluated(what, function, *x)


class Domain(Immutable):
    """A two-dimensional body given by a basis and forms of scikit-fem, a member of a Scene.

    The unknown is the displacement from the reference configuration, ``w["u"]`` in the forms, with
    the DOFs of the basis. The forms include the thickness. ``scene.weld((domain, "right"), (beam,
    "left"))`` connects a boundary to a beam. Raises InputError if the basis has no plane vectors,
    or if the tangent is not the derivative of the residual.

    Parameters
    ----------
    basis
        A ``Basis`` of a plane mesh and an ``ElementVector``, as ``Basis(MeshQuad(),
        ElementVector(ElementQuad2()))``.
    residual
        ``LinearForm`` of the internal virtual work at the displacement ``w["u"]``.
    tangent
        ``BilinearForm``: its derivative by the displacement.
    mass
        ``BilinearForm`` of the mass, ``rho * dot(u, v)``, for weight, modes and motion.
    name
        Name in messages.

    Notes
    -----
    In the scene the DOFs are renumbered to reduce the bandwidth; :meth:`of_basis` restores the
    order of the basis.

    The energy of user-defined forms is the work of the residual along a straight path from the
    reference configuration, by Gauss quadrature; it is exact for polynomials. The
    energy-momentum scheme uses the mean of the residual over a step (averaged vector field): it
    conserves energy and linear momentum; the error of the angular momentum is of second order. It
    rejects domains with an unsymmetric tangent, which have no energy.

    References
    ----------
    Averaged vector field: Quispel, McLaren: "A new class of energy-preserving numerical integration
    methods", Journal of Physics A 41 (2008).

    Examples
    --------
    A cantilever of forms of linear elasticity with a beam at its end; :meth:`solid` has the forms
    of a material:

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
    _solid: SolidForms | None = None

    def __init__(self, basis: Basis, residual: LinearForm, tangent: BilinearForm,
                 mass: BilinearForm | None = None, name: str | None = None) -> None:
        refuse(not isinstance(basis, Basis), "a Domain needs a Basis of scikit-fem, got {!r}",
               basis)
        refuse(basis.mesh.dim() != 2, "a Domain is plane, as beams are, got a mesh of dimension "
               "{}: {!r}", basis.mesh.dim(), basis.mesh)
        refuse(not isinstance(basis.elem, ElementVector) or basis.elem.dim != 2, "the unknown of a "
               "Domain is a displacement with two components: use an "
               "ElementVector(ElementQuad2()), got {!r}", basis.elem)
        refuse(len(np.unique(basis.element_dofs)) < basis.N, "the basis of a Domain must cover its "
               "whole mesh: for a part of it use mesh.restrict(elements)")
        for what, form, kind in (("residual", residual, LinearForm),
                                 ("tangent", tangent, BilinearForm), ("mass", mass, BilinearForm)):
            refuse(not (isinstance(form, kind) or (form is None and what == "mass")),
                   "{} of a Domain is a {} of scikit-fem, got {!r}{}", what, kind.__name__, form,
                   "; of a linear problem with the BilinearForm a it is LinearForm(lambda v, w: "
                   "a.form(w['u'], v, w))" * isinstance(form, BilinearForm))
        self.basis, self.residual, self.tangent, self.mass = basis, residual, tangent, mass
        self.name = require_label("name", name)
        self.N: int = basis.N
        #: Names of both components.
        self.dofnames = ["u^1", "u^2"]
        #: Mean of the vertices, shape (2,).
        self.origin = np.asarray(basis.mesh.p.mean(axis=1))
        #: The larger of width and height.
        self.size = float(np.max(np.ptp(basis.mesh.p, axis=1)))
        #: Typical changes of the DOFs when the domain moves by its size, (N,).
        self.sizes = np.full(basis.N, self.size)
        # a numbering of the DOFs with a small bandwidth: reverse Cuthill-McKee, or along
        # x or y
        pairs, n = basis.element_dofs[::2] // 2, basis.N // 2
        k = len(pairs)
        i, j = np.repeat(pairs, k, axis=0).ravel(), np.tile(pairs, (k, 1)).ravel()
        graph = sparse.csr_matrix((np.ones(len(i)), (i, j)), shape=(n, n))
        x, y = basis.doflocs[:, ::2]
        orders = [sparse.csgraph.reverse_cuthill_mckee(graph, symmetric_mode=True),
                  np.lexsort((y, x)), np.lexsort((x, y))]
        order = min(orders, key=lambda order: np.max(np.ptp(np.argsort(order)[pairs], axis=0)))
        self._order = (2 * order[:, None] + np.arange(2)).ravel()
        self._rank = np.argsort(self._order)
        #: Number of subdiagonals.
        self.bandwidth = int(np.max(np.ptp(self.numbers(basis.element_dofs), axis=0)))
        self._require_derivatives()

    @classmethod
    def solid(cls, basis: Basis, material: Material, width: float = 1.0,
              name: str | None = None) -> "Domain":
        """A domain of a material of the package or a user-defined one, with stress in results.

        Raises InputError if the material has a history.

        Parameters
        ----------
        basis
            As for :class:`Domain`.
        material
            As :class:`~skfem_ancf.StVenantKirchhoff` or :class:`~skfem_ancf.NeoHookean`, in plane
            stress or plane strain, without a history. Its ``E`` and ``density`` may be functions of
            global coordinates (x, y). Without a density the domain has no mass.
        width
            Thickness out of the plane, positive.
        name
            Name in messages.

        Examples
        --------
        A strip in uniaxial stress:

        >>> import numpy as np
        >>> from skfem import Basis, ElementQuad2, ElementVector, MeshQuad
        >>> from skfem_ancf import Domain, Scene, StVenantKirchhoff
        >>> mesh = MeshQuad.init_tensor(np.linspace(0, 2, 5), np.linspace(0, 1, 3)).with_defaults()
        >>> strip = Domain.solid(Basis(mesh, ElementVector(ElementQuad2())),
        ...                      StVenantKirchhoff(E=100.0, nu=0.3), width=0.1)
        >>> scene = Scene(strip).fix("left", "u^1").fix("bottom", "u^2").fix("right", "u^1", 0.2)
        >>> float(scene.solve_static().stress((1, 0.5), strip)[0].round(6))  # E (1.1^2 - 1) / 2
        10.5
        """
        forms = SolidForms(material, width)
        domain = cls(basis, forms.residual, forms.tangent, forms.mass, name)
        domain._solid = forms
        return domain

    @property
    def material(self) -> Material:
        """The material; InputError if the forms are user-defined."""
        if self._solid is None:
            raise InputError(f"the stress of {self!r} depends on its forms, which are user-defined:"
                             " a Domain.solid(basis, material) knows its stress")
        return self._solid.material

    def __repr__(self):
        who = "" if self.name is None else f"{self.name} "
        mesh = self.basis.mesh
        return f"<Domain {who}of {mesh.nelements} {type(mesh).__name__} cells, {self.N} DOFs>"

    def of_basis(self, u: Array) -> Array:
        """DOFs of the scene (..., N), as of ``state.u_of(domain)``, in the order of the basis."""
        u = require_finite("u", u)
        refuse(u.shape[-1:] != (self.N,), "u must hold the {} DOFs of {!r}, as state.u_of(domain), "
               "got the shape {}", self.N, self, u.shape)
        return u[..., self._rank]

    def numbers(self, dofs: Array) -> Array:
        """Numbers in the scene, relative to the first of the domain, of DOFs (...) of the basis."""
        return self._rank[dofs]

    # forms

    def load(self, form: LinearForm, boundary: Any = None) -> Array:
        """The force (N,) of a form on the domain or a boundary.

        Parameters
        ----------
        form
            Knows ``w.x``, ``w.h`` and, on a boundary, ``w.n``.
        boundary
            Facets in a form that scikit-fem accepts; None for the domain.
        """
        basis = self.basis if boundary is None else self.trace(boundary)
        return self._ask("load", form.assemble, basis)[self._order]

    def _with(self, u):
        return {"u": self.basis.interpolate(np.asarray(u)[self._rank])}

    def _ask(self, name, function, *args, **options):
        hint = ("residual and tangent know w['u'], the displacement, w['u'].grad, w.x and w.h; "
                "mass and loads w.x, w.h and, on a boundary, w.n")
        with explained("the {} of {!r} fails", hint, CallbackError, name, self), np.errstate(
                all="ignore"):  # iterates may be inverted
            return function(*args, **options)

    def force(self, u: Array) -> Array:
        """The internal force at a displacement, (N,) both."""
        return self._ask("residual", self.residual.assemble, self.basis,
                         **self._with(u))[self._order]

    def stiffness(self, u: Array) -> Array:
        """Values (k,) of the tangent at the entries :attr:`pattern`."""
        data = self._ask("tangent", self.tangent.coo_data, self.basis, **self._with(u)).data
        return np.bincount(self._entries[2], data, len(self._entries[0]))

    @cached_property
    def _entries(self):
        i, j = self._rank[self.tangent.coo_data(self.basis, **self._with(np.zeros(self.N))).indices]
        places, which = np.unique(i * np.int64(self.N) + j, return_inverse=True)
        return places // self.N, places % self.N, which

    @property
    def pattern(self) -> tuple[Array, Array]:
        """Rows and columns (k,) of the tangent."""
        return self._entries[0], self._entries[1]

    def matrix(self, u: Array | None = None) -> sparse.csr_array:
        """The sparse tangent at a displacement (N,), zero by default."""
        values = self.stiffness(np.zeros(self.N) if u is None else u)
        return sparse.csr_array((values, self.pattern), shape=(self.N, self.N))

    def energy(self, u: Array) -> float:
        """Strain energy at a displacement (N,): the work of the residual from rest."""
        if self._solid is not None:
            return float(self._ask("energy", self._solid.energy.assemble, self.basis,
                                   **self._with(u)))
        return float(sum(w * (self.force(s * u) @ u) for s, w in zip(*gauss(6))))

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """Mean of the internal force on a straight path between two displacements.

        Parameters
        ----------
        u0, u1
            Displacements at the start and the end, shape (N,).
        """
        d = u1 - u0
        return sum((w * self.force(u0 + s * d) for s, w in zip(*gauss(3))), np.zeros(self.N))

    def inverted(self, u: Array) -> bool:
        """True if a cell is turned inside out at a displacement (N,)."""
        (a, b), (c, d) = self._with(u)["u"].grad
        return bool(np.any((1.0 + a) * (1.0 + d) <= b * c))

    def _require_derivatives(self):
        mesh = self.basis.mesh  # strains are small in the thinnest cell
        thin = np.min(self.basis.dx.sum(axis=1) / np.ptp(mesh.p[:, mesh.t], axis=1).max(axis=0))
        u, v = thin * np.array([[1e-2], [1e-4]]) * np.cos(np.arange(2.0 * self.N)).reshape(2, -1)
        K = self.matrix(u)
        require_slope(f"the tangent of {self!r}", "the residual", lambda s: require_finite(
            f"the residual of {self!r}", self.force(u + s * v)), K @ v)
        self.symmetric = bool(abs(K - K.T).max() <= 1e-10 * abs(K).max())

    # the interface of a beam

    @cached_property
    def q0_local(self) -> Array:
        """DOFs of the position relative to :attr:`origin`, (N,)."""
        return self.velocity_of(lambda x: x - self.origin[:, None])

    @property
    def q0(self) -> Array:
        """DOFs of the position, (N,)."""
        return self.q0_local + self.rigid_motions()[:, :2] @ self.origin

    @cached_property
    def scale(self) -> float:
        """Energy of a unit strain, about: modulus times volume."""
        return float(abs(self.q0_local @ (self.matrix() @ self.q0_local)))

    @cached_property
    def held(self) -> bool:
        """True if the forms resist a rigid motion, as elastic bedding does."""
        K, motions = self.matrix(), self.rigid_motions()
        return bool(np.any(np.abs(K @ motions) > 1e-9 * (abs(K) @ np.abs(motions))))

    @cached_property
    def _mass(self):
        if self.mass is None:
            raise InputError(f"{self!r} has no mass: give its material a density, or a Domain of "
                             "forms mass=BilinearForm(lambda u, v, w: rho * width * dot(u, v))")
        M = sparse.csr_array(self._ask("mass", self.mass.assemble, self.basis))
        require_finite(f"the mass of {self!r}", M.data)
        low, size = M.diagonal().min(), abs(M).max()
        refuse(low < -1e-12 * size or abs(M - M.T).max() > 1e-10 * size, "the mass of {!r} must be "
               "symmetric and not negative, as rho * width * dot(u, v), got a diagonal with "
               "{:.6g}, or a form in which u and v cannot be interchanged", self, low)
        return M[self._order][:, self._order]

    @property
    def total_mass(self) -> float:
        """The mass."""
        along = self.rigid_motions()[:, 0]
        return float(along @ (self._mass @ along))

    def mass_entries(self) -> tuple[Array, Array, Array]:
        """Rows, columns and values (k,) of the mass matrix."""
        M = self._mass.tocoo()
        return M.row, M.col, M.data

    def weight(self, g: ArrayLike) -> Array:
        """The dead load of an acceleration ``g`` (2,), shape (N,)."""
        return self._mass @ (self.rigid_motions()[:, :2] @ require_finite("g", g, (2,)))

    def velocity_of(self, field: Callable[[Array], Array]) -> Array:
        """L2 projection (N,) of a vector field, a function of points (2, n)."""
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
        """Facet numbers of a boundary in a form that scikit-fem accepts."""
        mesh = self.basis.mesh
        if isinstance(boundary, str):
            require_option("boundary", boundary, mesh.boundaries or {})
        refuse(is_point(boundary), "a boundary of {!r} is needed here, got the point {!r}; "
               "scene.pin supports a point, scene.hinge connects it", self, boundary)
        found = np.asarray(mesh.normalize_facets(boundary))
        refuse(not len(found), "no facet of the boundary of {!r} is at {!r}", self, boundary,
               error=MeshError)
        return found

    def dofs(self, boundary: Any = None, names: str | Sequence[str] | None = None) -> Array:
        """Numbers of DOFs, shape (n,).

        Parameters
        ----------
        boundary
            An argument or result of ``basis.get_dofs``; None for all.
        names
            From :attr:`dofnames`, or without component, as ``"u"``; None for all.
        """
        if boundary is None or boundary is self:
            found = np.arange(self.N)
        else:
            view = boundary if isinstance(boundary, DofsView) else self.basis.get_dofs(
                self._facets(boundary))
            found = np.sort(self.numbers(view.all()))
        names = ["u"] if names is None else [names] if isinstance(names, str) else list(names)
        for one in names:
            if one != "r":
                require_option("degree of freedom", one, ["u", *self.dofnames])
        kept = [c for c in range(2) if {"u", "r", f"u^{c + 1}"} & set(names)]
        return found[np.isin(found % 2, kept)]

    def trace(self, boundary: Any) -> Any:
        """The ``FacetBasis`` of a boundary."""
        return self.basis.boundary(self._facets(boundary))

    def moments(self, boundary: Any) -> tuple[Array, Array, Array, Array]:
        """Mean position x (2,) of a boundary and the line d (2,) from end to end of the best
        straight one, and both as weights (N / 2,) of the DOFs of one component."""
        basis = self.trace(boundary)
        x, dx = np.asarray(basis.global_coordinates()), basis.dx
        length, centre = np.sum(dx), np.sum(x * dx, axis=(1, 2)) / np.sum(dx)
        off = x - centre[:, None, None]
        values, axes = np.linalg.eigh(np.einsum("iep,jep,ep->ij", off, off, dx) / length)
        refuse(values[0] > 1e-9 * values[1], "the boundary {!r} of {!r} is not straight: a cable "
               "cannot be welded to it", boundary, self)
        along = axes[:, 1]
        s = np.einsum("i,iep->ep", along, off)
        weights = [LinearForm(lambda v, w: w["f"] * v[0]).assemble(basis, f=f)[self._order][::2]
                   for f in (1.0 / length + 0.0 * s, s / np.sum(s**2 * dx))]
        return centre, along, weights[0], weights[1]

    # points

    def place(self, at: Any) -> Array:
        """A point (x, y) as an array (2,)."""
        return as_point(at)

    def _locate(self, x: Array) -> tuple[Array, Array]:
        """Cells (n,), -1 if outside, and local coordinates (2, n) of points (2, n)."""
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
            # not mapping.invF, which fails for all cells if one does not converge
            X = np.full((2, len(near), 1), 1.0 / 3.0)
            with np.errstate(all="ignore"):
                for _ in range(12):
                    rest = point[:, None] - mapping.F(X, tind=near)[..., 0]
                    D = np.moveaxis(mapping.DF(X, tind=near)[..., 0], -1, 0)
                    X = X + np.linalg.solve(D, rest.T[..., None]).transpose(1, 0, 2)
            X = X[..., 0]
            out = np.maximum(-X.min(axis=0), (X.sum(axis=0) if mesh.t.shape[0] == 3 else
                                              X.max(axis=0)) - 1.0)
            best = int(np.argmin(np.where(np.isfinite(out), out, np.inf)))
            if out[best] <= 1e-6:
                cells[k], local[:, k] = near[best], X[:, best]
        return cells, local

    def contains(self, x: ArrayLike) -> Array:
        """Whether points (2, n) of the reference configuration are in the domain, shape (n,)."""
        return self._locate(require_finite("x", x, (2, None)))[0] >= 0

    def probe(self, at: Any) -> tuple[Array, Array]:
        """Numbers and weights (2, k) of the DOFs in the displacement of a point."""
        dofs, weights = self.probes(self.place(at)[:, None])
        return dofs[..., 0], np.tile(weights[:, 0], (2, 1))

    def probes(self, x: Array) -> tuple[Array, Array]:
        """Numbers (2, k, n) and weights (k, n) of the DOFs in the displacement of points (2, n)."""
        cells, X = self._locate(x)
        refuse_any(cells < 0, "the point {:.6g} is outside of {!r}", x, self, error=MeshError)
        dofs = self.numbers(self.basis.element_dofs[:, cells]).reshape(-1, 2, len(cells))
        return dofs.swapaxes(0, 1), self._functions(X[:, :, None], cells)[0][..., 0]

    def _functions(self, X, cells=None):
        """Scalar shape functions (k, n, points) and gradients (k, 2, n, points) at points of the
        reference cell."""
        basis = self.basis
        fields = [basis.elem.gbasis(basis.mapping, X, k, tind=cells)[0]
                  for k in range(0, basis.Nbfun, 2)]
        return (np.array([np.asarray(field)[0] for field in fields]),
                np.array([np.asarray(field.grad)[0] for field in fields]))


class DomainPoints:
    """Points of one domain; attributes as of :class:`~skfem_ancf.beam.layout.BeamPoints`."""

    off_axis = False

    def __init__(self, domain: Domain, dofs: slice, index: Array | None, start: Array) -> None:
        self.body, self.slice, self.index, self.start = domain, dofs, index, start
        self._dofs, self._weights = domain.probes(start)

    def displacement(self, u: Array) -> Array:
        """Displacements (..., 2, n) for DOFs ``u`` (..., N) of the scene."""
        return np.sum(u[..., self.slice][..., self._dofs] * self._weights, axis=-2)

    def velocity(self, u: Array, v: Array) -> Array:
        """Velocities (..., 2, n) for DOFs and their rates, (..., N)."""
        return self.displacement(v)

    def fields(self, u: Array) -> tuple[Array, Array]:
        """Displacement (2, n) and its gradient (2, 2, n) for DOFs ``u`` (N,) of the scene."""
        cells, X = self.body._locate(self.start)
        slopes = self.body._functions(X[:, :, None], cells)[1][..., 0]
        return self.displacement(u), np.einsum("kjn,ikn->ijn", slopes, u[self.slice][self._dofs])


def grade_of(domain: Domain, x: Array) -> Any:
    """Modulus at points (2, n) of a domain over that of ``material.reference()``."""
    return grade_at(domain._solid.grade, x, "E") if domain._solid else 1.0


def drawn(domain: Domain, u: Array, parts: int = 1) -> tuple[Array, Array, Array, Array]:
    """For plots points (2, n), displacement and gradient (2, 2, n), and triangles or quads."""
    mesh, basis = domain.basis.mesh, domain.basis
    cell = mesh.init_refdom().refined(parts)
    x = np.asarray(basis.mapping.F(cell.p))
    dofs = domain.numbers(basis.element_dofs).reshape(-1, 2, mesh.nelements)
    functions, grads = domain._functions(cell.p)
    moved = np.einsum("kep,kce->cep", functions, u[dofs])
    gradient = np.einsum("kjep,kce->cjep", grads, u[dofs])
    first = cell.p.shape[1] * np.arange(mesh.nelements)
    cells = (first[:, None, None] + cell.t.T).reshape(-1, len(cell.t))
    return x.reshape(2, -1), moved.reshape(2, -1), gradient.reshape(2, 2, -1), cells
