"""fegear bench dynamics: what it measures and prints."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING

from fegear.cli.bench_outcome import Outcome
from fegear.cli.screen import ruled_table, screen
from fegear.cli.systems import build_system

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from fegear.statics import Progress
    from validation.bench_dynamics import Bench, Growth, Point


def measure_dynamics(gear_set: GearSet, torque: float, report: Progress) -> Outcome:
    """Run time against error over steps, modes and mesh, and growth with gears."""
    from fegear.memory import memory_level
    from validation import bench_dynamics as study

    points: list[Point] = []
    growth: list[Growth] = []
    interrupted = False
    level = memory_level()
    report("stiffness", 0, 1)
    bench = _bench(gear_set, torque)
    try:
        for point in study.run_benchmark(bench, report):
            points.append(point)  # one by one, to keep them at Ctrl-C
        report("growth", 0, 1)
        for gears in study.ROWS:
            row = _bench(study.row_of_gears(gear_set, gears), torque)
            growth.append(study.growth(row))
    except KeyboardInterrupt:
        interrupted = True
    title = f"Finite elements of {gear_set.name} in motion, {torque:g} N m"
    return Outcome(
        name="dynamics",
        title=title,
        about="Motion of the finite-element gears from rest over steps, elastic modes "
        "and mesh, against finer steps or all freedoms on a finer mesh.",
        points=points,
        draw=lambda: study.draw_points(points, title),
        values={
            "points": [asdict(point) for point in points],
            "growth": [asdict(item) for item in growth],
            "peak_memory_MB": level.peak_MB,
        },
        interrupted=interrupted,
    )


def _bench(gear_set: GearSet, torque: float) -> Bench:
    from fegear.excitation import Excitations
    from validation.bench_dynamics import Bench

    excitations = Excitations()
    reference = build_system(gear_set, torque, 1, False, None, excitations)
    return Bench(gear_set, torque, reference, excitations)


def show_dynamics(outcome: Outcome) -> None:
    from validation.bench_dynamics import observed_order

    console = screen()
    table = ruled_table(
        "study",
        "setting",
        "elastic\nfreedoms",
        "prepare\n[s]",
        "us per\nstep",
        "error of DTE,\nmedian",
        "largest",
    )
    for p in outcome.points:
        table.add_row(
            p.study,
            f"{p.setting:g}",
            str(p.freedoms),
            f"{p.prepare_s:.2f}",
            f"{p.us_per_step:.3g}",
            f"{p.error_median:.1e}",
            f"{p.error_largest:.1e}",
        )
    console.print(table)
    if sum(p.study == "steps" for p in outcome.points) > 1:
        order = observed_order(outcome.points)
        console.print(f"observed order over the steps: {order:.2f}")
    growth = ruled_table("gears in a row", "coordinates", "us per step")
    for item in outcome.values["growth"]:
        growth.add_row(
            str(item["gears"]), str(item["coordinates"]), f"{item['us_per_step']:.2f}"
        )
    console.print(growth)
    peak = outcome.values["peak_memory_MB"]
    if isfinite(peak):
        console.print(f"largest memory: {peak:.0f} MB")
