"""Face widths and hubs from mesh stiffness: known answers come back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear

from fegear.commands.identify.least_squares import (
    MeasuredStiffness,
    hub_limits,
    identify,
    stiffness_model,
)
from fegear.commands.identify.result import IdentificationResult, plain_candidate
from fegear.commands.identify.study import Identification
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh

COARSE = StaticsSettings(resolution="coarse", positions=32, estimate_error=False)
TORQUE = 100.0
HUBS = np.array([0.022, 0.030])
WIDTH = 0.8


@pytest.fixture(scope="module")
def pair():
    return load_gear_set("liu-pair")


@pytest.fixture(scope="module")
def model(pair, compliance_cache):
    return stiffness_model(pair, [TORQUE], COARSE)


@pytest.fixture(scope="module")
def measured(model):
    """What gears of known hubs and width show."""
    mean, variation = model.meshed_figures(WIDTH, HUBS)
    return MeasuredStiffness(torque=model.torque, mean=mean, variation=variation)


def test_figures_are_those_of_the_statics(model, pair):
    gears = tuple(
        replace(
            gear,
            face_width=WIDTH * gear.face_width,
            geometry=replace(gear.geometry, hub_radius=float(hub)),
        )
        for gear, hub in zip(pair.gears, HUBS, strict=True)
    )
    geometries = [gear.geometry for gear in gears]
    spec = pair.meshes[0]
    same = replace(
        spec, pair=replace(spec.pair, driver=geometries[0], driven=geometries[1])
    )
    table = solve_mesh(
        replace(pair, gears=gears, meshes=(same,)), 1, [TORQUE], COARSE
    ).table
    k = table["stiffness_N_per_m"][0]
    mean, variation = model.meshed_figures(WIDTH, HUBS)
    assert mean == pytest.approx([k.mean()], rel=1e-12)
    assert variation == pytest.approx([np.ptp(k) / k.mean()], rel=1e-12)


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9])
def test_interpolated_hubs_are_close_to_meshed_ones(model, fraction):
    hubs = [np.interp(fraction, (0, 1), family.limits) for family in model.families]
    between = model.figures(WIDTH, np.array(hubs))
    meshed = model.meshed_figures(WIDTH, np.array(hubs))
    np.testing.assert_allclose(between[0], meshed[0], rtol=1e-3)
    np.testing.assert_allclose(between[1], meshed[1], atol=1e-3)


def test_twice_the_width_under_twice_the_torque_is_twice_as_stiff(model):
    mean, variation = model.figures(WIDTH, HUBS)
    double = replace(model, torque=2.0 * model.torque).figures(2.0 * WIDTH, HUBS)
    np.testing.assert_allclose(double[0], 2.0 * mean, rtol=1e-9)
    np.testing.assert_allclose(double[1], variation, rtol=1e-8)


@pytest.mark.slow
def test_known_figures_come_back_and_leave_a_valley(model, measured):
    fit = identify(model, measured)
    assert fit.best.misfit < 0.01
    np.testing.assert_allclose(fit.best.mean, measured.mean, rtol=2e-3)
    np.testing.assert_allclose(fit.best.variation, measured.variation, atol=2e-3)
    assert fit.interpolation_error < 1e-3
    # one mesh gives two figures for three unknowns: the true set is one of many
    good = fit.equally_good
    assert len(good) > 5
    at_true_hub = [
        np.interp(HUBS[0], [c.hub_radius[0] for c in good], column)
        for column in (
            [c.hub_radius[1] for c in good],
            [c.width_factor for c in good],
        )
    ]
    assert at_true_hub == pytest.approx([HUBS[1], WIDTH], rel=0.03)
    again = identify(model, measured)
    assert np.array_equal(again.best.hub_radius, fit.best.hub_radius)


@pytest.mark.slow
def test_the_chosen_hubs_are_alike_in_proportion(model, measured, pair):
    fit = identify(model, measured)
    roots = [gear.geometry.root_radius for gear in pair.gears]

    def spread(candidate):
        return np.ptp(np.log(candidate.hub_radius / roots))

    assert spread(fit.best) <= min(map(spread, fit.equally_good)) + 0.02


def test_a_held_width_stays_and_one_hub_follows(model, measured):
    fit = identify(model, replace(measured, variation=np.array([np.nan])), True, 1)
    assert fit.along == 1
    assert {c.width_factor for c in (fit.best, *fit.valley)} == {1.0}
    hubs = [c.hub_radius for c in fit.equally_good]
    driver, driven = np.array(hubs).T
    assert (np.diff(driven) > 0).all()
    assert (np.diff(driver) < 0).all()  # a stiffer wheel asks for a softer pinion


def test_spreads_weigh_the_figures(model, measured):
    wrong = replace(measured, mean=1.3 * measured.mean)  # cannot be met at this width
    trusting = identify(model, replace(wrong, mean_std=1e-4), True)
    doubting = identify(model, replace(wrong, mean_std=1.0), True)
    assert trusting.best.mean > 1.02 * doubting.best.mean


def test_misfits_count_known_figures_in_spreads():
    measured = MeasuredStiffness(
        torque=np.array([1.0, 1.0]),
        mean=np.array([2e8, np.nan]),
        variation=np.array([np.nan, 0.3]),
    )
    misfits = measured.misfits(np.array([2.04e8, 1e8]), np.array([0.9, 0.25]))
    assert misfits == pytest.approx([1.0, -2.0])


def test_nothing_known_is_refused(model):
    unknown = np.array([np.nan])
    with pytest.raises(InputError, match="one is needed"):
        identify(
            model, MeasuredStiffness(torque=TORQUE, mean=unknown, variation=unknown)
        )


def test_a_gear_without_room_for_a_hub_is_refused(pair):
    small = make_gear(5, 2e-3, profile_shift=0.77, tip_radius=9.4e-3)
    with pytest.raises(InputError, match=r'gear "pinion": root radius .* 2 modules'):
        hub_limits(replace(pair.gears[0], geometry=small))


@pytest.mark.slow
def test_the_valley_as_a_file(model, measured, pair):
    fit = identify(model, measured)
    study = Identification(
        gear_set=pair, mean=measured.mean, variation=measured.variation
    )
    lines = IdentificationResult(study, pair, measured, fit).table.csv().splitlines()
    assert lines[0] == "# gear set: liu-pair"
    assert len(lines) == 4 + len(fit.valley)
    names = lines[2].split(",")[1:]
    for line, candidate in ((lines[3], fit.best), (lines[4], fit.valley[0])):
        numbers = map(float, line.split(",")[1:])
        row = dict(zip(names, numbers, strict=True))
        assert row == plain_candidate(pair, candidate)
    width = 1e3 * fit.valley[0].width_factor * pair.gears[0].face_width
    assert row["pinion_face_width_mm"] == pytest.approx(width, rel=1e-4)
