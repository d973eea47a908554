"""Branches over other figures than the speed, beside those over it and integration."""

from __future__ import annotations

import numpy as np
import pytest

from lumped import respond
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import ParameterFamily, PeriodicProblem, SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.steady.integration_settings import Settings

pytestmark = pytest.mark.slow

SPEED, HARMONICS = 1450.0, 10
LIMITS = 0.035, 0.1  # damping ratios
SETTINGS = BranchSettings(harmonics=HARMONICS, period_multiple=1, sweep_points=9)


@pytest.fixture(scope="module")
def damped(system, idler):
    return lambda ratio: system(idler(damping=ratio, coupled=False), harmonics=3)


@pytest.fixture(scope="module")
def branches(damped):
    family = ParameterFamily("damping_ratio", damped, SPEED, LIMITS)
    finder = BranchFinder(family, LIMITS, SETTINGS)
    finder.find(LIMITS[1])
    return finder.branches


def folds_of(branches):
    points = [point for branch in branches for point in branch.bifurcations]
    return [point for point in points if point.kind == "fold"]


def test_folds_over_damping_are_folds_over_speed(damped, branches):
    folds = folds_of(branches)
    assert len(folds) >= 2
    for fold in folds[:2]:
        finder = BranchFinder(
            SpeedFamily(damped(fold.parameter)), (SPEED - 60.0, SPEED + 60.0), SETTINGS
        )
        finder.from_rest(SPEED + 60.0)
        finder.from_sweeps()
        near = [point.frequency for point in folds_of(finder.branches)]
        assert min(abs(at - SPEED) for at in near) < 1e-4 * SPEED


def test_motions_are_those_of_integration(damped, branches):
    seen = 0
    for branch in branches:
        for point in branch.points[:: max(1, len(branch.points) // 8)]:
            if point.largest > 0.9:  # next to a fold another motion is near
                continue
            system = damped(point.parameter)
            motions = PeriodicProblem(SpeedFamily(system), HARMONICS, branch.multiple)
            start = motions.at(SPEED)[0].state(point.x, SPEED)
            settled = respond(system, SPEED, Settings(steps=256), start)
            np.testing.assert_allclose(
                settled.dte_rms, point.figures["dte_rms"], rtol=0.01
            )
            seen += 1
    assert seen >= 4


def test_branches_end_on_the_limits(branches):
    ends = [branch for branch in branches if "end of the range" in branch.reason]
    assert ends
    for branch in ends:
        assert branch.points[-1].parameter in LIMITS


def test_nothing_is_asked_for_beyond_the_limits(damped):
    """Where there may be no system."""
    ratios = []

    def system_of(ratio):
        ratios.append(ratio)
        return damped(ratio)

    family = ParameterFamily("damping_ratio", system_of, 2000.0, LIMITS)
    finder = BranchFinder(family, LIMITS, SETTINGS)
    finder.from_rest(LIMITS[0])
    assert finder.branches[0].points[-1].parameter == LIMITS[1]
    assert LIMITS[0] <= min(ratios) < max(ratios) <= LIMITS[1]


def test_a_change_of_the_figure_is_its_derivative(damped):
    family = ParameterFamily("damping_ratio", damped, SPEED, LIMITS)
    motions = PeriodicProblem(family, HARMONICS)
    x = motions.at(0.05)[0].static
    x = x + 1e-6 * np.random.default_rng(3).standard_normal(x.size)
    _, _, change = motions.equations(x, 0.05)
    up, down = (motions.equations(x, 0.05 + step)[0] for step in (1e-4, -1e-4))
    np.testing.assert_allclose(
        change, (up - down) / 2e-4, atol=1e-4 * abs(change).max()
    )
