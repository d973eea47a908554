"""fegear bench stiffness: what it measures and prints."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from fegear.cli.bench_outcome import Outcome
from fegear.cli.screen import ruled_table, screen

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from fegear.statics import Progress
    from validation.bench_stiffness import Point


def measure_stiffness(gear_set: GearSet, torque: float, report: Progress) -> Outcome:
    """Run time against error over mesh size, element order, grid and split."""
    from validation import bench_stiffness as bench

    points: list[Point] = []
    interrupted = False
    try:
        for point in bench.run_benchmark(gear_set, torque, report):
            points.append(point)  # one by one, to keep them at Ctrl-C
    except KeyboardInterrupt:
        interrupted = True
    title = f"Statics of {gear_set.name}, {torque:g} N m"
    orders = {
        f"observed order of the mean STE, {study}": bench.observed_order(points, study)
        for study in dict.fromkeys(p.study for p in points)
        if study != "contact grid"
    }
    return Outcome(
        name="stiffness",
        title=title,
        about="Static transmission error over mesh size, element order, contact grid "
        "and split, against a reference of much finer meshes.",
        points=points,
        draw=lambda: bench.draw_points(points, title),
        values={"points": [asdict(point) for point in points]} | orders,
        interrupted=interrupted,
    )


def show_stiffness(outcome: Outcome) -> None:
    table = ruled_table(
        "study",
        "flank\nedges",
        "contact\nnodes",
        "compl.\n[s]",
        "contact\n[ms]",
        "error\nmean",
        "error\npath",
        "error\ncorner",
    )
    for p in outcome.points:
        table.add_row(
            p.study,
            str(p.flank_edges),
            str(p.contact_nodes),
            f"{p.compliance_s:.3f}",
            f"{1e3 * p.contact_s:.2f}",
            f"{p.error_mean:.1e}",
            f"{p.error_path:.1e}",
            f"{p.error_corner:.1e}",
        )
    console = screen()
    console.print(table)
    for name, value in outcome.values.items():
        if name != "points":
            console.print(f"{name}: {value:.2f}")
