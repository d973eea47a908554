"""The main commands run where Python lacks the modules of Unix, as on Windows."""

from __future__ import annotations

import subprocess
import sys

import pytest
from written_tables import read_sweep

UNIX_ONLY = ("fcntl", "resource", "pwd", "grp", "termios")
RUN = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name in {names!r}:
            raise ModuleNotFoundError("No module named " + name, name=name)

for name in {names!r}:
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Blocker())
from fegear.cli import app

for words in {commands!r}:
    assert not app(words.split(), standalone_mode=False), words
"""
COMMANDS = (
    "sets",
    "show liu-pair",
    "stiffness liu-pair --resolution coarse --positions 4 -o t.csv --plot t.png",
    "modes liu-idler",
    "sweep liu-idler --excitation rectangular --speeds 900 --torque 50 -o s.csv",
    "motion liu-idler --excitation rectangular --speed 900 --torque 50 -o w.csv",
    "map liu-idler --excitation rectangular --over mesh.2.phase=0,1 --at 900 -o m.csv",
    "dynamics liu-pair --fidelity quasistatic --resolution coarse --torque 100 "
    "--speeds 2000 --direction up -o d.csv",
)


@pytest.mark.slow
def test_without_the_modules_of_unix(tmp_path):
    code = RUN.format(names=UNIX_ONLY, commands=COMMANDS)
    process = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=300,
    )
    assert process.returncode == 0, process.stderr
    outputs = ["d.csv", "m.csv", "s.csv", "t.csv", "t.png", "w.csv"]
    assert sorted(path.name for path in tmp_path.iterdir()) == outputs
    assert len(read_sweep(str(tmp_path / "d.csv")).rows) == 1
