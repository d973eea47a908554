"""When the elastic inertia of the gears matters, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped.train.elastic_inertia import (
    MAX_INERTIA_FACTOR,
    ElasticModes,
    choose,
    harmonic_amplitudes,
    inertia_error,
)

ZETA = 0.03
ONE = ElasticModes(np.array([10e3]), np.array([0.2]), ZETA)
SEVERAL = ElasticModes(
    np.array([30e3, 10e3, 10e3, 18e3]), np.array([0.01, 0.1, 0.05, 0.04]), ZETA
)
SPEEDS = np.linspace(50.0, 2000.0, 40)
SPECTRUM = np.array([3.0, -1.0j, 0.5 + 0.2j]) * 1e-6  # m


def part(x: float, zeta: float = ZETA) -> float:
    return x**2 / abs(1.0 - x**2 + 2j * zeta * x)


@pytest.mark.parametrize("frequency", [10.0, 3e3, 10e3, 47e3])
def test_one_mode_under_one_harmonic(frequency):
    expected = 0.2 * part(frequency / 10e3)
    assert inertia_error(ONE, [1e-6], frequency) == pytest.approx(expected, rel=1e-12)


def test_harmonics_and_modes_add_up():
    frequency, size = 2300.0, np.abs(SPECTRUM)
    errors = np.array(
        [
            sum(
                c * part(h * frequency / f)
                for f, c in zip(SEVERAL.frequencies_Hz, SEVERAL.compliance, strict=True)
            )
            for h in (1, 2, 3)
        ]
    )
    expected = math.sqrt(((size * errors) ** 2).sum() / (size**2).sum())
    assert inertia_error(SEVERAL, SPECTRUM, frequency) == pytest.approx(expected)


def test_size_is_the_compliance_lost_without_inertia():
    x = 0.4  # of an undamped mode: c / (1 - x^2) - c
    undamped = ElasticModes(ONE.frequencies_Hz, ONE.compliance, 0.0)
    expected = 0.2 / (1.0 - x**2) - 0.2
    assert inertia_error(undamped, [1.0], x * 10e3) == pytest.approx(expected)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_error_rises_below_the_first_resonance(one, other):
    highest = 0.9 * 10e3 / SPECTRUM.size  # of the last harmonic, below the mode
    low, high = sorted((one * highest, other * highest))
    errors = [inertia_error(SEVERAL, SPECTRUM, f) for f in (low, high)]
    assert errors[0] <= errors[1] * (1.0 + 1e-12)


def test_low_speeds_err_by_order_two_and_are_quasistatic():
    speeds = 100.0 / 2.0 ** np.arange(6)
    errors = [inertia_error(SEVERAL, SPECTRUM, f) for f in speeds]
    order = np.polyfit(np.log(speeds), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.01)
    choice = choose([(SEVERAL, SPECTRUM, 1.0)], speeds)
    assert (choice.fidelity, choice.speed_Hz) == ("quasistatic", 100.0)
    assert (choice.cutoff_Hz, choice.retained) == (0.0, (0,))
    assert choice.remaining == choice.bound == errors[0]


@pytest.mark.parametrize("amplitudes", [np.zeros(3), np.empty(0)])
def test_no_excitation_is_no_error(amplitudes):
    assert inertia_error(SEVERAL, amplitudes, 10e3) == 0.0
    assert choose([(SEVERAL, amplitudes, 1.0)], SPEEDS).fidelity == "quasistatic"


def test_no_modes_and_standstill_are_no_error():
    none = ElasticModes(np.empty(0), np.empty(0), ZETA)
    assert choose([(none, SPECTRUM, 1.0)], SPEEDS, tolerance=0.0).bound == 0.0
    assert inertia_error(SEVERAL, SPECTRUM, 0.0) == 0.0


@given(st.floats(-300.0, 300.0), st.floats(0.0, 2.0 * math.pi))
def test_scale_and_phase_of_the_excitation_change_nothing(power, phase):
    scaled = SPECTRUM * 10.0**power * np.exp(1j * phase)
    expected = inertia_error(SEVERAL, SPECTRUM, 3e3)
    assert inertia_error(SEVERAL, scaled, 3e3) == pytest.approx(expected, rel=1e-9)


def test_undamped_resonance_is_large_but_finite():
    undamped = ElasticModes(np.array([10e3, 2e3]), np.array([0.2, 0.0]), 0.0)
    assert inertia_error(undamped, [1.0], 10e3) == pytest.approx(
        0.2 * MAX_INERTIA_FACTOR
    )
    assert inertia_error(undamped, [1.0], 2e3) < 1.0  # a mode the mesh does not feel


def test_far_above_a_mode_all_its_compliance_is_lost():
    assert inertia_error(ONE, [1.0], 1e7) == pytest.approx(0.2, rel=1e-5)


@pytest.mark.parametrize("points", [2, 3, 16, 17, 64])
@pytest.mark.parametrize("harmonic", [1, 2, 7])
def test_pure_cosine_has_its_own_harmonic_only(points, harmonic):
    if 2 * harmonic >= points:
        return
    turn = 2.0 * math.pi * np.arange(points) / points
    amplitudes = harmonic_amplitudes(5.0 + 3.0 * np.cos(harmonic * turn + 0.4))
    expected = np.zeros(points // 2, complex)
    expected[harmonic - 1] = 3.0 * np.exp(0.4j)
    np.testing.assert_allclose(amplitudes, expected, atol=1e-14)


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=33))
def test_parseval(values):
    ste = np.array(values)
    amplitudes = harmonic_amplitudes(ste)
    assert amplitudes.shape == (ste.size // 2,)
    squares = 0.5 * np.abs(amplitudes) ** 2
    if ste.size % 2 == 0:
        squares[-1] *= 2.0  # a cosine at half the samples' rate is only seen at +-1
    assert squares.sum() == pytest.approx(ste.var(), rel=1e-9, abs=1e-9)


def test_fewest_modes_that_suffice_are_kept():
    mesh = (SEVERAL, np.array([1.0]), 1.0)
    choice = choose([mesh], [9e3], tolerance=0.01)
    assert choice.fidelity == "reduced"
    assert choice.retained == (3,)  # the pair at 10 kHz and the one at 18 kHz
    assert 18e3 < choice.cutoff_Hz < 30e3
    rest = ElasticModes(np.array([30e3]), np.array([0.01]), ZETA)
    assert choice.remaining == pytest.approx(inertia_error(rest, [1.0], 9e3))
    assert choice.remaining <= choice.tolerance < choice.bound
    assert choose([mesh], [9e3], tolerance=choice.bound).fidelity == "quasistatic"


def test_pairs_are_never_split():
    pair = ElasticModes(np.array([10e3, 10e3 * (1 + 1e-12)]), np.array([0.1, 0.1]), 0.1)
    choice = choose([(pair, [1.0], 1.0)], [9e3], tolerance=0.3)
    assert choice.retained == (2,)


@given(st.floats(0.0, 0.3), st.floats(0.0, 0.3))
def test_a_finer_tolerance_never_keeps_fewer_modes(one, other):
    fine, coarse = (
        choose([(SEVERAL, SPECTRUM, 1.0)], SPEEDS, tolerance)
        for tolerance in sorted((one, other))
    )
    assert fine.cutoff_Hz >= coarse.cutoff_Hz
    assert fine.remaining <= fine.tolerance


def test_worst_mesh_decides():
    slow, fast = (ONE, [1.0], 1.0), (ONE, [1.0], 2.5)
    choice = choose([slow, fast], SPEEDS)
    assert choice.mesh == 1
    assert choice.speed_Hz == SPEEDS[-1]
    assert choice.bound == inertia_error(ONE, [1.0], 2.5 * SPEEDS[-1])
    assert choice.retained == (1, 1)
    assert choose([slow], SPEEDS).fidelity == "quasistatic"


def test_sentences():
    said = choose([(ONE, [1.0], 1.0)], [500.0, 1200.0]).sentence
    assert said == (
        "quasistatic: elastic inertia changes the mesh compliance by at most 0.29 % of "
        "the excitation's RMS (at 1200 Hz), allowed are 2 %"
    )
    said = choose([(SEVERAL, [1.0], 1.0)], [10e3]).sentence
    assert said == (
        "reduced: elastic inertia changes the mesh compliance by up to 250 % of the "
        "excitation's RMS (at 10000 Hz), allowed are 2 %; 2 modes below 10 kHz are "
        "kept, the others change it by at most 1.9 %"
    )
    meshes = [(ONE, [1.0], 1.0), (ONE, [1.0], 2.0)]
    said = choose(meshes, [2e3]).sentence
    assert "(at 2000 Hz in mesh 2)" in said
    assert "1 + 1 modes below 10 kHz" in said


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frequencies_Hz": [0.0, 1.0]}, "frequencies_Hz = 0; must be positive"),
        ({"frequencies_Hz": [1.0]}, r"shape of compliance = \(2,\); must be \(1,\)"),
        ({"compliance": [0.1, math.nan]}, "compliance must be finite"),
        ({"compliance": [0.1, -0.1]}, "compliance = -0.1; must be 0 or more"),
        ({"damping_ratio": math.nan}, "damping_ratio = .*; must be 0 or more"),
    ],
)
def test_wrong_modes_are_named(change, message):
    values = {"frequencies_Hz": [1.0, 2.0], "compliance": [0.1, 0.1]}
    with pytest.raises(ValueError, match=message):
        ElasticModes(**(values | {"damping_ratio": 0.1} | change))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: choose([], SPEEDS), "meshes"),
        (lambda: choose([(ONE, [1.0], 1.0)], []), "speeds"),
        (lambda: choose([(ONE, [1.0], 1.0)], [math.inf]), "speeds must be finite"),
        (lambda: choose([(ONE, [1.0], 1.0)], SPEEDS, math.nan), "tolerance"),
        (lambda: choose([(ONE, [1.0], math.nan)], SPEEDS), "mesh_frequency"),
        (lambda: inertia_error(ONE, [math.nan], 1.0), "amplitudes must be finite"),
        (
            lambda: inertia_error(ONE, [[1.0]], 1.0),
            "dimensions of amplitudes = .*; must be 1",
        ),
        (lambda: inertia_error(ONE, [1.0], -1.0), "mesh_frequency"),
        (lambda: harmonic_amplitudes([1.0]), "values of ste = 1; must be 2 or more"),
    ],
)
def test_wrong_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
