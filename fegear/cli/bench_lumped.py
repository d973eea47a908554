"""fegear bench lumped: what it measures and prints."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.bench_outcome import Outcome
from fegear.cli.options import progress_bar
from fegear.cli.screen import print_json, ruled_table, screen
from fegear.cli.systems import build_system

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from fegear.statics import Progress
    from validation.bench_lumped import Growth, Point


def measure_lumped(
    gear_set: GearSet, torque: float, damping: float | None, report: Progress
) -> Outcome:
    """Run time against error, the race with SciPy, and growth with size."""
    from fegear.excitation import Excitations
    from validation import bench_lumped as bench

    points: list[Point] = []
    growth: list[Growth] = []
    sweep: dict[str, Any] = {}
    interrupted = False
    report("stiffness", 0, 1)
    system = build_system(gear_set, torque, 1, False, damping, Excitations())
    try:
        for point in bench.run_benchmark(system, report):
            points.append(point)  # one by one, to keep them at Ctrl-C
        report("growth", 0, 1)
        growth += bench.growth(system)
        sweep["sweep_warm_s"], sweep["sweep_speeds"] = bench.sweep_seconds(system)
    except KeyboardInterrupt:
        interrupted = True
    title = f"Lumped model 1 of {gear_set.name}, {torque:g} N m"
    whole = {p.study for p in points} >= {"rk4", "SciPy DOP853", "SciPy LSODA"}
    return Outcome(
        name="lumped",
        title=title,
        about="Settled vibration of the lumped train by own integrators and SciPy's, "
        "against the tightest tolerances.",
        points=points,
        draw=lambda: bench.draw_points(points, title),
        values={
            "points": [asdict(point) for point in points],
            "races": [asdict(r) for r in bench.races(points)] if whole else [],
            "growth": [asdict(item) for item in growth],
            **sweep,
        },
        interrupted=interrupted,
    )


def show_lumped(outcome: Outcome) -> None:
    values = outcome.values
    console = screen()
    table = ruled_table(
        "integrator",
        "setting",
        "ms per\nspeed",
        "us per\nperiod",
        "error of RMS,\nmedian",
        "largest",
    )
    for p in values["points"]:
        table.add_row(
            p["study"],
            f"{p['setting']:g}",
            f"{p['ms_per_speed']:.3g}",
            f"{p['us_per_period']:.3g}",
            f"{p['error_median']:.1e}",
            f"{p['error_largest']:.1e}",
        )
    console.print(table)
    for race in values["races"]:
        console.print(
            f"{race['study']} {race['setting']:g}, error {race['own_error']:.1e}: "
            f"{race['ratio']:.0f} times faster per speed than SciPy {race['method']} "
            f"at rtol {race['rtol']:g}, error {race['error']:.1e}"
        )
    growth = ruled_table("growth with", "size", "seconds", "us per speed\nor period")
    for item in values["growth"]:
        growth.add_row(
            item["study"],
            str(item["size"]),
            f"{item['seconds']:.4f}",
            f"{item['per_item_us']:.3g}",
        )
    console.print(growth)
    if "sweep_warm_s" in values:
        console.print(
            f"sweep of {values['sweep_speeds']} speeds, up and down, warm: "
            f"{values['sweep_warm_s']:.2f} s"
        )


def run_stress(output: Path | None, as_json: bool) -> None:
    """The table of promises and measurements; exit code 1 if one is not kept."""
    from fegear.output import make_directory, require_writable, write_text
    from validation.stress_lumped import run_trials, trials_csv

    if output is not None:
        make_directory(output)
        require_writable(output / "stress.csv")
    with progress_bar(enabled=not as_json) as report:
        trials = list(run_trials(report))
    if output is not None:
        write_text(output / "stress.csv", trials_csv(trials))
    if as_json:
        rows = [asdict(trial) | {"kept": trial.kept} for trial in trials]
        print_json({"trials": rows})
    else:
        names = ("attempt", "promise", "measured", "allowed", "kept")
        table = ruled_table(*names, words=names[:2])
        for trial in trials:
            table.add_row(
                trial.name,
                trial.promise,
                f"{trial.measured:.2g}",
                f"{trial.bound:.2g}",
                "yes" if trial.kept else "NO",
            )
        console = screen()
        console.print(table)
        kept = sum(trial.kept for trial in trials)
        console.print(f"{kept} of {len(trials)} promises kept")
    if not all(trial.kept for trial in trials):
        raise typer.Exit(1)
