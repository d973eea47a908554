"""Random gear sets: what is drawn, the promise, other branches, and the report."""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, replace

import numpy as np
import pytest
from declared_columns import require_declared
from quick_sets import measure_quickly

import validation.commands  # noqa: F401  # registers its columns
from fegear.gearset.inertia import body_inertia
from lumped.train.truncation import MAX_ERROR
from validation.commands.validate.random_sets import generator, measuring
from validation.commands.validate.random_sets.full_dynamics import (
    FullPoint,
    smallest_sets,
)
from validation.commands.validate.random_sets.generator import (
    COUNT,
    kind_of,
    random_gear_set,
)
from validation.commands.validate.random_sets.measuring import (
    COUPLED_DOWN,
    COUPLED_UP,
    MODEL_1,
    REDUCED,
    REFERENCE,
    REFERENCE_DOWN,
    WITHOUT,
    Measured,
    measure,
)
from validation.commands.validate.random_sets.set_runs import (
    FULL,
    SetRun,
    compared_sets,
    make_sets,
)
from validation.commands.validate.random_sets.verdicts import evaluate
from validation.commands.validate.report import report_values, write_report
from validation.commands.validate.report.random_sets import quantities

SOURCES = REFERENCE, REDUCED, MODEL_1, WITHOUT, COUPLED_UP, COUPLED_DOWN, REFERENCE_DOWN
GENTLE = 0  # the number of a set that takes little time


def within(value, limits):
    return limits[0] - 1e-9 <= value <= limits[1] + 1e-9


@pytest.mark.parametrize("number", range(COUNT))
def test_sets_are_within_their_ranges(number):
    gear_set = random_gear_set(number)
    for gear in gear_set.gears:
        teeth = gear.geometry
        assert within(teeth.teeth, generator.TEETH)
        assert within(1e3 * teeth.module, generator.MODULES_MM)
        assert within(teeth.hub_radius / teeth.root_radius, generator.HUBS)
        assert within(gear.face_width / teeth.module, generator.WIDTHS)
        if gear.inertia is not None:
            assert within(gear.inertia / body_inertia(gear), generator.INERTIA)
    (torque,) = gear_set.meshes[0].torques
    for load in generator.line_loads(gear_set):
        assert within(load * torque, np.array(generator.LINE_LOAD) * (0.999, 1.001))
    assert within(gear_set.damping_ratio, generator.DAMPING)


def test_sets_are_the_same_every_time_and_ten_of_each_kind():
    assert random_gear_set(7) == random_gear_set(7)
    kinds = [kind_of(number) for number in range(COUNT)]
    assert {kinds.count(kind) for kind in kinds} == {10}
    assert [g.geometry.teeth for g in random_gear_set(0).gears] == [104, 80]
    with pytest.raises(ValueError, match="number = 30; must be from 0 to 29"):
        random_gear_set(COUNT)


def test_meshes_on_a_counter_shaft_repeat_together_soon():
    for number in range(2, COUNT, 3):
        first, second = random_gear_set(number).meshes
        driven, driver = first.pair.driven.teeth, second.pair.driver.teeth
        assert driven // math.gcd(driven, driver) <= 5


def set_with(coupled, down=None, reference_down=1e-6, periods=1, **others):
    """Measured at 16 speeds with a reference of 1 um everywhere."""
    reference = [[1e-6]] * 16
    down = [row[0] for row in coupled] if down is None else down
    rms = dict.fromkeys(SOURCES, reference)
    rms |= {COUPLED_UP: coupled, COUPLED_DOWN: [[value] for value in down]}
    rms[REFERENCE_DOWN] = [[reference_down]] * 16
    measured = Measured(
        number=0,
        name="pair-1",
        kind="pair",
        teeth=[20, 30],
        hub_over_root=[0.3, 0.4],
        torque_Nm=10.0,
        speeds_Hz=[100.0 * (i + 1) for i in range(16)],
        rms_m=rms,
        multiples=dict.fromkeys(SOURCES, [[1]] * 16) | {COUPLED_UP: [[periods]] * 16},
        ms_per_speed=dict.fromkeys(SOURCES, 1.0),
        body_modes=4,
        left_out=0.03,
        warnings=[],
        resonance_Hz=1000.0,
        natural=[[900.0, 0.9]],
        natural_fe=[[901.0, 0.9]],
    )
    return replace(measured, **others)


def test_columns_are_declared():
    names = {"set", "verdict", *quantities(set_with(curve()))}
    require_declared("validate", names, "random-sets")


def curve(*errors):
    """Vibration that is off by these errors, and by 1 % at all other speeds."""
    return [[1e-6 * (1.0 + e)] for e in (*errors, *[0.01] * (16 - len(errors)))]


def test_the_promise_and_the_warning():
    assert evaluate(set_with(curve())).summary == "passed"
    off = set_with(curve(0.5, -0.3))
    assert evaluate(off).summary == "vibration off"
    assert (evaluate(off).worst, evaluate(off).worst_Hz) == (pytest.approx(0.5), 100.0)
    warned = evaluate(replace(off, warnings=["modes are left out"]))
    assert (warned.summary, warned.passed) == ("warns", True)


def test_no_motion_is_no_small_error():
    verdict = evaluate(set_with(curve(math.nan, math.nan)))
    assert (verdict.summary, verdict.worst) == ("vibration off", math.inf)


def test_a_speed_is_apart_where_the_falling_speed_has_the_reference():
    up = curve(0.5, 0.5, 0.5)
    reached = evaluate(set_with(up, down=[1.01e-6, 1.01e-6, 1.5e-6] + [1e-6] * 13))
    assert (reached.other_branch_speeds, reached.summary) == (2, "passed")
    assert reached.worst == pytest.approx(0.5)
    assert reached.p90_all == pytest.approx(0.5)
    unreached = evaluate(set_with(up))
    assert (unreached.other_branch_speeds, unreached.summary) == (0, "vibration off")


def test_a_speed_is_apart_where_the_falling_reference_is_at_the_coupled_model():
    verdict = evaluate(set_with(curve(0.5, 0.7), reference_down=1.51e-6))
    assert (verdict.other_branch_speeds, verdict.worst) == (1, pytest.approx(0.7))


def test_small_errors_are_never_apart():
    verdict = evaluate(set_with(curve(0.07), down=[1e-6] * 16, periods=2))
    assert (verdict.other_branch_speeds, verdict.worst) == (0, pytest.approx(0.07))


def test_other_periods_are_apart_but_not_everywhere():
    assert evaluate(set_with(curve(0.5, 0.5), periods=2)).other_branch_speeds == 2
    many = evaluate(set_with(curve(*[0.5] * 6), periods=2))
    assert (many.other_branch_speeds, many.summary) == (6, "vibration off")


def test_natural_frequencies_count_both_ways():
    extra = [[900.0, 0.9], [1200.0, 0.1]]
    for name, other in (("natural", "natural_fe"), ("natural_fe", "natural")):
        verdict = evaluate(set_with(curve(), **{name: extra, other: [[901.0, 0.9]]}))
        assert (verdict.summary, verdict.natural_Hz) == ("frequencies off", 1200.0)


def test_processes_make_the_sets_that_one_makes(tmp_path):
    """Files are the same to the byte but for the number of the process."""
    numbers = range(5)
    stores = []
    for name in ("one", "two"):
        stores.append(tmp_path / name)
        stores[-1].mkdir()
    one, two = stores
    calls = []
    with_workers = {"numbers": numbers, "measuring": measure_quickly}
    made = make_sets(two, 2, lambda *progress: calls.append(progress), **with_workers)
    assert len(made) == len(numbers)
    assert calls[-1] == ("random sets of workers", 5, 5)
    assert make_sets(two, 2, **with_workers) == set()  # nothing is missing
    assert make_sets(one, 1, **with_workers) == set()  # one process makes them in turn
    parallel = list(compared_sets(two, numbers=numbers, measuring=None))
    serial = list(compared_sets(one, **with_workers))
    pids = {run.measured.warnings[0] for run in parallel if run.measured}
    assert str(os.getpid()) not in pids
    for a, b in zip(parallel, serial, strict=True):
        assert a.table.relative_to(two) == b.table.relative_to(one)
        assert a.table.read_bytes() == b.table.read_bytes()
        assert (a.failure, a.name) == (b.failure, b.name)
        if a.measured:
            assert replace(a.measured, warnings=[]) == replace(b.measured, warnings=[])
    assert [run.failure for run in serial][1] == "no static equilibrium"


def test_sets_that_are_finished_stay_where_the_run_is_to_end(tmp_path):
    def report(stage, done, total):
        if done == 2:
            raise KeyboardInterrupt

    numbers = range(4)
    with pytest.raises(KeyboardInterrupt):
        make_sets(tmp_path, 2, report, numbers, measure_quickly)
    assert len(list(tmp_path.glob("random-*/result.json"))) >= 2


def test_table_in_the_report_and_kept_runs(tmp_path):
    def made(gear_set, number, report, speeds):
        if number == 1:
            raise ArithmeticError("no static equilibrium")
        return set_with(curve())

    store = tmp_path / "runs"
    store.mkdir()
    runs = list(compared_sets(store, numbers=(0, 1), measuring=made))
    assert [run.failure for run in runs] == ["", "no static equilibrium"]
    again = list(compared_sets(store, numbers=(0, 1), measuring=None))
    assert [run.reused for run in again] == [True, True]
    assert again[0].measured == runs[0].measured
    values = report_values([], tmp_path, {"": "all", "random-sets": "one"}, runs)
    write_report(values, [], tmp_path)
    (table, text), page = (
        (
            (tmp_path / name).read_text()
            for name in ("tables/random-sets.csv", "report.md")
        ),
        (tmp_path / "index.html").read_text(),
    )
    assert table.splitlines()[1].startswith("pair-1,passed,pair,20/30,0.30/0.40")
    for shown in (text, page):
        assert "1 of 2 keep" in shown
        assert "no static equilibrium" in shown
    set_values = json.loads((tmp_path / "report.json").read_text())["random_sets"]
    assert [row["verdict"] for row in set_values["rows"]] == ["passed", "failed"]
    rows = runs[0].table.read_text().splitlines()
    assert len(rows) == 17
    assert asdict(runs[0].measured)["speeds_Hz"][0] == 100.0


def test_full_models_stand_below_the_table(tmp_path):
    point = FullPoint("pair-10", 1188.0, 76568, 86, 0.0123, 0.00045)
    place = tmp_path / "runs" / "random-full" / FULL
    run = SetRun("pair-10", place, False, "here", "", full=(point,))
    commands = {"": "all", "random-sets": "one"}
    values = report_values([], tmp_path, commands, [run])
    write_report(values, [], tmp_path)
    row = (tmp_path / "tables/random-sets-full.csv").read_text().splitlines()[1]
    assert row == "pair-10,1188.0,76568,86,0.0123,0.00045"
    assert (
        "| pair-10 | 1188 | 76568 | 86 | 1.2 | 0.045 |"
        in (tmp_path / "report.md").read_text()
    )


def test_the_smallest_sets_have_the_fewest_teeth():
    assert smallest_sets(2) == [9, 15]


@pytest.mark.slow
@pytest.mark.usefixtures("compliance_cache")
def test_a_gentle_set_from_end_to_end():
    measured = measure(random_gear_set(GENTLE), GENTLE, count=3)
    verdict = evaluate(measured)
    assert measured.speeds_Hz == measuring.speeds_of(measured.resonance_Hz, 3)
    assert verdict.passed
    assert verdict.natural < 1e-3
    assert 0.0 < measured.left_out < MAX_ERROR
    assert measured.body_modes > 0
    assert min(measured.ms_per_speed.values()) > 0.0
