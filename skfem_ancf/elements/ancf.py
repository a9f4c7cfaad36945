"""The ANCF elements of order N, of all degrees along the axis, the cable, and a choice of them."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from ..core import (Array, gauss_lobatto, hermite_basis, is_builtin, read_only, refuse,
                    require_integer, require_like, require_names, require_option, require_positive)
from ..mesh.mesh_beam import MeshBeam
from ..mesh.mapping import SECTIONS
from .base import DEGREES, ElementBeam, Sampling, SectionFunctions, require_degree

POINT_FAMILIES = {
    # both ends of the interval, and the zeros of the Chebyshev polynomial T_{n-2}; sines instead of
    # cosines: exactly antisymmetric
    "chebyshev": lambda n: np.concatenate([
        [-1.0], np.sin(np.arange(3 - n, n - 2, 2) * np.pi / (2 * (n - 2))), [1.0]]),
    "gauss-lobatto": gauss_lobatto,
    "equispaced": lambda n: np.linspace(-1.0, 1.0, n),
}


class ElementBeamANCF(ElementBeam):
    """Beam element with position, axis slope and N section slopes at each node.

    The position is cubic along the axis and a polynomial of degree N across the section, whose
    derivative ``r_Y`` is interpolated at N points from bottom to top. Order 1 is the element of
    Omar and Shabana, order 2 that of Zheng. Raises InputError if the order is not an integer >= 1,
    NameUnknown if the family of points is not known. See "A series of locking-free beam element
    models in absolute nodal coordinate formulation", Archive of Applied Mechanics (2024), section
    2.

    Parameters
    ----------
    order
        Degree N >= 1 of the section.
    points
        Points of the section slopes: "chebyshev" (both faces and the zeros of T_{N-2}),
        "gauss-lobatto" or "equispaced". The space is the same, only the degrees of freedom differ.

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
        n = require_integer("the order of an ANCF beam element", order, 1, 64,
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

    Its space is that of :class:`ElementBeamANCF` of order 2, with other degrees of freedom. See
    Patel, Shabana: "Locking alleviation in the large displacement analysis of beam elements: the
    strain split method", Acta Mechanica 229 (2018).

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
    ones where loads and section are smooth; put nodes where the shear force jumps. Raises
    InputError if the order is not an integer >= 1, or the degree is not odd or not from 3 to 15,
    NameUnknown if the family of points is not known.

    Parameters
    ----------
    order
        Degree N >= 1 of the section.
    degree
        Degree along X: 3, 5, ... 15.
    points
        Points of the section slopes, as for :class:`ElementBeamANCF`.

    Examples
    --------
    >>> from skfem_ancf import ElementBeamANCFHermite
    >>> ElementBeamANCFHermite(1, degree=5).dofnames
    ['r', 'r_X', 'r_XX', 'r_Y0', 'r_XY0', 'r_XXY0']
    """

    def __init__(self, order: int, degree: int = 5, points: str = "chebyshev") -> None:
        self._slopes, self._points = require_degree(degree) // 2, points
        super().__init__(order, points)

    def raised(self) -> "ElementBeamANCFHermite | None":
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


class ElementBeamCable(ElementBeam):
    """Axis element: ``r`` and its derivatives along X are the degrees of freedom.

    Sections stay plane and normal to the axis. The stiffnesses are EA and EI; the thickness follows
    from S_yy = 0. Use it for slender beams.

    N = EA (stretch - 1) and M = EI (change of curvature) at any deformation: the nominal stress in
    a fibre is E (stretch - 1), or E / (1 - nu^2) times the same in plane strain. Output is the
    Green-Lagrange strain eps_xx = (stretch^2 - 1) / 2 and the second Piola-Kirchhoff stress S_xx =
    E (stretch - 1) / stretch. Raises InputError if the degree is not odd, or not from 3 to 15.

    Parameters
    ----------
    degree
        Degree of the axis along X: 3 (``r``, ``r_X``), 5 (and ``r_XX``; the best for frames and
        point loads), 7, ... 15 (derivatives up to order (degree - 1) / 2). One or two elements of
        degree 9 and more replace many where the loads are smooth.

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
    #: The mode that a higher degree misses in one element is resisted where two meet, and that of
    #: the cubic axis by a third point.
    stabilised = ()

    def __init__(self, degree: int = 3) -> None:
        m = (require_degree(degree) + 1) // 2
        super().__init__(SectionFunctions(np.zeros((1, 0))), ["r_" + "X" * k for k in range(2, m)],
                         [(0.0, k, 0) for k in range(2, m)], [])
        self.maxdeg = self.axis_degree

    def raised(self) -> "ElementBeamCable | None":
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


#: Least order for a field of the section; 0 is the cable.
ORDER_OF_FIELD = {"displacement": 0, "eps_xx": 0, "S_xx": 0, "eps_yy": 2, "eps_xy": 3, "S_yy": 5,
                  "S_xy": 3}


def choose_element(mesh: MeshBeam, material: Any, fields: str | Sequence[str] = (),
                   tolerance: float = 1e-3) -> ElementBeam:
    """The element of lowest order that represents the fields to a given accuracy.

    The error of a beam theory is a power of h / L, with L the length of the beam. The cable omits
    shear, ``3 E I / (k_s G A L^2)`` of the deflection of a cantilever. A section of order 1 or 2
    omits warping, about ``(h / L)^2 / 10``. Order 3 represents the shear parabola, with an error of
    order ``(h / L)^3``. The result is a quintic cable, or has cubic sections, or linear ones on a
    beam shorter than 20 heights. Raises NameUnknown if a field is not known.

    Parameters
    ----------
    mesh, material
        Mesh and material of the beam.
    fields
        Fields of the section that are needed: names from :data:`ORDER_OF_FIELD`.
    tolerance
        Relative error of the deflection due to the theory, without the discretisation error.
    """
    require_like("mesh", mesh, "MeshBeam", "height", "lengths")
    require_like("material", material, "Material", "E", "G", "nu")
    fields = require_names("field", fields, ORDER_OF_FIELD)
    tolerance = require_positive("tolerance", tolerance)
    refuse(tolerance >= 1.0, "the tolerance is relative and below 1, got {!r}", tolerance)
    ratio = mesh.height / float(mesh.lengths.sum())
    k_s = 10.0 * (1.0 + material.nu) / (12.0 + 11.0 * material.nu)
    shear = 0.25 * material.E / (k_s * material.G) * ratio**2
    wanted = max((ORDER_OF_FIELD[name] for name in fields), default=0)
    enough = (0 if shear <= tolerance else 2 if 0.1 * ratio**2 <= tolerance else
              3 if ratio**3 <= tolerance else 5)
    if not material.is_hooke:  # a cable uses E and nu only
        wanted = max(wanted, 2)
    order = max(wanted, enough)
    if order == 0:
        return ElementBeamCable(5)
    return ElementBeamANCFCubic(order) if ratio < 0.05 else ElementBeamANCF(order)
