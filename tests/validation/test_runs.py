"""Runs of small cases: verdicts, reuse, interruption."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from case_files import TINY
from conftest import SMALL_HUBS

from fegear.dynamics.stepper import ReducedStepper
from fegear.files import kept, memory
from fegear.files.errors import InputError
from fegear.files.store import open_checkpoint
from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.workers import Cluster, Stopped
from lumped.steady.steady_state import Diverged
from lumped.steady.steppers import FixedStepper
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.waves import Wave as PeriodicWave
from validation.study import runs, solving, tasks
from validation.study.cases import Model, SingleSpeed, Tolerance, load_case
from validation.study.metrics import static_measures
from validation.study.printed import printed_figure
from validation.study.run_files import FILE_NAMES, features
from validation.study.run_store import RESULT
from validation.study.solving import approach
from validation.study.statics_runs import mesh_statics, static_deflection
from validation.study.tasks import tasks_of

METRICS = (
    ("off_jump_distance", 0.25, "2 dB"),
    ("peak_frequency", 0.05, "half the usual margin"),
    ("jump_frequency", 100.0, "a few steps"),
    ("mean_stiffness", 0.05, "half the above"),
)
CASE = replace(
    TINY,
    name="small",
    edits=(
        "defaults.face_width_mm=25.4",
        "gear.1.hub_radius_mm=14.07",
        "gear.2.hub_radius_mm=20",
    ),
    speeds_Hz="1000:2600:40",
    metric=tuple(Tolerance(name=n, allowed=a, reason=r) for n, a, r in METRICS),
)
STORE = Path("store")
FEW = replace(
    CASE,
    speeds_Hz="1000:1200:50",
    single_speed=(SingleSpeed(torque_Nm=100.0, speed_Hz=1100.0, from_speed_Hz=1150.0),),
)


def bytes_of(store):
    return {p.relative_to(store): p.read_bytes() for p in store.rglob("*.*")}


def require_same_files(run, other):
    for name in ("sweep.csv", "statics.csv", "waves.csv"):
        one, two = run.directory / name, other.directory / name
        assert one.read_bytes() == two.read_bytes(), name
    assert inputs_of(run) == inputs_of(other)


def inputs_of(run):
    return json.loads((run.directory / kept.INPUTS).read_text())["inputs"]


@pytest.mark.slow
def test_runs_of_a_cluster_are_those_of_this_process(tmp_path, few):
    pytest.importorskip("distributed")
    runs.make_runs([FEW, FEW], tmp_path, Cluster())
    there = runs.run_case(FEW, tmp_path)
    for one, other in zip(few[1].runs, there.runs, strict=True):
        assert other.reused
        require_same_files(one, other)
    assert there.verdicts == few[1].verdicts


def test_runs_of_another_program_are_refused(tmp_path, monkeypatch):
    """As told by what a run was made of."""
    made = runs.contents_of

    def elsewhere(task):
        with monkeypatch.context() as patch:
            patch.setattr(tasks, "FORMAT", "another")
            return made(task)

    monkeypatch.setattr(runs, "contents_of", elsewhere)
    model_only = replace(FEW, speeds_Hz="1000:1050:50", single_speed=())
    with pytest.raises(InputError, match="workers whose program is not the one"):
        runs.make_runs([model_only], tmp_path, 1)


@pytest.fixture(scope="module")
def few(tmp_path_factory, compliance_cache):
    store = tmp_path_factory.mktemp("few")
    return store, runs.run_case(FEW, store)


def test_files_of_a_run(few):
    store, result = few
    reference, model = result.runs
    assert (reference.source, model.source) == ("fe", "model-1")
    for run in result.runs:
        names = {path.name for path in run.directory.iterdir()}
        assert names == {
            *("inputs.json", "sweep.csv", "statics.csv", "waves.csv", "result.json")
        }
        assert not run.reused
        assert run.directory.parent == store
        assert [c.direction for c in run.curves] == ["up", "down"]
        assert all((np.diff(c.frequency) > 0.0).all() for c in run.curves)
        assert run.cost.speeds == 10
        assert run.cost.timed_speeds == 14
        assert run.cost.steps > 1000
        assert run.cost.per_speed_s > 0.0
    assert {row.model for row in reference.table.rows} == {"quasistatic"}
    assert {row.model for row in model.table.rows} == {"1"}
    assert result.cost_ratio("model-1") > 1.0


def test_waves_of_both_are_alike_off_the_resonance(few):
    one, two = (run.cycles[0].force for run in few[1].runs)
    assert np.corrcoef(one, two)[0, 1] > 0.9
    assert one.mean() == pytest.approx(100.0 / 0.04535, rel=1e-2)


def test_reuse_computes_nothing_and_changes_no_byte(few, monkeypatch):
    store, result = few
    before = bytes_of(store)

    def never(*_):
        raise AssertionError("computed again")

    monkeypatch.setattr(runs, "solve_task", never)
    again = runs.run_case(FEW, store)
    assert all(run.reused for run in again.runs)
    assert again.verdicts == result.verdicts
    assert bytes_of(store) == before
    # a tolerance belongs to no run
    looser = replace(FEW, metric=FEW.metric[:1], name="other")
    assert all(run.reused for run in runs.run_case(looser, store).runs)


@pytest.mark.parametrize(
    "changes",
    [
        {"torques_Nm": (101.0,), "single_speed": ()},
        {"speeds_Hz": "1000:1200:25"},
        {"directions": ("up",)},
        {"edits": ("gear.pinion.inertia_kg_m2=0.003",)},
        {"damping_ratio": 0.05},
        {"single_speed": ()},
    ],
)
def test_what_determines_a_run_names_it(changes):
    names = [
        {t.directory(STORE) for t in tasks_of(c)}
        for c in (FEW, replace(FEW, **changes))
    ]
    assert names[0].isdisjoint(names[1])


def test_fidelity_and_friction_belong_to_the_finite_elements():
    before, after = (
        [task.directory(STORE) for task in tasks_of(case)]
        for case in (FEW, replace(FEW, fidelity="reduced", friction=0.1))
    )
    assert before[0] != after[0]
    assert before[1] == after[1]


@pytest.mark.slow
def test_an_interrupted_run_goes_on_where_it_was(few, tmp_path):
    stages = []

    def interrupt(stage, done, total):
        stages.append(stage)
        if stage.startswith("fe") and done == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runs.run_case(FEW, tmp_path, interrupt)
    assert (next(tmp_path.glob("fe-*")) / "checkpoint").is_file()
    assert not list(tmp_path.rglob("result.json"))
    result = runs.run_case(FEW, tmp_path)
    assert result.runs[0].cost.timed_speeds < 14
    uninterrupted = few[1]
    for here, there in zip(result.runs, uninterrupted.runs, strict=True):
        require_same_files(here, there)
    assert result.verdicts == uninterrupted.verdicts
    assert not list(tmp_path.rglob("checkpoint"))


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.2, 0.5, 0.7, 0.9])
def test_a_run_that_is_stopped_is_not_finished(few, tmp_path, part):
    """As by Ctrl-C in a study: the progress raises Stopped from then on."""
    calls, stopped_at = [], math.inf

    def report(*progress):
        calls.append(progress)
        if len(calls) >= stopped_at:
            raise Stopped

    runs.run_case(FEW, tmp_path / "whole", report)
    stopped_at, store = max(2, round(part * len(calls))), tmp_path / "stopped"
    calls.clear()
    with pytest.raises(Stopped):
        runs.run_case(FEW, store, report)
    uninterrupted = few[1]
    finished = {path.parent.name for path in store.rglob(kept.INPUTS)}
    for run in uninterrupted.runs:
        if run.directory.name in finished:
            require_same_files(
                SimpleNamespace(directory=store / run.directory.name), run
            )
    result = runs.run_case(FEW, store)
    for here, there in zip(result.runs, uninterrupted.runs, strict=True):
        require_same_files(here, there)
    assert result.verdicts == uninterrupted.verdicts


@pytest.mark.slow
def test_an_interruption_in_a_wave_keeps_the_sweep(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(solving, "_cycles_at", interrupt)
        with pytest.raises(KeyboardInterrupt):
            runs.run_case(FEW, tmp_path)
    assert runs.run_case(FEW, tmp_path).runs[0].cost.timed_speeds == 4


def test_a_wave_that_diverges_is_nan_and_outside(tmp_path, monkeypatch):
    def diverged(*_):
        raise Diverged(0.5)

    monkeypatch.setattr(FixedStepper, "record", diverged)
    entry = replace(FEW.metric[0], name="wave_correlation", allowed=0.5)
    case = replace(FEW, metric=(entry,), speeds_Hz="")
    (verdict,) = runs.run_case(case, tmp_path).verdicts
    assert math.isnan(verdict.measured)
    assert not verdict.within


@pytest.mark.slow
def test_an_approach_goes_on_where_it_was(few, tmp_path):
    def interrupt(stage, done, total):
        if stage.endswith("wave 1") and done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runs.run_case(FEW, tmp_path, interrupt)
    reports = []
    result = runs.run_case(FEW, tmp_path, lambda *progress: reports.append(progress))
    # of four speeds, two on the way are kept
    assert result.runs[0].cost.timed_speeds == 2
    waves = [report for report in reports if report[0].startswith("fe 100 N m, wave 1")]
    assert waves == [
        ("fe 100 N m, wave 1", 1, 4),
        ("fe 100 N m, wave 1", 2, 4),
        ("fe 100 N m, wave 1, 1116.67 Hz", 2, 4),
        ("fe 100 N m, wave 1", 3, 4),
        ("fe 100 N m, wave 1, 1100 Hz", 3, 4),
        ("fe 100 N m, wave 1", 4, 4),
    ]
    require_same_files(result.runs[0], few[1].runs[0])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sweep.csv", kept.INPUTS])
def test_speeds_are_kept_until_the_result_is_written(few, tmp_path, monkeypatch, name):
    def interrupted(path, content):
        if path.name == name:
            raise KeyboardInterrupt
        write(path, content)

    write = kept.write_bytes
    with monkeypatch.context() as patch:
        patch.setattr(kept, "write_bytes", interrupted)
        with pytest.raises(KeyboardInterrupt):
            runs.run_case(FEW, tmp_path)
    result = runs.run_case(FEW, tmp_path)
    # the last speed of the wave, whose motion is needed whole
    assert result.runs[0].cost.timed_speeds == 1
    require_same_files(result.runs[0], few[1].runs[0])


def test_a_diverging_approach_of_the_finite_elements_is_nan(tmp_path, monkeypatch):
    integrate = ReducedStepper.integrate

    def diverging(self, state, steps):
        if 0.0 < steps.frequency < 1120.0:
            raise Diverged(0.0)
        return integrate(self, state, steps)

    monkeypatch.setattr(ReducedStepper, "integrate", diverging)
    case = replace(FEW, speeds_Hz="")
    reference = runs.run_case(case, tmp_path).of("fe")[0]
    assert np.isnan(reference.cycles[0].force).all()
    assert reference.cost.timed_speeds == 3


def test_jumps_and_peaks_of_a_branch_are_those_of_each_mesh():
    speeds = np.arange(1980.0, 990.0, -20.0)
    steep = np.where(speeds > 1500.0, 1e-6, 5e-6)
    smooth = 1e-6 / np.hypot(1.0 - (speeds / 1500.0) ** 2, speeds / 15e3)
    columns = {"dte_rms": np.stack([steep, smooth], axis=1)}
    others = ("force_peak", "contact_loss", "back_side")
    columns |= {n: np.ones((speeds.size, 2)) for n in others}
    branch = SimpleNamespace(
        frequency_Hz=speeds,
        direction="down",
        column=columns.__getitem__,
        system=SimpleNamespace(excitations=(0, 1)),
        complete=True,
    )
    first, second = features([branch])
    assert [jump["frequency_to"] for jump in first["jumps"]] == [1500.0]
    assert second["jumps"] == []
    assert [peak["frequency"] for peak in second["peaks"]] == [1500.0]
    assert (first["mesh"], second["mesh"], second["direction"]) == (1, 2, "down")


def another_digit(match):
    return str((int(match[0]) + 1) % 10)


DAMAGE = {
    "cut off": lambda text: text[: len(text) // 2],
    "a digit": lambda text: re.sub(r"\d(?=\D*$)", another_digit, text),
    "empty": lambda text: "",
    "foreign": lambda text: "nothing\n",
    "gone": None,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", DAMAGE)
@pytest.mark.parametrize("name", [kept.INPUTS, *FILE_NAMES, RESULT])
def test_a_damaged_run_is_made_again(few, tmp_path, name, kind):
    store = shutil.copytree(few[0], tmp_path / "store")
    path = next(store.glob(f"model-1*/{name}"))
    whole = path.read_text()
    if kind == "gone":
        path.unlink()
    else:
        path.write_text(DAMAGE[kind](whole))
        assert path.read_text() != whole
    reference, model = runs.run_case(FEW, store).runs
    assert reference.reused
    assert not model.reused
    require_same_files(model, few[1].runs[1])
    assert all(run.reused for run in runs.run_case(FEW, store).runs)


def test_values_that_fit_json_but_not_the_seal_are_not_believed(few, tmp_path):
    store = shutil.copytree(few[0], tmp_path / "store")
    path = next(store.glob("model-1*/result.json"))
    result = json.loads(path.read_text())
    result["natural_Hz"][0] *= 1.01
    path.write_text(json.dumps(result))
    assert runs.run_case(FEW, store).runs[1].natural_Hz == few[1].runs[1].natural_Hz


@pytest.mark.parametrize("name", ["sweep.csv", "result.json"])
def test_what_cannot_be_read_is_told_before_anything_runs(few, tmp_path, name):
    store = shutil.copytree(few[0], tmp_path / "store")
    path = next(store.glob(f"fe-*/{name}"))
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match=rf"{name}: cannot be read, is a directory"):
        runs.run_case(FEW, store)


def test_a_store_that_cannot_be_written_is_told_before_anything_runs(
    tmp_path, monkeypatch
):
    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(runs, "solve_task", refuse)
    monkeypatch.setattr(tempfile, "mkstemp", refuse)
    case = replace(FEW, speeds_Hz="1000:1100:50", single_speed=())
    with pytest.raises(InputError, match="cannot be written, permission denied"):
        runs.run_case(case, tmp_path)


def test_a_run_that_another_process_makes_is_refused(few, tmp_path):
    task = next(tasks_of(FEW))
    checkpoint = task.directory(tmp_path) / "checkpoint"
    other = open_checkpoint(checkpoint, task.inputs, resume=True)
    with pytest.raises(InputError, match="another process works on it"):
        runs.run_case(FEW, tmp_path)
    other.close(keep=True)
    result = runs.run_case(FEW, tmp_path)
    require_same_files(result.runs[0], few[1].runs[0])


def test_a_checkpoint_left_beside_a_finished_run_goes(few, tmp_path):
    store = shutil.copytree(few[0], tmp_path / "store")
    task = next(tasks_of(FEW))
    checkpoint = task.directory(store) / "checkpoint"
    open_checkpoint(checkpoint, task.inputs, resume=True).close(keep=True)
    assert runs.run_case(FEW, store).runs[0].reused
    assert not checkpoint.exists()


@pytest.mark.skipif(sys.platform != "linux", reason="Linux counts memory")
def test_memory_of_runs_is_kept(few):
    store, result = few
    # of this process, which has run other tests before: what the run adds says more
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e6
    for run in result.runs:
        assert 50.0 < run.cost.memory_MB < most
        assert 0.0 <= run.cost.memory_above_start_MB < 1000.0
    costs = [run.cost for run in runs.run_case(FEW, store).runs]
    assert costs == [run.cost for run in result.runs]


def test_memory_that_is_not_known_is_nan(few, tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "STATUS_FILE", tmp_path / "nothing")
    store = shutil.copytree(few[0], tmp_path / "store")
    next(store.glob("model-1*/result.json")).unlink()
    for _ in range(2):
        cost = runs.run_case(FEW, store).runs[1].cost
        assert math.isnan(cost.memory_MB)
        assert math.isnan(cost.memory_above_start_MB)
        assert cost.steps > 0


@pytest.mark.slow
def test_a_wrong_inertia_fails_where_the_right_one_passes(tmp_path):
    gears = load_gear_set("liu-pair").gears
    wrong = tuple(f"gear.{g.name}.inertia_kg_m2={1.3 * g.inertia!r}" for g in gears)
    models = (CASE.model[0], replace(CASE.model[0], edits=wrong))
    result = runs.run_case(replace(CASE, model=models), tmp_path)
    right = [v for v in result.verdicts if v.model == "model-1"]
    failed = {v.metric for v in result.verdicts if not v.within}
    assert right
    assert all(v.within for v in right)
    assert {"off_jump_distance", "peak_frequency"} <= failed
    shift = [
        v.measured
        for v in result.verdicts
        if v.metric == "peak_frequency" and v.model == "model-1-edited"
    ]
    assert min(shift) == pytest.approx(1.3**-0.5 - 1.0, abs=0.04)


def printed_value(run, key, near):
    return printed_figure(run, key, near)[0]


def test_printed_figures(few):
    reference, model = few[1].runs
    stiffness = printed_value(model, "mesh1.mean_stiffness", 0.0)
    assert stiffness == pytest.approx(2.98e8, rel=5e-3)
    assert printed_value(reference, "mesh1.stiffness_variation", 0.0) == (
        pytest.approx(0.31, abs=0.02)
    )
    natural = printed_value(model, "natural", 2900.0)
    assert natural in model.natural_Hz
    assert math.isnan(printed_value(reference, "natural", 2900.0))
    assert math.isnan(printed_value(model, "natural", 10.0 * natural))
    force = printed_value(reference, "mesh1.wave1.force_peak", 0.0)
    assert force == np.abs(reference.cycles[0].force).max()
    assert printed_value(reference, "mesh1.wave1.contact_loss", 0.0) == 0.0
    files = {"natural": "result.json", "mesh1.up.peak": "sweep.csv"}
    files |= {"mesh1.wave1.contact_loss": "waves.csv"}
    files |= {"mesh1.friction_recess": "statics.csv"}
    assert {key: printed_figure(model, key, 1.0)[1] for key in files} == files
    for key in ("mesh1.up.jump", "mesh1.wave2.force_peak", "mesh1.friction_recess"):
        value = printed_value(model, key, 1.0)
        assert math.isnan(value)


@pytest.mark.slow
def test_friction_changes_the_deflection_of_single_pairs(tmp_path):
    edits = tuple(f"{key}={value}" for key, value in SMALL_HUBS.items())
    result = runs.run_case(replace(load_case("friction-pair"), edits=edits), tmp_path)
    reference = result.of("fe")[0]
    changes = [
        printed_value(reference, f"mesh1.friction_{stretch}", 0.0)
        for stretch in ("recess", "approach")
    ]
    assert all(1e-9 < abs(change) < 1e-6 for change in changes)
    assert math.isnan(result.cost_ratio("model-1"))
    assert {v.metric for v in result.verdicts} == {
        *("mean_stiffness", "stiffness_variation", "static_deflection")
    }


@pytest.mark.slow
def test_model_1_with_friction_deflects_as_the_finite_elements(tmp_path):
    """Within 25 nm where bending takes back what moments do, else 0.3 um off."""
    case = load_case("friction-pair")
    case = replace(case, model=case.model[:3])
    runs_by_source = {run.source: run for run in runs.run_case(case, tmp_path).runs}
    changes = {
        name: [
            printed_value(run, f"mesh1.friction_{stretch}", 0.0)
            for stretch in ("recess", "approach")
        ]
        for name, run in runs_by_source.items()
    }
    assert np.isnan(changes["model-1"]).all()
    for name, exact in (
        ("fe", (0.0, 0.0)),
        ("model-1-friction", (0.0, 0.0)),
        ("model-1-friction-bending-0", (-0.37e-6, 0.37e-6)),
    ):
        np.testing.assert_allclose(changes[name], exact, atol=4e-8)


@pytest.mark.slow
def test_only_bending_makes_friction_do_what_it_does_in_finite_elements(tmp_path):
    """The resonance of the case falls; moments alone would raise it."""
    case = replace(load_case("friction-resonance"), speeds_Hz="1300:1420:20")
    result = runs.run_case(case, tmp_path)
    effects = {
        v.model: (v.measured, v.within)
        for v in result.verdicts
        if v.metric == "friction_effect"
    }
    assert set(effects) == {"model-1-friction", "model-1-friction-bending-0"}
    assert effects["model-1-friction"][1]
    assert effects["model-1-friction-bending-0"][0] > 0.3
    sources = [run.source for run in result.judged]
    assert sources[:2] == ["fe", "fe-without-friction"]


def constant(value):
    return PeriodicWave(np.array([0.0, 1.0]), np.array([[value, 0.0, 0.0, 0.0]]))


def test_static_deflection_of_two_springs():
    pairs = tuple(
        PairExcitation(constant(k), constant(g))
        for k, g in ((2e8, 0.0), (1e8, 5e-6), (0.0, -1e-3))
    )
    excitation = MeshExcitation(pairs, 3e8)
    at = np.array([0.0, 0.3])
    one = static_deflection(excitation, 400.0, at)
    both = static_deflection(excitation, 2500.0, at)
    np.testing.assert_allclose(one, 2e-6, rtol=1e-12)
    np.testing.assert_allclose(both, (2500.0 + 1e8 * 5e-6) / 3e8, rtol=1e-12)


def test_static_deflection_is_that_of_the_finite_elements():
    gear_set, excitations = load_gear_set("liu-pair"), Excitations()
    table = excitations.table(gear_set, 0, 100.0)
    force = 100.0 / gear_set.meshes[0].pair.driver.base_radius
    deflection = static_deflection(
        excitations.mesh_excitation(gear_set, 0, 100.0, 1), force, table.position
    )
    error = np.abs(deflection / table["ste_m"][0] - 1.0)
    assert np.median(error) < 0.01


def test_approach_ends_at_the_speed():
    assert approach(SingleSpeed(torque_Nm=1.0, speed_Hz=900.0)) == [900.0]
    way = approach(SingleSpeed(torque_Nm=1.0, speed_Hz=900.0, from_speed_Hz=950.0))
    assert (way[0], way[-1], len(way)) == (950.0, 900.0, 4)


def test_approach_takes_steps_as_small_as_the_case_asks_for():
    fine = {"from_speed_Hz": 950.0, "step_Hz": 4.0}
    way = approach(SingleSpeed(torque_Nm=1.0, speed_Hz=900.0, **fine))
    assert (way[0], way[-1], len(way)) == (950.0, 900.0, 14)


@pytest.mark.parametrize("number", [1, 2, 3, "coupled"])
def test_statics_go_on_until_pitch_errors_repeat(number):
    """As the finite elements', pair after pair."""
    errors = {"gear.1.pitch_errors_um": [0, 3] * 19}
    case = replace(CASE, model=(Model(number=number),))
    task = next(iter(tasks_of(case)))
    task = replace(task, gear_set=load_gear_set("liu-pair", errors))
    excitations = Excitations()
    fe, model_statics = (
        mesh_statics(
            replace(task, model=model),
            excitations,
            0,
            lumped_system(
                task.gear_set, 100.0, LumpedModel(number=number), excitations
            ),
        )
        for model in (None, case.model[0])
    )
    assert fe.position.max() > 1.0
    assert np.ptp(np.round(model_statics.position)) == np.ptp(np.round(fe.position))
    measured = {name: value for name, _, value in static_measures(fe, model_statics)}
    allowed = 0.01 if number == "coupled" else 0.15
    assert measured["static_deflection"] < allowed


@pytest.mark.slow
def test_coupled_statics_are_those_of_a_mesh_alone():
    """As the tables of finite elements; a coupling would take a part of the load."""
    held = tuple(f"gear.{g}.coupling_stiffness_Nm_per_rad=1e5" for g in (1, 2))
    deflections = []
    for edits in ((), held):
        case = replace(CASE, speeds_Hz="", edits=(*CASE.edits, *edits))
        case = replace(case, model=(Model(number="coupled"),))
        _, task = tasks_of(case)
        (statics,) = solving.solve_task(
            task, None, Excitations(), lambda *_: None
        ).statics
        deflections.append(statics.deflection)
    np.testing.assert_allclose(deflections[1], deflections[0], rtol=1e-6)
    system = lumped_system(task.gear_set, 100.0, LumpedModel(number="coupled"))
    part = 1.0 - system.loaded.deflection.mean() / deflections[0].mean()
    assert part > 0.01, "as the train is at rest"
