"""Newmark's rules of displacement and velocity over a step.

Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67, with the parameters gamma and beta of
`fegear.dynamics.scheme`.
"""

from __future__ import annotations

from lumped.common.compiled import inlined


def predict(step, u, v, a):
    """(u_pred, v_pred) at the end of a step whose acceleration there is 0.

    u, v, a : displacement, velocity and acceleration at its start, numbers or arrays
    """
    h = step.h
    return (
        u + h * v + h * h * (0.5 - step.beta) * a,
        v + h * (1.0 - step.gamma) * a,
    )


def correct(step, u_pred, v_pred, a):
    """(u, v) at the end of a step with the acceleration a there."""
    h = step.h
    return u_pred + step.beta * h * h * a, v_pred + step.gamma * h * a


newmark_predict = inlined(predict)
newmark_correct = inlined(correct)
