"""What every beam element shares: products of axis and section functions."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import legendre
from skfem.element import DiscreteField, Element

from ..core.errors import InputError, MeshError, require_finite, shown
from ..core.frozen import Content, Frozen, read_only
from ..core.kept import cached_property
from ..mesh.nodal import nodal_derivatives, turned
from ..core.quadrature import gauss, tensor
from ..mesh.reference_cell import SECTIONS, RefBeam, few, hermite_basis
from .series import coefficients
from .sampling import Held, Sampling, default_sampling, missed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from ..mesh.mapping import MappingBeam
    from ..mesh.chain import Chain
    from ..mesh.mesh_beam import MeshBeam
    from ..core.types import Array, Rule

    Functionals = tuple[tuple[float, int, int], ...]


#: Degrees along the axis of the elements of the package.
DEGREES = tuple(range(3, 16, 2))


def require_degree(degree: object) -> int:
    """A degree along the axis: one of :data:`DEGREES`.

    Parameters
    ----------
    degree
        What was given.

    Raises
    ------
    InputError
        If it is another.
    """
    if (isinstance(degree, bool) or not isinstance(degree, (int, np.integer))
            or degree not in DEGREES):
        raise InputError(f"the degree along the axis is one of {', '.join(map(str, DEGREES))}, got "
                         f"{shown(degree)}: half of the Hermite functions belong to each node")
    return int(degree)


class ElementBeam(Frozen, Element):
    """A scalar beam element; wrap it in scikit-fem's ``ElementVector`` for the position field.

    The local functions are, for each of the two nodes, a Hermite function in xi for the position
    ``r``, its slope ``r_X`` and further derivatives on the axis, then ``(1 - xi) P_k(Y)`` or
    ``xi P_k(Y)`` for each section coordinate, Hermite functions too where their derivatives along
    X are coordinates. A subclass says what the coordinates are; all else follows from that, the
    :attr:`sampling` of the formulation "assumed" included, which it may override.

    Parameters
    ----------
    section
        The functions P_k of the section, a :class:`SectionFunctions`.
    names
        Names of the coordinates of a node after ``r`` and ``r_X``: further derivatives of the
        axis, then those of all P_k, then their first derivatives along X, and so on.
    functionals
        What these coordinates are, as in the attribute.
    welded
        Those of ``names`` that a welded face fixes.

    Attributes
    ----------
    section : SectionFunctions
        The functions P_k of the section.
    welded : list of str
        Names of the coordinates that a welded face fixes: the position of every point of it.
    functionals : tuple of (float, int, int)
        For each coordinate of a node: eta - 1/2 of the point, and the number of derivatives
        along X and Y that the coordinate is.
    axis_degree : int
        Polynomial degree of the axis along X.
    sections : str
        How section coordinates vary between the nodes: "linear", "cubic" or "quintic" (Hermite,
        with derivatives along X as further coordinates).
    strain_degree : int
        Polynomial degree of the Green-Lagrange strain along a straight element.
    carries_shear_parabola : bool
        True if the section functions hold Y^3, so that no shear correction is wanted.
    kinematics : str
        How the points of a section follow the coordinates: a name of
        :data:`skfem_ancf.beam.kinematics.KINEMATICS`.
    """

    refdom = RefBeam
    kinematics = "sections"
    #: Shear factor of a section that is no rectangle of one material, else None.
    shear: float | None = None
    _measure: Any = None

    def __init__(self, section: SectionFunctions, names: Sequence[str],
                 functionals: Sequence[tuple[float, int, int]], welded: Sequence[str]) -> None:
        self.section = section
        self.dofnames = ["r", "r_X", *names]
        self.nodal_dofs = len(self.dofnames)
        self.functionals: Functionals = (
            (0.0, 0, 0), (0.0, 1, 0), *((y, along, across) for y, along, across in functionals))
        self.welded = ["r", *welded]
        self.doflocs = np.array([[xi, 0.5 + f[0]] for xi in (0.0, 1.0) for f in self.functionals])
        self._along = (sum(across == 0 for _, _, across in self.functionals),
                       1 + max([a for _, a, across in self.functionals if across > 0], default=0))
        across, expected = len(self.functionals) - self._along[0], section.number * self._along[1]
        if len(names) != len(functionals) or across != expected:
            raise InputError(
                f"{type(self).__name__} has {len(names)} names and {len(functionals)} functionals, "
                f"{across} of them across the section: each name is one, and of each of the "
                f"{section.number} section functions there is one for each derivative along X, "
                f"here {expected}")
        self.axis_degree = 2 * self._along[0] - 1
        self.sections = SECTIONS[self._along[1] - 1]
        # stock quadrature takes 2 maxdeg in each direction: exact for the energy, which is of
        # degree 8 along the axis and 4 N across the section
        self.maxdeg = max(self.strain_degree, 2 * self.section.degree)

    def measured(self, measure: Any, shear: float | None = None) -> ElementBeam:
        """The same element for a section whose rules a measure gives, for formulations.

        Parameters
        ----------
        measure
            With ``gauss(n)``, as of :mod:`skfem_ancf.sections.measure`.
        shear
            What :func:`skfem_ancf.sections.shear.shear_factor` gives for the section.
        """
        other = object.__new__(type(self))
        other.__dict__.update(vars(self), _measure=measure, shear=shear)
        return other

    def raised(self) -> ElementBeam | None:
        """The element of the next degree along the axis, or None: for ``solve_static(adapt=...)``.
        """
        return None

    def across(self, n: int) -> Rule:
        """Points eta and weights across the section, n of them; those of Gauss unless it is known.

        Parameters
        ----------
        n
            Number of points.
        """
        return gauss(n) if self._measure is None else self._measure.gauss(n)

    @property
    def order(self) -> int:
        """Degree N of the section functions."""
        return self.section.degree

    @property
    def strain_degree(self) -> int:
        return 2 * max(self.axis_degree - 1, 2 * self._along[1] - 1)

    @property
    def carries_shear_parabola(self) -> bool:
        return self.section.degree >= 3

    @property
    def facet_points(self) -> int:
        """Gauss points of a facet, for products of two local functions."""
        return max(self.axis_degree, self.order) + 2

    @property
    def _factors(self) -> Array:
        return _factors(self._along, self.functionals, self.section.number)

    def local(self, X: Array, h: float | Array, i: int | slice = slice(None),
              rate: float | Array = 0.0) -> tuple[Array, Array, Array, Any]:
        """Local functions on the reference cell, their derivatives, and their power of the length.

        Parameters
        ----------
        X
            Reference points, shape (2, npoints) or (2, nelements, npoints).
        h
            Height of the section; of a tapered one at each point, shape X.shape[1:], or of each
            element at the same points, shape (nelements, npoints).
        i
            Number of the local function, 0 to 2 nodal_dofs - 1, or a slice of them.
        rate
            Derivative of the height by xi, of the same shape.

        Returns
        -------
        value, d_xi, d_eta
            Arrays of shape X.shape[1:], or (n,) + X.shape[1:] of a slice; of the shape of h where
            that has more axes.
        slope
            The power of L that a function takes: how many derivatives along X its coordinate is.
        """
        if not isinstance(i, slice):
            if not 0 <= i < 2 * self.nodal_dofs:
                self._index_error()
            value, d_xi, d_eta, (slope,) = self.local(X, h, slice(i, i + 1), rate)
            return value[0], d_xi[0], d_eta[0], int(slope)
        (value, d_xi, d_eta), power, slope = self._of_height(X, h, i)
        if isinstance(h, np.ndarray):  # h^p P(Y / h) of a height that varies
            d_xi += np.multiply.outer(power, rate / h) * value
        return value, d_xi, d_eta, slope

    def _of_height(self, X: Array, h: Any, i: slice = slice(None), parts: slice = slice(None)
                   ) -> tuple[Array, Array, Array]:
        """What :meth:`local` returns first, or some of it, at a constant height; both powers."""
        power, slope = self._factors[3:, i]
        if few(X):
            unit = _kept_functions(self._along, self.functionals, self.section, Content(X))
            unit = unit[parts, i]
        else:
            unit = _unit_functions(self._along, self._factors[:, i], self.section, X)[parts]
        if isinstance(h, np.ndarray) and h.ndim == unit.ndim - 1:  # some points of each element
            unit = unit[:, :, None]
        factor = _powers(h, power)
        return factor.reshape(factor.shape[:1] + (
            factor.shape[1:] or (1,) * (unit.ndim - 2))) * unit, power, slope

    def series(self) -> tuple[Array, Array, Array]:
        """The local functions of height 1 and length 1 in products of Chebyshev polynomials.

        Returns
        -------
        coefficients
            As :func:`skfem_ancf.elements.series.coefficients` returns them, which are kept.
        height, length
            The powers of both that the functions take, shape (2 nodal_dofs,) each.
        """
        p = max(self.axis_degree, 3 if self.sections == "cubic" else 1) + 1
        m = max(self.order, 1) + 1
        return (_series(self._along, self.functionals, self.section, p, m), *self._factors[3:])

    def integrals(self, h: float, L: float) -> Array:
        """The means of the local functions over a straight element of one height; (2 nodal_dofs,).

        Parameters
        ----------
        h, L
            Its height and length.
        """
        return self.powers(h, L) * _integrals_of(
            self._along, self.functionals, self.section, self.axis_degree, max(self.order, 1))

    def products(self, h: float, L: float) -> Array:
        """The means of products of two of them alike, shape (2 nodal_dofs, 2 nodal_dofs).

        Parameters
        ----------
        h, L
            As for :meth:`integrals`.
        """
        powers = self.powers(h, L)
        return powers[:, None] * powers * _products_of(
            self._along, self.functionals, self.section, self.axis_degree, max(self.order, 1))

    @property
    def by_reference(self) -> bool:
        """True if elements follow from one of length and height 1, straight ones by powers."""
        return all(getattr(type(self), name) is getattr(ElementBeam, name)
                   for name in ("local", "of_mesh", "functions", "slopes"))

    def unit_slopes(self, X: Array, Y: Array) -> Array:
        """Derivatives of the local functions of height 1 and length 1, which are kept.

        Parameters
        ----------
        X, Y
            Reference points of derivatives along the axis, shape (2, n), and of those across, (2,
            m).

        Returns
        -------
        ndarray
            Shape (n + m, 2 nodal_dofs).
        """
        return _slopes(self._along, self.functionals, self.section, Content(X, Y))

    def powers(self, h: float, L: float | Array) -> Array:
        """What height and length multiply the local functions by, shape (..., 2 nodal_dofs).

        Parameters
        ----------
        h, L
            Height and length of a straight element; of several lengths of shape (..., 1).
        """
        power, slope = self._factors[3:]
        return h**power * L**slope

    def gbasis(self, mapping: MappingBeam, X: Array, i: int,
               tind: Array | None = None) -> tuple[DiscreteField, ...]:
        """A local function on the body, with its gradient: what scikit-fem's ``Basis`` asks for.

        Parameters
        ----------
        mapping
            The mapping of a MeshBeam.
        X
            Reference points, shape (2, npoints) or (2, nelements, npoints).
        i
            Number of the local function, 0 to 2 nodal_dofs - 1.
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        tuple of DiscreteField
            One field: value (nelements, npoints) and grad (2, nelements, npoints).
        """
        if not 0 <= i < 2 * self.nodal_dofs:
            self._index_error()
        value, grad = self.functions(mapping, X, tind, slice(i, i + 1))
        return (DiscreteField(value=value[0], grad=grad[0]),)

    def functions(self, mapping: MappingBeam, X: Array, tind: Array | None = None,
                  which: slice = slice(None)) -> tuple[Array, Array]:
        """All local functions on the body, with their gradients.

        Parameters
        ----------
        mapping, X, tind
            As for :meth:`gbasis`, shapes (2, npoints) or (2, nelements, npoints), and
            (nelements,).
        which
            Some of them.

        Returns
        -------
        value, grad
            Shapes (n, nelements, npoints) and (n, 2, nelements, npoints).
        """
        mesh = mapping.mesh
        value, d_xi, d_eta, slope = self.of_mesh(mapping, X, tind, which)
        if value.ndim == 2:  # the same points of all elements
            value, d_xi, d_eta = value[:, None], d_xi[:, None], d_eta[:, None]
        scale = self._scale(mesh, slope, tind)[:, :, None]
        invDF = mapping.invDF(X, tind)
        grad = scale[:, None] * (invDF[0] * d_xi[:, None] + invDF[1] * d_eta[:, None])
        return scale * value, grad

    def values(self, mapping: MappingBeam, X: Array, tind: Array | None = None) -> Array:
        """All local functions on the body, without their gradients; shape (n, nelements, npoints).

        Parameters
        ----------
        mapping, X, tind
            As for :meth:`gbasis`, shapes (2, npoints) or (2, nelements, npoints), and
            (nelements,).
        """
        if not self.by_reference:
            value, _, _, slope = self.of_mesh(mapping, X, tind)
        else:
            h = mapping.height(X[0], tind)[0] if self.section.number else 1.0
            (value,), _, slope = self._of_height(X, h, parts=slice(1))
        return self._scaled(mapping.mesh, slope, tind, value)[0]

    def along(self, mapping: MappingBeam, X: Array, tind: Array | None = None
              ) -> tuple[Array, Array]:
        """All local functions on the body, and their derivatives by xi.

        Parameters
        ----------
        mapping, X, tind
            As for :meth:`gbasis`, shapes (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        value, d_xi
            Shape (n, nelements, npoints) both.
        """
        value, d_xi, _, slope = self.of_mesh(mapping, X, tind)
        value, d_xi = self._scaled(mapping.mesh, slope, tind, value, d_xi)
        return value, d_xi

    def _scaled(self, mesh: Chain, slope: Array, tind: Array | None, *values: Array
                ) -> list[Array]:
        """Local functions of all elements from those of length 1, which may be the same."""
        scale = self._scale(mesh, slope, tind)[:, :, None]
        return [scale * (x[:, None] if x.ndim == 2 else x) for x in values]

    def of_mesh(self, mapping: MappingBeam, X: Array, tind: Array | None = None,
                i: int | slice = slice(None)) -> tuple[Array, Array, Array, Any]:
        """As :meth:`local`, with the heights of a mesh.

        Parameters
        ----------
        mapping, X, tind, i
            As for :meth:`gbasis`, shapes (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        value, d_xi, d_eta, slope
            Of a tapered mesh with the axis of the elements, (n, nelements, npoints), where there
            are functions of the section.
        """
        h, rate = mapping.height(X[0], tind) if self.section.number else (1.0, 0.0)
        return self.local(X, h, i, rate)

    @staticmethod
    def _scale(mesh: Chain, slope: Array, tind: Array | None) -> Array:
        """The lengths of elements to the powers of local functions, shape (n, nelements)."""
        lengths = mesh.lengths if tind is None else mesh.lengths[tind]
        return lengths ** slope[:, None]

    def slopes(self, mapping: MappingBeam, X: Array, tind: Array | None = None
               ) -> tuple[Array, Array]:
        """Derivatives of all local functions along the axis and across it, and the beam's frame.

        Parameters
        ----------
        mapping, X, tind
            As for :meth:`gbasis`, shapes (2, npoints) or (2, nelements, npoints), and
            (nelements,).

        Returns
        -------
        slopes, frame
            Shapes (n, 2, nelements, npoints) and (2, 2, nelements, npoints), see
            :meth:`MappingBeam.frame <skfem_ancf.mesh.mapping.MappingBeam.frame>`.
        """
        _, d_xi, d_eta, slope = self.of_mesh(mapping, X, tind)
        if d_xi.ndim == 2:  # the same points of all elements
            d_xi, d_eta = d_xi[:, None], d_eta[:, None]
        rates, frame = mapping.in_frame(X, tind)
        out = rates[:, 0] * d_xi[:, None] + rates[:, 1] * d_eta[:, None]
        out *= self._scale(mapping.mesh, slope, tind)[:, None, :, None]
        return out, frame

    def gradients(self, mapping: MappingBeam, X: Array, tind: Array | None, u_e: Array
                  ) -> tuple[Array, Array]:
        """Derivatives of a displacement along the axis and across it, and the beam's frame.

        Parameters
        ----------
        mapping, X, tind
            As for :meth:`gbasis`, shapes (2, npoints) or (2, nelements, npoints), and
            (nelements,).
        u_e
            Coordinates of the elements, shape (nelements, n, 2).

        Returns
        -------
        H, frame
            Shape (2, 2, nelements, npoints) both.
        """
        mesh = mapping.mesh
        _, d_xi, d_eta, slope = self.of_mesh(mapping, X, tind)
        points = "bp" if d_xi.ndim == 2 else "bep"
        u = np.multiply(u_e.T, self._scale(mesh, slope, tind), order="C")
        r_xi, r_eta = (np.einsum(f"ibe,{points}->iep", u, d) for d in (d_xi, d_eta))
        rates, frame = mapping.in_frame(X, tind)
        return r_xi[:, None] * rates[:, 0] + r_eta[:, None] * rates[:, 1], frame

    @cached_property
    def sampling(self) -> Sampling:
        """Where "assumed" evaluates the strain; by default :func:`.sampling.default_sampling`."""
        return default_sampling(self.axis_degree, 2 * self._along[1] - 1)

    @cached_property
    def held(self) -> tuple[Held, ...]:
        """The modes that eps_xx misses there, of the axis and of each section coordinate.

        Their sizes do not lower the order of the error, which is 2 for linear sections. The more
        derivatives are coordinates, the more may resist and the less c is: for a quintic axis ten
        times the size of a cubic one costs little and spares the higher modes.
        """
        (m, k), N = self._along, self.section.number
        n = len(self.sampling.places("xx"))
        size = (1.0, "element") if k == 1 else (10.0 ** (m - 1), "beam")
        return (*(Held(self._of_both(range(m), w), *size) for w in missed(m, n)),
                *(Held(self._of_both(range(m + j, m + j + N * k, N), w), 1.0 / N)
                  for j in range(N) for w in missed(k, n)))

    def _of_both(self, rows: Sequence[int], weights: Array) -> Array:
        """Weights of some coordinates of both nodes, among zeros for the others."""
        full = np.zeros((2, self.nodal_dofs))
        full[:, rows] = weights.reshape(2, -1)
        return full.ravel()

    @cached_property
    def halving(self) -> Array:
        """The coordinates of the left half of an element of length 1 and height 1 from its own.

        Shape (2 nodal_dofs, 2 nodal_dofs), for coordinates multiplied by the length to the number
        of their derivatives along X. The last nodal_dofs rows are those of the middle.
        """
        n = self.axis_degree + 1, max(self.order, 1) + 1
        X = np.array(np.meshgrid(np.linspace(0, 1, n[0]), np.linspace(0, 1, n[1]))).reshape(2, -1)
        half = np.array([0.5 * X[0], X[1]])
        own, child = (self.local(P, 1.0)[0].T for P in (half, X))
        return np.linalg.lstsq(child, own, rcond=None)[0]

    def fitted(self, mesh: MeshBeam) -> MeshBeam:
        """The mesh that a beam of this element has: a curved one with sections as its own.

        Parameters
        ----------
        mesh
            A MeshBeam.

        Raises
        ------
        MeshError
            If it is curved, and the element's axis and sections are of two degrees, which those of
            a curved mesh are not but for a cubic axis.
        """
        if mesh.is_straight:
            return mesh
        if self.section.number and self.axis_degree > 3 and self._along[0] != self._along[1]:
            raise MeshError(
                f"{self!r} is for straight meshes: axis and sections of a curved one are of one "
                "degree. Use ElementBeamANCF, ElementBeamANCFHermite or ElementBeamCable")
        return mesh.with_sections(self.mesh_sections)

    @property
    def mesh_sections(self) -> str:
        """How a curved mesh of the element interpolates its sections."""
        return self.sections

    def rigid(self, mesh: MeshBeam) -> Array:
        """The coordinates of the nodes in the stress-free state, less their positions.

        Parameters
        ----------
        mesh
            A MeshBeam whose ``sections`` are those of the element, unless it is straight.

        Returns
        -------
        ndarray
            Shape (nodal_dofs, 2, nvertices); the first row, for ``r``, is zero.

        Raises
        ------
        MeshError
            If the mesh is curved and interpolates its sections in another way.
        """
        if mesh.sections != self.mesh_sections and not mesh.is_straight:
            raise MeshError(f"the sections of {self!r} are {self.mesh_sections}, those of the "
                            f"curved mesh {mesh.sections}: use "
                            f"mesh.with_sections({self.mesh_sections!r})")
        known = {(1, 0): mesh.p_X, (0, 1): mesh.p_Y}
        if mesh.p_XY is not None:
            known[1, 1] = mesh.p_XY
        most = max(self._along[0] - 1, self._along[1])
        if most > 1 and mesh.p_XY is not None and not mesh.is_straight:
            more = dict(enumerate(nodal_derivatives(mesh, most)[2:], 2))
            known |= {(k, 0): d for k, d in more.items()}
            known |= {(k - 1, 1): turned(d) for k, d in more.items() if k > 2}
        out = np.zeros((self.nodal_dofs, *mesh.p.shape))
        for k, (_, along, across) in enumerate(self.functionals):
            if (along, across) in known:
                out[k] = known[along, across]
        return out

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of order {self.order}, coordinates {self.dofnames}>"


@lru_cache(64)
def _integrals(content: Content) -> Array:
    """From the coefficients of derivatives by eta in 2 eta to those of functions, zero at 0."""
    derivatives, = content.arrays
    return read_only(legendre.legint(derivatives, lbnd=0.0, axis=0) / 2)


@lru_cache(64)
def _factors(along: tuple[int, int], functionals: Functionals, number: int) -> Array:
    """Of all local functions: row of the axis functions, or -1, of those along X that a section
    function has, its number, the power of h, and that of the length."""
    m, n = along
    rows = []
    for node in (0, 1):
        for k, (_, slope, power) in enumerate(functionals):
            of = m * node + slope if power == 0 else -1
            rows.append((of, n * node + slope, (k - m) % max(number, 1), power, slope))
    return read_only(np.array(rows).T)


@lru_cache(64)
def _series(along: tuple[int, int], functionals: Functionals, section: SectionFunctions, p: int,
            m: int) -> Array:
    factors = _factors(along, functionals, section.number)
    return read_only(coefficients(lambda X: _unit_functions(along, factors, section, X)[0], p, m))


@lru_cache(64)
def _integrals_of(along: tuple[int, int], functionals: Functionals, section: SectionFunctions,
                  degree: int, order: int) -> Array:
    X, W = tensor(gauss(degree // 2 + 1), gauss(order // 2 + 1))
    factors = _factors(along, functionals, section.number)
    return read_only(_unit_functions(along, factors, section, X)[0] @ W)


@lru_cache(64)
def _products_of(along: tuple[int, int], functionals: Functionals, section: SectionFunctions,
                 degree: int, order: int) -> Array:
    X, W = tensor(gauss(degree + 1), gauss(order + 1))
    N = _unit_functions(along, _factors(along, functionals, section.number), section, X)[0]
    return read_only(N * W @ N.T)


@lru_cache(64)
def _slopes(along: tuple[int, int], functionals: Functionals, section: SectionFunctions,
            content: Content) -> Array:
    factors, (X, Y) = _factors(along, functionals, section.number), content.arrays
    out = np.concatenate([_unit_functions(along, factors, section, X)[1].T,
                          _unit_functions(along, factors, section, Y)[2].T])
    # the positions of both nodes together are a translation: exactly, or round-off resists it
    out[:, len(functionals)] = -out[:, 0]
    return read_only(out)


@lru_cache(256)
def _kept_functions(along: tuple[int, int], functionals: Functionals, section: SectionFunctions,
                    content: Content) -> Array:
    """All of :func:`_unit_functions`, of one array of points."""
    X, = content.arrays
    return read_only(_unit_functions(along, _factors(along, functionals, section.number), section,
                                     X))


def _powers(h: float | Array, power: Array) -> Array:
    """h to several powers, shape (n,) + h.shape; of an array each found once."""
    if not isinstance(h, np.ndarray):
        return h**power
    found = np.ones((power.max(initial=0) + 1, *h.shape), h.dtype)
    for k in range(1, len(found)):
        np.multiply(found[k - 1], h, out=found[k])
    return found.take(power, axis=0)


def _unit_functions(along: tuple[int, int], factors: Array, section: SectionFunctions,
                    X: Array) -> Array:
    """Local functions of height 1 and length 1 and their derivatives by xi and eta, (3, n, ...)."""
    axis, of_node, number, _, _ = factors
    out = np.zeros((3, len(axis)) + np.shape(X)[1:], np.result_type(X, float))
    of_axis, of_section = axis >= 0, axis < 0
    for d in (0, 1):
        out[d, of_axis] = hermite_basis(along[0], X[0], d)[axis[of_axis]]
    if np.any(of_section):
        S, dS = (hermite_basis(along[1], X[0], d)[of_node[of_section]] for d in (0, 1))
        P, dP = (values[number[of_section]] for values in section(X[1] - 0.5))
        out[:, of_section] = S * P, dS * P, S * dP
    return out


class SectionFunctions(Frozen):
    """Polynomials P_k(eta), P_k(0) = 0, given by their derivatives in the Legendre basis.

    The beam's section function is ``h^m P_k(Y / h)`` for a coordinate that is an m-th derivative.

    Parameters
    ----------
    derivatives
        Legendre coefficients of P_k' on [-1/2, 1/2], shape (degree, n).
    """

    def __init__(self, derivatives: ArrayLike) -> None:
        self._dP = require_finite("derivatives", derivatives, (None, None))
        self._P = _integrals(Content(self._dP))

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) is SectionFunctions
                                 and self._content == other._content)

    def __hash__(self) -> int:
        return hash(self._content) if type(self) is SectionFunctions else id(self)

    @cached_property
    def _content(self) -> Content:
        return Content(self._dP)

    @property
    def degree(self) -> int:
        return self._dP.shape[0]

    @property
    def number(self) -> int:
        return self._dP.shape[1]

    def __call__(self, eta: Array, k: int | slice = slice(None)) -> tuple[Array, Array]:
        """P_k and its derivative at eta in [-1/2, 1/2]; of all k, shape (n,) + eta.shape."""
        return legendre.legval(2 * eta, self._P[:, k]), legendre.legval(2 * eta, self._dP[:, k])
