"""Time histories as tables: forces, pressures, root stresses and the file itself."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from sector_stress import sector_stress

from fegear.contact.loads import patch_loads, tooth_loads
from fegear.dynamics.history import (
    LEGEND,
    format_history,
    gear_words,
    history_name,
    history_table,
)
from fegear.dynamics.stepper import DynamicSettings, TimeSteps, steps_per_cycle
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import root_influence
from fegear.elasticity.sector import CyclicSector
from fegear.gearset.lumped_train import train_of
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from fegear.studies.columns import column_meaning
from lumped import LumpedSystem
from lumped.steady.steady_state import steady_state
from meshes import MeshSize

# as many steps as the laws have places
SETTINGS = DynamicSettings(steps=128, hub_angle=10.0, step_angle=10.0)
STEEL = PlaneMaterial(206e9, 0.3, "stress")
SLOW, FAST = 20.0, 1200.0  # Hz
UNITS = ("_s", "_m", "_N", "_Pa", "_rad")
UNITLESS = ("_position", "_engaged_pairs")


def recorded(stepper, frequency, roots=None):
    """The table at one speed."""
    _, motion = steady_state(stepper, frequency, SETTINGS)
    steps = steps_per_cycle(stepper.model, frequency, SETTINGS)
    header = {"gear set": stepper.model.sides[0].gear_set.name}
    return history_table(stepper.model, motion, steps, header, roots)


@pytest.fixture(scope="module")
def pair(case_of):
    """Table of the plain pair by frequency."""
    return cache(lambda frequency: recorded(case_of().stepper(), frequency))


def require_known(columns):
    """Require that the columns are declared; KeyError for one that is not."""
    for name in columns:
        assert column_meaning("dynamics", name, "history")


def parsed(text: str) -> tuple[dict[str, str], list[str], list[list[str]]]:
    lines = text.splitlines()
    comments = [line[1:].partition(":") for line in lines if line.startswith("#")]
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    header = {key.strip(): value.strip() for key, _, value in comments}
    return header, rows[0], rows[1:]


def test_columns_are_complete_and_name_their_units(case_of, pair):
    model, columns = case_of().model(), pair(FAST).columns
    assert len(columns) == 1 + 4 + 2 * model.contact_count + 2
    assert list(columns)[:7] == [
        "time_s",
        "mesh1_position",
        "mesh1_dte_m",
        "mesh1_force_N",
        "mesh1_engaged_pairs",
        "mesh1_pair0_load_N",
        "mesh1_pair0_pressure_Pa",
    ]
    assert all(name.endswith(UNITS + UNITLESS) for name in columns)
    assert len({values.shape for values in columns.values()}) == 1


@pytest.mark.parametrize("frequency", [SLOW, FAST])
def test_loads_add_up_to_the_mesh_force(pair, frequency):
    columns = pair(frequency).columns
    loads = [values for name, values in columns.items() if name.endswith("load_N")]
    np.testing.assert_allclose(
        np.sum(loads, axis=0), columns["mesh1_force_N"], rtol=1e-12
    )


def test_one_or_two_pairs_are_engaged_at_contact_ratio_one_and_a_half(pair):
    engaged = pair(SLOW).columns["mesh1_engaged_pairs"]
    assert set(engaged.tolist()) == {1, 2}
    assert engaged[:-1].mean() == pytest.approx(1.504, abs=0.2)  # teeth bend


@pytest.mark.parametrize("frequency", [SLOW, FAST])
def test_pressure_at_the_pitch_point_is_that_of_hertz(case_of, pair, frequency):
    case, columns = case_of(), pair(frequency).columns
    mesh = case.gear_set.meshes[0].pair
    s1 = mesh.pitch_point
    s2 = mesh.line_of_action - s1
    modulus = 0.5 * 206e9 / (1.0 - 0.3**2)  # of both gears together, in plane strain
    line_load = columns["mesh1_pair0_load_N"][0] / 25.4e-3
    hertz = math.sqrt(line_load * modulus * (1.0 / s1 + 1.0 / s2) / math.pi)
    assert columns["mesh1_pair0_pressure_Pa"][0] == pytest.approx(hertz, rel=0.03)


def test_pressure_follows_from_the_law_on_and_between_its_loads(case_of, pair):
    """Of a pair on its path, where it is Hertz's to a few parts in a thousand."""
    laws, columns = case_of().laws[0].drive, pair(FAST).columns
    pair_index = laws.pair_offsets.tolist().index(0)
    for step in (0, 5, 60):  # a multiple of the laws' positions
        load = columns["mesh1_pair0_load_N"][step]
        knots, values = laws.load[step, pair_index, 0], laws.pressure[step, pair_index]
        above = np.searchsorted(knots, load)
        pressure = columns["mesh1_pair0_pressure_Pa"][step]
        assert values[above - 1] < pressure < values[above]
        part = math.sqrt(load / knots[above])
        assert pressure == pytest.approx(part * values[above], rel=5e-3)


def test_no_load_is_no_pressure(pair):
    columns = pair(FAST).columns
    free = columns["mesh1_pair-1_load_N"] == 0.0
    assert 0 < free.sum() < free.size
    pressure = columns["mesh1_pair-1_pressure_Pa"]
    assert (pressure[free] == 0.0).all()
    assert (pressure[~free] > 0.0).all()


def test_rotations_make_up_the_deflection(case_of, pair):
    gears, columns = case_of().gear_set.gears, pair(FAST).columns
    rolled = [
        gear.geometry.base_radius * columns[f"{gear.name}_rotation_rad"]
        for gear in gears
    ]
    dte = columns["mesh1_dte_m"]
    np.testing.assert_allclose(np.sum(rolled, axis=0), dte, atol=1e-9 * dte.max())


def test_positions_start_over_with_every_cycle(pair):
    position = pair(FAST).columns["mesh1_position"]
    assert position[0] == position[-1] == 0.0
    np.testing.assert_allclose(position[:-1], np.arange(position.size - 1) / 128)


def test_text_reads_back_to_the_same_bits(pair):
    table = pair(FAST)
    header, names, rows = parsed(format_history(table))
    assert header == {"gear set": "liu-pair"} | LEGEND
    assert names == list(table.columns)
    for name, cells in zip(names, zip(*rows, strict=True), strict=True):
        assert [float(cell) for cell in cells] == table.columns[name].tolist()
    assert not any(cell == "-0.0" for row in rows for cell in row[4:13])
    engaged = names.index("mesh1_engaged_pairs")
    assert {row[engaged] for row in rows} <= {"0", "1", "2"}


def test_back_side_contacts_have_columns_of_their_own(case_of):
    stepper = case_of(backlash=1e-6).stepper()
    state = stepper.start()
    gradient = stepper.model.kinematics.deflection[0]
    state.motion[1] = -0.5 / (gradient @ gradient) * gradient  # thrown apart at 0.5 m/s
    _, motion = stepper.integrate(state, TimeSteps(FAST, 1.0 / (FAST * 128), 128, 128))
    columns = history_table(stepper.model, motion, 128).columns
    sums = {"pair": 0.0, "back": 0.0}
    for kind in sums:
        names = [n for n in columns if f"_{kind}" in n and n.endswith("load_N")]
        sums[kind] = np.sum([columns[name] for name in names], axis=0)
        peaks = [columns[name.replace("load_N", "pressure_Pa")] for name in names]
        np.testing.assert_array_equal(np.max(peaks, axis=0) > 0.0, sums[kind] > 0.0)
    assert sums["back"].max() > 0.0
    require_known(columns)
    force = columns["mesh1_force_N"]
    assert force.min() < 0.0
    np.testing.assert_allclose(
        sums["pair"] - sums["back"], force, atol=1e-9 * force.max()
    )


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_slow_motion_has_the_root_stress_of_the_statics(case_of, friction):
    case = case_of(friction=friction)
    gear_set = case.gear_set
    roots = {
        g: root_influence(CyclicSector(gear_set.gears[g].geometry, STEEL))
        for g in (0, 1)
    }
    columns = recorded(case.stepper(), SLOW, roots).columns
    settings = StaticsSettings(friction=friction)
    problem = contact_problem(gear_set, 0, settings)
    for step in (0, 20, 64, 115):
        loads = patch_loads(problem, 100.0, step / 128)
        for gear, kind in zip(gear_set.gears, ("driver", "driven"), strict=True):
            for load in loads:
                pair_loads = tooth_loads(loads, kind, load.tooth)
                finer = MeshSize().refined(2.0)
                field = sector_stress(gear.geometry, STEEL, pair_loads, finer)
                name = f"{gear.name}_mesh1_tooth{load.tooth}_root_stress_Pa"
                assert columns[name][step] == pytest.approx(field.root_stress, rel=0.02)


def test_gears_on_bearings_have_translations(case_of):
    case = case_of("liu-idler-small-hubs")
    gear_set = case.gear_set
    train = train_of(gear_set, 100.0, translations=True)
    reference = LumpedSystem(train, case.reference.excitations)
    stepper = replace(case, reference=reference).stepper()
    roots = {1: root_influence(CyclicSector(gear_set.gears[1].geometry, STEEL))}
    columns = recorded(stepper, FAST, roots).columns
    require_known(columns)
    for row, mesh in zip(reference.modes.coordinates.mesh_rows, (1, 2), strict=True):
        places = reference.modes.coordinates.indices
        deflection = 0.0
        for (gear, kind), place in places.items():
            unit = "rad" if kind == "rotation" else "m"
            name = f"{gear_set.gears[gear].name}_{kind}_{unit}"
            deflection = deflection + row[place] * columns[name]
        dte = columns[f"mesh{mesh}_dte_m"]
        np.testing.assert_allclose(deflection, dte, atol=1e-9 * dte.max())
    stressed = [name for name in columns if name.endswith("root_stress_Pa")]
    assert all(name.startswith("idler_mesh") for name in stressed)
    both = {name.split("_")[1] for name in stressed}
    assert both == {"mesh1", "mesh2"}
    assert all(np.ptp(columns[name]) > 0.0 for name in stressed)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((100.0, "up", 1600.0), "100Nm_up_1600Hz.csv"),
        ((50.0, "down", 800.0), "050Nm_down_0800Hz.csv"),
        ((0.5, "up", 1333.0 + 1.0 / 3.0), "000.5Nm_up_1333.333333Hz.csv"),
        ((1e4, "up", 1e5), "10000Nm_up_100000Hz.csv"),
    ],
)
def test_file_names(arguments, name):
    assert history_name(*arguments) == name


def test_file_names_sort_by_torque_and_speed():
    cases = [(t, "up", f) for t in (5.0, 50.0, 100.0) for f in (80.0, 800.0, 1600.0)]
    names = [history_name(*case) for case in cases]
    assert names == sorted(names)


@pytest.mark.parametrize("torque", [math.nan, math.inf, -1.0])
def test_wrong_numbers_are_named(torque):
    with pytest.raises(ValueError, match=r"torque = .*; must be finite and 0 or more"):
        history_name(torque, "up", 100.0)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["pinion", "middle-1"], ["pinion", "middle-1"]),
        (["sun, small", "Zahnrad_ä"], ["sun_small", "Zahnrad_ä"]),
        (["a b", "a,b"], ["a_b_1", "a_b_2"]),
    ],
)
def test_gears_are_named_by_words(names, expected):
    gears = [SimpleNamespace(name=name) for name in names]
    assert gear_words(SimpleNamespace(gears=gears)) == expected
