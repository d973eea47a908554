"""Codes of warnings and evidence lines: declared, used, and explained."""

from __future__ import annotations

import json
import re
from dataclasses import asdict
from pathlib import Path

import pytest
from cli_commands import commands, printed

from fegear.cli.screen import print_warnings
from fegear.files.codes import (
    EvidenceCode,
    WarningCode,
    codes,
    require_warning_code,
    with_code,
)
from fegear.files.keys import FILE_KINDS, file_keys
from fegear.studies.registry import commands as registered

ROOT = Path(__file__).parents[2]
LITERAL = re.compile(r'"([WE]\d\d)"')
MAX_LETTERS = 600
TEXTS = {
    code: {name: text for name, text in asdict(entry).items() if name != "code"}
    for code, entry in codes().items()
}


def used_codes() -> set[str]:
    """Codes as literals in the source of the packages that print lines."""
    sources = (
        path.read_text("utf-8")
        for package in ("fegear", "validation")
        for path in (ROOT / package).rglob("*.py")
    )
    return {code for text in sources for code in LITERAL.findall(text)}


def test_every_code_is_declared_and_used():
    assert used_codes() == codes().keys()


def test_lumped_models_know_no_codes():
    """They import nothing of fegear, which puts the codes on their lines."""
    for path in (ROOT / "lumped").rglob("*.py"):
        assert not LITERAL.search(path.read_text("utf-8")), path


def test_codes_rise():
    numbers = list(codes())
    warnings = [code for code in numbers if code.startswith("W")]
    evidence = [code for code in numbers if code.startswith("E")]
    assert numbers == [*sorted(warnings), *sorted(evidence)]


@pytest.mark.parametrize("code", codes())
def test_an_entry_is_short(code):
    assert type(codes()[code]) is (WarningCode if code[0] == "W" else EvidenceCode)
    assert sum(map(len, TEXTS[code].values())) <= MAX_LETTERS
    assert all(TEXTS[code].values())


@pytest.mark.parametrize("code", codes())
def test_an_entry_names_options_commands_keys_and_codes_that_exist(code):
    text = " ".join(TEXTS[code].values())
    options = {name for _, command in commands() for name in option_names(command)}
    keys = {key.key for kind in FILE_KINDS for key in file_keys(kind)}
    for quoted in re.findall(r"`([^`]+)`", text):
        for option in re.findall(r"--[a-z][a-z-]*", quoted):
            assert option in options, option
        for command in re.findall(r"^fegear (rattle [a-z]+|[a-z]+)", quoted):
            assert command in registered(), command
    unquoted = re.sub(r"`[^`]+`", "", text)
    for key in re.findall(r"\b(?:[a-z]+\.)?([a-z]+(?:_[A-Za-z]+)+)\b", unquoted):
        assert key in keys or f"{key}_shape" in keys or key in RELIEFS, key
    for other in re.findall(r"\b[WE]\d\d\b", text):
        assert other in codes()


RELIEFS = {"driver_tip_relief", "driven_tip_relief"}  # tables of a mesh


def option_names(command: object) -> set[str]:
    return {
        name
        for parameter in command.params
        for name in (*parameter.opts, *parameter.secondary_opts)
    }


def test_a_code_ends_a_line():
    assert with_code("W03", "the teeth jam") == "the teeth jam [W03]"
    with pytest.raises(KeyError):
        with_code("W00", "the teeth jam")


@pytest.mark.parametrize("end", ["", " [W00]", " [E01]", "[W03]", " [W03] so"])
def test_a_warning_without_its_code_is_refused(end, capsys):
    with pytest.raises(ValueError, match="must end with a code such as"):
        print_warnings([f"the teeth jam{end}"])
    assert capsys.readouterr().err == ""


def test_a_warning_with_its_code_is_printed(capsys):
    line = with_code("W03", "the teeth jam")
    assert require_warning_code(line) == line
    print_warnings([line])
    assert capsys.readouterr().err == "warning: the teeth jam [W03]\n"


def test_explain_prints_all_titles_or_whole_entries():
    titles = printed("explain")
    for code, entry in codes().items():
        assert f"  {code}  {entry.title}" in titles
    assert "cause" not in titles
    warning, evidence = codes()["W03"], codes()["E01"]
    values = json.loads(printed("explain", "E01", "w03", "E01", "--json"))
    assert values["codes"] == [asdict(evidence), asdict(warning)]
    text = " ".join(printed("explain", "W03", "E01").split())
    for part in (*TEXTS["W03"].values(), *TEXTS["E01"].values()):
        assert part in text
    assert text.index("cause: ") < text.index("cure: ") < text.index("limits: ")


def test_evidence_lines_end_with_their_code():
    coarse = ("--resolution", "coarse")
    lines = printed("stiffness", "liu-pair", *coarse, "--positions", 8)
    assert "[E01]" in lines
    assert "[E02]" in lines
    titles = printed("compare", "liu-pair")
    assert "plane stress [E12]" in titles
    at_rest = printed("motion", "liu-pair", *coarse, "--speed", 2000)
    assert "[E03]" in at_rest
