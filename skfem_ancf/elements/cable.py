"""The shear-rigid cable: order 0 of the family."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, shown, teaching
from ..reference import hermite_basis
from .base import ElementBeam, SectionFunctions

if TYPE_CHECKING:
    from ..types import Array


@teaching
class ElementBeamCable(ElementBeam):
    """An axis without a section of its own: ``r`` and its derivatives along X only.

    Sections stay normal to the axis; the beam has the stiffnesses EA and EI, and its thickness
    follows from S_yy = 0. For slender scenes that ask for no more of the section.

    Parameters
    ----------
    degree
        Degree of the axis along X: 3 (coordinates ``r``, ``r_X``), 5 (``r_XX`` too; by far the
        most accurate for its cost) or 7 (``r_XXX`` too, on straight meshes only).

    Raises
    ------
    InputError
        If the degree is not 3, 5 or 7.

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
        if (isinstance(degree, bool) or not isinstance(degree, (int, np.integer))
                or degree not in (3, 5, 7)):
            raise InputError(f"the degree of a cable is 3, 5 or 7, got {shown(degree)}")
        self.axis_degree = int(degree)
        m = (self.axis_degree + 1) // 2
        super().__init__(SectionFunctions(np.zeros((1, 0))), [], [], [])
        self.functionals = tuple((0.0, k, 0) for k in range(m))
        self.dofnames = ["r"] + ["r_" + "X" * k for k in range(1, m)]
        self.nodal_dofs = m
        self.doflocs = np.repeat([[0.0, 0.5], [1.0, 0.5]], m, axis=0)
        self.maxdeg = self.axis_degree

    @property
    def strain_degree(self) -> int:
        return 2 * (self.axis_degree - 1)

    def axis(self, xi: Array, derivative: int) -> Array:
        """The 2 m Hermite functions of the axis, or a derivative of them by xi.

        Parameters
        ----------
        xi
            Points, of any shape (...).
        derivative
            Number of derivatives.

        Returns
        -------
        ndarray
            Shape (2 m,) + xi.shape, m coordinates a node.
        """
        return hermite_basis(self.nodal_dofs, xi, derivative)

    def local(self, X: Array, h: float, i: int) -> tuple[Array, Array, Array, int]:
        if not 0 <= i < 2 * self.nodal_dofs:
            self._index_error()
        value, slope = (self.axis(X[0], d)[i] for d in (0, 1))
        return value, slope, 0.0 * X[1], i % self.nodal_dofs
