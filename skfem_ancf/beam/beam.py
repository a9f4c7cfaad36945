"""A beam: a mesh, an element, a material and a formulation."""

from __future__ import annotations

from functools import partial, wraps
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse
from skfem.assembly import Basis, FacetBasis
from skfem.element import ElementVector

from ..materials.damping import KelvinVoigt
from ..elements import ElementBeam, choose_element
from ..core.errors import (InputError, NameUnknown, require_finite, require_flag, require_integer,
                           require_label, require_like, require_names, shown,
                           require_unmasked)
from ..mesh.location import Finder
from ..formulations import get_formulation
from ..core.frozen import Frozen, read_only
from ..core.kept import cached_property
from .kinematics import KINEMATICS
from ..materials import Material
from ..mesh.mesh_beam import MeshBeam, reach
from .inertia import of_sections
from .interpolation import Part
from ..mesh.places import as_point, facets_of, node_of
from ..core.quadrature import gauss, tensor
from ..sections import Across, Rectangle, Section
from ..elements.series import Series
from .strains import ElementStrain

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike
    from scipy.sparse import csr_matrix

    from ..formulations.base import Formulation, Term
    from .inertia import Inertia
    from ..core.types import Array, Law, Place, Rule


def reference_coordinates(basis: Basis) -> Array:
    """Coordinates of the stress-free state of a basis of the position field.

    Parameters
    ----------
    basis
        A ``Basis`` of ``ElementVector(element)`` on a MeshBeam.

    Returns
    -------
    ndarray
        Shape (basis.N,).

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
    if not isinstance(basis.mesh, MeshBeam) or not isinstance(element, ElementBeam):
        raise InputError("the basis must be one of ElementVector(element) on a MeshBeam, got "
                         f"{shown(basis)}")
    return _coordinates(basis.mesh, element, basis.mesh.p)


def _coordinates(mesh, element, p):
    q = element.rigid(mesh)
    q[0] = p
    return np.ascontiguousarray(q.transpose(2, 0, 1)).ravel()


#: Attributes of meshes that functionals of vectors at nodes are of, by their derivatives.
_DIRECTIONS = {(1, 0): "p_X", (0, 1): "p_Y"}


def _fields(method):
    """A method of coordinates, points and elements, with what it is given checked."""

    @wraps(method)
    def call(self, u, X, tind=None):
        u, X = require_finite("u", u, (self.N,)), require_finite("X", X)
        if X.ndim not in (2, 3) or X.shape[0] != 2:
            raise InputError("X must have shape (2, npoints) or (2, nelements, npoints), got "
                             f"{X.shape}")
        if tind is not None:
            require_unmasked("tind", tind)
            tind = self.mesh.normalize_elements(tind)
        if X.ndim == 3 and X.shape[1] != (self.mesh.nelements if tind is None else len(tind)):
            raise InputError(f"X must hold points for each element, got shape {X.shape}")
        return method(self, u, X, tind)

    return call


class Beam(Frozen):
    """A planar beam. It does not change; :meth:`replace` returns a changed copy.

    Parameters
    ----------
    mesh
        A :class:`~skfem_ancf.MeshBeam`.
    element
        A beam element, for example ``ElementBeamANCF(3)``, or "auto": the one of lowest order that
        carries ``fields`` within ``tolerance``, see
        :func:`skfem_ancf.elements.choose.choose_element`.
    material
        A material, for example :class:`~skfem_ancf.StVenantKirchhoff`; None if the section has
        materials of its own.
    width
        Width of a full section: a positive number, or a function of material coordinates x, the
        parameter of the axis, and y, the distance from it, arrays of one shape.
    formulation
        How the strain is sampled and integrated: a name from
        :data:`skfem_ancf.formulations.FORMULATIONS`, or a formulation.
    name
        What messages and multi-beam scenes call the beam.
    compiled
        Use the kernels compiled by Numba, if it is installed and they apply; the results agree to
        round-off. The environment variable ``SKFEM_ANCF_COMPILED=0`` leaves Numba out everywhere.
    fields, tolerance
        For the element "auto": names of section fields that will be looked at, and the relative
        error that the beam theory may have.
    damping
        :class:`~skfem_ancf.KelvinVoigt` for a stress that resists the rate of the strain, or None.
    section
        A :class:`~skfem_ancf.Section` in place of the width.

    Raises
    ------
    InputError
        If an argument is of the wrong kind or out of range.
    NameUnknown
        If the formulation is not known.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), ElementBeamANCF(3),
    ...             StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
    >>> beam.N, round(beam.total_mass, 6)
    (170, 0.78)
    """

    mesh: MeshBeam
    element: ElementBeam
    material: Material
    section: Section
    width: Any
    across: Across
    formulation: Formulation
    name: str | None
    compiled: bool
    damping: KelvinVoigt | None
    kinematics: Any
    _given: Material | None
    nd: int
    N: int

    def __init__(self, mesh: MeshBeam, element: ElementBeam | str,
                 material: Material | None = None,
                 width: float | Callable[..., ArrayLike] | None = None,
                 formulation: str | Formulation | type[Formulation] = "assumed",
                 name: str | None = None, compiled: bool = True, fields: str | Sequence[str] = (),
                 tolerance: float = 1e-3, damping: KelvinVoigt | None = None,
                 section: Section | None = None) -> None:
        if not isinstance(mesh, MeshBeam):
            raise InputError(f"mesh must be a MeshBeam, got {shown(mesh)}")
        section = _section(section, width)
        found = _material(section, material, mesh)
        if isinstance(element, str) and element == "auto":
            element = choose_element(mesh, found.reference()[0], fields, tolerance)
        if not isinstance(element, ElementBeam):
            raise InputError(f"element must be a ElementBeam, got {shown(element)}")
        if damping is not None and not isinstance(damping, KelvinVoigt):
            raise InputError("damping must be a KelvinVoigt, as KelvinVoigt(1e-4), or None, got "
                             f"{shown(damping)}")
        nd = 2 * element.nodal_dofs
        vars(self).update(
            mesh=element.fitted(mesh), element=element, formulation=get_formulation(formulation),
            name=require_label("name", name), compiled=require_flag("compiled", compiled),
            damping=damping, kinematics=KINEMATICS[element.kinematics], nd=nd,
            N=nd * mesh.p.shape[1])
        self._fill(section, found, material, Across(self.mesh, element, section, material))

    def _fill(self, section, material, given, across):
        """Set what depends on section and material, of which ``given`` is the beam's own."""
        for slab in across.slabs:
            self.kinematics.require_law(slab.material)
        self.kinematics.warn_of_section(section, self.mesh)
        vars(self).update(section=section, material=material, _given=given, across=across,
                          width=getattr(section, "width", None))

    def __repr__(self):
        return (f"<Beam {self.name or ''}: {self.mesh.nelements} elements of order "
                f"{self.element.order}, {self.N} coordinates, {self.formulation.name}>")

    def replace(self, **changes: Any) -> Beam:
        """The same beam with some arguments of its constructor changed.

        Parameters
        ----------
        **changes
            Arguments of :class:`Beam`, as ``material=...`` or ``width=...``.

        Raises
        ------
        NameUnknown
            If an argument is not known.

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
            if name not in known + ("fields", "tolerance"):
                raise NameUnknown("argument of Beam", name, known)
        given = {name: getattr(self, name) for name in known} | {"material": self._given}
        given["section" if "width" in changes and isinstance(self.section, Rectangle) else
              "width"] = None
        return type(self)(**{**given, **changes})

    def with_mesh(self, mesh: MeshBeam) -> Beam:
        """The same beam on another mesh."""
        return self.replace(mesh=mesh)

    # the scikit-fem side

    @cached_property
    def vector_element(self) -> ElementVector:
        """The element of the position field: ``ElementVector(element)``."""
        return ElementVector(self.element)

    @cached_property
    def basis(self) -> Basis:
        """A scikit-fem ``Basis`` of the position field with the formulation's quadrature."""
        if len(self.across.slabs) > 1:
            return self.exact_basis()
        return Basis(self.mesh, self.vector_element,
                     quadrature=self.terms[0].quadrature)

    def exact_basis(self) -> Basis:
        """A ``Basis`` whose quadrature is exact for products of two coordinates, as in the mass.

        Its ``dx`` are volumes as of the mass: sections have their height between nodes too.
        """
        X, W = self.exact_rule()
        basis = Basis(self.mesh, self.vector_element, quadrature=(X, W))
        if not self.mesh.is_straight:
            basis.dx = self.mesh.mapping().full_volume(X) * W
        return basis

    def exact_rule(self) -> Rule:
        """Points and weights of the quadrature of :meth:`exact_basis`."""
        n = self.element.axis_degree + 1 + (0 if self.mesh.is_straight else 1)
        return tensor(gauss(n), self.kinematics.section_rule(self.element))

    def facet_basis(self, facets: Place, intorder: int | None = None) -> FacetBasis:
        """A scikit-fem ``FacetBasis`` of the position field at a place, see :meth:`dofs`.

        Parameters
        ----------
        facets
            A place, see :func:`skfem_ancf.mesh.places.facets_of`.
        intorder
            Degree of polynomials along the facets that the quadrature integrates exactly, 0 to
            200; by default that of products of two coordinates.
        """
        if intorder is not None:
            intorder = require_integer("intorder", intorder, 0, 200)
        return FacetBasis(self.mesh, self.vector_element, facets=facets_of(self.mesh, facets),
                          intorder=2 * self.facet_points - 2 if intorder is None else intorder)

    @property
    def facet_points(self) -> int:
        """Gauss points of a facet, for products of two coordinates."""
        return max(self.element.axis_degree, self.element.order) + 2

    @cached_property
    def kernel(self) -> Any:
        """The fused evaluation of the strain energy; see :mod:`skfem_ancf.beam.kernels`."""
        return self.kinematics.kernel(self.across, self.formulation)

    @cached_property
    def terms(self) -> Sequence[Term]:
        """The terms of the strain energy, of the formulation for each material of the section."""
        return [term for _, terms in self.across.terms(self.formulation) for term in terms]

    @cached_property
    def layers(self) -> Sequence[Beam]:
        """The beam as if it were of one material, for each slab of its section."""
        if self.across.plain:
            return [self]
        return [self.replace(material=slab.material, section=Rectangle(1.0),
                             element=self.element.measured(slab.measure, self.across.shear))
                for slab in self.across.slabs]

    @property
    def has_sections(self) -> bool:
        """True if points off the axis are linear in the coordinates: not of a cable."""
        return self.kinematics.has_sections

    # coordinates

    @cached_property
    def q0(self) -> Array:
        """Coordinates of the stress-free state, shape (N,)."""
        return read_only(_coordinates(self.mesh, self.element, self.mesh.p))

    @cached_property
    def origin(self) -> Array:
        """A point near the beam, from which positions are measured inside the package."""
        p = self.mesh.p
        return read_only(p.sum(axis=1) / p.shape[1])

    @cached_property
    def q0_local(self) -> Array:
        """Coordinates of the stress-free state with positions measured from :attr:`origin`."""
        return read_only(_coordinates(self.mesh, self.element,
                                      self.mesh.p - self.origin[:, None]))

    @cached_property
    def rows(self) -> Array:
        """Of the first element, the numbers of both components of all coordinates, (2, nb)."""
        return np.ascontiguousarray(np.arange(2 * self.nd).reshape(-1, 2).T)

    @property
    def dofnames(self) -> list[str]:
        """Names of the coordinates of a node, as scikit-fem gives them: r^1, r^2, r_X^1, ..."""
        return [f"{name}^{k}" for name in self.element.dofnames for k in (1, 2)]

    def nodes(self, boundary: Place) -> Array:
        """Nodes at a place, see :meth:`dofs`."""
        facets = facets_of(self.mesh, boundary)
        facets = np.unique(facets) if len(facets) > 1 else np.asarray(facets)
        if facets[-1] < self.mesh.p.shape[1]:  # sections have the numbers of their nodes
            return facets
        return np.unique(self.mesh.facets[:, facets])

    def dofs(self, boundary: Place, names: str | Sequence[str] | None = None) -> Array:
        """Coordinate numbers at a place.

        Parameters
        ----------
        boundary
            A place: the name of a boundary; a point (x, y) of the stress-free body, which means
            the section of a node; a function of the points x that returns truth values; or
            numbers of facets as an array of integers. See
            :func:`skfem_ancf.mesh.places.facets_of`.
        names
            Coordinate names, as ``"r^1"``, or without component, as ``"r"``; None for all.

        Raises
        ------
        NameUnknown
            If a name is not known; the message lists the known ones.
        """
        nodes, rows = self.nodes(boundary), self._rows_named(names)
        if len(nodes) == 1:
            return nodes[0] * self.nd + rows
        return np.sort((nodes[:, None] * self.nd + rows).ravel())

    def _rows_named(self, names):
        """Numbers of coordinates of a node by their names, increasing."""
        both = self.element.dofnames
        if isinstance(names, str) and both.count(names) == 1:
            return 2 * both.index(names) + np.arange(2)
        known = self.dofnames
        if names is None:
            return np.arange(len(known))
        names = require_names("coordinate", names, [*known, *(n for n in both if n not in known)])
        return np.array([k for k, full in enumerate(known)
                         if full in names or full.rsplit("^", 1)[0] in names])

    def locate(self, point: ArrayLike) -> tuple[int, Array]:
        """Element and reference point of a material point.

        Parameters
        ----------
        point
            Position in the stress-free body, shape (2,).

        Returns
        -------
        int, ndarray
            The element and (xi, eta).

        Raises
        ------
        MeshError
            If the point is outside the body.
        """
        x = as_point(point, self.mesh)[:, None]
        e, X, outside = self.finder(x)
        if outside[0] > self.finder.allowed:
            raise self.finder.refuse(x, outside)
        return int(e[0]), X[:, 0]

    @cached_property
    def finder(self) -> Finder:
        """What finds the elements that hold points, a :class:`~skfem_ancf.mesh.location.Finder`."""
        return Finder(self.mesh)

    @cached_property
    def tables(self) -> dict:
        """Tables at sections that do not change with the state, see :mod:`skfem_ancf.core.kept`."""
        return {}

    @cached_property
    def grids(self) -> dict:
        """Points of all elements at which fields were asked for last, by the reference points."""
        return {}

    def probe(self, point: ArrayLike) -> tuple[Array, Array]:
        """Coordinate numbers and weights of the position of a material point.

        Returns
        -------
        dofs, weights
            Shapes (2, n) and (n,): ``q[dofs] @ weights`` is the position.
        """
        return self.probe_at(point, *self.locate(point))

    def probe_at(self, point: ArrayLike, e: int, X: Array) -> tuple[Array, Array]:
        """As :meth:`probe`, for a point that :meth:`locate` has found.

        Parameters
        ----------
        point
            Its position in the stress-free body, shape (2,).
        e, X
            Its element, and its point (xi, eta) of the reference cell, shape (2,).

        Returns
        -------
        dofs, weights
            Shapes (2, n) and (n,).
        """
        if not self.has_sections and abs(X[1] - 0.5) > self.finder.allowed:
            raise InputError(
                f"the point {tuple(map(float, np.ravel(point)))} is off the axis of a cable, whose "
                "position there is no linear function of its coordinates: name a point of the "
                "axis, and put a moment on an end section with scene.moment")
        return self.probe_reference(e, X)

    def probe_reference(self, e: int, X: Array) -> tuple[Array, Array]:
        """As :meth:`probe`, for a point of an element.

        Parameters
        ----------
        e
            Number of the element.
        X
            Point (xi, eta) of its reference cell, shape (2,).

        Returns
        -------
        dofs, weights
            Shapes (2, n) and (n,).
        """
        one = Part(self, 0, slice(0, self.N), None, np.array([e]), np.reshape(X, (2, 1)))
        return one.dofs[..., 0].T, one.weights[:, 0]

    def first_of_node(self, e: int, xi: float, eta: float) -> int:
        """The first coordinate of the node that a point of an element is; -1 if it is none.

        Parameters
        ----------
        e, xi, eta
            The element, and the point of its reference cell.
        """
        if eta != 0.5 or (xi != 0.0 and xi != 1.0):
            return -1
        return int(self.mesh.t[int(xi), e]) * self.nd

    def section_node(self, boundary: Place) -> int:
        """The node of a place that is one section, see :meth:`dofs`."""
        return node_of(self.mesh, boundary)

    def section_direction(self, node: int) -> tuple[Array, Array]:
        """Coordinates (2, n) and weights (n,) of the direction 12 / h^3 int Y r dY of a section."""
        return self.kinematics.direction(self, node)

    @cached_property
    def size(self) -> float:
        """What tolerances of its places are relative to: of one line its length, see `reach`."""
        return reach([self.mesh])

    @cached_property
    def sizes(self) -> Array:
        """What its coordinates change by where it moves by its size and bends, shape (N,).

        Derivatives along the axis by the length of an element, those across by the height.
        """
        lengths, h = self.mesh.lengths, self.mesh.height
        length = float(np.add.reduce(lengths)) / lengths.size
        node = [self.size if k == m == 0 else length**-k * (h**(1 - m) if m else length)
                for _, k, m in self.element.functionals]
        out = np.empty((self.N // self.nd, self.nd))
        out[:] = np.array(node).repeat(2)
        return read_only(out.ravel())

    def held_by_a_section(self, held: Sequence[int], sums: Sequence[Any] = ()) -> bool:
        """True if a node is held, and the direction of the axis there or its normal.

        Parameters
        ----------
        held
            Numbers of coordinates.
        sums
            Sums of coordinates that are held, too: for each their numbers and factors, in pairs.
        """
        every = set(held)
        for one in [*([(dof, 1.0)] for dof in held), *sums]:
            node = one[0][0] // self.nd if one else 0
            first, turn, size = node * self.nd, 0.0, 0.0
            if first not in every or first + 1 not in every:
                continue
            for dof, factor in one:
                k = dof - first
                of = self.element.functionals[k // 2][1:] if 1 < k < self.nd else None
                if of not in _DIRECTIONS:
                    break
                way = getattr(self.mesh, _DIRECTIONS[of])[1 - k % 2, node]
                turn, size = turn + factor * (way if k % 2 else -way), size + abs(factor)
            else:
                if abs(turn) > 1e-3 * size:
                    return True  # it would change as the section turns
        return False

    def rigid_motions(self, rows: Any = slice(None)) -> Array:
        """Two translations and the rotation about :attr:`origin`.

        Parameters
        ----------
        rows
            Numbers of coordinates, shape (n,), for as many rows; all by default.

        Returns
        -------
        ndarray
            Shape (n, 3), or (N, 3).
        """
        out, q = np.zeros((self.N, 3)), self.q0_local
        out[::self.nd, 0] = out[1::self.nd, 1] = 1.0
        out[::2, 2], out[1::2, 2] = -q[1::2], q[::2]
        return out[rows]

    # fields

    @_fields
    def gradients(self, u: Array, X: Array, tind: Array | None = None) -> tuple[Array, Array]:
        """Displacement gradient in the beam's frame and the frame.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        X
            Reference points, (2, npoints) or (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        H, frame
            Shape (2, 2, nelements, npoints) both: H[i, J] = d u_i / d X_J, J along the frame.
        """
        return self.kinematics.gradients(self, u, X, tind)

    @_fields
    def displacements(self, u: Array, X: Array, tind: Array | None = None) -> Array:
        """Displacement at reference points.

        Parameters
        ----------
        u, X, tind
            As for :meth:`gradients`, shapes (N,), (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        ndarray
            Shape (2, nelements, npoints).
        """
        return self.kinematics.displacements(self, u, X, tind)

    @_fields
    def strain(self, u: Array, X: Array, tind: Array | None = None) -> Array:
        """Green-Lagrange strain of the formulation: (eps_xx, eps_yy, 2 eps_xy).

        Parameters
        ----------
        u, X, tind
            As for :meth:`gradients`, shapes (N,), (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        ndarray
            Shape (3, nelements, npoints).
        """
        return self.kinematics.strain(self, u, X, tind)

    def sampled_strain(self, term: Term, u: Array, X: Array, tind: Array | None = None) -> Array:
        """As :meth:`strain`, with the samples along the axis of a term of the formulation.

        Parameters
        ----------
        term
            A :class:`~skfem_ancf.formulations.Term`.
        u, X, tind
            As for :meth:`gradients`, shapes (N,), (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        ndarray
            Shape (3, nelements, npoints).
        """
        return self._at_points(self.strain_of(term), u, X, tind)

    def _at_points(self, strain, u, X, tind):
        tind = np.arange(self.mesh.nelements) if tind is None else tind
        shape = len(tind), X.shape[-1]
        points = X.reshape(2, -1) if X.ndim == 3 else np.tile(X, shape[0])
        return strain(u, np.repeat(tind, shape[1]), points).reshape(3, *shape)

    def strains(self, strain: Array, u: Array, X: Array, tind: Array | None = None
                ) -> Callable[..., Array]:
        """The strains of all terms, as :meth:`Formulation.stress_of
        <skfem_ancf.formulations.Formulation.stress_of>` asks for them.

        Parameters
        ----------
        strain
            That of the first term, shape (3, nelements, npoints).
        u, X, tind
            As for :meth:`gradients`, shapes (N,), (2, npoints) or (2, nelements, npoints), and
            (nelements,).
        """
        def strain_of(term: Term, xi: float | None = None, across: Rule | None = None) -> Array:
            if term is self.terms[0] and xi is None and across is None:
                return strain
            of = self.strain_of(term, getattr(term.law, "rows", (0, 1, 2)))
            at = X if xi is None else np.array([0.0 * X[0] + xi, X[1]])
            return self._at_points(partial(of, across=across), u, at, tind)

        return strain_of

    def strain_of(self, term: Term, rows: Sequence[int] = (0, 1, 2)) -> Any:
        """The strain of a term of the formulation, kept: an :class:`~.strains.ElementStrain`.

        Parameters
        ----------
        term
            A :class:`~skfem_ancf.formulations.Term`.
        rows
            The components that are asked for; the others are zero.
        """
        found = self._strains.get((id(term), rows))
        if found is None:
            found = self._strains[id(term), rows] = ElementStrain(self, term, rows)
        return found

    @cached_property
    def law(self) -> Law:
        """That of the material, with the shear factor of the element."""
        return self.material.law(self.material.shear_factor(self.element))

    @cached_property
    def _strains(self):
        return {}

    @cached_property
    def series(self) -> Series:
        """The local functions of the elements as a :class:`~skfem_ancf.elements.series.Series`."""
        return Series(self.element, self.mesh.height, self.mesh.mapping().height_degree)

    @cached_property
    def scales(self) -> Array:
        """What the local functions of each element are times those of length 1, (ne, nb)."""
        return read_only(self.series.scales(self.mesh.lengths))

    @_fields
    def stress(self, u: Array, X: Array, tind: Array | None = None) -> Array:
        """Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy), force per area of the stress-free body.

        Parameters
        ----------
        u, X, tind
            As for :meth:`gradients`, shapes (N,), (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        ndarray
            Shape (3, nelements, npoints).
        """
        return self.kinematics.stress(self, self.strain(u, X, tind), u, X, tind)

    # mass

    @property
    def total_mass(self) -> float:
        """Mass of the beam."""
        mass = float(np.sum(self.inertia.mass))
        return mass * (self.mesh.nelements if self.across.uniform else 1)

    @property
    def density(self) -> float:
        """Density of the material, its mean if it varies; raises InputError if it has none."""
        slab = self.across.slabs[0]
        if len(self.across.slabs) == 1 and not callable(slab.density):
            return self.across.density(slab, np.zeros((2, 0)))
        if not self.has_sections:
            return self.total_mass / self.kernel.volume
        volume = float(np.sum(of_sections(self, "").mass))
        return self.total_mass / (volume * (self.mesh.nelements if self.across.uniform else 1))

    @cached_property
    def inertia(self) -> Inertia:
        """Local functions and masses at points, :class:`~skfem_ancf.beam.inertia.Inertia`."""
        return self.kinematics.inertia(self)

    def mass_elements(self, elements: slice = slice(None)) -> Array:
        """Element mass matrices of a slice of the elements, shape (n, 2 nd, 2 nd)."""
        n, across = len(range(*elements.indices(self.mesh.nelements))), self.across
        if across.simple and across.uniform and self.element.by_reference:
            m, h, L = self._equal
            out = np.zeros((n, self.nd, 2, self.nd, 2))
            out[:, :, 0, :, 0] = out[:, :, 1, :, 1] = m * self.element.products(h, L)
            return out.reshape(n, 2 * self.nd, 2 * self.nd)
        full = self.inertia.matrices(slice(None) if across.uniform else elements)
        return np.repeat(full, n, axis=0) if across.uniform else full

    def weight(self, g: ArrayLike) -> Array:
        """The dead load of an acceleration ``g`` (2,), shape (N,)."""
        g = require_finite("g", g, (2,))
        if self.across.uniform and self.across.plain:
            return (self._masses[:, None] * g).ravel()
        load = self.inertia.weights(g)
        forces = np.empty((self.mesh.nelements,) + load.shape[1:])
        forces[:] = load
        return self.kernel.scatter(forces)

    @cached_property
    def _masses(self):
        """Of equal elements the weight over the acceleration, (N / 2,)."""
        m, h, L = self._equal
        loads = np.empty((self.mesh.nelements, self.nd, 2))
        loads[:] = (m * self.element.integrals(h, L))[:, None]
        return self.kernel.scatter(loads)[::2]

    @property
    def _equal(self):
        """Mass, height and length of each of equal elements."""
        h, L = self.mesh.height, float(self.mesh.lengths[0])
        return self.density * self.across.slabs[0].width * h * L, h, L

    def mass(self) -> csr_matrix:
        """The mass matrix, constant, sparse, shape (N, N)."""
        dofs = self.basis.element_dofs.T
        rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None])
        M = sparse.coo_matrix((self.mass_elements().ravel(), (rows.ravel(), columns.ravel())),
                              shape=(self.N, self.N)).tocsr()
        M.eliminate_zeros()
        return M


def _section(section, width):
    """What was given as a section, or a rectangle of a width."""
    if section is None:
        return Rectangle(width)
    if width is not None:
        raise InputError(f"give a width or a section, not both: got {shown(width)} and {section!r}")
    if not isinstance(section, Section):
        raise InputError('section must be a Section, as Section.profile("I", width=0.05, '
                         f"web=0.005, flange=0.008), got {shown(section)}")
    return section


def _material(section, material, mesh):
    """The material of a beam: what was given, or the first of a section that has its own."""
    if (material is None) != section.has_materials or not isinstance(
            material, (Material, type(None))):
        raise InputError(f"material must be None, for {section!r} has its own, got "
                         f"{shown(material)}" if section.has_materials else
                         f"material must be a Material, got {shown(material)}")
    return material or section.slabs(mesh, None)[0].material
