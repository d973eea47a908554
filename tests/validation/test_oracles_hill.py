"""Hill's equation with a sawtooth against itself and Bessel functions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jv

from validation.oracles.hill import (
    exact_transition,
    exponentials,
    first_order_form,
    recursion,
)


@pytest.mark.parametrize(("a", "b", "h"), [(2.0, 1.0, 1.5), (0.5, 9.0, 2.0)])
def test_airy_functions_are_the_printed_bessel_functions(a, b, h):
    """Eq. 4.58, where a t + b is positive."""

    def states(t):
        z = a * t + b
        sigma = 2.0 * z**1.5 / (3.0 * a)
        return np.array(
            [
                [np.sqrt(z) * jv(1 / 3, sigma), np.sqrt(z) * jv(-1 / 3, sigma)],
                [z * jv(-2 / 3, sigma), -z * jv(2 / 3, sigma)],
            ]
        )

    printed = states(h) @ np.linalg.inv(states(0.0))
    np.testing.assert_allclose(exact_transition(a, b, h), printed, rtol=1e-11)


def test_transitions_keep_the_area_and_follow_each_other():
    a, b = -1.0, -1.0
    first, whole = exact_transition(a, b, 0.3), exact_transition(a, b, 0.8)
    second = exact_transition(a, b + 0.3 * a, 0.5)
    assert np.linalg.det(whole) == pytest.approx(1.0, abs=1e-13)
    np.testing.assert_allclose(second @ first, whole, rtol=1e-13)


def test_exponentials_are_exact_for_a_constant():
    form = first_order_form(0.0, 4.0)
    c, s = np.cos(1.4), np.sin(1.4)
    exact = np.array([[c, s / 2.0], [-2.0 * s, c]])
    np.testing.assert_allclose(exponentials(form, 0.7, 3), exact, atol=1e-14)
    np.testing.assert_allclose(recursion(form, 0.7, 30), exact, atol=1e-14)
