"""The problems, each told in the terms of a rod so that every code can build it."""

from dataclasses import dataclass

import numpy as np

GRAVITY = 9.81


@dataclass(frozen=True)
class Problem:
    """A straight beam along x, with one support, one load, and a time to integrate to.

    Attributes
    ----------
    name, title
        What files and figures call it.
    L, h, b, E, nu, rho
        Length, height, width, modulus, Poisson ratio, density.
    support
        Of the left end: "clamp", "pin", "arm" (it turns by :func:`arm_angle`) or "free".
    load
        "gravity"; "force", "traction" (both downwards, at the right end) or "moment", of size
        ``value``; or None.
    t_end
        None for a static problem.
    """

    name: str
    title: str
    L: float
    h: float
    b: float
    E: float
    nu: float
    rho: float
    support: str
    load: str | None = None
    value: float = 0.0
    t_end: float | None = None

    @property
    def EA(self):
        return self.E * self.b * self.h

    @property
    def EI(self):
        return self.E * self.b * self.h**3 / 12.0

    @property
    def GA(self):
        """Shear stiffness, with the shear factor of a rectangle."""
        nu = self.nu
        return 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * self.EA / (2.0 * (1.0 + nu))

    @property
    def tip(self):
        return (self.L, 0.0)


def arm_angle(t):
    """Angle of the rotating arm of Simo and Vu-Quoc (1986), for t up to 15 s."""
    return 0.4 * (0.5 * t * t + (7.5 / np.pi) ** 2 * (np.cos(2.0 * np.pi * t / 15.0) - 1.0))


def throw(X, L):
    """Velocity of the axis across the thrown rod, and its derivative by X.

    It turns and bends; the rate of the curvature and its slope vanish at the free ends.
    """
    s = 2.0 * X / L - 1.0
    bend = s**2 / 2.0 - s**4 / 6.0 + s**6 / 30.0 - 29.0 / 210.0
    slope = s - 2.0 * s**3 / 3.0 + s**5 / 5.0
    return 6.0 * s + 17.0 * bend, (6.0 + 17.0 * slope) * 2.0 / L


THROW_ALONG = 1.0  # m/s, along the axis


def soft(name, title, support, load="gravity", slenderness=100.0, **options):
    """The beam of example 5.2: L = 1, EI and the mass kept at every slenderness."""
    h = 1.0 / slenderness
    return Problem(name, title, 1.0, h, 0.01, 2e8 * (0.01 / h) ** 3, options.pop("nu", 0.3),
                   7800.0 * 0.01 / h, support, load, **options)


ARM = np.sqrt(12.0 * 1.4e4 / 2.8e7)  # height of a square section with the arm's EA and EI
PROBLEMS = {p.name: p for p in (
    soft("5.2", "gravity cantilever 5.2, L/h = 100", "clamp"),
    soft("5.2-1e3", "gravity cantilever, L/h = 1e3", "clamp", slenderness=1e3),
    soft("5.2-1e4", "gravity cantilever, L/h = 1e4", "clamp", slenderness=1e4),
    Problem("5.1", "small deflection 5.1", 1.0, 0.01, 0.01, 2e11, 0.3, 7800.0, "clamp", "force",
            10.0),
    Problem("thick", "thick continuum", 2.0, 0.5, 0.1, 2.07e11, 0.3, 7800.0, "clamp", "traction",
            62.5e6),
    soft("roll-up", "roll-up by an end moment", "clamp", "moment", nu=0.0,
         value=2.0 * np.pi * 2e8 * 0.01**4 / 12.0),
    soft("pendulum", "soft pendulum 5.5, 1 s", "pin", t_end=1.0),
    Problem("spin-up", "spin-up of an arm, 5 s", 10.0, ARM, ARM, 2.8e7 / ARM**2, 0.3,
            1.2 / ARM**2, "arm", t_end=5.0),
    soft("free-rod", "thrown rod, 0.5 s", "free", None, t_end=0.5),
)}
