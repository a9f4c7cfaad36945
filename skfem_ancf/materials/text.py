"""Laws as texts: fast in every scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .base import Material

if TYPE_CHECKING:
    from ..core.types import Array


class TextMaterial(Material):
    """A law given by a text, see :mod:`skfem_ancf.core.source`: compiled code calls it as NumPy
    does.

    A subclass has a static method ``text(constants, strain, out)``, marked by
    :func:`~skfem_ancf.core.source.source`, and :attr:`constants`. The text takes strains
    (eps_xx, eps_yy, 2 eps_xy) of shape (3, n, m) and writes to ``out`` what its first length
    asks for: 1 for the energy per volume, 3 for the second Piola-Kirchhoff stress, 9 for the
    moduli, row by row. Parameters are those of :class:`~skfem_ancf.materials.base.Material`.

    A subclass that overrides ``energy``, ``stress`` or ``moduli`` runs in NumPy.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf.materials import TextMaterial
    >>> from skfem_ancf.core.source import lanes, source
    >>> class Springs(TextMaterial):
    ...     constants = property(lambda self: np.array([self.E]))
    ...
    ...     @staticmethod
    ...     @source
    ...     def text(constants, strain, out):
    ...         for c in range(3):
    ...             for p in lanes(strain.shape[1]):
    ...                 for e in lanes(strain.shape[2]):
    ...                     S = constants[0] * strain[c, p, e]
    ...                     if len(out) == 3:
    ...                         out[c, p, e] = S
    ...                     elif len(out) == 9:
    ...                         for d in range(3):
    ...                             out[3 * c + d, p, e] = constants[0] * (c == d)
    ...                     else:
    ...                         W = 0.5 * strain[c, p, e] * S
    ...                         out[0, p, e] = W + (out[0, p, e] if c else 0.0)
    >>> Springs(2.0, 0.0).stress(np.array([0.5, 0.0, 0.0])).tolist()
    [1.0, 0.0, 0.0]
    """

    text: Any = None

    @property
    def constants(self) -> Array:
        """Numbers that the text takes, shape (k,)."""
        raise NotImplementedError(f"{type(self).__name__} has a text and no constants")

    @property
    def has_text(self) -> bool:
        """True if the text is the energy, the stress and the moduli."""
        return self.text is not None and all(
            getattr(type(self), name) is getattr(TextMaterial, name)
            for name in ("energy", "stress", "moduli"))

    def energy(self, strain: Array) -> Array:
        return self.evaluated(strain, 1)[0]

    def stress(self, strain: Array) -> Array:
        return self.evaluated(strain, 3)

    def moduli(self, strain: Array) -> Array:
        found = self.evaluated(strain, 9)
        return found.reshape((3, 3) + found.shape[1:])

    def evaluated(self, strain: Array, number: int) -> Array:
        """What the text gives.

        Parameters
        ----------
        strain
            Shape (3, ...).
        number
            1, 3 or 9, or what else the text knows.

        Returns
        -------
        ndarray
            Shape (number, ...).
        """
        strain = np.asarray(strain)
        strain = strain.astype(np.result_type(strain, float), copy=False)
        out = np.empty((number, 1, strain[0].size), strain.dtype)
        self.text(self.constants, strain.reshape(3, 1, -1), out)
        return out.reshape((number,) + strain.shape[1:])
