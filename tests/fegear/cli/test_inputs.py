"""No option changes nothing: each moves the answer of a command or is refused.

Cases come from the declared options, so that a new one fails here until it has another
value. An answer is what a command computes, without what it only repeats of its input.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from cli_commands import ROOT_COMMAND, commands
from option_cases import cases_of, option_name
from quick_benchmarks import answer_at_once
from short_uses import SHORT_USES
from slow_tests import in_tier_of
from small_sets import SETS

ROOT_OPTIONS = {"--debug", "--version", "--install-completion", "--show-completion"}
CASES = {command: dict(cases_of(command)) for command in SHORT_USES}


def test_every_option_of_every_command_has_a_case():
    options = {
        name: {option_name(param) for param in command.params}
        for name, command in commands()
    }
    assert {name: set(cases) for name, cases in CASES.items()} == options
    assert {option_name(param) for param in ROOT_COMMAND.params} == ROOT_OPTIONS


def test_exceptions_are_of_options_that_there_are():
    for command, use in SHORT_USES.items():
        assert use.options.keys() <= CASES[command].keys(), command


@pytest.fixture
def quick_benchmarks(monkeypatch):
    answer_at_once(monkeypatch)


def options() -> Iterator[Any]:
    for command, cases in CASES.items():
        for name in cases:
            case = f"{command} {name}".replace(" ", "-")
            yield in_tier_of(command, name, id=case)


@pytest.mark.parametrize(("command", "name"), list(options()))
def test_an_option_moves_the_answer_or_is_refused(
    answers, quick_benchmarks, command, name
):
    """Only this finds an option that is read and not used."""
    case = CASES[command][name]
    base, changed = (answers(w, SETS[case.set]) for w in (case.base, case.changed))
    assert base.code == 0
    assert changed.code == (2 if case.refused else 0)
    assert case.refused or changed.answer != base.answer
