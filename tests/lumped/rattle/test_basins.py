"""Basins beside known motions, random starts and runs without early ends."""

from __future__ import annotations

import math
import time
import tracemalloc

import numpy as np
import pytest

from lumped.figures.rattle import color_of_motion, colors_of, draw_basins
from lumped.rattle.attractors import RattleAttractor, classify_attractors
from lumped.rattle.basins import (
    BasinMap,
    InitialGrid,
    basins_of,
    settle_grid,
    settle_tile,
)
from lumped.rattle.kernels.settle import CHANGING
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.orbits import default_speed
from lumped.rattle.return_map import iterate_map_points, settling_returns

GRID = InitialGrid(side=60, velocity=(0.0, 7.0))


def machine(damping=0.6, eccentricity=0.1, stiffness=math.inf):
    return Machine(
        damping=damping,
        eccentricity=eccentricity,
        half_backlash=0.6,
        stiffness=stiffness,
    )


def compute_basins(which, grid=GRID, iterations=1499):
    return basins_of(which, grid, iterations, settle_grid(which, grid, iterations))


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
    basins = compute_basins(machine(damping, eccentricity))
    assert [attractor.name for attractor in basins.attractors] == names
    assert basins.fractions.sum() == pytest.approx(1.0)
    for attractor in basins.attractors:
        assert (attractor.exponent > 0.0) == attractor.name.startswith("chaotic")


@pytest.mark.slow
@pytest.mark.parametrize("figures", [(0.6, 0.1), (0.575, 0.1), (0.1, 0.02), (5.0, 1.0)])
def test_early_ends_change_nothing(figures):
    """Cells that fade away never leave; those of an orbit stay on it."""
    which, (first, last) = machine(*figures), (0, GRID.cells)
    departures = GRID.initial_conditions(first, last)
    early = iterate_map_points(which, departures, 1499)
    whole = iterate_map_points(which, departures, 1499, stop_early=False)
    np.testing.assert_array_equal(early.period, whole.period)
    np.testing.assert_array_equal(early.returns, whole.returns)
    one, two = (basins_of(which, GRID, 1499, s) for s in (early, whole))
    np.testing.assert_array_equal(one.attractor, two.attractor)


def test_cells_beside_each_other_do_not_change_each_other():
    which = machine(0.6, 0.1)
    departures = GRID.initial_conditions(0, 300)
    settled = iterate_map_points(which, departures, 300)
    alone = [
        iterate_map_points(which, condition[None], 300) for condition in departures
    ]
    for one, parts in zip(settled, zip(*alone, strict=True), strict=True):
        np.testing.assert_array_equal(one, np.concatenate(parts))


def brute_force(which, starts, turns=60, steps=400):
    """Whether runs from departures (n, 2) still leave the flank after so many turns, by
    Runge-Kutta steps that end on impacts."""
    delta, beta, eps = which.damping, which.half_backlash, which.eccentricity
    x, w, dt = np.full(len(starts), beta), -starts[:, 1], 1.0 / steps
    t, least = starts[:, 0].copy(), np.full(len(starts), beta)

    def pull(t, w):
        angle = TURN * t
        load = 2.0 * TURN * delta - TURN**2 * eps * np.cos(angle)
        return load - TURN * delta * eps * np.sin(angle) - delta * w

    def step(t, x, w, dt):
        one = pull(t, w)
        two = pull(t + 0.5 * dt, w + 0.5 * dt * one)
        three = pull(t + 0.5 * dt, w + 0.5 * dt * two)
        four = pull(t + dt, w + dt * three)
        return (
            x + dt * (w + dt * (one + two + three) / 6.0),
            w + dt * (one + 2.0 * two + 2.0 * three + four) / 6.0,
        )

    for k in range(turns * steps):
        ahead, speed = step(t, x, w, dt)
        out = np.flatnonzero(np.abs(ahead) > beta)
        if out.size:
            side = np.sign(ahead[out])
            part = (side * beta - x[out]) / (ahead[out] - x[out])
            meets = w[out] + part * (speed[out] - w[out])
            rest = (1.0 - part) * dt
            place = np.clip(side * beta, -beta, beta)
            again = step(t[out] + part * dt, place, -meets, rest)
            ahead[out], speed[out] = np.clip(again[0], -beta, beta), again[1]
        x, w, t = ahead, speed, t + dt
        if k >= (turns - 2) * steps:
            least = np.minimum(least, x)
    return least < beta - 0.05


def parts_by_brute_force(count):
    """The quiet part by so many random runs and by cells, and the standard error."""
    which = machine(0.6, 0.067)
    random = np.random.default_rng(7)
    starts = random.uniform((0.0, 0.0), (1.0, 7.0), (count, 2))
    quiet = 1.0 - float(np.mean(brute_force(which, starts)))
    grid = InitialGrid(side=200, velocity=(0.0, 7.0))
    cells = compute_basins(which, grid).fractions[0]
    return quiet, cells, math.sqrt(cells * (1.0 - cells) / count)


@pytest.mark.slow
def test_parts_are_those_of_random_runs():
    """By other means, within what so many can tell."""
    quiet, cells, error = parts_by_brute_force(600)
    assert 0.1 < cells < 0.95
    assert abs(quiet - cells) < 3.0 * error


@pytest.mark.slow
def test_stiff_flanks_tend_to_impacts():
    """The part of cells that leave or join the quiet ones shrinks with stiffness."""
    impact = compute_basins(machine(0.62)).attractor == 0
    fractions = []
    for stiffness in (1e3, 1e5, 1e7):
        basins = compute_basins(machine(0.62, stiffness=stiffness))
        fractions.append(np.mean((basins.attractor == 0) != impact))
    assert fractions[0] > 3.0 * fractions[1] > 9.0 * fractions[2]
    assert fractions[2] < 0.01


def test_tiles_are_in_the_order_of_the_cells(monkeypatch):
    from lumped.rattle import basins

    monkeypatch.setattr(basins, "CELLS_PER_TILE", 1000)
    which, tiles = machine(0.65), {}

    def compute(parts):
        tiles.update({name: part() for name, part in reversed(parts.items())})
        return tiles

    whole = settle_grid(which, GRID, 500, compute)
    assert sorted(tiles) == ["0", "1", "2", "3"]
    one = settle_tile(which, GRID, 1000, 2000, 500)
    np.testing.assert_array_equal(one["end"], whole.end[1000:2000])
    for one, two in zip(whole, settle_grid(which, GRID, 500), strict=True):
        np.testing.assert_array_equal(one, two)


def test_entropy_is_that_of_the_mixture():
    assert compute_basins(machine(0.7)).entropy == 0.0
    grid = InitialGrid(side=100, velocity=(0.0, 7.0))
    assert compute_basins(machine(0.5), grid).entropy > 0.3


@pytest.mark.parametrize("velocity", [(-1.0, 2.0), (3.0, 3.0), (0.0, math.inf)])
def test_a_grid_of_no_speeds_is_refused(velocity):
    with pytest.raises(ValueError, match=r"velocity = .*; must rise from 0 or more"):
        InitialGrid(side=10, velocity=velocity)


def processor_time(which, cells, iterations):
    """Of departures that stay in chaos."""
    random = np.random.default_rng(2)
    starts = random.uniform((0.55, 4.4), (0.75, 4.6), (cells, 2))
    times = []
    for _ in range(3):
        begin = time.thread_time()
        iterate_map_points(which, starts, iterations)
        times.append(time.thread_time() - begin)
    return min(times)


def test_time_grows_with_cells_and_iterations():
    which = machine(0.6)
    once = processor_time(which, 400, 400)
    assert processor_time(which, 1600, 400) / once == pytest.approx(4.0, rel=0.5)
    assert processor_time(which, 400, 1600) / once == pytest.approx(4.0, rel=0.5)


def test_memory_is_that_of_the_picture():
    """And not that of the trajectories."""
    which, peaks = machine(0.6), []
    grid = InitialGrid(side=100, velocity=(0.0, 7.0))
    for iterations in (100, 800):
        tracemalloc.start()
        settle_grid(which, grid, iterations)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]
    assert peaks[1] < 160 * grid.cells


def test_runs_on_their_way_are_not_chaotic_by_where_they_depart():
    """They settle to orbits in ten times as many returns, beside one that is chaotic;
    the orbits attract at half the damping."""
    which = Machine(damping=0.01, eccentricity=0.002, half_backlash=0.012)
    departures = InitialGrid(
        side=7, velocity=(0.0, default_speed(which))
    ).initial_conditions(0, 49)
    iterations = settling_returns(which)
    settled = iterate_map_points(which, departures, iterations)
    later = iterate_map_points(which, departures, 10 * iterations)
    assert (settled.period == CHANGING).sum() > 40
    attractors, number, _ = classify_attractors(which, iterations, settled)
    chaotic = [i for i, attractor in enumerate(attractors) if attractor.exponent > 0.0]
    assert len(chaotic) == 1
    assert (later.period[np.isin(number, chaotic)] == CHANGING).all()
    assert (number >= 0).mean() > 0.9
    orbits = [
        attractor.exponent for attractor in attractors if attractor.name.startswith("P")
    ]
    assert len(orbits) > 5
    assert orbits == pytest.approx(len(orbits) * [-0.5 * which.damping], rel=1e-4)


def test_motions_that_are_named_in_a_picture_have_colors_that_differ():
    """Large basins those of their itinerary; the least of many share one."""
    names = [f"P({m},{n},0)" for m in range(1, 5) for n in range(1, 5)]
    attractors = [RattleAttractor(name, 1, (0.1, 1.0), -1.0) for name in names]
    cells = np.repeat(np.arange(16), np.arange(32, 0, -2))
    number = np.resize(cells, (16, 16))
    grid = InitialGrid(side=16, velocity=(0.0, 1.0))
    basins = BasinMap(machine(), grid, 100, tuple(attractors), number, number)
    colors = np.array(colors_of(basins))
    assert tuple(colors[0]) == color_of_motion("P(1,1,0)")
    assert (colors[12:] == colors[12]).all()
    gaps = np.linalg.norm(colors[:13, None] - colors[None, :13], axis=2)
    assert gaps[np.triu_indices(13, 1)].min() > 0.2
    assert color_of_motion("sticking(1)") != color_of_motion("sticking(2)")
    (legend,) = draw_basins(basins, "a machine").legends
    labels = [text.get_text() for text in legend.get_texts()]
    assert len(labels) == 13
    assert labels[-1].startswith("4 others ")
