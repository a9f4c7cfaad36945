"""Laws in kernels: Hooke's, functions of the strain at a point, and methods of any other."""

import weakref
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from ...materials import LinearLaw, PointwiseMaterial
from ...materials.base import ShearCorrected
from ...core.source import F1, F2, indices, primitive, source

#: Kinds of laws: constant moduli, a function of the strain at a point, and any other.
LINEAR, POINTWISE, OWN = 0, 1, 2

#: By handle, as long as a kernel has them: compiled code holds no Python objects.
_LAWS: dict[int, Any] = {}
_handles = count(1)


class LawTables(NamedTuple):
    """A law as compiled code takes it; :func:`law_tables` makes it.

    Attributes
    ----------
    kind, handle
        :data:`LINEAR`, :data:`POINTWISE` or :data:`OWN`, and what finds the law of the latter two.
    address
        That of the compiled law; 0 in NumPy.
    D
        Moduli, those without strain where they depend on it, shape (3, 3).
    constants
        Of a pointwise law.
    scale
        Factors on the strain, and on the stress: that of shear is sqrt(k_s). Shape (3,).
    """

    kind: int
    handle: int
    address: int
    D: F2
    constants: F1
    scale: F1


@primitive("skfem_ancf.equations.loops")
def own_evaluate(handle, strain, out):
    """Stress (3, n, elements), moduli (9, ...) or energy (1, ...) of a law in Python."""
    law = _LAWS[handle]
    found = {1: law.energy, 3: law.stress, 9: law.moduli}[len(out)](strain)
    out[...] = np.reshape(found, out.shape)


@primitive("skfem_ancf.equations.loops")
def evaluate_points(law, strain, out):
    """Energy, stress or moduli of a pointwise law; compiled, by its address."""
    out[...] = _LAWS[law.handle].evaluated(strain, len(out))


def point_of(law: LawTables) -> Any:
    """The function of the strain at a point, None for a law without."""
    return _LAWS[law.handle].point if law.kind == POINTWISE else None


@source
def law_evaluate(law, strain, out):
    """Second Piola-Kirchhoff stress, moduli or energy per volume of a law that is not linear.

    Parameters
    ----------
    law
        LawTables.
    strain
        (eps_xx, eps_yy, 2 eps_xy), shape (3, n, elements).
    out
        The stress, if of shape (3, n, elements), the moduli (9, ...), (c, d) at 3 c + d, or the
        energy (1, ...).
    """
    n, size = strain.shape[1], strain.shape[2]
    x = np.empty(strain.shape, strain.dtype)
    for c in range(3):  # the strain of the law: with its shear corrected
        y = law.scale[c]
        for p in indices(n):
            for e in indices(size):
                x[c, p, e] = y * strain[c, p, e]
    if law.kind == POINTWISE:
        evaluate_points(law, x, out)
    else:
        own_evaluate(law.handle, x, out)
    for k in range(len(out)):
        y = 1.0 if len(out) == 1 else law.scale[k // (len(out) // 3)]
        y *= law.scale[k % 3] if len(out) == 9 else 1.0
        for p in indices(n):
            for e in indices(size):
                out[k, p, e] *= y


@source
def conserve(law, middle, change, S):
    """Make the stress's product with the change of the strain that of the law's energy.

    The discrete gradient of Gonzalez (2000).

    Parameters
    ----------
    law
        LawTables.
    middle, change
        Mean of both strains and their difference, shape (3, n, elements).
    S
        The stress of the mean; changed.
    """
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
    """The LawTables of a law; one in Python is kept as long as its ``owner`` lives.

    Parameters
    ----------
    law
        Of a material: an object with ``energy``, ``stress`` and ``moduli``.
    owner
        What asks it.
    """
    one = np.ones(3)
    if isinstance(law, LinearLaw):
        return LawTables(LINEAR, 0, 0, np.array(law.D, dtype=float), np.zeros(3), one)
    base, scale = (law.base, law.scale) if type(law) is ShearCorrected else (law, one)
    handle, kind, constants = next(_handles), OWN, np.zeros(3)
    if isinstance(base, PointwiseMaterial) and base.is_pointwise:
        kind, constants = POINTWISE, np.array(base.constants, dtype=float)
    _LAWS[handle] = base
    weakref.finalize(owner, _LAWS.pop, handle, None)
    with np.errstate(all="ignore"):
        D = np.reshape(law.moduli(np.zeros((3, 1, 1))), (3, 3))
    return LawTables(kind, handle, 0, np.array(D), constants, np.array(scale, dtype=float))


#: Of cables, which have moduli alone.
NO_LAW = LawTables(LINEAR, 0, 0, np.zeros((3, 3)), np.zeros(3), np.ones(3))
