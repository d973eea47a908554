"""Sidebands of planets that pass a sensor, beside spectra of their sums over a turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.closed_forms.planet_passing import (
    passing_amplitudes,
    phasor_sums,
    window_coefficients,
)
from lumped.signals.averages import order_amplitudes
from lumped.signals.ring_sensor import PlanetPasses, RingSensor, hann_window

POINTS = 64  # per mesh cycle
HARMONICS = np.array([[900.0, 30.0 - 8.0j, 4.0 + 11.0j, -2.0j]])

# teeth of the ring, and positions of the planets [deg]
SETS = {
    "in phase": (96, [0.0, 120.0, 240.0]),
    "sequential": (94, [0.0, 120.0, 240.0]),
    "counter-phased": (94, [0.0, 90.0, 180.0, 270.0]),
    "mixed": (94, [0.0, 93.0, 180.0, 273.0]),
    "unequal": (96, [0.0, 99.0, 201.0]),
}


def passing_signal(ring, positions, harmonics, sensor=0.0, width=None, sense=1):
    """Signal over a turn of the carrier, force by force."""
    angles = np.radians(positions)
    passes = PlanetPasses(ring=0, teeth=ring, meshes=(0,), angles=angles, sense=sense)
    width = 2.0 * math.pi / angles.size if width is None else width
    cycles = np.arange(ring * POINTS) / POINTS
    weights = RingSensor(passes=passes, direction=sensor, width=width).weights(cycles)
    lines = np.exp(2j * math.pi * np.outer(cycles, np.arange(harmonics.shape[1])))
    one_sided = np.where(np.arange(harmonics.shape[1]) == 0, 1.0, 2.0)
    forces = ((lines * one_sided) @ harmonics.T).real
    return (forces * weights).sum(axis=1)


def equal_planets(ring, positions, sense=1):
    """Harmonics of planets that do what the first one does at the same tooth."""
    shift = sense * ring * (np.radians(positions) - math.radians(positions[0]))
    return HARMONICS * np.exp(1j * np.outer(shift, np.arange(HARMONICS.size)))


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("name", SETS)
def test_amplitudes_are_those_of_the_sampled_sum(name, sense):
    ring, positions = SETS[name]
    harmonics = equal_planets(ring, positions, sense)
    settings = {"sensor": 0.7, "width": 1.9, "sense": sense}
    signal = passing_signal(ring, positions, harmonics, **settings)
    sampled = order_amplitudes(signal[:, None])[:, 0]
    order = np.arange(4 * ring)
    expected = passing_amplitudes(
        harmonics, np.radians(positions), ring, order, **settings
    )
    # lines of the window beyond the samples, which fall with the third power
    assert np.abs(sampled[order] - expected).max() < 1e-7 * expected[1:].max()


@pytest.mark.parametrize("name", SETS)
def test_equal_planets_have_the_amplitudes_of_one_times_their_phasor_sum(name):
    ring, positions = SETS[name]
    angles, order = np.radians(positions), np.arange(1, 4 * ring)
    settings = {"width": 2.0 * math.pi / angles.size}
    harmonics = equal_planets(ring, positions)
    every = passing_amplitudes(harmonics, angles, ring, order, **settings)
    one = passing_amplitudes(harmonics[:1], angles[:1], ring, order, **settings)
    np.testing.assert_allclose(
        every, one * phasor_sums(angles, order), atol=1e-12 * every.max()
    )


@pytest.mark.parametrize("name", ["in phase", "sequential", "counter-phased"])
def test_equally_spaced_planets_leave_multiples_of_their_number(name):
    ring, positions = SETS[name]
    signal = passing_signal(ring, positions, equal_planets(ring, positions))
    sampled = order_amplitudes(signal[:, None])[:, 0]
    order = np.arange(sampled.size)
    others = order % len(positions) != 0
    assert sampled[others].max() < 1e-9 * sampled[1:].max()
    # the mesh itself is heard where its order is such a multiple
    assert (sampled[ring] > 1e-3 * sampled[1:].max()) == (ring % len(positions) == 0)


def test_opposed_pairs_leave_even_orders():
    """Of planets at 0, 93, 180 and 273 deg, those at 4 k are not whole sums."""
    sums = phasor_sums(np.radians(SETS["mixed"][1]), np.arange(1, 9))
    assert sums[::2].max() < 1e-12
    expected = np.abs(2.0 + 2.0 * np.exp(1j * np.radians(93.0) * np.arange(2, 9, 2)))
    np.testing.assert_allclose(sums[1::2], expected)


def test_sidebands_are_asymmetric_about_a_mesh_that_is_not_heard():
    """Of 94 teeth and three planets 93 and 96 are multiples, not 94 (McFadden 1985)."""
    ring, positions = SETS["sequential"]
    angles = np.radians(positions)
    near = passing_amplitudes(
        equal_planets(ring, positions), angles, ring, [92, 93, 94, 95, 96]
    )
    assert (near[[0, 2, 3]] < 1e-12 * near[1]).all()
    assert near[1] > 1.2 * near[4] > 0.0


def test_windows_are_the_sums_of_their_orders():
    angle = np.linspace(-math.pi, math.pi, 101)
    order = np.arange(-4000, 4001)
    for width in (0.5, 2.0, 2.0 * math.pi):
        window = window_coefficients(width, order)
        summed = (np.exp(1j * np.outer(angle, order)) @ window).real
        np.testing.assert_allclose(summed, hann_window(angle, width), atol=1e-6)
