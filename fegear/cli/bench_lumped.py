"""fegear bench lumped: what it prints and writes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.lumped_options import build_system, middle_torque, strict_json
from fegear.cli.options import progress_bar

if TYPE_CHECKING:
    from rich.table import Table

    from validation.bench_lumped import Point


def run_speed(
    set_name: str,
    torque: float | None,
    damping: float | None,
    output: Path,
    as_json: bool,
) -> None:
    """Run time against error, the race with SciPy, and growth with size."""
    from fegear.excitation import Excitations
    from fegear.gearset import load_gear_set
    from fegear.output import make_directory, require_writable

    gear_set = load_gear_set(set_name)
    load = middle_torque(gear_set, torque)
    make_directory(output)
    require_writable(output / "lumped.csv")
    from validation import bench_lumped as bench

    points: list[Point] = []
    growth: list[bench.Growth] = []
    seconds: tuple[float, int] | None = None
    interrupted = False
    with progress_bar(enabled=not as_json) as report:
        report("stiffness", 0, 1)
        system = build_system(gear_set, load, 1, False, damping, Excitations())
        try:
            for point in bench.run_benchmark(system, report):
                points.append(point)  # one by one, to keep them at Ctrl-C
            report("growth", 0, 1)
            growth += bench.growth(system)
            seconds = bench.sweep_seconds(system)
        except KeyboardInterrupt:
            interrupted = True
    if not points:
        raise KeyboardInterrupt
    title = f"{gear_set.name}, model 1, {load:g} N m: run time against error"
    _write(points, output, title)
    whole = {p.study for p in points} >= {"rk4", "SciPy DOP853", "SciPy LSODA"}
    values: dict[str, Any] = {
        "points": [asdict(point) for point in points],
        "races": [asdict(r) for r in bench.races(points)] if whole else [],
        "growth": [asdict(item) for item in growth],
    }
    if seconds:
        values["sweep_warm_s"], values["sweep_speeds"] = seconds
    if as_json:
        typer.echo(strict_json(values), nl=False)
    else:
        _print_speed(values)
        typer.echo(f"wrote {output / 'lumped.csv'} and {output / 'lumped.png'}")
    if interrupted:
        raise KeyboardInterrupt


def _write(points: list[Point], output: Path, title: str) -> None:
    from fegear.output import write_whole
    from fegear.plots import save_figure
    from validation import bench_lumped as bench
    from validation.points import write_points

    write_whole(output / "lumped.csv", lambda path: write_points(points, path))
    figure = bench.draw_points(points, title)
    write_whole(output / "lumped.png", lambda path: save_figure(figure, path))


def _print_speed(values: dict[str, Any]) -> None:
    from rich.console import Console

    console = Console(highlight=False, markup=False)
    table = figure_table(
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
    growth = figure_table("growth with", "size", "seconds", "us per speed\nor period")
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
    from fegear.output import make_directory, require_writable, write_whole
    from validation.stress_lumped import run_trials, write_trials

    if output is not None:
        make_directory(output)
        require_writable(output / "stress.csv")
    with progress_bar(enabled=not as_json) as report:
        trials = list(run_trials(report))
    if output is not None:
        write_whole(output / "stress.csv", lambda path: write_trials(trials, path))
    if as_json:
        rows = [asdict(trial) | {"kept": trial.kept} for trial in trials]
        typer.echo(strict_json({"trials": rows}), nl=False)
    else:
        from rich.console import Console

        table = figure_table("attempt", "promise", "measured", "allowed", "kept")
        table.columns[1].justify = "left"
        for trial in trials:
            table.add_row(
                trial.name,
                trial.promise,
                f"{trial.measured:.2g}",
                f"{trial.bound:.2g}",
                "yes" if trial.kept else "NO",
            )
        console = Console(highlight=False, markup=False)
        console.print(table)
        kept = sum(trial.kept for trial in trials)
        console.print(f"{kept} of {len(trials)} promises kept")
    if not all(trial.kept for trial in trials):
        raise typer.Exit(1)


def figure_table(*columns: str) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for i, name in enumerate(columns):
        table.add_column(name, justify="left" if i == 0 else "right")
    return table
