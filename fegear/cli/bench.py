"""fegear bench: run time against error."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fegear.cli.groups import grouped
from fegear.cli.options import (
    RATIO,
    SET_HELP,
    AsJson,
    PairName,
    progress_bar,
    refuse_idle,
    require_outputs,
)
from fegear.cli.screen import print_json, ruled_table, say, screen
from fegear.files.errors import InputError

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from lumped.common.progress import Progress
    from validation.bench.benchmark import Benchmark

    Measure = Callable[[Progress], Benchmark]

EXAMPLES = {
    "stiffness": "fegear bench stiffness liu-pair -o bench",
    "dynamics": "fegear bench dynamics liu-pair -o bench",
    "lumped": "fegear bench lumped liu-idler -o bench",
    "branches": "fegear bench branches liu-idler -o bench",
    "stability": "fegear bench stability liu-friction -o bench",
    "eccentric": "fegear bench eccentric -o bench",
    "clatter": "fegear bench clatter -o bench",
    "all": "fegear bench all -o bench",
}
PAIR, TRAIN, TORQUE = "liu-pair", "liu-idler", 100.0  # N m, of `bench all`
RUBBING = "liu-friction"
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


Damping = Annotated[
    float | None,
    typer.Option(
        help="Damping ratio of every vibration mode. [default: that of the gear "
        "set, else 0.04]"
    ),
    RATIO,
]


def _torque(gear_set: GearSet, asked: float | None, mesh: int | None = None) -> float:
    """The torque asked for [N m], or the middle load case.

    mesh : counted from 1, on whose driver it is; on the input gear without one
    """
    from fegear.studies.trains import chosen_torque

    try:
        return chosen_torque(gear_set, asked, mesh)
    except InputError as error:
        raise InputError(f"--{error}") from None  # it begins with the setting


def stiffness_benchmark(
    set_name: PairName = PAIR,
    torque: Annotated[
        float,
        typer.Option(
            "--torque", help="Torque on the driving gear of mesh 1 [N\u00a0m]."
        ),
    ] = TORQUE,
    output: Directory = Path("bench-stiffness"),
    as_json: AsJson = False,
) -> None:
    """Statics over mesh size, element order and contact grid."""
    from fegear.gearset import load_gear_set
    from validation.bench import bench_stiffness

    gear_set = load_gear_set(set_name)
    load = _torque(gear_set, torque, mesh=1)
    _run("stiffness", partial(bench_stiffness.measure, gear_set, load), output, as_json)


def dynamics_benchmark(
    set_name: PairName = PAIR,
    torque: InputTorque = None,
    output: Directory = Path("bench-dynamics"),
    as_json: AsJson = False,
) -> None:
    """Finite-element dynamics over time steps and modes."""
    from fegear.gearset import load_gear_set
    from validation.bench import bench_dynamics

    gear_set = load_gear_set(set_name)
    load = _torque(gear_set, torque)
    _run("dynamics", partial(bench_dynamics.measure, gear_set, load), output, as_json)


@grouped
def lumped_benchmark(
    *,
    set_name: Annotated[
        str | None,
        typer.Argument(metavar="SET", help=f"{SET_HELP} [default: {TRAIN}]"),
    ] = None,
    stress: Annotated[
        bool,
        typer.Option(
            "--stress", help="Try to break the models instead, on one train of its own."
        ),
    ] = False,
    torque: InputTorque = None,
    damping: Damping = None,
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
    if stress:
        if set_name is not None:
            refuse_idle(f"it runs on a train of its own, not {set_name}", stress=True)
        refuse_idle("--stress has its own", torque=torque, damping=damping)
        _run_stress(output, as_json)
        return
    from fegear.gearset import load_gear_set
    from validation.bench import bench_lumped

    gear_set = load_gear_set(set_name or TRAIN)
    load = _torque(gear_set, torque)
    measure = partial(bench_lumped.measure, gear_set, load, damping)
    _run("lumped", measure, output or Path("bench-lumped"), as_json)


def branches_benchmark(
    set_name: Annotated[
        str, typer.Argument(metavar="SET", help=f"{SET_HELP} [default: {TRAIN}]")
    ] = TRAIN,
    torque: InputTorque = None,
    damping: Damping = None,
    output: Directory = Path("bench-branches"),
    as_json: AsJson = False,
) -> None:
    """Periodic motions by harmonic balance beside sweeps."""
    from fegear.gearset import load_gear_set
    from validation.bench import bench_branches

    gear_set = load_gear_set(set_name)
    load = _torque(gear_set, torque)
    measure = partial(bench_branches.measure, gear_set, load, damping)
    _run("branches", measure, output, as_json)


def stability_benchmark(
    set_name: Annotated[
        str, typer.Argument(metavar="SET", help=f"{SET_HELP} [default: {RUBBING}]")
    ] = RUBBING,
    torque: InputTorque = None,
    output: Directory = Path("bench-stability"),
    as_json: AsJson = False,
) -> None:
    """Floquet multipliers of trains with tooth friction, and closed forms."""
    from fegear.gearset import load_gear_set
    from validation.bench import bench_stability

    load = _torque(load_gear_set(set_name), torque)
    measure = partial(bench_stability.measure, set_name, load)
    _run("stability", measure, output, as_json)


def eccentric_benchmark(
    output: Directory = Path("bench-eccentric"), as_json: AsJson = False
) -> None:
    """Eccentric wheels: centre distance, and contact over the mesh size."""
    from validation.bench import bench_eccentric

    _run("eccentric", bench_eccentric.measure, output, as_json)


def clatter_benchmark(
    output: Directory = Path("bench-clatter"), as_json: AsJson = False
) -> None:
    """Clattering wheels: impacts per second, and the tolerance of events."""
    from validation.bench import bench_clatter

    _run("clatter", bench_clatter.measure, output, as_json)


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
    from fegear.files.output import strict_json, write_text
    from fegear.gearset import load_gear_set
    from validation.bench import (
        bench_branches,
        bench_clatter,
        bench_dynamics,
        bench_eccentric,
        bench_lumped,
        bench_stability,
        bench_stiffness,
    )
    from validation.bench.benchmark import write_page

    pair, train = load_gear_set(PAIR), load_gear_set(TRAIN)
    measures: dict[str, Measure] = {
        "stiffness": partial(bench_stiffness.measure, pair, TORQUE),
        "lumped": partial(bench_lumped.measure, train, TORQUE, None),
        "branches": partial(bench_branches.measure, train, TORQUE, None),
        "stability": partial(bench_stability.measure, RUBBING, TORQUE),
        "eccentric": bench_eccentric.measure,
        "clatter": bench_clatter.measure,
        "dynamics": partial(bench_dynamics.measure, pair, TORQUE),
    }
    others = [output / "index.html", output / "bench.json"]
    measured = _measured(measures, output, as_json, others)
    values = {each.name: each.values for each in measured}
    write_text(output / "bench.json", strict_json(values))
    command = shlex.join(["fegear", "bench", "all", "-o", str(output)])
    page = write_page(measured, output, command)
    if as_json:
        print_json(values)
    else:
        say(f"wrote {page}")
    if measured[-1].interrupted or len(measured) < len(measures):
        raise KeyboardInterrupt


def _run(name: str, measure: Measure, output: Path, as_json: bool) -> None:
    """Measure, write and print; after Ctrl-C what was finished."""
    from validation.bench.benchmark import files_of

    (measured,) = _measured({name: measure}, output, as_json)
    if as_json:
        print_json(measured.values)
    else:
        _show(measured)
        say("wrote {} and {}".format(*files_of(name, output)))
    if measured.interrupted:
        raise KeyboardInterrupt


def _measured(
    measures: Mapping[str, Measure],
    output: Path,
    as_json: bool,
    others: Sequence[Path] = (),
) -> list[Benchmark]:
    """Benchmarks with their files, after Ctrl-C those that have points.

    others : files that will be written besides
    """
    from fegear.files.output import make_directory
    from validation.bench.benchmark import files_of, write_benchmark

    make_directory(output)
    files = [path for name in measures for path in files_of(name, output)]
    require_outputs([*files, *others])
    measured: list[Benchmark] = []
    with progress_bar(enabled=not as_json) as report:
        for name, measure in measures.items():
            named = report if len(measures) == 1 else partial(_report_of, name, report)
            measured.append(measure(named))
            if measured[-1].interrupted:
                break
    measured = [each for each in measured if each.tables["points"]]
    if not measured:
        raise KeyboardInterrupt
    for each in measured:
        write_benchmark(each, output)
    return measured


def _report_of(name: str, report: Progress, what: str, done: int, total: int) -> None:
    report(f"{name}: {what}", done, total)


def _show(measured: Benchmark) -> None:
    console = screen()
    for rows in filter(None, measured.tables.values()):
        names = [name for name in rows[0] if name not in measured.left_out]
        table = ruled_table(*(name.replace("_", "\n") for name in names))
        for row in rows:
            table.add_row(*(_cell(row[name]) for name in names))
        console.print(table)
    for finding in measured.findings:
        console.print(finding)


def _cell(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"


def _run_stress(output: Path | None, as_json: bool) -> None:
    """The table of promises and measurements; exit code 1 if one is not kept."""
    from fegear.files.output import make_directory, write_text
    from validation.stress import stress_coupled, stress_lumped
    from validation.stress.trials import run_trials, trials_csv

    families = [*stress_lumped.TRIALS, *stress_coupled.TRIALS]

    path = None if output is None else make_directory(output) / "stress.csv"
    require_outputs([path])
    with progress_bar(enabled=not as_json) as report:
        trials = list(run_trials(families, report))
    if path is not None:
        write_text(path, trials_csv(trials))
    kept = sum(trial.kept for trial in trials)
    if as_json:
        rows = [asdict(trial) | {"kept": trial.kept} for trial in trials]
        print_json({"trials": rows})
    else:
        names = ("attempt", "promise", "measured", "allowed", "kept")
        table = ruled_table(*names, words=names[:2])
        for trial in trials:
            figures = f"{trial.measured:.2g}", f"{trial.bound:.2g}"
            word = "yes" if trial.kept else "NO"
            table.add_row(trial.name, trial.promise, *figures, word)
        console = screen()
        console.print(table)
        console.print(f"{kept} of {len(trials)} promises kept")
    if kept < len(trials):
        raise typer.Exit(1)
