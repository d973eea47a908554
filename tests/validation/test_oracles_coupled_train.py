"""The oracle of coupled contacts against a spring, and its energy against its force."""

from __future__ import annotations

import numpy as np
import pytest

from validation.oracles.coupled_train import Instant

STIFF, CURVED = 2e8, 1e13  # N/m, N/m2
KNOTS = np.array([0.0, 3e-5, 1e-4])


def law_of(stiff, curved):
    """F = stiff x + curved x2 in two cells."""
    rows = [
        [stiff * x + curved * x**2, stiff + 2.0 * curved * x, curved, 0.0]
        for x in KNOTS[:-1]
    ]
    return np.array(rows)


def instant(**changes):
    values = {
        "knots": np.array([KNOTS, KNOTS]),
        "load_curve": np.array([law_of(STIFF, CURVED), law_of(0.5 * STIFF, 0.0)]),
        "gap": np.array([1e-6, 3e-6]),
        "compliance": np.array([[2e-9, 1e-9], [1e-9, 3e-9]]),
        "rows": np.array([[1.0, 0.4], [0.8, -0.3]]),
        "inertia_rows": np.array([[2e-9, 1e-9], [1e-9, 0.0]]),
        "work": np.array([[3e-9, 1e-9], [1e-9, 2e-9]]),
        "stiffness": np.array([[2e7, 0.0], [0.0, 5e7]]),
        "load": np.array([2000.0, 300.0]),
    }
    return Instant(**(values | changes))


def test_a_single_spring_in_a_body():
    """Compliances in series; inertia takes no part where nothing accelerates."""
    one = np.ones((1, 1))
    spring = Instant(
        knots=KNOTS[None],
        load_curve=law_of(STIFF, 0.0)[None],
        gap=np.array([1e-6]),
        compliance=1e-9 * one,
        rows=one,
        inertia_rows=0.0 * one,
        work=0.0 * one,
        stiffness=0.0 * one,
        load=np.array([1000.0]),
    )
    s = 1e-6 + 1000.0 * (1.0 / STIFF + 1e-9)
    z, x, a = spring.solve(np.array([s]))
    np.testing.assert_allclose(z, [s])
    np.testing.assert_allclose(x, [1000.0 / STIFF], rtol=1e-9)
    np.testing.assert_allclose(a, [0.0], atol=1e-6)
    energy = 0.5 * 1000.0 * (s - 1e-6) - 1000.0 * s
    assert spring.potential(np.array([s])) == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("q", [(2e-5, -1e-6), (4e-6, 1e-5), (-1e-5, 0.0)])
def test_its_accelerations_are_the_slopes_of_its_energy(q):
    """In contact, with one contact open, and with both open."""
    contacts, q = instant(), np.array(q)
    _, x, acceleration = contacts.solve(q)
    assert ((x > 0.0).sum() > 0) == (q[0] > 0.0)
    for i, step in enumerate(1e-8 * np.eye(2)):
        slope = (contacts.potential(q + step) - contacts.potential(q - step)) / 2e-8
        assert -slope == pytest.approx(acceleration[i], abs=0.05), f"coordinate {i}"
