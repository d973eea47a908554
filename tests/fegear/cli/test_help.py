"""Help in plain words: every option with unit and default, every command's example."""

from __future__ import annotations

import inspect
import re
import shlex
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from cli_commands import commands
from page_commands import GUIDES, ROOT, commands_of, files_of
from typer.testing import CliRunner

from fegear.cli import app

UNITS = (
    *(
        "N/m",
        "N",
        "m/s",
        "N.m",
        "Hz",
        "rpm",
        "base pitches",
        "pixels",
        "1/um",
        "um",
        "mm",
    ),
    *("kg m2", "m2/N", "rad", "rad per turn", "turns", "degrees", "modules", "s"),
)
UNIT = re.compile(rf"\[({'|'.join(UNITS)})\]")
NO_UNIT = ("ratio", "coefficient", "tolerance", "deviation", "over its mean")
# left out, nothing is done in their place; files are not written
WITHOUT_DEFAULT = {
    "--at",
    "--band",
    "--from-rpm",
    "--history",
    "--root-stress",
    "--rpm",
    "--set",
    "--table",
    "--time-history",
}


MAX_HELP_LINES = 180
COMMANDS = dict(commands())
OPTIONS = [
    (name, param)
    for name, command in COMMANDS.items()
    for param in command.params
    if param.opts[0].startswith("-")
]


def label(value: Any) -> str:
    return value if isinstance(value, str) else max(value.opts, key=len)


@cache
def rendered(name: str) -> str:
    """Help on a screen of 80 columns, its lines joined again."""
    result = CliRunner(env={"COLUMNS": "80"}).invoke(app, [*name.split(), "--help"])
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert len(lines) < MAX_HELP_LINES
    start = next((i for i, line in enumerate(lines) if "Example:" in line), len(lines))
    assert max(map(len, lines[:start])) <= 80
    text = "\n".join(lines)
    return " ".join(re.sub(r"-\n\s+", "-", text).split())  # a word at its hyphen


@pytest.mark.parametrize(("command", "param"), OPTIONS, ids=label)
def test_an_option_says_what_it_is_its_unit_and_its_default(command, param):
    help_text = param.help or ""
    assert len(help_text) > 10
    name = max(param.opts, key=len)
    page = rendered(command)
    assert help_text.replace("\u00a0", " ") in page.replace("\u00a0", " ")
    hints = get_type_hints(inspect.unwrap(COMMANDS[command].callback))
    if "float" in str(hints[param.name]) or name in ("--speeds", "--rpm", "--band"):
        assert UNIT.search(help_text) or any(w in help_text for w in NO_UNIT)
    is_flag = getattr(param, "is_flag", False)
    is_file = hints[param.name] == Path | None
    if not (is_flag or is_file or name in WITHOUT_DEFAULT):
        entry = page.partition(f" {name} ")[2]
        entry = re.split(r" --[a-z-]+[ /]", entry.replace(help_text, "", 1))[0]
        assert param.required or "[default: " in help_text + entry


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_has_an_example_that_can_be_typed(command):
    example = COMMANDS[command].epilog.splitlines()[-1].strip()
    assert len(example) <= 78
    assert parsed(example) == command


def parsed(line: str) -> str:
    """The command of a line, whose options are parsed and not run."""
    program, *arguments = shlex.split(line)
    assert program == "fegear"
    depth = 2 if arguments[0] in ("bench", "rattle") else 1
    command = " ".join(arguments[:depth])
    COMMANDS[command].make_context(command, arguments[depth:])
    return command


TUTORIALS = [page for page in GUIDES if page.startswith("docs/tutorials/")]


@pytest.mark.parametrize("page", ["README.md", *GUIDES])
def test_commands_in_the_documentation_can_be_typed(page):
    lines = commands_of(page)
    assert len(lines) > 5 or page not in ("README.md", "docs/gallery.md")
    for line in lines:
        parsed(line)


def test_links_and_pictures_of_the_readme_exist():
    """Those of the other pages are checked where the documentation is built."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)\s]+)\)", text)
    assert len(targets) > 10
    for target in targets:
        assert target.startswith("https:") or (ROOT / target).exists(), target


WRITES = {"-o", "--output", "--plot", "--contact", "--drawing", "--gears", ">"}
WRITES |= {"--bearing-forces", "--spectrum"}


@pytest.mark.parametrize("page", ["README.md", *TUTORIALS])
def test_files_that_a_page_reads_are_there_before(page):
    """Each is written by a command above or is printed whole, with its name."""
    existing = set(files_of(page))
    for line in commands_of(page):
        arguments = shlex.split(line, comments=True)
        outputs = {word for before, word in pairwise(arguments) if before in WRITES}
        inputs = {word for word in arguments if re.search(r"\w\.(toml|csv)$", word)}
        assert inputs <= outputs | existing, line
        existing |= outputs


def test_the_readme_names_its_sources():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    sources = text.partition("## Sources")[2]
    for author, year in (("Liu", "2007"), ("Mason", "2008"), ("Eschmann", "1987")):
        assert re.search(rf"{author}.*?{year}", sources, re.DOTALL)


def test_the_list_of_commands_is_not_cut_off():
    result = CliRunner(env={"COLUMNS": "80"}).invoke(app, ["--help"])
    assert "..." not in result.stdout.partition("Commands:")[2]
    for name, command in COMMANDS.items():
        if " " not in name:
            assert name in result.stdout
            assert command.help.splitlines()[0] in result.stdout


def test_version(capsys):
    from fegear.cli import run
    from fegear.files.version import package_version

    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"fegear {package_version()}\n"


def test_words_are_completed(monkeypatch, capsys):
    from fegear.cli import run

    monkeypatch.setenv("_FEGEAR_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "fegear stiffness --re")
    monkeypatch.setenv("COMP_CWORD", "2")
    assert run([]) == 0
    assert capsys.readouterr().out.split() == ["--resolution"]
