"""Derivatives of the transmission error with respect to reliefs, and best reliefs."""

from __future__ import annotations

import itertools
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from changed_flanks import with_flanks
from hypothesis import given, settings
from hypothesis import strategies as st
from wide_sets import HELICAL

import fegear
from fegear.commands.relief.best_relief import (
    find_best_relief,
    starting_designs,
    without_idle_features,
)
from fegear.commands.relief.objective import ReliefObjective, peak_to_peak
from fegear.commands.relief.relief_problem import ReliefProblem, relief_ranges
from fegear.contact.pairs import candidate_pairs
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.plane.kernels.cycle import TORQUE
from fegear.contact.plane.runs import solve_pairs
from fegear.contact.solve import solve_cycle
from fegear.files.toml import toml_text
from fegear.gearset import make_gear_set
from fegear.gearset.edit import edited
from fegear.gearset.modifications import Relief
from fegear.gearset.read import load_tables
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from fegear.studies.trains.gear_sets import GearSetRef

COARSE = StaticsSettings(resolution="coarse")
TORQUES = np.array([60.0, 100.0, 140.0])
POSITIONS = np.arange(16) / 16 + 1.0 / 37.0
TIPS = "driver_tip", "driven_tip"


@pytest.fixture(scope="module")
def contact():
    return contact_problem(fegear.load_gear_set("liu-pair"), 0, COARSE)


def relief_problem(contact, shape="linear"):
    ranges = relief_ranges(contact, TIPS)
    return ReliefProblem(contact, ranges, TORQUES, POSITIONS, 20e-6, shape)


def test_a_gap_of_a_pair_counts_as_its_part_of_the_next_load(contact):
    """Exact: the contact conditions of the loaded nodes are linear in their gaps."""
    teeth = candidate_pairs(contact, POSITIONS)
    targets = np.full((1, POSITIONS.size), 100.0 / contact.face_width)
    gaps = np.full((POSITIONS.size, teeth.size), 2e-6)

    def solved(gaps):
        return solve_pairs(contact, teeth, gaps, POSITIONS, TORQUE, targets)

    middle, step = solved(gaps), 1e-10
    closing = middle.cells.moment_arms[..., 0] / contact.pair.driver.base_radius
    total = (middle.cells.slope * closing).sum(axis=2)
    for k in range(teeth.size):
        ends = []
        for sign in (1.0, -1.0):
            moved = gaps.copy()
            moved[:, k] += sign * step
            ends.append(solved(moved).rows.ste)
        difference = (ends[0] - ends[1]) / (2.0 * step)
        share = middle.cells.slope[..., k] / total
        assert np.abs(difference - share).max() < 1e-5


def test_slopes_of_the_load_add_up_to_the_local_stiffness(contact):
    cycle = solve_cycle(contact, TORQUES, POSITIONS)
    total = (cycle.load_slope * cycle.closing).sum(axis=2)
    np.testing.assert_allclose(total, cycle.local_stiffness, rtol=1e-12)


def errors(problem, design):
    """Transmission errors of a design in all cases."""
    return problem.responses(design)["ste"].values


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize(("nodes", "tolerance"), [(25, 0.02), (101, 0.004)])
def test_derivatives_approach_differences_with_finer_nodes(
    contact, nodes, tolerance, friction
):
    """Nodes follow the point of contact, which derivatives leave out: 0.009, 0.002."""
    finer = replace(contact, solver=PlaneContact(nodes=nodes), friction=friction)
    problem = relief_problem(finer, "parabolic")
    problem = replace(problem, torques=np.array([100.0]))
    design = np.array([8.0, 7.0, 0.4, 0.35])
    _, slopes = problem.responses(design)["ste"]
    for i, step in enumerate([1e-3, 1e-3, 1e-4, 1e-4]):
        ends = [errors(problem, design + s * step * np.eye(4)[i]) for s in (1, -1)]
        difference = (ends[0] - ends[1]) / (2.0 * step)
        largest = np.abs(difference).max()
        assert np.abs(difference - slopes[..., i]).max() < tolerance * largest


def test_flanks_without_relief_have_no_derivatives(contact):
    cycle = solve_cycle(contact, TORQUES, POSITIONS, with_slopes=True)
    assert cycle.relief_slope.shape[1] == POSITIONS.size
    assert not cycle.relief_slope.any()
    tip = Relief(magnitude=1e-6, start_roll_length=contact.pair.pitch_point)
    relieved = with_flanks(contact, driver_tip_relief=tip)
    one = solve_cycle(relieved, TORQUES, POSITIONS, with_slopes=True)
    assert one.relief_slope[:, :, 0, 0, 0].any()
    assert not one.relief_slope[:, :, 1].any()


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["largest", "mean"])
def test_no_design_of_a_grid_is_better_by_one_per_cent(contact, objective):
    problem = relief_problem(contact)
    goal = ReliefObjective(objective)
    found = find_best_relief(problem, starting_designs(problem, 5), goal)
    reduce = np.max if objective == "largest" else np.mean
    grid = itertools.product(*(np.linspace(*ends, 6) for ends in problem.bounds))
    values = [reduce(peak_to_peak(errors(problem, np.array(x)))) for x in grid]
    assert found.value < 1.01 * min(values)
    assert found.evaluations < len(values) / 15
    assert found.value == pytest.approx(reduce(found.measures), rel=1e-12)


def test_designs_to_start_from_are_within_bounds_and_the_same(contact):
    problem = relief_problem(contact)
    designs = np.array(starting_designs(problem, 9))
    low, high = np.array(problem.bounds).T
    assert designs.shape == (9, 4)
    assert ((designs >= low) & (designs <= high)).all()
    assert (designs == np.array(starting_designs(problem, 9))).all()


def test_the_written_gear_set_has_the_transmission_error_that_is_shown(tmp_path):
    study = fegear.ReliefDesign(
        torque=(80.0, 120.0),
        starts=2,
        elements=StaticsSettings(resolution="coarse", positions=16),
    )
    result = fegear.run(study)
    result.write(tmp_path / "best.toml")
    gears = fegear.load_gear_set(tmp_path / "best.toml")
    elements = replace(study.elements, estimate_error=False)
    solved = fegear.solve_mesh(gears, 1, (80.0, 120.0), elements)
    after = [row["after_um"] for row in result.rows]
    np.testing.assert_allclose(1e6 * peak_to_peak(solved.cycle.ste), after, rtol=1e-9)
    assert max(after) < 0.7 * max(row["before_um"] for row in result.rows)
    for relief in result.reliefs:  # 1 um more, by another solution
        key = f"mesh.1.{relief['relief']}.magnitude_um"
        edits = {key: relief["magnitude_um"] + 1.0}
        more = fegear.load_gear_set(tmp_path / "best.toml", edits)
        solved = fegear.solve_mesh(more, 1, (80.0, 120.0), elements)
        change = 1e6 * peak_to_peak(solved.cycle.ste).max() - max(after)
        assert relief["objective_per_um"] == pytest.approx(change, rel=1e-6)
        assert change > 0.0


@pytest.mark.parametrize("folder", ["sets", "elsewhere"])
def test_the_written_gear_set_has_its_measured_profile(tmp_path, monkeypatch, folder):
    monkeypatch.chdir(tmp_path)
    for name in ("sets", "elsewhere"):
        (tmp_path / name).mkdir()
    edits = {"mesh.1.driver_profile.file": "flank.csv"}
    tables = load_tables("liu-pair", {})
    tables = edited(tables, edits)
    (tmp_path / "sets/pair.toml").write_text(toml_text(tables))
    (tmp_path / "sets/flank.csv").write_text(
        "roll_angle_deg,deviation_um\n18,0\n22,-3\n26,-1\n"
    )
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name="sets/pair.toml"),
        torque=(100.0,),
        starts=1,
        elements=StaticsSettings(resolution="coarse", positions=8),
    )
    path = tmp_path / folder / "best.toml"
    fegear.run(study).write(path)
    profile = fegear.load_gear_set(path).meshes[0].driver_flank.profile
    assert profile == study.gear_set.loaded.meshes[0].driver_flank.profile
    file = tomllib.loads(path.read_text())["mesh"][0]["driver_profile"]["file"]
    assert Path(file).is_absolute() == (folder == "elsewhere")


def test_a_design_that_is_not_better_is_reported():
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(
            name="liu-pair", edits=("mesh.1.tip_relief.magnitude_um=6",)
        ),
        torque=(100.0,),
        max_relief_um=0.001,
        starts=1,
        elements=StaticsSettings(resolution="coarse", positions=16),
    )
    result = fegear.run(study)
    (warning,) = result.summary["warnings"]
    assert warning.endswith(" um [W28]")
    assert result.summary["reliefs"] == []
    assert any("left out" in part for part in result.page() if isinstance(part, str))
    left_out = result.summary["left_out"]
    assert left_out == ["driver_tip_relief", "driven_tip_relief"]
    written = fegear.make_gear_set(result.tables).meshes[0]
    assert written.driver_flank.tip_relief is written.driven_flank.tip_relief is None


def test_a_relief_that_ends_at_its_limit_is_told():
    study = fegear.ReliefDesign(
        torque=(100.0,), max_relief_um=3.0, starts=1, elements=COARSE
    )
    (warning,) = fegear.run(study).summary["warnings"]
    assert "driven_tip_relief: the magnitude ends at the largest" in warning
    assert warning.endswith("3 um, which --max-relief-um raises [W37]")


def test_symmetric_reliefs_have_one_size_and_the_sum_of_derivatives(contact):
    apart = relief_problem(contact)
    problem = replace(apart, symmetric=True)
    ste, slopes = problem.responses(np.array([8.0, 0.4]))["ste"]
    design = np.array([8.0, 8.0, 0.4, 0.4])
    ste_apart, slopes_apart = apart.responses(design)["ste"]
    np.testing.assert_array_equal(ste, ste_apart)
    np.testing.assert_array_equal(slopes, slopes_apart.reshape(3, 16, 2, 2).sum(-1))
    lengths = [entry.lengths for entry in problem.ranges]
    assert problem.bounds[1] == (lengths[0][0], min(high for _, high in lengths))


def test_the_best_symmetric_relief_is_that_of_a_grid(contact):
    problem = replace(relief_problem(contact), symmetric=True)
    goal = ReliefObjective("largest")
    found = find_best_relief(problem, starting_designs(problem, 5), goal)
    grid = itertools.product(*(np.linspace(*ends, 13) for ends in problem.bounds))
    best = min(goal.of_responses(problem.responses(np.array(x))) for x in grid)
    assert found.value < 1.001 * best


def test_symmetric_reliefs_of_root_and_tip_are_those_of_both_gears():
    study = fegear.ReliefDesign(
        torque=(80.0, 120.0),
        symmetric=True,
        root=True,
        starts=2,
        elements=StaticsSettings(resolution="coarse", positions=16),
    )
    summary = fegear.run(study).summary
    sizes = {}
    for relief in summary["reliefs"]:
        end = relief["relief"].split("_")[1]
        sizes.setdefault(end, []).append(
            (relief["magnitude_um"], relief["length_pitches"])
        )
    assert "tip" in sizes
    for one, other in sizes.values():
        assert one == other
    assert summary["objective_after_um"] < 0.7 * summary["objective_before_um"]


def test_reliefs_without_effect_are_left_out(contact):
    """One too small to count, and one whose mate is refined in its place."""
    problem, objective = relief_problem(contact), ReliefObjective()
    best = find_best_relief(problem, starting_designs(problem, 3), objective)
    both, design, _ = without_idle_features(problem, best.design, objective)
    assert both.ranges == problem.ranges
    np.testing.assert_array_equal(design, best.design)
    alone = best.design * np.array([0.0, 1.0, 1.0, 1.0])
    for size_um in (0.001, 0.1):
        small = alone + np.array([size_um, 0.0, 0.0, 0.0])
        fewer, design, solutions = without_idle_features(problem, small, objective)
        assert [entry.place for entry in fewer.ranges] == ["driven_tip"]
        assert solutions >= 4
        reached = objective.of_responses(fewer.responses(design))
        before = objective.of_responses(problem.responses(small))
        without = replace(problem, ranges=())
        none = objective.of_responses(without.responses(np.empty(0)))
        assert reached <= before + 1e-3 * none


WORDS = st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=8)
PLAIN = (
    st.booleans()
    | st.integers(-(2**62), 2**62)
    | st.floats(allow_nan=False, allow_infinity=False)
    | WORDS
)
KEYS = WORDS.filter(bool)
TABLES = st.recursive(
    st.dictionaries(KEYS, PLAIN | st.lists(PLAIN, max_size=3), max_size=4),
    lambda inner: st.dictionaries(
        KEYS, PLAIN | inner | st.lists(inner, min_size=1, max_size=3), max_size=3
    ),
    max_leaves=6,
)


@settings(max_examples=100, deadline=None)
@given(TABLES)
def test_tables_come_back_from_their_text(tables):
    assert tomllib.loads(toml_text(tables)) == tables


@pytest.mark.slow
def test_helical_gears_have_no_better_relief_on_a_grid():
    """Both gears have the same magnitude and length."""
    gears = make_gear_set(HELICAL)
    torques = np.array([120.0])
    contact = contact_problem(gears, 0, COARSE)
    ranges = relief_ranges(contact, TIPS)
    problem = ReliefProblem(contact, ranges, torques, POSITIONS, 30e-6, symmetric=True)
    best = find_best_relief(problem, starting_designs(problem, 3), ReliefObjective())
    (_, most), (_, longest) = problem.bounds
    sizes = itertools.product(most * np.arange(6) / 5.0, longest * np.arange(1, 6) / 5)
    on_grid = [peak_to_peak(errors(problem, np.array(one)))[0] for one in sizes]
    without = on_grid[0]
    assert best.value <= 1.001 * min(on_grid)
    assert best.value < 0.6 * without
