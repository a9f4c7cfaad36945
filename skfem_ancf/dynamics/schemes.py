"""The energy-momentum schemes and the generalised-alpha family, schemes by name, and the choice of
one by ``scheme="auto"``."""

from typing import Any, NamedTuple

import numpy as np

from ..actions.obstacles.contact import may_touch
from ..core import Array, refuse, require_finite_scalar, require_option
from ..equations.system import System
from .base import Motion, Scheme, derivative, grown
from .collocation import Gauss, Radau

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


# the generalised-alpha family: Chung-Hulbert, HHT and Newmark

class GeneralizedAlpha(Scheme):
    """Generalised-alpha: second order, with numerical damping of high frequencies.

    The equation of motion holds at the end of each step,
    ``M a_{n+1} + f(u_{n+1}) = Q_{n+1}``, and Newmark's formulas use an acceleration ``w`` with
    ``(1 - alpha_m) w_{n+1} + alpha_m w_n = (1 - alpha_f) a_{n+1} + alpha_f a_n``.

    Parameters
    ----------
    rho_inf
        Spectral radius at infinite frequency, from 0 (annihilated in one step) to 1 (no damping).
        With 1, accelerations and reactions oscillate from step to step in stiff beams.

    References
    ----------
    Chung, Hulbert: "A time integration algorithm for structural dynamics with improved numerical
    dissipation", Journal of Applied Mechanics 60 (1993), eq. (17), (25); in this form, which is of
    second order with constraints too, Arnold, Bruls: "Convergence of the generalized-alpha scheme
    for constrained mechanical systems", Multibody System Dynamics 18 (2007), eq. (7)-(9).
    """

    name = "generalized-alpha"

    def __init__(self, rho_inf: float = 0.9) -> None:
        rho = require_finite_scalar("rho_inf", rho_inf)
        refuse(not 0.0 <= rho <= 1.0, "rho_inf must lie in [0, 1], got {!r}", rho)
        self.set_parameters((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0))

    def set_parameters(self, alpha_m: float, alpha_f: float) -> None:
        """Set alpha_m and alpha_f, and the optimal gamma and beta for second order.

        Parameters
        ----------
        alpha_m, alpha_f
            Weights of the old accelerations.
        """
        self.alpha_m, self.alpha_f = alpha_m, alpha_f
        self.gamma = 0.5 + alpha_f - alpha_m
        self.beta = 0.25 * (self.gamma + 0.5) ** 2

    @property
    def error_constant(self) -> float:  # type: ignore[override]
        return abs(self.beta - 1.0 / 6.0)

    @property
    def parameters(self) -> tuple[float, ...]:  # type: ignore[override]
        return self.alpha_m, self.alpha_f, self.beta, self.gamma

    def local_error(self, old: Motion, new: Motion, dt: float) -> Array:
        # numerical damping of first order, if gamma exceeds its value for second order
        damping = 0.5 * (self.gamma - 0.5 - self.alpha_f + self.alpha_m)
        return super().local_error(old, new, dt) + damping * dt * (new.v - old.v)

    def __repr__(self):
        return (f"<{type(self).__name__} alpha_m={self.alpha_m:.4g} alpha_f={self.alpha_f:.4g} "
                f"beta={self.beta:.4g} gamma={self.gamma:.4g}>")


class HHT(GeneralizedAlpha):
    """The scheme of Hilber, Hughes and Taylor.

    See Hilber, Hughes, Taylor: "Improved numerical dissipation for time integration algorithms in
    structural dynamics", Earthquake Engineering and Structural Dynamics 5 (1977).

    Parameters
    ----------
    alpha
        From 0 (no damping) to 1/3; the authors' alpha is its negative.
    """

    name = "hht"

    def __init__(self, alpha: float = 0.05) -> None:
        alpha = require_finite_scalar("alpha", alpha)
        refuse(not 0.0 <= alpha <= 1.0 / 3.0, "alpha must lie in [0, 1/3], got {!r}", alpha)
        self.set_parameters(0.0, alpha)


class Newmark(GeneralizedAlpha):
    """Newmark's scheme; by default the trapezoidal rule, beta = 1/4, gamma = 1/2.

    See Newmark: "A method of computation for structural dynamics", Journal of the Engineering
    Mechanics Division ASCE 85 (1959).

    Parameters
    ----------
    beta, gamma
        Newmark's parameters; second order for gamma = 1/2 only.
    """

    name = "newmark"

    def __init__(self, beta: float = 0.25, gamma: float = 0.5) -> None:
        self.set_parameters(0.0, 0.0)
        self.beta = require_finite_scalar("beta", beta)
        self.gamma = require_finite_scalar("gamma", gamma)
        refuse(self.gamma < 0.5 or self.beta < 0.5 * self.gamma, "unconditional stability needs 2 "
               "beta >= gamma >= 1/2, got beta = {!r}, gamma = {!r}", beta, gamma)
        self.order = 2 if self.gamma == 0.5 else 1


# schemes by name, and the choice of one

#: The schemes by name.
SCHEMES = {cls.name: cls for cls in (EnergyMomentum, EnergyMomentum4, GeneralizedAlpha, HHT,
                                    Newmark, Gauss, Radau)}


def get_scheme(scheme: str | Scheme | type[Scheme]) -> Scheme:
    """A :class:`Scheme` from its name, its class or itself.

    Raises
    ------
    NameUnknown
        If the name is not known; the message lists the known ones.
    """
    if isinstance(scheme, Scheme):
        return scheme
    if isinstance(scheme, type) and issubclass(scheme, Scheme):
        return scheme()
    return SCHEMES[require_option("scheme", scheme, SCHEMES)]()
#: Tolerance below which schemes of high order are cheaper.
FINE = 1e-4
#: Ratio of axial to bending frequencies above which a beam is stiff.
STIFF = 1e3
#: Default tolerance.
RTOL = 1e-5


class Choice(NamedTuple):
    """A scheme, and the reason for it."""

    scheme: Scheme
    reason: str


def choose_scheme(system: System, rtol: float = RTOL) -> Choice:
    """Choose the scheme for a system.

    * contact, frames, materials with a history: ``energy-momentum``,
    * ``rtol`` above 1e-4: ``energy-momentum`` without damping, else ``generalized-alpha``,
    * joints, damping or stiff beams: ``radau``, which damps what steps do not resolve,
    * all others: ``gauss`` with three points.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.
    rtol
        Tolerance, relative to the size of the scene.

    Examples
    --------
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.dynamics import choose_scheme
    >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamCable(3),
    ...                    StVenantKirchhoff(2e8, 0.3, 7800.0), width=0.1)).clamp("left")
    >>> choose_scheme(scene.system)
    Choice(scheme=<Gauss, 3 points>, reason='rtol = 1e-05, nothing is lost, no joints')
    >>> choose_scheme(scene.system, 1e-3).scheme
    <EnergyMomentum>
    """
    asked = f"rtol = {rtol:g}"
    if may_touch(system):
        return Choice(EnergyMomentum(), "obstacles or contact: touching is a kink, and energy is "
                                        "kept")
    if system.histories.lasting > 1:
        return Choice(EnergyMomentum(), "a material with a history")
    if system.mass_solver.by_nodes:
        return Choice(EnergyMomentum(), "a frame: its nodes are eliminated")
    if not all(domain.symmetric for domain in system.domains):
        return Choice(GeneralizedAlpha(), "a domain without an energy")
    if rtol > FINE:
        if system.damped:
            return Choice(GeneralizedAlpha(), f"{asked}, damping")
        return Choice(EnergyMomentum(), f"{asked}, nothing is lost")
    found = [text for text, there in (("joints", system.constraints.m > 0),
                                      ("damping", system.damped)) if there]
    # A wave crosses an element of length L / n in ``L / (n c)``, bending has the frequency ``pi^2 c
    # h / (sqrt(12) L^2)``: the ratio of axial to bending frequencies is about ``0.7 n L / h``.
    ratio = max((0.7 * b.mesh.nelements * float(np.sum(b.mesh.lengths)) / b.mesh.height
                 for b in system.beams), default=1.0)
    if not found and ratio > STIFF:
        found = ["vibrations that no step resolves"]
    if found:
        return Choice(Radau(), f"{asked}, " + ", ".join(found))
    return Choice(Gauss(3), f"{asked}, nothing is lost, no joints")
