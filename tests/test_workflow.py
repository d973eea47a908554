"""The workflow of continuous integration runs what the README tells."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
WORKFLOW = (ROOT / ".github" / "workflows" / "test.yml").read_text("utf-8")
README = (ROOT / "README.md").read_text("utf-8")


def test_commands_are_those_of_the_readme():
    commands = re.findall(r"^ *- run: (.+)$", WORKFLOW, re.MULTILINE)
    assert len(commands) == 3
    development = README.split("```sh\n")[2].partition("\n```")[0]
    steps = development.replace(".venv-test/bin/", "").split(" && ")
    assert steps == ["python3 -m venv .venv-test", *commands]


def test_system_libraries_are_those_of_the_documentation():
    (command,) = re.findall(r"^ *(apt-get install .+)$", WORKFLOW, re.MULTILINE)
    page = (ROOT / "docs" / "howto" / "install.md").read_text("utf-8")
    assert f"\n{command}\n" in page


def test_oldest_python_is_that_of_the_package():
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    (oldest,) = re.findall(r'^requires-python = ">=(.+)"$', project, re.MULTILINE)
    (versions,) = re.findall(r"^ *python: \[(.+)\]$", WORKFLOW, re.MULTILINE)
    assert versions.split(", ")[0] == f'"{oldest}"'
