"""fegear bench: run time against error."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

bench_app = typer.Typer(help="Run time against error.")


@bench_app.callback()
def benchmarks() -> None:
    """Run time against error."""


@bench_app.command("stiffness")
def stiffness_benchmark(
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-pair",
    torque: Annotated[
        float, typer.Option(help="Torque on the driving gear [N m].")
    ] = 100.0,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Directory for CSV and PNG.")
    ] = Path("bench-stiffness"),
) -> None:
    """Static stiffness over mesh size, element order, contact grid and split.

    Example: fegear bench stiffness liu-pair -o bench
    """
    from fegear.cli.options import checked_torques, progress_bar
    from fegear.gearset import load_gear_set
    from fegear.output import make_directory, require_writable, write_whole

    gear_set = load_gear_set(set_name)
    checked_torques([torque])
    make_directory(output)
    require_writable(output / "stiffness.csv")
    from fegear.plots import save_figure
    from validation import bench_stiffness as bench

    points: list[bench.Point] = []
    interrupted = False
    with progress_bar(enabled=True) as report:
        try:
            for point in bench.run_benchmark(gear_set, torque, report):
                points.append(point)  # one by one, to keep them at Ctrl-C
        except KeyboardInterrupt:
            interrupted = True
    if not points:
        raise KeyboardInterrupt
    table, picture = output / "stiffness.csv", output / "stiffness.png"
    write_whole(table, lambda path: bench.write_points(points, path))
    title = f"{gear_set.name}, {torque:g} N m: run time against error"
    figure = bench.draw_points(points, title)
    write_whole(picture, lambda path: save_figure(figure, path))
    _print_points(points)
    typer.echo(f"wrote {table} and {picture}")
    if interrupted:
        raise KeyboardInterrupt


def _print_points(points: list) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from validation.bench_stiffness import observed_order

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("study", no_wrap=True)
    for name in (
        "flank\nedges",
        "contact\nnodes",
        "compl.\n[s]",
        "contact\n[ms]",
        "error\nmean",
        "error\npath",
        "error\ncorner",
    ):
        table.add_column(name, justify="right")
    for p in points:
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
    console = Console()
    console.print(table)
    for study in dict.fromkeys(p.study for p in points):
        if study != "contact grid":
            order = observed_order(points, study)
            console.print(f"observed order of the mean STE, {study}: {order:.2f}")


@bench_app.command("dynamics")
def dynamics_benchmark(
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-pair",
    torque: Annotated[
        float | None, typer.Option(help="On the input gear [N m].")
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Directory for CSV and PNG.")
    ] = Path("bench-dynamics"),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as JSON.")
    ] = False,
) -> None:
    """Fidelities of the finite elements in motion over steps, modes and mesh.

    Example: fegear bench dynamics liu-pair -o bench
    """
    from fegear.cli.bench_dynamics import run_bench

    run_bench(set_name, torque, output, as_json)


@bench_app.command("lumped")
def lumped_benchmark(
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-idler",
    stress: Annotated[
        bool,
        typer.Option(
            "--stress",
            help="Try to break the models instead, on Table 2.1's idler.",
        ),
    ] = False,
    torque: Annotated[
        float | None, typer.Option(help="On the input gear [N m].")
    ] = None,
    damping: Annotated[float | None, typer.Option(help="Damping ratio.")] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Directory for CSV and PNG [default: bench-lumped, none for stress].",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as JSON.")
    ] = False,
) -> None:
    """Integrators against a tight reference and SciPy, growth, stress.

    Example: fegear bench lumped liu-idler -o bench; fegear bench lumped --stress
    """
    if stress:
        from fegear.cli.bench_lumped import run_stress

        run_stress(output, as_json)
    else:
        from fegear.cli.bench_lumped import run_speed

        place = output or Path("bench-lumped")
        run_speed(set_name, torque, damping, place, as_json)
