"""Bifurcations located by shooting, beside more harmonics and plain integration."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from fegear.files.values import plain_of, value_of
from lumped.branches.balance import HarmonicBalance
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.location import find_root
from lumped.branches.motions import ParameterFamily, SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.branches.shooting import shoot
from lumped.continuation.arc_length import NoSolution
from lumped.continuation.bifurcations import DOUBLING, FOLD
from lumped.steady.integration_settings import Settings
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import AdaptiveStepper

LIMITS = 2000.0, 3400.0  # Hz, with a branch of twice the period that doubles again
FEW, MANY = 8, 40
OFF = 3e-5  # of a speed, to both sides of a doubling
CYCLES, CHANGE = 30, 1e-4


@pytest.fixture(scope="module")
def train(system):
    return system(harmonics=3)


def bifurcations(train, harmonics, limits=LIMITS, **others):
    """Bifurcations of all branches, each with its branch."""
    settings = BranchSettings(harmonics=harmonics, sweep_points=2, **others)
    finder = BranchFinder(SpeedFamily(train), limits, settings)
    finder.find(limits[0])
    return [
        (branch, point) for branch in finder.branches for point in branch.bifurcations
    ]


@pytest.fixture(scope="module")
def few(train):
    return bifurcations(train, FEW)


@pytest.mark.slow
def test_places_are_those_of_many_harmonics(train, few):
    """Harmonic balance misses them by far more."""
    many = bifurcations(train, MANY)
    assert [point.kind for _, point in few] == [point.kind for _, point in many]
    missed = []
    for (_, point), (_, exact) in zip(few, many, strict=True):
        assert point.best_parameter == pytest.approx(exact.best_parameter, rel=1e-7)
        assert point.best_parameter == pytest.approx(exact.parameter, rel=1e-6)
        missed.append(abs(point.parameter / exact.best_parameter - 1.0))
    assert max(missed) > 5e-5


def test_alternating_changes_grow_on_one_side_alone(train, few):
    """By nothing but time integration of motions beside the doubling."""
    # others grow by themselves
    doublings = [
        (b, p) for b, p in few if p.kind == DOUBLING and p.largest < 1.0 + 1e-6
    ]
    assert {branch.multiple for branch, _ in doublings} == {1, 2}
    for branch, point in doublings:
        growths = [
            math.log(
                alternation(train, branch, point, point.best_parameter * (1.0 + side))
            )
            for side in (-OFF, 0.0, OFF)
        ]
        assert growths[0] * growths[2] < 0.0
        assert abs(growths[1]) < 0.01 * abs(growths[0])


def alternation(train, branch, point, frequency):
    """Growth over some periods of what changes its sign in each."""
    balance = HarmonicBalance(train, FEW, branch.multiple)
    start = shoot(balance, point.x, frequency).state
    values, vectors = np.linalg.eig(balance.monodromy(point.x, frequency))
    way = vectors[:, np.abs(values + 1.0).argmin()].real.reshape(2, -1)
    settings = Settings(method="dopri5", accuracy=1e-12)
    stepper, at = AdaptiveStepper(train), Speed(frequency, settings)
    state = start + CHANGE * np.abs(start).max() / np.abs(way).max() * way
    size, sizes = np.abs(start).max(axis=1, keepdims=True), []
    for _ in range(2 * CYCLES):
        before = state
        state, _ = stepper.record(state, at, branch.multiple)
        sizes.append(np.linalg.norm((state - before) / size))
    return sizes[-1] / sizes[CYCLES - 1]


def test_true_contact_alone_is_located(train):
    """Contact that closes by tanh is none that integration knows."""
    smooth = bifurcations(train, FEW, (3000.0, 3100.0), steepness=1e8)
    assert smooth
    for _, point in smooth:
        assert math.isnan(point.refined_parameter)
        assert point.best_parameter == point.parameter


def test_kept_branches_have_their_places(few):
    branch, _ = few[0]
    again = value_of(json.loads(json.dumps(plain_of(branch))))
    places = [point.refined_parameter for point in branch.points]
    np.testing.assert_array_equal([p.refined_parameter for p in again.points], places)


def test_folds_are_located(train):
    pairs = bifurcations(train, FEW, (1330.0, 1500.0), period_multiple=1)
    folds = [point for _, point in pairs if point.kind == FOLD]
    assert folds
    for point in folds:
        assert point.refined_parameter == pytest.approx(point.parameter, rel=1e-3)


def test_a_root_by_secants():
    assert find_root(lambda x: math.sin(x - 2e-4)) == pytest.approx(2e-4, abs=1e-9)
    with pytest.raises(NoSolution, match="no bifurcation there"):
        find_root(lambda x: 1.0 + x)


@pytest.mark.slow
def test_over_a_figure(system):
    """Where no contact is lost harmonic balance is exact, whatever its harmonics."""

    def at(value):
        return system(variation=value)

    family = ParameterFamily("variation", at, 3200.0, (0.05, 0.3))
    settings = BranchSettings(harmonics=FEW, sweep_points=2, period_multiple=1)
    finder = BranchFinder(family, family.limits, settings)
    finder.find(0.05)
    (point,) = [p for p in finder.branches[0].bifurcations if p.kind == DOUBLING]
    assert point.refined_parameter == pytest.approx(point.parameter, rel=1e-8)
