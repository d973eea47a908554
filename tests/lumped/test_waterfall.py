"""Spectra over speed: Parseval's sum, Fourier coefficients, resonances of harmonics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from friction_pairs import COUPLED, pair_system

from lumped.common.csv_text import format_csv, parse_csv
from lumped.figures.waterfall import (
    COLUMNS,
    draw_waterfall,
    spectra_over_speed,
    spectra_rows,
)
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond_with_history
from lumped.steady.sweep import sweep
from lumped.train.friction import ToothFriction

SPEEDS = [2.0 + 0.05 * i for i in range(30)]
SETTINGS = Settings(steps=256, tolerance=1e-6)


@pytest.fixture(scope="module")
def spectra():
    system = pair_system(0.05, 0.02, ToothFriction(0.1, 0.4))
    return spectra_over_speed(3.0, sweep(system, SPEEDS, "up", SETTINGS), SETTINGS)


def test_lines_are_all_of_the_vibration(spectra):
    for lines, response in zip(spectra.lines, spectra.branch.responses, strict=True):
        square = 0.5 * (lines.amplitude[1:, 0] ** 2).sum()
        assert math.sqrt(square) == pytest.approx(response.dte_rms[0], rel=1e-3)


def test_harmonics_are_fourier_coefficients(spectra):
    response = spectra.branch.responses[7]
    system = spectra.branch.system
    _, history = respond_with_history(
        system, response.frequency, SETTINGS, response.state
    )
    time, s = history.time, history.deflection[:, 0]
    for order in (1, 2, 3):
        turn = np.exp(-2j * np.pi * order * response.frequency * time)
        exact = 2.0 * abs(np.trapezoid(turn * s, time)) / time[-1]
        assert spectra.harmonic(order, 0)[7] == pytest.approx(exact, rel=2e-3)


def test_a_harmonic_peaks_where_it_meets_a_natural_frequency(spectra):
    """The second at half of 5.70, with a ratio of damping of 0.02."""
    second = spectra.harmonic(2, 0)
    top = SPEEDS[int(second.argmax())]
    assert 2.0 * top == pytest.approx(COUPLED[2], rel=0.03)
    assert second.max() > 5.0 * second.min()


def test_rows_have_orders_and_frequencies(spectra):
    text = format_csv(COLUMNS, spectra_rows([spectra]), {"gear set": "pair"})
    table = parse_csv(text, "lines")
    rows = [dict(zip(table.names, row, strict=True)) for row in table.rows.values()]
    orders = {float(row["order"]) for row in rows}
    assert {1.0, 2.0, 3.0} <= orders == {float(round(order)) for order in orders}
    for row in rows[::7]:
        line = float(row["order"]) * float(row["mesh_frequency_Hz"])
        assert float(row["frequency_Hz"]) == pytest.approx(line, rel=1e-12)
    largest = max(float(row["amplitude_m"]) for row in rows)
    assert largest == pytest.approx(spectra.largest(0))
    assert min(float(row["amplitude_m"]) for row in rows) > 1e-4 * largest


def test_the_picture_has_a_column_for_each_branch(spectra):
    figure = draw_waterfall([spectra, spectra], "pair")
    campbell, _, harmonics, _ = figure.axes[:4]
    assert len(harmonics.lines) == 6
    np.testing.assert_allclose(
        harmonics.lines[1].get_ydata(), 1e6 * spectra.harmonic(2, 0)
    )
    dots = campbell.collections[0].get_offsets()
    ratios = dots[:, 1] / dots[:, 0]
    np.testing.assert_allclose(ratios, np.round(ratios), rtol=1e-9)
    natural = [line.get_ydata()[0] for line in campbell.lines if line.get_ls() == "--"]
    np.testing.assert_allclose(natural, COUPLED)


def test_a_train_at_rest_has_no_lines():
    pair = pair_system(0.05, 0.02)
    gears = tuple(replace(gear, torque=0.0) for gear in pair.train.gears)
    still = replace(pair, train=replace(pair.train, gears=gears))
    waterfall = spectra_over_speed(0.0, sweep(still, [2.0, 3.0], "up"))
    assert not list(waterfall.seen(0))
    assert not list(spectra_rows([waterfall]))
    campbell, harmonics = draw_waterfall([waterfall]).axes[:2]
    assert not campbell.collections[0].get_offsets().size
    assert harmonics.get_ylim()[1] > 0.0
