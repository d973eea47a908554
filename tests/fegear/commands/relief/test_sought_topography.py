"""Topographies that are sought beside reliefs and leads."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from sliced_pairs import WIDTH, problem, slope, wide_roots
from wide_sets import HELICAL

import fegear
from fegear.commands.relief.best_relief import (
    find_best_relief,
    starting_designs,
    without_idle_features,
)
from fegear.commands.relief.objective import ReliefObjective
from fegear.commands.relief.quantities import QUANTITIES
from fegear.commands.relief.relief_problem import (
    ReliefProblem,
    lead_ranges,
    relief_ranges,
)
from fegear.commands.relief.topography_range import topography_range
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import slice_places
from fegear.files.toml import toml_text
from fegear.gearset.edit import edited
from fegear.gearset.modifications import FlankTopography
from fegear.statics.settings import StaticsSettings
from fegear.studies.trains.gear_sets import GearSetRef

COARSE = StaticsSettings(
    resolution="coarse", positions=8, estimate_error=False, root_stress=False
)


def sought_problem(helix_angle_deg, points, gaps=(8e-6,), names=(), places=()):
    contact = problem(helix_angle_deg, corner_contact=False)
    solvers = []
    for depth in gaps:
        gap = slope(depth)(slice_places(WIDTH, contact.solver.slices))
        solvers.append(replace(contact.solver, gap=gap, back_gap=gap))
    return ReliefProblem(
        contact=contact,
        ranges=relief_ranges(contact, places),
        torques=np.array([80.0, 200.0]),
        positions=np.arange(4) / 4.0 + 0.05,
        max_magnitude=20e-6,
        shape="parabolic",
        leads=lead_ranges("driver", names, 20e-6, WIDTH),
        solvers=tuple(solvers),
        quantities=tuple(QUANTITIES),
        roots=wide_roots(helix_angle_deg),
        topography=topography_range(contact, solvers[0], "driver", points, 20e-6),
    )


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_slopes_by_depths_are_those_of_two_solutions(helix_angle_deg):
    sought = sought_problem(helix_angle_deg, (2, 3), names=("crowning",))
    design = np.array([3.0, *np.random.default_rng(4).uniform(1.0, 6.0, 6)])
    solved = sought.responses(design)
    for i in range(1, design.size):
        step = np.zeros(design.size)
        step[i] = 1e-3  # the point of the largest stress changes within more
        above, below = (sought.values(design + sign * step) for sign in (1, -1))
        for name, (_, slopes) in solved.items():
            expected = (above[name] - below[name]) / (2.0 * step[i])
            # roots of loads near 0 have no slope, nor have places that begin to touch
            values = solved[name].values
            counts = (values > 0.2 * values.max()) | (name == "ste")
            ours = np.where(counts, slopes[..., i], expected)
            error = np.abs(ours - expected).max()
            assert error < 1e-4 * np.abs(expected).max(), (name, i)


def test_measured_topographies_have_no_slopes():
    """Of many points they would take long, and are not asked for."""
    grid = FlankTopography(
        roll_lengths=(5e-3, 9e-3), places=(-5e-3, 5e-3), depths=((0.0, 1e-6),) * 2
    )
    contact = problem()
    driver = replace(contact.driver, topography=grid)
    contact = replace(contact, driver=driver)
    cycle = solve_cycle(contact, [80.0], [0.1], with_slopes=True)
    assert cycle.topography_slope.size == 0
    assert cycle.face.load_change.shape[-1] == 0


def test_a_topography_takes_a_misalignment_away():
    """One that is linear over the width is a slope, whose best is known."""
    sought = sought_problem(0.0, (2, 2))
    goal = ReliefObjective("distribution")
    sought = replace(sought, quantities=goal.quantities)
    best = find_best_relief(sought, starting_designs(sought, 2), goal)
    aligned = sought_problem(0.0, (2, 2), (0.0,)).values(np.zeros(4))
    assert best.value <= (1.0 + 1e-3) * goal.of(aligned)
    before = goal.of(sought.values(np.zeros(4)))
    assert best.value < 0.8 * before


def test_an_idle_topography_is_left_out():
    sought = sought_problem(0.0, (2, 2), (0.0,), places=("driver_tip",))
    goal = ReliefObjective("largest")
    sought = replace(sought, quantities=goal.quantities)
    design = np.array([4.0, 0.5, 2.0, 2.0, 2.0, 2.0])  # turned teeth
    fewer, reduced, _ = without_idle_features(sought, design, goal)
    assert fewer.topography is None
    assert reduced.size == 2 * len(fewer.ranges)
    assert goal.of(fewer.values(reduced)) <= 1.01 * goal.of(sought.values(design))


@pytest.mark.slow
def test_no_topography_of_a_grid_is_better():
    """250 of 6 depths at each of 4 points, in the worst of two misalignments."""
    sought = sought_problem(18.0, (2, 2), (-4e-6, 8e-6))
    depths = np.linspace(0.0, 20.0, 6)
    grid = [x for x in itertools.product(depths, repeat=4) if min(x) == 0.0]
    chosen = np.random.default_rng(2).choice(len(grid), 250, replace=False)
    values = [sought.values(np.array(grid[i])) for i in chosen]
    for goal in ("pressure", "root_stress", "largest"):
        objective = ReliefObjective(goal)
        alone = replace(sought, quantities=objective.quantities)
        best = find_best_relief(alone, starting_designs(alone, 5), objective)
        assert best.value <= 1.002 * min(map(objective.of, values)), goal
        assert best.value < 0.98 * objective.of(alone.values(np.zeros(4))), goal


def test_the_written_gear_set_has_what_is_shown(tmp_path):
    file = tmp_path / "helical.toml"
    existing = {"mesh.1.driver_topography": {"bias_um": 9.0}}
    file.write_text(toml_text(edited(HELICAL, existing)))
    study = fegear.ReliefDesign(
        gear_set=GearSetRef(name=str(file)),
        torque=(120.0,),
        misalignment_um=(8.0,),
        topography=(2, 3),
        max_topography_um=7.0,
        objective="pressure",
        tip=False,
        starts=1,
        elements=COARSE,
    )
    result = fegear.run(study)
    result.write(tmp_path / "best.toml")
    assert result.after < 0.95 * result.before
    table = dict(result.summary["topography"])
    assert table.pop("topography") == "driver_topography"
    depths = np.array(table["depth_um"])
    assert depths.shape == (2, 3)
    assert depths.min() == 0.0
    assert depths.max() <= 7.0 + 1e-9
    edits = {"mesh.1.misalignment_um": 8.0}
    gears = fegear.load_gear_set(tmp_path / "best.toml", edits)
    ours = gears.meshes[0].driver_flank.topography
    assert 1e6 * np.array(ours.depths) == pytest.approx(depths)
    assert gears.meshes[0].driven_flank.topography is None
    (figures,) = fegear.solve_mesh(gears, 1, [120.0], COARSE).key_figures
    after = figures["max_pressure_plane_strain_MPa"]
    assert result.summary["objective_after_MPa"] == pytest.approx(after, rel=1e-8)
    page = [part for part in result.page() if hasattr(part, "columns")]
    assert len(page[0].columns) == 1 + 3
    for draw in result.figures.values():
        draw().savefig(tmp_path / "plot.png")
