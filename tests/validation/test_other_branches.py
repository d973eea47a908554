"""Speeds on another branch of coexisting motions, told from a model that is off."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from validation.commands.validate.random_sets import verdicts
from validation.study.cycle_metrics import ForceCycle
from validation.study.metrics import MeasuredCurve, verdict
from validation.study.other_branches import (
    on_other_branch,
    speeds_on_other_branches,
    without_speeds,
)
from validation.study.runs import MODEL_IS_OFF, with_cause

SPEEDS = np.arange(1000.0, 2000.0, 20.0)
LOW, HIGH = np.full(SPEEDS.size, 1e-6), np.full(SPEEDS.size, 4e-6)
BETWEEN = (SPEEDS >= 1400.0) & (SPEEDS < 1500.0)  # 5 of 50 speeds with both motions


def curve(direction, values, multiple=1, mesh=1):
    still = np.zeros_like(values)
    periods = np.broadcast_to(np.asarray(multiple), values.shape).astype(np.int64)
    return MeasuredCurve(
        *(direction, mesh, SPEEDS, values, still + 1.0, still),
        period_multiple=periods,
    )


def judged(reference, model):
    """The verdict on the distance of the curves of the model up."""
    runs = [
        SimpleNamespace(torque=100.0, curves=curves) for curves in (reference, model)
    ]
    raw_verdict = verdict(
        "rms_distance", "m", "100 N m, up, mesh 1, 50 speeds", 1.0, 0.1, ""
    )
    return with_cause(raw_verdict, *runs, "100 N m, up, mesh 1")


def test_a_motion_that_the_other_has_with_the_speed_falling_is_another_branch():
    jumped = np.where(BETWEEN, HIGH, LOW)
    reference = [curve("up", LOW), curve("down", jumped)]
    model = [curve("up", jumped), curve("down", jumped)]
    common, others = speeds_on_other_branches(reference, model, "up")
    assert common.size == SPEEDS.size
    np.testing.assert_array_equal(others, SPEEDS[BETWEEN])
    outcome = judged(reference, model)
    assert not outcome.within  # the verdict stays
    assert outcome.cause.startswith("another branch: 5 of 50 speeds, 1400 to 1480 Hz")
    assert outcome.cause.endswith("steps of 10 Hz may lead both onto one")


def test_motions_of_other_periods_are_other_branches():
    jumped, periods = np.where(BETWEEN, HIGH, LOW), np.where(BETWEEN, 2, 1)
    outcome = judged([curve("up", LOW)], [curve("up", jumped, periods)])
    assert outcome.cause.startswith("another branch")


def test_a_model_that_is_off_is_said_to_be():
    reference = [curve("up", LOW), curve("down", LOW)]
    raised = np.where(BETWEEN, HIGH, LOW)
    outcome = judged(reference, [curve("up", raised), curve("down", raised)])
    assert outcome.cause == MODEL_IS_OFF
    both = np.where(BETWEEN, HIGH, 1.5 * LOW)
    periods = np.where(BETWEEN, 2, 1)
    outcome = judged([curve("up", LOW)], [curve("up", both, periods)])
    assert outcome.cause.startswith(f"{MODEL_IS_OFF}; besides, 5 of 50 speeds")


def test_of_too_many_speeds_nothing_is_known():
    outcome = judged([curve("up", LOW)], [curve("up", HIGH, 2)])
    assert outcome.cause.startswith("not known: 50 of 50 speeds")


def test_the_worst_mesh_counts_and_speeds_are_left_out_of_all():
    reference = [curve("up", LOW), curve("up", LOW, mesh=2)]
    jumped, periods = np.where(BETWEEN, HIGH, LOW), np.where(BETWEEN, 2, 1)
    model = [curve("up", LOW), curve("up", jumped, periods, mesh=2)]
    _, others = speeds_on_other_branches(reference, model, "up")
    assert others.size == BETWEEN.sum()
    remaining = without_speeds(model[1], others)
    assert remaining.frequency.size == SPEEDS.size - others.size
    assert remaining.dte_rms.max() == pytest.approx(1e-6)


def test_random_sets_and_cases_have_one_mechanism():
    assert verdicts.on_other_branch is on_other_branch
    assert verdicts.OTHER_MOTION == verdicts.MAX_P90 == 0.08
    assert verdicts.SAME_MOTION == verdicts.MEDIAN == 0.02
    assert verdicts.MAX_OTHER_BRANCH == 0.25


@pytest.mark.parametrize(
    ("loss", "multiple", "cause"),
    [
        (
            0.3,
            1,
            "another branch, perhaps: model and finite elements differ in whether",
        ),
        (
            0.0,
            2,
            "another branch, perhaps: model and finite elements repeat after diff",
        ),
        (0.0, 1, MODEL_IS_OFF),
    ],
)
def test_a_single_motion_of_another_kind_is_on_another_branch(loss, multiple, cause):
    label, where = "2470 Hz from rest", "100 N m, 2470 Hz from rest, mesh 1"
    cycles = (
        ForceCycle(label, 1, np.ones(8), *kind) for kind in ((0.0, 1), (loss, multiple))
    )
    runs = [SimpleNamespace(torque=100.0, cycles=[cycle]) for cycle in cycles]
    raw_verdict = verdict("wave_peak_force", "m", where, 1.0, 0.1, "")
    outcome = with_cause(raw_verdict, *runs, where)
    assert not outcome.within
    assert outcome.cause.startswith(cause)
