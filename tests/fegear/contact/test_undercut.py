"""Contact of an undercut pinion against finite elements of whole gears."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import islice

import numpy as np
import pytest
from oracles.relieved_flanks import Flank, closing_way
from whole_contact import ste_of_whole_gears

from fegear.contact.edges import edge_arcs
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.plausibility import gear_set_warnings
from fegear.statics.plausibility import tip_warnings
from fegear.statics.settings import RESOLUTIONS, Resolution, StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.statics.table_warnings import table_warnings
from meshes import MeshSize

TORQUE = 100.0
TABLES = {
    "name": "undercut",
    "plane": "stress",
    "defaults": {"module_mm": 4.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "pinion", "teeth": 12, "hub_radius_mm": 10.0},
        {"name": "wheel", "teeth": 45, "hub_radius_mm": 60.0},
    ],
    "mesh": [{"driver": "pinion", "driven": "wheel", "center_distance_mm": 114.02}],
    "load": {"gear": "pinion", "torques_Nm": [TORQUE]},
}
SIZE = MeshSize(fillet_edges=16)


@lru_cache(maxsize=8)
def solved(resolution="default", positions=64):
    settings = StaticsSettings(
        resolution=resolution, positions=positions, estimate_error=False
    )
    return solve_mesh(make_gear_set(TABLES), 1, [TORQUE], settings)


# one pair; two, of which one leaves; and before, beside and behind the path's start
@pytest.mark.slow
@pytest.mark.parametrize(
    ("position", "pairs"),
    [(0.1, 1), (0.55, 2), (0.4047, 2), (0.4497, 2), (0.4567, 2), (0.4747, 2)],
)
def test_deflection_is_that_of_whole_gears(position, pairs):
    """Under the contact pressure: transmission error less gaps, weighted by loads."""
    solved_ste, ste, touching = ste_of_whole_gears(
        solved().problem, TORQUE, position, SIZE
    )
    assert touching == pairs
    assert solved_ste == pytest.approx(ste, rel=2e-3)


@pytest.mark.slow
def test_mean_transmission_error_converges(monkeypatch):
    """Better than at first order, on the path alone and with contact of the edge."""
    positions = np.arange(64) / 64

    def means(factor):
        nodes = 1 + 2 * round(12 * factor)
        finer = Resolution(MeshSize().refined(factor), nodes)
        monkeypatch.setitem(RESOLUTIONS, "default", finer)
        problem = solved.__wrapped__(positions=1).problem
        on_path = replace(problem, corner_contact=False)
        return [
            solve_cycle(p, [TORQUE], positions).ste.mean() for p in (on_path, problem)
        ]

    best = np.array(means(2.8))
    errors = [np.abs(means(factor) / best - 1.0) for factor in (0.5, 0.71, 1.0)]
    assert np.max(errors) < 2e-3
    assert (np.log2(np.divide(errors[0], errors[2])) > [2.0, 1.5]).all()
    assert (errors[2] < [2e-4, 6e-4]).all()


def test_without_corner_contact_no_pair_touches_below_the_form_circle():
    problem = replace(solved().problem, corner_contact=False)
    cycle = solve_cycle(problem, [TORQUE], np.arange(64) / 64)
    pair = problem.pair
    s1 = pair.pitch_point + pair.base_pitch * np.add.outer(cycle.position, cycle.teeth)
    below = s1 < pair.driver.form_roll_length
    assert below.any()
    assert not cycle.load[0][below].any()
    assert np.isinf(cycle.gap[0][below]).all()
    assert cycle.residual.max() < 1e-10


def test_gap_of_the_edge_is_that_of_the_geometry():
    """Before the path begins, the edge of the undercut touches the mate's flank."""
    problem = solved().problem
    pair, none = problem.pair, np.zeros_like
    flanks = [
        Flank(gear.base_radius, gear.tip_roll_length, gear.form_roll_length, none)
        for gear in (pair.driver, pair.driven)
    ]
    start = pair.path[0]
    positions = start + np.array([-0.25, -0.15, -0.05, -0.01, 0.02, 0.1])
    cycle = solve_cycle(problem, [TORQUE], positions)
    gap = cycle.gap[0][:, cycle.teeth.tolist().index(0)]
    rolls = pair.pitch_point + pair.base_pitch * positions
    exact = [closing_way(*flanks, pair.center_distance, roll) for roll in rolls]
    assert max(exact) > 5e-6
    # the lever of the force at the edge changes while the gap closes
    np.testing.assert_allclose(gap, exact, rtol=1e-3, atol=1e-11)


def test_transmission_error_does_not_jump_where_the_path_begins():
    problem = solved().problem
    positions = problem.pair.path[0] + np.array([-2e-3, -1e-3, 1e-3, 2e-3])
    ste = solve_cycle(problem, [TORQUE], positions).ste[0]
    assert np.ptp(ste) < 5e-3 * ste.mean()
    without = replace(problem, corner_contact=False)
    assert np.ptp(solve_cycle(without, [TORQUE], positions).ste) > 0.3 * ste.mean()


def test_transmission_error_does_not_jump_where_the_edge_meets_the_tip_corner():
    """Before, the mate's tip corner touches the flank above the edge."""
    pair = solved().problem.pair
    passed = -0.316 + np.arange(-12, 13) * 1e-3  # base pitches before the path begins
    cycle = solve_cycle(solved().problem, [TORQUE], pair.path[0] + passed)
    load = cycle.load[0][:, cycle.teeth.tolist().index(0)]
    assert load[0] == 0.0
    assert load[-1] > 0.05 * load.max()
    assert np.abs(np.diff(cycle.ste[0])).max() < 0.1 * cycle.ste.mean()


def test_driver_and_driven_gear_can_change_roles():
    mesh = {"driver": "wheel", "driven": "pinion", "center_distance_mm": 114.02}
    load = {"gear": "wheel", "torques_Nm": [TORQUE * 45 / 12]}
    gears = make_gear_set(TABLES | {"mesh": [mesh], "load": load})
    settings = StaticsSettings(estimate_error=False)
    swapped = solve_mesh(gears, 1, load["torques_Nm"], settings)
    assert swapped.problem.pair.contact_ratio == pytest.approx(
        solved().problem.pair.contact_ratio
    )
    one, two = (result.table["ste_m"][0] for result in (solved(), swapped))
    mirrored = np.roll(two[::-1], 1)  # position p is -p, and the jump moves by one
    assert np.median(np.abs(mirrored / one - 1.0)) < 1e-6


def test_back_flanks_of_an_undercut_gear_touch_alike():
    problem = solved().problem
    positions = np.arange(16) / 16 + 0.01
    back = solve_cycle(problem, [-TORQUE], positions)
    assert back.residual.max() < 1e-10
    assert (back.ste < 0.0).all()


def random_pair(rng):
    """Two gears of which one is undercut, as tables in mesh; None if refused."""
    angle, teeth = rng.uniform(14.5, 25.0), (rng.integers(8, 17), rng.integers(12, 70))
    gears = [
        {
            "name": name,
            "teeth": int(count),
            "profile_shift": rng.uniform(-0.3, 0.3),
            "hub_radius_mm": 0.8 * count,
        }
        for name, count in zip(("pinion", "wheel"), teeth, strict=True)
    ]
    mesh = {"driver": "pinion", "driven": "wheel"}
    mesh["operating_pressure_angle_deg"] = angle + rng.uniform(0.2, 4.0)
    defaults = TABLES["defaults"] | {"pressure_angle_deg": angle}
    try:
        gear_set = make_gear_set(
            TABLES | {"defaults": defaults, "gear": gears, "mesh": [mesh]}
        )
    except InputError:
        return None
    pair = gear_set.meshes[0].pair
    return gear_set if pair.driver.is_undercut or pair.driven.is_undercut else None


@pytest.mark.slow
def test_random_undercut_pairs_have_solutions_that_grow_with_the_torque():
    rng = np.random.default_rng(20261125)
    pairs = (gear_set for _ in range(400) if (gear_set := random_pair(rng)))
    positions = np.arange(16) / 16
    settings = StaticsSettings(resolution="coarse", estimate_error=False, positions=1)
    for gear_set in islice(pairs, 8):
        problem = solve_mesh(gear_set, 1, [TORQUE], settings).problem
        drive = solve_cycle(problem, [0.1 * TORQUE, TORQUE, 3.0 * TORQUE], positions)
        back = solve_cycle(problem, [-TORQUE], positions)
        assert max(drive.residual.max(), back.residual.max()) < 1e-10
        assert (np.diff(drive.ste, axis=0) > 0.0).all()


def test_the_end_of_an_undercut_flank_is_an_edge():
    problem = solved().problem
    edges = edge_arcs(problem)
    assert edges[0][-1] == pytest.approx(problem.pair.driver.flank_length)
    assert edges[1].size == 1


@pytest.mark.parametrize(("torque", "warned"), [(TORQUE, True), (20.0, False)])
def test_a_warning_says_that_the_tip_strikes_the_edge(torque, warned):
    settings = StaticsSettings(resolution="coarse", positions=16, estimate_error=False)
    solution = solve_mesh(make_gear_set(TABLES), 1, [torque], settings)
    strikes = [line for line in table_warnings(solution) if line.endswith("[W36]")]
    assert len(strikes) == warned
    error_um = 1e6 * solution.cycle.ste.max()
    text = (
        f"at a clearance of 7.4 um, which the transmission error of {error_um:.3g} um"
    )
    assert all(text in line for line in strikes)


def test_ordinary_teeth_have_no_edge_to_strike():
    pair = load_gear_set("liu-pair").meshes[0].pair
    assert not list(tip_warnings(1, 100.0, pair, 1e-3))


def test_a_warning_says_how_much_of_the_path_is_lost():
    (line,) = gear_set_warnings(make_gear_set(TABLES))
    assert "contact ratio 1.254" in line
    assert line.endswith("[W27]")
