"""Wrong input ends a command with one line and exit code 2, before anything is done.

A line of `wrong_inputs/*.txt` is a command, and a part of the line that it ends with,
or all of that line where it begins with `fegear: `.
"""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from cli_commands import refused

FILES = sorted(Path(__file__).with_name("wrong_inputs").glob("*.txt"))
LINES = [line for file in FILES for line in file.read_text("utf-8").splitlines()]


@pytest.mark.parametrize("line", LINES)
def test_wrong_input_is_one_line_before_anything_is_done(
    capsys, monkeypatch, tmp_path, line
):
    monkeypatch.chdir(tmp_path)
    command, _, message = line.partition(" | ")
    error = refused(capsys, *shlex.split(command))
    if message.startswith("fegear: "):
        assert error == f"{message}\n"
    else:
        assert message in error
    assert not list(tmp_path.iterdir())
