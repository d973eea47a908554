"""Answers of commands on small gear sets, each computed once."""

from __future__ import annotations

import contextlib
import io
import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from short_uses import written_inputs
from small_sets import Tables

from fegear.cli import run
from fegear.files.toml import toml_text

# what a command only repeats of its input, and what differs from run to run
REPEATED = {
    "center_distance_mm",
    "damping_ratio",
    "excitation",
    "face_width_mm",
    "fidelity",
    "friction_coefficient",
    "gear_set",
    "load_share",
    "mean_std",
    "model",
    "origin",
    "peak_memory_MB",
    "plane",
    "positions",
    "resolution",
    "seconds",
    "sliding",
    "speeds",
    "stiffness_variation",
    "teeth",
    "torque_Nm",
    "torque_of",
    "translations",
    "variation_std",
    "wall_time_s",
    "warnings",
    "corner_contact",
    "driver_torque_Nm",
}


class Outcome(NamedTuple):
    code: int
    answer: Any


def outcome(folder: Path, arguments: list[str]) -> Outcome:
    """Exit code, what was printed and what was written, in a folder of its own."""
    before, out = Path.cwd(), io.StringIO()
    folder.mkdir(parents=True)
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            code = run(arguments)
    finally:
        os.chdir(before)
    files = {
        str(path.relative_to(folder)): content(path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    text = out.getvalue()
    with contextlib.suppress(ValueError):
        return Outcome(code, (without_repeated(json.loads(text)), files))
    return Outcome(code, (text, files))


def without_repeated(values: Any) -> Any:
    """Numbers that differ by less than what a solver leaves open are equal."""
    if isinstance(values, dict):
        return {k: without_repeated(v) for k, v in values.items() if k not in REPEATED}
    if isinstance(values, list):
        return [without_repeated(v) for v in values]
    return float(f"{values:.9g}") if isinstance(values, float) else values


def content(data: bytes) -> bytes:
    """A file without the header that repeats the input."""
    if data.startswith(b"# "):
        return b"\n".join(li for li in data.splitlines() if not li.startswith(b"# "))
    return data


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, str]:
    """Paths for the words in capitals."""
    return written_inputs(tmp_path_factory.mktemp("inputs"))


@pytest.fixture(scope="module")
def answers(tmp_path_factory, files):
    """Outcomes of a command on the tables of a gear set, each computed once."""
    folder, outcomes = tmp_path_factory.mktemp("answers"), {}

    def answer(command: str, tables: Tables) -> Outcome:
        text = toml_text(tables)
        if (command, text) not in outcomes:
            gear_set = folder / f"{len(outcomes)}.toml"
            gear_set.write_text(text)
            paths = files | {"SET": str(gear_set)}
            arguments = [paths.get(word, word) for word in command.split()]
            outcomes[command, text] = outcome(folder / str(len(outcomes)), arguments)
        return outcomes[command, text]

    return answer
