"""Coefficients of the implicit time steps.

Generalised-alpha: second order, stable for any step, and damping only what the step
does not resolve (Chung and Hulbert, J. Appl. Mech. 60 (1993) 371). Contact is
enforced at the end of a step; its force enters the balance with the same weights as
the elastic forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
        """Of mass, damping and stiffness in the matrix that a step [s] inverts."""
        late = 1.0 - self.alpha_f
        return (
            1.0 - self.alpha_m,
            late * self.gamma * step,
            late * self.beta * step**2,
        )

    def newmark(self, step: float) -> tuple[float, float, float, float, float]:
        """What the compiled steps need to know of a step [s]."""
        return step, self.alpha_m, self.alpha_f, self.gamma, self.beta

    def predicted(self, step: float, state: Array) -> tuple[Array, Array]:
        """Displacement and velocity after a step without acceleration at its end.

        state : displacement, velocity and acceleration, and what else follows
        """
        q, v, a = state[:3]
        ahead = q + step * v + (step * step * (0.5 - self.beta)) * a
        return ahead, v + (step * (1.0 - self.gamma)) * a

    def corrected(self, step: float, state: Array, acceleration: Array) -> Array:
        """Displacement, velocity and acceleration with it (3, ...)."""
        ahead, faster = self.predicted(step, state)
        ahead += (step * step * self.beta) * acceleration
        faster += (step * self.gamma) * acceleration
        return np.stack([ahead, faster, acceleration])


def generalized_alpha(remaining: float) -> Scheme:
    """The scheme that leaves `remaining` (0 to 1) of an unresolved vibration a step.

    Raises ValueError outside of that.
    """
    if not 0.0 <= remaining <= 1.0:
        raise ValueError(f"remaining must be from 0 to 1, got {remaining}")
    alpha_m = (2.0 * remaining - 1.0) / (remaining + 1.0)
    alpha_f = remaining / (remaining + 1.0)
    lag = alpha_f - alpha_m
    return Scheme(alpha_m, alpha_f, 0.5 + lag, 0.25 * (1.0 + lag) ** 2)
