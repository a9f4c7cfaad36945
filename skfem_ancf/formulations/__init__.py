"""Formulations: where strain components are sampled, and how the strain energy is integrated. A new
one is a file beside this one, with a class derived from :class:`Formulation`, and a line in
:data:`FORMULATIONS`."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from ..core import (Array, Immutable, Law, Rule, cached_property, gauss, product_rule, read_only,
                    refuse, require_like, require_not_negative, require_option, stress_of)
from ..elements.base import ElementBeam
from ..materials import LinearLaw, Material
from ..materials.history import AtRest
from ..mesh.mesh_beam import MeshBeam

COMPONENTS = ("xx", "yy", "xy")


@dataclass(frozen=True)
class Term:
    """One integral of the strain energy: ``int law(strain) dV`` over a product rule.

    Attributes
    ----------
    law
        Energy, stress and moduli as functions of the strain (3, ...).
    axis, section
        Points and weights on [0, 1] along the axis and across the section.
    samples
        For a strain component ("xx", "yy" or "xy") the points xi at which it is evaluated; it is
        interpolated by Lagrange polynomials. Other components are evaluated at the integration
        points.
    section_samples
        Points eta and a matrix (section points, points eta): the strain at a section point is
        this combination of the strains at the points eta. None to evaluate it there.
    """

    law: Law
    axis: Rule
    section: Rule
    samples: dict[str, tuple[float, ...]] = field(default_factory=dict)
    section_samples: Rule | None = None

    @cached_property
    def quadrature(self) -> Rule:
        """Points (2, n) and weights (n,) for scikit-fem's Basis."""
        X, W = product_rule(self.axis, self.section)
        return read_only(X), read_only(W)

    def nodes(self, component: str) -> Array:
        """Points along the axis where a component is sampled, shape (m,)."""
        return np.asarray(self.samples.get(component, self.axis[0]), dtype=float)

    @property
    def section_nodes(self) -> Array:
        """Points across the section where the strain is evaluated."""
        return np.asarray(self.section_samples[0] if self.section_samples else self.section[0])


def refuse_rigid_sections(element: ElementBeam, material: Material, law: Law) -> None:
    """Raise InputError for sections of order 1 of a material with a history."""
    refuse(isinstance(law, AtRest) and element.order == 1, "{} has a history, and sections of "
           "order 1, which cannot contract as they bend, would be 12 to 17 % too stiff with it: "
           "use order 2 or more, or a cable", type(material).__name__)


class Formulation(Immutable):
    """Base class of formulations; a subclass defines its name and :meth:`terms`.

    Other Parameters
    ----------------
    mesh, element, material, width
        Those of the beam.
    """

    name = ""

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        """The integrals of the strain energy, a list of :class:`Term`."""
        raise NotImplementedError(f"{type(self).__name__} has no terms: a formulation defines "
                                  "terms(element, material), a list of Term")

    def points_along(self, element: ElementBeam, material: Material) -> int:
        """Number of points along an element in the first of :meth:`terms`."""
        return len(self.terms(element, material)[0].axis[0])

    def stabilisation(self, mesh: MeshBeam, element: ElementBeam, material: Material,
                      width: float) -> Array | None:
        """A constant element stiffness (nelements or 1, 2 nb, 2 nb), or None. It is added to that
        of the terms, and must vanish for finite rigid motions of the reference configuration."""
        return None

    def stress(self, layer: Any, strain: Array, u: Array, X: Array,
               tind: Array | None) -> Array:
        """Second Piola-Kirchhoff stress for output, shape (3, nelements, npoints).

        The first term is evaluated at the points, the others where they are integrated: terms with
        one point along take the strain of the middle of the element, those with one point across
        that of the axis, those with section samples that of the section.

        Parameters
        ----------
        layer
            One layer of a beam, with ``terms`` and ``strain(term, u, X, tind, across)``.
        strain
            That of ``beam.strain(u, X, tind)``, shape (3, nelements, npoints).
        u
            Displacement of the degrees of freedom, shape (N,).
        X
            Reference points, (2, npoints) or (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.
        """
        first, *others = layer.terms
        total = stress_of(first.law, strain)
        for term in others:
            (xi, _), across, mean = term.axis, None, term.section_samples
            at = X if len(xi) > 1 else np.array([0.0 * X[0] + xi[0], X[1]])
            if mean is not None:
                across = mean[0], mean[1][0]
            elif len(term.section[0]) == 1:
                across = term.section
            total = total + stress_of(term.law, layer.strain(term, u, at, tind, across))
        return total

    @staticmethod
    def full_rules(element: ElementBeam, material: Material | None = None) -> tuple[Rule, Rule]:
        """Rules along the axis and across the section that integrate the energy exactly.

        They are exact for twice the degree of the strain (St. Venant-Kirchhoff):
        ``element.strain_degree`` along the axis of a straight element, and 2 N across the section.
        The rule across includes the width of sections that are not rectangles. A material with a
        history may ask for more points across.
        """
        require_like("element", element, "beam element", "strain_degree", "order")
        n = max(2 * element.order + 1, getattr(material, "points", 0))
        return gauss(element.strain_degree + 1), (
            element.across(n) if hasattr(element, "across") else gauss(n))

    def __repr__(self) -> str:
        return f"<formulation {self.name!r}>"


# enhanced continuum mechanics: the Poisson coupling acts on the axis only

#: The rule across the section that is the axis alone, with the weight of the whole section.
AXIS = (np.array([0.5]), np.array([1.0]))


def split_moduli(name: str, material: Material, element: ElementBeam) -> tuple[Array, Array]:
    """Moduli diag(E, E, k_s G) without Poisson coupling, and the rest of D, (3, 3) both."""
    require_like("material", material, "Material", "law")
    law: Any = material.law(material.shear_factor(element))
    refuse(not isinstance(law, LinearLaw) or isinstance(law, AtRest), "formulation {!r} needs "
           "constant moduli, which {} does not have: use StVenantKirchhoff, or another "
           "formulation", name, type(material).__name__)
    uncoupled = np.diag([material.E, material.E, law.D[2, 2]])
    return uncoupled, law.D - uncoupled


class EnhancedContinuum(Formulation):
    """U = 1/2 int eps : diag(E, E, k_s G) : eps dV + 1/2 int eps : (D - diag(E, E)) : eps h b dX.

    The second integral is over the axis. This avoids Poisson locking of sections without linear
    thickness strain, as those of order 1. See Gerstmayr, Matikainen, Mikkola: "A geometrically
    exact beam element based on the absolute nodal coordinate formulation", Multibody System
    Dynamics 20 (2008), for the split.
    """

    name = "ecm"

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        axis, section = self.full_rules(element)
        uncoupled, coupling = split_moduli(self.name, material, element)
        terms = [Term(LinearLaw(uncoupled), axis, section)]
        if np.any(coupling):  # not at nu = 0 in plane stress
            terms.append(Term(LinearLaw(coupling), axis, AXIS))
        return terms


class Continuum(Formulation):
    """U = int W(eps) dV with the Green-Lagrange strain of the interpolated position.

    References
    ----------
    "A series of locking-free beam element models in absolute nodal coordinate formulation",
    Archive of Applied Mechanics (2024).
    """

    name = "continuum"

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        require_like("material", material, "Material", "law")
        require_like("element", element, "beam element", "strain_degree", "order")
        law = material.law(material.shear_factor(element))
        refuse_rigid_sections(element, material, law)
        return [Term(law, *self.full_rules(element, material))]


# the strain split method: Poisson coupling of the axial strain only

class StrainSplit(EnhancedContinuum):
    """eps = a + s with a = eps(X, 0): stress D a + diag(E, E, k_s G) s.

    The energy is 1/2 int (a : D : a + 2 a : D : s + s : D_0 : s) dV with D_0 = diag(E, E, k_s G).
    Its derivative by s is the stress of the method. Its derivative by a is D (a + s) instead of the
    same stress: the difference, the Poisson coupling of the mean of s, is of second order and makes
    the tangent symmetric. With D_0 in the middle term it would be "ecm". See Patel, Shabana:
    "Locking alleviation in the large displacement analysis of beam elements: the strain split
    method", Acta Mechanica 229 (2018).
    """

    name = "strain-split"

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        axis, section = self.full_rules(element)
        uncoupled, coupling = split_moduli(self.name, material, element)
        if not np.any(coupling):
            return [Term(LinearLaw(uncoupled), axis, section)]
        eta, w = section
        # a : C : s + 1/2 a : C : a = 1/2 m : C : m - 1/2 (m - a) : C : (m - a), m the mean
        mean = (eta, w[None])
        places, of = np.unique(np.append(eta, 0.5), return_inverse=True)
        rest = (places, np.bincount(of, np.append(w, -1.0))[None])
        return [Term(LinearLaw(uncoupled), axis, section),
                Term(LinearLaw(coupling), axis, AXIS, section_samples=mean),
                Term(LinearLaw(-coupling), axis, AXIS, section_samples=rest)]


#: Poisson ratio in plane strain to which linear sections take laws that are not split.
NEAR = 0.4


class Assumed(Formulation):
    """Strain components sampled where the interpolation represents pure bending exactly.

    A cubic axis cannot keep ``|r_X|`` constant in bending, and linearly interpolated sections get
    thinner between rotated nodes. Both parasitic strains vanish at the sampling points, between
    which the strain is interpolated, so the error does not depend on the slenderness. The element
    defines the points in :attr:`~skfem_ancf.elements.ElementBeam.sampling`: linear sections use
    eps_xx and eps_xy at two Gauss points and eps_yy at the nodes; cubic sections eps_xx at two
    Gauss points, eps_xy and eps_yy at xi = 0, 1/2, 1, with three Gauss points of integration.

    Modes that the samples miss are stabilised by ``1/2 k L |c|^2``, with c and k from
    :attr:`~skfem_ancf.elements.ElementBeam.stabilised`: for a cubic axis
    ``c = (r_X1 + r_X2) / 2 - (r_2 - r_1) / L`` and k = E I / L^2 (10 E I / l^2 with cubic sections,
    l the length of the beam, which keeps their order). On a curved reference configuration
    ``beta (r_2 - r_1) / L`` is subtracted from c, with the complex number beta for which c vanishes
    there: the term is objective and quadratic, and its matrix is constant. A cubic cable has a
    third integration point instead, with the small weight ``alpha * 1200 E I / (E A l^2)``, at most
    4/9, that of three Gauss points.

    In plane strain, linear sections of order 2 and more integrate the volumetric part of the law
    (:meth:`~skfem_ancf.materials.base.Material.volumetric_split`) with one point (selective reduced
    integration), against volumetric locking as nu goes to 1/2. The stress has the volumetric part
    of the element's middle. Sections of order 1 have no linear thickness strain: for laws with
    constant moduli the Poisson coupling acts on the mean strain of the section.

    Parameters
    ----------
    alpha
        Factor on the stabilisation, and for cubic cables on the weight of the third point.
    """

    name = "assumed"

    def __init__(self, alpha: float = 1.0) -> None:
        self.alpha = require_not_negative("alpha", alpha, False)

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        _, section = self.full_rules(element, material)
        sampling = element.sampling
        axis, samples = gauss(sampling.points), sampling.samples
        require_like("material", material, "Material", "law")
        factor = material.shear_factor(element)
        law = material.law(factor)
        whole = Term(law, axis, section, samples)
        locks = isinstance(law, AtRest) and material.plane == "strain" and material.nu > NEAR
        refuse(locks and element.order > 0 and sampling.volume, "{} has a history, and linear "
               "sections lock in plane strain as nu goes to 1/2, by 2 % at {:g}: nu is {:g}. Use "
               "ElementBeamANCFCubic(2), or a cable", type(material).__name__, NEAR, material.nu)
        if element.order > 1:
            laws = material.volumetric_split(factor) if sampling.volume else None
            if laws is None:
                return [whole]
            # the volumetric term has few points along the axis
            points = tuple(axis[0])
            return [Term(laws[0], axis, section, samples),
                    Term(laws[1], gauss(sampling.volume), section,
                         {"xx": points, "xy": points, **samples})]
        refuse_rigid_sections(element, material, law)
        if not isinstance(law, LinearLaw) or isinstance(law, AtRest):
            return [whole]
        uncoupled, coupling = split_moduli(self.name, material, element)
        if material.plane == "strain":  # a bent section is as stiff as E / (1 - nu^2)
            more = np.diag([1.0, 1.0, 0.0]) * material.E * material.nu**2 / (1.0 - material.nu**2)
            uncoupled, coupling = uncoupled + more, coupling - more
        if not np.any(coupling):
            return [whole]
        mean = (section[0], section[1][None])
        return [Term(LinearLaw(uncoupled), axis, section, samples),
                Term(LinearLaw(coupling), axis, AXIS, samples, mean)]

    def points_along(self, element: ElementBeam, material: Material) -> int:
        if type(self).terms is not Assumed.terms:  # of a subclass
            return super().points_along(element, material)
        return element.sampling.points

    def stabilisation(self, mesh: MeshBeam, element: ElementBeam, material: Material,
                      width: float) -> Array | None:
        if not element.stabilised:
            return None
        straight, n = mesh.is_straight, element.nodal_dofs
        L = mesh.lengths[:1 if mesh.is_uniform else None]
        EI = material.E * width * mesh.height**3 / 12.0
        along = element.powers(1.0, L[:, None]) / L[:, None]
        if not straight:  # plane vectors as complex numbers
            x, y = element.rigid(mesh).swapaxes(0, 1)
            z = x + 1j * y
            z[0] = mesh.p[0] + 1j * mesh.p[1]
            z = z[:, mesh.t].swapaxes(0, 1).reshape(2 * n, -1).T
            chord = z[:, n] - z[:, 0]
        weights, sizes, per = zip(*element.stabilised)
        lengths = {"element": L, "beam": mesh.chain_lengths[:len(L)], "": 1.0 + 0.0 * L}
        k = self.alpha * EI * np.array(sizes)[:, None] * np.array([
            L / lengths[name]**2 for name in per])
        c = np.array(weights)[:, None] * along  # of each mode and element
        if not straight:
            turned = np.sum(c * z, axis=2) / chord
            c = c + 0j
            c[..., 0] += turned
            c[..., n] -= turned
        K = (k[..., None] * c.conj()).transpose(1, 2, 0) @ c.swapaxes(0, 1)
        out = np.zeros((len(L), 2 * n, 2, 2 * n, 2))
        out[:, :, 0, :, 0] = out[:, :, 1, :, 1] = K.real
        if not straight:
            out[:, :, 1, :, 0] = turning = 0.5 * (K.imag - K.imag.swapaxes(1, 2))
            out[:, :, 0, :, 1] = -turning
        return out.reshape(len(L), 4 * n, 4 * n)


#: The formulations by name, and a function that makes one once.
FORMULATIONS = {cls.name: cls for cls in (Continuum, EnhancedContinuum, StrainSplit, Assumed)}
_MADE: Any = cache(lambda kind: kind())


def get_formulation(formulation: str | Formulation | type[Formulation]) -> Formulation:
    """A :class:`Formulation` from its name, its class or itself; NameUnknown for another name."""
    if isinstance(formulation, Formulation):
        return formulation
    if isinstance(formulation, type) and issubclass(formulation, Formulation):
        return formulation()
    return _MADE(FORMULATIONS[require_option("formulation", formulation, FORMULATIONS)])


__all__ = ["COMPONENTS", "FORMULATIONS", "Assumed", "Continuum", "EnhancedContinuum",
           "Formulation", "StrainSplit", "Term", "get_formulation"]
