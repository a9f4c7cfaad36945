"""The energy-momentum scheme."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .base import Motion, Scheme, Step

if TYPE_CHECKING:
    from ..system import System


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
    while it meets both at the end of every step. gamma is of the size of dt^2.

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
    couples_velocity = True
    compiled = True, (0.0, 0.0, 0.25, 0.5)

    def begin(self, system: System, y: Motion, dt: float) -> Step:
        return _Step(system, y, dt)

    def __repr__(self):
        return "<EnergyMomentum>"


class _Step(Step):
    def __init__(self, system, y, dt):
        self.system, self.y, self.dt = system, y, dt
        self.t, self.joint_time = y.t + dt, y.t + 0.5 * dt
        self.guess = y.u + dt * y.v + 0.5 * dt * dt * y.acceleration
        self.mass_factor, self.stiffness_factor = 2.0 / dt**2, 0.5
        self._strain0 = system.strains(y.u)

    def force(self, u):
        s, y = self.system, self.y
        return (s.mean_external_force(y.u, u, y.t, self.t)
                - s.mean_internal_force(y.u, u, self._strain0))

    def acceleration(self, u):
        return (u - self.y.u - self.dt * self.y.v) * (2.0 / self.dt**2)

    def support_acceleration(self, v, a):
        return (v - self.y.v[self.system.fixed]) / self.dt

    def velocity(self, u):
        return (u - self.y.u) * (2.0 / self.dt) - self.y.v

    def middle(self, u):
        return 0.5 * (self.y.u + u)

    def finish(self, u, v, multipliers, impulse):
        y, dt = self.y, self.dt
        middle, force = (v - y.v) / dt, multipliers + impulse / dt
        # what acts at the middle of the step, extrapolated to its end from the last two steps
        ahead = dt / (dt + y.before)
        return Motion(self.t, u, v, middle + ahead * (middle - y.algorithmic), middle,
                      force + ahead * (force - y.force), force, dt)
