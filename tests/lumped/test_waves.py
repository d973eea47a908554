"""Periodic piecewise cubics: values, limits, means, sums and cuts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lumped.train.waves import (
    Wave,
    constant_wave,
    cut_into_pitches,
    linear_pieces,
    linear_wave,
    multiply_waves,
    shift_cubics,
    sum_waves,
    wave_from_harmonics,
    wave_from_samples,
)

small = st.floats(-10.0, 10.0).map(lambda value: round(value, 9))
positions = st.floats(-3.0, 3.0)


@st.composite
def waves(draw):
    inner = draw(st.lists(st.integers(1, 99), max_size=5, unique=True))
    breaks = np.array([0, *sorted(inner), 100]) / 100.0
    rows = draw(arrays(np.float64, (breaks.size - 1, 4), elements=small))
    return Wave(breaks, rows, tuple(breaks[:-1]))


def gauss_mean(wave):
    x, w = np.polynomial.legendre.leggauss(3)
    h = np.diff(wave.breaks)
    at = wave.breaks[:-1, None] + 0.5 * h[:, None] * (1.0 + x)
    return float((0.5 * h[:, None] * w * wave(at)).sum())


@given(wave=waves())
def test_mean_is_the_integral(wave):
    assert wave.mean == pytest.approx(gauss_mean(wave), rel=1e-12, abs=1e-11)


@given(wave=waves(), x=positions, turns=st.integers(-5, 5))
def test_period_is_one(wave, x, turns):
    on_break = np.abs((x - wave.breaks) % 1.0)
    if min(on_break.min(), (1.0 - on_break).min()) < 1e-9:
        return
    np.testing.assert_allclose(wave(x + turns), wave(x), rtol=1e-9, atol=1e-9)


@given(wave=waves())
def test_jumps_have_two_sides(wave):
    """At each break the piece before ends and the next one begins."""
    c = wave.coefficients
    h = np.diff(wave.breaks)[:, None] ** np.arange(4)
    ends = (c * h).sum(axis=1)
    np.testing.assert_allclose(wave(wave.breaks[:-1]), c[:, 0], rtol=1e-12)
    np.testing.assert_allclose(
        wave(wave.breaks[1:], side=-1), ends, rtol=1e-9, atol=1e-10
    )
    assert wave(0.0, side=-1) == wave(1.0, side=-1) == wave(-2.0, side=-1)
    assert wave(1.0) == wave(0.0)


@given(one=waves(), two=waves(), x=positions)
def test_sum_is_the_sum_of_values(one, two, x):
    both = sum_waves([one, two])
    assert both.mean == pytest.approx(one.mean + two.mean, rel=1e-11, abs=1e-10)
    assert set(both.corners) == {*one.corners, *two.corners}
    for side in (1, -1):
        np.testing.assert_allclose(
            both(x, side), one(x, side) + two(x, side), rtol=1e-8, atol=1e-8
        )


@given(wave=waves(), factor=small, offset=small, x=positions)
def test_scaled(wave, factor, offset, x):
    expected = factor * wave(x) + offset
    assert wave.scaled(factor, offset)(x) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(c=arrays(np.float64, (1, 4), elements=small), shift=small, x=small)
def test_shifted_cubics_are_the_same_cubics(c, shift, x):
    moved = shift_cubics(c, np.array([shift]))[0]
    one = np.polynomial.polynomial.polyval(x + shift, c[0])
    two = np.polynomial.polynomial.polyval(x, moved)
    assert two == pytest.approx(one, rel=1e-9, abs=1e-7)


@given(samples=arrays(np.float64, st.integers(4, 12), elements=small))
def test_interpolant_stays_within_its_samples(samples):
    """Between two samples no value is beyond both of them."""
    wave, n = wave_from_samples(samples), samples.size
    np.testing.assert_allclose(wave(np.arange(n) / n), samples, atol=1e-12)
    inside = wave((np.arange(n)[:, None] + np.linspace(0.0, 1.0, 9)[1:-1]) / n)
    ends = np.stack([samples, np.roll(samples, -1)])
    assert (inside >= ends.min(axis=0)[:, None] - 1e-9).all()
    assert (inside <= ends.max(axis=0)[:, None] + 1e-9).all()


@given(
    samples=arrays(np.float64, 8, elements=small),
    turn=st.integers(0, 7),
    x=positions,
)
def test_interpolant_turns_with_its_samples(samples, turn, x):
    turned = wave_from_samples(np.roll(samples, -turn))
    assert turned(x) == pytest.approx(
        float(wave_from_samples(samples)(x + turn / 8)), abs=1e-8
    )


def test_interpolant_has_order_three_or_more():
    errors = []
    for n in (16, 32, 64, 128):
        x = np.arange(n) / n
        interpolant = wave_from_samples(np.sin(2 * np.pi * x))(
            (np.arange(1000) + 0.3) / 1000
        )
        exact = np.sin(2 * np.pi * (np.arange(1000) + 0.3) / 1000)
        errors.append(np.sqrt(((interpolant - exact) ** 2).mean()))
    assert -np.polyfit(range(4), np.log2(errors), 1)[0] > 2.3


@pytest.mark.parametrize("count", [1, 3, 10])
def test_harmonics_are_kept(count):
    s = np.arange(1, count + 1)
    c = (0.3 + 0.2j) ** s * s
    wave = wave_from_harmonics(2.0, c)
    x = np.linspace(-1.0, 1.0, 777)
    expected = 2.0 + 2.0 * (c * np.exp(2j * np.pi * x[:, None] * s)).sum(axis=1).real
    np.testing.assert_allclose(wave(x), expected, atol=2e-8 * np.abs(c).sum())
    assert wave.mean == pytest.approx(2.0, rel=1e-12)


def test_constant():
    wave = constant_wave(3.0)
    assert wave.mean == 3.0
    assert (wave(np.linspace(-2.0, 2.0, 9)) == 3.0).all()


@given(
    start=st.floats(-3.0, 0.0),
    lengths=st.lists(st.floats(0.05, 0.9), min_size=1, max_size=4),
    heights=st.lists(small, min_size=5, max_size=5),
    outside=small,
    x=st.floats(-4.0, 4.0),
)
def test_cut_at_pitches_keeps_the_function(start, lengths, heights, outside, x):
    """Pair k at cycle position x stands at k + x of its own way."""
    at = start + np.cumsum([0.0, *lengths])
    points = list(zip(at, heights, strict=False))
    cut = cut_into_pitches(*linear_pieces(points), at, outside)
    if np.abs(x - at).min() < 1e-6 or abs(x - round(x)) < 1e-6:
        return
    inside = at[0] < x < at[-1]
    expected = np.interp(x, at, heights[: at.size]) if inside else outside
    k = math.floor(x)
    if k in cut:
        assert cut[k](x - k) == pytest.approx(expected, abs=1e-7)
    else:
        assert not inside


def test_cut_at_pitches_keeps_jumps_and_their_corners():
    points = [(-0.4, 0.0), (-0.4, 2.0), (0.3, 2.0), (0.3, 5.0), (0.6, 5.0), (0.6, 0.0)]
    cut = cut_into_pitches(*linear_pieces(points), {x for x, _ in points}, 0.0)
    assert sorted(cut) == [-1, 0]
    assert cut[-1](0.6) == 2.0
    assert cut[-1](0.6, side=-1) == 0.0
    assert (cut[0](0.3), cut[0](0.3, side=-1)) == (5.0, 2.0)
    assert cut[0](0.6) == 0.0
    np.testing.assert_allclose(cut[-1].corners, [0.6])
    np.testing.assert_allclose(sorted(cut[0].corners), [0.3, 0.6])
    # the pair passes its wave on at the pitch without a jump
    assert cut[-1](1.0, side=-1) == cut[0](0.0)


def test_corners_on_a_pitch_belong_to_one_pair():
    points = [(-1.0, 0.0), (-1.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    cut = cut_into_pitches(*linear_pieces(points), {-1.0, 1.0}, 0.0)
    assert sorted(cut) == [-1, 0]
    assert sum_waves(list(cut.values())).mean == 2.0


@pytest.mark.parametrize(
    ("breaks", "rows", "message"),
    [
        ([0.0, 1.0], np.zeros((2, 4)), "shape"),
        ([0.1, 1.0], np.zeros((1, 4)), "begin at 0"),
        ([0.0, 0.9], np.zeros((1, 4)), "end at 1"),
        ([0.0, 0.5, 0.5, 1.0], np.zeros((3, 4)), "increase"),
        ([0.0, 1.0], np.full((1, 4), math.nan), "finite"),
    ],
)
def test_what_is_no_wave_is_named(breaks, rows, message):
    with pytest.raises(ValueError, match=message):
        Wave(np.array(breaks), rows)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (np.zeros(3), r"shape of samples = \(3,\); must be \(n,\), n >= 4"),
        (np.zeros((2, 4)), "shape"),
        (np.array([0.0, 1.0, math.nan, 2.0]), "finite"),
    ],
)
def test_samples_are_checked(samples, message):
    with pytest.raises(ValueError, match=message):
        wave_from_samples(samples)


@given(one=waves(), start=small, slope=small)
def test_products_are_exact_up_to_the_third_degree(one, start, slope):
    """Else at the breaks, with the slopes there."""
    square = Wave(one.breaks, one.coefficients * [1.0, 1.0, 1.0, 0.0], one.corners)
    wave, x = (
        multiply_waves(square, linear_wave(start, slope)),
        np.linspace(0.0, 0.999, 97),
    )
    exact = square(x) * (start + slope * x)
    np.testing.assert_allclose(wave(x), exact, rtol=1e-9, atol=1e-7)
    assert wave.corners == one.corners


def test_products_of_base_pitches_that_differ():
    rows = np.arange(24.0).reshape(3, 2, 4)
    one = Wave(np.array([0.0, 0.4, 1.0]), rows)
    other = Wave(
        np.array([0.0, 0.7, 1.0]), np.ones((2, 2, 4)) * [[[1.0, 0.5, 0.0, 0.0]]]
    )
    wave = multiply_waves(one, other)
    assert wave.period == 6
    for pitch in range(6):
        x = wave.breaks[:-1]
        np.testing.assert_allclose(
            wave(x, pitch=pitch), one(x, pitch=pitch) * other(x, pitch=pitch)
        )
    with pytest.raises(ValueError, match="without offsets"):
        multiply_waves(one, Wave(one.breaks, one.coefficients, offsets=np.ones(2)))
