"""Weak forms of a planar body: energy, internal force, tangent, mass, loads.

Each factory returns a scikit-fem form for ``asm`` on a ``Basis`` of the position field, with the
degrees of freedom passed as ``r``:

>>> import numpy as np
>>> from skfem import Basis, ElementVector, asm
>>> from skfem_ancf import (ElementBeamANCF, MeshBeam, StVenantKirchhoff, forms,
...                         reference_coordinates)
>>> basis = Basis(MeshBeam.init_line(np.linspace(0, 1, 3), height=0.1),
...               ElementVector(ElementBeamANCF(2)))
>>> steel = StVenantKirchhoff(E=2.1e11, nu=0.3)
>>> q = reference_coordinates(basis)
>>> K = asm(forms.tangent(steel, width=0.1), basis, r=q)
>>> K.shape, bool(abs(asm(forms.internal_force(steel, width=0.1), basis, r=q)).max() < 1e-3)
((24, 24), True)

There are four kinds, equal where they are the same integral:

* :func:`textbook_energy`, :func:`textbook_internal_force`, :func:`textbook_tangent`: plain
  formulas, assembled by scikit-fem for one pair of local functions at a time. Tests compare the
  others with them.
* :func:`energy`, :func:`internal_force`, :func:`tangent`: the same for all local functions at once.
* :func:`strain_energy`: the energy as an :class:`~skfem_ancf.Energy`, for a scene.
* :func:`of`: the forms in the formulation of a Beam, as :class:`~skfem_ancf.Scene` uses them.

The strain is the Green-Lagrange strain ``(F^T F - 1) / 2`` in the beam's frame with
``F = grad r``, and S is the second Piola-Kirchhoff stress.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from skfem.assembly import BilinearForm, CellBasis, Form, Functional, LinearForm
from skfem.element import DiscreteField
from skfem.helpers import dot

from ..actions.energy import Energy, points_of
from ..beam import PiolaForm, PiolaTangent, moduli_at, scattered, tensor
from ..core import (Array, ArrayLike, ask_field, refuse, require_finite, require_like,
                    require_positive)
from ..formulations import get_formulation
from ..materials.base import Material

# kinematics: grad[i, j] = d r_i / d X_j

def deformation_gradient(r: Any, frame: Array) -> Array:
    """F in the beam's frame: F[i, J] = d r_i / d X_j frame[j, J], shape (2, 2, ...).

    Parameters
    ----------
    r
        The position field, with ``grad`` of shape (2, 2, ...).
    frame
        The beam's frame, shape (2, 2, ...).
    """
    return np.einsum("ij...,jJ...->iJ...", r.grad, frame)


def green_lagrange(F: Array) -> Array:
    """Strain (eps_xx, eps_yy, 2 eps_xy), shape (3, ...), of a deformation gradient (2, 2, ...)."""
    return np.array([0.5 * (dot(F[:, 0], F[:, 0]) - 1.0), 0.5 * (dot(F[:, 1], F[:, 1]) - 1.0),
                     dot(F[:, 0], F[:, 1])])


def strain_variation(F: Array, dF: Array) -> Array:
    """Variation of :func:`green_lagrange` at F in the direction dF, shape (3, ...).

    Parameters
    ----------
    F
        Deformation gradient in the beam's frame, shape (2, 2, ...).
    dF
        Its variation, shape (2, 2, ...).
    """
    return np.array([dot(F[:, 0], dF[:, 0]), dot(F[:, 1], dF[:, 1]),
                     dot(F[:, 0], dF[:, 1]) + dot(F[:, 1], dF[:, 0])])


def _law(material, k_s):
    require_like("material", material, "Material", "law")
    return material.law(require_positive("k_s", k_s))


def piola(law: Any, F: Array, frame: Array) -> Array:
    """First Piola-Kirchhoff stress ``d W / d (d r_i / d X_j)``, shape (2, 2, ...).

    Parameters
    ----------
    law
        A material's law.
    F, frame
        Deformation gradient in the beam's frame, and the frame, (2, 2, ...).
    """
    return np.einsum("iJ...,JK...,jK...->ij...", F, tensor(law.stress(green_lagrange(F))), frame)


def moduli_of(law: Any, F: Array, frame: Array) -> Array:
    """Derivatives of :func:`piola` by the deformation gradient, shape (2, 2, 2, 2, ...).

    Parameters
    ----------
    law, F, frame
        As for :func:`piola`.
    """
    return np.einsum("jJ...,iJkL...,lL...->ijkl...", frame, moduli_at(law, F, green_lagrange(F)),
                     frame, optimize=True)


# textbook forms


def textbook_energy(material: Material, width: float = 1.0, k_s: float = 1.0) -> Functional:
    """Strain energy ``U(r) = int W(eps) dV``, a ``Functional``.

    Parameters
    ----------
    material
        A :class:`~skfem_ancf.materials.Material`.
    width
        Width of the section, positive.
    k_s
        Factor on the shear modulus, positive, see
        :meth:`~skfem_ancf.materials.base.Material.shear_factor`.
    """
    law, width = _law(material, k_s), require_positive("width", width)
    return EnergyForm(lambda w: width * law.energy(
        green_lagrange(deformation_gradient(w.r, w.frame))))


def textbook_internal_force(material: Material, width: float = 1.0, k_s: float = 1.0) -> LinearForm:
    """First variation ``delta U = int S : delta eps dV``, a ``LinearForm``.

    Parameters
    ----------
    material, width, k_s
        As for :func:`textbook_energy`.
    """
    law, width = _law(material, k_s), require_positive("width", width)

    @BeamLinearForm
    def force(v, w):
        F, dF = (deformation_gradient(f, w.frame) for f in (w.r, v))
        return width * dot(law.stress(green_lagrange(F)), strain_variation(F, dF))

    return force


def textbook_tangent(material: Material, width: float = 1.0, k_s: float = 1.0) -> BilinearForm:
    """Second variation ``int delta eps : D : d eps + S : d delta eps dV``, a ``BilinearForm``.

    Parameters
    ----------
    material, width, k_s
        As for :func:`textbook_energy`.
    """
    law, width = _law(material, k_s), require_positive("width", width)

    @BeamBilinearForm
    def stiffness(u, v, w):
        F, DF, dF = (deformation_gradient(f, w.frame) for f in (w.r, u, v))
        eps, d, D = green_lagrange(F), strain_variation(F, dF), strain_variation(F, DF)
        return width * (np.einsum("a...,ab...,b...->...", d, law.moduli(eps), D)
                        + dot(law.stress(eps), strain_variation(dF, DF)))

    return stiffness


#: The three forms: ``textbook.energy``, ``textbook.internal_force``, ``textbook.tangent``.
textbook = SimpleNamespace(energy=textbook_energy, internal_force=textbook_internal_force,
                           tangent=textbook_tangent)


# scikit-fem's forms with the beam's frame


class _BeamFrame:
    """A form with the beam's frame in ``w``, shape (2, 2, nelements, npoints)."""

    @staticmethod
    def _normalize_asm_kwargs(w, basis):
        if hasattr(basis, "find"):
            tind, points = basis.mapping.facet_points(basis.X, basis.find)
        else:
            tind, points = basis.tind, basis.X
        frame = basis.mapping.frame(points, tind)
        return {**Form._normalize_asm_kwargs(w, basis), "frame": frame}


class EnergyForm(_BeamFrame, Functional):
    """A functional with the beam's frame as ``w.frame``."""


class BeamLinearForm(_BeamFrame, LinearForm):
    """A linear form with the beam's frame as ``w.frame``."""


class BeamBilinearForm(_BeamFrame, BilinearForm):
    """A bilinear form with the beam's frame as ``w.frame``."""


class StressForm(BeamLinearForm, PiolaForm):
    """A linear form ``int P : grad v`` defined by the first Piola-Kirchhoff stress P.

    The decorated function takes ``w``, with fields as in scikit-fem's ``LinearForm`` and the beam's
    frame ``w.frame``, and returns P (2, 2, nelements, npoints). All local functions are contracted
    at once by a matrix product.
    """


class ModuliForm(BeamBilinearForm, PiolaTangent):
    """A bilinear form ``int grad v : A : grad u`` defined by the moduli A = dP / dF. The decorated
    function takes ``w`` and returns A (2, 2, 2, 2, nelements, npoints). All pairs of local
    functions are contracted at once by matrix products."""


# the same for all local functions at once, and mass and loads

#: :func:`textbook_energy`: a functional has no local functions to contract.
energy = textbook_energy


def internal_force(material: Material, width: float = 1.0, k_s: float = 1.0) -> LinearForm:
    """Internal force ``int P : grad v dV``, P = F S; a batched ``LinearForm``.

    Parameters
    ----------
    material, width, k_s
        As for :func:`textbook_energy`.
    """
    law, width = _law(material, k_s), require_positive("width", width)
    return StressForm(lambda w: width * piola(law, deformation_gradient(w.r, w.frame), w.frame))


def tangent(material: Material, width: float = 1.0, k_s: float = 1.0) -> BilinearForm:
    """Tangent ``int grad v : dP/dF : grad u dV``; a batched ``BilinearForm``.

    Parameters
    ----------
    material, width, k_s
        As for :func:`textbook_energy`.
    """
    law, width = _law(material, k_s), require_positive("width", width)
    return ModuliForm(lambda w: width * moduli_of(
        law, deformation_gradient(w.r, w.frame), w.frame))


def mass(density: float, width: float = 1.0) -> BilinearForm:
    """Mass ``int rho v . u dV``, a constant ``BilinearForm``.

    On curved meshes with linear sections a ``Basis`` underestimates volumes by theta^2 / 12, theta
    the angle of an element: use :meth:`~skfem_ancf.Beam.exact_basis`.

    Parameters
    ----------
    density
        Mass per volume, positive.
    width
        Width of the section, positive.
    """
    density, width = require_positive("density", density), require_positive("width", width)
    return BilinearForm(lambda u, v, _: width * density * dot(u, v))


def gravity(density: float, g: ArrayLike, width: float = 1.0) -> LinearForm:
    """Dead load ``int rho g . v dV``, a ``LinearForm``; for the volumes see :func:`mass`.

    Parameters
    ----------
    density
        Mass per volume, positive.
    g
        The acceleration, shape (2,).
    width
        Width of the section, positive.
    """
    density, width = require_positive("density", density), require_positive("width", width)
    g = require_finite("g", g, (2,))
    return LinearForm(lambda v, _: width * density * (g[0] * v[0] + g[1] * v[1]))


def _widths(width):
    return require_finite("width", width, (None, None)) if isinstance(
        width, np.ndarray) else require_positive("width", width)


def traction(t: ArrayLike | Callable[[Array], Array], width: float | Array = 1.0) -> LinearForm:
    """Dead traction ``int t . v dA`` for a ``FacetBasis``, a ``LinearForm``.

    Parameters
    ----------
    t
        Force per undeformed area, shape (2,), or a function of the points x (2, ...) that returns
        (2, ...).
    width
        Width of the section, positive, or widths at the points of the basis, shape (nfacets,
        npoints).
    """
    width = _widths(width)
    if not callable(t):
        t = require_finite("t", t, (2,))

    @LinearForm
    def surface_load(v, w):
        value = ask_field("t(x)", t, np.asarray(w.x)) if callable(t) else t
        return width * (value[0] * v[0] + value[1] * v[1])

    return surface_load


def pressure(width: float | Array = 1.0) -> BilinearForm:
    """Unit follower pressure ``int -n . v da``, linear in the position: a ``BilinearForm``.

    On the deformed facet ``n da`` is the derivative of the position along the facet, rotated by
    -90 degrees. The force is the matrix times the degrees of freedom.

    Parameters
    ----------
    width
        Width of the section, positive, or widths at the points of the basis, shape (nfacets,
        npoints).
    """
    width = _widths(width)

    @BilinearForm
    def follower(u, v, w):
        # the facet's direction with the body on its left: n turned by +90 degrees
        along = -w.n[1] * u.grad[:, 0] + w.n[0] * u.grad[:, 1]
        return -width * (along[1] * v[0] - along[0] * v[1])

    return follower


# the strain energy of a beam as an Energy

def strain_energy(beam: Any) -> Energy:
    """The strain energy of a beam as an :class:`~skfem_ancf.Energy`, fully integrated.

    psi is the strain energy density of the material at the points of the formulation "continuum",
    in all layers of the section, independent of the formulation of the beam. Load factors do not
    scale it. A scene of the beam already contains this energy: adding it doubles the stiffness. The
    kernels of a Beam with this formulation give the same numbers faster.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff, forms
    >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(2),
    ...             StVenantKirchhoff(2e8, 0.3), width=0.1, formulation="continuum")
    >>> u = 1e-3 * beam.sizes * np.cos(np.arange(beam.N))
    >>> energy = forms.strain_energy(beam).bind(beam)
    >>> bool(abs(energy.potential(u) / beam.kernel.energy(u) - 1) < 1e-12)
    True
    """
    require_like("beam", beam, "Beam", "facet_basis")
    return StrainEnergy(beam)


class StrainEnergy(Energy):
    """The energy of :func:`strain_energy`, of a ``beam``."""

    def __init__(self, beam: Any = None) -> None:
        super().__init__(strain_energy, strain_energy, strain_energy, beam=beam, scaled=False)

    def _points(self, beam):
        mapping, every, out = beam.mesh.mapping(), np.arange(beam.mesh.nelements), []
        for layer, terms in beam.across.terms(get_formulation("continuum")):
            for term in terms:
                X, W = term.quadrature
                weights = beam.across.volume(layer, X, W, every, len(term.section[0]) == 1,
                                             "" if layer.grade is None else "grade")
                out.append(points_of(
                    beam, every, X, np.broadcast_to(weights, (len(every), len(W))),
                    (term.law, mapping.frame(X, every))))
        return out

    def _ask(self, name, y, part, times=1):
        law, frame = part.of
        F = np.einsum("ij...,jJ...->iJ...", y[2:].reshape(2, 2, *y.shape[1:]), frame)
        if name == "psi":
            return law.energy(green_lagrange(F))
        if name == "gradient":
            return 0.0 * y[:2], piola(law, F, frame)
        out = np.zeros((6, *y.shape))
        out[2:, 2:] = moduli_of(law, F, frame).reshape(4, 4, *y.shape[1:])
        return out

    def distribution(self, u: Any) -> None:
        return None


# weak forms of a beam in its formulation

class BeamForms(NamedTuple):
    """The forms of one beam, see :func:`of`."""

    energy: Functional
    internal_force: LinearForm
    tangent: BilinearForm


def of(beam: Any) -> BeamForms:
    """The weak forms of a beam in its formulation.

    They are ``U(r)``, ``delta U`` and ``delta^2 U`` of the strain energy that
    :class:`~skfem_ancf.Scene` uses, stabilisation included, for ``asm(form, basis, r=q)``. The
    formulation has its own quadrature; that of the basis does not matter.

    They can be called inside another form: ``weak.internal_force(v, w)`` and ``weak.tangent(u, v,
    w)`` are densities, constant in each element, with the same integral. Then ``r`` must be
    :func:`position` of the basis.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`. The forms are assembled on a ``Basis`` of
        ``ElementVector(element)`` on its mesh, or on some of its elements.

    Raises
    ------
    InputError
        In the assembly, if the basis is not one of the beam, or ``r`` has the wrong shape.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem import Basis, ElementVector, LinearForm, asm
    >>> from skfem_ancf import (Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff, forms,
    ...                         reference_coordinates)
    >>> mesh, element = MeshBeam.init_line(np.linspace(0, 1, 3), height=0.1), ElementBeamANCF(2)
    >>> weak = forms.of(Beam(mesh, element, StVenantKirchhoff(E=2.1e11, nu=0.3), width=0.1))
    >>> basis = Basis(mesh, ElementVector(element))
    >>> q = reference_coordinates(basis)
    >>> asm(weak.tangent, basis, r=q).shape
    (24, 24)
    >>> residual = LinearForm(lambda v, w: weak.internal_force(v, w) + 100 * v[1])
    >>> asm(residual, basis, r=forms.position(basis, q)).shape
    (24,)
    """
    require_like("beam", beam, "Beam", "facet_basis")
    return BeamForms(_BeamEnergy(beam), _BeamForce(beam), _BeamTangent(beam))


class Position(DiscreteField):
    """A position field with its basis and degrees of freedom ``q``."""

    basis: Any
    q: Any


def position(basis: CellBasis, q: ArrayLike) -> Position:
    """``basis.interpolate(q)`` with the basis and the degrees of freedom attached.

    Parameters
    ----------
    basis
        A ``Basis`` of ``ElementVector(element)`` on the mesh of a beam.
    q
        The degrees of freedom, shape (N,).
    """
    require_like("basis", basis, "Basis", "interpolate", "N")
    q = require_finite("q", q, (basis.N,))
    field = basis.interpolate(q).view(Position)
    field.basis, field.q = basis, q
    return field


class _BeamForm:
    """A form with element contributions from the kernel of a beam."""

    def __init__(self, beam):
        super().__init__(self._density)
        self.beam, self._last = beam, (None, None)

    def __call__(self, *functions):
        return self._density(*functions)

    def _density(self, *functions):
        """Value inside another form, shape (nelements, npoints)."""
        *functions, w = functions
        r = w.get("r")
        refuse(not isinstance(r, Position), "inside another form the forms of a beam need the "
               "position with its degrees of freedom: asm(form, basis, r=forms.position(basis, q))")
        last = self._last
        if last[0] is not r:
            last = self._last = r, self._contributions(r.basis, r=r.q)
        found, number = last[1], {id(f[0]): k for k, f in enumerate(r.basis.basis)}
        for function in reversed(functions):  # rows of v, columns of u
            refuse(id(function) not in number, "the position belongs to another basis: assemble "
                   "the form on the basis that forms.position has")
            found = found[:, number[id(function)]]
        return (found / r.basis.dx.sum(axis=1))[:, None] + np.zeros(r.basis.dx.shape)

    def _contributions(self, basis, r=None, idx=None, **other):
        """Contributions of the elements of the basis; ``idx`` is scikit-fem's."""
        mesh, element = self.beam.mesh, self.beam.element
        other_element = getattr(basis.elem, "elem", None)
        same = (isinstance(basis, CellBasis) and basis.N == self.beam.N
                and type(other_element) is type(element)
                and np.array_equal(other_element.doflocs, element.doflocs)
                and np.array_equal(basis.mesh.p, mesh.p) and basis.mesh.height == mesh.height
                and np.array_equal(basis.mesh.heights, mesh.heights))
        refuse(not same, "this is a form of {!r}: assemble it on Basis(beam.mesh, "
               "ElementVector(beam.element)), not on {!r}", self.beam, basis)
        r = r.q if isinstance(r, Position) else r
        refuse(other or isinstance(r, DiscreteField) or np.shape(r) != (basis.N,), "pass the "
               "degrees of freedom as r=q, a vector of {} numbers, and nothing else; got r of "
               "shape {}{}", basis.N, np.shape(r), f" and {sorted(other)}" if other else "")
        found = self._found(np.asarray(r, dtype=np.float64) - self.beam.q0)
        return found if basis.tind is None else found[basis.tind]


class _BeamEnergy(_BeamForm, Functional):
    def _found(self, u):
        return self.beam.kernel.energies(u)

    def elemental(self, v, **kwargs):
        return self._contributions(v, **kwargs)


class _BeamForce(_BeamForm, LinearForm):
    def _found(self, u):
        forces = self.beam.kernel.forces(u)
        return forces.reshape(len(forces), -1)

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        data, dofs = self._contributions(ubasis, **kwargs).T, ubasis.element_dofs
        return np.array([dofs.ravel()]), data.ravel(), (ubasis.N,), (ubasis.Nbfun,)


class _BeamTangent(_BeamForm, BilinearForm):
    def _found(self, u):
        return self.beam.kernel.tangents(u)

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        refuse(vbasis is not None and vbasis is not ubasis, "trial and test functions of a beam's "
               "tangent need the same basis: asm(form, basis, r=q)")
        return scattered(self._contributions(ubasis, **kwargs), ubasis)


__all__ = ["BeamBilinearForm", "BeamForms", "BeamLinearForm", "EnergyForm", "ModuliForm",
           "Position", "StrainEnergy", "StressForm", "deformation_gradient", "energy", "gravity",
           "green_lagrange", "internal_force", "mass", "moduli_of", "of", "piola", "position",
           "pressure", "strain_energy", "strain_variation", "tangent", "textbook",
           "textbook_energy", "textbook_internal_force", "textbook_tangent", "traction"]
