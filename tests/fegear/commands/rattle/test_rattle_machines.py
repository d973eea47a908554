"""Machine files of `fegear rattle`: every key counts, and what is wrong is one line."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from typer.testing import CliRunner

from fegear.cli import app, run
from fegear.commands.rattle.machines import MachineFile, load_machine, machine_names
from fegear.gearset.problems import model_of

SCALED = {"damping": 0.6, "eccentricity_rad": 0.1, "half_backlash_rad": 0.6}
OF_GEARS = {
    "driving_eccentricity_rad": 0.05,
    "driven_eccentricity_rad": 0.06,
    "eccentricity_phase_rad": 1.0,
}
BASE: dict[str, dict[str, Any]] = {
    "machine": SCALED | {"ripple": 0.5, "stiffness": 900.0},
    "driving_gear": {"stiffness": 30.0, "inertia": 0.06, "damping": 0.1},
    "driven_gear": {"stiffness": 90.0, "inertia": 0.03, "damping": 0.2},
    "absorber": {
        "mass": 0.05,
        "pivot_radius": 0.4,
        "path_radius": 0.5,
        "damping": 0.1,
        "gear_eccentricity_rad": 0.02,
        "offset_angle_rad": 0.5,
    },
}
GEARS_APART = BASE | {
    "machine": {k: v for k, v in BASE["machine"].items() if k != "eccentricity_rad"}
    | OF_GEARS
}
IMPACTS: dict[str, dict[str, Any]] = {"machine": SCALED}
ANOTHER = {
    "ripple_order": 2,
    "ripple_phase_rad": 1.0,
    "motor_on_gear": True,
    "gear": "driven",
    "restitution": 0.7,
}
BY_MOTION = "half_backlash_rad", "restitution"  # they press no flanks together
ON_SCREEN = "name", "description", "inferences"


def written(tmp_path, tables, **more) -> str:
    lines = [f"{key} = {json.dumps(value)}" for key, value in more.items()]
    for name, keys in tables.items():
        lines += [f"[{name}]", *(f"{k} = {json.dumps(v)}" for k, v in keys.items())]
    path = tmp_path / "machine.toml"
    path.write_text("\n".join(['name = "x"', *lines, ""]))
    return str(path)


def json_output(*arguments: str) -> dict[str, Any]:
    result = CliRunner().invoke(app, ["rattle", *arguments, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def answer(path: str, command: str) -> Any:
    """Of a command, without the figures that it repeats."""
    if command == "basin":
        values = json_output("basin", path, "--grid", "8", "--iterations", "200")
        return [
            (attractor["name"], attractor["point"])
            for attractor in values["attractors"]
        ]
    values = json_output("critical", path)
    names = "critical_eccentricity_rad", "least_contact_load_over_mean"
    return [values[name] for name in names]


KEYS = [
    (table, key)
    for table, field in MachineFile.model_fields.items()
    if table not in ON_SCREEN
    for key in (model_of(field.annotation) or MachineFile).model_fields
]


@pytest.mark.slow
@pytest.mark.parametrize(("table", "key"), KEYS)
def test_every_key_moves_an_answer(tmp_path, table, key):
    command, tables = "critical", GEARS_APART if key in OF_GEARS else BASE
    if key in BY_MOTION:
        command, tables = "basin", IMPACTS
    before = answer(written(tmp_path, tables), command)
    entries = tables.get(table, {})
    other = ANOTHER.get(key, 1.2 * entries.get(key, 1.0))
    changed = tables | {table: entries | {key: other}}
    after = answer(written(tmp_path, changed), command)
    assert before != after


def test_name_description_and_inferences_are_on_the_screen(tmp_path):
    texts = {"description": "A pump of mine", "inferences": ["its play", "its mass"]}
    path = written(tmp_path, IMPACTS, **texts)
    for command in (["critical"], ["periodic", "--max-liftoffs", "1"], ["basin"]):
        small = ["--grid", "5"] if command == ["basin"] else []
        arguments = ["rattle", command[0], path, *command[1:], *small]
        page = CliRunner().invoke(app, arguments).stdout
        for text in ("x: A pump of mine", "inferred: its play", "inferred: its mass"):
            assert text in page
    values = json_output("critical", path)
    assert {name: values[name] for name in texts} == texts


WRONG = [
    (
        {"machine": SCALED | {"damping": -1}},
        "machine.damping = -1; must be at least 1e-09",
    ),
    ({"machine": SCALED | {"damping": "a"}}, 'machine.damping = "a"; must be a number'),
    ({"machine": SCALED | {"play": 3}}, "unknown key machine.play"),
    ({"machine": SCALED | {"dampin": 3}}, "machine.dampin, did you mean damping"),
    ({"machine": {"damping": 0.6, "half_backlash_rad": 1}}, "eccentricity_rad"),
    ({"machine": SCALED | OF_GEARS}, "only one is allowed"),
    (
        {"machine": SCALED | {"driven_eccentricity_rad": 0.1}},
        "is needed with it",
    ),
    ({"machine": SCALED | {"ripple_order": 0}}, "ripple_order = 0; must be at least 1"),
    (
        {"machine": SCALED | {"restitution": 1.5}},
        "restitution = 1.5; must be at most 1",
    ),
    (
        {"machine": SCALED | {"stiffness": 100.0, "restitution": 0.5}},
        "restitution = 0.5; belongs to impacts",
    ),
    (
        {"machine": SCALED, "shafts": {"driven_drag": 0}},
        "shafts.driven_drag = 0; must be at least 1e-09",
    ),
    (
        {"machine": SCALED, "driving_gear": {"stiffness": -3}},
        "driving_gear.stiffness = -3; must be at least 1e-09",
    ),
    ({"machine": SCALED, "driving_gear": {}}, "driving_gear.stiffness is missing"),
    (
        {"machine": SCALED, "driven_gear": {"stiffness": 3, "motor_on_gear": True}},
        "unknown key driven_gear.motor_on_gear",
    ),
    (
        {"machine": SCALED, "absorber": BASE["absorber"] | {"gear": "third"}},
        'absorber.gear = "third"; must be',
    ),
    (
        {"machine": SCALED, "absorber": BASE["absorber"] | {"mass": 0}},
        "absorber.mass = 0; must be at least 1e-12",
    ),
    ({"machine": SCALED, "sprung_gear": {}}, "unknown key sprung_gear"),
]


@pytest.mark.parametrize(("tables", "message"), WRONG, ids=lambda case: str(case)[:40])
def test_a_machine_file_that_is_wrong_is_one_line(tmp_path, capsys, tables, message):
    assert run(["rattle", "critical", written(tmp_path, tables)]) == 2
    error = capsys.readouterr().err
    assert "machine.toml" in error
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.slow
def test_noise_of_a_sprung_gear_is_told_by_the_flanks_that_meet():
    """Some ten times that without springs, table 6.1."""
    options = "--velocity", "0:0.002", "--starts", "12", "--turns", "50"
    figures = "--epsilon", "8e-5", "--kappa", "inf", "--iterations", "500"
    sprung = json_output("noise", "roots-a-sprung", *options, *figures)
    names = {motion["name"] for motion in sprung["motions"]}
    assert names <= {"quiet", "single-sided rattle", "double-sided rattle"}
    assert sprung["undecided_fraction"] == 0.0
    assert "transients of the parts fade to 0.001 in 8" in sprung["warnings"][0]
    unsprung = json_output("noise", "roots-a", *options, *figures[:4])
    ratio = sprung["noise_rad2_per_turn3"] / unsprung["noise_rad2_per_turn3"]
    assert 4.0 < ratio < 20.0


@pytest.mark.parametrize("more_drag", [0.0, 1e-6])
def test_speeds_of_unequal_shafts_are_the_same_in_all_commands(tmp_path, more_drag):
    """4 pi damping times the drive, which is 2.5 here, and 4 half backlashes."""
    tables = {
        "machine": {"damping": 0.4, "eccentricity_rad": 0.2, "half_backlash_rad": 0.4},
        "shafts": {
            "driving_inertia": 0.5,
            "driven_inertia": 2.0,
            "driving_drag": 0.5,
            "driven_drag": 2.0 + more_drag,
        },
    }
    path = written(tmp_path, tables)
    options = "--iterations", "100"
    summaries = [json_output("noise", path, "--starts", "2", "--turns", "5", *options)]
    if not more_drag:
        summaries += [json_output("basin", path, "--grid", "5", *options)]
        summaries += [json_output("periodic", path, "--max-liftoffs", "1")]
    exact = 4.0 * math.pi * 0.4 * 2.5 + 1.6
    for summary in summaries:
        assert summary["velocity_rad_per_turn"] == pytest.approx([0.0, exact], rel=1e-5)


def test_unequal_shafts_that_slow_down_at_one_rate_have_basins(tmp_path):
    shafts = {"driving_inertia": 1.5, "driving_drag": 1.5}
    path = written(tmp_path, IMPACTS | {"shafts": shafts})
    values = json_output("basin", path, "--grid", "8", "--iterations", "200")
    assert values["drive"] == pytest.approx(1.25 / 1.5)
    assert values["damping"] == 0.6


@pytest.mark.parametrize("name", machine_names())
def test_built_in_machines_are_read_and_marked(name):
    named = load_machine(name)
    assert named.name == name
    assert named.description
    assert json_output("critical", name)["critical_eccentricity_rad"] > 0.0


def test_phase_of_two_eccentric_gears(tmp_path):
    """Quiet up to the phase at which what is left is the critical eccentricity."""
    parts = {k: v for k, v in SCALED.items() if k != "eccentricity_rad"}
    gears = OF_GEARS | {
        "driving_eccentricity_rad": 0.15,
        "driven_eccentricity_rad": 0.1,
    }
    path = written(tmp_path, {"machine": parts | gears})
    values = json_output("critical", path)
    max_phase = values["quiet_phase_max_rad"]
    for change, quiet in ((-1e-6, True), (1e-6, False)):
        turned = {
            "machine": parts | gears | {"eccentricity_phase_rad": max_phase + change}
        }
        assert (
            json_output("critical", written(tmp_path, turned))["quiet_motion_exists"]
            is quiet
        )
    path = written(tmp_path, {"machine": parts | gears})
    page = CliRunner().invoke(app, ["rattle", "critical", path]).stdout
    assert f"it can run quietly within {math.degrees(max_phase):.4g} degrees" in page


def test_sensitivities_are_slopes_of_the_critical_eccentricity(tmp_path):
    tables = {k: v for k, v in BASE.items() if k != "machine"}
    tables["machine"] = SCALED | {"stiffness": 900.0}
    sensitivities = json_output("critical", written(tmp_path, tables))[
        "critical_sensitivity"
    ]
    for table, key in (("driving_gear", "stiffness"), ("absorber", "mass")):
        eccentricities = []
        for factor in (0.999, 1.001):
            changed = tables[table] | {key: tables[table][key] * factor}
            path = written(tmp_path, tables | {table: changed})
            values = json_output("critical", path)
            eccentricities.append(values["critical_eccentricity_rad"])
        low, high = eccentricities
        slope = math.log(high / low) / math.log(1.001 / 0.999)
        assert sensitivities[f"{table}.{key}"] == pytest.approx(slope, rel=1e-3)


def test_a_ripple_that_the_eccentricity_cancels_has_a_quiet_window(tmp_path):
    rippled = {k: v for k, v in SCALED.items() if k != "stiffness"} | {"ripple": 7.9}

    def at(**changes: float) -> dict:
        return json_output(
            "critical", written(tmp_path, {"machine": rippled | changes})
        )

    values = at(eccentricity_rad=0.2)
    assert values["quiet_motion_exists"]
    limits = "least_quiet_eccentricity_rad", "critical_eccentricity_rad"
    low, high = (values[name] for name in limits)
    assert (low, high) == pytest.approx((0.009125, 0.3875), rel=1e-3)
    for value, quiet in ((0.99, False), (1.01, True)):
        assert at(eccentricity_rad=value * low)["quiet_motion_exists"] is quiet
    slopes = [
        values[f"{name}_sensitivity"]["ripple"] for name in ("critical", "least_quiet")
    ]
    more = at(ripple=7.9 * 1.001)
    changes = [math.log(more[name] / values[name]) for name in limits[::-1]]
    assert slopes == pytest.approx([1e3 * change for change in changes], rel=0.02)
    path = written(tmp_path, {"machine": rippled})
    page = CliRunner().invoke(app, ["rattle", "critical", path]).stdout
    assert "quiet from 0.009125 rad, below which the torque ripple parts" in page
    assert "1 % more ripple: +21.9 % least quiet eccentricity" in page
    none = at(ripple_phase_rad=3.0)
    assert [none[name] for name in limits] == [None, None]
    path = written(tmp_path, {"machine": rippled | {"ripple_phase_rad": 3.0}})
    page = CliRunner().invoke(app, ["rattle", "critical", path]).stdout
    assert "no permanent contact at any eccentricity, for the torque ripple" in page


def test_a_figure_at_its_limit_has_no_change_beyond_it(tmp_path):
    """Flanks whose stiffness is that of critical damping, 0.5 % aside."""
    least = SCALED["damping"] ** 2 / 8.0
    tables = {"machine": SCALED | {"stiffness": 1.005 * least}}
    values = json_output("critical", written(tmp_path, tables))
    less, more = values["critical_sensitivity"]["stiffness"]
    assert less is None
    assert more < 0.0


@pytest.mark.parametrize(
    ("gear", "key"),
    [
        ({"stiffness": 2.0 * math.pi**2}, "driving_gear.stiffness"),  # resonates
        ({"stiffness": 900.0}, "absorber.path_radius"),  # in tune
    ],
)
def test_changes_of_both_sides_are_told_where_the_critical_one_bends(
    tmp_path, gear, key
):
    absorber = {"mass": 1e-3, "pivot_radius": 0.4, "path_radius": 0.4}
    tables = {"machine": SCALED | {"damping": 1e-4}, "driving_gear": gear}
    tables |= {"absorber": absorber} if key.startswith("absorber") else {}
    values = json_output("critical", written(tmp_path, tables))
    less, more = values["critical_sensitivity"][key]
    table, name = key.split(".")
    for factor, change in ((0.99, less), (1.01, more)):
        entries = tables[table] | {name: tables[table][name] * factor}
        path = written(tmp_path, tables | {table: entries})
        changed = json_output("critical", path)["critical_eccentricity_rad"]
        ratio = changed / values["critical_eccentricity_rad"]
        assert change == pytest.approx(100.0 * (ratio - 1.0), rel=1e-6)
    page = (
        CliRunner()
        .invoke(app, ["rattle", "critical", written(tmp_path, tables)])
        .stdout
    )
    line = f"1 % more {key}: {more:+.3g} % critical eccentricity, 1 % less: {less:+.3g}"
    assert line in page


def test_rattle_of_one_impact_a_turn_exists_from_the_checked_eccentricity():
    """0.05964 at a damping of 0.6; other parts than shafts may strike twice."""
    name = "simple_rattle_in_impacts_from_rad"
    assert json_output("critical", "roots-scaled")[name] == pytest.approx(
        0.05964, rel=1e-4
    )
    assert json_output("critical", "roots-a-refined")[name] is None
    page = CliRunner().invoke(app, ["rattle", "critical", "roots-scaled"]).stdout
    assert "rattle of one impact a turn exists from 0.05964 rad" in page


def test_files_of_built_in_machines_say_what_was_inferred():
    for name in machine_names():
        named = load_machine(name)
        assert named.inferences or name == "roots-scaled"
