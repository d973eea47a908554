"""fegear bench: run time against error."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from fegear.cli.options import SET_HELP, AsJson, PairName

EXAMPLES = {
    "stiffness": "fegear bench stiffness liu-pair -o bench",
    "dynamics": "fegear bench dynamics liu-pair -o bench",
    "lumped": "fegear bench lumped liu-idler -o bench",
    "all": "fegear bench all -o bench",
}
Directory = Annotated[
    Path,
    typer.Option(
        "-o", "--output", metavar="DIR", help="Directory for the table and the figure."
    ),
]
InputTorque = Annotated[
    float | None,
    typer.Option(
        "--torque",
        help="Torque on the input gear [N\u00a0m]. [default: middle load case of the "
        "gear set]",
    ),
]


def stiffness_benchmark(
    set_name: PairName = "liu-pair",
    torque: Annotated[
        float,
        typer.Option(
            "--torque", help="Torque on the driving gear of mesh 1 [N\u00a0m]."
        ),
    ] = 100.0,
    output: Directory = Path("bench-stiffness"),
    as_json: AsJson = False,
) -> None:
    """Statics over mesh size, element order and contact grid."""
    from fegear.cli.bench_outcome import run_bench
    from fegear.cli.bench_stiffness import measure_stiffness, show_stiffness
    from fegear.cli.options import driver_torque
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    load = driver_torque(gear_set, 1, torque)
    measure = partial(measure_stiffness, gear_set, load)
    run_bench("stiffness", measure, show_stiffness, output, as_json)


def dynamics_benchmark(
    set_name: PairName = "liu-pair",
    torque: InputTorque = None,
    output: Directory = Path("bench-dynamics"),
    as_json: AsJson = False,
) -> None:
    """Finite-element dynamics over time steps and modes."""
    from fegear.cli.bench_dynamics import measure_dynamics, show_dynamics
    from fegear.cli.bench_outcome import run_bench
    from fegear.cli.lumped_options import middle_torque
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    measure = partial(measure_dynamics, gear_set, middle_torque(gear_set, torque))
    run_bench("dynamics", measure, show_dynamics, output, as_json)


def lumped_benchmark(
    set_name: Annotated[
        str | None,
        typer.Argument(metavar="SET", help=f"{SET_HELP} [default: liu-idler]"),
    ] = None,
    stress: Annotated[
        bool,
        typer.Option(
            "--stress", help="Try to break the models instead, on one train of its own."
        ),
    ] = False,
    torque: InputTorque = None,
    damping: Annotated[
        float | None,
        typer.Option(
            "--damping",
            help="Damping ratio of every vibration mode. [default: that of the gear "
            "set, else 0.04]",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Directory for the table and the figure. [default: bench-lumped, "
            "none with --stress]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Time integrators of the lumped models beside SciPy's."""
    from fegear.cli.options import refuse_idle

    if stress:
        from fegear.cli.bench_lumped import run_stress

        if set_name is not None:
            refuse_idle(f"it runs on a train of its own, not {set_name}", stress=True)
        refuse_idle("--stress has its own", torque=torque, damping=damping)
        run_stress(output, as_json)
        return
    from fegear.cli.bench_lumped import measure_lumped, show_lumped
    from fegear.cli.bench_outcome import run_bench
    from fegear.cli.lumped_options import Physics, middle_torque
    from fegear.gearset import load_gear_set

    Physics(damping=damping)  # checks it
    gear_set = load_gear_set(set_name or "liu-idler")
    load = middle_torque(gear_set, torque)
    measure = partial(measure_lumped, gear_set, load, damping)
    place = output or Path("bench-lumped")
    run_bench("lumped", measure, show_lumped, place, as_json)


def all_benchmarks(
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="DIR", help="Directory for index.html and more."
        ),
    ] = Path("bench"),
    as_json: AsJson = False,
) -> None:
    """All benchmarks on one page, index.html."""
    from fegear.cli.bench_all import run_all

    run_all(output, as_json)
