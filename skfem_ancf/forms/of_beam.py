"""Weak forms of a beam in its formulation."""
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from skfem.assembly import BilinearForm, CellBasis, Functional, LinearForm
from skfem.element import DiscreteField

from ..core.errors import InputError, require_finite, require_like
from .weak import scattered


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
        if not isinstance(r, Position):
            raise InputError("inside another form the forms of a beam need the position with "
                             "its degrees of freedom: asm(form, basis, r=forms.position(basis, q))")
        last = self._last
        if last[0] is not r:
            last = self._last = r, self._contributions(r.basis, r=r.q)
        found, number = last[1], {id(f[0]): k for k, f in enumerate(r.basis.basis)}
        try:
            for function in reversed(functions):  # rows of v, columns of u
                found = found[:, number[id(function)]]
        except KeyError:
            raise InputError("the position belongs to another basis: assemble the form on the "
                             "basis that forms.position has") from None
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
        if not same:
            raise InputError(f"this is a form of {self.beam!r}: assemble it on "
                             f"Basis(beam.mesh, ElementVector(beam.element)), not on {basis!r}")
        r = r.q if isinstance(r, Position) else r
        if other or isinstance(r, DiscreteField) or np.shape(r) != (basis.N,):
            raise InputError(f"pass the degrees of freedom as r=q, a vector of {basis.N} numbers, "
                             f"and nothing else; got r of shape {np.shape(r)}"
                             + (f" and {sorted(other)}" if other else ""))
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
        if vbasis is not None and vbasis is not ubasis:
            raise InputError("trial and test functions of a beam's tangent need the same basis: "
                             "asm(form, basis, r=q)")
        return scattered(self._contributions(ubasis, **kwargs), ubasis)
