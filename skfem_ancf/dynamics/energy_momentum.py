"""The energy-momentum schemes."""

from __future__ import annotations

from typing import Any

from ..core import Array, refuse
from ..equations.system import System
from .base import Motion, Scheme, derivative, grown

#: Fractions of a step of fourth order; all intermediate times lie within the step.
LONG = 1.0 / (4.0 - 4.0**(1.0 / 3.0))
PARTS = LONG, LONG, 1.0 - 4.0 * LONG, LONG, LONG


class EnergyMomentum(Scheme):
    """Conserves energy, momentum and angular momentum; second order.

    With the mean values u_m and v_m of the step,

    * ``M (v_1 - v_0) / dt = Q - B(u_m)^T S - J(u_m)^T lambda - (gamma . Phi'') v_m``,
    * ``(u_1 - u_0) / dt = v_m + M^-1 J(u_m)^T gamma``,
    * ``Phi(u_1) = 0`` and ``J(u_1) v_1 = 0``.

    The strain is quadratic in u, so that ``eps_1 - eps_0 = B(u_m) (u_1 - u_0)``, and a stress with
    ``S . (eps_1 - eps_0) = W_1 - W_0`` conserves the energy: for St. Venant-Kirchhoff the mean of
    both stresses, else the discrete gradient. Constraints Phi are quadratic too; the multipliers
    lambda and gamma (of size dt^2) enforce them and their rates at the end of each step without
    work. For a sleeve, which is not quadratic, J is a discrete gradient and the gamma term is
    corrected (:meth:`~skfem_ancf.actions.joints.Joint.mean_entries`, ``mean_turning``).

    References
    ----------
    Simo, Tarnow: "The discrete energy-momentum method. Conserving algorithms for nonlinear
    elastodynamics", ZAMP 43 (1992); for other laws Gonzalez: "Exact energy and momentum conserving
    algorithms for general models in nonlinear elasticity", CMAME 190 (2000), eq. (36); for joints
    Gear, Leimkuhler, Gupta: "Automatic integration of Euler-Lagrange equations with constraints",
    Journal of Computational and Applied Mathematics 12-13 (1985).
    """

    name = "energy-momentum"
    tol = 1e-14  # round-off: a residual changes the energy
    conserving = True
    parameters = (0.0, 0.0, 0.5, 1.0)

    def __repr__(self):
        return "<EnergyMomentum>"

    def require(self, system: System) -> None:
        for domain in system.domains:
            refuse(not domain.symmetric, "the tangent of {!r} is not symmetric: there is no energy "
                   "that the scheme could conserve. Use 'generalized-alpha' or 'radau', or forms "
                   "that are derivatives of an energy", domain)


class EnergyMomentum4(EnergyMomentum):
    """Conserves energy, momentum and angular momentum; fourth order.

    A composition of five steps of :class:`EnergyMomentum` with 0.41, 0.41, -0.66, 0.41 and 0.41
    times the step size. It conserves what each step conserves. The step back in time excludes
    damping and friction. See Suzuki: "Fractal decomposition of exponential operators with
    applications to many-body theories and Monte Carlo simulations", Physics Letters A 146 (1990);
    Hairer, Lubich, Wanner: "Geometric Numerical Integration", II.4, example 4.3.

    Examples
    --------
    >>> from skfem_ancf.dynamics import get_scheme
    >>> get_scheme("energy-momentum-4").order
    4
    """

    name = "energy-momentum-4"
    order = 4
    filtered = 2
    error_constant = abs(sum(part**5 for part in PARTS)) / 80.0

    def __repr__(self):
        return "<EnergyMomentum4>"

    def require(self, system: System) -> None:
        super().require(system)
        refuse(system.histories.evolve, "{!r} takes a part of each step back in time, which "
               "materials and items with a history do not know: use 'energy-momentum', "
               "'generalized-alpha', 'gauss' or 'radau'", self)
        refuse(system.damped or system.histories.dissipates, "{!r} takes a part of each step back "
               "in time, where damping and friction would add energy: use 'energy-momentum', or "
               "'radau' for high order", self)

    def step(self, integrator: Any, y: Motion, dt: float) -> Motion:
        begin, lost, parts = y.t, y.dissipated, []
        for part in PARTS:
            y = integrator.take(y, part * dt)
            parts.append(y)
        new = integrator.start(y.u, y.v, begin + dt, dt, ahead=False,
                               history=y.history)
        new.dissipated, new.start, new.parts = lost, y.start, parts
        return new

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        """Estimate the error that a step adds to the displacement, shape (N,).

        For a vibration of frequency w, a part p of a step has the phase error (w p)^3 / 12 -
        (w p)^5 / 80; the cubic terms cancel. The estimate is therefore dt^5 / 80 times the sum of
        the fifth powers of the fractions times the third derivative of the acceleration, by
        differences over the ends of whole steps.

        Parameters
        ----------
        old, new, dt
            Start and end of the step, and its size.
        """
        if "values" not in (old.memory or {}):
            derivative(old, old, old.t, old.acceleration, 3)
        k, high, lower = derivative(old, new, new.t, new.acceleration, 3)
        assert lower is not None  # there are at least two values
        return self.error_constant * dt**2 * grown(dt**k * high, dt**(k - 1) * lower, 3 - k)
