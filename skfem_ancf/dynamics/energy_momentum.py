"""The energy-momentum scheme."""

import numpy as np

from .base import Motion, Scheme, Step


class EnergyMomentum(Scheme):
    """Conserves energy, momentum and angular momentum; second order.

    ``M (v_{n+1} - v_n) / dt + B(u_{n+1/2})^T S = Q``, ``u_{n+1} - u_n = dt (v_n + v_{n+1}) / 2``.
    The strain is quadratic in the coordinates, so ``eps_{n+1} - eps_n = B(u_{n+1/2}) (u_{n+1} -
    u_n)``, and a stress S with ``S . (eps_{n+1} - eps_n) = W_{n+1} - W_n`` conserves the energy: the
    mean of the two stresses for St. Venant-Kirchhoff, the discrete gradient for other laws. Joints
    act with their derivative at the midpoint and are met at the end of the step.

    References
    ----------
    Simo, Tarnow: "The discrete energy-momentum method. Conserving algorithms for nonlinear
    elastodynamics", ZAMP 43 (1992); for other laws Gonzalez: "Exact energy and momentum conserving
    algorithms for general models in nonlinear elasticity", CMAME 190 (2000), eq. (36).
    """

    name = "energy-momentum"
    tol = 1e-14  # to round-off: what is left in the residual is lost energy
    projects_velocity = False

    def begin(self, system, y, dt):
        return _Step(system, y, dt)

    def __repr__(self):
        return "<EnergyMomentum>"


class _Step(Step):
    def __init__(self, system, y, dt):
        self.system, self.y, self.dt = system, y, dt
        self.t = y.t + dt
        self.guess = y.u + dt * y.v + 0.5 * dt * dt * y.acceleration
        self.mass_factor, self.stiffness_factor = 2.0 / dt**2, 0.5
        self._strain0 = system.strains(y.u)

    def residual(self, u):
        s, y, dt = self.system, self.y, self.dt
        inertia = s.mass.multiply((u - y.u - dt * y.v) * (2.0 / dt**2))
        return (s.mean_external_force(y.u, u, y.t, self.t)
                - s.mean_internal_force(y.u, u, self._strain0) - inertia)

    def tangent_at(self, u):
        return 0.5 * (self.y.u + u)

    def finish(self, u, multipliers):
        y, dt = self.y, self.dt
        v = (u - y.u) * (2.0 / dt) - y.v
        # extrapolated from the middle of the step to its end, for the next guess only
        middle = (v - y.v) / dt
        previous = y.algorithmic if y.algorithmic is not None else middle
        return Motion(self.t, u, v, 1.5 * middle - 0.5 * previous, middle, multipliers)
