"""The shear-rigid cable element, order 0 of the family."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..core.types import Array
from ..mesh.reference_cell import SECTIONS, hermite_basis
from .base import DEGREES, ElementBeam, Sampling, SectionFunctions, StabilisedMode, require_degree


class ElementBeamCable(ElementBeam):
    """Axis element: ``r`` and its derivatives along X are the degrees of freedom.

    Sections stay plane and normal to the axis. The stiffnesses are EA and EI; the thickness follows
    from S_yy = 0. Use it for slender beams.

    N = EA (stretch - 1) and M = EI (change of curvature) at any deformation: the nominal stress in
    a fibre is E (stretch - 1), or E / (1 - nu^2) times the same in plane strain. Output is the
    Green-Lagrange strain eps_xx = (stretch^2 - 1) / 2 and the second Piola-Kirchhoff stress S_xx =
    E (stretch - 1) / stretch.

    Parameters
    ----------
    degree
        Degree of the axis along X: 3 (``r``, ``r_X``), 5 (and ``r_XX``; the best for frames and
        point loads), 7, ... 15 (derivatives up to order (degree - 1) / 2). One or two elements of
        degree 9 and more replace many where the loads are smooth.

    Raises
    ------
    InputError
        If the degree is not odd, or not from 3 to 15.

    References
    ----------
    Berzeri, Shabana: "Development of simple models for the elastic forces in the absolute nodal
    co-ordinate formulation", Journal of Sound and Vibration 235 (2000); Gerstmayr, Irschik: "On
    the correct representation of bending and axial deformation in the absolute nodal coordinate
    formulation with an elastic line approach", Journal of Sound and Vibration 318 (2008).

    Examples
    --------
    >>> from skfem_ancf import ElementBeamCable
    >>> ElementBeamCable().dofnames, ElementBeamCable(5).dofnames
    (['r', 'r_X'], ['r', 'r_X', 'r_XX'])
    """

    order = 0
    kinematics = "cable"
    carries_shear_parabola = False

    def __init__(self, degree: int = 3) -> None:
        m = (require_degree(degree) + 1) // 2
        super().__init__(SectionFunctions(np.zeros((1, 0))), ["r_" + "X" * k for k in range(2, m)],
                         [(0.0, k, 0) for k in range(2, m)], [])
        self.maxdeg = self.axis_degree

    def raised(self) -> ElementBeamCable | None:
        if type(self) is not ElementBeamCable or self.axis_degree == DEGREES[-1]:
            return None
        return ElementBeamCable(self.axis_degree + 2)

    @property
    def strain_degree(self) -> int:
        # |r_X| and the curvature are not polynomials: one point for each Hermite function
        return self.axis_degree

    @property
    def mesh_sections(self) -> str:
        # an axis of degree 5 has all that is known of a curved mesh whose axis is cubic
        return "linear" if self.axis_degree < 7 else SECTIONS[self.nodal_dofs - 1]

    def axis(self, xi: Array, derivative: int) -> Array:
        """The Hermite functions of the axis, or a derivative by xi, (2 m,) + xi.shape.

        Parameters
        ----------
        xi
            Points, of any shape (...).
        derivative
            Order of the derivative.
        """
        return hermite_basis(self.nodal_dofs, xi, derivative)

    @cached_property
    def sampling(self) -> Sampling:
        return Sampling(self.axis_degree - 1, {})

    @property
    def stabilised(self) -> tuple[StabilisedMode, ...]:
        # the mode that a higher degree misses in one element is resisted where two meet, and that
        # of the cubic axis by a third point
        return ()
