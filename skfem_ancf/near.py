"""What single points ask of one element in one state: polynomials, evaluated by numbers."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .formulations import Formulation
from .kernels.along import from_first_node
from .kernels.cable import curvature, extension
from .kept import kept
from .point import AGAIN
from .series import along, polynomials

if TYPE_CHECKING:
    from .beam import Beam
    from .formulations.base import Term
    from .point import Point
    from .types import Array, Rule

#: Elements of which a beam keeps what no state changes.
ELEMENTS = 4096


class NearSections:
    """The fields of the elements in one of them, for sections with coordinates of their own.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    e
        The element.
    u_e
        Displacements of its coordinates, shape (2, nb).
    """

    def __init__(self, beam: Beam, e: int, u_e: Array) -> None:
        self._beam, self._e, self._u_e = beam, e, u_e
        self._first = beam.strain_of(beam.terms[0])
        self._polynomials = {id(self._first): self._first.polynomials(e, u_e)}
        self._sections: dict[Any, Any] = {}
        self._by_formulation = (beam.across.plain
                                and type(beam.formulation).stress is Formulation.stress)

    def strain(self, point: Point) -> list[float]:
        """The strain (eps_xx, eps_yy, 2 eps_xy).

        Parameters
        ----------
        point
            A point of the element.
        """
        table = point.strain_table
        if not table:
            new = self._first.at(*point.place)
            table, point.strain_table = new, AGAIN if table is None else new
        return table(self._polynomials[id(self._first)])

    def stress(self, point: Point) -> Array | None:
        """The stress (S_xx, S_yy, S_xy), shape (3,); None where only many points have it.

        Parameters
        ----------
        point
            A point of the element.
        """
        if not self._by_formulation:
            return None
        return self._beam.formulation.stress_of(self._beam, partial(self._strain, point))

    def _strain(self, point: Point, term: Term, xi: float | None = None,
                across: Rule | None = None) -> Array:
        """As :meth:`Beam.strains <skfem_ancf.Beam.strains>`, of one point."""
        if xi is None and across is None and term is self._beam.terms[0]:
            return np.array(self.strain(point))
        of = self._beam.strain_of(term, getattr(term.law, "rows", (0, 1, 2)))
        polynomials = self._polynomials.get(id(of))
        if polynomials is None:
            polynomials = self._polynomials[id(of)] = of.polynomials(self._e, self._u_e)
        e, x, y = point.place
        if across is None:
            return np.array(of.at(e, x if xi is None else xi, y)(polynomials))
        key = id(of), across[0].tobytes(), across[1].tobytes()
        sections = self._sections.get(key)
        if sections is None:
            sections = self._sections[key] = of.sections(e, polynomials, across)
        return np.array(sections(x if xi is None else xi))


class NearCable:
    """As :class:`NearSections`, of a cable.

    Parameters
    ----------
    beam, e, u_e
        As there, u_e of shape (2, nb).
    """

    def __init__(self, beam: Beam, e: int, u_e: Array) -> None:
        self._beam = beam
        slopes, start = kept(beam.touched, ("slopes", e), lambda: _slopes(beam, e), ELEMENTS)
        # both derivatives of the displacement, then of the stress-free axis, both components
        self._polynomials = np.concatenate([_derived(slopes, u_e), start])

    def strain(self, point: Point) -> list[float]:
        """The strain (eps_xx, eps_yy, 2 eps_xy).

        Parameters
        ----------
        point
            A point of the element.
        """
        beam, (e, xi, eta) = self._beam, point.place
        T = np.array(polynomials(xi, self._polynomials.shape[1]))
        da0, da1, db0, db1, x, y, bx, by = self._polynomials.dot(T).tolist()
        square0, a0, a1 = x * x + y * y, x + da0, y + da1
        square = a0 * a0 + a1 * a1
        kappa = (curvature(a0, a1, bx + db0, by + db1, square)
                 - curvature(x, y, bx, by, square0))
        eps = extension(a0, a1, da0, da1, square**0.5, square0**0.5)
        slabs = beam.across.slabs
        slab = slabs[0 if len(slabs) == 1 else beam.across.which(
            np.array([[xi], [eta]]), np.array([e])).item()]
        return fibre(beam.mesh.mapping().lever(*point.place), eps, kappa,
                     slab.material.lateral_ratio)

    def stress(self, point: Point) -> Array | None:
        """The stress (S_xx, S_yy, S_xy), shape (3,); None where only many points have it.

        Parameters
        ----------
        point
            A point of the element.
        """
        if not self._beam.across.plain:
            return None
        modulus = self._beam.across.slabs[0].material.axial_modulus
        return np.array([modulus * self.strain(point)[0], 0.0, 0.0])


def _slopes(beam, e):
    """Of one element of a cable both derivatives of its functions, and of its stress-free axis.

    Coefficients of Chebyshev polynomials of 2 xi - 1: shapes (p, 2, nb) and (4, p).
    """
    length, mesh, element = beam.mesh.lengths[e], beam.mesh, beam.element
    scales = beam.scales[e] / length ** np.array([[1], [2]])
    slopes = scales * np.stack([along(partial(element.axis, derivative=d), element.axis_degree)
                                for d in (1, 2)]).transpose(2, 0, 1)
    dofs = mesh.t[0, e] * beam.nd + beam.rows
    start = _derived(slopes, beam.q0_local[dofs])
    if mesh.is_straight:
        start[2:] = 0.0
    return slopes, start


def _derived(slopes, q):
    """Both derivatives of the axis, both components, (4, p), for coordinates (2, nb)."""
    return (slopes @ from_first_node(q.T)).reshape(-1, 4).T


def fibre(Y: Any, eps: Any, kappa: Any, ratio: Any) -> list[Any]:
    """The strain (eps_xx, eps_yy, 2 eps_xy) of a fibre of a section that stays normal to its axis.

    Parameters
    ----------
    Y
        Distance from the axis: a number, or an array of any shape, as the others.
    eps, kappa
        Extension of the axis and change of its curvature.
    ratio
        Minus the strain across the fibre over that along it.
    """
    e = eps - Y * kappa
    xx = e + 0.5 * e * e
    return [xx, -ratio * xx, 0.0 * xx]
