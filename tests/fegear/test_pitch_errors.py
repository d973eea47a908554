"""Statics with pitch errors: every tooth pair of the whole period by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_at import contact_at

from fegear.contact.pairs import back_side_position
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import tooth_pair_errors, without_pitch_errors
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped.train.table import format_table, parse_table
from validation.study.statics_runs import static_deflection

PINION, WHEEL = (0.0, 3e-6), (1e-6, -2e-6, 0.5e-6, 2e-6, -1e-6)  # repeated around
PITCHES = 10
SETTINGS = StaticsSettings(positions=16, resolution="coarse", estimate_error=False)


@pytest.fixture(scope="module")
def uneven(problem):
    return replace(
        problem,
        driver=replace(problem.driver, pitch_errors=PINION * 19),
        driven=replace(problem.driven, pitch_errors=WHEEL * 11),
    )


def with_errors(gear_set: GearSet, *errors: tuple[float, ...]) -> GearSet:
    pairs = zip(gear_set.gears, errors, strict=True)
    gears = tuple(
        replace(gear, pitch_errors=gear_errors) for gear, gear_errors in pairs
    )
    return replace(gear_set, gears=gears)


@pytest.fixture(scope="module")
def uneven_set():
    return with_errors(load_gear_set("liu-pair"), PINION * 19, WHEEL * 11)


def test_pairs_count_anew_in_each_base_pitch(uneven):
    """The same contact whether a position is 7.4, or 0.4 in base pitch 7."""
    pitch = np.repeat(np.arange(PITCHES), 4)
    position = np.tile(np.arange(4) / 4 + 0.05, PITCHES)
    cycle = solve_cycle(uneven, [100.0], position, pitch)
    for n in (0, 5, 30, 39):
        alone = solve_cycle(uneven, [100.0], [position[n] + pitch[n]])
        assert cycle.position[n] == pytest.approx(alone.position[0])
        assert cycle.ste[0, n] == pytest.approx(alone.ste[0, 0], rel=1e-6)
        assert cycle.no_load[0, n] == pytest.approx(alone.no_load[0, 0], abs=1e-12)
    assert np.ptp(cycle.no_load) > 2e-6


def rigid_errors(problem, position, back):
    """No-load transmission error of rigid teeth with contact on the path alone.

    From where the teeth stand: tooth n of both gears, counted as they come into
    contact, is in the reference pair at position n. On the back flanks the driven
    tooth is as early as it is thick, and a driver's tooth stands ahead of it.
    """
    pair, errors = problem.pair, []
    driver_errors, driven_errors = (
        problem.driver.pitch_errors,
        problem.driven.pitch_errors,
    )
    for x in position:
        gaps = []
        for n in range(int(x) - 4, int(x) + 5):
            pitches = x - n
            if back:
                pitches = float(back_side_position(pair, x - n))
            roll = pair.pitch_point + pitches * pair.base_pitch
            if not pair.path_start <= roll <= pair.path_end:
                continue
            driver_tooth = n - 1 if back else n
            total = (
                driver_errors[driver_tooth % len(driver_errors)]
                + driven_errors[n % len(driven_errors)]
            )
            gaps.append(-total if back else total)
        errors.append(min(gaps))
    return np.array(errors)


@pytest.mark.parametrize("back", [False, True])
def test_rigid_teeth_follow_the_first_pair_to_touch(uneven, back):
    position = np.arange(PITCHES * 8) / 8 + 0.02
    case = replace(uneven, corner_contact=False)
    torque = -100.0 if back else 100.0
    cycle = solve_cycle(case, [torque], position % 1.0, np.floor(position).astype(int))
    expected = rigid_errors(case, position, back)
    if back:
        expected = -(case.pair.backlash + expected)
    np.testing.assert_allclose(cycle.no_load[0], expected, atol=1e-10)
    assert np.ptp(expected) > 2e-6


@pytest.mark.parametrize("torque", [100.0, -100.0])
def test_the_approach_of_a_torque_gives_the_torque(uneven, torque):
    position = np.arange(PITCHES) + 0.3
    cycle = solve_cycle(uneven, [torque], np.full(PITCHES, 0.3), np.arange(PITCHES))
    contact = contact_at(uneven, position, cycle.ste[0])
    np.testing.assert_allclose(contact.torque, torque, rtol=5e-3)


def test_a_table_goes_on_until_the_pairs_repeat(uneven_set):
    result = solve_mesh(uneven_set, 1, [100.0], SETTINGS)
    table = result.table
    assert result.pitches == PITCHES
    np.testing.assert_allclose(table.position, np.arange(160) / 16)
    assert f"after {PITCHES} base pitches" in table.header["pitch errors"]
    assert parse_table(format_table(table)) == table
    # every base pitch differs from the others
    ste = table["ste_m"][0].reshape(PITCHES, 16)
    distance = np.abs(ste[:, None] - ste[None, :]).max(axis=2)
    assert (distance[~np.eye(PITCHES, dtype=bool)] > 1e-7).all()
    plain = solve_mesh(without_pitch_errors(uneven_set), 1, [100.0], SETTINGS)
    assert plain.pitches == 1
    assert "pitch errors" not in plain.table.header


def test_a_table_that_is_too_long_is_refused_with_its_length():
    errors = tuple(tuple(np.arange(z) * 1e-8) for z in (38, 55))
    hunting = with_errors(load_gear_set("liu-pair"), *errors)
    with pytest.raises(InputError, match=r"2090 base pitches .* 2140160 rows"):
        solve_mesh(hunting, 1, [100.0], replace(SETTINGS, positions=1024))


def test_estimates_of_the_discretisation_know_the_errors(uneven_set):
    settings = replace(SETTINGS, estimate_error=True)
    assert solve_mesh(uneven_set, 1, [100.0], settings).error.mean < 0.02


def test_model_1_has_nearly_the_statics_of_the_finite_elements(uneven_set):
    """Exact where one pair carries, and within a part of the errors elsewhere."""
    source = Excitations(ExcitationSettings(positions=64, resolution="coarse"))
    table = source.table(uneven_set, 0, 100.0)
    force = 100.0 / uneven_set.meshes[0].pair.driver.base_radius
    excitation = source.mesh_excitation(uneven_set, 0, 100.0, 1)
    assert excitation.period == PITCHES
    deflection = static_deflection(excitation, force, table.position)
    deviation = deflection - table["ste_m"][0]
    alone = table["n_pairs"][0] == 1
    assert np.abs(deviation[alone & (table.position % 1.0 < 0.1)]).max() < 1e-9
    assert deviation.std() < 0.1 * table["ste_m"][0].std()
    # one tooth's error on every tooth, or none, is no match for that
    for one_for_all in (0.0, float(tooth_pair_errors(uneven_set, 0)[0])):
        plain = source.table(without_pitch_errors(uneven_set), 0, 100.0)["ste_m"][0]
        repeated = np.tile(plain + one_for_all, PITCHES)
        assert (repeated - table["ste_m"][0]).std() > 3.0 * deviation.std()


@pytest.mark.parametrize("model", [2, 3])
def test_models_of_the_whole_mesh_take_the_table(uneven_set, model):
    source = Excitations(ExcitationSettings(positions=64, resolution="coarse"))
    table = source.table(uneven_set, 0, 100.0)
    (spring,) = source.mesh_excitation(uneven_set, 0, 100.0, model).pairs
    assert spring.period == PITCHES
    ste = table["ste_m"][0]
    gap = ste - ste.mean() if model == 2 else table["nlte_m"][0]
    np.testing.assert_allclose(spring.gap(table.position), gap, atol=1e-15)


def test_an_idler_drives_with_the_flank_that_stands_ahead():
    """A tooth that stands back in the first mesh is early in the second."""
    idler = load_gear_set("liu-idler")
    errors = tuple(2e-6 if tooth == 30 else 0.0 for tooth in range(55))
    uneven = with_errors(idler, (), errors, ())
    source = Excitations(ExcitationSettings(positions=16, resolution="coarse"))
    free = [source.table(uneven, m, 100.0)["nlte_m"][0] for m in range(2)]
    late, early = (error.reshape(55, -1) for error in free)
    assert late.max() == pytest.approx(2e-6, abs=1e-9)
    assert int(late.max(axis=1).argmax()) in (29, 30)
    assert early.min() == pytest.approx(-2e-6, abs=1e-9)
    assert (early.min(axis=1) < -1e-6).sum() in (2, 3)  # its way through the mesh


def test_tables_know_which_tooth_is_first():
    """Another phase of the second mesh puts another tooth into its reference pair."""
    idler = load_gear_set("liu-idler")
    errors = tuple(2e-6 if tooth == 30 else 0.0 for tooth in range(55))
    source = Excitations(ExcitationSettings(positions=16, resolution="coarse"))
    no_load_errors = []
    for phase in (0.2, 1.2):
        meshes = (idler.meshes[0], replace(idler.meshes[1], phase=phase))
        uneven = with_errors(replace(idler, meshes=meshes), (), errors, ())
        no_load_errors.append(source.table(uneven, 1, 100.0)["nlte_m"][0])
    np.testing.assert_allclose(
        np.roll(no_load_errors[0], 16), no_load_errors[1], atol=1e-9
    )
