"""Gears within their tolerances: contact, derivatives, distribution, first order."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest, truncnorm, uniform

import fegear
from fegear.commands.tolerances.bands import (
    band_error,
    contact_ratio,
    peak_to_peak_without,
    total_effects,
)
from fegear.commands.tolerances.deviations import (
    CENTER,
    MEAN_STIFFNESS,
    PEAK_TO_PEAK,
    LinearContact,
    ToleranceProblem,
    linear_contact,
    sources_of,
    std_over_limit,
    ste_derivatives,
    unit_deviates,
)
from fegear.commands.tolerances.variants import Variants, solve_variants, with_profiles
from fegear.contact.solve import solve_cycle
from fegear.files.store import CheckpointOptions
from fegear.gearset.modifications import FlankProfile
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from meshes import GearPair

COARSE = StaticsSettings(resolution="coarse", positions=16)
POSITION = np.arange(16) / 16
TORQUE = 100.0
SOURCES = sources_of(over_width=False)
LIMITS = dict(
    zip(SOURCES, (7e-6, 7.5e-6, 9e-6, 9e-6, 17.5e-6, 8.5e-6, 8.5e-6), strict=True)
)


RING = """
name = "planet-ring"
defaults = { module_mm = 2.0, face_width_mm = 20.0, tooth_thinning_um = 40 }
mesh = [{ driver = "planet", driven = "ring", center_distance_mm = 60.0 }]
load = { gear = "planet", torques_Nm = [100.0] }

[[gear]]
name = "planet"
teeth = 36
hub_radius_mm = 20.0

[[gear]]
name = "ring"
teeth = 96
internal = true
rim_radius_mm = 108.0
tip_radius_mm = 94.3
"""


@pytest.fixture(scope="module")
def contact():
    return contact_problem(fegear.load_gear_set("liu-pair"), 0, COARSE)


RING_DRIVES = RING.replace(
    'driver = "planet", driven = "ring"', 'driver = "ring", driven = "planet"'
).replace('gear = "planet"', 'gear = "ring"')


@pytest.fixture(scope="module", params=["liu-pair", "planet-ring", "ring-planet"])
def gears_name(request, tmp_path_factory):
    """The name of an external pair, the file of a planet in a ring, of its reverse."""
    if request.param == "liu-pair":
        return request.param
    path = tmp_path_factory.mktemp("ring") / "ring.toml"
    path.write_text(RING if request.param == "planet-ring" else RING_DRIVES)
    return str(path)


@pytest.fixture(scope="module")
def any_contact(gears_name):
    return contact_problem(fegear.load_gear_set(gears_name), 0, COARSE)


def problem_of(contact, scale=1.0, distribution="normal", only=SOURCES):
    limits = {name: scale * LIMITS[name] * (name in only) for name in SOURCES}
    return ToleranceProblem(contact, TORQUE, POSITION, limits, distribution)


def test_one_pair_of_gears_is_that_of_a_gear_set_file(any_contact, gears_name):
    """Slopes, crowning and pitch errors of a sample, in a file for `stiffness`."""
    contact = any_contact
    problem = problem_of(contact)
    deviations = 1e-6 * np.round(1e6 * problem.sample(3, seed=5), 3)
    deviations[:, problem.variables.index(CENTER)] = 0.0
    solved = problem.solve(deviations)
    values = problem.quantities(solved.ste, solved.no_load, solved.distribution)
    teeth = contact.pair.driver.teeth, contact.pair.driven.teeth
    numbers = [gear + 1 for gear in fegear.load_gear_set(gears_name).meshes[0].gears]
    for i, row in enumerate(deviations):
        edits = {}
        errors = problem.tooth_errors(row[None, :])
        roles = zip(("driver", "driven"), teeth, errors, strict=True)
        for gear, (role, count, error) in enumerate(roles):
            sizes_um = np.round(1e6 * row[[gear, 2 + gear]], 3).tolist()
            edits[f"mesh.1.{role}_profile.slope_um"] = sizes_um[0]
            edits[f"mesh.1.{role}_profile.crowning_um"] = sizes_um[1]
            pitch = np.zeros(count)
            pitch[-problem.teeth % count] = 1e6 * error[0]
            edits[f"gear.{numbers[gear]}.pitch_errors_um"] = pitch.tolist()
        gears = fegear.load_gear_set(gears_name, edits)
        cycle = solve_cycle(contact_problem(gears, 0, COARSE), TORQUE, POSITION)
        np.testing.assert_allclose(solved.ste[i], cycle.ste[0], rtol=1e-9)
        stiffness = values[MEAN_STIFFNESS][i]
        assert stiffness == pytest.approx(cycle.stiffness.mean(), rel=1e-9)
        assert values[PEAK_TO_PEAK][i] == pytest.approx(np.ptp(cycle.ste), rel=1e-9)


@pytest.mark.parametrize("increase", [-20e-6, 15e-6])
def test_another_centre_distance_is_another_pair(any_contact, increase):
    """Of flanks that stay as they are, with a compliance that stays as it is."""
    contact = any_contact
    none = np.zeros((1, 2))
    moved = Variants(none, none, np.zeros((1, 4)), np.array([increase]))
    solved = solve_variants(contact, TORQUE, POSITION, moved)
    pair = contact.pair
    distance = pair.center_distance + increase
    there = replace(contact, pair=GearPair(pair.driver, pair.driven, distance))
    cycle = solve_cycle(with_profiles(there), TORQUE, POSITION)
    np.testing.assert_allclose(solved.ste, cycle.ste, rtol=1e-9)
    assert contact_ratio(pair, increase) == pytest.approx(there.pair.contact_ratio)


def test_backlash_of_a_ring_falls_as_the_centres_move_apart(gears_name):
    study = study_of(gear_set=gears_name)
    bands = fegear.run(study).bands
    pair = fegear.load_gear_set(gears_name).meshes[0].pair
    step = 1e-6
    there = GearPair(pair.driver, pair.driven, pair.center_distance + step)
    slope = (there.backlash - pair.backlash) / step
    assert bands.backlash_slope == pytest.approx(slope, rel=1e-3)
    assert (slope < 0.0) == pair.is_internal


def test_the_nominal_pair_is_that_of_the_contact_problem(contact):
    solved = problem_of(contact).solve(np.zeros((2, 11)))
    expected = solve_cycle(with_profiles(contact), TORQUE, POSITION)
    np.testing.assert_allclose(solved.ste[0], expected.ste[0], rtol=1e-12)
    np.testing.assert_array_equal(solved.ste[0], solved.ste[1])
    np.testing.assert_allclose(solved.load[0], expected.load[0], rtol=1e-9)
    np.testing.assert_allclose(solved.no_load[0], expected.no_load[0], atol=1e-15)


@pytest.mark.parametrize("source", [s for s in SOURCES if s != CENTER])
def test_derivatives_of_the_contact_solution_are_those_of_differences(
    any_contact, source
):
    """But for the turn of the normal, which they leave out."""
    problem = problem_of(any_contact)
    index = problem.variables.index(source) + source.endswith("pitch")
    slope = ste_derivatives(problem)[:, index]
    step, deviations = 1e-9, np.zeros((2, len(problem.variables)))
    deviations[:, index] = step, -step
    ends = problem.solve(deviations).ste
    difference = (ends[0] - ends[1]) / (2.0 * step)
    assert np.abs(slope - difference).max() < 0.02 * np.abs(slope).max()


def test_profiles_without_size_have_derivatives(contact):
    cycle = solve_cycle(contact, TORQUE, POSITION, with_slopes=True)
    assert cycle.profile_slope.shape[1] == POSITION.size
    assert not cycle.profile_slope.any()
    one = with_flanks(contact, driven_profile=FlankProfile())
    slopes = solve_cycle(one, TORQUE, POSITION, with_slopes=True).profile_slope
    assert not slopes[:, :, 0].any()
    assert (slopes[:, :, 1, 0] > 0.0).all()
    assert (slopes[:, :, 1, 1] < 0.0).all()


def test_teeth_add_up_pitch_deviations(contact):
    """Every step between teeth that follow each other is one single pitch deviation."""
    problem = problem_of(contact)
    deviations = problem.sample(1, seed=2)
    errors, _ = problem.tooth_errors(deviations)
    order = np.argsort(-problem.teeth)
    pitch = deviations[0, 5 : 5 + problem.teeth.size - 1]
    np.testing.assert_allclose(np.diff(errors[0, order]), pitch, atol=1e-20)
    assert errors[0, list(problem.teeth).index(0)] == 0.0


@pytest.mark.parametrize("distribution", ["normal", "uniform"])
def test_deviates_are_distributed_as_stated(distribution):
    deviates = unit_deviates(distribution, (20_000, 1), seed=3).ravel()
    exact = truncnorm(-3.0, 3.0, scale=1 / 3) if distribution == "normal" else None
    exact = exact or uniform(-1.0, 2.0)
    assert np.abs(deviates).max() <= 1.0
    assert kstest(deviates, exact.cdf).pvalue > 0.01
    assert std_over_limit(distribution) == pytest.approx(exact.std(), rel=1e-9)


def test_longer_samples_begin_with_shorter_ones(contact):
    problem = problem_of(contact)
    np.testing.assert_array_equal(problem.sample(9, 1)[:4], problem.sample(4, 1))


def linear_of(contact, problem, slopes):
    """A linear contact whose transmission error has two positions."""
    ste = np.array([20e-6, 10e-6])
    gaps = np.zeros((2, 1)), np.zeros((2, 1, len(problem.variables)))
    return LinearContact(
        ste=ste,
        gap=gaps[0],
        distribution=np.empty(0),
        ste_slope=np.array([slopes, 0.0 * slopes]),
        gap_slope=gaps[1],
        distribution_slope=np.empty((0, slopes.size)),
        derivative_error=0.0,
    )


def test_quantiles_of_a_linear_case_are_those_of_theory(contact):
    """Peak to peak of two positions, one of which moves: a normal distribution."""
    problem = problem_of(contact)
    slopes = np.linspace(-0.3, 0.4, len(problem.variables))
    linear = linear_of(contact, problem, slopes)
    solved = linear.solve(problem.sample(40_000, 7))
    values = problem.quantities(*solved)[PEAK_TO_PEAK]
    std = np.linalg.norm(slopes * problem.std)
    assert values.std() == pytest.approx(std, rel=0.02)
    for probability, z in ((5, -1.645), (95, 1.645)):
        quantile = np.percentile(values, probability)
        assert quantile == pytest.approx(10e-6 + z * std, abs=0.04 * std)


def test_parts_of_the_variance_of_a_linear_case(contact):
    problem = problem_of(contact)
    slopes = np.linspace(-0.3, 0.4, len(problem.variables))
    linear = linear_of(contact, problem, slopes)
    effects = total_effects(problem, linear, 20_000, 1)[PEAK_TO_PEAK]
    parts = (slopes * problem.std) ** 2
    sources = np.array(problem.variables)
    for source in SOURCES:
        exact = parts[sources == source].sum() / parts.sum()
        assert effects[source] == pytest.approx(exact, abs=0.02)
    without = peak_to_peak_without(problem, linear, 20_000, 1)
    for source in SOURCES:
        rest = np.sqrt(parts[sources != source].sum())
        assert without[source] == pytest.approx(10e-6 + 1.645 * rest, rel=0.01)


def test_the_first_order_becomes_exact_as_the_scatter_vanishes(contact):
    """Its error is of second order in the scatter, in the band of first order."""
    scales, errors = (0.2, 0.1, 0.05), []
    for scale in scales:
        problem = problem_of(contact, scale, only=SOURCES[-2:])
        deviations = problem.sample(60, 4)
        solved = problem.solve(deviations).ste
        linear = linear_contact(problem).solve(deviations)[0]
        errors.append(np.sqrt(np.mean((solved - linear) ** 2)))
    order = np.polyfit(np.log(scales), np.log(errors), 1)[0]
    assert order > 1.5


def test_bands_agree_at_small_scatter(contact):
    problem = problem_of(contact, 0.1)
    deviations = problem.sample(400, 1)
    solved = problem.solve(deviations)
    values = problem.quantities(solved.ste, solved.no_load, solved.distribution)
    linear = problem.quantities(*linear_contact(problem).solve(deviations))
    for name, value in values.items():
        assert band_error(value, linear[name]) < 0.03, name


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.05, 1.0))
def test_pairs_of_gears_do_not_depend_on_their_company(contact, seed, scale):
    problem = problem_of(contact, scale)
    deviations = problem.sample(3, seed)
    together = problem.solve(deviations)
    alone = problem.solve(deviations[2:])
    np.testing.assert_array_equal(together.ste[2], alone.ste[0])
    assert (together.load >= 0.0).all()
    total = together.load.sum(axis=2)
    force = problem.mesh_force
    np.testing.assert_allclose(total, np.full_like(total, force), rtol=0.02)


def study_of(**options):
    return fegear.Tolerances(
        torque=TORQUE,
        samples=20,
        elements=StaticsSettings(resolution="coarse", positions=8),
        **options,
    )


def test_seeds_reproduce():
    one, same, other = (fegear.run(study_of(seed=s)) for s in (4, 4, 5))
    assert one.summary == same.summary
    assert one.table.csv() == same.table.csv()
    quantities = one.summary["quantities"], other.summary["quantities"]
    assert quantities[0] != quantities[1]


def test_the_number_of_threads_changes_nothing():
    study = replace(study_of(), samples=600)
    one, two = (fegear.run(study, workers=n) for n in (1, 2))
    assert one.summary == two.summary


def test_grades_and_amounts():
    result = fegear.run(study_of(driver_grade=4, driven_grade=8, single_pitch_um=2.0))
    limits = {row["source"]: row["limit_um"] for row in result.summary["tolerances"]}
    assert limits["driver_single_pitch"] == limits["driven_single_pitch"] == 2.0
    assert limits["driven_profile_form"] > 3.5 * limits["driver_profile_form"]
    assert result.bands.variables.count("driver_single_pitch") == 3
    shares = [r["share_of_ste_peak_to_peak"] for r in result.summary["tolerances"]]
    assert sum(shares) == pytest.approx(1.0)


def test_a_first_order_that_fails_is_told_with_numbers():
    """At a small torque teeth lose contact, and the warning says how often."""
    study = replace(study_of(grade=9), torque=5.0)
    summary = fegear.run(study).summary
    (warning,) = [w for w in summary["warnings"] if "STE p-p" in w]
    assert warning.endswith("[W29]")
    assert summary["lost_contact_fraction"] > 0.5
    percent = 100.0 * summary["lost_contact_fraction"]
    assert f"{percent:.0f} % of the pairs of gears" in warning


def test_bands_of_the_screen_are_sampled_and_sensitivities_of_the_first_order():
    result = fegear.run(study_of())
    parts = result.page()
    bands, tolerances = (part for part in parts if not isinstance(part, str))
    (row,) = (r for r in bands.rows if r["quantity"] == PEAK_TO_PEAK)
    assert [*bands.columns] == ["quantity", "nominal", "5 %", "50 %", "95 %"]
    assert bands.columns["95 %"](row) == f"{1e6 * row['p95']:.4g}"
    assert tolerances.title.endswith("effect on STE p-p to first order")
    most = 1e6 * row["first_order_p95"]
    for source in tolerances.rows:  # the same deviations, without those of a source
        change = 100.0 * (source["first_order_p95_without_um"] / most - 1.0)
        assert source["without"] == f"{change:+.1f}"
        assert change < 1.0


def test_a_nominal_value_outside_its_band_is_explained():
    """Deviations of either sign lower the stiffness of teeth at a small torque."""
    lines = list(fegear.run(replace(study_of(grade=9), torque=5.0)).page())
    assert any("mean k" in x and "lower it" in x for x in lines if isinstance(x, str))


def test_an_undercut_is_warned_of():
    mesh = {"driver": "pinion", "driven": "wheel", "center_distance_mm": 114.02}
    gears = fegear.make_gear_set(
        {
            "name": "undercut",
            "defaults": {"module_mm": 4.0, "face_width_mm": 20.0},
            "gear": [
                {"name": "pinion", "teeth": 12, "hub_radius_mm": 10.0},
                {"name": "wheel", "teeth": 45, "hub_radius_mm": 60.0},
            ],
            "mesh": [mesh],
        }
    )
    warnings = fegear.run(study_of(gear_set=gears)).summary["warnings"]
    assert [w[-5:] for w in warnings if "undercut" in w] == ["[W27]", "[W36]"]


def test_backlash_that_the_centre_distance_takes_away():
    study = study_of(center_distance_um=1250.0, distribution="uniform")
    summary = fegear.run(replace(study, samples=100)).summary
    assert 0.0 < summary["jammed_fraction"] < 0.5
    assert any(w.endswith("[W30]") for w in summary["warnings"])


def test_a_centre_distance_that_ends_the_mesh_is_refused():
    shorter = {"mesh.1.contact_ratio": 1.2}
    gears = fegear.load_gear_set("liu-pair", shorter)
    with pytest.raises(fegear.InputError, match="the contact ratio falls to 0"):
        fegear.run(study_of(gear_set=gears, center_distance_um=1250.0))


def test_pitch_errors_of_the_gear_set_are_replaced():
    plain = fegear.run(study_of())
    teeth = fegear.load_gear_set("liu-pair").gears[0].geometry.teeth
    edits = {"gear.1.pitch_errors_um": [5.0] + [0.0] * (teeth - 1)}
    with_errors = fegear.run(study_of(gear_set=fegear.load_gear_set("liu-pair", edits)))
    assert with_errors.bands.rows == plain.bands.rows


def test_blocks_that_are_finished_are_gathered(tmp_path):
    """After Ctrl-C the result is that of the blocks, and --resume completes it."""
    study = replace(study_of(), samples=600)
    checkpoint = tmp_path / "t.csv.partial"

    def progress(label: str, done: int, total: int) -> None:
        if done >= 300:
            raise KeyboardInterrupt

    options = CheckpointOptions(checkpoint=checkpoint)
    part = fegear.run(study, options, progress, workers=1)
    assert not part.complete
    count = part.summary["samples"]
    assert 250 <= count < 600
    messages: list[str] = []
    again = replace(options, resume=True)
    whole = fegear.run(study, again, notify=messages.append)
    done = math.ceil(count / 250)
    units = "blocks are finished"
    assert messages == [f"{checkpoint}: {done} of 3 {units}"]
    assert whole.summary == fegear.run(study).summary
    np.testing.assert_array_equal(
        whole.bands.solved.ste[:250], part.bands.solved.ste[:250]
    )
