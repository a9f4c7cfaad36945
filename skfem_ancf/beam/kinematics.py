"""How the points of a section follow the coordinates: one class for each kind of element.

An element names its kind, ``element.kinematics``; what depends on it is asked here.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .inertia import of_cable, of_sections
from .kernels import CableKernel, Kernel
from .kernels.along import CableSections, stretched
from ..core.errors import InputError, ModelWarning, warn
from ..core.linear import first_order
from ..formulations.ecm import AXIS
from ..core.quadrature import gauss

if TYPE_CHECKING:
    from .interior import Interior
    from ..elements.base import ElementBeam
    from .inertia import Inertia
    from ..materials.base import Material
    from ..mesh.mesh_beam import MeshBeam
    from ..core.types import Array, Rule


#: Part of the deflection of a cantilever, by a force at its end, that is not left out silently.
SHEARED = 1e-3


class Sections:
    """Points of sections are coordinates of their own: the position is linear in them.

    Attributes
    ----------
    kernel
        Class of the strain energy.
    has_sections : bool
        Points off the axis are linear in the coordinates.
    """

    kernel: Any = Kernel
    has_sections = True

    @staticmethod
    def require_law(material: Material) -> None:
        """Any law will do."""

    @staticmethod
    def warn_of_section(section: Any, mesh: MeshBeam) -> None:
        """Nothing of a section is ignored.

        Parameters
        ----------
        section, mesh
            Those of a beam.
        """

    @staticmethod
    def section_rule(element: ElementBeam) -> Rule:
        """Points and weights across the section, exact for products of two coordinates."""
        return gauss(element.order + 1)

    @staticmethod
    def inertia(beam: Interior) -> Inertia:
        """Its masses at points.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        """
        return of_sections(beam)

    @staticmethod
    def direction(beam: Interior, node: int) -> tuple[Array, Array]:
        """Coordinates (2, n) and weights (n,) of 12 / h^3 int Y r dY of a section.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        node
            Its number.
        """
        eta, w = gauss(beam.element.order + 1)
        h = beam.mesh.node_height(node)
        first = next(k for k, f in enumerate(beam.element.functionals) if f[2] > 0)
        f = beam.element.functionals[first:first + beam.element.section.number]
        c = np.array([12.0 * h ** (f[k][2] - 1) * np.sum(
            w * (eta - 0.5) * beam.element.section(eta - 0.5, k)[0]) for k in range(len(f))])
        return node * beam.nd + 2 * first + np.arange(2 * len(f)).reshape(-1, 2).T, c

    @staticmethod
    def direction_weights(beam: Interior, e: int, xi: float) -> Array:
        """Weights (nb,) of an element's local functions in the direction of a section inside it.

        Of the same integral as :meth:`direction`; of a cable those of the tangent of its axis.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        e, xi
            The element, and where in it the section is, from 0 to 1.
        """
        eta, w = gauss(beam.element.order + 1)
        mapping = beam.mesh.mapping()
        h = float(np.ravel(mapping.height(np.array([xi]), np.array([e]))[0])[0])
        rows = beam.element.local(np.array([xi + 0.0 * eta, eta]), h)
        return 12.0 / h * (rows[0] @ (w * (eta - 0.5))) * beam.mesh.lengths[e] ** rows[3]

    @staticmethod
    def plane(beam: Interior, tangent: Array) -> tuple[Array, list[int]]:
        """What keeps a section in its plane: its normal, and the coordinates that stay in it.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        tangent
            Of the axis, shape (2,).
        """
        return tangent, [k for k, (_, along, across) in enumerate(beam.element.functionals)
                         if along == 0 and across > 0]

    @staticmethod
    def gradients(beam: Interior, u: Array, X: Array, tind: Array | None) -> tuple[Array, Array]:
        """Displacement gradient in the beam's frame, and the frame.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        u, X, tind
            As for :meth:`Beam.gradients <skfem_ancf.Beam.gradients>`, shapes (N,), (2, npoints) or
            (2, nelements, npoints), and (nelements,).
        """
        u_e = beam.kernel.gather(u, slice(None) if tind is None else tind)
        return beam.element.gradients(beam.mesh.mapping(), X, tind, u_e)

    @staticmethod
    def displacements(beam: Interior, u: Array, X: Array, tind: Array | None) -> Array:
        """Displacement at reference points, shape (2, nelements, npoints).

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        u, X, tind
            As for :meth:`Beam.gradients <skfem_ancf.Beam.gradients>`, shapes (N,), (2, npoints) or
            (2, nelements, npoints), and (nelements,).
        """
        mapping = beam.mesh.mapping()
        u_e = beam.kernel.gather(u, slice(None) if tind is None else tind)
        functions = beam.element.functions(mapping, X, tind)[0]
        return np.einsum("eki,kep->iep", u_e, functions, optimize=True)

    @staticmethod
    def strain(beam: Interior, u: Array, X: Array, tind: Array | None) -> Array:
        """Green-Lagrange strain of the formulation, shape (3, nelements, npoints).

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        u, X, tind
            As for :meth:`Beam.gradients <skfem_ancf.Beam.gradients>`, shapes (N,), (2, npoints) or
            (2, nelements, npoints), and (nelements,).
        """
        return beam.sampled_strain(beam.terms[0], u, X, tind)

    @staticmethod
    def strain_at(beam: Interior, u: Array, e: Array, X: Array) -> Array:
        """As :meth:`strain`, at points each in an element of its own, shape (3, n).

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        u
            Displacement of its coordinates, shape (N,).
        e, X
            Elements (n,) and reference points (2, n).
        """
        return beam.strain_of(beam.terms[0])(u, e, X)

    @staticmethod
    def stress(beam: Interior, strain: Array, u: Array, X: Array, tind: Array | None) -> Array:
        """Second Piola-Kirchhoff stress, shape (3, nelements, npoints).

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        strain
            What :meth:`strain` returns, shape (3, nelements, npoints).
        u, X, tind
            As for :meth:`Beam.gradients <skfem_ancf.Beam.gradients>`, shapes (N,), (2, npoints) or
            (2, nelements, npoints), and (nelements,).
        """
        return beam.across.of_slabs(X, strain, [
            partial(layer.formulation.stress, layer, strain, u, X, tind)
            for layer in beam.layers], tind)

    @staticmethod
    def shortest(beam: Interior, u: Array) -> float:
        """Smallest stretch of the fibres along the axis at the integration points.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        u
            Displacement of the coordinates, shape (N,).
        """
        return beam.kernel.shortest(u)

    @staticmethod
    def deformation(beam: Interior, u: Array) -> tuple[Array, Array]:
        """det F and both principal stretches at the integration points.

        Parameters
        ----------
        beam
            A :class:`~skfem_ancf.Beam`.
        u
            Displacement of the coordinates, shape (N,). Of a
            :func:`~skfem_ancf.core.linear.step` they are linear.
        """
        det, stretches = [], []
        for term in beam.terms:
            H, frame = Sections.gradients(beam, u, term.quadrature[0], None)
            F = H + frame
            C = first_order(np.einsum("ikep,ijep->kjep", F, F))
            middle, half = 0.5 * (C[0, 0] + C[1, 1]), 0.5 * (C[0, 0] - C[1, 1])
            root = np.hypot(half, C[0, 1])
            square = np.array([middle - root, middle + root]).ravel()
            stretches.append(0.5 + 0.5 * square if np.iscomplexobj(F) else
                             np.sqrt(np.maximum(square, 0.0)))
            det.append(first_order(F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]).ravel())
        return np.concatenate(det), np.concatenate(stretches)


class Cable(Sections):
    """Sections stay normal to the axis, and get thinner so that S_yy = 0.

    The nominal stress along a fibre is ``P = E (eps - Y kappa)``; E / (1 - nu^2) in plane strain.
    Over a section its integral is N = EA eps - ES kappa, that of -Y P is M = EI kappa - ES eps. The
    second Piola-Kirchhoff stress is P over the stretch of the fibre.
    """

    kernel: Any = CableKernel
    has_sections = False

    @staticmethod
    def require_law(material: Material) -> None:
        """Hooke's law of E and nu."""
        if not material.is_hooke:
            raise InputError(
                "a cable has Hooke's law of E and nu along its axis and bends with E I: it cannot "
                f"have the law of {material!r}. Use StVenantKirchhoff, or an element with "
                "sections, as ElementBeamANCFCubic(2)")

    @staticmethod
    def warn_of_section(section: Any, mesh: MeshBeam) -> None:
        """A ModelWarning where a given stiffness against shear would be felt."""
        GA = getattr(section, "GA", None)
        if GA is None:
            return
        share = 3.0 * section.EI / (GA * float(np.min(mesh.chain_lengths))**2)
        if share > SHEARED:
            warn(
                f"a cable has no shear deformation and ignores GA={GA:g} of {section!r}, which "
                f"would add {share:.1%} to the deflection of a cantilever of its length: use an "
                "element with sections, as ElementBeamANCFCubic(2), or leave GA out", ModelWarning)

    @staticmethod
    def section_rule(element: ElementBeam) -> Rule:
        return AXIS

    @staticmethod
    def inertia(beam: Interior) -> Inertia:
        return of_cable(beam)

    @staticmethod
    def direction(beam: Interior, node: int) -> tuple[Array, Array]:
        # the tangent, which turns with the section
        return node * beam.nd + 2 + np.arange(2).reshape(2, 1), np.ones(1)

    @staticmethod
    def direction_weights(beam: Interior, e: int, xi: float) -> Array:
        rows = beam.element.local(np.array([[xi], [0.5]]), beam.mesh.height)
        return rows[1][:, 0] * beam.mesh.lengths[e] ** (rows[3] - 1.0)

    @staticmethod
    def plane(beam: Interior, tangent: Array) -> tuple[Array, list[int]]:
        return np.array([-tangent[1], tangent[0]]), [1]

    @staticmethod
    def _section(beam, u, X, tind):
        at = CableSections(beam, X[0], tind)
        tangent, strain = at(beam.kernel.gather(u, slice(None) if tind is None else tind))
        return tangent, at.tangent0, *strain, at.kappa0

    @classmethod
    def gradients(cls, beam: Interior, u: Array, X: Array,
                  tind: Array | None) -> tuple[Array, Array]:
        frame = beam.mesh.mapping().frame(X, tind)
        tangent, _, eps, kappa, kappa0 = cls._section(beam, u, X, tind)
        Y, normal = beam.mesh.mapping().offset(X, tind), np.array([-tangent[1], tangent[0]])
        strain = cls._strain_of(beam, Y, beam.across.which(X, tind), eps, kappa, kappa0)
        with np.errstate(invalid="ignore"):  # where the strain leaves no width
            across = np.sqrt(1.0 + 2.0 * strain[1])
        F = np.stack([(1.0 + (eps - Y * kappa) / (1.0 - Y * kappa0)) * tangent, across * normal],
                     axis=1)
        return F - frame, frame

    @classmethod
    def displacements(cls, beam: Interior, u: Array, X: Array, tind: Array | None) -> Array:
        tangent, tangent0, *_ = cls._section(beam, u, X, tind)
        turn = tangent - tangent0
        return (Sections.displacements(beam, u, X, tind)
                + beam.mesh.mapping().offset(X, tind) * np.array([-turn[1], turn[0]]))

    @classmethod
    def strain(cls, beam: Interior, u: Array, X: Array, tind: Array | None) -> Array:
        return cls._strain_of(beam, beam.mesh.mapping().offset(X, tind), beam.across.which(X, tind),
                              *cls._section(beam, u, X, tind)[2:])

    @staticmethod
    def _strain_of(beam, Y, which, eps, kappa, kappa0):
        ratios = np.array([slab.material.lateral_ratio for slab in beam.across.slabs])
        longer = (eps - Y * kappa) / (1.0 - Y * kappa0)  # of a fibre, by its length
        xx = longer + 0.5 * longer * longer
        return np.array([xx, -ratios[which] * xx, 0.0 * xx])

    @classmethod
    def strain_at(cls, beam: Interior, u: Array, e: Array, X: Array) -> Array:
        return cls.strain(beam, u, X[:, :, None], e)[..., 0]

    @staticmethod
    def stress(beam: Interior, strain: Array, u: Array, X: Array, tind: Array | None) -> Array:
        stretch, longer = stretched(strain[0])
        if not beam.mesh.is_straight:
            kappa0 = CableSections(beam, X[0], tind).kappa0
            longer = longer * (1.0 - beam.mesh.mapping().offset(X, tind) * kappa0)

        def along(material):
            S = material.axial_modulus * longer / stretch
            return np.array([S, 0.0 * S, 0.0 * S])

        return beam.across.of_slabs(X, strain, [partial(along, slab.material)
                                                for slab in beam.across.slabs], tind)

    @staticmethod
    def shortest(beam: Interior, u: Array) -> float:
        return np.min(beam.kernel.outer_stretches(u))

    @staticmethod
    def deformation(beam: Interior, u: Array) -> tuple[Array, Array]:
        along = beam.kernel.outer_stretches(u)
        ratio = beam.across.slabs[0].material.lateral_ratio
        if np.iscomplexobj(u):
            return along + ratio * (1.0 - along), along
        across = np.sqrt(np.maximum(1.0 - ratio * (along * along - 1.0), 0.0))  # S_yy = 0
        return along * across, along


def folded(beam: Any, u: Array) -> bool:
    """True if the axis of an element turns back: its ends lie against a tangent of the axis.

    An axis that does so turns by more than pi over the element, or has no length in it.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    u
        Displacement of its degrees of freedom, shape (N,).
    """
    nodes = u.reshape(-1, beam.nd)[:, :4].T
    x, tangent = beam.mesh.p + nodes[:2], beam.mesh.p_X + nodes[2:]
    left, right = beam.mesh.t
    chord = x[:, right] - x[:, left]
    return bool(min(np.min(np.sum(chord * tangent[:, end], axis=0)) for end in (left, right)) < 0.0)


#: Classes by the name that elements give.
KINEMATICS = {"sections": Sections, "cable": Cable}
