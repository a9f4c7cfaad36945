"""ANCF beam elements whose sections vary cubically along the axis: fourth order."""

from .hermite import ElementBeamANCFHermite


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
