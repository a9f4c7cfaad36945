"""A beam: a mesh, an element, a material and a formulation."""

from __future__ import annotations

from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from skfem.assembly import Basis, FacetBasis, asm
from skfem.element import ElementVector

from . import forms
from .damping import KelvinVoigt
from .elements import ElementBeam, choose_element
from .errors import (InputError, MeshError, NameUnknown, require_finite, require_flag,
                     require_integer, require_label, require_like, require_names, require_positive,
                     shown, taught, teaching)
from .finder import Finder
from .formulations import get_formulation
from .frozen import Frozen, read_only
from .kinematics import KINEMATICS
from .materials import Material
from .mesh import MeshBeam
from .places import as_point, facets_of
from .quadrature import gauss, tensor
from .rigid import RigidBody
from .series import Series
from .strains import ElementStrain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike
    from scipy.sparse import csr_matrix

    from .formulations.base import Formulation, Term
    from .types import Array, Place, WhichMember


@taught
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


def _fields(method):
    """A method of coordinates, points and elements, with what it is given checked."""

    @wraps(method)
    def call(self, u, X, tind=None):
        u, X = require_finite("u", u, (self.N,)), require_finite("X", X)
        if X.ndim not in (2, 3) or X.shape[0] != 2:
            raise InputError("X must have shape (2, npoints) or (2, nelements, npoints), got "
                             f"{X.shape}")
        if tind is not None:
            tind = self.mesh.normalize_elements(tind)
        if X.ndim == 3 and X.shape[1] != (self.mesh.nelements if tind is None else len(tind)):
            raise InputError(f"X must hold points for each element, got shape {X.shape}")
        return method(self, u, X, tind)

    return call


@teaching
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
        A material, for example :class:`~skfem_ancf.StVenantKirchhoff`.
    width
        Width of the section, positive.
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

    def __init__(self, mesh: MeshBeam, element: ElementBeam | str, material: Material, width: float,
                 formulation: str | Formulation | type[Formulation] = "assumed",
                 name: str | None = None, compiled: bool = True, fields: str | Sequence[str] = (),
                 tolerance: float = 1e-3, damping: KelvinVoigt | None = None) -> None:
        if isinstance(element, str) and element == "auto" and isinstance(mesh, MeshBeam):
            element = choose_element(mesh, material, fields, tolerance)
        for argument, kind, value in (("mesh", MeshBeam, mesh), ("element", ElementBeam, element),
                                      ("material", Material, material)):
            if not isinstance(value, kind):
                raise InputError(f"{argument} must be a {kind.__name__}, got {shown(value)}")
        element = cast("ElementBeam", element)
        self.mesh: MeshBeam = element.fitted(mesh)
        self.element, self.material = element, material
        self.width = require_positive("width", width)
        self.formulation = get_formulation(formulation)
        self.name = require_label("name", name)
        self.compiled = require_flag("compiled", compiled)
        if damping is not None and not isinstance(damping, KelvinVoigt):
            raise InputError("damping must be a KelvinVoigt, as KelvinVoigt(1e-4), or None, got "
                             f"{shown(damping)}")
        self.damping = damping
        self.kinematics = KINEMATICS[element.kinematics]
        self.kinematics.require_law(material)
        self.nd = 2 * element.nodal_dofs
        self.N = self.nd * mesh.p.shape[1]

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
                 "damping")
        for name in changes:
            if name not in known + ("fields", "tolerance"):
                raise NameUnknown("argument of Beam", name, known)
        return type(self)(**{**{name: getattr(self, name) for name in known}, **changes})

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
        return Basis(self.mesh, self.vector_element,
                     quadrature=self.terms[0].quadrature)

    def exact_basis(self) -> Basis:
        """A ``Basis`` whose quadrature is exact for products of two coordinates, as in the mass."""
        n = self.element.axis_degree + 1 + (0 if self.mesh.is_straight else 1)
        return Basis(self.mesh, self.vector_element,
                     quadrature=tensor(gauss(n), self.kinematics.section_rule(self.element)))

    def facet_basis(self, facets: Place, intorder: int | None = None) -> FacetBasis:
        """A scikit-fem ``FacetBasis`` of the position field at a place, see :meth:`dofs`.

        Parameters
        ----------
        facets
            A place, see :func:`skfem_ancf.places.facets_of`.
        intorder
            Degree of polynomials along the facets that the quadrature integrates exactly, 0 to
            200; by default that of products of two coordinates.
        """
        if intorder is not None:
            intorder = require_integer("intorder", intorder, 0, 200)
        order = 2 * max(self.element.axis_degree, self.element.order) + 2
        return FacetBasis(self.mesh, self.vector_element, facets=facets_of(self.mesh, facets),
                          intorder=order if intorder is None else intorder)

    @cached_property
    def kernel(self) -> Any:
        """The fused evaluation of the strain energy; see :mod:`skfem_ancf.kernel`."""
        return self.kinematics.kernel(self.mesh, self.element, self.material, self.width,
                                      self.formulation)

    @cached_property
    def terms(self) -> Sequence[Term]:
        """The terms of the strain energy, of the formulation for this element and material."""
        return self.formulation.terms(self.element, self.material)

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
        return read_only(self.mesh.p.mean(axis=1))

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
        return self.vector_element.dofnames

    def nodes(self, boundary: Place) -> Array:
        """Nodes at a place, see :meth:`dofs`."""
        return self.mesh._expand_facets(facets_of(self.mesh, boundary))[0]

    def dofs(self, boundary: Place, names: str | Sequence[str] | None = None) -> Array:
        """Coordinate numbers at a place.

        Parameters
        ----------
        boundary
            A place: the name of a boundary; a point (x, y) of the stress-free body, which means
            the section of a node; a function of the points x that returns truth values; or
            numbers of facets as an array of integers. See
            :func:`skfem_ancf.places.facets_of`.
        names
            Coordinate names, as ``"r^1"``, or without component, as ``"r"``; None for all.

        Raises
        ------
        NameUnknown
            If a name is not known; the message lists the known ones.
        """
        known = self.dofnames
        if names is None:
            rows: Array = np.arange(len(known))
        else:
            both = [name for name in self.element.dofnames if name not in known]
            names = require_names("coordinate", names, known + both)
            rows = np.array([k for k, full in enumerate(known)
                             if full in names or full.rsplit("^", 1)[0] in names])
        return np.sort((self.nodes(boundary)[:, None] * self.nd + rows).ravel())

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
        """What finds the elements that hold points, a :class:`~skfem_ancf.finder.Finder`."""
        return Finder(self.mesh)

    @cached_property
    def tables(self) -> dict:
        """Tables at sections that do not change with the state, see :mod:`skfem_ancf.kept`."""
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
        e, X = self.locate(point)
        if not self.has_sections and abs(X[1] - 0.5) > 1e-6:
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
        mapping, tind = self.mesh.mapping(), np.array([e])
        weights = self.element.functions(mapping, X[:, None], tind)[0][:, 0, 0]
        first = self.mesh.t[0, e] * self.nd
        return first + np.arange(2 * self.nd).reshape(-1, 2).T, weights

    def section_node(self, boundary: Place) -> int:
        """The node of a place that is one section, see :meth:`dofs`."""
        facets = np.asarray(facets_of(self.mesh, boundary))
        if len(facets) != 1 or facets[0] >= self.mesh.p.shape[1]:
            raise MeshError(f"boundary {boundary!r} is not one section of the beam; sections are "
                            "'left' and 'right', or the point of a node of the axis")
        return int(facets[0])

    def section_direction(self, node: int) -> tuple[Array, Array]:
        """Coordinates (2, n) and weights (n,) of the direction 12 / h^3 int Y r dY of a section."""
        return self.kinematics.direction(self, node)

    @property
    def size(self) -> float:
        """Length of its axis."""
        return float(self.mesh.lengths.sum())

    def rigid_motions(self) -> Array:
        """Two translations and the rotation about :attr:`origin`: shape (N, 3)."""
        q = self.q0_local.reshape(-1, self.nd // 2, 2)
        out = np.zeros(q.shape + (3,))
        out[:, 0, 0, 0] = out[:, 0, 1, 1] = 1.0
        out[..., 0, 2], out[..., 1, 2] = -q[..., 1], q[..., 0]
        return out.reshape(self.N, 3)

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
        tind = np.arange(self.mesh.nelements) if tind is None else tind
        shape = len(tind), X.shape[-1]
        points = X.reshape(2, -1) if X.ndim == 3 else np.tile(X, shape[0])
        return self.strain_of(term)(u, np.repeat(tind, shape[1]), points).reshape(3, *shape)

    def strain_of(self, term: Term) -> ElementStrain:
        """The strain of a term of the formulation: an :class:`~.strains.ElementStrain`, kept."""
        found = self._strains.get(id(term))
        if found is None:
            found = self._strains[id(term)] = ElementStrain(self, term)
        return found

    @cached_property
    def _strains(self):
        return {}

    @cached_property
    def series(self) -> Series:
        """The local functions of the elements as a :class:`~skfem_ancf.series.Series`."""
        return Series(self.element, self.mesh.height)

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
        volume = float(np.sum(self._shapes[1]))
        return self.density * volume * (self.mesh.nelements if self.mesh.is_uniform else 1)

    @property
    def density(self) -> float:
        """Density of the material; raises InputError if the material has none."""
        if self.material.density is None:
            raise InputError(f"{self.material!r} has no density: give one to use mass or gravity")
        return self.material.density

    @cached_property
    def _shapes(self):
        """Local functions (nb, ne, np) and volume weights (ne, np); ne = 1 if all are equal."""
        n = self.element.axis_degree + 1 + (0 if self.mesh.is_straight else 1)
        X, W = tensor(gauss(n), self.kinematics.section_rule(self.element))
        tind = np.array([0]) if self.mesh.is_uniform else None
        mapping = self.mesh.mapping()
        return self.element.functions(mapping, X, tind)[0], self.width * W * mapping.detDF(X, tind)

    def mass_elements(self, elements: slice = slice(None)) -> Array:
        """Element mass matrices of a slice of the elements, shape (n, 2 nd, 2 nd)."""
        N, dV = self._shapes
        if not self.mesh.is_uniform:
            N, dV = N[:, elements], dV[elements]
        scalar = self.density * np.einsum("iep,jep,ep->eij", N, N, dV, optimize=True)
        full = np.einsum("eij,ab->eiajb", scalar, np.eye(2)).reshape(-1, 2 * self.nd, 2 * self.nd)
        n = len(range(*elements.indices(self.mesh.nelements)))
        return np.repeat(full, n, axis=0) if self.mesh.is_uniform else full

    def weight(self, g: ArrayLike) -> Array:
        """The dead load of an acceleration ``g`` (2,), shape (N,)."""
        g = require_finite("g", g, (2,))
        N, dV = self._shapes
        mean = self.density * np.einsum("iep,ep->ei", N, dV)
        load = np.broadcast_to(mean[:, :, None] * g, (self.mesh.nelements,) + mean.shape[1:] + (2,))
        return self.kernel.scatter(np.ascontiguousarray(load))

    def mass(self) -> csr_matrix:
        """The mass matrix, constant, sparse, shape (N, N)."""
        return asm(forms.mass(self.density, self.width), self.exact_basis())


def select_beam(beams: Sequence[Beam], beam: WhichMember) -> Beam:
    """The beam meant by a Beam, a name, a number, or None where there is only one.

    Parameters
    ----------
    beams
        The beams of a scene.
    beam
        A Beam, its name or its number, or None.

    Raises
    ------
    NameUnknown
        If there is no such beam, or None is given and there are several.
    """
    if beam is None and len(beams) == 1:
        return beams[0]
    found: Sequence[Beam] = ()
    if isinstance(beam, Beam):
        found = [b for b in beams if b is beam]
    elif isinstance(beam, str):
        found = [b for b in beams if b.name == beam]
    elif isinstance(beam, int) and not isinstance(beam, bool) and beam >= 0:
        found = list(beams[beam:beam + 1])
    if found:
        return found[0]
    known = [b.name if b.name is not None else k for k, b in enumerate(beams)]
    if beam is None:
        raise InputError(f"the scene has {len(beams)} beams: say which with beam=, one of {known}")
    if isinstance(beam, RigidBody):
        raise InputError(f"this is asked of beams, got {shown(beam)}; beams are {known}")
    raise NameUnknown("beam", beam, known)


def select_member(beams: Sequence[Beam], bodies: Sequence[RigidBody],
                  which: WhichMember) -> Beam | RigidBody:
    """As :func:`select_beam`, of beams and of rigid bodies, which are numbered behind them.

    Parameters
    ----------
    beams, bodies
        Those of a scene.
    which
        A Beam or a RigidBody, its name or its number; None for the only beam.

    Raises
    ------
    NameUnknown
        If there is none, or None is given and there are several beams.
    """
    if which is None or not bodies:
        return select_beam(beams, which)
    members = *beams, *bodies
    if isinstance(which, RigidBody):
        found = [b for b in bodies if b is which]
        if found:
            return found[0]
        raise NameUnknown("rigid body", which, [b.name or len(beams) + k
                                                for k, b in enumerate(bodies)])
    return select_beam(members, which)  # type: ignore[arg-type]
