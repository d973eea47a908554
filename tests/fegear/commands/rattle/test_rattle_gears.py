"""`fegear rattle gears`: the machine against its two gears in SI units."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from fegear.cli import app, run
from fegear.commands.rattle.machines import load_machine
from lumped.rattle.kernels.flight import return_map

GEARS = (
    *("rattle", "gears", "liu-pair", "--resolution", "coarse"),
    *("--speed-rpm", "600", "--drag-Nm", "2", "--eccentricity-um", "500"),
)
TURN = 2.0 * math.pi


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """What is told of a machine, and its file."""
    path = tmp_path_factory.mktemp("gears") / "m.toml"
    result = CliRunner().invoke(app, [*GEARS, "-o", str(path), "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout), str(path)


def next_departure(values, t: float, v: float) -> tuple[float, float]:
    """The departure after one (t, v) of both gears: seconds, newtons, metres."""
    speed = values["speed_rpm"] / 60.0
    radius = 1e-3 * values["base_radius_mm"]
    one, two = values["teeth"]
    other = radius * two / one
    ratio = one / two
    inertia, driven = (
        values[f"{side}_inertia_kg_m2"] for side in ("driving", "driven")
    )
    omega = TURN * speed
    drag = (values["drag_Nm"] - values["driven_drag_Nm"]) / omega
    driven_drag = values["driven_drag_Nm"] / ratio / (omega * ratio)
    error, play = 1e-6 * values["eccentricity_um"], 0.5e-6 * values["backlash_um"]

    def path(s, u):
        return radius * u[0] - other * u[1] + error * math.cos(omega * s)

    def rates(s, u):
        gap = path(s, u)
        deflection = math.copysign(max(abs(gap) - play, 0.0), gap)
        force = values["mean_stiffness_N_per_m"] * deflection
        return [
            *u[2:],
            (values["drag_Nm"] - drag * u[2] - radius * force) / inertia,
            (other * force - driven_drag * u[3]) / driven,
        ]

    def clearance(s, u):
        return path(s, u) - play

    clearance.direction = -1.0
    begin = t / speed
    start = (play - error * math.cos(omega * begin)) / radius
    rate = error * omega * math.sin(omega * begin) / radius - v * speed
    solution = solve_ivp(
        *(
            rates,
            (begin, begin + 2.0 / speed),
            [start, 0.0, omega + rate, omega * ratio],
        ),
        method="DOP853",
        events=clearance,
        rtol=1e-10,
        atol=1e-13,
        max_step=1e-3 / speed,
    )
    times, states = solution.t_events[0], solution.y_events[0]
    index = int(np.argmax(times > begin + 1e-7))
    u, s = states[index], times[index]
    slip = radius * u[2] - other * u[3] - error * omega * math.sin(omega * s)
    return s * speed, -slip / radius / speed


@pytest.mark.slow
def test_machine_of_gears_moves_as_both_in_si_units(outputs):
    values, path = outputs
    machine = load_machine(path).machine
    for start in ((0.2, 0.02), (0.6, 0.05)):
        t, v, _ = return_map(machine.arrays, *start)
        assert (t, v) == pytest.approx(next_departure(values, *start), rel=1e-5)


def test_stiffness_is_that_of_the_load_of_the_drag(outputs):
    values, _ = outputs
    arguments = ["stiffness", "liu-pair", "--resolution", "coarse", "--json"]
    torque = f"{values['driven_drag_Nm']!r}"
    result = CliRunner().invoke(app, [*arguments, "--torque", torque])
    row = json.loads(result.stdout)["torques"][0]
    for name in ("mean_stiffness_N_per_m", "peak_to_peak_over_mean"):
        assert values[name] == pytest.approx(row[name], rel=1e-12)


def test_critical_eccentricity_of_the_file_is_what_was_told(outputs):
    values, path = outputs
    result = CliRunner().invoke(app, ["rattle", "critical", path, "--json"])
    summary = json.loads(result.stdout)
    critical = summary["critical_eccentricity_rad"]
    assert critical == pytest.approx(values["critical_eccentricity_rad"], rel=1e-9)
    in_um = critical * values["base_radius_mm"] * 1e3
    assert values["critical_eccentricity_um"] == pytest.approx(in_um)
    assert summary["description"] == "38/55 gears of liu-pair at 600 rpm, drag 2 N m"


def test_gear_sets_are_told_from_machines(tmp_path, capsys):
    path = tmp_path / "set.toml"
    path.write_text('name = "x"\n[[gear]]\nteeth = 20\n')
    for name in ("liu-pair", str(path)):
        assert run(["rattle", "critical", name]) == 2
        assert "fegear rattle gears makes a machine" in capsys.readouterr().err
