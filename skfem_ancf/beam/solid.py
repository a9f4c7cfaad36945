"""Weak forms of hyperelastic bodies, for all local functions at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem.assembly import BilinearForm, Functional, LinearForm
from skfem.assembly.form.form import FormExtraParams
from skfem.helpers import dot

from ..core import Array, refuse, require_like, require_positive
from ..materials import HistoryMaterial, Material
from ..sections.section import evaluated


def tensor(S: Array) -> Array:
    """The symmetric tensor (2, 2, ...) of components (xx, yy, xy), shape (3, ...)."""
    return np.array([[S[0], S[2]], [S[2], S[1]]])


def moduli_at(law: Any, F: Array, strain: Array) -> Array:
    """Derivatives (2, 2, 2, 2, ...) of the first Piola-Kirchhoff stress by F, at a Green strain."""
    k = np.array([[0, 2], [2, 1]])
    D = law.moduli(strain)[k][:, :, k]
    A = np.einsum("iI...,IJKL...,kK...->iJkL...", F, D, F, optimize=True)
    return A + np.einsum("ik,JL...->iJkL...", np.eye(2), tensor(law.stress(strain)))


def displacement_strain(H: Array) -> Array:
    """Green-Lagrange strain (eps_xx, eps_yy, 2 eps_xy) of a displacement gradient (2, 2, ...)."""
    # It has no cancellation at small strain.
    square = np.einsum("ki...,kj...->ij...", H, H)
    return np.array([H[0, 0] + 0.5 * square[0, 0], H[1, 1] + 0.5 * square[1, 1],
                     H[0, 1] + H[1, 0] + square[0, 1]])


class PiolaForm(LinearForm):
    """A linear form ``int P : grad v``; the decorated function of ``w`` returns P (2, 2, ...)."""

    def _parameters(self, basis, kwargs):
        return FormExtraParams({**basis.default_parameters(),
                                **self._normalize_asm_kwargs(kwargs, basis)})

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        P = self.form(self._parameters(ubasis, kwargs)) * ubasis.dx
        nq, ne = ubasis.Nbfun, ubasis.nelems
        B = _gradient_table(ubasis).reshape(ne, nq, -1)
        P = np.moveaxis(P, (2, 3), (0, 1)).reshape(ne, -1, 1)
        data = (B @ P)[..., 0].T
        return np.array([ubasis.element_dofs.ravel()]), data.ravel(), (ubasis.N,), (nq,)


class PiolaTangent(BilinearForm):
    """A bilinear form ``int grad v : A : grad u``; the function returns A (2, 2, 2, 2, ...)."""

    _parameters = PiolaForm._parameters

    def _assemble(self, ubasis, vbasis=None, **kwargs):
        A = self.form(self._parameters(ubasis, kwargs)) * ubasis.dx
        nq, ne = ubasis.Nbfun, ubasis.nelems
        B = _gradient_table(ubasis).reshape(ne, nq, -1, 4)
        A = np.moveaxis(A.reshape(4, 4, ne, -1), (2, 3), (0, 1))
        AB = A @ B.transpose(0, 2, 3, 1)  # (ne, np, 4, nq)
        K = B.reshape(ne, nq, -1) @ AB.reshape(ne, -1, nq)  # rows v, columns u
        return scattered(K, ubasis)


def _gradient_table(basis):
    return np.ascontiguousarray(np.moveaxis(np.array([b[0].grad for b in basis.basis]),
                                            (0, 3, 4, 1, 2), (1, 0, 2, 3, 4)))


def scattered(K: Array, basis: Any) -> tuple[Any, Array, tuple[int, int], tuple[int, int]]:
    """Element matrices (ne, nq, nq), rows v and columns u, as COO data of scikit-fem."""
    nq, dofs = basis.Nbfun, basis.element_dofs
    rows, cols = np.tile(dofs, (nq, 1)), np.repeat(dofs, nq, axis=0)
    return (np.array([rows.ravel(), cols.ravel()]), K.transpose(2, 1, 0).ravel(),
            (basis.N, basis.N), (nq, nq))


class SolidForms:
    """Energy, force, tangent and mass of a material without a history at the displacement
    ``w["u"]``. Functions of the material are of global coordinates; ``mass`` is None without
    density."""

    def __init__(self, material: Material, width: float) -> None:
        require_like("material", material, "Material", "law", "reference")
        refuse(isinstance(material, HistoryMaterial), "a Domain has no history of its material, "
               "got {!r}: only beams can be plastic or viscoelastic. Use StVenantKirchhoff or "
               "NeoHookean", material)
        one, self.grade = material.reference()
        self.law, self.width, self.material = one.law(), require_positive("width", width), material
        self.energy = Functional(self._energy)
        self.residual, self.tangent = PiolaForm(self._force), PiolaTangent(self._tangent)
        self.mass = None if material.density is None else BilinearForm(self._mass)

    def _factor(self, w):
        return self.width * grade_at(self.grade, np.asarray(w.x), "E")

    def _energy(self, w):
        return self._factor(w) * self.law.energy(displacement_strain(w["u"].grad))

    def _force(self, w):
        S = tensor(self.law.stress(displacement_strain(w["u"].grad)))
        return self._factor(w) * (S + np.einsum("iJ...,JK...->iK...", w["u"].grad, S))

    def _tangent(self, w):
        H = w["u"].grad
        F = H + np.eye(2)[:, :, None, None]
        return self._factor(w) * moduli_at(self.law, F, displacement_strain(H))

    def _mass(self, u, v, w):
        density = self.material.density
        rho = grade_at(density, np.asarray(w.x), "density") if callable(density) else density
        return self.width * rho * dot(u, v)


def grade_at(function: Any, x: Array, what: str) -> Any:
    """A positive function of coordinates at points (2, ...); 1 for None."""
    if function is None:
        return 1.0
    return evaluated(what, function, *x)
