"""Constitutive laws in kernels: linear, pointwise functions of the strain, and laws in Python."""

import weakref
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from ...materials import LinearLaw, PointwiseMaterial
from ...materials.base import ShearCorrected
from ...materials.history import AtRest
from ...core import F1, F2, F3, apart, indices, primitive

#: Kinds of laws: constant moduli, a function of the strain at a point, a law in Python, one with a
#: history.
LINEAR, POINTWISE, CUSTOM, HISTORY = 0, 1, 2, 3

#: Laws by handle, as long as a kernel uses them; compiled code has no Python objects.
_LAWS: dict[int, Any] = {}
_handles = count(1)


class LawTables(NamedTuple):
    """A law for kernels; :func:`law_tables` makes it."""

    kind: int  # LINEAR, POINTWISE, CUSTOM or HISTORY
    handle: int  # of a law that is not linear
    address: int  # of the compiled law, or 0
    D: F2  # moduli, at zero strain if they vary, (3, 3)
    constants: F1  # of a pointwise law
    scale: F1  # factors of strain and stress, sqrt(k_s) for shear, (3,)


@primitive("skfem_ancf.equations.loops")
def custom_evaluate(handle, strain, out):
    """Stress (3, n, elements), moduli (9, ...), both (12, ...) or energy (1, ...) in Python."""
    law = _LAWS[handle]
    if len(out) == 12:
        out[:3], out[3:] = law.stress(strain), np.reshape(law.moduli(strain), out[3:].shape)
        return
    found = {1: law.energy, 3: law.stress, 9: law.moduli}[len(out)](strain)
    out[...] = np.reshape(found, out.shape)


@primitive("skfem_ancf.equations.loops")
def evaluate_points(law, strain, out):
    """Energy, stress or moduli of a pointwise law; compiled code calls its address."""
    out[...] = _LAWS[law.handle].evaluated(strain, len(out))


def point_of(law: LawTables) -> Any:
    """The function of a pointwise law, or None."""
    return _LAWS[law.handle].point if law.kind == POINTWISE else None


def material_of(law: LawTables) -> Any:
    return _LAWS[law.handle]


@apart("laws", LawTables, F3, F3)
def law_evaluate(law, strain, out):
    """Second Piola-Kirchhoff stress, moduli or energy per volume of a nonlinear law."""
    # ``strain`` is (eps_xx, eps_yy, 2 eps_xy), shape (3, n, elements). The shape of ``out`` selects
    # the result: (3, n, elements) stress, (9, ...) moduli (c, d) at 3 c + d, (12, ...) both in
    # NumPy, (1, ...) energy.
    n, size = strain.shape[1], strain.shape[2]
    x = np.empty(strain.shape, strain.dtype)
    for c in range(3):  # with the shear correction
        y = law.scale[c]
        for p in indices(n):
            for e in indices(size):
                x[c, p, e] = y * strain[c, p, e]
    if law.kind == POINTWISE:
        evaluate_points(law, x, out)
    else:
        custom_evaluate(law.handle, x, out)
    stresses = 3 if len(out) == 3 or len(out) == 12 else 0
    for k in range(len(out)):
        y = 1.0
        if k < stresses:
            y = law.scale[k]
        elif len(out) > 1:
            y = law.scale[(k - stresses) // 3] * law.scale[k % 3]
        for p in indices(n):
            for e in indices(size):
                out[k, p, e] *= y


@apart("laws", LawTables, F3, F3, F3)
def conserve(law, middle, change, S):
    """Correct the mean stress S so that its work equals the change of energy, by Gonzalez (2000).
    ``middle`` and ``change`` are the mean of both strains and their difference, (3, n,
    elements)."""
    n, size = S.shape[1], S.shape[2]
    x, W = np.empty((3, 2 * n, size), S.dtype), np.empty((1, 2 * n, size), S.dtype)
    before, after, old, new = x[:, :n], x[:, n:], W[0, :n], W[0, n:]
    for c in range(3):
        for p in indices(n):
            for e in indices(size):
                before[c, p, e] = middle[c, p, e] - 0.5 * change[c, p, e]
                after[c, p, e] = middle[c, p, e] + 0.5 * change[c, p, e]
    law_evaluate(law, x, W)
    for p in indices(n):
        for e in indices(size):
            a, b, c = change[0, p, e], change[1, p, e], change[2, p, e]
            square = a * a + b * b + c * c
            missing = (new[p, e] - old[p, e]
                       - (S[0, p, e] * a + S[1, p, e] * b + S[2, p, e] * c))
            share = missing * (square > 1e-24) / np.maximum(square, 1e-24)
            S[0, p, e] += share * a
            S[1, p, e] += share * b
            S[2, p, e] += share * c


def law_tables(law: Any, owner: Any) -> LawTables:
    """The LawTables of a law; a law in Python is registered while its ``owner`` lives."""
    one = np.ones(3)
    if isinstance(law, AtRest):
        handle = next(_handles)
        _LAWS[handle] = law.material
        weakref.finalize(owner, _LAWS.pop, handle, None)
        return LawTables(HISTORY, handle, 0, law.D.copy(), np.zeros(3), law.scale)
    if isinstance(law, LinearLaw):
        return LawTables(LINEAR, 0, 0, np.array(law.D, dtype=float), np.zeros(3), one)
    base, scale = (law.base, law.scale) if type(law) is ShearCorrected else (law, one)
    handle, kind, constants = next(_handles), CUSTOM, np.zeros(3)
    if isinstance(base, PointwiseMaterial) and base.is_pointwise:
        kind, constants = POINTWISE, np.array(base.constants, dtype=float)
    _LAWS[handle] = base
    weakref.finalize(owner, _LAWS.pop, handle, None)
    with np.errstate(all="ignore"):
        D = np.reshape(law.moduli(np.zeros((3, 1, 1))), (3, 3))
    return LawTables(kind, handle, 0, np.array(D), constants, np.array(scale, dtype=float))


#: For cables, which have moduli only.
NO_LAW = LawTables(LINEAR, 0, 0, np.zeros((3, 3)), np.zeros(3), np.ones(3))
