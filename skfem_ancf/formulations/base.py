"""Formulations: the base class, and the integrals that they consist of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core import (Array, Immutable, InputError, Law, Rule, cached_property, gauss, lagrange,
                    product_rule, read_only, require_like, stress_of)
from ..elements.base import ElementBeam
from ..materials.base import Material
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

    def matrix(self, component: str) -> Array | None:
        """Interpolation matrix from samples to integration points; None for the identity."""
        sampled = component in self.samples
        if not sampled and self.section_samples is None:
            return None
        xi = self.axis[0]
        along = lagrange(self.samples[component], xi) if sampled else np.eye(len(xi))
        across = self.section_samples[1] if self.section_samples else np.eye(len(self.section[0]))
        both = along[:, None, :, None] * across[:, None]
        return both.reshape(len(along) * len(across), -1)


def refuse_rigid_sections(element: ElementBeam, material: Material, law: Law) -> None:
    """Raise InputError for sections of order 1 of a material with a history."""
    if isinstance(law, AtRest) and element.order == 1:
        raise InputError(
            f"{type(material).__name__} has a history, and sections of order 1, which cannot "
            "contract as they bend, would be 12 to 17 % too stiff with it: use order 2 or more, or "
            "a cable")


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
        """A constant element stiffness (nelements or 1, 2 nb, 2 nb), or None.

        It is added to that of the terms, and must vanish for finite rigid motions of the reference
        configuration.
        """
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
