"""ANCF beam elements of any odd degree along the axis."""

from __future__ import annotations

from ..core.immutable import ours
from .ancf import ElementBeamANCF
from .base import DEGREES, ElementBeam, require_degree


class ElementBeamANCFHermite(ElementBeamANCF):
    """:class:`ElementBeamANCF` with axis and section slopes of any odd degree (Hermite) along X.

    The degrees of freedom of a node are ``r`` and the section slopes ``r_Y0`` ..., with their
    derivatives along the axis up to order (degree - 1) / 2: for degree 5 ``r``, ``r_X``, ``r_XX``,
    ``r_Y0`` ..., ``r_XY0`` ..., ``r_XXY0`` .... The space is the product of polynomials of that
    degree in X and of degree N in Y. One or two elements of degree 9 and more replace many cubic
    ones where loads and section are smooth; put nodes where the shear force jumps.

    Parameters
    ----------
    order
        Degree N >= 1 of the section.
    degree
        Degree along X: 3, 5, ... 15.
    points
        Points of the section slopes, as for :class:`ElementBeamANCF`.

    Raises
    ------
    InputError
        If the order is not an integer >= 1, or the degree is not odd or not from 3 to 15.
    NameUnknown
        If the family of points is not known.

    Examples
    --------
    >>> from skfem_ancf import ElementBeamANCFHermite
    >>> ElementBeamANCFHermite(1, degree=5).dofnames
    ['r', 'r_X', 'r_XX', 'r_Y0', 'r_XY0', 'r_XXY0']
    """

    def __init__(self, order: int, degree: int = 5, points: str = "chebyshev") -> None:
        self._slopes, self._points = require_degree(degree) // 2, points
        super().__init__(order, points)

    def raised(self) -> ElementBeamANCFHermite | None:
        # ElementBeamANCFCubic belongs to this family; user-defined subclasses do not
        if not ours(self) or self.axis_degree == DEGREES[-1]:
            return None
        return ElementBeamANCFHermite(self.order, self.axis_degree + 2, self._points)

    def plane(self) -> ElementBeam | None:
        return ElementBeamANCFHermite(1, self.axis_degree) if ours(self) else None

    def _coordinates(self) -> tuple[list[str], list[tuple[float, int, int]]]:
        names, functionals = super()._coordinates()
        more = range(2, self._slopes + 1)
        each = range(self._slopes + 1)
        return (["r_" + "X" * k for k in more]
                + [name.replace("r_", "r_" + "X" * k) for k in each for name in names],
                [(0.0, k, 0) for k in more]
                + [(eta, k, m) for k in each for eta, _, m in functionals])


# ANCF beam elements whose sections vary cubically along the axis: fourth order

class ElementBeamANCFCubic(ElementBeamANCFHermite):
    """:class:`ElementBeamANCF` with section slopes that are cubic (Hermite) along X.

    The degrees of freedom of a node are ``r``, ``r_X``, the section slopes ``r_Y0`` ... and their
    derivatives along the axis ``r_XY0`` ...: the space is the product of cubic polynomials in X and
    polynomials of degree N in Y. With the formulation "assumed" the deflection converges at fourth
    order, at any slenderness. Parameters and errors are those of :class:`ElementBeamANCF`.

    Examples
    --------
    >>> from skfem_ancf import ElementBeamANCFCubic
    >>> ElementBeamANCFCubic(2).dofnames
    ['r', 'r_X', 'r_Y0', 'r_Y1', 'r_XY0', 'r_XY1']
    """

    def __init__(self, order: int, points: str = "chebyshev") -> None:
        super().__init__(order, 3, points)
