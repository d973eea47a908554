"""Basins beside known motions, random starts and runs without early ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.rattle.basins import (
    Grid,
    basins_of,
    settle_grid,
    settle_tile,
)
from lumped.rattle.departures import settle_departures
from lumped.rattle.machine import Machine

GRID = Grid(side=60, velocity=(0.0, 7.0))


def machine(damping=0.6, eccentricity=0.1, stiffness=math.inf):
    return Machine(
        damping=damping,
        eccentricity=eccentricity,
        half_backlash=0.6,
        stiffness=stiffness,
    )


def found(which, grid=GRID, iterations=1499):
    return basins_of(which, grid, iterations, settle_grid(which, grid, iterations, {}))


@pytest.mark.parametrize(
    ("damping", "eccentricity", "names"),
    [
        (0.6, 0.1, ["quiet", "P(1,1,0)", "chaotic 1"]),
        (0.575, 0.1, ["quiet", "P(1,1,0)", "P(1,2,0)", "P(2,2,1)"]),
        (0.6, 0.067, ["quiet", "P(1,1,0)"]),
        (0.6, 0.059, ["quiet"]),
        (0.7, 0.1, ["quiet"]),
    ],
)
def test_motions_that_are_printed_are_there(damping, eccentricity, names):
    """Figures 3.11 to 3.16."""
    basins = found(machine(damping, eccentricity))
    assert [attractor.name for attractor in basins.attractors] == names
    assert basins.fractions.sum() == pytest.approx(1.0)
    for attractor in basins.attractors:
        assert (attractor.exponent > 0.0) == attractor.name.startswith("chaotic")


@pytest.mark.parametrize("figures", [(0.6, 0.1), (0.575, 0.1), (0.1, 0.02), (5.0, 1.0)])
def test_early_ends_change_nothing(figures):
    """Cells that fade away never leave; those of an orbit stay on it."""
    which, (first, last) = machine(*figures), (0, GRID.cells)
    departures = GRID.departures(first, last)
    early = settle_departures(which, departures, 1499)
    whole = settle_departures(which, departures, 1499, early=False)
    np.testing.assert_array_equal(early.period, whole.period)
    np.testing.assert_array_equal(early.returns, whole.returns)
    one, two = (basins_of(which, GRID, 1499, s) for s in (early, whole))
    np.testing.assert_array_equal(one.attractor, two.attractor)


def test_cells_beside_each_other_do_not_change_each_other():
    which = machine(0.6, 0.1)
    departures = GRID.departures(0, 300)
    settled = settle_departures(which, departures, 300)
    alone = [settle_departures(which, each[None], 300) for each in departures]
    for one, parts in zip(settled, zip(*alone, strict=True), strict=True):
        np.testing.assert_array_equal(one, np.concatenate(parts))


def test_parts_are_those_of_random_starts():
    """Within what 2000 starts can tell."""
    which = machine(0.575)
    basins = found(which)
    random = np.random.default_rng(7)
    starts = np.stack([random.uniform(0, 1, 2000), random.uniform(0, 7, 2000)], axis=1)
    settled = settle_departures(which, starts, 1499)
    quiet = float(np.mean(settled.period < 0))
    spread = math.sqrt(quiet * (1.0 - quiet) / 2000)
    assert abs(quiet - basins.fractions[0]) < 4.0 * spread


def test_stiff_flanks_tend_to_impacts():
    """The part of cells that leave or join the quiet ones shrinks with stiffness."""
    impact = found(machine(0.62)).attractor == 0
    apart = [
        np.mean((found(machine(0.62, stiffness=stiffness)).attractor == 0) != impact)
        for stiffness in (1e3, 1e5, 1e7)
    ]
    assert apart[0] > 3.0 * apart[1] > 9.0 * apart[2]
    assert apart[2] < 0.01


def test_known_tiles_are_not_computed_again(monkeypatch):
    from lumped.rattle import basins

    monkeypatch.setattr(basins, "TILE", 1000)
    which, kept = machine(0.65), {}
    whole = settle_grid(which, GRID, 500, {}, kept.__setitem__)
    assert sorted(kept) == [0, 1, 2, 3]
    again = []
    taken = settle_grid(
        which, GRID, 500, {n: kept[n] for n in (0, 2)}, lambda n, _: again.append(n)
    )
    assert sorted(again) == [1, 3]
    for one, two in zip(whole, taken, strict=True):
        np.testing.assert_array_equal(one, two)
    one = settle_tile(which, GRID, 1000, 2000, 500)
    np.testing.assert_array_equal(one.end, kept[1].end)


def test_entropy_is_that_of_the_mixture():
    assert found(machine(0.7)).entropy == 0.0
    assert found(machine(0.5), Grid(side=100, velocity=(0.0, 7.0))).entropy > 0.3


@pytest.mark.parametrize("velocity", [(-1.0, 2.0), (3.0, 3.0), (0.0, math.inf)])
def test_a_grid_of_no_speeds_is_refused(velocity):
    with pytest.raises(ValueError, match="velocity must rise from 0 or more"):
        Grid(side=10, velocity=velocity)
