"""Body modes of the coupled model, on gears whose bodies are rims on spokes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rim_gears import FREE, RimGears
from scipy.linalg import eigh

from lumped import Settings, respond
from lumped.branches.period_map import PeriodMap
from lumped.train.truncation import TruncationModel

SOFT = 1.5e-9  # m/N of a gear's spokes
WAVES = ((0.0, 3e-7), (1e-6, 2e-7), (5e-7, 2e-7), (0.0, 3e-7))
PAIR = RimGears(spokes=SOFT, in_rim=0.7, gap=WAVES, damping=0.02, vibrating=True)
IDLER = replace(PAIR, gears=3)
FREE_PAIR = replace(PAIR, ground=FREE)


@pytest.mark.parametrize("case", [PAIR, IDLER], ids=["pair", "idler"])
def test_statics_and_all_frequencies_are_exact(case):
    """Relief of inertia alone is right for bodies without hub or without rim only."""
    still = replace(case, gap=tuple((mean, 0.0) for mean, _ in case.gap))
    system = still.coupled
    loaded = system.loaded
    exact = np.tile(still.exact_static, (len(loaded.deflection), 1))
    np.testing.assert_allclose(loaded.deflection, exact)
    frequencies = still.dense.angular / (2.0 * np.pi)
    np.testing.assert_allclose(np.sort(loaded.frequency_Hz), np.sort(frequencies))
    less = replace(still, vibrating=False).coupled.loaded
    np.testing.assert_allclose(less.deflection, loaded.deflection)
    lowest = less.frequency_Hz / np.sort(frequencies)[: less.frequency_Hz.size]
    assert np.abs(lowest - 1.0).max() > 5e-3


def test_gears_that_turn_freely_go_with_their_rims():
    """The free rotation is no coordinate, but it moves against the bodies."""
    case = replace(FREE_PAIR, gap=((0.0, 0.0),))
    dense = case.dense
    squares = eigh(dense.matrix, np.diag(dense.mass), eigvals_only=True)
    eigenvalues = (2.0 * np.pi * case.coupled.loaded.frequency_Hz) ** 2
    np.testing.assert_allclose(np.sort(eigenvalues), squares[1:], rtol=1e-9)


@pytest.mark.parametrize("case", [PAIR, IDLER], ids=["pair", "idler"])
@pytest.mark.parametrize("part", [0.3, 0.8, 1.2])
def test_vibration_is_exact_beside_a_resonance_of_bodies(case, part):
    """Parts of the highest frequency, which is one of the rims."""
    case = replace(case, positions=512)
    frequency = part * case.dense.angular[-1] / (2.0 * np.pi)
    response = respond(case.coupled, frequency, Settings(steps=256, tolerance=1e-9))
    assert not response.contact_loss.any()
    np.testing.assert_allclose(response.dte_rms, case.exact_rms(frequency), rtol=2e-4)


def test_steps_are_of_fourth_order():
    case = replace(PAIR, positions=512)
    frequency = 0.3 * case.dense.angular[-1] / (2.0 * np.pi)
    exact = case.exact_rms(frequency)[0]
    counts = np.array([32, 64, 128])
    errors = [
        abs(respond(case.coupled, frequency, settings).dte_rms[0] / exact - 1.0)
        for settings in (
            Settings(steps=n, tolerance=1e-10, step_angle=2.0) for n in counts.tolist()
        )
    ]
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate > 3.5


def test_changes_along_a_period_are_the_derivative_of_the_steps():
    case = replace(PAIR, backlash=8e-6, gap=((0.0, 3e-6), (0.0, 3e-6)))
    system = case.coupled
    frequency = 0.9 * system.resonances_Hz[0]
    motion = PeriodMap(system)
    x = motion.of_response(respond(system, frequency), Settings())
    _, jacobian, by_frequency = motion.equations(x, frequency)
    change = 1e-4 * motion.size
    for i, unit in enumerate(change * np.eye(x.size)):
        ends = [motion.errors(x + sign * unit, frequency) for sign in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / (2.0 * change)
        np.testing.assert_allclose(jacobian[:, i], slope, atol=1e-3)
    ends = [motion.errors(x, frequency + step) for step in (0.01, -0.01)]
    slope = (ends[0] - ends[1]) / 0.02
    np.testing.assert_allclose(by_frequency, slope, atol=1e-3 * np.abs(slope).max())


def inertia(**changes) -> TruncationModel:
    defaults = {
        "frequencies_Hz": np.array([4e3, 9e3, 9e3, 30e3]),
        "damping_ratio": np.full(4, 0.01),
        "families": np.array([0, 1, 1, 3]),
        "compliance": np.array([[0.2, 0.03, 0.04, 0.01]]),
        "unsolved_Hz": 40e3,
        "unsolved_compliance": np.array([0.02]),
        "amplitudes": np.array([1.0, 0.3, 0.1], complex)[None],
        "rate": np.ones(1),
        "resonances_Hz": np.array([3000.0]),
        "energy": np.array([[0.8]]),
        "resonance_damping": 0.5,
    }
    return TruncationModel(**defaults | changes)


def test_more_modes_leave_out_less_and_the_fewest_are_chosen():
    bodies, band = inertia(), (500.0, 5000.0)
    masks = [np.array(m, bool) for m in ([0] * 4, [1, 0, 0, 0], [1, 1, 1, 0], [1] * 4)]
    errors = [bodies.largest_error(mask, band) for mask in masks]
    assert (np.diff(errors) < 0.0).all()
    for mask, error in zip(masks, errors, strict=True):
        np.testing.assert_array_equal(bodies.choose(band, 1.001 * error), mask)


def test_the_bound_is_that_of_one_mode_off_resonance():
    """c r of the mode alone, r = x^2 / |1 - x^2 + 2 i zeta x|."""
    alone = inertia(unsolved_compliance=np.zeros(1), amplitudes=np.array([[1.0 + 0j]]))
    retained = np.array([0, 1, 1, 1], bool)
    x = 1000.0 / 4000.0
    expected = 0.2 * x**2 / abs(1.0 - x**2 + 0.02j * x)
    bound = alone.largest_error(retained, (999.999, 1000.0))
    assert bound == pytest.approx(expected, rel=1e-4)


SHARP = {"resonances_Hz": np.array([7500.0]), "resonance_damping": 0.005}


def test_a_shifted_resonance_counts_by_half_bandwidths():
    """A shift by s of them changes amplitudes on the flanks by s / 2.

    Only the part of the vibration that is resonance counts.
    """
    alone = inertia(**SHARP, unsolved_compliance=np.zeros(1))
    retained, band = np.array([1, 1, 1, 0], bool), (2400.0, 2600.0)
    x = 7500.0 / 30e3
    change = 0.01 * x**2 / abs(1.0 - x**2 + 0.02j * x)
    shift = 0.8 * change / (2.0 * 0.005)
    grown = 0.1 / np.sqrt(1.1) * 0.8 / (2.0 * 0.005)  # the third harmonic
    expected = 0.5 * shift * grown / np.hypot(1.0, grown)
    assert alone.flank_bound(retained, band) == pytest.approx(expected, rel=1e-9)
    assert alone.flank_bound(retained, (2700.0, 3000.0)) == 0.0, "no harmonic meets it"
    assert alone.flank_bound(np.ones(4, bool), band) == 0.0


def test_little_damping_keeps_more_modes():
    band = (2400.0, 2600.0)
    counts = [
        inertia(**SHARP | {"resonance_damping": damping}).choose(band).sum()
        for damping in (0.5, 0.005)
    ]
    assert counts[0] < counts[1]


def test_slow_gears_keep_no_body_modes():
    assert not inertia().choose((5.0, 50.0)).any()
