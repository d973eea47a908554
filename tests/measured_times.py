"""Times of the tests by folder and by test.

    python -m pytest -n 0 --junitxml=times.xml
    python tests/measured_times.py times.xml

Times are of the clock, of a test with its fixtures; of processor time, where one
process runs alone on an idle machine.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

SLOWEST = 50
CLASSES = 5.0, 1.0, 0.05  # s


Measured = tuple[str, float]  # a test and its time [s]


def measured(path: Path) -> list[Measured]:
    """Each test of a JUnit file and its time [s], slowest first."""
    cases = ElementTree.parse(path).iter("testcase")
    times = [
        (f"{case.get('classname')}::{case.get('name')}", float(case.get("time", "0")))
        for case in cases
    ]
    return sorted(times, key=lambda item: -item[1])


def folder_of(test: str, depth: int) -> str:
    """Folder of a test below `tests`, at most so deep, or its file."""
    parts = test.partition("::")[0].split(".")
    return "/".join(parts[1 : depth + 1])


def sums(times: Iterable[Measured], depth: int) -> list[tuple[str, int, float]]:
    """Folders with the number of their tests and their time [s], slowest first."""
    counts, seconds = defaultdict[str, int](int), defaultdict[str, float](float)
    for test, time in times:
        counts[folder_of(test, depth)] += 1
        seconds[folder_of(test, depth)] += time
    rows = [(name, counts[name], seconds[name]) for name in counts]
    return sorted(rows, key=lambda row: -row[2])


def report(path: Path, depth: int) -> Iterable[str]:
    times = measured(path)
    total = sum(time for _, time in times)
    yield f"{len(times)} tests, {total:.0f} s"
    for limit in CLASSES:
        above = [time for _, time in times if time > limit]
        yield f"above {limit:g} s: {len(above)} tests, {sum(above):.0f} s"
    slowest = sum(time for _, time in times[:SLOWEST])
    yield f"the slowest {SLOWEST}: {slowest:.0f} s, {100.0 * slowest / total:.0f} %"
    yield f"\n{'seconds':>8} {'tests':>6}  folder"
    for name, count, seconds in sums(times, depth)[:SLOWEST]:
        yield f"{seconds:8.1f} {count:6}  {name}"
    yield f"\n{'seconds':>8}  test"
    for test, time in times[:SLOWEST]:
        yield f"{time:8.2f}  {test.removeprefix('tests.')}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, help="JUnit file of a run")
    parser.add_argument("--depth", type=int, default=3, help="of folders")
    options = parser.parse_args()
    print("\n".join(report(options.file, options.depth)))  # noqa: T201


if __name__ == "__main__":
    main()
