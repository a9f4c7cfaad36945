"""The energy-momentum schemes."""

from __future__ import annotations

from typing import Any

from ..core.errors import InputError
from ..core.types import Array
from ..equations.system import System
from .base import Motion, Scheme
from .differences import derivative, grown

#: Parts of a step of fourth order, all of whose ends lie within it.
LONG = 1.0 / (4.0 - 4.0**(1.0 / 3.0))
PARTS = LONG, LONG, 1.0 - 4.0 * LONG, LONG, LONG


class EnergyMomentum(Scheme):
    """Conserves energy, momentum and angular momentum; second order.

    With v and u at the middle of the step, written v_m and u_m,

    * ``M (v_1 - v_0) / dt = Q - B(u_m)^T S - J(u_m)^T lambda - (gamma . Phi'') v_m``,
    * ``(u_1 - u_0) / dt = v_m + M^-1 J(u_m)^T gamma``,
    * ``Phi(u_1) = 0`` and ``J(u_1) v_1 = 0``.

    The strain is quadratic in the coordinates, so ``eps_1 - eps_0 = B(u_m) (u_1 - u_0)``, and a
    stress S with ``S . (eps_1 - eps_0) = W_1 - W_0`` conserves the energy: the mean of the two
    stresses for St. Venant-Kirchhoff, the discrete gradient for other laws. The joints Phi are
    quadratic too, and their velocities J v bilinear in (u, v): the midpoint rule for the
    Hamiltonian to which both are joined by multipliers lambda and gamma conserves the energy
    while it meets both at the end of every step. gamma is of the size of dt^2. Of a sleeve, which
    is not quadratic, J is a discrete gradient, and what has gamma as a factor has the work that is
    missing (:meth:`~skfem_ancf.actions.joints.Joint.mean_entries`, ``mean_turning``).

    References
    ----------
    Simo, Tarnow: "The discrete energy-momentum method. Conserving algorithms for nonlinear
    elastodynamics", ZAMP 43 (1992); for other laws Gonzalez: "Exact energy and momentum conserving
    algorithms for general models in nonlinear elasticity", CMAME 190 (2000), eq. (36); for joints
    Gear, Leimkuhler, Gupta: "Automatic integration of Euler-Lagrange equations with constraints",
    Journal of Computational and Applied Mathematics 12-13 (1985).
    """

    name = "energy-momentum"
    tol = 1e-14  # to round-off: what is left in the residual is lost energy
    conserving = True
    parameters = (0.0, 0.0, 0.5, 1.0)

    def __repr__(self):
        return "<EnergyMomentum>"

    def require(self, system: System) -> None:
        for domain in system.domains:
            if not domain.symmetric:
                raise InputError(f"the tangent of {domain!r} is not symmetric: there is no energy "
                                 "that the scheme could conserve. Take 'generalized-alpha' or "
                                 "'radau', or forms that are derivatives of an energy")


class EnergyMomentum4(EnergyMomentum):
    """Conserves energy, momentum and angular momentum; fourth order.

    Five steps of :class:`EnergyMomentum` of 0.41, 0.41, -0.66, 0.41 and 0.41 times the size: a
    composition of symmetric steps conserves what each of them does, and the parts cancel the
    error of second order. Going back in time, damping and friction would drive: they are refused.

    Of a free rod that turns and bends, the energy has drifted by 5e-11 of itself after 1e5 steps,
    the angular momentum by 1e-11: by round-off, 1e-16 a part of a step.

    Examples
    --------
    >>> from skfem_ancf.dynamics import get_scheme
    >>> get_scheme("energy-momentum-4").order
    4

    References
    ----------
    Suzuki: "Fractal decomposition of exponential operators with applications to many-body theories
    and Monte Carlo simulations", Physics Letters A 146 (1990); Hairer, Lubich, Wanner: "Geometric
    Numerical Integration", II.4, example 4.3.
    """

    name = "energy-momentum-4"
    order = 4
    filtered = 2
    error_constant = abs(sum(part**5 for part in PARTS)) / 80.0

    def __repr__(self):
        return "<EnergyMomentum4>"

    def require(self, system: System) -> None:
        super().require(system)
        if system.damped or system.forces.contacts.lasting:
            raise InputError(f"{self!r} goes back in time in a part of each step, where damping "
                             "and friction drive: take 'energy-momentum', or 'radau' for high "
                             "order")

    def step(self, integrator: Any, y: Motion, dt: float) -> Motion:
        begin, lost = y.t, y.dissipated
        for part in PARTS:
            y = integrator.take(y, part * dt)
        new = integrator.start(y.u, y.v, begin + dt, dt, ahead=False,
                               contacts=y.contacts)
        new.dissipated = lost
        return new

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate of the error that a step adds to the displacement, shape (N,).

        Of a vibration of the frequency w the parts of a step, whose phases lag by (w part)^3 / 12 -
        (w part)^5 / 80, lose (w dt)^5 / 80 times the sum of the fifth powers. So from the third
        derivative of the acceleration at the ends of steps, not of their parts, where it has errors
        of second order.

        Parameters
        ----------
        old, new, dt
            Start and end of the step, and its size.
        """
        if "values" not in (old.memory or {}):
            derivative(old, old, old.t, old.acceleration, 3)
        k, high, lower = derivative(old, new, new.t, new.acceleration, 3)
        assert lower is not None  # of two ends at least
        return self.error_constant * dt**2 * grown(dt**k * high, dt**(k - 1) * lower, 3 - k)
