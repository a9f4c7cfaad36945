"""The generalised-alpha family: Chung-Hulbert, HHT and Newmark."""

from __future__ import annotations

from ..core import Array, refuse, require_finite_scalar
from .base import Motion, Scheme


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
