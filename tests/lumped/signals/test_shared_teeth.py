"""The tooth of a gear in two meshes, by signals that have its fault twice a turn."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.signals.faulty_tooth import Engagement
from lumped.signals.shared_teeth import OTHER_MESH_WEIGHT, tooth_of_meshes

TEETH, POINTS = 31, 31 * 32
# of a planet with 31 teeth: contact of tooth 1 in its two meshes [base pitches]
SUN = Engagement(0.0, -0.83, 0.82, False, 1 + np.arange(TEETH))
RING = Engagement(0.0, -1.04, 0.83, True, 1 + (np.arange(TEETH) + 15) % TEETH)


def residual(tooth, at_sun, at_ring):
    """Fault of a tooth while it is in contact in each mesh."""
    position = np.arange(POINTS) / POINTS * TEETH
    values = np.zeros(POINTS)
    for engagement, size in ((SUN, at_sun), (RING, at_ring)):
        place = np.flatnonzero(engagement.teeth == tooth)[0]
        distance = np.mod(position - place + 0.5 * TEETH, TEETH) - 0.5 * TEETH
        inside = (distance >= engagement.start) & (distance < engagement.end)
        values[inside] += size
    return values


@pytest.mark.parametrize("tooth", [1, 12, 16, 31])
@pytest.mark.parametrize("sizes", [(1.0, -1.0), (1.0, -0.6), (0.6, 1.0), (1.0, 0.02)])
def test_the_tooth_is_in_contact_whenever_the_signal_differs(tooth, sizes):
    """The mesh of the signal first, in which the fault is largest or nearly so."""
    first, second = (SUN, RING) if abs(sizes[0]) == 1.0 else (RING, SUN)
    values = residual(tooth, *sizes)
    named, rms = tooth_of_meshes(values, (first, second), OTHER_MESH_WEIGHT)
    assert named == tooth
    lengths = np.array([e.end - e.start for e in (SUN, RING)])
    expected = np.sqrt(np.square(sizes) @ lengths / lengths.sum())
    assert rms == pytest.approx(expected, rel=0.02)


def test_forces_of_both_meshes_count_alike():
    values = residual(7, 0.7, -1.0)
    for meshes in ((SUN, RING), (RING, SUN)):
        assert tooth_of_meshes(values, meshes)[0] == 7
