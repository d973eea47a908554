"""Closed forms against integrated motion, and how fast they part from it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lumped import Settings, respond_with_history, sweep
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.closed_forms import (
    contact_loss_amplitude,
    instability_interval,
    limits,
    linear_amplitude,
    parametric_system,
    peak,
    peak_amplitude,
    resonance,
    steady_vibrations,
    superharmonic,
    transition_frequencies,
)

EXACT = Settings(method="dopri5", tolerance=1e-7)
SCALES = np.array([0.5, 0.25, 0.125])


def integrated(system, frequency, order=1):
    """Amplitudes (m,) of e^(i order w t) of the settled mesh deflections [m]."""
    response, history = respond_with_history(system, frequency, EXACT)
    assert response.contact_loss.max() == 0.0
    turn = np.exp(-2j * np.pi * order * frequency * history.time)
    area = np.trapezoid(history.deflection * turn[:, None], history.time, axis=0)
    return 2.0 * np.abs(area) / (history.time[-1] - history.time[0])


def fitted_order(errors):
    return np.polyfit(np.log(SCALES), np.log(errors), 1)[0]


def beside_resonance(chapter_3, scale):
    """Error of the amplitude beside the first mode, its detuning scaled as well."""
    system = chapter_3(scale)
    near = resonance(parametric_system(system), 0)
    frequency = near.at * (1.0 + 0.15 * scale)
    expected = near.amplitudes(linear_amplitude(near, frequency))
    return np.abs(integrated(system, frequency) / expected - 1.0).max()


def test_a_fundamental_resonance_is_right_to_first_order(chapter_3):
    errors = [beside_resonance(chapter_3, scale) for scale in SCALES]
    assert fitted_order(errors) == pytest.approx(1.0, abs=0.1)
    assert errors[-1] < 0.03


def test_large_variations_leave_the_form(chapter_3):
    """Of 70 and 80 % peak to peak: other modes and higher orders are not small."""
    assert beside_resonance(chapter_3, 2.0) > 0.25


def test_a_superharmonic_peak_is_right_to_first_order(chapter_3):
    """Waves of one harmonic: nothing but eq. 3.42 drives twice the mesh frequency."""
    errors = []
    for scale in SCALES:
        system = chapter_3(scale, harmonics=1)
        near = superharmonic(parametric_system(system, harmonics=1), 0, 2)
        expected = near.amplitudes(peak_amplitude(near))
        errors.append(np.abs(integrated(system, near.at, 2) / expected - 1.0).max())
    assert errors[-1] < 1e-3
    assert fitted_order(errors) > 0.9


def test_the_peak_where_contact_is_lost(chapter_3):
    """Swept down its upper branch; damping such that mesh 2 is lost for a seventh."""
    scale = 0.25
    near = resonance(parametric_system(chapter_3(scale)), 0)
    over = peak_amplitude(near) / contact_loss_amplitude(near).min()
    system = chapter_3(scale, damping=0.04 * over / 1.1)
    near = resonance(parametric_system(system), 0)
    top = peak(near)
    assert top.separation[0] == 0.0
    speeds = top.frequency * (1.0 + scale * np.array([0.02, 0.01, 0.0, -0.01]))
    branch = sweep(system, speeds, "down", EXACT)
    rms = branch.column("dte_rms").max(axis=0)
    np.testing.assert_allclose(
        np.sqrt(2.0) * rms, near.amplitudes(top.amplitude), 0.015
    )
    lost = branch.column("contact_loss").max(axis=0)
    np.testing.assert_allclose(lost, top.separation / np.pi, atol=0.015)


@pytest.mark.parametrize(
    ("damping", "off"), [(0.08, (0.03, 0.06)), (0.04, (0.17, 0.22))]
)
def test_long_loss_of_contact_leaves_the_form_and_is_told(chapter_3, damping, off):
    """The peak stands lower than it says: the mean deflection falls, which it holds."""
    system = chapter_3(damping=damping)
    parametric = parametric_system(system)
    near = resonance(parametric, 0)
    speeds = near.at * np.arange(0.68, 1.1, 0.01)
    branch = sweep(system, speeds, "down")
    peak_index = branch.column("dte_rms")[:, 1].argmax()
    deviation = peak(near).frequency / branch.frequency_Hz[peak_index] - 1.0
    assert off[0] < deviation < off[1]
    assert bool(limits(parametric, near)) == (deviation > 0.1)


def test_contact_is_first_lost_where_the_transitions_say(chapter_3):
    """Toward the resonance from either side, within the second order of the variation.

    Below it another motion that loses contact is possible as well, hence the sweep.
    """
    system = chapter_3(0.25)
    near = resonance(parametric_system(system), 0)
    below, above = transition_frequencies(near, 1)
    margin = 0.15 * (above - below)
    steps = margin * np.array([-4.0, -1.0, 1.0])
    for direction, speeds in (("up", below + steps), ("down", above - steps)):
        lost = sweep(system, speeds, direction, EXACT).column("contact_loss")[:, 1]
        assert (lost > 0.0).tolist() == [False, False, True]


def test_a_subharmonic_grows_inside_of_its_interval_only(chapter_3):
    """Below the interval the motion of twice the period goes on once it is there."""
    system = chapter_3(0.25, damping=0.03)
    near = resonance(parametric_system(system), 0, Fraction(1, 2))
    low, high = instability_interval(near)
    step = 0.2 * (high - low)
    outside, _ = respond_with_history(system, high + step, EXACT)
    assert outside.contact_loss.max() == 0.0
    # the first speed starts at rest, far from the motion that is unstable there
    inside = sweep(system, (high - step, low + step, low - step), "down", EXACT)
    assert inside.column("contact_loss")[:, 1].min() > 0.0
    assert [response.multiple for response in inside.responses] == [2, 2, 2]


def unstable_by_balance(system, near, scale):
    """Frequencies and RMS of mesh 2 on the branch by harmonic balance, (n,) each."""
    ends = near.at * (1.0 - 0.35 * scale), near.at * (1.0 + 0.25 * scale)
    family = SpeedFamily(system, unit=0.2 * scale * near.at)
    finder = BranchFinder(family, ends, BranchSettings(harmonics=12))
    finder.from_rest(ends[1])
    points = [point for branch in finder.branches for point in branch.points]
    unstable = [point for point in points if not point.stable]
    rms = [point.figures["dte_rms"][1] for point in unstable]
    return np.array([point.frequency for point in unstable]), np.array(rms)


def test_the_unstable_branch_is_that_of_harmonic_balance(chapter_3):
    """Between its folds, at variations of 5 %; no integration arrives there."""
    scale = 0.125
    near = resonance(parametric_system(chapter_3(scale)), 0)
    over = peak_amplitude(near) / contact_loss_amplitude(near).min()
    system = chapter_3(scale, damping=0.04 * over / 1.3)
    near = resonance(parametric_system(system), 0)
    first, last = contact_loss_amplitude(near).min(), peak_amplitude(near)
    lower = [
        steady_vibrations(near, alpha)[0]
        for alpha in np.linspace(first, last, 2000)[1:-1]
    ]
    unstable = [vibration for vibration in lower if not vibration.stable]
    speeds = np.array([vibration.frequency for vibration in unstable])
    rms = np.array([near.amplitudes(vibration.amplitude)[1] for vibration in unstable])
    rms /= np.sqrt(2.0)
    exact_speeds, exact_rms = unstable_by_balance(system, near, scale)
    # the fold at which the branch that keeps contact ends
    fold, exact_fold = (
        1.0 - frequencies.max() / near.at for frequencies in (speeds, exact_speeds)
    )
    assert fold == pytest.approx(exact_fold, rel=0.05)
    both = (exact_speeds > speeds.min()) & (exact_speeds < speeds.max())
    assert both.sum() > 5
    order = np.argsort(speeds)
    interpolated_rms = np.interp(exact_speeds[both], speeds[order], rms[order])
    np.testing.assert_allclose(interpolated_rms, exact_rms[both], rtol=0.06)
