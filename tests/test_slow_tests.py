"""Which tests a command line runs."""

from __future__ import annotations

import shlex

import pytest

pytest_plugins = "pytester"

TESTS = """\
import pytest

def test_quick():
    pass

@pytest.mark.slow
@pytest.mark.parametrize("case", ["one", "two"])
def test_slow(case):
    pass

@pytest.mark.slow
def test_slow_sweep():
    pass
"""
OPTIONS = "-v", "-p", "no:hypothesispytest"
QUICK = ["test_quick"]
SLOW = ["test_slow[one]", "test_slow[two]", "test_slow_sweep"]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("", QUICK),
        ("test_x.py", QUICK),
        ("-m slow", SLOW),
        ("-m 'slow or not slow'", QUICK + SLOW),
        ("test_x.py::test_slow", SLOW[:2]),
        ("./test_x.py::test_slow[one]", SLOW[:1]),
        ("test_x.py test_x.py::test_slow_sweep", QUICK + SLOW[2:]),
        ("test_x.py::test_slow_sweep -n 1", SLOW[2:]),
    ],
)
def test_slow_tests_run_where_they_are_selected(pytester, arguments, expected):
    pytester.makepyfile(test_x=TESTS)
    pytester.makeconftest("from slow_tests import pytest_collection_modifyitems")
    pytester.makeini("[pytest]\nmarkers = slow: takes long")
    result = pytester.runpytest_inprocess(*OPTIONS, *shlex.split(arguments))
    result.assert_outcomes(passed=len(expected))
    for name in expected:
        assert f"test_x.py::{name}" in result.stdout.str()
