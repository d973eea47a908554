"""Leads that are sought beside reliefs, and objectives over the face width."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from cli_commands import refused
from scipy.optimize import minimize
from sliced_pairs import WIDTH, problem, slope, wide_roots
from wide_sets import HELICAL

import fegear
from fegear.commands.relief.best_relief import find_best_relief, starting_designs
from fegear.commands.relief.objective import (
    QUANTITY_OF,
    ReliefObjective,
    Term,
    linear_step,
)
from fegear.commands.relief.quantities import QUANTITIES, SlopedValues
from fegear.commands.relief.relief_problem import (
    ReliefProblem,
    lead_ranges,
    relief_ranges,
)
from fegear.commands.relief.study import _parsed_misalignments
from fegear.contact.width.contact import slice_places
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset.edit import edited
from fegear.statics.settings import StaticsSettings
from fegear.studies.trains.gear_sets import GearSetRef

OVER_WIDTH = "pressure", "line_load", "distribution"
COARSE = StaticsSettings(
    resolution="coarse", positions=8, estimate_error=False, root_stress=False
)


def misaligned(contact, depth):
    """The solver of a pair whose axes are misaligned."""
    gap = slope(depth)(slice_places(WIDTH, contact.solver.slices))
    return replace(contact.solver, gap=gap, back_gap=gap)


def lead_problem(helix_angle_deg, names, gaps=(8e-6,), positions=4, places=()):
    contact = problem(helix_angle_deg, corner_contact=False)
    return ReliefProblem(
        contact=contact,
        ranges=relief_ranges(contact, places),
        torques=np.array([80.0, 200.0]),
        positions=np.arange(positions) / positions + 0.05,
        max_magnitude=20e-6,
        shape="parabolic",
        leads=lead_ranges("driver", names, 20e-6, WIDTH),
        solvers=tuple(misaligned(contact, gap) for gap in gaps),
        quantities=tuple(QUANTITIES),
        roots=wide_roots(helix_angle_deg),
    )


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_slopes_of_all_quantities_are_those_of_two_solutions(helix_angle_deg):
    """Reliefs to some per cent, as places of contact move with them, leads to 1 %."""
    sought = lead_problem(
        helix_angle_deg, ("crowning", "slope", "end_relief"), places=("driver_tip",)
    )
    design = np.array([6.0, 0.4, 5.0, -4.0, 4.0, 6.0])
    solved = sought.responses(design)
    for i in range(design.size):
        step = np.zeros(design.size)
        step[i] = 1e-3 if i == 1 else 1e-2
        above, below = (sought.values(design + sign * step) for sign in (1, -1))
        for name, (_, slopes) in solved.items():
            expected = (above[name] - below[name]) / (2.0 * step[i])
            # roots of loads near 0 have no slope, nor have places that begin to touch
            values = solved[name].values
            counts = (values > 0.2 * values.max()) | (name == "ste")
            ours = np.where(counts, slopes[..., i], expected)
            tolerance = (0.05, 0.08, *4 * (0.01,))[i]
            error = np.abs(ours - expected).max()
            assert error < tolerance * np.abs(expected).max(), (name, i)


def test_cases_are_misalignments_of_all_torques():
    gaps = -8e-6, 0.0, 8e-6
    sought = lead_problem(0.0, ("slope",), gaps)
    values = sought.values(np.array([3.0]))["distribution"]
    for i, gap in enumerate(gaps):
        alone = lead_problem(0.0, ("slope",), (gap,)).values(np.array([3.0]))
        expected = alone["distribution"]
        assert (values[2 * i : 2 * i + 2] == expected).all()


def random_responses(seed, sizes=3):
    random = np.random.default_rng(seed)
    return {
        name: SlopedValues(
            1.0 + 0.3 * random.random((2, 12)), random.normal(size=(2, 12, sizes))
        )
        for name in QUANTITIES
    }


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("goals", [("distribution",), ("largest", "pressure"), "all"])
def test_the_step_of_several_terms_is_that_of_another_solver(seed, goals):
    if goals == "all":
        goals = tuple(QUANTITY_OF)
    scales = dict(zip(goals, 1.0 + np.arange(len(goals)), strict=True))
    others = tuple(Term(name, scales[name]) for name in goals[1:])
    goal = ReliefObjective(goals[0], scale=scales[goals[0]], others=others)
    quantities = random_responses(seed)
    limits = np.full(3, -0.1), np.full(3, 0.1)
    step, value = linear_step(quantities, limits, goal)
    assert (np.abs(step) <= 0.1 + 1e-9).all()
    # harmonics within CUT_RTOL
    assert value == pytest.approx(goal.of_linear(quantities, step), rel=1e-3)
    starts = np.random.default_rng(seed).uniform(-0.1, 0.1, (12, 3))
    least = min(
        minimize(
            lambda x: goal.of_linear(quantities, x),
            start,
            method="Nelder-Mead",
            bounds=[(-0.1, 0.1)] * 3,
            options={"xatol": 1e-8, "fatol": 1e-10, "maxiter": 4000},
        ).fun
        for start in starts
    )
    assert value <= least * (1.0 + 1e-3)


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_a_slope_takes_a_misalignment_away(helix_angle_deg):
    """Both are the same gap, so that the best slope is known."""
    sought = lead_problem(helix_angle_deg, ("slope",))
    sought = replace(sought, quantities=("distribution",))
    goal = ReliefObjective("distribution")
    best = find_best_relief(sought, starting_designs(sought, 2), goal)
    if not helix_angle_deg:
        assert best.design[0] == pytest.approx(-8.0, abs=0.05)
        assert best.value == pytest.approx(
            goal.of(lead_problem(0.0, ("slope",), (0.0,)).values(np.zeros(1))), rel=1e-3
        )
    before = goal.of(sought.values(np.zeros(1)))
    assert best.value < 0.8 * before


@pytest.mark.slow
def test_no_crowning_and_slope_of_a_grid_is_better():
    """A grid of 400 designs, in the worst of three misalignments, for every goal."""
    sought = lead_problem(18.0, ("crowning", "slope"), (-4e-6, 2e-6, 8e-6))
    grid = itertools.product(*(np.linspace(*ends, 20) for ends in sought.bounds))
    values, none = [sought.values(np.array(x)) for x in grid], np.zeros(2)
    for goal in (*OVER_WIDTH, "root_stress", "largest"):
        objective = ReliefObjective(goal)
        alone = replace(sought, quantities=objective.quantities)
        best = find_best_relief(alone, starting_designs(alone, 5), objective)
        assert best.value <= 1.002 * min(map(objective.of, values)), goal
        assert best.evaluations < 100, goal
        assert best.value < 0.95 * objective.of(alone.values(none)), goal


@pytest.fixture
def helical(tmp_path):
    """A file of helical gears whose lead, of both, is in one table."""
    lead = {"crowning_um": 6.0, "slope_um": 9.0}
    path = tmp_path / "helical.toml"
    path.write_text(toml_text(edited(HELICAL, {"mesh.1.lead": lead})))
    return path


def test_the_written_gear_set_has_what_is_shown(helical, tmp_path):
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name=str(helical)),
        torque=(60.0, 120.0),
        misalignment_um=(-6.0, 6.0),
        lead=("crowning", "end_relief"),
        objective="distribution",
        also=(("largest", 0.1),),
        tip=False,
        starts=1,
        elements=COARSE,
    )
    result = fegear.run(study)
    result.write(tmp_path / "best.toml")
    summary = result.summary
    assert summary["objective_after"] < summary["objective_before"]
    assert [row["misalignment_um"] for row in result.rows] == [-6.0, -6.0, 6.0, 6.0]
    # the slope of both flanks together is a misalignment, and stays one
    written = fegear.load_gear_set(tmp_path / "best.toml").meshes[0]
    assert written.misalignment == pytest.approx(9e-6)
    driver, driven = (flank.lead for flank in written.flanks)
    assert driven.crowning == pytest.approx(6e-6)
    sizes = {row["lead"]: row["size_um"] for row in summary["leads"]}
    of_driver = 0.0 if driver is None else driver.crowning
    assert 1e6 * of_driver == pytest.approx(sizes.get("driver_lead.crowning", 0.0))
    for row in result.rows:
        edits = {"mesh.1.misalignment_um": row["misalignment_um"]}
        gears = fegear.load_gear_set(tmp_path / "best.toml", edits)
        solved = fegear.solve_mesh(gears, 1, [row["torque_Nm"]], COARSE)
        (figures,) = solved.key_figures
        for ours, theirs in (
            ("load_distribution_factor_after", "load_distribution_factor"),
            ("pressure_after_MPa", "max_pressure_plane_strain_MPa"),
            ("after_um", "ste_peak_to_peak_um"),
        ):
            assert row[ours] == pytest.approx(figures[theirs], rel=1e-8), ours
    names = result.more_tables["torques"].names
    assert names[-1] == "pressure_after_Pa"
    for values, row in zip(
        result.more_tables["torques"].rows(), result.rows, strict=True
    ):
        by_name = dict(zip(names, values, strict=True))
        assert by_name["misalignment_m"] == pytest.approx(1e-6 * row["misalignment_um"])
        load = by_name["line_load_after_N_per_m"]
        assert load == pytest.approx(1e3 * row["line_load_after_N_per_mm"])
    for name, draw in result.figures.items():
        draw().savefig(tmp_path / f"{name}.png")


def test_spur_gears_have_leads_where_they_are_sought():
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name="liu-pair"),
        torque=(100.0,),
        misalignment_um=(8.0,),
        lead=("slope",),
        max_lead_um=5.0,
        objective="pressure",
        tip=False,
        starts=1,
        elements=replace(COARSE, plane="width"),
    )
    result = fegear.run(study)
    (lead,) = result.summary["leads"]
    assert lead["size_um"] == pytest.approx(-5.0, abs=0.01)
    # one misalignment is shown, as the gear set keeps its own
    assert [row["misalignment_um"] for row in result.rows] == [8.0]
    # a plane in which the written gear set can be solved
    assert result.tables["plane"] == "width"
    (warning,) = (text for text in result.summary["warnings"] if "W37" in text)
    assert "driver_lead.slope: the depth ends at the largest allowed, 5 um" in warning


@pytest.mark.slow
def test_root_stress_is_that_of_the_written_gear_set(helical, tmp_path):
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name=str(helical)),
        torque=(60.0, 120.0),
        misalignment_um=(-6.0, 6.0),
        lead=("crowning", "slope"),
        objective="root_stress",
        tip=False,
        starts=1,
        elements=COARSE,
    )
    result = fegear.run(study)
    result.write(tmp_path / "best.toml")
    assert result.after < 0.98 * result.before
    settings = replace(COARSE, root_stress=True)
    largest = []
    for row in result.rows:
        edits = {"mesh.1.misalignment_um": row["misalignment_um"]}
        for when, file in (("before", helical), ("after", tmp_path / "best.toml")):
            more = {"mesh.1.lead.slope_um": 0.0} if when == "before" else {}
            gears = fegear.load_gear_set(file, more | edits)
            solved = fegear.solve_mesh(gears, 1, [row["torque_Nm"]], settings)
            names = "driver_root_stress_MPa", "driven_root_stress_MPa"
            stress = max(solved.key_figures[0][name] for name in names)
            assert row[f"root_stress_{when}_MPa"] == pytest.approx(stress, rel=1e-8)
        largest.append(stress)
    assert result.summary["objective_after_MPa"] == pytest.approx(max(largest))
    titles = {title for part in result.page() for title in getattr(part, "columns", ())}
    assert "root stress\nafter [MPa]" in titles
    table = result.more_tables["torques"]
    assert list(table.names[-2:]) == ["root_stress_before_Pa", "root_stress_after_Pa"]


REFUSED = [
    ({"objective": "pressure"}, "needs loads that vary over the face width"),
    ({"objective": "root_stress"}, "objective = root_stress; needs loads that vary"),
    ({"also": (("root_stress", 1.0),)}, "objective = root_stress; needs loads that"),
    ({"tip": False}, "tip = off; a relief, a lead or a topography must be sought"),
    ({"topography": (3, 3)}, "plane = stress; must be width"),
    ({"lead": ("slope",)}, "plane = stress; must be width"),
    ({"compromises": 3, "also": (("mean", 1.0),)}, "compromises = 3; are those of"),
]
WORDS = [
    ("--misalignment-um=a:b", "must be A:B with A below B"),
    ("--misalignment-um=5:-5", "must be A:B with A below B"),
    ("--misalignment-um=nan", "must be A:B with A below B"),
    ("--misalignment-um=1,1", "must have each misalignment once"),
    ("--also=mean=1,mean=2", "must have each objective once"),
    ("--misalignment-um=0:5:0", "STEP must be above 0"),
    ("--also=mean=0", "weights must be above 0"),
    ("--topography=3", "must be KxL, such as 3x4, with 2 to 8 points"),
    ("--topography=3x9", "must be KxL, such as 3x4, with 2 to 8 points"),
    ("--topography=1x3", "must be KxL, such as 3x4, with 2 to 8 points"),
    ("--lead=slope,slope", "must be crowning, slope, end_relief, each once"),
]


def test_an_aligned_pair_in_a_range_is_in_slices_as_the_others(tmp_path):
    """So that what is before and after is of one kind, and K_Hbeta is shown."""
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name="liu-pair"),
        torque=(100.0,),
        misalignment_um=(-4.0, 0.0, 4.0),
        tip=False,
        lead=("crowning",),
        objective="distribution",
        starts=1,
        elements=replace(COARSE, plane="width"),
    )
    result = fegear.run(study)
    assert result.after < result.before
    before = [row["load_distribution_factor_before"] for row in result.rows]
    assert max(before) == pytest.approx(result.before)
    assert before[0] == pytest.approx(before[2], rel=1e-3)
    assert before[1] < before[0]


def test_compromises_are_of_the_peak_to_peak(helical):
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name=str(helical)),
        torque=(60.0, 120.0),
        compromises=3,
        objective="distribution",
        elements=COARSE,
    )
    with pytest.raises(InputError, match="compromises = 3; are those of the peak"):
        fegear.run(study)


@pytest.mark.parametrize(("word", "message"), WORDS)
def test_words_that_are_refused(capsys, word, message):
    assert message in refused(capsys, "relief", "liu-pair", word)


def test_a_range_has_its_middle():
    assert _parsed_misalignments("-15:5") == (-15.0, -5.0, 5.0)
    assert _parsed_misalignments("3,-1") == (3.0, -1.0)
    assert _parsed_misalignments("-15:15:10") == (-15.0, -5.0, 5.0, 15.0)


@pytest.mark.parametrize(("settings", "message"), REFUSED)
def test_refusals_before_anything_is_solved(settings, message, monkeypatch):
    study = fegear.ReliefDesign(torque=(60.0, 100.0), **settings)
    monkeypatch.setattr("fegear.contact.solve._solve_flanks", None)
    with pytest.raises(InputError, match=message):
        fegear.run(study)
