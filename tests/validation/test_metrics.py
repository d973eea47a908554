"""Metrics against curves and waves made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped.steady.jumps import Jump, Peak
from lumped.steady.response import History
from validation.study import metrics as m
from validation.study.cycle_metrics import force_cycle, match_cycles

SPEEDS = np.arange(1000.0, 2000.0, 20.0)


def resonance(speeds, at=1500.0, height=1.0):
    return height / np.sqrt((1.0 - (speeds / at) ** 2) ** 2 + (0.1 * speeds / at) ** 2)


def curve(values, speeds=SPEEDS, **changes):
    values = np.asarray(values, float)
    still = np.zeros_like(values)
    plain = m.MeasuredCurve(
        "up", 1, np.asarray(speeds, float), values, still + 1.0, still
    )
    return replace(plain, **changes)


def jump(start, end):
    return Jump("up", 1, start, end, 1e-6, 5e-6)


def peak(frequency, height):
    return Peak("up", 1, frequency, height, 0.0, 0.0, 0.0)


def measured(reference, model):
    """Values by metric, in lists."""
    out = {}
    for name, _, value in m.curve_measures(reference, model):
        out.setdefault(name, []).append(value)
    return out


def test_scaled_curve_is_off_by_its_factor():
    base = curve(resonance(SPEEDS))
    other = curve(1.2 * base.dte_rms)
    assert m.curve_distance(base, other).value == pytest.approx(0.2)
    assert m.curve_distance(other, base).value == pytest.approx(0.2 / 1.2)


def test_friction_effect_is_the_change_of_the_largest_value():
    base = curve(resonance(SPEEDS))
    raised = curve(1.2 * resonance(SPEEDS, at=1700.0))
    top = base.dte_rms.max() / resonance(SPEEDS, at=1700.0).max()
    assert m.friction_effect(raised, base) * top == pytest.approx(1.2)
    assert math.isnan(m.friction_effect(replace(raised, complete=False), base))
    assert math.isnan(m.friction_effect(raised, curve(0.0 * SPEEDS)))


def test_shifted_curve_is_off_at_its_peak_and_not_far_from_it():
    base, other = (curve(resonance(SPEEDS, at)) for at in (1500.0, 1600.0))
    near = m.curve_distance(base, other, [(0.0, 1300.0), (1800.0, 3000.0)]).value
    far = m.curve_distance(base, other, [(1300.0, 1800.0)]).value
    assert near > 0.3
    assert far < 0.6 * near


def test_only_common_speeds_count():
    base = curve(resonance(SPEEDS))
    half = curve(resonance(SPEEDS[::2]), SPEEDS[::2])
    assert m.curve_distance(base, half) == m.Distance(0.0, 25, 0)
    shifted = curve(base.dte_rms, SPEEDS + 1.0)
    assert math.isnan(m.curve_distance(base, shifted).value)


def test_nan_and_branches_that_ended_early_are_never_within():
    base = curve(resonance(SPEEDS))
    broken = curve(np.where(SPEEDS == 1200.0, np.nan, base.dte_rms))
    ended = replace(base, complete=False)
    for other in (broken, ended):
        value = measured(base, other)["rms_distance"][0]
        assert math.isnan(value)
        assert not m.verdict("rms_distance", "model-1", "", value, 1e9, "any").within
    still = curve(np.zeros(SPEEDS.size))
    assert math.isnan(m.curve_distance(still, base).value)


def test_speeds_between_matched_jumps_are_left_out_and_counted():
    low, high = np.full(SPEEDS.size, 1.0), np.full(SPEEDS.size, 3.0)
    base = curve(np.where(SPEEDS > 1400.0, high, low), jumps=(jump(1400.0, 1420.0),))
    late = curve(np.where(SPEEDS > 1500.0, high, low), jumps=(jump(1500.0, 1520.0),))
    assert m.jump_zones(base, late) == [(1400.0, 1520.0)]
    distance = m.curve_distance(base, late, m.jump_zones(base, late))
    assert (distance.value, distance.left_out) == (0.0, 7)
    assert measured(base, late)["jump_frequency"] == [100.0]
    assert measured(base, late)["jumps_unmatched"] == [0.0]


def test_a_missing_jump_hides_nothing_but_its_step():
    low, high = np.full(SPEEDS.size, 1.0), np.full(SPEEDS.size, 3.0)
    base = curve(np.where(SPEEDS > 1400.0, high, low), jumps=(jump(1400.0, 1420.0),))
    none = curve(low)
    assert m.jump_zones(base, none) == m.jump_zones(none, base) == [(1400.0, 1420.0)]
    metrics = measured(base, none)
    assert metrics["jumps_unmatched"] == [1.0]
    assert "jump_frequency" not in metrics
    assert metrics["off_jump_distance"][0] > 0.5


def test_jumps_far_apart_are_two():
    base, other = (
        curve(np.ones(SPEEDS.size), jumps=(jump(f, f + 20.0),)) for f in (1000.0, 1900)
    )
    jump_metrics = [
        metric for metric in m.curve_measures(base, other) if "jump" in metric[0]
    ]
    assert ("jumps_unmatched", "missing 1010 Hz; extra 1910 Hz", 2.0) in jump_metrics


def test_peaks_are_told_one_by_one():
    base = curve(np.ones(SPEEDS.size), peaks=(peak(1500.0, 2e-6), peak(3000.0, 1e-6)))
    other = curve(np.ones(SPEEDS.size), peaks=(peak(1425.0, 3e-6),))
    metrics = measured(base, other)
    assert metrics["peak_amplitude"] == [pytest.approx(0.5)]
    assert metrics["peak_frequency"] == [pytest.approx(-0.05)]
    assert metrics["peaks_unmatched"] == [1.0]


def test_contact_loss_and_force_are_those_of_the_worst_speed():
    base = curve(np.ones(SPEEDS.size))
    loss, force = np.zeros(SPEEDS.size), np.ones(SPEEDS.size)
    loss[7], force[9] = 0.3, 1.5
    metrics = measured(base, replace(base, contact_loss=loss, force_peak=force))
    assert metrics["contact_loss"] == [pytest.approx(0.3)]
    assert metrics["peak_force"] == [pytest.approx(0.5)]
    back = measured(replace(base, contact_loss=loss), base)
    assert back["contact_loss"] == [pytest.approx(-0.3)]


def test_curves_of_other_meshes_are_refused():
    base = curve(np.ones(SPEEDS.size))
    with pytest.raises(ValueError, match="one mesh and direction"):
        list(m.curve_measures(base, replace(base, mesh=2)))


values = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=30)


@given(values)
def test_distance_of_identical_arrays_is_zero(given_values):
    distance = m.relative_distance(given_values, given_values)
    assert distance == 0.0 or not any(np.square(given_values) > 0.0)


@given(values, st.randoms())
def test_distance_is_bounded_symmetric_and_free_of_order(given_values, random):
    a = np.array(given_values) + 2e3
    b = np.array(random.sample(given_values, len(given_values))) + 2e3
    size_a, size_b = (np.sqrt((x**2).mean()) for x in (a, b))
    one, two = m.relative_distance(a, b), m.relative_distance(b, a)
    assert one * size_a == pytest.approx(two * size_b)
    assert 0.0 <= one <= 1.0 + size_b / size_a
    order = random.sample(range(a.size), a.size)
    assert m.relative_distance(a[order], b[order]) == pytest.approx(one)


frequencies = st.lists(st.floats(100.0, 1e4), max_size=6, unique=True)


@given(frequencies, frequencies)
def test_matches_are_one_to_one_and_the_same_both_ways(here, there):
    pairs = m.match_frequencies(here, there)
    assert len({i for i, _ in pairs}) == len({j for _, j in pairs}) == len(pairs)
    assert m.count_unmatched(here, there) == m.count_unmatched(there, here)
    assert m.count_unmatched(here, here) == 0


PARTS = np.arange(256) / 256
WAVE = np.sin(2 * np.pi * PARTS) + 0.4 * np.cos(6 * np.pi * PARTS + 1.0)


@pytest.mark.parametrize("late", [-0.25, -0.03, 0.0, 0.1, 0.4])
def test_shift_of_a_wave_is_its_phase(late):
    at = (PARTS - late) % 1.0
    later = np.sin(2 * np.pi * at) + 0.4 * np.cos(6 * np.pi * at + 1.0)
    match = match_cycles(WAVE, later)
    assert match.phase == pytest.approx(late, abs=1e-3)
    assert match.peak == pytest.approx(0.0, abs=1e-3)
    assert (
        match.correlation == pytest.approx(1.0) if late == 0 else match.correlation < 1
    )


def test_scale_and_mean_leave_correlation_and_phase():
    match = match_cycles(WAVE + 5.0, 2.0 * (WAVE + 5.0))
    assert match.correlation == pytest.approx(1.0)
    assert match.phase == pytest.approx(0.0, abs=1e-9)
    assert match.peak == pytest.approx(1.0)
    assert match_cycles(WAVE, -WAVE).correlation == pytest.approx(-1.0)


def test_waves_that_do_not_vary_have_no_correlation():
    match = match_cycles(np.ones(8), np.arange(8.0))
    assert math.isnan(match.correlation)
    assert math.isnan(match.phase)
    with pytest.raises(ValueError, match="one shape"):
        match_cycles(np.ones(8), np.ones(9))


def test_a_cycle_is_the_first_of_the_record_on_even_times():
    time = np.concatenate([np.linspace(0.0, 0.3, 40), np.linspace(0.31, 2.0, 300)])
    force = np.stack([np.zeros(time.size), np.sin(2.0 * np.pi * time)], axis=1)
    history = History(time, *[force] * 6)
    cycle = force_cycle(history, 1, 1.0)
    error = (2.0 * np.pi * 0.01) ** 2 / 8.0  # of a chord over the widest step
    np.testing.assert_allclose(cycle, np.sin(2.0 * np.pi * PARTS), atol=error)


def statics(deflection, **changes):
    deflection = np.asarray(deflection, float)
    count = deflection.size
    return replace(
        m.Statics(
            mesh=1,
            force=1e3,
            position=np.arange(count) / count,
            deflection=deflection,
            friction=np.zeros(count),
            single_pair_contact=np.zeros(count, bool),
        ),
        **changes,
    )


def test_stiffness_and_variation_of_a_rectangular_wave():
    base = statics(1e3 / np.repeat([2.5e8, 3.5e8], 8))
    assert base.mean_stiffness == pytest.approx(3e8)
    assert base.variation == pytest.approx(1.0 / 3.0)
    stiffer = statics(base.deflection / 1.1)
    metrics = {name: value for name, _, value in m.static_measures(base, stiffer)}
    assert metrics["mean_stiffness"] == pytest.approx(0.1)
    assert metrics["stiffness_variation"] == pytest.approx(0.0, abs=1e-12)
    assert metrics["static_deflection"] == pytest.approx(1.0 - 1.0 / 1.1)


def test_change_by_friction_is_of_single_pairs_in_a_stretch():
    base = statics(
        np.ones(4),
        friction=np.array([1.0, 2.0, 4.0, 8.0]),
        single_pair_contact=np.arange(4) != 1,
    )
    assert base.friction_change(0.0, 0.5) == 1.0
    assert base.friction_change(0.5, 1.0) == 6.0
    assert math.isnan(base.friction_change(0.25, 0.5))


@pytest.mark.parametrize(
    ("metric", "value", "within"),
    [
        ("peak_force", -0.1, True),
        ("peak_force", -0.3, False),
        ("peak_force", math.nan, False),
        ("wave_correlation", 0.95, True),
        ("wave_correlation", 0.1, False),
        ("wave_correlation", -0.95, False),
        ("wave_correlation", math.nan, False),
    ],
)
def test_verdicts_know_the_sense_of_a_metric(metric, value, within):
    allowed = 0.9 if metric == "wave_correlation" else 0.2
    verdict = m.verdict(metric, "model-1", "here", value, allowed, "because")
    assert verdict.within is within
    assert (verdict.unit, verdict.reason) == ("1", "because")
