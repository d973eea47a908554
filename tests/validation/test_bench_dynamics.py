"""Errors, rows of gears and figures of the benchmark of gears in motion."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.dynamics.build import FiniteElements
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from lumped.common.csv_text import format_records
from validation.commands.bench import bench_dynamics as study
from validation.commands.bench.benchmark import Benchmark, plain
from validation.study.from_rest import run, subject, waveform_error


@pytest.fixture(scope="module")
def bench_of(compliance_cache):
    excitations = Excitations()

    def make(gears):
        gear_set = study.row_of_gears(load_gear_set("liu-pair"), gears)
        return subject(gear_set, 100.0, excitations)

    return make


def test_error_at_common_times():
    time = np.linspace(0.0, 1.0, 128, endpoint=False)
    fine = np.sin(2.0 * np.pi * time)[:, None]
    assert waveform_error(fine[::4], fine)[0] == 0.0
    assert waveform_error(1.01 * fine[::2], fine)[0] == pytest.approx(0.01)


@pytest.mark.parametrize("gears", [2, 3, 4])
def test_gears_of_a_row_turn_in_turns(gears):
    row = study.row_of_gears(load_gear_set("liu-pair"), gears)
    assert [g.geometry.teeth for g in row.gears] == [38, 55, 38, 55][:gears]
    for mesh in row.meshes:
        assert mesh.pair.driver == row.gears[mesh.driver].geometry
        assert mesh.pair.driven == row.gears[mesh.driven].geometry
    assert row.senses == (1, -1, 1, -1)[:gears]


def test_errors_shrink_with_the_steps_at_equal_cost_per_step(bench_of):
    bench = bench_of(2)
    stepper, freedoms, _ = bench.stepper(FiniteElements(fidelity="quasistatic"))
    assert freedoms == 0
    fine, _ = run(stepper, bench.speeds[1], 1024)
    errors = [
        waveform_error(run(stepper, bench.speeds[1], n)[0], fine)[0]
        for n in (64, 128, 256)
    ]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_cutoffs_below_all_elastic_modes_are_left_out(bench_of):
    bench = bench_of(2)
    stepper, _, _ = bench.stepper(FiniteElements(fidelity="reduced"))
    others = study.others_with_modes(stepper)
    skipped = [option for option in study.FULL.others if option not in others]
    assert [setting for _, setting, _ in skipped] == [10e3]
    _, _, elements = others[len(study.FULL.meshes) + 1]
    assert bench.stepper(elements)[1] > 0
    with pytest.raises(InputError, match="no elastic mode"):
        bench.stepper(skipped[0][2])


def test_rows_grow_by_coordinates(bench_of):
    sizes = [study.growth(bench_of(gears)) for gears in (2, 4)]
    assert sizes[1].coordinates == 2 * sizes[0].coordinates
    assert all(size.us_per_step > 0.0 for size in sizes)


def test_picture_and_table(tmp_path):
    points = [
        study.DynamicsCost("steps", 64, 9, 1.0, 3.0, 1e-2, 2e-2),
        study.DynamicsCost("steps", 128, 9, 1.0, 3.0, 2.5e-3, 5e-3),
        study.DynamicsCost("mesh", 0.7, 900, 1.0, 9e3, np.nan, np.nan),
        study.DynamicsCost("modes", 0.0, 0, 1.0, 3.0, 1.0, 1.2),
    ]
    assert study.observed_order(points) == pytest.approx(2.0)
    lines = format_records(plain({"points": points})["points"]).splitlines()
    assert lines[0].startswith("study,setting,freedoms,prepare_s,us_per_step")
    assert len(lines) == 5
    panel = study.figure_panel(points)
    axes = Benchmark("", "title", "", {}, [panel]).draw().axes[0]
    assert len(axes.lines) == 3
    assert "[ms]" in axes.get_ylabel()
    assert [label.get_text() for label in axes.texts] == ["64", "128", "0"]
