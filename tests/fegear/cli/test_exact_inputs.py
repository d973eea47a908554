"""Numbers of a command line reach JSON and the headers of files to the last bit."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest

from lumped.common.csv_text import format_exact
from tests.cli_commands import printed

TORQUE, THIRD, SPEED = 123.4567, 1.0 / 3.0, 2345.678901
RATIO = 0.0123456789
FAST = "--excitation", "rectangular"
LOADED = *FAST, "--torque", TORQUE, "--damping-ratio", RATIO
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?", re.IGNORECASE)
CASES = {  # what is typed, and which numbers of it JSON and the file have
    "sweep": (
        ("sweep", "liu-pair", *LOADED, "--friction", THIRD, "--bending", 0.1234567),
        ("--speeds", f"{SPEED!r}"),
        (TORQUE, RATIO, THIRD, SPEED),
        (0.1234567,),
    ),
    "motion": (
        ("motion", "liu-pair", *LOADED, "--speed", SPEED, "--friction", THIRD),
        ("--bending", 0.1234567),
        (TORQUE, RATIO, THIRD, SPEED),
        (0.1234567,),
    ),
    "map": (
        ("map", "liu-pair", *LOADED, "--at", SPEED),
        ("--over", "mesh.1.tip_relief.magnitude_um=1.2345678"),
        (1.2345678,),
        (TORQUE, RATIO, SPEED),
    ),
    "branches": (
        ("branches", "liu-pair", *LOADED, "--harmonics", 5),
        ("--speeds", "6000.1234567:6000.7654321"),
        (TORQUE, RATIO, 6000.1234567),
        (),
    ),
    "branches over a figure": (
        ("branches", "liu-pair", *LOADED, "--at", 6001.2345678),
        ("--over", "mesh.1.stiffness_variation=0.3123456789:0.3123556789"),
        (TORQUE, RATIO, 6001.2345678, 0.3123456789),
        (),
    ),
    "bifurcations": (
        ("bifurcations", "liu-pair", *LOADED, "--at", SPEED),
        ("--over", "mesh.1.stiffness_variation=0.3123456789", "--direction", "up"),
        (TORQUE, RATIO, SPEED, 0.3123456789),
        (),
    ),
    "stability": (
        ("stability", "liu-pair", *LOADED, "--bending", 0.1234567),
        ("--over", f"friction=0,{0.1 / 3!r}", "--speeds", "3001.2345678:3501:100"),
        (TORQUE, RATIO, 0.1 / 3),
        (0.1234567,),
    ),
    "sharing": (
        ("sharing", "planetary-24-36-96", "--torque", TORQUE, "--model", 1),
        ("--resolution", "coarse"),
        (TORQUE,),
        (),
    ),
    "theory": (("theory", "liu-pair", *LOADED), (), (TORQUE, RATIO), ()),
    "dynamics": (
        ("dynamics", "liu-pair", "--torque", TORQUE, "--friction", THIRD),
        ("--damping-ratio", 0.2345678, "--fidelity", "quasistatic", "--speeds", SPEED),
        (TORQUE, THIRD, 0.2345678, SPEED),
        (),
    ),
    "stiffness": (
        ("stiffness", "liu-pair", "--torque", TORQUE, "--friction", THIRD),
        ("--positions", 4, "--resolution", "coarse"),
        (TORQUE, THIRD),
        (),
    ),
    "eccentric": (
        ("eccentric", "--radius", 20.1234567, "--eccentricity", 6 + THIRD),
        ("--pressure-angle", 20.7654321),
        (20.1234567, 6 + THIRD, 20.7654321),
        (),
    ),
    "rattle bifurcation": (
        ("rattle", "bifurcation", "roots-scaled", "--beta", 0.61234567),
        ("--over", "delta=0.601234567:0.602345678", "--runs", 0),
        (0.61234567, 0.601234567),
        (),
    ),
    "rattle noise": (
        ("rattle", "noise", "roots-scaled", "--delta", 0.601234567),
        ("--starts", 3, "--turns", 3),
        (0.601234567,),
        (),
    ),
    "rattle gears": (
        ("rattle", "gears", "liu-pair", "--speed-rpm", 1500 + THIRD),
        ("--drag-Nm", 1 + THIRD, "--eccentricity-um", 9 + THIRD),
        (1500 + THIRD, 1 + THIRD, 9 + THIRD),
        (),
    ),
    "clatter": (
        ("clatter", "seed-five-speed", "--seconds", 0.1234567),
        (),
        (0.1234567,),
        (),
    ),
}
WITHOUT_FILE = {
    "modes": (("modes", "liu-pair", "--stiffness", "fe", "--torque", TORQUE), TORQUE),
    "compare": (("compare", "liu-pair", "--torque", TORQUE), TORQUE),
    "rattle periodic": (("rattle", "periodic", "roots-scaled", "--beta", THIRD), THIRD),
    "rattle critical": (("rattle", "critical", "roots-a", "--epsilon", THIRD), THIRD),
}


def numbers(values: Any) -> Iterator[float]:
    if isinstance(values, dict):
        values = list(values.values())
    if isinstance(values, list):
        for value in values:
            yield from numbers(value)
    elif isinstance(values, int | float):
        yield float(values)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_inputs_reach_json_and_file(name, tmp_path):
    command, options, in_both, in_file = CASES[name]
    path = tmp_path / ("out.toml" if name == "rattle gears" else "out.csv")
    summary = json.loads(printed(*command, *options, "-o", path, "--json"))
    written = {float(text) for text in NUMBER.findall(path.read_text("utf-8"))}
    assert set(in_both) <= set(numbers(summary))
    assert {*in_both, *in_file} <= written


@pytest.mark.parametrize("name", WITHOUT_FILE)
def test_inputs_reach_json(name):
    arguments, number = WITHOUT_FILE[name]
    assert number in set(numbers(json.loads(printed(*arguments, "--json"))))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (100.0, "100"),
        (0.04, "0.04"),
        (123.4567, "123.4567"),
        (1.0 / 3.0, "0.3333333333333333"),
        (1234567.0, "1234567"),
        (1e-4, "0.0001"),
        (5, "5"),
    ],
)
def test_shortest_text_that_reads_back(value, text):
    assert format_exact(value) == text
    assert float(format_exact(value)) == value
