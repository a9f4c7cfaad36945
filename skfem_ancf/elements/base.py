"""Base class of beam elements, and where their strain is sampled."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from skfem.element import DiscreteField, Element

from ..core import (Array, ArrayLike, Immutable, InputError, MeshError, Rule, cached_property,
                    gauss, gauss_lobatto, hermite_basis, refuse, require_finite, shown)
from ..mesh.mapping import SECTIONS, MappingBeam, nodal_derivatives, turned
from ..mesh.mesh_beam import MeshBeam
from ..mesh.numbering import RefBeam


# sampling points of the formulation "assumed", and the modes that they miss

class Sampling(NamedTuple):
    """Sampling of the strain along an element in the formulation "assumed". ``points`` is the
    number of integration points (Gauss). ``samples`` maps a strain component "xx", "yy" or "xy" to
    the points xi in [0, 1] where it is evaluated; others are evaluated at the integration points.
    ``volume`` is the number of Gauss points for the volumetric part in plane strain, reduced
    against volumetric locking; 0 to integrate it with the rest."""

    points: int
    samples: dict[str, tuple[float, ...]]
    volume: int = 0

    def places(self, component: str) -> Array:
        """Points xi in [0, 1] where a strain component is evaluated, shape (n,)."""
        return np.array(self.samples.get(component, gauss(self.points)[0]))


class StabilisedMode(NamedTuple):
    """A mode that the samples miss, stabilised by ``1/2 k L |c|^2``, L the length of the element.
    ``weights`` (2 nodal_dofs,) give c, a derivative along X of a field, from the degrees of freedom
    of an element of length 1. ``size`` is k in units of E I over the squared length of the
    "element" or the "beam", as ``per`` says; "" for a curvature c, without division."""

    weights: Array
    size: float
    per: str = ""


def default_sampling(p: int, s: int) -> Sampling:
    """Samples for axes of degree ``p`` and sections of degree ``s``, by counting constraints."""
    # An element of a chain adds one node with p + s + 2 unknowns. In the thin limit a sample is a
    # constraint; neighbours share those at nodes. If no unknown is left the element locks; with
    # fewer samples modes are missed (:func:`missed`) and must be stabilised. eps_xx, of degree
    # 2 (p - 1), has p - 1 Gauss points; eps_yy the nodes, and between them the s Gauss-Lobatto
    # points, zeros of the mode of the slope that eps_xx misses; eps_xy (s + 3) / 2 Gauss-Lobatto
    # points where sections have the degree of the axis, else the points of eps_xx. Linear sections,
    # p = 3 and s = 1, have 1 of 6 left, p = s = 3 has 2 of 8, p = s = 5 1 of 12.
    few = (s + 3) // 2
    if s < p:
        return Sampling(min(p - 1, (p + s + 2 - few) // 2), {"yy": _lobatto(few)},
                        volume=int(s == 1))
    few = max(few, s - 1)
    many = s if s > 5 else min(s, p + s + 2 - (p - 1) - (few - 1))
    return Sampling(many, {"xx": tuple(gauss(p - 1)[0]), "yy": _lobatto(many),
                           "xy": _lobatto(few)})


def _lobatto(n: int) -> tuple[float, ...]:
    return tuple(0.5 + 0.5 * gauss_lobatto(n))


def missed(m: int, n: int) -> list[Array]:
    """Modes with m nodal derivatives whose slope vanishes at n Gauss points, (2 m,) each."""
    x, w = gauss(2 * m)
    out = []
    for degree in range(n, 2 * m - 1):
        P = legendre.legval(2.0 * x - 1.0, np.eye(degree + 1)[degree])
        weights = (2 * degree + 1) * hermite_basis(m, x, 1) @ (w * P)
        weights[m] = -weights[0]  # exactly zero for a translation
        out.append(weights)
    return out


#: Degrees along the axis.
DEGREES = tuple(range(3, 16, 2))


def require_degree(degree: object) -> int:
    """Check a degree along the axis, one of :data:`DEGREES`."""
    if (isinstance(degree, bool) or not isinstance(degree, (int, np.integer))
            or degree not in DEGREES):
        raise InputError(f"the degree along the axis is one of {', '.join(map(str, DEGREES))}, got "
                         f"{shown(degree)}")
    return int(degree)


class SectionFunctions:
    """Polynomials P_k(eta), P_k(0) = 0, by Legendre coefficients (degree, n) of P_k'. The section
    function of a beam is ``h^m P_k(Y / h)`` for an m-th derivative."""

    def __init__(self, derivatives: ArrayLike) -> None:
        dP = require_finite("derivatives", derivatives, (None, None))
        self.degree, self.number = dP.shape
        #: coefficients (degree + 1, 2, n) of P_k and its derivative
        self._both = np.zeros((self.degree + 1, 2, self.number))
        self._both[:-1, 1] = dP
        part = dP / (4.0 * np.arange(self.degree)[:, None] + 2.0)  # of (L_m+1 - L_m-1) / (2 m + 1)
        self._both[1:, 0] += part
        self._both[:-2, 0] -= part[1:]
        self._both[0, 0] = 0.0
        self._both[0, 0] = -legendre.legval(0.0, self._both[:, 0])

    def values(self, eta: Array) -> Array:
        """P_k at eta, as those of a call."""
        return legendre.legval(2 * eta, self._both[:, 0])

    def __call__(self, eta: Array, k: int | slice = slice(None)) -> tuple[Array, Array]:
        """P_k and its derivative at eta in [-1/2, 1/2], shape (n,) + eta.shape."""
        value, slope = legendre.legval(2 * eta, self._both[:, :, k])
        return value, slope


class ElementBeam(Immutable, Element):
    """A scalar beam element; wrap it in scikit-fem's ``ElementVector`` for the position field.

    The local functions of each node are Hermite functions in xi for the position ``r``, its slope
    ``r_X`` and higher derivatives on the axis, then ``(1 - xi) P_k(Y)`` or ``xi P_k(Y)`` for each
    derivative across the section, or Hermite functions times P_k where their derivatives along X
    are degrees of freedom too. A subclass defines the degrees of freedom. Everything else follows
    from them, :attr:`sampling` of the formulation "assumed" included, which it may override.

    Parameters
    ----------
    section
        The functions P_k of the section, a :class:`SectionFunctions`.
    names
        Names of the degrees of freedom of a node after ``r`` and ``r_X``: higher derivatives of
        the axis, then those of all P_k, then their first derivatives along X, and so on.
    functionals
        Their definitions, as in the attribute.
    welded
        Those of ``names`` that fix the position of every point of a clamped face.

    Other Parameters
    ----------------
    mapping
        The mapping of a MeshBeam.
    X
        Reference points, shape (2, npoints) or (2, nelements, npoints).
    tind
        Elements, shape (nelements,), or None for all.
    i, which
        Number of the local function, or a slice.

    Attributes
    ----------
    functionals : tuple of (float, int, int)
        For each degree of freedom of a node: eta - 1/2 of its point, and the numbers of derivatives
        along X and Y.
    axis_degree : int
        Polynomial degree of the axis along X.
    sections : str
        Interpolation of the section along X: "linear", "cubic" or "quintic" (Hermite).
    kinematics : str
        "sections" or "cable", see :mod:`skfem_ancf.beam.kinematics`.
    """

    refdom = RefBeam
    kinematics = "sections"
    #: Shear factor of the section; None for a rectangle of one material.
    shear: float | None = None
    _measure: Any = None

    def __init__(self, section: SectionFunctions, names: Sequence[str],
                 functionals: Sequence[tuple[float, int, int]], welded: Sequence[str]) -> None:
        self.section = section
        self.dofnames = ["r", "r_X", *names]
        self.nodal_dofs = len(self.dofnames)
        self.functionals: tuple[tuple[float, int, int], ...] = (
            (0.0, 0, 0), (0.0, 1, 0), *((y, along, across) for y, along, across in functionals))
        self.welded = ["r", *welded]
        self.doflocs = np.array([[xi, 0.5 + f[0]] for xi in (0.0, 1.0) for f in self.functionals])
        self._along = (sum(across == 0 for _, _, across in self.functionals),
                       1 + max([a for _, a, across in self.functionals if across > 0], default=0))
        across, expected = len(self.functionals) - self._along[0], section.number * self._along[1]
        refuse(len(names) != len(functionals) or across != expected, "{} has {} names and {} "
               "functionals, {} of them across the section, which has {} functions and needs {}",
               type(self).__name__, len(names), len(functionals), across, section.number, expected)
        self.axis_degree = 2 * self._along[0] - 1
        self.sections = SECTIONS[self._along[1] - 1]
        # stock quadrature takes 2 maxdeg in each direction: exact for the energy, which is of
        # degree 8 along the axis and 4 N across the section
        self.maxdeg = max(self.strain_degree, 2 * self.section.degree)

    def measured(self, measure: Any, shear: float | None = None) -> "ElementBeam":
        """The element for a section with given quadrature, as formulations take it.

        Parameters
        ----------
        measure, shear
            A measure with ``gauss(n)``, see :mod:`skfem_ancf.sections.section`; the shear factor.
        """
        other = self._thawed()
        other._measure, other.shear = measure, shear
        other._freeze()
        return other

    def raised(self) -> "ElementBeam | None":
        """The element of the next degree along the axis, or None: for ``solve_static(adapt=...)``.
        """
        return None

    def plane(self) -> "ElementBeam | None":
        """The element of order 1 with the same axis, or None: for sections that stay plane."""
        return None

    def across(self, n: int) -> Rule:
        """n Gauss points eta and weights across the section."""
        return gauss(n) if self._measure is None else self._measure.gauss(n)

    @property
    def order(self) -> int:
        """Degree N of the section functions."""
        return self.section.degree

    @property
    def strain_degree(self) -> int:
        """Polynomial degree of the Green-Lagrange strain along a straight element."""
        return 2 * max(self.axis_degree - 1, 2 * self._along[1] - 1)

    @property
    def carries_shear_parabola(self) -> bool:
        """True if the section functions include Y^3, so that no shear correction is needed."""
        return self.section.degree >= 3

    @property
    def facet_points(self) -> int:
        """Gauss points of a facet for products of two local functions."""
        return max(self.axis_degree, self.order) + 2

    # local functions

    @cached_property
    def _powers(self) -> Array:
        """Powers of height and length of all local functions, shape (2, 2 nodal_dofs)."""
        return np.array([(across, along) for _, along, across in self.functionals] * 2).T

    @cached_property
    def _places(self) -> tuple[Array, ...]:
        """Numbers of the axis functions and of the others, with the two factors of these."""
        (m, n), (power, slope) = self._along, self._powers
        node, k = np.divmod(np.arange(2 * self.nodal_dofs), self.nodal_dofs)
        of_axis, of_section = (power == 0).nonzero()[0], power.nonzero()[0]
        number = (k - m) % max(self.section.number, 1)
        return of_axis, of_section, (n * node + slope)[of_section], number[of_section]

    def _unit(self, X: Array, i: Any = slice(None)) -> Array:
        """Functions for height 1 and length 1 and their derivatives by xi and eta, (3, n, ...)."""
        (xi, eta), (m, n), (of_axis, of_section, node, number) = X, self._along, self._places
        A, dA = [hermite_basis(m, xi, d) for d in (0, 1)]
        if not self.section.number:
            return np.array([A[i], dA[i], 0.0 * A[i]])
        S, dS = [hermite_basis(n, xi, d).take(node, axis=0) for d in (0, 1)]
        P, dP = [x.take(number, axis=0) for x in self.section(eta - 0.5)]
        out = np.zeros((3, len(of_axis) + len(of_section), *xi.shape), np.result_type(X, float))
        out[0, of_axis], out[1, of_axis] = A, dA
        out[0, of_section], out[1, of_section], out[2, of_section] = S * P, dS * P, S * dP
        return out[:, i]

    def local(self, X: Array, h: float | Array, i: slice = slice(None),
              rate: float | Array = 0.0) -> tuple[Array, Array, Array, Array]:
        """Local functions on the reference cell, their derivatives by xi and eta, (n,) +
        X.shape[1:], or + the shape of h if that has more axes, and the power of the length that
        multiplies a function: the number of its derivatives along X.

        Parameters
        ----------
        h, rate
            Height and its derivative by xi: numbers, values at the points, X.shape[1:], or values
            of each element at the same points, (nelements, npoints).
        """
        power, slope = self._powers[:, i]
        unit, axes = self._unit(X, i), 0 if type(h) is float else np.ndim(h)
        if not self.section.number:
            return *unit, slope
        if axes == unit.ndim - 1:  # the same points of each element
            unit = unit[:, :, None]
        column = (-1,) + (1,) * (unit.ndim - 2)
        value, d_xi, d_eta = h ** power.reshape(column) * unit
        if axes:  # h^p P(Y / h) of a height that varies
            d_xi += np.multiply.outer(power, rate / h) * value
        return value, d_xi, d_eta, slope

    def powers(self, h: float, L: float | Array) -> Array:
        """Factors of height and length on the local functions, shape (..., 2 nodal_dofs).

        Parameters
        ----------
        h, L
            Height and length of a straight element; several lengths have shape (..., 1).
        """
        power, slope = self._powers
        return h**power * L**slope if self.section.number else L**slope

    @cached_property
    def by_reference(self) -> bool:
        """True if elements follow from one of unit length and height by :meth:`powers`."""
        kind, base = type(self), ElementBeam
        return (kind.local is base.local and kind.of_mesh is base.of_mesh
                and kind.functions is base.functions and kind.slopes is base.slopes)

    def unit_slopes(self, X: Array, Y: Array) -> Array:
        """Derivatives of the local functions for unit height and length, (n + m, 2 nodal_dofs).

        Parameters
        ----------
        X, Y
            Reference points of derivatives along the axis, (2, n), and across, (2, m).
        """
        out = np.concatenate([self._unit(X)[1].T, self._unit(Y)[2].T])
        # exactly zero for translations, so that round-off does not stiffen them
        out[:, self.nodal_dofs] = -out[:, 0]
        return out

    def of_mesh(self, mapping: MappingBeam, X: Array, tind: Array | None = None,
                i: slice = slice(None)) -> list[Array]:
        """Local functions ``i`` and derivatives by xi and eta, (n, nelements, npoints) each."""
        h, rate = mapping.height(X[0], tind) if self.section.number else (1.0, 0.0)
        *found, slope = self.local(X, h, i, rate)
        lengths = mapping.mesh.lengths if tind is None else mapping.mesh.lengths[tind]
        scale = (lengths ** slope[:, None])[:, :, None]
        return [scale * (x[:, None] if x.ndim == 2 else x) for x in found]

    def values(self, mapping: MappingBeam, X: Array, tind: Array | None = None) -> Array:
        """The local functions of :meth:`of_mesh` alone."""
        if not self.by_reference:
            return self.of_mesh(mapping, X, tind)[0]
        (xi, eta), (m, n), (power, slope) = X, self._along, self._powers[:, :, None, None]
        lengths = mapping.mesh.lengths if tind is None else mapping.mesh.lengths[tind]
        found = hermite_basis(m, xi)
        if self.section.number:
            axis, section, node, number = self._places
            A, P = found, self.section.values(eta - 0.5).take(number, axis=0)
            found = np.empty((self._powers.shape[1], *P.shape[1:]), P.dtype)
            found[axis], found[section] = A, hermite_basis(n, xi).take(node, axis=0) * P
        found = lengths[:, None] ** slope * (found[:, None] if found.ndim == 2 else found)
        return found * mapping.height(xi, tind)[0] ** power if self.section.number else found

    def gbasis(self, mapping: MappingBeam, X: Array, i: int,
               tind: Array | None = None) -> tuple[DiscreteField, ...]:
        """The local function ``i`` and its gradient, for scikit-fem's ``Basis``: one DiscreteField
        with value (nelements, npoints) and grad (2, nelements, npoints)."""
        if not 0 <= i < 2 * self.nodal_dofs:
            self._index_error()
        value, grad = self.functions(mapping, X, tind, slice(i, i + 1))
        return (DiscreteField(value=value[0], grad=grad[0]),)

    def functions(self, mapping: MappingBeam, X: Array, tind: Array | None = None,
                  which: slice = slice(None)) -> tuple[Array, Array]:
        """Local functions, (n, nelements, npoints), and their gradients, (n, 2, ...)."""
        value, d_xi, d_eta = self.of_mesh(mapping, X, tind, which)
        invDF = mapping.invDF(X, tind)
        return value, invDF[0] * d_xi[:, None] + invDF[1] * d_eta[:, None]

    def slopes(self, mapping: MappingBeam, X: Array, tind: Array | None = None
               ) -> tuple[Array, Array]:
        """Derivatives of all local functions along and across the axis, and the beam's frame.
        Shapes (n, 2, nelements, npoints) and (2, 2, nelements, npoints)."""
        _, d_xi, d_eta = self.of_mesh(mapping, X, tind)
        frame = mapping.frame(X, tind)
        rates = np.einsum("kiep,ijep->jkep", mapping.invDF(X, tind), frame)
        return rates[:, 0] * d_xi[:, None] + rates[:, 1] * d_eta[:, None], frame

    # stabilisation, adaptivity

    @cached_property
    def sampling(self) -> Sampling:
        """Sampling points of "assumed"; by default :func:`.base.default_sampling`."""
        return default_sampling(self.axis_degree, 2 * self._along[1] - 1)

    @cached_property
    def stabilised(self) -> tuple[StabilisedMode, ...]:
        """Modes of the axis and the section functions without eps_xx at the sampling points.

        The stabilisation does not lower the order of convergence, which is 2 for linear sections.
        With more derivatives as degrees of freedom it may be larger: a quintic axis takes ten times
        the coefficient of a cubic one, which suppresses the higher modes.
        """
        (m, k), N = self._along, self.section.number
        n = len(self.sampling.places("xx"))
        size = (1.0, "element") if k == 1 else (10.0 ** (m - 1), "beam")
        return (*(StabilisedMode(self._of_both(range(m), w), *size) for w in missed(m, n)),
                *(StabilisedMode(self._of_both(range(m + j, m + j + N * k, N), w), 1.0 / N)
                  for j in range(N) for w in missed(k, n)))

    def _of_both(self, rows: Sequence[int], weights: Array) -> Array:
        full = np.zeros((2, self.nodal_dofs))
        full[:, rows] = weights.reshape(2, -1)
        return full.ravel()

    @cached_property
    def halving(self) -> Array:
        """Matrix (2 nodal_dofs, 2 nodal_dofs) from an element to its left half, for unit length and
        height. Degrees of freedom are scaled by the length to the number of their derivatives along
        X. The last nodal_dofs rows are those of the middle."""
        n = self.axis_degree + 1, max(self.order, 1) + 1
        X = np.array(np.meshgrid(np.linspace(0, 1, n[0]), np.linspace(0, 1, n[1]))).reshape(2, -1)
        half = np.array([0.5 * X[0], X[1]])
        own, child = (self.local(P, 1.0)[0].T for P in (half, X))
        return np.linalg.lstsq(child, own, rcond=None)[0]

    # the reference configuration

    def fitted(self, mesh: MeshBeam) -> MeshBeam:
        """The mesh of a beam of this element: for a curved one with the element's ``sections``.

        Raises
        ------
        MeshError
            If it is curved and the axis and the sections of the element have different degrees.
        """
        if mesh.is_straight:
            return mesh
        refuse(self.section.number and self.axis_degree > 3 and self._along[0] != self._along[1],
               "{!r} is for straight meshes: use ElementBeamANCF or ElementBeamANCFHermite", self,
               error=MeshError)
        return mesh.with_sections(self.mesh_sections)

    @property
    def mesh_sections(self) -> str:
        """Interpolation of the sections of a curved mesh of this element."""
        return self.sections

    def rigid(self, mesh: MeshBeam) -> Array:
        """DOFs of the reference configuration except positions, (nodal_dofs, 2, nvertices).

        Raises
        ------
        MeshError
            If the mesh is curved and its ``sections`` are not those of the element.
        """
        of = self.mesh_sections
        refuse(mesh.sections != of and not mesh.is_straight, "the sections of {!r} are {}, those "
               "of the curved mesh {}: use mesh.with_sections({!r})", self, of, mesh.sections, of,
               error=MeshError)
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
        return f"<{type(self).__name__} of order {self.order}: {', '.join(self.dofnames)}>"
