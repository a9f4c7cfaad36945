"""Assumed strain, free of membrane and curvature-thickness locking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError, require_finite_scalar, require_like
from ..core.quadrature import gauss
from ..core.types import Array
from ..elements.base import ElementBeam
from ..materials import LinearLaw
from ..materials.base import Material
from ..materials.history import AtRest
from ..mesh.mesh_beam import MeshBeam
from .base import AXIS, Formulation, Term, refuse_rigid_sections, split_moduli


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
        self.alpha = require_finite_scalar("alpha", alpha)
        if self.alpha < 0.0:
            raise InputError(f"alpha must not be negative, got {alpha!r}")

    def terms(self, element: ElementBeam, material: Material) -> Sequence[Term]:
        _, section = self.full_rules(element, material)
        sampling = element.sampling
        axis, samples = gauss(sampling.points), sampling.samples
        require_like("material", material, "Material", "law")
        factor = material.shear_factor(element)
        law = material.law(factor)
        whole = Term(law, axis, section, samples)
        locks = isinstance(law, AtRest) and material.plane == "strain" and material.nu > NEAR
        if locks and element.order > 0 and sampling.volume:
            raise InputError(
                f"{type(material).__name__} has a history, and linear sections lock in plane "
                f"strain as nu goes to 1/2, by 2 % at {NEAR:g}: nu is {material.nu:g}. Use "
                "ElementBeamANCFCubic(2), or a cable")
        if element.order > 1:
            return self._volumetric_apart(whole, element, material, factor) or [whole]
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

    @staticmethod
    def _volumetric_apart(whole: Term, element: ElementBeam, material: Material,
                          factor: float) -> list[Term] | None:
        """The term split in two, the volumetric one with few points along the axis; or None."""
        volume = element.sampling.volume
        laws = material.volumetric_split(factor) if volume else None
        if laws is None:
            return None
        points = tuple(whole.axis[0])
        samples = {"xx": points, "xy": points, **whole.samples}
        return [Term(laws[0], whole.axis, whole.section, whole.samples),
                Term(laws[1], gauss(volume), whole.section, samples)]

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
        K = np.zeros((len(L), 2 * n, 2 * n), float if straight else complex)
        for mode in element.stabilised:
            c = mode.weights * along
            of = L if mode.per == "element" else mesh.chain_lengths[:len(L)] if mode.per else 1.0
            k = self.alpha * mode.size * EI / of**2 * L
            if not straight:
                turned = np.sum(c * z, axis=1) / chord
                c = c + 0j
                c[:, 0] += turned
                c[:, n] -= turned
            K += (k[:, None] * c.conj())[:, :, None] * c[:, None]
        out = np.empty((len(L), 2 * n, 2, 2 * n, 2))
        out[:, :, 0, :, 0] = out[:, :, 1, :, 1] = K.real
        out[:, :, 1, :, 0], out[:, :, 0, :, 1] = K.imag, -K.imag
        return out.reshape(len(L), 4 * n, 4 * n)
