"""Coefficients of the implicit time steps.

Generalised-alpha: second order, stable for any step, and damping only what the step
does not resolve (Chung and Hulbert, J. Appl. Mech. 60 (1993) 371). Contact is
enforced at the end of a step; its force enters the balance with the same weights as
the elastic forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fegear.dynamics.kernels import newmark
from fegear.dynamics.kernels.step_arrays import Newmark
from lumped.common.array_types import Array


@dataclass(frozen=True)
class Scheme:
    """M a(n+1-am) + C v(n+1-af) + K q(n+1-af) = f(n+1-af), with Newmark's rules.

    alpha_m, alpha_f, gamma, beta : as printed there
    """

    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float

    def weights(self, step: float) -> tuple[float, float, float]:
        """Weights of mass, damping and stiffness in the matrix that a step [s]
        inverts.
        """
        new = 1.0 - self.alpha_f
        return 1.0 - self.alpha_m, new * self.gamma * step, new * self.beta * step**2

    def newmark(self, step: float) -> Newmark:
        """Coefficients of the compiled steps for a step [s]."""
        return Newmark(step, self.alpha_m, self.alpha_f, self.gamma, self.beta)

    def predicted(self, step: float, state: Array) -> tuple[Array, Array]:
        """Displacement and velocity after a step without acceleration at its end.

        state : displacement, velocity and acceleration, and what else follows
        """
        u_pred, v_pred = newmark.predict(self.newmark(step), *state[:3])
        return u_pred, v_pred

    def corrected(self, step: float, state: Array, acceleration: Array) -> Array:
        """Displacement, velocity and acceleration with it (3, ...)."""
        u_pred, v_pred = self.predicted(step, state)
        u, v = newmark.correct(self.newmark(step), u_pred, v_pred, acceleration)
        return np.stack([u, v, acceleration])


def generalized_alpha(rho_inf: float) -> Scheme:
    """The scheme with spectral radius rho_inf (0 to 1) at infinite frequency.

    It leaves that part of an unresolved vibration a step; Chung and Hulbert, eq. 25.

    Raises ValueError outside of that.
    """
    if not 0.0 <= rho_inf <= 1.0:
        raise ValueError(f"rho_inf = {rho_inf}; must be from 0 to 1")
    alpha_m = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0)
    alpha_f = rho_inf / (rho_inf + 1.0)
    lag = alpha_f - alpha_m
    return Scheme(alpha_m, alpha_f, 0.5 + lag, 0.25 * (1.0 + lag) ** 2)
