"""A few of the random cases of `fuzz_gear_sets.py`."""

from __future__ import annotations

import pytest
from fuzz_gear_sets import BASE, NOT_FUZZED, WORDS, cases, option_lists, tried

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


def test_the_fuzzer_knows_every_option():
    flags = {"--json", "--translations", "--hold-width", "--model-1", "--resume"}
    flags |= {"--overwrite", "--whole", "--corner-contact"}
    flags |= {"--all", "--quick"}  # take minutes
    flags |= {"--chaos", "--exponents", "--root", "--averages", "--symmetric"}
    fuzzed = {name for name in registered() if not name.startswith("bench ")}
    assert fuzzed - NOT_FUZZED == BASE.keys()
    for options in option_lists().values():
        for option in options:
            assert option in WORDS or option in flags or not option.startswith("--")
