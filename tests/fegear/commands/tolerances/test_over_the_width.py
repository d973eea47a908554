"""Tolerances of gears whose loads vary over the face width."""

from __future__ import annotations

import math

import numpy as np
import pytest
from wide_sets import HELICAL

import fegear
from fegear.commands.tolerances.deviations import (
    AXES,
    CENTER,
    DISTRIBUTION,
    HELIX,
    MEAN_STIFFNESS,
    PEAK_TO_PEAK,
    ToleranceProblem,
    linear_contact,
    sources_of,
)
from fegear.commands.tolerances.grades import helix_tolerances, tolerances_of_pair
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.files.toml import toml_text
from fegear.gearset import make_gear_set
from fegear.gearset.edit import edited
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from fegear.studies.trains.gear_sets import GearSetRef

COARSE = StaticsSettings(resolution="coarse", positions=4, root_stress=False)
TORQUE, POSITION = 80.0, np.arange(4) / 4.0
SOURCES = sources_of(over_width=True)
LIMITS = dict.fromkeys(SOURCES, 4e-6) | {CENTER: 15e-6}


@pytest.fixture(scope="module")
def contact():
    return contact_problem(make_gear_set(HELICAL), 0, COARSE)


def problem_of(contact, scale=1.0):
    limits = {name: scale * limit for name, limit in LIMITS.items()}
    return ToleranceProblem(contact, TORQUE, POSITION, limits)


def test_one_pair_of_gears_is_that_of_a_gear_set_file(contact):
    """All deviations of a sample, in a file for `stiffness`."""
    problem = problem_of(contact)
    deviations = 1e-6 * np.round(1e6 * problem.sample(2, seed=3), 3)
    deviations[:, problem.variables.index(CENTER)] = 0.0
    solved = problem.solve(deviations)
    values = problem.quantities(solved.ste, solved.no_load, solved.distribution)
    angle = contact.pair.operating_pressure_angle
    for i, row in enumerate(deviations):
        um = dict(zip(problem.variables, 1e6 * row, strict=True))
        in_plane, out = (um[name] for name in AXES)
        gap = in_plane * math.sin(angle) + out * math.cos(angle)
        edits = {"mesh.1.misalignment_um": gap}
        errors = problem.tooth_errors(row[None, :])
        gears = contact.pair.driver, contact.pair.driven
        for number, (role, gear) in enumerate(
            zip(("driver", "driven"), gears, strict=True)
        ):
            for kind, table in (("profile", "profile"), ("helix", "lead")):
                key = f"mesh.1.{role}_{table}"
                edits[f"{key}.slope_um"] = um[f"{role}_{kind}_slope"]
                edits[f"{key}.crowning_um"] = um[f"{role}_{kind}_form"]
            pitch = np.zeros(gear.teeth)
            pitch[-problem.teeth % gear.teeth] = 1e6 * errors[number][0]
            edits[f"gear.{number + 1}.pitch_errors_um"] = pitch.tolist()
        changed = make_gear_set(edited(HELICAL, edits))
        cycle = solve_cycle(contact_problem(changed, 0, COARSE), TORQUE, POSITION)
        np.testing.assert_allclose(solved.ste[i], cycle.ste[0], rtol=1e-9)
        for name, expected in (
            (MEAN_STIFFNESS, cycle.stiffness.mean()),
            (PEAK_TO_PEAK, np.ptp(cycle.ste)),
            (DISTRIBUTION, cycle.face.distribution_factor[0]),
        ):
            assert values[name][i] == pytest.approx(expected, rel=1e-7), name


def test_small_deviations_are_linear(contact):
    """What one contact solution gives, and what solutions give."""
    problem = problem_of(contact, 0.02)
    linear = linear_contact(problem)
    assert linear.derivative_error < 0.02
    deviations = problem.sample(3, seed=1)
    solved = problem.solve(deviations)
    ste, _, distribution = linear.solve(deviations)
    assert np.abs(ste - solved.ste).max() < 0.02 * np.abs(solved.ste - linear.ste).max()
    change = np.abs(solved.distribution - linear.distribution).max()
    assert np.abs(distribution - solved.distribution).max() < 0.02 * change


def test_the_same_gap_has_the_same_slope(contact):
    """A helix slope of either gear, and axes out of parallel."""
    problem = problem_of(contact, 0.1)
    slopes = dict(
        zip(
            problem.variables, linear_contact(problem).distribution_slope.T, strict=True
        )
    )
    driver, driven, in_plane, out = (slopes[name] for name in (*HELIX[:2], *AXES))
    largest, angle = np.abs(driver).max(), contact.pair.operating_pressure_angle
    assert driven == pytest.approx(driver, abs=0.01 * largest)
    for axes, part in ((in_plane, math.sin(angle)), (out, math.cos(angle))):
        assert axes == pytest.approx(part * driver, abs=0.01 * largest)


def test_tolerances_computed_by_hand():
    """25 teeth of 3 mm at 20 degrees: d = 79.81 mm; b = 30 mm, grade 6."""
    tables = HELICAL | {
        "defaults": HELICAL["defaults"]
        | {"helix_angle_deg": 20.0, "face_width_mm": 30.0}
    }
    pair = make_gear_set(tables).meshes[0].pair
    limits = helix_tolerances(pair.driven, 30e-3, 6)
    d, b = 75.0 / math.cos(math.radians(20.0)), 30.0
    by_hand = [0.05 * d**0.5 + 0.35 * b**0.5 + 4.0, 0.07 * d**0.5 + 0.45 * b**0.5 + 4.0]
    # 9.001 and 10.027, rounded to halves and to whole micrometres
    assert [2**0.5 * value for value in by_hand] == pytest.approx(
        [9.0, 10.03], abs=0.01
    )
    assert (limits.helix_slope, limits.helix_form) == pytest.approx((9e-6, 10e-6))
    names = "single_pitch", "profile_slope", "profile_form", "center_distance"
    amounts = dict.fromkeys([*names, "helix_slope", "helix_form", *AXES])
    every = tolerances_of_pair(pair, (6, 6), amounts, (30e-3, 30e-3))
    assert every["axes_in_plane"] == pytest.approx(math.hypot(9e-6, 10e-6))
    assert every["axes_out_of_plane"] == pytest.approx(0.5 * every["axes_in_plane"])
    stated = tolerances_of_pair(pair, (6, 6), dict.fromkeys(amounts, 2.0), (0.1, 0.1))
    assert set(stated.values()) == {2e-6}


def test_a_study_has_the_band_of_the_distribution_factor(tmp_path):
    path = tmp_path / "helical.toml"
    path.write_text(toml_text(HELICAL))
    study = fegear.Tolerances(
        gear_set=GearSetRef(name=str(path)), torque=TORQUE, samples=10, elements=COARSE
    )
    result = fegear.run(study)
    rows = {row["quantity"]: row for row in result.summary["quantities"]}
    assert rows[DISTRIBUTION]["p95"] > rows[DISTRIBUTION]["p05"] >= 1.0
    shares = {
        row["source"]: row[f"share_of_{DISTRIBUTION}"]
        for row in result.summary["tolerances"]
    }
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["driver_helix_slope"] > 10.0 * shares["driver_profile_slope"]
    for draw in result.figures.values():
        draw().savefig(tmp_path / "bands.png")


def test_what_is_of_the_width_is_refused_of_uniform_loads():
    study = fegear.Tolerances(helix_slope_um=5.0)
    with pytest.raises(InputError, match="helix_slope_um = 5; needs loads that vary"):
        fegear.run(study)
