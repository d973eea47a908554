"""Columns of tables: declared once, with meaning and unit.

Tables of the examples are checked where `test_every_study` makes them.
"""

from __future__ import annotations

import math
import re
from dataclasses import asdict, fields

import pytest
from declared_columns import declared, require_declared
from scipy.io import netcdf_file

import fegear
import validation.commands  # noqa: F401  # registers its columns
from fegear.commands.rattle.bifurcation_result import ExistenceResult
from fegear.studies.columns import (
    Column,
    column_meaning,
    columns,
    find_column,
    unit_of_column,
)
from fegear.studies.registry import commands
from validation.commands.bench import (
    bench_branches,
    bench_clatter,
    bench_commands,
    bench_dynamics,
    bench_eccentric,
    bench_growth,
    bench_lumped,
    bench_stability,
    bench_stiffness,
)
from validation.commands.bench.stress.trials import trials_csv
from validation.commands.validate.random_sets.full_dynamics import FullPoint
from validation.commands.validate.report.tables import report_tables
from validation.study.cases import Printed
from validation.study.solving import Cost

BENCHMARKS = {
    ("stiffness", "table"): bench_stiffness.StiffnessCost,
    ("dynamics", "table"): bench_dynamics.DynamicsCost,
    ("dynamics", "growth"): bench_dynamics.RowGrowth,
    ("lumped", "table"): bench_lumped.StepCost,
    ("lumped", "races"): bench_lumped.Race,
    ("lumped", "growth"): bench_lumped.Growth,
    ("branches", "table"): bench_branches.BranchCost,
    ("branches", "sweeps"): bench_branches.SweepComparison,
    ("branches", "stability"): bench_branches.StabilityAgreement,
    ("branches", "orders"): bench_branches.Order,
    ("stability", "table"): bench_stability.MultiplierCost,
    ("stability", "multipliers"): bench_stability.Multipliers,
    ("stability", "edges"): bench_stability.Edge,
    ("stability", "chart"): bench_stability.Chart,
    ("eccentric", "table"): bench_eccentric.EccentricCost,
    ("eccentric", "contact"): bench_eccentric.ContactCost,
    ("clatter", "table"): bench_clatter.ImpactCost,
    ("commands", "table"): bench_commands.CommandCost,
    ("growth", "table"): bench_growth.ChainCost,
}
UNITS = {
    "m": "dte_rms_m ste_m pair2_gap_m pinion_x_m",
    "m/s": "dte_rate_m_per_s approach_speed_m_per_s",
    "m/s2": "pinion_bearing1_x_m_per_s2",
    "m/N": "pair1_pair2_compliance_m_per_N",
    "N": "force_peak_N mesh1_pair-1_load_N",
    "N/mm": "line_load_N_per_mm",
    "N/m": "stiffness_N_per_m pair1_stiffness_N_per_m",
    "N m": "torque_Nm driven_torque_Nm",
    "N s": "impulse_Ns",
    "Pa": "max_pressure_Pa pinion_mesh1_tooth0_root_stress_Pa",
    "MPa": "contact_pressure_MPa",
    "MPa sqrt(m)": "mode1_stress_intensity_MPa_sqrt_m",
    "J/m2": "energy_release_rate_J_per_m2",
    "J": "lost_energy_J",
    "W": "mesh1_friction_power_W",
    "s": "time_s seconds fe_per_speed_s",
    "ms": "ms ms_per_motion coupled_ms",
    "us": "per_item_us us_per_step",
    "MB": "memory_MB",
    "kg": "mass_kg",
    "kg m2": "inertia_kg_m2",
    "Hz": "mesh_frequency_Hz unstable_to_Hz",
    "mm": "x_mm edge_at_pitch_mm pinion_hub_radius_mm",
    "um": "transmission_error_um mesh.2.tip_relief.magnitude_um",
    "rad/s": "pinion_speed_deviation_rad_per_s",
    "urad": "driver_error_urad",
    "rad": "separation_angle_rad eccentricity_rad",
    "deg": "driver_angle_deg",
    "turns": "time_turns",
    "rad/turn": "speed_rad_per_turn",
    "rad2/turn3": "noise_rad2_per_turn3",
    "rpm": "fitted_speed_rpm",
    "base pitches": "driver_tip_length_pitches",
    "1/s": "impacts_per_s",
    "1/turn": "impacts_per_turn",
    "1/period": "lyapunov_per_period lyapunov_stderr_per_period",
    "%": "per_cent error_percent percent_for_1_percent_less",
    "": "mesh position misfit kind items ms_of pairs limits mesh.2.phase friction",
}


def test_a_meaning_says_more_than_the_name():
    for column in columns():
        assert set(column.commands) <= commands().keys()
        words = column.meaning.split()
        assert len(words) > 2, column
        assert set(words) - set(re.findall(r"[a-z]+", column.name)), column


@pytest.mark.parametrize(
    ("unit", "name"), [(unit, name) for unit in UNITS for name in UNITS[unit].split()]
)
def test_the_unit_is_at_the_end_of_a_name(unit, name):
    assert unit_of_column(name) == unit


def test_every_unit_is_among_those_tested():
    assert {column.unit for column in columns()} <= UNITS.keys()


@pytest.mark.parametrize(
    ("command", "name", "table", "stands_for"),
    [
        ("stiffness", "pair12_gap_m", "table", "pair{n}_gap_m"),
        (
            "stiffness",
            "pair1_pair3_compliance_m_per_N",
            "table",
            "pair{n}_pair{n}_compliance_m_per_N",
        ),
        ("dynamics", "mesh1_pair-1_load_N", "history", "mesh{n}_pair{n}_load_N"),
        ("dynamics", "big_gear_2_x_m", "history", "{gear}_x_m"),
        ("identify", "my gear_face_width_mm", "table", "{gear}_face_width_mm"),
        ("identify", "mesh2_stiffness_variation", "table", None),
        ("map", "mesh.2.phase", "table", "{parameter}"),
        ("map", "dte_rms_m", "table", "dte_rms_m"),
        ("bifurcations", "mesh_frequency_Hz", "table", "{parameter}"),
    ],
)
def test_names_with_numbers_gears_and_parameters(command, name, table, stands_for):
    stands_for = stands_for or "mesh{n}_stiffness_variation"
    assert find_column(command, name, table).name == stands_for


def test_dots_and_letters_are_no_numbers():
    column = Column("pair{n}_gap.m", "", "", ())
    assert column.stands_for("pair1_gap.m")
    assert not column.stands_for("pair1_gap_m")
    assert not column.stands_for("paira_gap.m")


@pytest.mark.parametrize(
    ("command", "name", "table"),
    [
        ("sweep", "dte_m", "table"),
        ("sweep", "dte_rms_m", "spectra"),
        ("gears", "dte_rms_m", "table"),
        ("stiffness", "pair_gap_m", "table"),
    ],
)
def test_what_is_not_declared_is_an_error(command, name, table):
    with pytest.raises(KeyError, match=f"{command}, {table}: column {name} is not"):
        column_meaning(command, name, table)


@pytest.mark.parametrize(("subject", "table"), BENCHMARKS)
def test_columns_of_benchmarks(subject, table):
    names = [field.name for field in fields(BENCHMARKS[subject, table])]
    require_declared(f"bench {subject}", names, table)


def test_columns_of_trials():
    names = trials_csv(()).splitlines()[-1].split(",")
    require_declared("bench lumped", names, "stress")


def test_columns_of_reports():
    """Those that a small report does not have."""
    value = Printed(quantity="peak", value=1.0, unit="um", where="table 2.1")
    run = dict.fromkeys(("source", "torque_Nm", "rows", "rows_not_repeating"))
    cost = asdict(Cost(prepare_s=1.0)) | {"per_speed_s": math.nan}
    empty = {"case": "a", "models": [], "verdicts": [], "budget": {}}
    case = empty | {
        "printed": [asdict(value) | {"found": []}],
        "runs": [run | {"cost": cost}],
    }
    tables = report_tables({"cases": [case], "random_sets": {}})
    for table in ("printed", "costs"):
        require_declared("validate", tables[table][0], table)
    full = [field.name for field in fields(FullPoint)]
    require_declared("validate", full, "random-sets-full")


def test_columns_of_the_list_of_figures():
    names = fegear.run(fegear.Reproduction(numbers=("2.10",), listed=True)).table.names
    assert set(names) <= declared("reproduce")


def test_columns_over_two_parameters_of_a_machine():
    over = "epsilon=0.09:0.1", "delta=0.5:0.6"
    study = fegear.OrbitBifurcations(machine="roots-scaled", over=over)
    result = ExistenceResult(study, study.named, study.plane, ())
    on_branches = {"branch", "liftoff", "stable", "largest_multiplier"}
    require_declared(
        "rattle bifurcation",
        result.table.names,
        missing=on_branches,
        parameters=result.columns,
    )


def test_a_saved_table_has_meanings_and_units(tmp_path):
    study = fegear.Stability(
        gear_set="liu-pair",
        over="friction=0:0.1:2",
        speeds=[1000.0, 1100.0],
        model=fegear.LumpedModel(
            number=1,
            excitation=fegear.ExcitationSettings(kind="rectangular"),
            bending=0.39,
        ),
    )
    fegear.run(study).save(tmp_path / "chart.nc")
    with netcdf_file(tmp_path / "chart.nc", mmap=False) as content:
        found = {
            name: (content.variables[name].long_name, content.variables[name].units)
            for name in ("mesh_frequency_Hz", "friction", "floquet_max")
        }
    meaning = column_meaning("stability", "friction").encode()
    assert found["mesh_frequency_Hz"] == (b"mesh frequency of the first mesh", b"Hz")
    assert found["friction"] == (meaning, b"1")
    assert found["floquet_max"][1] == b"1"
