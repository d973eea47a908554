"""Generalised-alpha on a single oscillator."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fegear.dynamics.scheme import generalized_alpha

REMAINING = [0.0, 0.5, 0.9, 1.0]


def amplification(remaining, omega_h, damping=0.0):
    """Matrix (3, 3) of (q, h v, h^2 a) over a step of q'' + 2 z w q' + w^2 q = 0."""
    s = generalized_alpha(remaining)
    C, K = 2.0 * damping * omega_h, omega_h**2
    mass, drag, spring = s.weights(1.0)
    # Newmark's q and v at the end of the step but for the new acceleration
    q = np.array([1.0, 1.0, 0.5 - s.beta])
    v = np.array([0.0, 1.0, 1.0 - s.gamma])
    late = 1.0 - s.alpha_f
    rest = np.array([0.0, 0.0, s.alpha_m])
    rest = rest + C * (late * v + s.alpha_f * np.array([0.0, 1.0, 0.0]))
    rest = rest + K * (late * q + s.alpha_f * np.array([1.0, 0.0, 0.0]))
    a = -rest / (mass + C * drag + K * spring)
    return np.stack([q + s.beta * a, v + s.gamma * a, a])


def radius(matrix):
    return np.abs(np.linalg.eigvals(matrix)).max()


@pytest.mark.parametrize("remaining", REMAINING)
def test_leaves_of_an_unresolved_vibration_what_it_says(remaining):
    # equal roots, which rounding parts
    assert radius(amplification(remaining, 1e5)) == pytest.approx(remaining, abs=1e-3)


@given(
    remaining=st.floats(0.0, 1.0),
    power=st.floats(-3.0, 6.0),
    damping=st.floats(0.0, 2.0),
)
def test_never_amplifies(remaining, power, damping):
    assert radius(amplification(remaining, 10.0**power, damping)) <= 1.0 + 1e-4


@pytest.mark.parametrize("remaining", REMAINING)
def test_damps_more_the_less_is_resolved(remaining):
    radii = [radius(amplification(remaining, x)) for x in np.geomspace(0.1, 1e3, 12)]
    assert (np.diff(radii) < 1e-4).all()


@pytest.mark.parametrize("remaining", REMAINING)
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_order_is_two(remaining, damping):
    omega, end = 2.0 * np.pi, 1.3
    damped = omega * np.sqrt(1.0 - damping**2)
    exact = np.exp(-damping * omega * end) * (
        np.cos(damped * end) + damping * omega / damped * np.sin(damped * end)
    )
    counts = np.array([80, 160, 320, 640])
    errors = []
    for steps in counts:
        h = end / steps
        state = np.array([1.0, 0.0, -((omega * h) ** 2)])
        one = amplification(remaining, omega * h, damping)
        errors.append(abs((np.linalg.matrix_power(one, steps) @ state)[0] - exact))
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("remaining", REMAINING)
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_predicted_and_corrected_are_the_same_step(remaining, damping):
    """What uncompiled marches use, by hand on the oscillator."""
    s, h, omega = generalized_alpha(remaining), 0.03, 20.0
    C, K = 2.0 * damping * omega, omega**2
    state = np.array([[0.7], [-3.0], [11.0]])
    q, v = s.predicted(h, state)
    mass, drag, spring = s.weights(h)
    late = 1.0 - s.alpha_f
    force = -s.alpha_m * state[2] - C * (late * v + s.alpha_f * state[1])
    force = force - K * (late * q + s.alpha_f * state[0])
    new_state = s.corrected(h, state, force / (mass + C * drag + K * spring))
    units = np.array([1.0, h, h * h])
    expected = amplification(remaining, omega * h, damping) @ (units * state[:, 0])
    np.testing.assert_allclose(units * new_state[:, 0], expected, rtol=1e-12)


@pytest.mark.parametrize("remaining", [-0.1, 1.1, float("nan")])
def test_refuses_what_cannot_remain(remaining):
    with pytest.raises(ValueError, match="rho_inf"):
        generalized_alpha(remaining)
