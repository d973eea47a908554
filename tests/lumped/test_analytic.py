"""Waves from key figures: means, heights, shares, harmonics and best relief."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped import StiffnessParameters, analytic_excitation
from lumped.train.analytic import pair_springs, static_error, stiffness_harmonics
from lumped.train.waves import sum_waves

MEAN, FORCE = 2.9831e8, 2205.0
RATIOS = (1.0, 1.0 + 1e-6, 1.3, 1.504, 2.0 - 1e-6, 2.0, 2.36, 3.0, 3.7)
ratios = st.floats(1.0, 4.5)
shares = st.floats(0.1, 0.9)


def make(ratio, **changes):
    values = {"mean": MEAN, "variation": 0.35, "contact_ratio": ratio}
    return StiffnessParameters(**(values | changes))


def mesh_wave(figures):
    return sum_waves([spring.stiffness for spring in pair_springs(figures)])


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("ramp", [0.0, 1e-7])
def test_mean_and_height(ratio, ramp):
    part = ratio - math.floor(ratio)
    figures = make(ratio, ramp=min(ramp, part, 1.0 - part))
    wave = mesh_wave(figures)
    assert wave.mean == pytest.approx(MEAN, rel=1e-9)
    both = [wave(wave.breaks[:-1]), wave(wave.breaks[1:], side=-1)]
    height = np.ptp(np.concatenate(both))
    expected = 0.35 * MEAN if part else 0.0
    # positions of 1e-16 on a ramp of 1e-7
    assert height == pytest.approx(expected, rel=1e-8 if ramp else 1e-12, abs=1e-6)


@given(ratio=ratios, share=shares)
def test_any_contact_ratio_keeps_the_mean(ratio, share):
    wave = mesh_wave(make(ratio, load_share=share))
    assert wave.mean == pytest.approx(MEAN, rel=1e-9)


@given(ratio=ratios, share=shares, part=st.floats(0.0, 1.0))
def test_trapezoid_keeps_the_mean(ratio, share, part):
    room = min(ratio % 1.0, 1.0 - ratio % 1.0)
    wave = mesh_wave(make(ratio, load_share=share, ramp=part * room))
    assert wave.mean == pytest.approx(MEAN, rel=1e-9)


@given(ratio=ratios, share=shares, x=st.floats(0.0, 1.0))
def test_pairs_in_contact(ratio, share, x):
    """As many springs touch as the contact ratio allows."""
    figures = make(ratio, load_share=share)
    touching = sum(float(s.stiffness(x)) > 0.0 for s in pair_springs(figures))
    assert touching in (figures.pairs, figures.pairs + 1)


@pytest.mark.parametrize("approach", [None, 0.3, 0.752])
def test_contact_starts_at_the_approach(approach):
    figures = make(1.504, approach=approach)
    start = -(0.752 if approach is None else approach)
    wave = mesh_wave(figures)
    assert wave(start) == pytest.approx(figures.high, rel=1e-12)
    assert wave(start, side=-1) == pytest.approx(figures.low, rel=1e-12)
    assert wave(start + 0.504, side=-1) == pytest.approx(figures.high, rel=1e-12)
    assert wave(start + 0.504) == pytest.approx(figures.low, rel=1e-12)


@pytest.mark.parametrize("share", [0.5, 0.6, 0.25])
def test_load_share_of_the_leaving_pair(share):
    """alpha where double contact starts, 1 - alpha where it ends."""
    figures = make(1.504, load_share=share)
    springs = pair_springs(figures)
    start, end = 1.0 - 0.752, 0.752
    first = [float(s.stiffness(start)) / figures.high for s in springs]
    last = [float(s.stiffness(end, side=-1)) / figures.high for s in springs]
    entering, leaving = 0, 1  # pairs -1 and 0
    assert first[leaving] == pytest.approx(share)
    assert first[entering] == pytest.approx(1.0 - share)
    assert last[leaving] == pytest.approx(1.0 - share)
    assert last[entering] == pytest.approx(share)
    middle = [float(s.stiffness(0.5)) / figures.high for s in springs]
    np.testing.assert_allclose(middle, 0.5, rtol=1e-9)


def best_relief(figures):
    """Eq. (2.28), for a contact ratio below 2."""
    eps, c = figures.variation, figures.contact_ratio
    double, single = 1.0 + eps * (2.0 - c), 1.0 + eps * (1.0 - c)
    return 2.0 * FORCE * eps / (figures.mean * single * double)


@pytest.mark.parametrize("ratio", [1.2, 1.504, 1.8])
def test_best_relief_makes_the_static_error_flat(ratio):
    """Eq. (2.28): twice the peak-to-peak error of unmodified teeth."""
    figures, c = make(ratio), ratio
    relief = best_relief(figures)
    plain = static_error(pair_springs(figures), FORCE)
    height = FORCE / figures.low - FORCE / figures.high
    x = np.linspace(0.0, 1.0, 1001)
    assert np.ptp(plain(x)) == pytest.approx(height, rel=1e-9)
    assert relief == pytest.approx(2.0 * height, rel=1e-12)
    gap = [(-c / 2, relief), (c / 2 - 1, 0.0), (1 - c / 2, 0.0), (c / 2, relief)]
    flat = static_error(pair_springs(figures, gap), FORCE)
    assert np.ptp(flat(x)) < 1e-9 * height
    for factor in (0.8, 1.2):
        other = [(at, factor * depth) for at, depth in gap]
        assert np.ptp(static_error(pair_springs(figures, other), FORCE)(x)) > (
            0.1 * height
        )


@pytest.mark.parametrize("ratio", [1.504, 2.36])
def test_static_error_carries_the_force(ratio):
    """Eq. (2.8) as an equilibrium, with pairs that do not touch."""
    gap = [(-ratio / 2, 3e-5), (-0.2, 0.0), (0.2, 0.0), (ratio / 2, 3e-5)]
    springs = pair_springs(make(ratio), gap)
    error = static_error(springs, FORCE)
    x = np.arange(512) / 512
    deflection = error(x)
    held = sum(
        spring.stiffness(x) * np.maximum(deflection - spring.gap(x), 0.0)
        for spring in springs
    )
    np.testing.assert_allclose(held, FORCE, rtol=1e-9)


def test_error_without_load_is_the_least_gap():
    gap = [(-0.752, 1e-5), (-0.248, 0.0), (0.248, 0.0), (0.752, 1e-5)]
    springs = pair_springs(make(1.504), gap)
    x = np.arange(512) / 512
    touching = [np.where(s.stiffness(x) > 0.0, s.gap(x), np.inf) for s in springs]
    np.testing.assert_allclose(
        static_error(springs, 0.0)(x), np.min(touching, axis=0), atol=1e-18
    )


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("approach", [None, 0.4])
@pytest.mark.parametrize("ramp", [0.0, 0.1])
def test_harmonics_are_those_of_the_wave(ratio, approach, ramp):
    """Fourier integrals of the linear pieces, exact."""
    room = min(ratio % 1.0, 1.0 - ratio % 1.0)
    figures = make(ratio, approach=approach, ramp=min(ramp, room))
    wave = mesh_wave(figures)
    harmonics = stiffness_harmonics(figures, 6)
    a, h = wave.breaks[:-1], np.diff(wave.breaks)
    x, w = np.polynomial.legendre.leggauss(24)
    at = a[:, None] + 0.5 * h[:, None] * (1.0 + x)
    values = wave(at) * 0.5 * h[:, None] * w
    for s in range(1, 7):
        exact = (values * np.exp(-2j * np.pi * s * at)).sum()
        assert abs(harmonics[s - 1] - exact) < 1e-9 * MEAN


def test_many_harmonics_approach_the_wave():
    figures = make(1.504, ramp=0.2)
    excitation = analytic_excitation(figures, harmonics=60)
    x = np.linspace(0.0, 1.0, 200, endpoint=False)
    wave = mesh_wave(figures)
    np.testing.assert_allclose(
        excitation.pairs[0].stiffness(x), wave(x), atol=5e-3 * MEAN
    )


@pytest.mark.parametrize("model", [1, 2, 3])
@pytest.mark.parametrize("harmonics", [None, 3])
def test_models_take_what_is_theirs(model, harmonics):
    excitation = analytic_excitation(
        make(1.504), model, force=FORCE, harmonics=harmonics
    )
    stiffness = [pair.stiffness for pair in excitation.pairs]
    assert excitation.mean_stiffness == MEAN
    assert sum_waves(stiffness).mean == pytest.approx(MEAN, rel=1e-9)
    assert len(stiffness) == (2 if model == 1 and harmonics is None else 1)
    constant_stiffness = np.ptp(stiffness[0](np.linspace(0.0, 1.0, 99))) == 0.0
    assert constant_stiffness == (model == 2)
    gap = excitation.pairs[0].gap
    assert (np.ptp(gap(np.linspace(0.0, 1.0, 99))) > 0.0) == (model == 2)
    assert gap.mean == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mean": 0.0}, "mean = 0; must be positive"),
        ({"mean": math.nan}, "mean"),
        ({"variation": 1.0}, "variation"),
        ({"variation": -0.1}, "variation"),
        ({"contact_ratio": 0.9}, "contact_ratio = 0.9; must be from 1"),
        ({"load_share": 1.0}, "load_share"),
        ({"ramp": 0.6}, "ramp = 0.6; must be from 0 to 0.5"),
    ],
)
def test_figures_are_checked(changes, message):
    values = {"mean": MEAN, "variation": 0.35, "contact_ratio": 1.5} | changes
    with pytest.raises(ValueError, match=message):
        StiffnessParameters(**values)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"model": 4}, "model = 4; must be 1, 2 or 3"),
        ({"harmonics": 0}, "harmonics = 0; must be 1 or more"),
        ({"harmonics": 2, "gap": [(0.0, 0.0), (0.5, 1e-6)]}, "gaps need tooth pairs"),
    ],
)
def test_excitation_names_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        analytic_excitation(make(1.5), **arguments)
