"""A command's folder is all there is of it: without it everything else works."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from source_files import ROOT
from test_architecture import MODULES, imports_of

import validation.commands  # noqa: F401  its folders, too
from fegear.studies.registry import folders

FOLDERS = [folder.__name__ for folder in folders()]
QUICK = ("fegear.commands.sweep", "fegear.commands.rattle")
# Starts all commands but those that need the folder which is missing, and their help.
START = """
import sys
from fegear.cli import run
from fegear.studies import load_study
from fegear.studies.registry import commands
needed = set(sys.argv[1:])
assert run(["--help"]) == 0
for name, command in commands().items():
    if command.package not in needed:
        load_study(name)
        assert run([*name.split(), "--help"]) == 0, name
print(*(command.package for command in commands().values()))
"""


def in_folder(module: str, folder: str) -> bool:
    return module == folder or module.startswith(f"{folder}.")


def users_of(folder: str) -> set[str]:
    """Folders of commands with a module that needs one of a folder."""
    reached = {module for module in MODULES if in_folder(module, folder)}
    while True:
        more = {m for m in MODULES if m not in reached and imports_of(m) & reached}
        if not more:
            break
        reached |= more
    return {
        f.__name__ for f in folders() if any(in_folder(m, f.__name__) for m in reached)
    }


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_other_command_imports_it(folder):
    importing = {
        module
        for module in MODULES
        if not in_folder(module, folder)
        and (folder.startswith("validation.") or not module.startswith("validation."))
        and any(in_folder(name, folder) for name in imports_of(module))
    }
    assert importing == set()


@pytest.mark.parametrize(
    "folder",
    [pytest.param(f, marks=[pytest.mark.slow] * (f not in QUICK)) for f in FOLDERS],
)
def test_all_other_commands_start_without_it(folder, tmp_path):
    copied = ROOT / Path(*folder.split("."))
    _link_all_but(ROOT, copied, tmp_path)
    arguments = [sys.executable, "-c", START, *users_of(folder)]
    done = subprocess.run(
        arguments, cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    started = done.stdout.splitlines()[-1].split()
    assert folder not in started
    assert len(set(started)) == len(folders()) - 1


def _link_all_but(source: Path, left_out: Path, target: Path) -> None:
    """A folder of links to all that another one has, but one folder below it."""
    for path in source.iterdir():
        if path == left_out or path.name.startswith("."):
            continue
        if path in left_out.parents:
            (target / path.name).mkdir()
            _link_all_but(path, left_out, target / path.name)
        elif path.name in LINKED or source != ROOT:
            (target / path.name).symlink_to(path)


LINKED = "fegear", "lumped", "meshes", "validation", "pyproject.toml"
