"""Shooting beside harmonic balance, stable motions and unstable ones."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.branches.balance import HarmonicBalance
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.branches.shooting import shoot
from lumped.continuation.arc_length import NoSolution

FUNDAMENTAL, SUBHARMONIC = (1330.0, 1500.0), (3150.0, 3350.0)  # Hz


@pytest.fixture(scope="module")
def train(system):
    return system(harmonics=3)


def branches(train, harmonics, limits=FUNDAMENTAL):
    settings = BranchSettings(harmonics=harmonics)
    finder = BranchFinder(SpeedFamily(train), limits, settings)
    finder.find(limits[0])
    return finder.branches


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "kinds"),
    [
        (FUNDAMENTAL, {(1, True), (1, False)}),
        (SUBHARMONIC, {(2, True)}),
    ],
)
def test_harmonics_converge_to_what_shooting_finds(train, limits, kinds):
    """On all branches, with a force that has corners: of fourth order or better."""
    errors = []
    for harmonics in (6, 12, 24):
        differences, seen = [], set()
        for branch in branches(train, harmonics, limits):
            balance = HarmonicBalance(train, harmonics, branch.multiple)
            for point in branch.points[::6]:
                exact = shoot(balance, point.x, point.frequency).figures["dte_rms"]
                differences.append(
                    abs(exact - point.figures["dte_rms"]).max() / exact.max()
                )
                seen.add((branch.multiple, point.stable))
        # next to a fold a small error of the force is a large one of the motion
        errors.append(np.median(differences))
        assert max(differences) < 0.02
        assert kinds <= seen
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 2.0**3
    assert errors[2] < errors[1] / 2.0**3


def test_a_branch_tells_its_error(train):
    for branch in branches(train, 12):
        assert 0.0 <= branch.error < 1e-4


def test_where_there_is_no_motion_none_is_found(train):
    balance = HarmonicBalance(train, 6)
    x = balance.static + 1e-4 * np.random.default_rng(1).standard_normal(
        balance.static.size
    )
    with pytest.raises(NoSolution, match="shooting found no periodic motion"):
        shoot(balance, x, 1400.0)
