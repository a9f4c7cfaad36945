"""Laws in kernels: Hooke's, those with texts, and any other by calls of its methods."""

import weakref
from itertools import count
from typing import NamedTuple

import numpy as np

from ..materials import LinearLaw, NeoHookean
from ..materials.base import ShearCorrected
from ..materials.neo_hookean import (neo_hookean_constants, neo_hookean_energy,
                                     neo_hookean_moduli, neo_hookean_stress)
from ..source import F1, F2, lanes, primitive, source
from .base import packed

#: Kinds of laws: constant moduli, a law with texts, and any other.
LINEAR, NEO_HOOKEAN, OWN = 0, 1, 2

_LAWS = {}  # by handle, as long as a kernel has them: compiled code holds no Python objects
_handles = count(1)


class LawTables(NamedTuple):
    """A law as compiled code takes it; :func:`law_tables` makes it.

    Attributes
    ----------
    kind, handle
        One of :data:`LINEAR`, :data:`NEO_HOOKEAN`, :data:`OWN`, and what finds an own law.
    D
        Constant moduli, shape (3, 3).
    constants
        Of a law with texts.
    scale
        Factors on the strain, and on the stress: that of shear is sqrt(k_s). Shape (3,).
    """

    kind: int
    handle: int
    D: F2
    constants: F1
    scale: F1


@primitive("primitives")
def own_stress(handle, strain, S):
    """S (3, n, elements) of a law in Python."""
    S[...] = _LAWS[handle].stress(strain)


@primitive("primitives")
def own_moduli(handle, strain, D):
    """Moduli (3, 3, n, elements) of a law in Python."""
    D[...] = _LAWS[handle].moduli(strain)


@primitive("primitives")
def own_energy(handle, strain, W):
    """Energies (n, elements) of a law in Python."""
    W[...] = _LAWS[handle].energy(strain)


@source
def scaled(scale, strain, out):
    """The strain of the law: with its shear corrected."""
    for c in range(3):
        x = scale[c]
        for p in lanes(strain.shape[1]):
            for e in lanes(strain.shape[2]):
                out[c, p, e] = x * strain[c, p, e]


@source
def linear_stress(D, strain, S):
    """S = D eps, shape (3, n, elements)."""
    for c in range(3):
        x, y, z = D[c, 0], D[c, 1], D[c, 2]
        for p in lanes(S.shape[1]):
            for e in lanes(S.shape[2]):
                S[c, p, e] = x * strain[0, p, e] + y * strain[1, p, e] + z * strain[2, p, e]


@source
def law_stress(law, strain, S):
    """Second Piola-Kirchhoff stress (3, n, elements)."""
    if law.kind == LINEAR:
        linear_stress(law.D, strain, S)
        return
    x = np.empty(strain.shape, strain.dtype)
    scaled(law.scale, strain, x)
    if law.kind == NEO_HOOKEAN:
        neo_hookean_stress(law.constants, x, S)
    else:
        own_stress(law.handle, x, S)
    scaled(law.scale, S, S)


@source
def law_moduli(law, strain, D):
    """The stress's derivative by the strain, (3, 3, n, elements), of a law that is not linear."""
    x = np.empty(strain.shape, strain.dtype)
    scaled(law.scale, strain, x)
    if law.kind == NEO_HOOKEAN:
        neo_hookean_moduli(law.constants, x, D)
    else:
        own_moduli(law.handle, x, D)
    for c in range(3):
        for d in range(3):
            y = law.scale[c] * law.scale[d]
            for p in lanes(D.shape[2]):
                for e in lanes(D.shape[3]):
                    D[c, d, p, e] *= y


@source
def law_energy(law, strain, W):
    """Energy per volume (n, elements)."""
    x = np.empty(strain.shape, strain.dtype)
    if law.kind == LINEAR:
        linear_stress(law.D, strain, x)
        for p in lanes(W.shape[0]):
            for e in lanes(W.shape[1]):
                W[p, e] = 0.5 * (strain[0, p, e] * x[0, p, e] + strain[1, p, e] * x[1, p, e]
                                 + strain[2, p, e] * x[2, p, e])
        return
    scaled(law.scale, strain, x)
    if law.kind == NEO_HOOKEAN:
        neo_hookean_energy(law.constants, x, W)
    else:
        own_energy(law.handle, x, W)


@source
def mean_stress(law, middle, change, S):
    """A stress whose product with the change of the strain is that of the law's energy.

    The stress of the middle for a linear law, else the discrete gradient of Gonzalez (2000).

    Parameters
    ----------
    law
        LawTables.
    middle, change
        Mean of both strains and their difference, shape (3, n, elements).
    S
        The result.
    """
    law_stress(law, middle, S)
    if law.kind == LINEAR:
        return
    n, size = S.shape[1], S.shape[2]
    x, W = np.empty(S.shape), np.empty((2, n, size))
    for k in range(2):
        for c in range(3):
            for p in lanes(n):
                for e in lanes(size):
                    x[c, p, e] = middle[c, p, e] + (k - 0.5) * change[c, p, e]
        law_energy(law, x, W[k])
    for p in lanes(n):
        for e in lanes(size):
            a, b, c = change[0, p, e], change[1, p, e], change[2, p, e]
            square = a * a + b * b + c * c
            missing = W[1, p, e] - W[0, p, e] - (S[0, p, e] * a + S[1, p, e] * b + S[2, p, e] * c)
            share = missing * (square > 1e-24) / np.maximum(square, 1e-24)
            S[0, p, e] += share * a
            S[1, p, e] += share * b
            S[2, p, e] += share * c


def law_tables(law, owner):
    """The LawTables of a law; one in Python is kept as long as its ``owner`` lives."""
    none, one = np.zeros((3, 3)), np.ones(3)
    if isinstance(law, LinearLaw):
        return LawTables(LINEAR, 0, packed(law.D), np.zeros(3), one)
    base, scale = (law.base, law.scale) if type(law) is ShearCorrected else (law, one)
    if isinstance(base, NeoHookean) and base.has_texts:
        return LawTables(NEO_HOOKEAN, 0, none, neo_hookean_constants(base), packed(scale))
    handle = next(_handles)
    _LAWS[handle] = base
    weakref.finalize(owner, _LAWS.pop, handle, None)
    return LawTables(OWN, handle, none, np.zeros(3), packed(scale))
