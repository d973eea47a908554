"""Branches of the idler beside sweeps and perturbed motions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from slow_tests import first_are_quick

from lumped.branches.balance import HarmonicBalance
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.steady.integration_settings import Settings
from lumped.steady.jumps import find_jumps
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from lumped.steady.sweep import sweep

LIMITS = 1300.0, 3600.0
HARMONICS = 12


@pytest.fixture(scope="module")
def train(system):
    return system(harmonics=3)


@pytest.fixture(scope="module")
def branches(train):
    finder = BranchFinder(
        SpeedFamily(train), LIMITS, BranchSettings(harmonics=HARMONICS)
    )
    finder.find(LIMITS[0])
    return finder.branches


def stable_levels(branches, frequency, multiple):
    """RMS (m,) of all stable motions at a frequency, between points."""
    for branch in branches:
        for one, two in pairwise(branch.points):
            if (one.frequency - frequency) * (two.frequency - frequency) > 0.0:
                continue
            if branch.multiple == multiple and one.stable and two.stable:
                part = (frequency - one.frequency) / (two.frequency - one.frequency)
                a, b = one.figures["dte_rms"], two.figures["dte_rms"]
                yield a + part * (b - a)


@pytest.mark.parametrize("direction", first_are_quick(["up", "down"], 1))
def test_sweeps_run_along_stable_motions(train, branches, direction):
    branch = sweep(train, np.arange(*LIMITS, 25.0), direction, Settings(steps=256))
    seen = 0
    for response in branch.responses[1:]:
        if response.multiple not in (1, 2):
            continue
        levels = stable_levels(branches, response.frequency, response.multiple)
        distances = [np.abs(level - response.dte_rms).max() for level in levels]
        assert min(distances) < 0.01 * response.dte_rms.max(), response.frequency
        seen += 1
    assert seen > 70


def test_sweeps_jump_at_bifurcations(train, branches):
    speeds = np.arange(*LIMITS, 10.0)
    places = [p.frequency for branch in branches for p in branch.bifurcations]
    seen = 0
    for direction in ("up", "down"):
        branch = sweep(train, speeds, direction)
        followed = {r.frequency: r.multiple in (1, 2) for r in branch.responses}
        for jump in find_jumps(branch):
            low, high = sorted((jump.frequency_from, jump.frequency_to))
            if followed[low] and followed[high]:
                assert any(low - 1.0 < place < high + 1.0 for place in places), jump
                seen += 1
    assert seen


def test_stability_is_what_a_small_disturbance_does(train, branches):
    """On both kinds of motion: it dies away or grows."""
    fine = Settings(method="dopri5", accuracy=1e-9)
    stepper, random = stepper_of(train, fine), np.random.default_rng(1)
    for stable in (True, False):
        # the slow mode of the couplings takes a hundred periods to decay
        points = [
            (branch, point)
            for branch in branches
            for point in branch.points
            if (point.largest < 0.999 if stable else point.largest > 1.05)
        ]
        for branch, point in points[:: max(1, len(points) // 5)]:
            balance = HarmonicBalance(train, HARMONICS, branch.multiple)
            speed = Speed(point.frequency, fine)
            start = balance.state(point.x, point.frequency)
            size = np.abs(start).max(axis=1, keepdims=True)
            other = start + 1e-6 * size * random.standard_normal(start.shape)
            distances = [np.linalg.norm((other - start) / size)]
            while len(distances) < 200 and distances[-1] < 100.0 * distances[0]:
                start, _ = stepper.record(start, speed, branch.multiple)
                other, _ = stepper.record(other, speed, branch.multiple)
                distances.append(np.linalg.norm((other - start) / size))
            # it may swell first, for disturbances are not of one mode
            dies = distances[-1] < 0.5 * max(distances)
            assert dies == stable, point.frequency


def test_motions_inside_the_range_are_followed_both_ways(branches):
    """One branch, on which a sweep's motion is neither the first nor the last."""
    swept = [branch for branch in branches if branch.origin.startswith("from a sweep")]
    assert swept
    for branch in swept:
        at = float(branch.origin.split()[-2])
        speeds = [point.frequency for point in branch.points]
        assert min(speeds) < at < max(speeds)
        steps = np.abs(np.diff([point.x for point in branch.points], axis=0))
        assert steps.max() < 0.5 * np.abs(branch.points[0].x).max()


def test_every_branch_says_how_it_begins_and_ends(branches):
    assert all(branch.origin and branch.reason for branch in branches)
    assert branches[0].origin == "from rest at 1300 Hz"
    assert branches[0].reason == "the end of the range was reached"
    assert {branch.multiple for branch in branches} == {1, 2}


def test_no_branch_is_found_twice(branches):
    starts = [
        (b.multiple, b.points[5].frequency, b.points[5].largest) for b in branches
    ]
    for branch in branches:
        passed = [(branch.multiple, p.frequency, p.largest) for p in branch.points]
        near = [any(np.allclose(s, p, rtol=1e-9) for p in passed) for s in starts]
        assert sum(near) == 1


def test_bifurcations_are_where_multipliers_are_on_the_circle(branches):
    kinds = {"fold": 1.0, "period doubling": -1.0, "branch point": 1.0}
    seen = set()
    for branch in branches:
        for point in branch.bifurcations:
            if point.kind == "torus":
                continue
            nearest = np.abs(point.multipliers - kinds[point.kind]).min()
            assert nearest < 2e-3, (point.kind, point.frequency)
            seen.add(point.kind)
    assert "fold" in seen


def test_a_branch_that_stands_upright_has_no_bifurcations_on_its_way(branches):
    """Period doublings of motions that keep contact: all amplitudes at one speed."""
    for branch in branches:
        doublings = [point for point in branch.bifurcations if branch.multiple == 2]
        places = [round(point.frequency, 3) for point in doublings]
        assert len(places) == len(set(places))


def test_upright_motions_are_not_counted_as_stable(branches):
    """They are neutral: a multiplier is at 1, on either side of it by rounding."""
    upright = [p for branch in branches for p in branch.points if p.vertical]
    assert upright
    assert not any(point.stable for point in upright)
    at_one = [abs(point.multipliers - 1.0).min() for point in upright]
    assert max(at_one) < 5e-3
