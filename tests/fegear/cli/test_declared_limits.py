"""Values outside of what a setting declares are refused before anything is done.

The settings come from the registry of commands, so that a new one is tested at once.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from math import isfinite
from typing import Any, get_type_hints

import pytest
from cli_commands import commands as typer_commands
from cli_commands import refused
from free_housings import HOUSINGS
from option_cases import choices, settings_by_option
from short_uses import SHORT_USES

from fegear.studies import registry
from lumped.common.options import Range, allowed_of

NAMES = {
    "SET": "liu-pair",
    "CASE": "idler",
}
TYPER_COMMANDS = dict(typer_commands())
COMMANDS = list(registry.commands())
# other options that a file needs, and ends of names are refused only after those
VIBRATING = "--stiffness fe --motion space --plane width"
NEEDS = {
    "campbell --bearing-forces": VIBRATING,
    "campbell --housing": f"{VIBRATING} --set housing.file={HOUSINGS / 'sensor.mat'}",
    "campbell --mesh-forces": VIBRATING,
    "campbell --response": VIBRATING,
    "eccentric --contact": "--teeth 40 --torque 10",
    "relief --pareto": "--torque 60:140:20 --compromises 5",
    "relief --front": "--torque 60:140:20 --compromises 5",
    "stiffness --cracks": "--set gear.1.cracks=[{tooth=3,depth_mm=1}]",
    "stiffness --face": "--set mesh.1.lead.slope_um=5",
    "stiffness --face-loads": "--set mesh.1.lead.slope_um=5",
    "stiffness --root-stresses": "--set mesh.1.lead.slope_um=5",
}
# see `wrong_inputs`
NO_ENDING = {
    *("new --output", "rattle manifold --output"),
    *("signals --order-map", "signals --separated", "signals --separated-plot"),
}


@pytest.fixture(autouse=True)
def empty_folder(monkeypatch, tmp_path) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    yield
    assert not list(tmp_path.iterdir())


@pytest.fixture
def nothing_runs(monkeypatch) -> None:
    monkeypatch.setattr("fegear.studies.running.run", None)


def short_use(command: str, *without: str) -> list[str]:
    """A short use of a command, without some of its options."""
    base = [NAMES.get(word, word) for word in SHORT_USES[command].text.split()]
    for option in without:
        if option in base:
            at = base.index(option)
            del base[at : at + 2]
    return [*command.split(), *base]


def settings_of(command: str) -> list[Any]:
    """Those that have an option, also those of groups."""
    return list(settings_by_option(command).values())


def study_of(command: str) -> Any:
    entry = registry.commands()[command]
    return getattr(import_module(entry.module), entry.study)


def allowed_numbers(member: Any) -> Range | None:
    return getattr(member.declared, "allowed", None) or allowed_of(member.field)


def outside(allowed: Range, whole: bool) -> Iterator[float]:
    """A number just outside on each side that ends."""
    for end, excluded, sign in (
        (allowed.least, allowed.above, -1),
        (allowed.most, allowed.below, 1),
    ):
        if isfinite(end):
            step = 1.0 if whole else 1e-9 * (abs(end) or 1.0)
            yield float(f"{end + sign * step:.12g}")
        elif isfinite(excluded):
            yield excluded


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", text)]


def files(command: str) -> list[str]:
    """Options of files that are written; a folder has no ending."""
    if study_of(command).folder:
        return []
    callback = inspect.unwrap(TYPER_COMMANDS[command].callback)
    hints = get_type_hints(callback)
    return [
        option
        for param in TYPER_COMMANDS[command].params
        if "Path" in str(hints[param.name])
        and (option := max(param.opts, key=len)).startswith("--")
        and f"{command} {option}" not in NO_ENDING
    ]


@pytest.mark.parametrize("command", COMMANDS)
def test_numbers_outside_of_their_range(capsys, nothing_runs, command):
    for member in settings_of(command):
        allowed = allowed_numbers(member)
        if allowed is None:
            continue
        whole = "int" in str(member.kind) and "float" not in str(member.kind)
        ends = {allowed.least, allowed.most, allowed.above, allowed.below}
        for value in (*outside(allowed, whole), float("nan")):
            text = f"{value:.12g}"
            if member.declared.metavar == "A:B":
                text = f"{text}:{value + 1.0:.12g}"
            error = refused(
                capsys, *short_use(command, member.option), member.option, text
            )
            assert error.startswith(f"fegear: {member.option} "), error
            if value == value:
                shown = numbers(error.partition(member.option)[2])
                assert {value, *filter(isfinite, ends)} <= set(shown), error
            else:
                assert "nan" in error
                assert "; must be " in error


@pytest.mark.parametrize("command", COMMANDS)
def test_words_that_are_no_choice(capsys, nothing_runs, command):
    for member in settings_of(command):
        allowed = choices(member.kind)
        if not allowed or allowed_numbers(member):
            continue
        arguments = [*short_use(command, member.option), member.option, "wrong"]
        error = refused(capsys, *arguments)
        assert error.startswith(f"fegear: {member.option} = wrong; must be "), error
        assert all(str(choice) in error for choice in allowed), error


@pytest.mark.parametrize("command", COMMANDS)
def test_files_that_are_not_there(capsys, command):
    for member in settings_of(command):
        if member.declared.reads and command not in ("new", "sharing"):
            arguments = short_use(command, member.option, "--excitation")
            error = refused(capsys, *arguments, member.option, "none.csv")
            assert "none.csv: cannot be read, no such file" in error


@pytest.mark.parametrize("command", COMMANDS)
def test_names_of_files_that_cannot_be_written(capsys, nothing_runs, command):
    """Of an ending that is not known, and in a folder that is not there."""
    for option in files(command):
        needs = NEEDS.get(f"{command} {option}", "").split()
        left_out = [word for word in needs if word.startswith("--")]
        short = "-o" if option == "--output" else option
        arguments = [*short_use(command, option, short, *left_out), *needs, option]
        error = refused(capsys, *arguments, "a.wrong")
        assert error.startswith("fegear: a.wrong: "), error
        assert "name must end in ." in error
        ending = re.findall(r"\.\w+", error)[1]
        error = refused(capsys, *arguments, f"missing/a{ending}")
        assert error.startswith(f"fegear: missing/a{ending}: cannot be written"), error


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_resumed_or_replaced_has_a_file(capsys, nothing_runs, command):
    if study_of(command).resumes and not study_of(command).folder:
        for option in ("--resume", "--overwrite"):
            arguments = short_use(command, "--output", "-o", option)
            error = refused(capsys, *arguments, option)
            assert error.startswith(f"fegear: {option}"), error
            assert "needs " in error
            assert f"--{study_of(command).checkpoint_beside}" in error
