"""Harmonic balance beside closed forms, differences and time integration."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lumped.branches.balance import HarmonicBalance
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from lumped.train.bodies import TrainError
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.system import LumpedSystem
from lumped.train.waves import constant_wave, wave_from_samples

FINE = Settings(method="dopri5", accuracy=1e-10, tolerance=1e-10)
LOST = 1600.0  # Hz at which the idler loses contact


def solved(balance, frequency, x=None):
    """Unknowns of the motion near that of an integration from rest."""
    if x is None:
        x = balance.of_response(respond(balance.system, frequency), Settings())
    for _ in range(12):
        errors, jacobian, _ = balance.equations(x, frequency)
        step = np.linalg.solve(jacobian, errors)
        x = x - step
        if np.abs(step).max() < 1e-16:
            break
    assert np.abs(step).max() < 1e-13
    return x


def integrated(system, state, frequency, periods):
    """State (2, n) after so many common periods by adaptive steps."""
    stepper = stepper_of(system, FINE)
    return stepper.record(state, Speed(frequency, FINE), periods)[0]


def test_constant_stiffness_is_the_linear_response(system):
    """Model-2 below contact loss: the receptance at each harmonic, in closed form."""
    linear = system(model=2, harmonics=3)
    balance, frequency = HarmonicBalance(linear, harmonics=12), 900.0
    x = solved(balance, frequency, balance.static)
    arrays = linear.arrays
    grid = np.linspace(0.0, 1.0, 4096, endpoint=False)
    _, gaps = linear.excitation.evaluate(grid)
    waves = np.fft.rfft(gaps, axis=0)[:13] / grid.size
    omega = 2.0 * math.pi * frequency * np.arange(13)
    modes = arrays.rigidity - omega[:, None] ** 2
    modes = 1.0 / (modes + 1j * omega[:, None] * arrays.damping)
    G = np.einsum("hi,mi,ri->hmr", modes, arrays.shapes, arrays.shapes)
    exact = np.einsum("hmr,r,hr->hm", G, arrays.mean_stiffness, waves)
    exact[0] += linear.static_deflection
    series = x.reshape(balance.shape)
    amplitudes = 0.5 * (series[1:13] - 1j * series[13:])
    np.testing.assert_allclose(series[0], exact[0].real, rtol=1e-6)
    np.testing.assert_allclose(
        amplitudes, exact[1:], atol=1e-4 * np.abs(exact[1:]).max()
    )


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), frequency=st.floats(700.0, 4000.0))
def test_jacobian_is_that_of_differences(system, seed, frequency):
    """With contact lost and regained, on any motion and not only on solutions."""
    balance = HarmonicBalance(system(harmonics=3), harmonics=6)
    random = np.random.default_rng(seed)
    decay = np.concatenate([[0.0], *[1.0 / np.arange(1, 7) ** 2] * 2])[:, None]
    x = balance.static + (8e-6 * decay * random.standard_normal(balance.shape)).ravel()
    along = random.standard_normal(x.size)
    _, jacobian, by_frequency = balance.equations(x, frequency)
    h = 1e-11
    ahead, behind = (
        balance.equations(x + s * h * along, frequency)[0] for s in (1, -1)
    )
    slope = (ahead - behind) / (2.0 * h)
    np.testing.assert_allclose(jacobian @ along, slope, atol=2e-4 * np.abs(slope).max())
    ahead, behind = (balance.equations(x, frequency + s)[0] for s in (0.01, -0.01))
    slope = (ahead - behind) / 0.02
    np.testing.assert_allclose(by_frequency, slope, atol=1e-5 * np.abs(slope).max())


def test_jacobian_where_a_sampled_stiffness_rises_within_a_step(idler):
    """Quadrature must not depend on where contact cuts its pieces."""
    samples = 3e8 * (np.arange(200) >= 30)  # N/m
    pair = PairExcitation(wave_from_samples(samples), constant_wave(0.0))
    train = LumpedSystem(idler(), (MeshExcitation((pair,), 2.5e8),) * 2)
    balance = HarmonicBalance(train, harmonics=2)
    x = np.zeros(balance.shape)
    # contact is lost as the stiffness rises
    for start in np.linspace(0.146, 0.156, 6):
        angle = 2.0 * np.pi * (start - 0.25)
        x[1], x[3] = 8e-6 * np.cos(angle), 8e-6 * np.sin(angle)
        along = np.ones(x.size)
        _, jacobian, _ = balance.equations(x.ravel(), LOST)
        ahead, behind = (
            balance.equations(x.ravel() + s * 1e-11 * along, LOST)[0] for s in (1, -1)
        )
        slope = (ahead - behind) / 2e-11
        error = np.abs(jacobian @ along - slope).max()
        assert error < 2e-5 * np.abs(slope).max(), start


@pytest.mark.parametrize("frequency", [LOST, 2500.0])
def test_state_comes_back_after_a_period(system, frequency):
    """Adaptive steps from a state of the series, which share nothing with it."""
    train = system(harmonics=3)
    errors = []
    for harmonics in (5, 10, 20, 40):
        balance = HarmonicBalance(train, harmonics)
        x = solved(balance, frequency)
        state = balance.state(x, frequency)
        after = integrated(train, state, frequency, 1)
        size = np.abs(train.arrays.shapes @ state[0]).max()
        errors.append(np.abs(train.arrays.shapes @ (after - state)[0]).max() / size)
    assert errors[-1] < 1e-5
    falls = [b < a for a, b in pairwise(errors) if a > 1e-9]
    assert falls
    assert all(falls)


def test_order_in_the_number_of_harmonics(system):
    """A kinked force leaves h^-4 of a deflection and a jump of stiffness h^-3; what
    is left out of the RMS falls at least as fast as its square does."""
    for waves, least in ((3, 3.0), (None, 2.0)):
        train = system(harmonics=waves)
        x = {n: solved(HarmonicBalance(train, n), LOST) for n in (8, 16, 32, 128)}
        figures = {}
        for n, unknowns in x.items():
            balance = HarmonicBalance(train, n)
            figures[n] = unknowns.reshape(balance.shape)
        H = 128
        errors = []
        for n in (8, 16, 32):
            error = figures[128].copy()
            error[: n + 1] -= figures[n][: n + 1]
            error[H + 1 : H + n + 1] -= figures[n][n + 1 :]
            errors.append(np.sqrt((error**2).sum()))
        orders = -np.diff(np.log2(errors))
        assert (orders > least - 0.7).all(), (waves, orders)
        assert errors[-1] < 1e-3 * np.abs(figures[128][1:]).max()


def test_figures_are_those_of_the_integration(system):
    train = system()
    balance = HarmonicBalance(train, 40)
    response = respond(train, LOST, FINE)
    quantities = balance.figures(solved(balance, LOST), LOST)
    assert response.contact_loss.max() > 0.05
    for name in ("dte_rms", "dte_mean", "dte_peak", "force_peak"):
        np.testing.assert_allclose(quantities[name], getattr(response, name), rtol=2e-3)
    np.testing.assert_allclose(
        quantities["contact_loss"], response.contact_loss, atol=2e-3
    )


def test_monodromy_is_that_of_differences(system):
    train = system()
    balance = HarmonicBalance(train, 60)
    x = solved(balance, LOST)
    state, n = balance.state(x, LOST), train.arrays.rigidity.size
    transfer = balance.monodromy(x, LOST)
    scale = np.concatenate([np.full(n, 1e-9), np.full(n, 1e-5)]) * np.abs(state).max()
    columns = []
    for i, step in enumerate(scale):
        change = np.zeros(2 * n)
        change[i] = step
        ahead, behind = (
            integrated(train, state + s * change.reshape(2, n), LOST, 1).ravel()
            for s in (1.0, -1.0)
        )
        columns.append((ahead - behind) / (2.0 * step))
    multipliers = np.abs(np.linalg.eigvals(np.array(columns).T))
    exact = np.abs(np.linalg.eigvals(transfer))
    np.testing.assert_allclose(np.sort(multipliers), np.sort(exact), rtol=5e-3)


def test_phase_space_shrinks_by_damping_alone(system):
    """Liouville: the determinant of the monodromy knows neither contact nor waves."""
    train = system()
    balance = HarmonicBalance(train, 10)
    x = solved(balance, LOST)
    exact = math.exp(-train.arrays.damping.sum() / LOST)
    determinant = np.linalg.det(balance.monodromy(x, LOST))
    assert determinant == pytest.approx(exact, rel=1e-7)


def test_a_motion_as_one_of_a_longer_period(system):
    balance = HarmonicBalance(system(), 8)
    x = solved(balance, LOST)
    longer = balance.repeated(3)
    errors, _, _ = longer.equations(balance.lengthened(x, 3), LOST)
    assert np.abs(errors).max() < 1e-9 * np.abs(x).max()
    delayed = longer.delayed(balance.lengthened(x, 3), 2, LOST)
    np.testing.assert_allclose(delayed, balance.lengthened(x, 3), atol=1e-18)


def test_what_cannot_be_is_refused(system):
    with pytest.raises(ValueError, match="harmonics = 0; must be at least 1"):
        HarmonicBalance(system(), 0)
    with pytest.raises(TrainError, match="4002 unknowns, more than 3000"):
        HarmonicBalance(system(), 1000)


def test_contact_that_closes_by_tanh_converges_to_true_contact(system):
    """With the square of its steepness; eq. 3.5."""
    train = system(harmonics=3)
    exact = HarmonicBalance(train, 16)
    x = solved(exact, LOST)
    rms = exact.figures(x, LOST)["dte_rms"]
    errors = []
    for steepness in (2e6, 4e6, 8e6):
        smooth = HarmonicBalance(train, 16, steepness=steepness)
        near = solved(smooth, LOST, x)
        errors.append(abs(smooth.figures(near, LOST)["dte_rms"] / rms - 1.0).max())
    assert 3e-5 < errors[0] < 3e-2
    assert errors[1] < errors[0] / 3.0
    assert errors[2] < errors[1] / 3.0


def test_contact_that_closes_by_tanh_has_its_exact_jacobian(system):
    balance = HarmonicBalance(system(harmonics=3), 4, steepness=1e6)
    x = balance.static * 1.5
    x = x + 3e-6 * np.random.default_rng(5).standard_normal(x.size)
    _, jacobian, _ = balance.equations(x, 1500.0)
    for column in (0, 3, 8, x.size - 1):
        step = np.zeros(x.size)
        step[column] = 1e-10
        up, down = (balance.errors(x + sign * step, 1500.0) for sign in (1, -1))
        difference = (up - down) / 2e-10
        np.testing.assert_allclose(
            difference, jacobian[:, column], atol=1e-5 * abs(jacobian).max()
        )
