"""What every command writes, recorded before a change and compared after it.

    python tests/recorded_commands.py record BEFORE
    python tests/recorded_commands.py record AFTER --only 12,13
    python tests/recorded_commands.py compare BEFORE AFTER

A folder for each command holds its files, screen and exit code. Numbers agree within
1e-10 of the largest of their column or key, words and pictures to the letter and
pixel; run times, memory and what names the sources of a run are left out.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

AGREEMENT = 1e-10
# run time, memory, and digests of the sources: of this run, not of its answer
OWN = re.compile(
    r"(wall[_ ]time|_time_s$|march_s|solving|solve_s|peak_memory|memory|cost|elapsed"
    r"|version|made_with|sources|sha256|digest|timed|prepare_s|per_speed|seconds|about)"
)
OWN_FILES = re.compile(r"figures/cost\.|(report|f)/(index\.html|report\.md)$")
DIGEST = re.compile(r"-[0-9a-f]{16}\b")
OWN_LINES = re.compile(
    r"wall time|^time:|own-case  model|memory|compiling|took| s per | s a speed"
    r"|fegear 0"
)
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

PAIR = """name = "own"
[defaults]
module_mm = 2.0
face_width_mm = 12.0
hub_radius_mm = 8.0
[[gear]]
name = "driver"
teeth = 23
profile_shift = 0.1
bearing_kx_N_per_m = 2e8
bearing_ky_N_per_m = 1e8
[[gear]]
name = "wheel"
teeth = 31
{errors}
[[mesh]]
driver = "driver"
driven = "wheel"
operating_pressure_angle_deg = 21.0
backlash_um = 60.0
[mesh.tip_relief]
magnitude_um = 8.0
length_pitches = 0.3
shape = "parabolic"
[load]
gear = "driver"
torques_Nm = [40.0]
"""
HELICAL = """name = "helical"
[defaults]
module_mm = 3.0
helix_angle_deg = 18.0
face_width_mm = 20.0
[[gear]]
name = "one"
teeth = 18
hub_radius_mm = 14.0
[[gear]]
name = "two"
teeth = 25
hub_radius_mm = 18.0
[[mesh]]
driver = "one"
driven = "two"
backlash_um = 60.0
misalignment_um = 10.0
[mesh.tip_relief]
magnitude_um = 10.0
length_pitches = 0.3
[load]
gear = "one"
torques_Nm = [60.0, 120.0]
"""
ERRORS = "pitch_errors_um = [" + ", ".join(["3.0", "0.0"] * 15 + ["-2.0"]) + "]"
CASE = """name = "own-case"
title = "Own case"
gear_set = "liu-pair"
torques_Nm = [100.0]
speeds_Hz = "1400:3000:200"
fidelity = "reduced"
[[model]]
number = 1
excitation = "fe"
[[model]]
number = 2
excitation = "fe"
[[metric]]
name = "rms_distance"
allowed = 0.2
reason = "for a comparison of two states of the program"
"""
GEARBOX = """name = "box"
[excitation]
frequency_Hz = 25.0
amplitude_mm = 0.15
[[wheel]]
name = "spur"
ratio = 0.87
base_radius_mm = 40.0
inertia_kg_m2 = 1e-3
tooth_play_mm = 0.1
tooth_restitution = 0.8
drag_Nm = -0.05
"""
MEASURED = "time_s,speed_rpm\n0,3000\n10,2704\n20,2437\n30,2197\n40,1980\n50,1785\n"
GIVEN = {
    "own.toml": PAIR.format(errors=""),
    "helical.toml": HELICAL,
    "errors.toml": PAIR.format(errors=ERRORS),
    "own-case.toml": CASE,
    "measured.csv": MEASURED,
    "box.toml": GEARBOX,
}
COMMANDS = Path(__file__).with_suffix(".txt").read_text().splitlines()
RESUMED = ("dynamics liu-pair --speeds 1000:2000:20 --torque 100 -o d.csv", "--resume")


def record(folder: Path, only: set[int], workers: int) -> None:
    """Run the commands, each in a folder of its own named after its number."""
    chosen = [n for n in range(len(COMMANDS) + 1) if not only or n in only]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda number: _record(folder, number), chosen))


def _record(folder: Path, number: int) -> None:
    place = folder / f"{number:02d}"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for name, text in GIVEN.items():
        (place / name).write_text(text)
    begin = time.perf_counter()
    command_line = COMMANDS[number] if number < len(COMMANDS) else RESUMED[0]
    if number == len(COMMANDS):
        _killed(place, command_line)
        command_line = " ".join(RESUMED)
    done = _run(command_line, place)
    for name in GIVEN:
        (place / name).unlink()
    (place / "command.txt").write_text(f"fegear {command_line}\n")
    (place / "screen.txt").write_text(done.stdout)
    (place / "errors.txt").write_text(done.stderr)
    (place / "code.txt").write_text(f"{done.returncode}\n")
    seconds = time.perf_counter() - begin
    sys.stderr.write(
        f"{number:02d} {seconds:6.1f} s, code {done.returncode}: {command_line}\n"
    )


def _command(command_line: str) -> list[str]:
    main = "from fegear.cli import main; main()"
    return [sys.executable, "-c", main, *shlex.split(command_line)]


def _environment() -> dict[str, str]:
    return os.environ | {"OPENBLAS_NUM_THREADS": "1", "COLUMNS": "100"}


def _run(command_line: str, place: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        _command(command_line),
        cwd=place,
        env=_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def _killed(place: Path, command_line: str) -> None:
    """The same run, killed after its first few speeds."""
    process = subprocess.Popen(
        _command(command_line), cwd=place, env=_environment(), stdout=subprocess.DEVNULL
    )
    written: set[int] = set()  # times at which the stored speeds changed
    while process.poll() is None and len(written) < 8:
        written |= {path.stat().st_mtime_ns for path in place.glob("d.csv.partial")}
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()


def compare(before: Path, after: Path) -> list[str]:
    """A line for each file that differs, and by how much."""
    differences = []
    for place in sorted(after.iterdir()):
        ones, others = _files(before / place.name), _files(place)
        command = (place / "command.txt").read_text().strip()
        for name in sorted(ones.keys() | others.keys()):
            if name not in ones or name not in others:
                missing = before if name not in ones else after
                differences.append(f"{place.name}/{name}: not in {missing}; {command}")
            elif difference := _difference(ones[name], others[name]):
                differences.append(f"{place.name}/{name}: {difference}; {command}")
    return differences


def _files(folder: Path) -> dict[str, Path]:
    """Paths by their names in the folder, without digests of the sources."""
    names = {
        DIGEST.sub("", path.relative_to(folder).as_posix()): path
        for path in folder.rglob("*")
        if path.is_file()
    }
    return {name: path for name, path in names.items() if not OWN_FILES.search(name)}


def _difference(one: Path, other: Path) -> str:
    if one.read_bytes() == other.read_bytes():
        return ""
    kind: Callable[[Path, Path], str] = {
        ".csv": _of_tables,
        ".json": _of_json,
        ".png": _of_pictures,
        ".gif": _of_pictures,
        ".vtu": _of_fields,
        ".npz": _of_arrays,
    }.get(one.suffix, _of_texts)
    if all(path.read_text(errors="replace").startswith("{") for path in (one, other)):
        kind = _of_json
    return kind(one, other)


def _of_tables(one: Path, other: Path) -> str:
    (comments, head, columns), (comments2, head2, columns2) = map(_table, (one, other))
    if head != head2:
        return f"columns {head} and {head2}"
    if wrong := _of_lines(comments, comments2):
        return wrong
    return _farthest(dict(zip(head, zip(columns, columns2, strict=True), strict=True)))


def _table(path: Path) -> tuple[list[str], list[str], list[list[str]]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    head, *rows = csv.reader([line for line in lines if not line.startswith("#")])
    return comments, head, [list(column) for column in zip(*rows, strict=True)]


def _farthest(columns: dict[str, tuple[list[Any], list[Any]]]) -> str:
    """The column that differs most, relative to its largest value."""
    worst = (0.0, "")
    for name, (values, others) in columns.items():
        if OWN.search(name):
            continue
        if len(values) != len(others):
            return f"{name}: {len(values)} and {len(others)} values"
        pairs = [
            (_as_number(a), _as_number(b))
            for a, b in zip(values, others, strict=True)
            if a != b and _plain(a) != _plain(b)
        ]
        if any(math.isnan(a) != math.isnan(b) for a, b in pairs):
            return f"{name}: words or empty cells differ"
        scale = max((abs(_as_number(a)) for a in values if _is_number(a)), default=0.0)
        for a, b in pairs:
            if not math.isnan(a):
                worst = max(worst, (abs(a - b) / (scale or 1.0), name))
            else:
                return f"{name}: words differ"
    return f"{worst[1]} by {worst[0]:.1e}" if worst[0] > AGREEMENT else ""


def _plain(value: Any) -> Any:
    return DIGEST.sub("", value) if isinstance(value, str) else value


def _is_number(value: Any) -> bool:
    return not math.isnan(_as_number(value))


def _as_number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _of_json(one: Path, other: Path) -> str:
    leaves: dict[str, tuple[list[Any], list[Any]]] = {}
    for place, path in enumerate((one, other)):
        for name, value in _leaves("", json.loads(path.read_text(encoding="utf-8"))):
            leaves.setdefault(name, ([], []))[place].append(value)
    return _farthest(leaves)


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}", inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _leaves(name, inner)
    else:
        yield name, value


def _of_texts(one: Path, other: Path) -> str:
    return _of_lines(
        *(p.read_text(encoding="utf-8").splitlines() for p in (one, other))
    )


def _of_lines(one: list[str], other: list[str]) -> str:
    line_lists = [
        [DIGEST.sub("", line) for line in lines if not OWN_LINES.search(line)]
        for lines in (one, other)
    ]
    if len(line_lists[0]) != len(line_lists[1]):
        return f"{len(line_lists[0])} and {len(line_lists[1])} lines"
    for a, b in zip(*line_lists, strict=True):
        if a != b and not _same_words(a, b):
            return f"{a[:80]!r} and {b[:80]!r}"
    return ""


def _same_words(a: str, b: str) -> bool:
    if OWN.search(a):
        return NUMBER.sub("0", a) == NUMBER.sub("0", b) or "sha256" in a
    one, other = ([float(x) for x in NUMBER.findall(line)] for line in (a, b))
    return NUMBER.sub("", a) == NUMBER.sub("", b) and np.allclose(
        one, other, rtol=AGREEMENT, atol=0.0
    )


def _of_pictures(one: Path, other: Path) -> str:
    from PIL import Image

    with Image.open(one) as a, Image.open(other) as b:
        frames = getattr(a, "n_frames", 1), getattr(b, "n_frames", 1)
        if a.size != b.size or frames[0] != frames[1]:
            return f"{a.size} x {frames[0]} and {b.size} x {frames[1]} pixels"
        worst = 0
        for frame in range(frames[0]):
            a.seek(frame), b.seek(frame)
            apart = np.array(a.convert("RGB"), int) - np.array(b.convert("RGB"), int)
            worst = max(worst, int(np.abs(apart).max()))
    return f"pixels by {worst} of 255" if worst else ""


def _of_fields(one: Path, other: Path) -> str:
    import meshio

    a, b = meshio.read(one), meshio.read(other)
    pairs = {"points": (a.points, b.points)}
    for kind in ("point_data", "cell_data", "field_data"):
        fields, others = getattr(a, kind), getattr(b, kind)
        if fields.keys() != others.keys():
            return f"{kind} {sorted(fields)} and {sorted(others)}"
        pairs |= {name: (fields[name], others[name]) for name in fields}
    pairs |= {"cells": tuple([c.data for c in mesh.cells] for mesh in (a, b))}  # type: ignore[dict-item]
    for name, (x, y) in pairs.items():
        flat, flat2 = (np.concatenate([np.ravel(part) for part in v]) for v in (x, y))
        if flat.size != flat2.size:
            return f"{name}: {flat.size} and {flat2.size} values"
        apart = np.nanmax(np.abs(flat - flat2)) / (np.nanmax(np.abs(flat)) or 1.0)
        if not apart <= AGREEMENT:
            return f"{name} by {apart:.1e}"
    return ""


def _of_arrays(one: Path, other: Path) -> str:
    with np.load(one) as a, np.load(other) as b:
        if a.keys() != b.keys():
            return f"arrays {sorted(a)} and {sorted(b)}"
        for name in a:
            if a[name].dtype.kind in "fc":
                same = np.allclose(a[name], b[name], AGREEMENT, 0.0, equal_nan=True)
            else:
                same = OWN.search(name) or np.array_equal(a[name], b[name])
            if not same:
                return f"{name} differs"
    return ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    verbs = parser.add_subparsers(dest="verb", required=True)
    recorder = verbs.add_parser("record")
    recorder.add_argument("folder", type=Path)
    recorder.add_argument("--only", default="", help="numbers with commas")
    recorder.add_argument("--workers", type=int, default=1)
    comparer = verbs.add_parser("compare")
    comparer.add_argument("before", type=Path)
    comparer.add_argument("after", type=Path)
    options = parser.parse_args()
    if options.verb == "record":
        only = {int(word) for word in options.only.split(",") if word}
        record(options.folder.absolute(), only, options.workers)
        return
    lines = compare(options.before, options.after)
    sys.stdout.write("".join(f"{line}\n" for line in lines) or "all agree\n")
    sys.exit(bool(lines))


if __name__ == "__main__":
    main()
