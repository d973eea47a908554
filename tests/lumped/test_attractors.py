"""Poincaré sections and Lyapunov exponents beside closed forms and other methods."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.attractors import attractors
from lumped.attractors.attractors import (
    Attractor,
    Kind,
    SectionSettings,
    find_attractor,
)
from lumped.branches.balance import HarmonicBalance
from lumped.kernels import orbit
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond_confirmed
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import FixedStepper

CHAPTER_3 = 2.621e-3, 3.27e-3, 0.119  # kg m2
LAG = -0.125  # base pitches of the second mesh, pi/4
FIRST = 1783.06  # Hz, the first elastic mode of the free train
CHAOTIC = 0.78 * FIRST  # Hz, of a motion that loses contact


@pytest.fixture(scope="module")
def train(system, idler):
    """The idler of chapter 3 on rectangular waves, free to turn."""
    free = idler(inertias=CHAPTER_3, coupled=False, phases=(0.0, LAG))
    return system(free, contact_ratio=1.5)


@pytest.fixture(scope="module")
def chaotic(train):
    """(response, settings of its steps) after speeds that fall from 1.0 FIRST."""
    response, settings = None, Settings(multiples=16)
    for ratio in (1.0, 0.95, 0.9, 0.88, 0.86, 0.84, 0.82, 0.8, 0.78):
        state = None if response is None else response.state
        response, _, finer = respond_confirmed(
            train, ratio * FIRST, settings, state, response
        )
    return response, finer


@pytest.mark.parametrize(
    ("frequency", "harmonics", "multiple", "model"),
    [
        (1000.0, 3, 1, 1),
        (1450.0, 3, 1, 2),
        (1450.0, 3, 1, 3),
        (0.93 * FIRST, None, 1, 1),
        (0.91 * FIRST, None, 2, 1),
    ],
)
def test_a_periodic_motion_has_the_exponent_of_its_floquet_multiplier(
    system, idler, frequency, harmonics, multiple, model
):
    free = idler(inertias=CHAPTER_3, coupled=False, phases=(0.0, LAG))
    built = system(free, harmonics=harmonics, contact_ratio=1.5, model=model)
    settings = Settings(tolerance=1e-8, steps=256)
    response, _, settings = respond_confirmed(built, frequency, settings)
    assert response.multiple == multiple
    attractor = find_attractor(built, response, settings)
    balance = HarmonicBalance(built, harmonics=60, multiple=multiple)
    x = balance.of_response(response, settings)
    for _ in range(8):
        errors, jacobian, _ = balance.equations(x, frequency)
        x = x - np.linalg.solve(jacobian, errors)
    multipliers = np.linalg.eigvals(balance.monodromy(x, frequency))
    exponent = math.log(np.abs(multipliers).max()) / multiple
    assert attractor.exponent == pytest.approx(exponent, rel=0.02)
    assert attractor.exponent < 0.0
    assert (attractor.stderr, attractor.kind) == (0.0, Kind.PERIODIC)
    assert attractor.deflection.shape == (multiple, 2)


def test_a_linear_train_has_the_decay_of_its_slowest_mode(system, idler):
    built = system(idler(inertias=CHAPTER_3, coupled=False), variation=0.0)
    response, _, settings = respond_confirmed(built, 900.0)
    attractor = find_attractor(built, response, settings)
    decay = 0.04 * 2.0 * math.pi * built.resonances_Hz[0] / 900.0
    assert attractor.exponent == pytest.approx(-decay, rel=1e-6)


def neighbours(start, frequency, periods):
    """How much two motions that begin close together part in each period, by scipy.

    Equations of the mesh deflections s with rectangular waves k_m(t), the second late:
    s'' = p - A F - C s', F = k_m(t) max(s, 0), C of the modes about the mean.

    start : deflections and rates of both meshes
    """
    radii, inertia = (0.04535, 0.06564, 0.11218), CHAPTER_3
    first, idle, last = (r**2 / j for r, j in zip(radii, inertia, strict=True))
    A = np.array([[first + idle, -idle], [-idle, idle + last]])
    p, q = 100.0 / radii[0] * first, 100.0 / radii[0] * last
    mean, swing = np.array([2.9831e8, 3.2108e8]), np.array([0.35, 0.4])
    square, shapes = np.linalg.eig(A * mean)
    C = shapes @ np.diag(0.08 * np.sqrt(square)) @ np.linalg.inv(shapes)
    (a, b), (c, d), ((e, f), (g, h)) = *A.tolist(), C.tolist()

    def rates(t, y, k, m):
        derivatives = []
        for s, u, v, w in (y[:4].tolist(), y[4:].tolist()):
            one, two = k * max(s, 0.0), m * max(u, 0.0)
            derivatives += [v, w, p - a * one - b * two - e * v - f * w]
            derivatives.append(q - c * one - d * two - g * v - h * w)
        return derivatives

    scale, separation = np.array([1e-6, 1e-6, 1e-2, 1e-2]), 1e-6
    state, growth = np.array(start), []
    other = state + separation * scale * 0.5
    edges = 0.0, 0.125, 0.5, 0.625, 1.0  # contact ratio 1.5: half of the time high
    for _ in range(periods):
        y = np.concatenate([state, other])
        for begin, end in pairwise(edges):
            middle = 0.5 * (begin + end)
            high = np.array([middle < 0.5, (middle + LAG) % 1.0 < 0.5])
            k = (mean * (1.0 + swing * (high - 0.5))).tolist()
            span, fine = (begin / frequency, end / frequency), 1e-6
            y = solve_ivp(rates, span, y, "DOP853", args=k, rtol=fine, atol=1e-15).y
            y = y[:, -1]
        state, change = y[:4], (y[4:] - y[:4]) / scale
        size = np.linalg.norm(change)
        growth.append(math.log(size / separation))
        other = state + separation * change / size * scale
    return np.array(growth)


@pytest.mark.slow
def test_a_chaotic_motion_parts_from_its_neighbours_as_fast(train, chaotic):
    response, settings = chaotic
    assert response.multiple == 0
    attractor = find_attractor(train, response, settings)
    assert attractor.kind == Kind.CHAOTIC
    # a periodic motion exists besides, which less exact steps may fall into
    points = zip(attractor.deflection, attractor.rate, strict=True)
    runs = (neighbours(np.concatenate(point), CHAOTIC, 600)[50:] for point in points)
    growth = next(run for run in runs if run[-100:].mean() > 0.0)
    parts = np.array([part.mean() for part in np.array_split(growth, 15)])
    spread = math.hypot(attractor.stderr, parts.std(ddof=1) / math.sqrt(parts.size))
    assert spread < 0.06
    assert abs(attractor.exponent - parts.mean()) < 3.0 * spread
    assert attractor.deflection.shape == attractor.rate.shape == (100, 2)
    assert len(np.unique(np.round(attractor.deflection[:, 0], 9))) > 90


def test_no_direction_grows_along_a_torus(train):
    """Between doublings and chaos the motion has two frequencies."""
    response, settings = None, Settings(multiples=32)
    for ratio in (0.92, 0.9):
        state = None if response is None else response.state
        response, _, finer = respond_confirmed(
            train, ratio * FIRST, settings, state, response
        )
    attractor = find_attractor(train, response, finer, SectionSettings(sections=7))
    assert response.multiple == 0
    assert attractor.kind == Kind.QUASI_PERIODIC
    assert abs(attractor.exponent) < 1e-3
    assert attractor.deflection.shape == (7, 2)


def test_changes_are_carried_as_differences_of_motions(train, chaotic):
    """Also through losses of contact: nothing is to be added there."""
    response, settings = chaotic[0], Settings(steps=1024)
    way = FixedStepper(train).kernel_arguments(Speed(response.frequency, settings))
    start, n = np.array(response.state), response.state.shape[1]

    def end(state):
        out = np.empty((way[1].h.size + 1, 2, n))
        orbit.integrate_steps(*way, np.ascontiguousarray(state), out)
        return out[-1]

    columns = []
    for i, j in np.ndindex(2, n):
        step = np.zeros((2, n))
        step[i, j] = 1e-7 * np.abs(start[i]).max()
        change = (end(start + step) - end(start - step)) / (2.0 * step[i, j])
        columns.append(change.ravel())
    largest = np.abs(np.linalg.eigvals(np.array(columns).T)).max()
    once = replace(response, multiple=1)  # the multiplier of one period
    attractor = find_attractor(train, once, settings)
    assert attractor.exponent == pytest.approx(math.log(largest), rel=1e-5)


def test_kernels_are_the_same_uncompiled(train, request, monkeypatch):
    monkeypatch.setattr(attractors, "FINE_STEPS", 16)
    response, _, _ = respond_confirmed(train, 0.91 * FIRST, Settings(multiples=2))
    coarse = Settings(steps=16)
    compiled = find_attractor(train, response, coarse)
    request.getfixturevalue("uncompiled")
    plain = find_attractor(train, response, coarse)
    assert plain.exponent == pytest.approx(compiled.exponent, rel=1e-9)
    np.testing.assert_allclose(plain.rate, compiled.rate, rtol=1e-9)


@pytest.mark.parametrize("multiple", [0, 1])
def test_a_motion_that_diverges_has_no_exponent(train, multiple):
    response, _, settings = respond_confirmed(train, 0.95 * FIRST)
    lost = replace(response, multiple=multiple, state=response.state * math.nan)
    attractor = find_attractor(train, lost, settings)
    assert attractor.kind == Kind.DIVERGED
    assert math.isnan(attractor.exponent)
    assert math.isnan(attractor.stderr)
    assert attractor.deflection.shape == (0, 2)


@pytest.mark.parametrize(
    ("multiple", "exponent", "stderr", "kind"),
    [
        (3, -0.2, 0.0, "periodic"),
        (0, 0.2, 0.01, "chaotic"),
        (0, 0.2, 0.05, "quasi-periodic"),
        (0, 9e-4, 1e-5, "quasi-periodic"),
        (0, -0.2, 0.01, "not converged"),
        (0, math.nan, 0.01, "diverged"),
        (0, math.inf, 0.01, "diverged"),
    ],
)
def test_kinds(multiple, exponent, stderr, kind):
    empty = np.empty((0, 1))
    assert Attractor(multiple, empty, empty, exponent, stderr).kind == kind


@pytest.mark.parametrize("sections", [0, 10_001])
def test_sections_out_of_range_are_named(sections):
    with pytest.raises(ValueError, match=f"sections = {sections}; must be 1 to 10000"):
        SectionSettings(sections=sections)
