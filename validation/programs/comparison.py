"""Numbers of ours beside those of another program: rows, their page and their file."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np

from validation.programs.exported_pair import Array, MeshMotion

RECORDED = Path(__file__).with_name("recorded")


@dataclass(frozen=True)
class ComparedValue:
    """A quantity by both programs.

    scale : of which the difference is a percentage; by default the value of ours
    tolerance : of the difference [%]; None where a larger one is explained on the page
    """

    quantity: str
    unit: str
    ours: float
    theirs: float
    scale: float | None = None
    tolerance: float | None = None

    @property
    def difference(self) -> float:
        """Theirs minus ours [%]."""
        return 100.0 * (self.theirs - self.ours) / (self.scale or abs(self.ours))

    @property
    def is_met(self) -> bool:
        """Whether the difference is within its tolerance, if there is one."""
        return self.tolerance is None or abs(self.difference) <= self.tolerance


Rows = Sequence[ComparedValue]


def compare_motions(
    label: str, ours: MeshMotion, theirs: MeshMotion, tolerance: float | None
) -> list[ComparedValue]:
    """Measures of two motions over a period, and the largest distance of both.

    tolerance : of all rows [%]
    """
    rows = []
    for name, unit, factor in (("deflection", "um", 1e6), ("force", "N", 1.0)):
        one, other = (factor * getattr(motion, name) for motion in (ours, theirs))
        at_our_times = np.interp(ours.time, theirs.time, other)
        distance = float(np.abs(at_our_times - one).max())
        values = {
            "mean": (_mean(ours.time, one), _mean(theirs.time, other), None),
            "peak to peak": (float(np.ptp(one)), float(np.ptp(other)), None),
            "largest distance": (0.0, distance, float(np.ptp(one))),
        }
        rows += [
            ComparedValue(f"{label}: {name}, {measure}", unit, a, b, scale, tolerance)
            for measure, (a, b, scale) in values.items()
        ]
    lost = [
        100.0 * _mean(m.time, (m.force <= 0.0).astype(np.float64))
        for m in (ours, theirs)
    ]
    if any(lost):
        lost_time = ComparedValue(
            f"{label}: contact lost", "% of time", lost[0], lost[1], 100.0
        )
        rows.append(lost_time)
    return rows


def _mean(time: Array, values: Array) -> float:
    """Mean over a period whose steps may differ."""
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def format_rows(rows: Rows) -> str:
    """A table in Markdown, which is also easy to read on a screen."""
    names = ("quantity", "unit", "fegear", "other program", "difference [%]")
    cells = [
        (r.quantity, r.unit, f"{r.ours:.6g}", f"{r.theirs:.6g}", f"{r.difference:.1g}")
        for r in rows
    ]
    widths = [max(map(len, column)) for column in zip(names, *cells, strict=True)]
    rule = tuple("-" * width for width in widths)
    return "\n".join(
        "| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |"
        for row in (names, rule, *cells)
    )


def record_rows(path: Path, rows: Rows, packages: Sequence[str]) -> None:
    """Write rows, versions of packages and the date of today to a JSON file."""
    content = {
        "date": datetime.now(UTC).date().isoformat(),
        "versions": {name: version(name) for name in packages},
        "rows": [asdict(row) for row in rows],
    }
    path.write_text(json.dumps(content, indent=1) + "\n", "utf-8")


def recorded_rows(name: str) -> list[ComparedValue]:
    """Rows of a file in `recorded`."""
    content = json.loads((RECORDED / f"{name}.json").read_text("utf-8"))
    return [ComparedValue(**row) for row in content["rows"]]


def recorded_page(name: str) -> str:
    """Versions, date and rows of a file in `recorded`, in Markdown."""
    content = json.loads((RECORDED / f"{name}.json").read_text("utf-8"))
    versions = ", ".join(f"{key} {text}" for key, text in content["versions"].items())
    rows = format_rows(recorded_rows(name))
    return f"Recorded on {content['date']} with {versions}.\n\n{rows}"


def run_comparison(
    description: str, compare: Callable[[Path], Rows], packages: Sequence[str]
) -> None:
    """Print the table of a folder of files, and record it where that is asked for.

    Ends with status 1 where a difference is larger than its tolerance.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with the files of export_files")
    parser.add_argument("--record", type=Path, help="write the rows to this JSON file")
    arguments = parser.parse_args()
    rows = compare(arguments.folder)
    sys.stdout.write(format_rows(rows) + "\n")
    if arguments.record:
        record_rows(arguments.record, rows, packages)
    if missed := [row.quantity for row in rows if not row.is_met]:
        sys.exit(f"beyond the tolerance: {', '.join(missed)}")
