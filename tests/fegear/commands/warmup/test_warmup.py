"""Kernels compiled before they are needed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from fegear.cli import run
from fegear.commands.warmup import study as warmup
from fegear.commands.warmup.study import COMPILED_DECORATOR, USES, kernel_folders
from lumped.common.compiled import CACHE_SUFFIX

# compiled inside others alone, by the record that these are called with
CHOSEN = {
    "record_friction",
    "set_friction_acceleration",
    "record_springs",
    "set_varied_acceleration",
    "record_bearings",
    "set_bearing_acceleration",
    "record_space",
    "set_space_acceleration",
}
# of the records of a step: springs, friction, bearings, space, and small changes
BY_RECORD = {
    "rk4.rk4_step": 5,
    "rk4.settle_motion": 4,
    "rk4.record_motion": 4,
    "mesh_force.set_spring_acceleration": 3,
}
# of a motion, whose arrays are whole, and of a column of small changes
BY_ORDER = {
    "coupled_variables.add_columns": 2,
    "coupled_variables.get_variables": 2,
    "coupled_variables.set_variables": 2,
    "coupled_steps.extrapolate": 2,
}
# with what some uses do not need, and without: small changes, derivatives by reliefs
BY_NEED = {"coupled_steps.set_start_forces": 2, "cycle.solve_cycle": 2}
FIRST_USES = """
import sys
from fegear.cli import run
from lumped.common.compiled import CompileCount
with CompileCount() as count:
    for line in sys.stdin:
        assert run(line.split()) == 0, line
print(count.signatures)
"""
BEARING = "gear.1.ball_bearing={balls=9,ball_diameter_mm=8,pitch_diameter_mm=39}"
COMMANDS = f"""\
stiffness --mesh 1 --friction 0.1
sweep liu-idler --speeds 1000:1100:100
sweep liu-pair --speeds 1000 --excitation rectangular --friction 0.1 --bending 0
sweep liu-pair --speeds 1000:1100:100 --model coupled --without body
dynamics liu-pair --torque 100 --speeds 1000:1100:100 --friction 0.1
branches liu-pair --torque 100 --speeds 1000:1010
branches liu-pair --torque 100 --speeds 1000:1010 --model coupled
rattle noise roots-scaled --starts 5
rattle noise roots-a-sprung --starts 5
rattle periodic roots-scaled --max-liftoffs 2
clatter seed-five-speed --seconds 1
stability liu-pair --over friction=0:0.1:3 --speeds 1400:1800:100
sweep liu-pair --speeds 1000 --excitation rectangular --translations --set {BEARING}
sweep turbo-pair --speeds 1000 --motion space --plane width --resolution coarse
signals liu-pair --speed 900:1000 --seconds 0.2 --excitation rectangular
signals liu-pair --speed 900:1000 --seconds 0.2 --model coupled
map liu-pair --over damping_ratio=0.03,0.04 --at 1000
bifurcations liu-pair --over damping_ratio=0.03,0.04 --at 1000
"""


def functions() -> set[str]:
    """Compiled functions of the sources, by module and name."""
    names = re.compile(f"{COMPILED_DECORATOR.pattern}\n+def (\\w+)", re.M)
    paths = [path for folder in kernel_folders() for path in folder.glob("*.py")]
    return {
        f"{path.stem}.{match[2]}"
        for path in paths
        for match in names.finditer(path.read_text("utf-8"))
        if match[2] not in CHOSEN
    }


def signatures(cache: Path) -> Counter[str]:
    """How many each function has, which may be in several folders."""
    counts = Counter[tuple[Path, str]]()
    for path in cache.rglob(f"*{CACHE_SUFFIX}"):
        counts[path.parent, path.name.rpartition("-")[0]] += 1
    most = Counter[str]()
    for (_, name), count in counts.items():
        most[name] = max(most[name], count)
    return most


def called(
    *arguments: str, cache: str, stdin: str | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        input=stdin,
        check=True,
    )


@pytest.mark.slow
def test_after_it_the_first_uses_compile_nothing(tmp_path):
    """Only a cache that was empty shows what is compiled, and for which arguments."""
    cache = str(tmp_path)
    process = called("-m", "fegear", "warmup", "--json", cache=cache)
    values = json.loads(process.stdout)
    counts = signatures(tmp_path)
    assert values["compiled_signatures"] == values["signatures"] == counts.total()
    assert functions() <= counts.keys()
    several = {name: count for name, count in counts.items() if count > 1}
    assert several == BY_RECORD | BY_ORDER | BY_NEED
    used = called("-c", FIRST_USES, cache=cache, stdin=COMMANDS)
    assert used.stdout.splitlines()[-1] == "0"


def test_what_two_processes_compile_at_once_counts_once():
    """The cache keeps one of them."""
    result = warmup.Warmup().gather({"a": {"f (int64,)", "g ()"}, "b": {"g ()"}})
    assert result.compiled == 2


def test_uses_are_as_many_as_their_list_says():
    for count, uses in USES.values():
        assert len(list(uses())) == count


def test_without_a_cache_that_can_be_written_one_line_says_so(monkeypatch, capsys):
    monkeypatch.setattr(warmup, "kernel_cache", lambda folder: None)
    assert run(["warmup"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "no cache directory can be written; set NUMBA_CACHE_DIR" in line


def test_ctrl_c_keeps_what_was_compiled(tmp_path):
    command = [sys.executable, "-m", "fegear", "warmup", "--only", "rattle"]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    process = subprocess.Popen(
        command, env=environment, stderr=subprocess.PIPE, text=True
    )
    while not signatures(tmp_path):
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error.splitlines()[-1] == "fegear: interrupted"
    assert signatures(tmp_path)
