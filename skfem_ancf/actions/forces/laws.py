"""User-defined laws of springs and dashpots: force of elongation, angle or rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from ...core.errors import InputError, ask_number, require_function, require_not_negative, shown
from ...core.quadrature import gauss

#: Points by which the work between two states of a step is integrated.
POINTS = 8
#: Relative round-off of a potential.
ROUND_OFF = 1e-13
#: Relative step of the differences that give the slope of a law.
STEP = 1e-6


class Law:
    """A force, or moment, as a function of one number, with its potential.

    ``given`` is the function, or a pair of it and its potential, by default the integral from zero.
    ``name`` and ``of`` are for messages.

    Examples
    --------
    >>> law = Law("k", lambda s: 3.0 * s**2)
    >>> law(2.0), round(law.potential(2.0), 12), round(law.slope(2.0), 6)
    (12.0, 8.0, 12.0)
    """

    def __init__(self, name: str, given: Any, of: str = "elongation") -> None:
        pair = given if isinstance(given, (tuple, list)) else (given,)
        if not 1 <= len(pair) <= 2 or any(isinstance(part, type) for part in pair):
            raise InputError(f"{name} must be a number, a function of the {of}, or a function and "
                             f"its potential, got {shown(given)}")
        what = f"of the {of} that returns a number"
        self.name, self.of = name, of
        self.function: Callable[[float], float] = require_function(name, pair[0], what)
        self.energy: Any = None if len(pair) == 1 else require_function(
            f"the potential of {name}", pair[1], what)

    def __call__(self, s: float) -> float:
        """The force at s."""
        return ask_number(f"{self.name}({self.of} = {{:g}})", self.function, float(s))

    def potential(self, s: float) -> float:
        """Potential at s, by default the integral of the force from zero."""
        if self.energy is not None:
            return ask_number(f"the potential of {self.name} at {{:g}}", self.energy, float(s))
        return float(scipy.integrate.quad(self, 0.0, s, epsabs=0.0, epsrel=1e-12, limit=200)[0])

    def work(self, a: float, b: float) -> float:
        """Change of the potential from a to b."""
        if self.energy is not None:
            return self.potential(b) - self.potential(a)
        return (b - a) * self.mean(a, b)

    def mean(self, a: float, b: float) -> float:
        """Mean force from a to b: :meth:`work` over b - a."""
        if a == b:
            return self(a)
        x, w = gauss(POINTS)
        found = float(np.dot(w, [self(a + (b - a) * z) for z in x]))
        if self.energy is not None:
            before, after = self.potential(a), self.potential(b)
            missing = after - before - (b - a) * found
            if abs(missing) > ROUND_OFF * (abs(before) + abs(after)):
                found += missing / (b - a)
        return found

    def slope(self, s: float, scale: float = 1.0) -> float:
        """Derivative at s by differences."""
        d = STEP * max(abs(s), scale)
        return (self(s + d) - self(s - d)) / (2.0 * d)

    def __repr__(self) -> str:
        return f"<{self.name} {shown(self.function)}>"


class Proportional(float):
    """A linear law."""

    def __call__(self, s: float) -> float:
        return self * s

    def potential(self, s: float) -> float:
        return 0.5 * self * s * s

    def work(self, a: float, b: float) -> float:
        return 0.5 * self * (b - a) * (b + a)

    def mean(self, a: float, b: float) -> float:
        return 0.5 * self * (a + b)

    def slope(self, s: float, scale: float = 1.0) -> float:
        return float(self)

    def __repr__(self) -> str:
        return f"{self:g}"


def number_or_law(name: str, given: Any, of: str) -> Proportional | Law:
    """A non-negative number or a function as a law."""
    if isinstance(given, Law):
        return given
    if callable(given) or isinstance(given, (tuple, list)):
        law = Law(name, given, of)
        if of.endswith("rate") and law(0.0) != 0.0:
            raise InputError(f"{name} is a force of the {of}, and must be 0 where that is 0, got "
                             f"{law(0.0):g}")
        return law
    return Proportional(require_not_negative(name, given))
