"""Names of types for annotations: what arguments are, and what comes back."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from numpy.typing import ArrayLike, NDArray

#: An array of numbers; its shape is said where it is used.
Array: TypeAlias = NDArray[Any]

#: What :func:`skfem_ancf.mesh.places.facets_of` takes.
Place: TypeAlias = "str | ArrayLike | Callable[[Array], Array]"

#: What a force is multiplied by: a function of time, or None.
TimeFunction: TypeAlias = "Callable[[float], float] | None"

#: The name of a file.
StrPath: TypeAlias = "str | os.PathLike[str]"

#: Points and weights of a rule on [0, 1].
Rule: TypeAlias = tuple[Array, Array]


class Law(Protocol):
    """What a formulation integrates: functions of the strain (3, ...)."""

    def energy(self, strain: Array) -> Array:
        """Energy per volume, shape (...)."""

    def stress(self, strain: Array) -> Array:
        """Second Piola-Kirchhoff stress, shape (3, ...)."""

    def moduli(self, strain: Array) -> Array:
        """Derivative of the stress, shape (3, 3, ...)."""


class HasShear(Protocol):
    """What a shear factor depends on: whether sections of an element carry the shear parabola."""

    @property
    def carries_shear_parabola(self) -> bool: ...


class Isotropic(Protocol):
    """What the choice of an element reads of a material: its elastic constants."""

    @property
    def E(self) -> float: ...

    @property
    def G(self) -> float: ...

    @property
    def nu(self) -> float: ...

    @property
    def is_hooke(self) -> bool: ...
