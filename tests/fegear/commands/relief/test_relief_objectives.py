"""Objectives of reliefs, compromises, tolerances and the search for least vibration."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

import fegear
from fegear.commands.relief.best_relief import (
    find_best_relief,
    starting_designs,
)
from fegear.commands.relief.front import relief_front
from fegear.commands.relief.objective import ReliefObjective, linear_step, peak_to_peak
from fegear.commands.relief.quantities import SlopedValues
from fegear.commands.relief.relief_problem import ReliefProblem, relief_ranges
from fegear.commands.relief.tolerance import tolerance_band
from fegear.commands.relief.vibration import VibrationSearch
from fegear.statics.contact_problem import contact_problem
from fegear.statics.harmonics import mesh_harmonics
from fegear.statics.settings import StaticsSettings
from fegear.train.model_settings import LumpedModel
from lumped.common.workers import Stopped

COARSE = StaticsSettings(resolution="coarse", positions=16)
HARMONICS = ReliefObjective("harmonics", (1, 2, 3))


@pytest.fixture(scope="module")
def problem():
    contact = contact_problem(fegear.load_gear_set("liu-pair"), 0, COARSE)
    ranges = relief_ranges(contact, ("driver_tip", "driven_tip"))
    torques, positions = np.array([60.0, 140.0]), np.arange(16) / 16
    return ReliefProblem(contact, ranges, torques, positions, 20e-6)


def random_change(seed, torques=2, positions=16, size=4):
    random = np.random.default_rng(seed)
    ste = 1e-5 + 1e-6 * random.normal(size=(torques, positions))
    slopes = 1e-6 * random.normal(size=(torques, positions, size))
    return ste, slopes, (np.full(size, -0.2), np.full(size, 0.2))


def test_the_measure_of_harmonics_is_that_of_their_amplitudes():
    ste, _, _ = random_change(1)
    for orders in ((1,), (1, 2, 3), (2, 5)):
        measures = ReliefObjective("harmonics", orders).measures({"ste": ste})
        for values, measure in zip(ste, measures, strict=True):
            amplitudes = [one.amplitude for one in mesh_harmonics(values, 7)]
            expected = np.linalg.norm([amplitudes[order - 1] for order in orders])
            assert measure == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_step_of_harmonics_is_that_of_another_solver(seed):
    ste, slopes, limits = random_change(seed)
    step, value = linear_step({"ste": SlopedValues(ste, slopes)}, limits, HARMONICS)
    assert value == pytest.approx(HARMONICS.of({"ste": ste + slopes @ step}), rel=1e-9)

    def squares(x):  # by the largest, as another unknown
        return (
            x[4] ** 2 - HARMONICS.measures({"ste": 1e6 * (ste + slopes @ x[:4])}) ** 2
        )

    start = np.append(np.zeros(4), 1.1e6 * HARMONICS.of({"ste": ste}))
    other = minimize(
        lambda x: x[4],
        start,
        method="SLSQP",
        bounds=[*zip(*limits, strict=True), (0.0, None)],
        constraints={"type": "ineq", "fun": squares},
        options={"ftol": 1e-10, "maxiter": 200},
    )
    assert value == pytest.approx(1e-6 * other.fun, rel=2e-3)


def test_the_best_relief_of_harmonics_has_smaller_ones_than_that_of_the_peaks(problem):
    starts = starting_designs(problem, 2)
    by_peaks = find_best_relief(problem, starts, ReliefObjective())
    by_harmonics = find_best_relief(problem, starts, HARMONICS)
    assert by_harmonics.value < HARMONICS.of_responses(
        problem.responses(by_peaks.design)
    )
    none = problem.responses(np.array([0.0, 0.0, 0.4, 0.4]))
    plain = HARMONICS.of_responses(none)
    assert by_harmonics.value < 0.5 * plain


@pytest.mark.slow
def test_compromises_trade_one_torque_for_the_other(problem):
    points, evaluations = relief_front(problem, ReliefObjective(), 5)
    measures = np.array([point.measures for point in points])
    assert len(points) >= 4
    assert evaluations > len(points)
    assert (np.diff(measures[:, 0]) > 0.0).all()
    assert (np.diff(measures[:, 1]) < 0.0).all()
    for point in points:
        solved = peak_to_peak(problem.responses(point.design)["ste"].values)
        np.testing.assert_allclose(solved, point.measures, rtol=1e-12)
    best = find_best_relief(problem, starting_designs(problem, 5), ReliefObjective())
    assert measures.max(axis=1).min() < 1.05 * best.value


@pytest.mark.parametrize("name", ["largest", "harmonics"])
def test_a_small_tolerance_has_the_effect_that_derivatives_give(problem, name):
    objective = ReliefObjective(name)
    best = find_best_relief(problem, starting_designs(problem, 2), objective)
    band = tolerance_band(problem, best.design, objective, 0.3e-6, 0.01, 30)
    assert band.nominal < band.solved
    assert band.difference < 0.1
    none = tolerance_band(problem, best.design, objective, 0.0, 0.0, 3)
    # to round-off: derivatives come with values of their own
    assert none.first_order == pytest.approx(none.nominal, rel=1e-13)
    assert none.solved == pytest.approx(none.nominal, rel=1e-13)


class QuickJob:
    """A job that stops after some reports."""

    def __init__(self, reports=10**9):
        self.stop, self.reports = threading.Event(), reports

    def report(self, stage, done, total):
        self.reports -= 1
        if self.reports < 0:
            raise Stopped


def vibration_search(problem, job, limit):
    def changed(design):
        sizes = dict(zip(("driver", "driven"), design, strict=False))
        edits = {
            f"mesh.1.{role}_tip_relief.magnitude_um": size
            for role, size in sizes.items()
        }
        return fegear.load_gear_set("liu-pair", edits)

    return VibrationSearch(
        changed=changed,
        bounds=np.array(problem.bounds),
        model=LumpedModel(
            number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
        ),
        index=0,
        torques=(100.0,),
        speeds=(2000.0, 2400.0),
        limit=limit,
        job=job,
    )


def test_the_least_vibration_is_no_more_than_that_of_the_first_designs(problem):
    search = vibration_search(problem, QuickJob(), 5)
    first = {"largest": np.array([5.0, 5.0, 0.4, 0.4])}
    best = search.find(fegear.load_gear_set("liu-pair"), first)
    assert best.complete
    assert best.designs <= 5
    assert best.sweeps == 2 * (best.designs + 1)
    assert best.best.peak <= best.static.peak
    assert best.best.peak == min(band.peak for _, band in search.solved)


def test_a_search_that_is_stopped_keeps_its_best_design(problem):
    search = vibration_search(problem, QuickJob(reports=3), 9)
    first = {"largest": np.array([5.0, 5.0, 0.4, 0.4])}
    best = search.find(fegear.load_gear_set("liu-pair"), first)
    assert not best.complete
    assert best.designs == 2


@pytest.mark.slow
def test_a_study_says_what_it_found(tmp_path):
    study = fegear.ReliefDesign(
        torque=(60.0, 140.0),
        starts=2,
        compromises=3,
        relief_tolerance_um=1.0,
        elements=COARSE,
    )
    result = fegear.run(study)
    summary = result.summary
    assert len(summary["compromises"]) == len(list(result.more_tables["pareto"].rows()))
    fewer = replace(result, front=result.front[:2])
    lines = [part for part in fewer.page() if isinstance(part, str)]
    assert any(line.startswith("2 of 3 searches") for line in lines)
    tolerance = summary["tolerance"]
    assert tolerance["nominal_um"] == pytest.approx(
        summary["objective_after_um"], rel=0.01
    )
    assert tolerance["by_solutions_um"] > tolerance["nominal_um"]
    for name, draw in result.figures.items():
        draw().savefig(tmp_path / f"{name}.png")
