"""A few of the random cases of `fuzz_gear_sets.py`."""

from __future__ import annotations

import pytest
from fuzz_gear_sets import FILES, NOT_FUZZED, WEIGHTS, cases, tried, values_of

from fegear.studies.registry import commands as registered


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        *cases(100, seed=0),
        *cases(40, seed=0, faults="show"),
        *cases(6, seed=0, faults="stiffness"),
    ],
    ids=lambda case: case.arguments[0],
)
def test_a_random_case_ends_as_it_should(tmp_path, case):
    _, wrong, line = tried(case, tmp_path)
    assert wrong is None, f"{wrong}: {case.arguments!a} {line}\n{case.files!a}"


def test_the_fuzzer_knows_every_command():
    fuzzed = {name for name in registered() if not name.startswith("bench ")}
    assert fuzzed - NOT_FUZZED == WEIGHTS.keys()


def test_values_of_options_are_allowed_ones_and_others():
    assert values_of("sweep", "--torque")[0] == "30"
    assert {"nan", "-1"} <= set(values_of("sweep", "--torque"))
    assert {"up", "both", "x"} <= set(values_of("sweep", "--direction"))
    assert set(FILES) <= set(values_of("sweep", "--output"))
    assert values_of("sweep", "--json") == []
