"""Jumps and peaks of frequency responses."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped import sweep_all
from lumped.steady.jumps import find_jumps, find_peaks, prominent_maxima


def branch(frequency, *curves, direction="up"):
    columns = {"dte_rms": np.array(curves).T}
    for name in ("force_peak", "contact_loss"):
        columns[name] = np.zeros_like(columns["dte_rms"])
    return SimpleNamespace(
        frequency_Hz=np.asarray(frequency, float),
        direction=direction,
        column=columns.__getitem__,
        system=SimpleNamespace(excitations=curves),
    )


def softening(frequency, direction):
    """Amplitude of a softening Duffing oscillator over frequency [Hz].

    (1000 (1 - 10 a^2) - f)^2 = (3 / a)^2 - 30^2; the curve keeps to the root next to
    the one before, until its branch ends.
    """
    a = np.linspace(1e-3, 0.0999, 40001)
    last = 0.0
    out = []
    for f in frequency:
        miss = (1000.0 * (1.0 - 10.0 * a**2) - f) ** 2 - (3.0 / a) ** 2 + 30.0**2
        roots = a[np.flatnonzero(np.diff(np.sign(miss)))]
        last = roots[np.abs(roots - last).argmin()]
        out.append(last)
    return 1e-4 * np.array(out)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_fold_is_one_jump_and_its_end_is_named(direction):
    frequency = np.arange(500.0, 1200.0, 5.0)
    if direction == "down":
        frequency = frequency[::-1]
    curve = softening(frequency, direction)
    jumps = find_jumps(branch(frequency, curve, direction=direction))
    assert len(jumps) == 1
    step = int(np.abs(np.diff(curve)).argmax())
    jump = jumps[0]
    assert (jump.frequency_from, jump.frequency_to) == tuple(frequency[step : step + 2])
    assert (jump.dte_rms_from, jump.dte_rms_to) == tuple(curve[step : step + 2])
    assert (jump.direction, jump.mesh) == (direction, 1)


@pytest.mark.parametrize("offset", [0.0, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("points", [5, 3, 2])
def test_a_resolved_peak_is_no_jump(points, offset):
    """Points over the half width, at any offset from the top."""
    step = 2.0 / points
    x = np.arange(-60, 60) * step + offset * step
    for power in (0.5, 1.0):
        lorentzian = 1e-6 / (1.0 + x**2) ** power
        assert find_jumps(branch(1000.0 + x, lorentzian)) == []


def test_a_plateau_and_round_off_are_no_jumps():
    frequency = np.arange(20.0)
    noise = 1e-19 * (frequency % 3)
    assert find_jumps(branch(frequency, np.full(20, 1e-6), 1e-6 + noise, noise)) == []


def test_a_step_on_a_plateau_is_a_jump_in_its_mesh_only():
    step = np.where(np.arange(20) < 10, 1e-6, 2e-6)
    jumps = find_jumps(branch(np.arange(20.0), np.full(20, 1e-6), step))
    assert [(j.mesh, j.frequency_from) for j in jumps] == [(2, 9.0)]


def test_nan_rows_are_passed_over():
    curve = np.where(np.arange(20) < 10, 1e-6, 2e-6)
    curve[[3, 18, 19]] = np.nan
    assert len(find_jumps(branch(np.arange(20.0), curve))) == 1
    assert find_jumps(branch(np.arange(20.0), np.full(20, np.nan))) == []


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_points_are_no_jumps_and_no_error(count):
    curve = np.array([1e-6, 9e-6, 1e-6])[:count]
    assert find_jumps(branch(np.arange(float(count)), curve)) == []


def test_uneven_speeds_are_compared_by_their_slopes():
    frequency = np.array([0.0, 1.0, 2.0, 3.0, 23.0, 24.0, 25.0])
    assert find_jumps(branch(frequency, 1e-6 * (1.0 + frequency))) == []


def test_prominent_maxima():
    assert prominent_maxima(np.array([0.0, 1.0, 0.0, 0.5, 0.45, 2.0, 0.1])) == [1, 5]
    assert prominent_maxima(np.array([3.0, 1.0, 2.0])) == []
    assert prominent_maxima(np.array([1.0, np.nan, 4.0, 4.0, 1.0])) == [2]
    assert prominent_maxima(np.zeros(5)) == []
    assert prominent_maxima(np.array([])) == []


def idler_system(torque=100.0):
    """The built-in train with rectangular waves of the printed figures."""
    excitations = Excitations(ExcitationSettings(kind="rectangular"))
    gear_set = load_gear_set("liu-idler")
    return lumped_system(
        gear_set, torque, LumpedModel(number=1), excitations=excitations
    )


def test_jumps_of_the_idler_train():
    """Softening: up at the feet of both resonances, down far below them."""
    up, down = sweep_all([idler_system()], np.arange(1000.0, 3600.0, 20.0).tolist())
    for jumps, rises in ((find_jumps(up), True), (find_jumps(down), False)):
        large = [j for j in jumps if abs(j.dte_rms_to - j.dte_rms_from) > 5e-6]
        assert len(large) >= 2
        assert all((j.dte_rms_to > j.dte_rms_from) is rises for j in large)
    tops = [peak for peak in find_peaks(down) if peak.mesh == 2]
    assert len(tops) == 2
    assert all(peak.contact_loss > 0.5 and peak.force_peak > 5e3 for peak in tops)
    largest = max(find_jumps(down), key=lambda j: j.dte_rms_from)
    assert largest.frequency_from == pytest.approx(2040.0, abs=60.0)


def test_steep_resonance_without_hysteresis_is_no_jump():
    frequency = np.arange(20.0)
    step = np.where(frequency < 10, 1e-6, 5e-6)
    up = branch(frequency, step)
    down = branch(frequency, step, direction="down")
    assert find_jumps(up)
    assert find_jumps(up, down) == []
    other = branch(frequency, np.where(frequency < 12, 1e-6, 5e-6), direction="down")
    assert len(find_jumps(up, other)) == 1


def test_a_figure_pairs_the_directions_of_each_model():
    """Finite elements and the lumped model beside them hang on one system."""
    from lumped.figures import sweeps as figures

    frequency = np.arange(500.0, 1200.0, 5.0)
    curves = []
    for model, offset in (("first", 0.0), ("second", 5e-6)):
        for direction, at in (("up", frequency), ("down", frequency[::-1])):
            rms = softening(at, direction) + offset
            one = branch(at, rms, direction=direction)
            one.responses, one.system = (None,), "the same"
            curves.append(figures.ResponseCurve(100.0, one, model))
    for curve in curves:
        (same,) = [
            other.branch
            for other in curves
            if other.name == curve.name and other is not curve
        ]
        assert figures._opposite(curve, curves) is same
