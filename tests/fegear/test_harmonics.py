"""Harmonics of the mesh frequency against NumPy's transform and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fegear.statics.harmonics import mesh_harmonics


@given(arrays(float, st.integers(4, 60), elements=st.floats(-1e3, 1e3)))
def test_harmonics_are_those_of_the_transform(values):
    spectrum = 2.0 * np.fft.rfft(values) / values.size
    harmonics = mesh_harmonics(values, 5)
    assert len(harmonics) == min(5, (values.size - 1) // 2)
    for part in harmonics:
        harmonics_found = part.amplitude * np.exp(1j * part.phase)
        assert harmonics_found == pytest.approx(spectrum[part.order], abs=1e-9)


@given(st.floats(0.0, 5.0), st.floats(-3.1, 3.1), st.integers(1, 4))
def test_a_cosine_has_its_amplitude_and_phase(amplitude, phase, order):
    position = np.arange(64) / 64
    values = 7.0 + amplitude * np.cos(2.0 * math.pi * order * position + phase)
    for part in mesh_harmonics(values, 5):
        expected = amplitude if part.order == order else 0.0
        assert part.amplitude == pytest.approx(expected, abs=1e-12)
        if part.order == order and amplitude > 1e-6:
            assert part.phase == pytest.approx(phase, abs=1e-6)


@pytest.mark.parametrize("double", [0.25, 0.5, 0.6])
def test_a_rectangular_wave_has_its_series(double):
    """Height 1 over the part `double` from position 0: sin(pi h c) / (pi h / 2)."""
    count = 6000
    wave = (np.arange(count) < double * count).astype(float)
    for part in mesh_harmonics(wave, 5):
        turn = math.pi * part.order * double
        amplitude = 2.0 / (math.pi * part.order) * math.sin(turn)
        harmonics_found = part.amplitude * np.exp(1j * part.phase)
        assert harmonics_found == pytest.approx(
            amplitude * np.exp(-1j * turn), abs=1e-3
        )


def test_what_repeats_later_than_a_base_pitch_is_left_out():
    position = np.arange(3 * 32) / 32
    mesh = 2.0 * np.cos(2.0 * math.pi * position - 0.4)
    shaft = np.cos(2.0 * math.pi * position / 3.0)
    first, *others = mesh_harmonics(mesh + shaft, 5, pitches=3)
    assert (first.order, first.amplitude) == (1, pytest.approx(2.0))
    assert first.phase == pytest.approx(-0.4)
    assert all(part.amplitude < 1e-12 for part in others)


@pytest.mark.parametrize(("positions", "count"), [(1, 0), (2, 0), (3, 1), (8, 3)])
def test_few_positions_resolve_few_harmonics(positions, count):
    assert len(mesh_harmonics(np.ones(positions), 5)) == count
