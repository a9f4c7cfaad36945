"""A beam: a mesh, an element, a material and a formulation."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import sparse
from skfem import Basis, ElementVector, FacetBasis

from ..core import (Array, ArrayLike, Immutable, Place, cached_property, read_only, refuse,
                    require_finite, require_flag, require_integer, require_kind, require_label,
                    require_like, require_names, require_option, require_unmasked)
from ..elements import ElementBeam, choose_element
from ..formulations import Formulation, Term, get_formulation
from ..materials import Material
from ..materials.damping import KelvinVoigt
from ..mesh.mesh_beam import MeshBeam, reach
from ..mesh.places import Finder, facets_of
from ..sections import Across, Rectangle, Section
from . import kinematics
from .masses import Masses, exact_rule, masses_of
from .strains import BeamLayer, Interpolation, on_grid, strain_at, stress_at


def reference_coordinates(basis: Basis) -> Array:
    """DOFs of the reference configuration, shape (basis.N,).

    Parameters
    ----------
    basis
        A ``Basis`` of ``ElementVector(element)`` on a MeshBeam.

    Examples
    --------
    >>> from skfem import Basis, ElementVector
    >>> from skfem_ancf import ElementBeamANCF, MeshBeam, reference_coordinates
    >>> basis = Basis(MeshBeam.init_line([0, 2], height=0.1), ElementVector(ElementBeamANCF(1)))
    >>> reference_coordinates(basis).tolist()  # r, r_X, r_Y of both nodes
    [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0, 1.0, 0.0, 0.0, 1.0]
    """
    require_like("basis", basis, "Basis of ElementVector(element) on a MeshBeam", "mesh", "elem")
    element = getattr(basis.elem, "elem", None)
    refuse(not isinstance(basis.mesh, MeshBeam) or not isinstance(element, ElementBeam),
           "the basis must be one of ElementVector(element) on a MeshBeam, got {!r}", basis)
    return _coordinates(basis.mesh, element, basis.mesh.p).copy()


def _coordinates(mesh, element, p):
    """Read-only DOFs (N,) of the reference configuration, with positions p (2, nvertices)."""
    q = element.rigid(mesh)
    q[0] = p
    q = q.transpose(2, 0, 1).reshape(-1)
    q.flags.writeable = False
    return q


class Beam(Immutable):
    """A planar beam. It is immutable; :meth:`replace` returns a changed copy.

    Parameters
    ----------
    mesh
        A :class:`~skfem_ancf.MeshBeam`.
    element
        A beam element, such as ``ElementBeamANCF(3)``, or "auto": the element of lowest order that
        represents ``fields`` within ``tolerance``, see
        :func:`skfem_ancf.elements.choose_element`.
    material
        A material, such as :class:`~skfem_ancf.StVenantKirchhoff`; None if the section has its own
        materials.
    width
        Width of a full section: a positive number, or a function of material coordinates x, the
        parameter of the axis, and y, the distance from it, arrays of one shape.
    formulation
        How the strain is sampled and integrated: a name from
        :data:`skfem_ancf.formulations.FORMULATIONS`, or a formulation.
    name
        Name of the beam in messages and scenes.
    compiled
        Use compiled kernels where Numba supports them; results agree to round-off.
        ``SKFEM_ANCF_COMPILED=0`` in the environment disables Numba.
    fields, tolerance
        For the element "auto": names of section fields of interest, and the relative error that the
        beam theory may have.
    damping
        :class:`~skfem_ancf.KelvinVoigt`, or None.
    section
        A :class:`~skfem_ancf.Section` instead of the width.

    Other Parameters
    ----------------
    u
        Displacement of the degrees of freedom, shape (N,).
    X
        Points of the reference cell, (2, npoints) or (2, nelements, npoints).
    tind
        Elements, shape (nelements,), or None for all.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), ElementBeamANCF(3),
    ...             StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
    >>> beam.N, round(beam.total_mass, 6)
    (170, 0.78)
    """

    def __init__(self, mesh: MeshBeam, element: ElementBeam | str,
                 material: Material | None = None,
                 width: float | Callable[..., ArrayLike] | None = None,
                 formulation: str | Formulation | type[Formulation] = "assumed",
                 name: str | None = None, compiled: bool = True, fields: str | Sequence[str] = (),
                 tolerance: float = 1e-3, damping: KelvinVoigt | None = None,
                 section: Section | None = None) -> None:
        require_kind("mesh", mesh, MeshBeam)
        refuse(section is None and width is None, 'a beam has a section: give width=, that of a '
               'rectangle, or section=, as Section.profile("IPE 200")')
        refuse(section is not None and width is not None, "give a width or a section, not both: "
               "got {!r} and {!r}", width, section)
        if section is None:
            section = Rectangle(width)  # type: ignore[arg-type]
        self.section = require_kind("section", section, Section,
                                    ', as Section.profile("IPE 200")')
        if self.section.has_materials:
            refuse(material is not None, "material must be None, since {!r} has its own, got {!r}",
                   self.section, material)
        else:
            require_kind("material", material, Material)
        self._given = material
        self.material = material or self.section.layers_on(mesh, None)[0].material
        if isinstance(element, str) and element == "auto":
            element = choose_element(mesh, self.material.reference()[0], fields, tolerance)
        if damping is not None:
            require_kind("damping", damping, KelvinVoigt, ", as KelvinVoigt(1e-4), or None")
        element = require_kind("element", element, ElementBeam)
        self.element: ElementBeam = self.section.element_for(element)
        self.mesh, self.damping = self.element.fitted(mesh), damping
        self.formulation: Formulation = get_formulation(formulation)
        self.name, self.compiled = require_label("name", name), require_flag("compiled", compiled)
        #: Positions off the axis are linear in the DOFs, unlike those of a cable.
        self.has_sections = self.element.kinematics == "sections"
        self.nd = 2 * self.element.nodal_dofs
        self.N = self.nd * mesh.p.shape[1]
        self.width = getattr(self.section, "width", None)
        self.across = Across(self.mesh, self.element, self.section, material)
        if not self.has_sections:
            kinematics.require_cable(self)

    def __repr__(self):
        return (f"<Beam {self.name or ''}: {self.mesh.nelements} elements of order "
                f"{self.element.order}, {self.N} degrees of freedom, {self.formulation.name}>")

    def replace(self, **changes: Any) -> "Beam":
        """A copy with some arguments of the constructor changed.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1], height=0.1), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=1.0, nu=0.3), width=0.1)
        >>> stiffer = beam.replace(material=beam.material.replace(E=2.0), width=0.2)
        >>> beam.width, stiffer.width, stiffer.material.E
        (0.1, 0.2, 2.0)
        """
        known = ("mesh", "element", "material", "width", "formulation", "name", "compiled",
                 "damping", "section")
        for name in changes:
            require_option("argument of Beam", name, known + ("fields", "tolerance"))
        given = {name: getattr(self, name) for name in known} | {"material": self._given}
        given["section" if "width" in changes and isinstance(self.section, Rectangle) else
              "width"] = None
        return type(self)(**{**given, **changes})

    # the scikit-fem side

    @cached_property
    def basis(self) -> Basis:
        """``Basis`` of the position field with the quadrature of the formulation."""
        if len(self.across.layers) > 1:
            return self.exact_basis()
        return Basis(self.mesh, ElementVector(self.element), quadrature=self.terms[0].quadrature)

    def exact_basis(self) -> Basis:
        """``Basis`` whose quadrature integrates products of two DOFs exactly, as for the mass."""
        X, W = exact_rule(self)
        basis = Basis(self.mesh, ElementVector(self.element), quadrature=(X, W))
        if not self.mesh.is_straight:
            basis.dx = self.mesh.mapping().full_volume(X) * W
        return basis

    def facet_basis(self, facets: Place, intorder: int | None = None) -> FacetBasis:
        """``FacetBasis`` of the position field at a place, see :meth:`dofs`.

        Parameters
        ----------
        facets
            A place, see :func:`skfem_ancf.mesh.places.facets_of`.
        intorder
            Degree of exactness of the quadrature, 0 to 200; by default that of products of two
            DOFs.
        """
        if intorder is not None:
            intorder = require_integer("intorder", intorder, 0, 200)
        return FacetBasis(self.mesh, ElementVector(self.element),
                          facets=facets_of(self.mesh, facets),
                          intorder=2 * self.element.facet_points - 2 if intorder is None else
                          intorder)

    @cached_property
    def kernel(self) -> Any:
        """Evaluates the strain energy; see :mod:`skfem_ancf.beam.kernels`."""
        return kinematics.KERNELS[self.element.kinematics](self.across, self.formulation)

    @cached_property
    def terms(self) -> list[Term]:
        """Terms of the strain energy, for each material of the section."""
        return [term for layer in self.layers for term in layer.terms]

    @cached_property
    def layers(self) -> list[BeamLayer]:
        """Layers of the section with their terms, :class:`~.strains.BeamLayer`."""
        return [BeamLayer(self, layer, terms)
                for layer, terms in self.across.terms(self.formulation)]

    # degrees of freedom

    @cached_property
    def q0(self) -> Array:
        """DOFs of the reference configuration, shape (N,)."""
        return _coordinates(self.mesh, self.element, self.mesh.p)

    @cached_property
    def origin(self) -> Array:
        """A point near the beam, origin of the local coordinates."""
        return read_only(self.mesh.p.sum(axis=1) / self.mesh.p.shape[1])

    @cached_property
    def q0_local(self) -> Array:
        """:attr:`q0` with positions relative to :attr:`origin`."""
        return _coordinates(self.mesh, self.element, self.mesh.p - self.origin[:, None])

    @property
    def dofnames(self) -> list[str]:
        """Names of the DOFs of a node: r^1, r^2, r_X^1, ..."""
        return [f"{name}^{k}" for name in self.element.dofnames for k in (1, 2)]

    def dofs(self, boundary: Place, names: str | Sequence[str] | None = None) -> Array:
        """Numbers of the DOFs at a place.

        Parameters
        ----------
        boundary
            A place, such as the name of a boundary or a point (x, y) in the section of a node; see
            :func:`skfem_ancf.mesh.places.facets_of`.
        names
            Their names, as ``"r^1"``, or without component, as ``"r"``; None for all.
        """
        facets = facets_of(self.mesh, boundary)
        if len(facets) > 1:
            facets = np.unique(facets)
        if facets[-1] >= self.mesh.p.shape[1]:  # facets below that number are sections at nodes
            facets = np.unique(self.mesh.facets[:, facets])
        known, both = self.dofnames, self.element.dofnames
        names = known if names is None else require_names(
            "degree of freedom", names, [*known, *[n for n in both if n not in known]])
        rows = np.array([k for k, full in enumerate(known)
                         if full in names or both[k // 2] in names])
        return (facets[:, None] * self.nd + rows).ravel()

    @cached_property
    def finder(self) -> Finder:
        """Locates points in elements, a :class:`~skfem_ancf.mesh.places.Finder`."""
        return Finder(self.mesh)

    def probe(self, point: ArrayLike) -> tuple[Array, Array]:
        """Numbers (2, n) and weights (n,) of the DOFs in the position of a material point. The
        position is ``q[dofs] @ weights``."""
        e, X = kinematics.locate(self, point)
        refuse(not self.has_sections and abs(X[1] - 0.5) > self.finder.allowed, "the point {!r} is "
               "off the axis of a cable, where the position is not linear in the degrees of "
               "freedom: use a point of the axis, and scene.moment for a moment on an end section",
               point)
        return kinematics.probe_reference(self, e, X)

    @cached_property
    def size(self) -> float:
        """Length scale of tolerances: for a single line its length, see `reach`."""
        return reach([self.mesh])

    @cached_property
    def sizes(self) -> Array:
        """Typical changes of the DOFs when the beam moves by its size, shape (N,)."""
        length, h = float(self.mesh.lengths.sum()) / len(self.mesh.lengths), self.mesh.height
        node = [self.size if k == m == 0 else length**-k * (h**(1 - m) if m else length)
                for _, k, m in self.element.functionals]
        out = np.empty((self.N // self.nd, len(node), 2))
        out[:] = np.array(node)[:, None]
        out.flags.writeable = False
        return out.reshape(-1)

    def rigid_motions(self) -> Array:
        """Two translations and the rotation about :attr:`origin`, (N, 3)."""
        out, q = np.zeros((self.N, 3)), self.q0_local
        out[::self.nd, 0] = out[1::self.nd, 1] = 1.0
        out[::2, 2], out[1::2, 2] = -q[1::2], q[::2]
        return out

    # fields

    def gradients(self, u: Array, X: Array, tind: Array | None = None) -> tuple[Array, Array]:
        """Displacement gradient H[i, J] = d u_i / d X_J in the beam frame, and this frame, shape
        (2, 2, nelements, npoints) both."""
        return kinematics.gradients(self, *self._checked(u, X, tind))

    def displacements(self, u: Array, X: Array, tind: Array | None = None) -> Array:
        """Displacement, shape (2, nelements, npoints)."""
        return kinematics.displacements(self, *self._checked(u, X, tind))

    def strain(self, u: Array, X: Array, tind: Array | None = None) -> Array:
        """Green-Lagrange strain (eps_xx, eps_yy, 2 eps_xy), (3, nelements, npoints)."""
        return on_grid(strain_at, self, *self._checked(u, X, tind))

    def stress(self, u: Array, X: Array, tind: Array | None = None) -> Array:
        """Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy), (3, nelements, npoints)."""
        return on_grid(stress_at, self, *self._checked(u, X, tind))

    def _checked(self, u, X, tind):
        u, X = require_finite("u", u, (self.N,)), require_finite("X", X)
        refuse(X.ndim not in (2, 3) or X.shape[0] != 2, "X must have shape (2, npoints) or (2, "
               "nelements, npoints), got {}", X.shape)
        if tind is not None:
            require_unmasked("tind", tind)
            tind = self.mesh.normalize_elements(tind)
        refuse(X.ndim == 3 and X.shape[1] != (self.mesh.nelements if tind is None else len(tind)),
               "X must have points for each element, got shape {}", X.shape)
        return u, X, tind

    @cached_property
    def interpolation(self) -> Interpolation:
        """Displacements as polynomials, see :mod:`skfem_ancf.beam.strains`."""
        return Interpolation(self)

    # mass

    @property
    def total_mass(self) -> float:
        """Mass of the beam."""
        mass = float(np.sum(self.masses.mass))
        return mass * (self.mesh.nelements if self.across.uniform else 1)

    @cached_property
    def masses(self) -> Masses:
        """Shape functions and masses at points, :class:`~skfem_ancf.beam.masses.Masses`."""
        return masses_of(self)

    def mass_elements(self, elements: slice = slice(None)) -> Array:
        """Mass matrices of a slice of the elements, shape (n, 2 nd, 2 nd)."""
        if not self.across.uniform:
            return self.masses.matrices(elements)
        n = len(range(*elements.indices(self.mesh.nelements)))
        return np.repeat(self.masses.matrices(slice(None)), n, axis=0)

    def weight(self, g: ArrayLike) -> Array:
        """The dead load of an acceleration ``g`` (2,), shape (N,)."""
        load = self.masses.weights(require_finite("g", g, (2,)))
        return self.kernel.scatter(load + np.zeros((self.mesh.nelements, 1, 1)))

    def mass(self) -> sparse.csr_matrix:
        """The constant mass matrix, sparse, shape (N, N)."""
        entries = kinematics.entries_of(self.basis.element_dofs.T)
        M = sparse.coo_matrix((self.mass_elements().ravel(), entries),
                              shape=(self.N, self.N)).tocsr()
        M.eliminate_zeros()
        return M
