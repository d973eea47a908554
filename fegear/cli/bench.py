"""fegear bench: run time against error."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

AsJson = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]
OUTPUT_HELP = "Directory for CSV and PNG."

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
    output: Annotated[Path, typer.Option("-o", "--output", help=OUTPUT_HELP)] = Path(
        "bench-stiffness"
    ),
    as_json: AsJson = False,
) -> None:
    """Static stiffness over mesh size, element order, contact grid and split.

    Example: fegear bench stiffness liu-pair -o bench
    """
    from fegear.cli.bench_outcome import run_bench
    from fegear.cli.bench_stiffness import measure_stiffness, show_stiffness
    from fegear.cli.options import checked_torques
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    checked_torques([torque])
    measure = partial(measure_stiffness, gear_set, torque)
    run_bench("stiffness", measure, show_stiffness, output, as_json)


@bench_app.command("dynamics")
def dynamics_benchmark(
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-pair",
    torque: Annotated[
        float | None, typer.Option(help="On the input gear [N m].")
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help=OUTPUT_HELP)] = Path(
        "bench-dynamics"
    ),
    as_json: AsJson = False,
) -> None:
    """Fidelities of the finite elements in motion over steps, modes and mesh.

    Example: fegear bench dynamics liu-pair -o bench
    """
    from fegear.cli.bench_dynamics import measure_dynamics, show_dynamics
    from fegear.cli.bench_outcome import run_bench
    from fegear.cli.lumped_options import middle_torque
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    measure = partial(measure_dynamics, gear_set, middle_torque(gear_set, torque))
    run_bench("dynamics", measure, show_dynamics, output, as_json)


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
    as_json: AsJson = False,
) -> None:
    """Integrators against a tight reference and SciPy, growth, stress.

    Example: fegear bench lumped liu-idler -o bench; fegear bench lumped --stress
    """
    if stress:
        from fegear.cli.bench_lumped import run_stress

        run_stress(output, as_json)
        return
    from fegear.cli.bench_lumped import measure_lumped, show_lumped
    from fegear.cli.bench_outcome import run_bench
    from fegear.cli.lumped_options import middle_torque
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    load = middle_torque(gear_set, torque)
    measure = partial(measure_lumped, gear_set, load, damping)
    place = output or Path("bench-lumped")
    run_bench("lumped", measure, show_lumped, place, as_json)


@bench_app.command("all")
def all_benchmarks(
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Directory of the page.")
    ] = Path("bench"),
    as_json: AsJson = False,
) -> None:
    """Statics, lumped and finite-element dynamics on one page, index.html.

    Example: fegear bench all -o bench
    """
    from fegear.cli.bench_all import run_all

    run_all(output, as_json)
