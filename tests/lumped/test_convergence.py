"""When synthetic transients with known multipliers count as settled."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from numba import njit

from lumped.kernels import convergence
from lumped.kernels.convergence import close_section
from lumped.steady.integration_settings import Settings
from lumped.steady.steady_state import new_convergence

MULTIPLES = 8
MOST = 40_000  # periods


@pytest.fixture(params=[1, 3], autouse=True, ids="{}-earlier".format)
def earlier_steps(request, monkeypatch):
    """Steps with which the last one is compared, as of lumped models and others."""
    monkeypatch.setattr(Settings, "earlier_steps", request.param)
    return request.param


def memory(shape, tolerance, noise=0.0, cycles=1):
    """Of coordinates (n,) that move one mesh, over a range of 1 m."""
    n, settings = len(shape), Settings(tolerance=tolerance, multiples=MULTIPLES)
    check = new_convergence(np.array([shape]), np.ones(n), settings, cycles)
    check.limits[:] = [[-0.5], [0.5]]
    check.error_bound[:] = noise
    return check


@njit  # no cache on disk: it would outlive a change of the kernels
def first_settled(sections, check):
    """Period at which a way of sections (periods, 2, n) has settled, or all of them."""
    check.sections[0] = sections[0]
    for period in range(1, sections.shape[0]):
        if close_section(check, sections[period, 0], sections[period, 1]):
            return period
    return -1


def settle(way, tolerance=1e-4, shape=(1.0,), noise=0.0, cycles=1):
    """way : (periods, n) complex, displacement + i velocity; a range of 1 m.

    noise : of the integrator in a period [m]; cycles : of a mesh in a period
    """
    way = np.asarray(way, complex).reshape(len(way), -1)
    sections = np.ascontiguousarray(np.stack([way.real, way.imag], axis=1))
    check = memory(shape, tolerance, noise, cycles)
    period = first_settled(sections, check)
    return (period, check.multiple) if period >= 0 else (len(way), 0)


def transient(multiplier, amplitude=1.0, periods=MOST):
    n = np.arange(periods)
    return amplitude * np.power(complex(multiplier), n)


def orbit(values, periods=MOST):
    return np.resize(np.array(values, complex), periods)


def latest(multiplier, tolerance):
    """Periods after which even the cautious estimate d / (1 - rho) is small enough.

    d = |1 - mu| rho^n is the distance of two sections.
    """
    rho = abs(multiplier)
    small = tolerance / (1.0 + tolerance) * (1.0 - rho) / abs(1.0 - multiplier)
    return math.log(small) / math.log(rho)


@pytest.mark.slow
@pytest.mark.parametrize("rho", [0.3, 0.9, 0.95, 0.99, 0.999])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-8])
def test_real_multipliers(rho, sign, tolerance):
    period, multiple = settle(0.3 + transient(sign * rho), tolerance)
    assert multiple == 1
    assert rho**period < 3.0 * tolerance
    assert period < latest(sign * rho, tolerance) + 10


@pytest.mark.parametrize("rho", [0.5, 0.9, 0.95, 0.99, 0.999])
@pytest.mark.parametrize(
    "angle",
    [0.01, 0.1, 0.3, 1.0, 2.0, 3.0, 3.13]
    + [2.0 * math.pi * part for part in (1 / 3, 1 / 4, 1 / 5, 2 / 7, 1 / 3 + 1e-3)],
)
def test_turning_multipliers(rho, angle):
    """What vibration at another frequency than the mesh's decays like."""
    tolerance = 1e-4
    multiplier = rho * cmath.exp(1j * angle)
    period, multiple = settle(0.3 + transient(multiplier), tolerance)
    assert multiple == 1
    assert rho**period < 3.0 * tolerance
    assert period < latest(multiplier, tolerance) + 10


@pytest.mark.parametrize(
    "values",
    [(0.3, -0.2), (0.3, 0.1, -0.2), (0.3, 0.1, -0.2, 0.4), (0.3, 0.31), range(8)],
    ids=lambda v: str(len(v)),
)
@pytest.mark.parametrize(
    "multiplier",
    [0.3, 0.9, 0.99, -0.9, -0.95, -0.99, 0.95j, 0.99 * cmath.exp(1j)],
)
def test_orbits_of_several_periods(values, multiplier):
    tolerance = 1e-4
    period, multiple = settle(orbit(values) + transient(multiplier), tolerance)
    assert multiple == len(values)
    assert abs(multiplier) ** period < 3.0 * tolerance


def test_orbit_that_never_moved():
    assert settle(orbit([0.3]))[1] == 1
    period, multiple = settle(orbit([0.3, 0.1]))
    assert multiple == 2
    assert period < 10


def test_longer_orbits_than_looked_for_are_none():
    assert settle(orbit(np.arange(MULTIPLES + 1) / 10, 3000))[1] == 0


@pytest.mark.parametrize("rate", [3.7, 3.9, 3.99])
def test_chaos_never_settles(rate):
    x = np.empty(20_000)
    x[0] = 0.3
    for n in range(x.size - 1):
        x[n + 1] = rate * x[n] * (1.0 - x[n])
    assert settle(x)[1] == 0


@pytest.mark.parametrize(
    ("rate", "multiple"), [(2.9, 1), (3.2, 2), (3.5, 4), (3.55, 8)]
)
def test_doubling_of_the_logistic_map(rate, multiple):
    """A nonlinear transient onto known orbits."""
    x = np.empty(20_000)
    x[0] = 0.3
    for n in range(x.size - 1):
        x[n + 1] = rate * x[n] * (1.0 - x[n])
    period, period_multiple = settle(x)
    assert period_multiple == multiple
    assert abs(x[period] - x[-1 - (x.size - 1 - period) % multiple]) < 3e-4


def test_turning_without_decay_never_settles():
    assert settle(0.1 * np.exp(1j * np.arange(5000)))[1] == 0


def test_growth_never_settles():
    assert settle(1e-5 * np.power(1.01, np.arange(1500)))[1] == 0


def test_a_fast_mode_does_not_hide_a_slow_one():
    """Two modes of one mesh: the slow one starts a hundred times smaller."""
    fast, slow = transient(0.5), transient(0.99 * cmath.exp(0.7j), 0.01)
    way = 0.3 + np.stack([fast, slow], axis=1)
    period, multiple = settle(way, shape=(1.0, 1.0))
    assert multiple == 1
    assert 0.01 * 0.99**period < 3e-4


@pytest.mark.parametrize("angle", [0.86, 0.88, 1.12])
def test_steps_of_an_ellipse_shrink_over_some_periods_alone(angle, earlier_steps):
    """Parametric excitation turns a mode on an ellipse: every third step is longer."""
    n, tolerance, rho = np.arange(2000), 1e-4, 0.8
    turning = np.exp(2j * np.pi * angle * n)
    ellipse = rho**n * (turning.real + 0.4j * turning.imag)
    period, multiple = settle(0.3 + ellipse, tolerance)
    assert multiple == 1
    assert rho**period < 3.0 * tolerance
    if earlier_steps == 3:
        assert period < latest(rho * cmath.exp(2j * np.pi * angle), tolerance) + 10


def test_no_number_never_settles():
    assert settle(np.full(100, np.nan))[1] == 0


def test_uncompiled_parts_agree(uncompiled):
    way = 0.3 + transient(-0.8, periods=200)
    check = memory((1.0,), 1e-4)
    check.sections[0] = [[way[0].real], [way[0].imag]]
    for value in way[1:]:
        if convergence.close_section(
            check, np.array([value.real]), np.array([value.imag])
        ):
            break
    assert (check.period, check.multiple) == settle(way)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_bounds_let_no_runaway_pass(uncompiled, value):
    good = np.zeros(2)
    with np.errstate(invalid="ignore"):
        for bad in (np.array([value, 0.0]), np.array([0.0, value])):
            assert not convergence.is_bounded(good, bad, 1e6)
        if not math.isfinite(value):
            assert not convergence.is_bounded(np.array([value, 0.0]), good, 1e6)
    assert convergence.is_bounded(good, good, 1e-9)


@pytest.mark.parametrize("noise", [1e-7, 1e-9])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_noise_of_the_integrator_is_not_motion(noise, tolerance):
    """A decay that ends in noise has settled, once the noise is known."""
    rng = np.random.default_rng(1)
    way = 0.3 + transient(0.9, periods=4000)
    way = way + noise * (
        rng.uniform(-1, 1, way.size) + 1j * rng.uniform(-1, 1, way.size)
    )
    without_bound, with_bound = (
        settle(way, tolerance),
        settle(way, tolerance, noise=2.0 * noise),
    )
    assert with_bound[1] == 1
    assert with_bound[0] < 400
    if tolerance < noise:
        assert without_bound[1] == 0


def test_noise_hides_no_motion():
    """Nothing larger than a millionth of the range, or the tolerance, is noise."""
    way = orbit([0.0, 1e-3], 4000)
    assert settle(way, 1e-4, noise=1.0)[1] == 2
    assert settle(transient(cmath.exp(0.3j), 1e-3, 4000), 1e-4, noise=1.0)[1] == 0


@pytest.mark.parametrize("value", [0.3, 0.0])
def test_after_a_long_period_one_repetition_is_enough(value):
    """Nothing is left of the start; shorter periods are confirmed."""
    way = value + transient(1e-12, periods=20)
    assert settle(way, cycles=2090) == (2, 1)
    assert settle(way) == (5, 1)


@pytest.mark.parametrize("multiplier", [0.99, -0.9, 0.5])
def test_what_still_decays_after_a_long_period_is_confirmed(multiplier):
    way = 0.3 + transient(1e-3) + 1e-2 * transient(multiplier)
    period, multiple = settle(way)
    assert settle(way, cycles=2090) == (period, multiple)
    assert abs(1e-2 * multiplier**period) < 3e-4
