"""Motions that come to rest on a flank, beside SciPy's integration of each flight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from lumped.rattle.attractors import AttractorClassifier
from lumped.rattle.basins import InitialGrid, basins_of, settle_grid
from lumped.rattle.kernels.settle import STICKING
from lumped.rattle.long_runs import settled_departures
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.noise import measure_noise
from lumped.rattle.return_map import iterate_map_points
from lumped.rattle.sticking import sticking_from, sticking_motions

GRID = InitialGrid(side=40, velocity=(0.0, 7.0))
SLOW = 1e-9  # rad per turn: flanks rest
RIPPLED = {"damping": 0.1, "half_backlash": 0.3, "ripple": 20.0, "ripple_order": 3}


def machine(eccentricity, restitution, **others):
    figures = {"damping": 0.6, "half_backlash": 0.6} | others
    return Machine(eccentricity=eccentricity, restitution=restitution, **figures)


def load(m, t):
    """Acceleration of flanks in the play at no speed."""
    acceleration = 2.0 * TURN * m.damping - TURN**2 * m.eccentricity * math.cos(
        TURN * t
    )
    acceleration -= TURN * m.damping * m.eccentricity * math.sin(TURN * t)
    return acceleration + m.ripple * math.cos(
        m.ripple_order * TURN * t + m.ripple_phase
    )


def flight(m, t, side, v):
    """Time, side and speed of the meeting after a departure from a side at v > 0.

    y is the distance from the flank that is left.
    """

    def rates(t, u):
        return [u[1], -side * load(m, t) - m.damping * u[1]]

    def back(t, u):
        return u[0]

    def over(t, u):
        return u[0] - 2.0 * m.half_backlash

    back.terminal = over.terminal = True
    back.direction, over.direction = -1.0, 1.0
    pull = abs(load(m, t))
    step = min(0.02, 0.5 * v / pull if pull > 1e-6 else 0.02)
    solution = solve_ivp(
        *(rates, (t, t + 20.0), [0.0, v], "DOP853"),
        events=[back, over],
        rtol=1e-11,
        atol=1e-13,
        max_step=0.05,
        first_step=step,
    )
    side = -side if solution.t_events[1].size else side
    return solution.t[-1], side, abs(solution.y[1, -1])


def run(m, t, v, turns, most=100):
    """Impacts (n, 3), time, side and speed, and releases from rest (time, side), up to
    so many."""
    impacts, releases, side, end = [], [], 1, t + turns
    while t < end and len(releases) < most:
        t, side, w = flight(m, t, side, v)
        impacts.append((t, side, w))
        v = m.restitution * w
        if v < SLOW and side * load(m, t) > 0.0:
            times = t + np.arange(1, 401) / 200
            ends = [s for s in times if side * load(m, s) < 0.0]
            if not ends:
                break
            t = brentq(lambda s: load(m, s), ends[0] - 0.005, ends[0], xtol=1e-14)
            v = SLOW
            releases.append((t, side))
    return np.array(impacts), releases


@pytest.mark.parametrize(("eccentricity", "restitution"), [(0.4, 0.2), (0.25, 0.5)])
def test_motions_rest_and_part_as_by_integration(eccentricity, restitution):
    """One attractor, whatever is counted of the chatter."""
    m = machine(eccentricity, restitution)
    basins = basins_of(m, GRID, 1499, settle_grid(m, GRID, 1499))
    assert [attractor.name for attractor in basins.attractors] == ["sticking(1)"]
    (attractor,) = basins.attractors
    assert (attractor.period, attractor.exponent) == (1, -math.inf)
    assert attractor.point[1] == 0.0
    impacts, releases = run(m, 0.3, 2.0, 8.0)
    times = np.array([t for t, _ in releases])
    assert {side for _, side in releases} == {1}
    np.testing.assert_allclose(np.diff(times)[-3:], 1.0, atol=1e-9)
    np.testing.assert_allclose(times % 1.0, attractor.point[0], atol=1e-9)
    last = (impacts[:, 0] > times[-2]) & (impacts[:, 0] < times[-1])
    exact = np.sum(impacts[last, 2] ** 2)
    noise = measure_noise(m, np.array([[0.3, 2.0]]), 1499, 200)
    assert noise.attractors[noise.motion[0]].name == "sticking(1)"
    assert noise.level[0] == pytest.approx(exact, rel=1e-6)


def test_both_attractors_beside_each_other_are_those_of_runs():
    m = machine(0.2, 0.8)
    random = np.random.default_rng(3)
    starts = random.uniform((0.0, 0.3), (1.0, 7.0), (8, 2))
    naming = AttractorClassifier(m, 1499)
    numbers, _ = naming.sort(iterate_map_points(m, starts, 1499))
    named = [naming.attractors[i].name for i in numbers]
    assert set(named) == {"sticking(1)", "P(1,2,0)"}
    for start, name in zip(starts, named, strict=True):
        _, releases = run(m, *start, 80.0, 3)
        assert (len(releases) == 3) == (name == "sticking(1)")


def test_two_that_rest_are_two():
    """By their releases; one rests on the lower flank as well."""
    m = machine(0.15, 0.0, **RIPPLED)
    one, two = sticking_motions(m)
    assert one.name == two.name == "sticking(1)"
    assert one.point[0] == pytest.approx(0.0723670, abs=1e-7)
    sides = [
        sorted({speed > 0.0 for _, speed in motion.releases}) for motion in (one, two)
    ]
    assert sides == [[True], [False, True]]
    basins = basins_of(m, GRID, 1499, settle_grid(m, GRID, 1499))
    named = [attractor.name for attractor in basins.attractors]
    assert {"sticking(1)", "sticking(1) b"} <= set(named)
    points = [
        attractor.point[0]
        for attractor in basins.attractors
        if attractor.exponent == -math.inf
    ]
    assert points == pytest.approx([one.point[0], two.point[0]], abs=1e-9)


def test_rest_on_the_lower_flank_alone():
    m = machine(0.3, 0.3, **RIPPLED)
    (motion,) = sticking_motions(m)
    ((time, speed),) = motion.releases
    assert speed < 0.0 < motion.point[1]
    basins = basins_of(m, GRID, 300, settle_grid(m, GRID, 300))
    assert motion.name in {attractor.name for attractor in basins.attractors}
    _, releases = run(m, 0.3, 2.0, 6.0)
    assert releases[-1][1] == -1
    assert releases[-1][0] % 1.0 == pytest.approx(time, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.2, 0.7, 0.95])
def test_early_ends_change_nothing(restitution):
    m = machine(0.3, restitution)
    departures = GRID.initial_conditions(0, GRID.cells)
    early = iterate_map_points(m, departures, 1499)
    whole = iterate_map_points(m, departures, 1499, stop_early=False)
    np.testing.assert_array_equal(early.period, whole.period)
    np.testing.assert_array_equal(early.returns, whole.returns)
    rests = early.period == STICKING
    assert rests.all() == (restitution < 0.9)
    np.testing.assert_array_equal(early.end[rests], whole.end[rests])
    one, two = (basins_of(m, GRID, 1499, settled) for settled in (early, whole))
    np.testing.assert_array_equal(one.attractor, two.attractor)


def test_a_period_that_round_off_decides_is_not_told():
    """Releases that are faster by less than what is at rest lead back later or sooner:
    25, 39, 51 turns."""
    (motion,) = sticking_motions(machine(0.3, 0.7))
    assert (motion.name, motion.turns) == ("sticking(irregular)", 0)


def test_what_rests_no_more_is_no_such_motion():
    assert not sticking_motions(machine(0.15, 0.9))
    assert not sticking_motions(machine(0.5, 0.7))
    assert not sticking_motions(machine(0.3, 1.0))
    assert sticking_from(machine(0.5, 0.7), (0.82, 1e-9)) is None


def test_long_runs_show_departures_after_a_release():
    departures = settled_departures(machine(0.4, 0.2), (0.0, 7.0))
    assert len(departures)
    assert departures[:, 0].min() >= 0.0
    assert np.min(np.abs(departures[:, 0] - 0.8439829)) < 1e-6
