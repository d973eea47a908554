"""Gears of many teeth on small hubs: no less exact, in little time and memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from conftest import MODULE, make_gear

from fegear.elasticity import ring
from fegear.elasticity.flank import flank_compliance
from fegear.elasticity.gear_modes import gear_modes
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from meshes import MeshSize, outline

STEEL = PlaneMaterial(206e9, 0.3)


def gear_of(teeth, hub=0.1):
    """With a hub of so much of the reference radius."""
    return make_gear(teeth, hub * 0.5 * MODULE * teeth)


def largest_change(one, other):
    """Of normal and tangential compliance, over the largest normal one."""
    scale = np.abs(other.normal).max()
    pairs = (one.normal, other.normal), (one.tangential, other.tangential)
    return max(np.abs(a - b).max() for a, b in pairs) / scale


@pytest.mark.slow
@pytest.mark.parametrize(("teeth", "hub"), [(55, 0.25), (100, 0.1)])
def test_layers_lose_nothing_against_triangles_down_to_the_hub(monkeypatch, teeth, hub):
    gear = gear_of(teeth, hub)
    compliance = flank_compliance(CyclicSector(gear, STEEL))
    monkeypatch.setattr(outline, "FLOOR_DEPTH", 1e9)
    assert (
        largest_change(compliance, flank_compliance(CyclicSector(gear, STEEL))) < 1e-4
    )


@pytest.mark.slow
def test_a_finer_mesh_changes_a_large_gear_no_more_than_a_usual_one():
    changes = []
    for gear in (gear_of(40, 0.3), gear_of(1000)):
        # equally many places of load; the elements between them are finer
        size = MeshSize()
        finer = MeshSize(tooth_size=0.15, hub_size=0.6, body_growth=0.075)
        one, two = (
            flank_compliance(CyclicSector(gear, STEEL, s)) for s in (size, finer)
        )
        changes.append(largest_change(one, two))
    assert changes[1] < max(changes[0], 1e-4)


def test_compliance_is_as_reciprocal_with_a_thousand_teeth():
    few, many = (flank_compliance(CyclicSector(gear_of(z), STEEL)) for z in (100, 1000))
    assert many.reciprocity_error < 1.5 * few.reciprocity_error < 3e-4


@pytest.mark.slow
def test_modes_are_resolved_however_thick_layers_may_be():
    """By layers that follow from the cut-off; without them errors are 2e-2."""
    gear, cutoff = gear_of(100, 0.3), 60e3
    fine, coarse = (
        gear_modes(
            CyclicSector(gear, STEEL, MeshSize(body_growth=growth)), 7850.0, cutoff
        )
        for growth in (0.15, 0.6)
    )
    frequencies, expected = coarse.frequencies_Hz, fine.frequencies_Hz
    np.testing.assert_allclose(frequencies, expected, rtol=1e-3)


def peak_of(teeth):
    """Bytes that numpy held at most."""
    tracemalloc.start()
    try:
        flank_compliance(CyclicSector(gear_of(teeth), STEEL))
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_teeth():
    few, many, most = (peak_of(teeth) for teeth in (100, 300, 1000))
    assert few < 60e6
    assert many < 1.4 * few
    assert most < 1.4 * many


def test_harmonics_in_batches_are_those_at_once(monkeypatch):
    rng = np.random.default_rng(1)
    m, teeth = 6, 23
    root = rng.standard_normal((2 * m, 2 * m))
    superelement = root @ root.T
    left, right = rng.standard_normal((2, m, 3))
    args = superelement, left, right, teeth, range(-2, 3)
    expected = ring.ring_response(*args)
    monkeypatch.setattr(ring, "BYTES_PER_BATCH", 16 * m * m * 5)
    for cut, field in ring.ring_response(*args).items():
        np.testing.assert_allclose(field, expected[cut], rtol=1e-12, atol=1e-15)
