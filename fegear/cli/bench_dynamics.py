"""fegear bench dynamics: what it prints and writes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.bench_lumped import figure_table
from fegear.cli.lumped_options import build_system, middle_torque, strict_json
from fegear.cli.options import progress_bar

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from validation.bench_dynamics import Bench, Growth, Point


def run_bench(set_name: str, torque: float | None, output: Path, as_json: bool) -> None:
    """Run time against error over steps, modes and mesh, and growth with gears."""
    from fegear.gearset import load_gear_set
    from fegear.output import make_directory, require_writable
    from validation import bench_dynamics as study

    gear_set = load_gear_set(set_name)
    load = middle_torque(gear_set, torque)
    make_directory(output)
    require_writable(output / "dynamics.csv")
    points: list[Point] = []
    growth: list[Growth] = []
    interrupted = False
    with progress_bar(enabled=not as_json) as report:
        report("stiffness", 0, 1)
        bench = _bench(gear_set, load)
        try:
            for point in study.run_benchmark(bench, report):
                points.append(point)  # one by one, to keep them at Ctrl-C
            report("growth", 0, 1)
            for gears in study.ROWS:
                row = _bench(study.row_of_gears(gear_set, gears), load)
                growth.append(study.growth(row))
        except KeyboardInterrupt:
            interrupted = True
    if not points:
        raise KeyboardInterrupt
    _write(points, output, f"{gear_set.name}, {load:g} N m: run time against error")
    values = {
        "points": [asdict(point) for point in points],
        "growth": [asdict(item) for item in growth],
        "peak_memory_MB": round(_peak_memory_MB()),
    }
    if as_json:
        typer.echo(strict_json(values), nl=False)
    else:
        _print(values, points)
        typer.echo(f"wrote {output / 'dynamics.csv'} and {output / 'dynamics.png'}")
    if interrupted:
        raise KeyboardInterrupt


def _bench(gear_set: GearSet, torque: float) -> Bench:
    from fegear.excitation import Excitations
    from validation.bench_dynamics import Bench

    excitations = Excitations()
    reference = build_system(gear_set, torque, 1, False, None, excitations)
    return Bench(gear_set, torque, reference, excitations)


def _peak_memory_MB() -> float:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _write(points: list[Point], output: Path, title: str) -> None:
    from fegear.output import write_whole
    from fegear.plots import save_figure
    from validation import bench_dynamics as study
    from validation.points import write_points

    write_whole(output / "dynamics.csv", lambda path: write_points(points, path))
    figure = study.draw_points(points, title)
    write_whole(output / "dynamics.png", lambda path: save_figure(figure, path))


def _print(values: dict[str, Any], points: list[Point]) -> None:
    from rich.console import Console

    from validation.bench_dynamics import observed_order

    console = Console(highlight=False, markup=False)
    table = figure_table(
        "study",
        "setting",
        "elastic\nfreedoms",
        "prepare\n[s]",
        "us per\nstep",
        "error of DTE,\nmedian",
        "largest",
    )
    for p in values["points"]:
        table.add_row(
            p["study"],
            f"{p['setting']:g}",
            str(p["freedoms"]),
            f"{p['prepare_s']:.2f}",
            f"{p['us_per_step']:.3g}",
            f"{p['error_median']:.1e}",
            f"{p['error_largest']:.1e}",
        )
    console.print(table)
    if sum(p.study == "steps" for p in points) > 1:
        console.print(f"observed order over the steps: {observed_order(points):.2f}")
    growth = figure_table("gears in a row", "coordinates", "us per step")
    for item in values["growth"]:
        growth.add_row(
            str(item["gears"]), str(item["coordinates"]), f"{item['us_per_step']:.2f}"
        )
    console.print(growth)
    console.print(f"largest memory: {values['peak_memory_MB']} MB")
