"""The ANCF beam elements of order N, of all degrees along the axis."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from ..core.errors import require_integer, require_option
from ..core.immutable import is_builtin, read_only
from ..core.quadrature import gauss_lobatto
from ..core.types import Array
from .base import DEGREES, ElementBeam, SectionFunctions, require_degree


def _chebyshev(n: int) -> Array:
    """Both ends of the interval, and the zeros of the Chebyshev polynomial T_{n-2}."""
    m = n - 2  # sines instead of cosines: exactly antisymmetric
    return np.concatenate([[-1.0], np.sin(np.arange(1 - m, m, 2) * np.pi / (2 * m)), [1.0]])


#: Largest degree of a section.
MAX_ORDER = 64

POINT_FAMILIES = {
    "chebyshev": _chebyshev,
    "gauss-lobatto": gauss_lobatto,
    "equispaced": lambda n: np.linspace(-1.0, 1.0, n),
}


class ElementBeamANCF(ElementBeam):
    """Beam element with position, axis slope and N section slopes at each node.

    The position is cubic along the axis and a polynomial of degree N across the section, whose
    derivative ``r_Y`` is interpolated at N points from bottom to top. Order 1 is the element of
    Omar and Shabana, order 2 that of Zheng.

    Parameters
    ----------
    order
        Degree N >= 1 of the section.
    points
        Points of the section slopes: "chebyshev" (both faces and the zeros of T_{N-2}),
        "gauss-lobatto" or "equispaced". The space is the same, only the degrees of freedom differ.

    Raises
    ------
    InputError
        If the order is not an integer >= 1.
    NameUnknown
        If the family of points is not known.

    References
    ----------
    "A series of locking-free beam element models in absolute nodal coordinate formulation",
    Archive of Applied Mechanics (2024), section 2.

    Examples
    --------
    >>> from skfem import Basis, ElementVector
    >>> from skfem_ancf import ElementBeamANCF, MeshBeam
    >>> element = ElementBeamANCF(3)
    >>> element.dofnames
    ['r', 'r_X', 'r_Y0', 'r_Y1', 'r_Y2']
    >>> int(Basis(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementVector(element)).N)
    30
    """

    def __init__(self, order: int, points: str = "chebyshev") -> None:
        n = require_integer("the order of an ANCF beam element", order, 1, MAX_ORDER,
                            "polynomials of a higher degree have no digits left")
        require_option("family of section points", points, POINT_FAMILIES)
        x = np.zeros(1) if n == 1 else (
            np.array([-1.0, 1.0]) if n == 2 else POINT_FAMILIES[points](n))
        self.section_points = read_only(0.5 * x)
        functions = SectionFunctions(np.linalg.inv(legendre.legvander(x, n - 1)))
        names, functionals = self._coordinates()
        super().__init__(functions, names, functionals, [f"r_Y{k}" for k in range(n)])

    def plane(self) -> ElementBeam | None:
        return ElementBeamANCF(1) if is_builtin(self) else None

    def _coordinates(self) -> tuple[list[str], list[tuple[float, int, int]]]:
        return ([f"r_Y{k}" for k in range(len(self.section_points))],
                [(float(y), 0, 1) for y in self.section_points])


# the element of Patel and Shabana

class ElementBeamPatelShabana(ElementBeam):
    """Beam element with ``r``, ``r_X``, ``r_Y`` and ``r_YY`` on the axis.

    Its space is that of :class:`ElementBeamANCF` of order 2, with other degrees of freedom.

    References
    ----------
    Patel, Shabana: "Locking alleviation in the large displacement analysis of beam elements:
    the strain split method", Acta Mechanica 229 (2018).

    Examples
    --------
    >>> from skfem_ancf import ElementBeamPatelShabana
    >>> ElementBeamPatelShabana().dofnames
    ['r', 'r_X', 'r_Y', 'r_YY']
    """

    def __init__(self) -> None:
        # P' = 1 for r_Y, and P' = eta for h r_YY: legendre coefficients in 2 eta
        super().__init__(SectionFunctions(np.array([[1.0, 0.0], [0.0, 0.5]])),
                         ["r_Y", "r_YY"], [(0.0, 0, 1), (0.0, 0, 2)], ["r_Y", "r_YY"])

    def plane(self) -> ElementBeam | None:
        return ElementBeamANCF(1) if is_builtin(self) else None


# ANCF beam elements of any odd degree along the axis

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
        if not is_builtin(self) or self.axis_degree == DEGREES[-1]:
            return None
        return ElementBeamANCFHermite(self.order, self.axis_degree + 2, self._points)

    def plane(self) -> ElementBeam | None:
        return ElementBeamANCFHermite(1, self.axis_degree) if is_builtin(self) else None

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
