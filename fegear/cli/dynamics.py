"""fegear dynamics: the finite-element gears in motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.dynamics_run import Run, history_keeper, root_influences, run_sweeps
from fegear.cli.edits import edit_entries, parsed_edits, refuse_idle_edits
from fegear.cli.lumped_options import (
    Damping,
    LoadCases,
    MaxPeriods,
    Physics,
    SolvedPlane,
    SolvedResolution,
    Speeds,
    Tolerance,
    Translations,
    chosen_torques,
    settings_of,
    speeds_of,
)
from fegear.cli.options import (
    AsJson,
    Edits,
    Output,
    Plot,
    SetName,
    progress_bar,
    refuse_idle,
    require,
    require_friction,
    require_outputs,
)
from fegear.cli.screen import complain, say
from fegear.cli.sweep import DirectionChoice, SweepDirection, at_torques
from fegear.cli.sweep_report import SweepOutputs, SweepResult, tell_sweep
from fegear.cli.systems import (
    file_header,
    most_in_words,
    solved_excitations,
    system_at,
    usual_speeds,
)

if TYPE_CHECKING:
    from fegear.dynamics.build import FiniteElements, Prepared
    from fegear.dynamics.respond import DynamicSettings
    from lumped.sweep import Branch

EXAMPLE = "fegear dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv"
ELASTIC_DAMPING = 0.01  # where the option is not given


class FidelityChoice(StrEnum):
    auto = "auto"
    full = "full"
    reduced = "reduced"
    quasistatic = "quasistatic"


def dynamics_command(
    set_name: SetName,
    fidelity: Annotated[
        FidelityChoice,
        typer.Option(
            "--fidelity",
            help="What moves. full: all degrees of freedom of the finite elements; "
            "reduced: hubs and elastic modes of the gears; quasistatic: hubs alone, "
            "without elastic inertia; auto: reduced where elastic inertia matters, "
            "else quasistatic.",
        ),
    ] = FidelityChoice.auto,
    speeds: Speeds = None,
    direction: SweepDirection = DirectionChoice.both,
    torque: LoadCases = None,
    edits: Edits = None,
    friction: Annotated[
        float, typer.Option("--friction", help="Coulomb friction coefficient.")
    ] = 0.0,
    damping: Damping = None,
    elastic_damping: Annotated[
        float | None,
        typer.Option(
            "--elastic-damping",
            help="Damping ratio of the first elastic modes of the gears. [default: "
            f"{ELASTIC_DAMPING:g}]",
        ),
    ] = None,
    translations: Translations = False,
    cutoff: Annotated[
        float | None,
        typer.Option(
            "--cutoff",
            help="Natural frequency [Hz] up to which elastic modes are considered. "
            "[default: 7 times the highest speed, or more]",
        ),
    ] = None,
    plane: SolvedPlane = None,
    resolution: SolvedResolution = None,
    steps: Annotated[
        int,
        typer.Option(
            "--steps", help="Least number of time steps per period of the fastest mesh."
        ),
    ] = 128,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    model_1: Annotated[
        bool,
        typer.Option(
            "--model-1", help="Run lumped model 1 as well and show both results."
        ),
    ] = False,
    output: Output = None,
    plot: Plot = None,
    history: Annotated[
        Path | None,
        typer.Option(
            "--history",
            metavar="DIR",
            help="Write a CSV file for each speed into this directory: load and "
            "contact pressure of every tooth pair and motion of the hubs over one "
            "period.",
        ),
    ] = None,
    root_stress: Annotated[
        str | None,
        typer.Option(
            "--root-stress",
            metavar="GEAR",
            help="Add the root stress of this gear's teeth to the files of --history.",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with an interrupted run to the same --output.",
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Vibration of finite-element gears over speed.

    The CSV columns are those of `fegear sweep`. With --output each finished speed is
    kept in FILE.partial until the file is written; --resume goes on from there.
    """
    from fegear.errors import InputError
    from fegear.gearset import load_gear_set

    require_outputs([output], [set_name], plot)
    if resume and output is None:
        raise InputError("--resume needs the --output of the run to go on with")
    if root_stress is not None and history is None:
        raise InputError("--root-stress needs --history")
    changes = parsed_edits(edits, torque=torque, damping=damping)
    gear_set = load_gear_set(set_name, changes)
    physics = Physics(
        translations=translations, damping=damping, plane=plane, resolution=resolution
    )
    refuse_idle_edits(changes, physics)
    elements = _checked_elements(fidelity, friction, elastic_damping, cutoff)
    settings = _checked_settings(steps, tolerance, max_periods)
    frequencies = None if speeds is None else speeds_of(speeds)
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    with progress_bar(enabled=not as_json) as report:
        report("stiffness", 0, 1)
        excitations = solved_excitations(physics)
        systems = [system_at(gear_set, each, physics, excitations) for each in torques]
        frequencies = frequencies or usual_speeds(systems[0])
        run = Run(gear_set, torques, systems, frequencies, direction.directions)
        report("pair laws and modes", 0, 1)
        prepared = _prepare(run, elements, settings, excitations)
        header = _header(run, physics, settings, elements, prepared)
        header |= edit_entries(changes)
        records = f"{history}, root stress of {root_stress}" if history else "none"
        roots = root_influences(gear_set, root_stress, excitations.source.statics)
        keep = history_keeper(run, prepared, settings, header, history, roots)
        branches = run_sweeps(
            *(run, prepared, settings, header, output, records, resume, keep, report)
        )
        beside = _model_1(run, report) if model_1 else []
    if not as_json:
        _print_choice(torques, prepared)
    if output is not None and not all(branch.complete for branch in branches):
        complain(f"{output}.partial is kept, --resume goes on there")
    result = SweepResult(
        gear_set=gear_set,
        model=prepared[0].fidelity,
        header=header,
        frequencies=frequencies,
        found=at_torques(torques, direction, branches),
        beside=at_torques(torques, direction, beside) if model_1 else (),
    )
    tell_sweep(result, SweepOutputs(csv=output, plot=plot, as_json=as_json), begin)


def _checked_elements(
    fidelity: FidelityChoice,
    friction: float,
    elastic_damping: float | None,
    cutoff: float | None,
) -> FiniteElements:
    from fegear.dynamics.build import FiniteElements

    if fidelity == FidelityChoice.quasistatic:
        without = "--fidelity quasistatic has no elastic modes"
        refuse_idle(without, elastic_damping=elastic_damping, cutoff=cutoff)
    if fidelity == FidelityChoice.full:
        refuse_idle("--fidelity full keeps all elastic modes", cutoff=cutoff)
    require_friction(friction)
    ratio = ELASTIC_DAMPING if elastic_damping is None else elastic_damping
    require(0.0 <= ratio < 1.0, "--elastic-damping", ratio, "allowed 0 to below 1")
    if cutoff is not None:
        require(0.0 < cutoff <= 3e5, "--cutoff", cutoff, "allowed above 0 to 3e5 Hz")
    return FiniteElements(
        fidelity=fidelity.value,
        friction=friction,
        elastic_damping=ratio,
        cutoff_Hz=cutoff,
    )


def _checked_settings(
    steps: int, tolerance: float, max_periods: int | None
) -> DynamicSettings:
    from fegear.dynamics.respond import DynamicSettings

    values = {"steps": steps, "tolerance": tolerance, "max_periods": max_periods}
    return settings_of(DynamicSettings, **values)


def _prepare(
    run: Run, elements: FiniteElements, settings: DynamicSettings, excitations: Any
) -> list[Prepared]:
    """A stepper for every torque, all of the same fidelity."""
    from fegear.dynamics.build import prepare

    def prepared(elements: FiniteElements) -> list[Prepared]:
        given = run.frequencies, elements, settings, excitations
        return [
            prepare(run.gear_set, torque, system, *given)
            for torque, system in zip(run.torques, run.systems, strict=True)
        ]

    found = prepared(elements)
    if len({each.fidelity for each in found}) > 1:
        found = prepared(replace(elements, fidelity="reduced"))
    return found


def _header(
    run: Run,
    physics: Physics,
    settings: DynamicSettings,
    elements: FiniteElements,
    prepared: Sequence[Prepared],
) -> dict[str, str]:
    ratio = run.systems[0].train.damping_ratio
    words = (
        f"generalised-alpha, {settings.steps} steps per period or more, tolerance "
        f"{settings.tolerance:g}, up to {most_in_words(settings.max_periods)}"
    )
    header = file_header(run.gear_set, physics, words, ratio)
    kept = "; ".join(" + ".join(map(str, each.elastic)) or "0" for each in prepared)
    return header | {
        "fidelity": prepared[0].fidelity,
        "elastic freedoms": kept,
        "elastic damping ratio": f"{elements.elastic_damping:g}",
        "friction coefficient": f"{elements.friction:g}",
    }


def _model_1(run: Run, report: Callable[[str, int, int], None]) -> list[Branch]:
    from lumped.sweep import sweep_all

    return sweep_all(
        run.systems,
        run.frequencies,
        run.directions,
        report=lambda done, total: report("Model-1", done, total),
    )


def _print_choice(torques: Sequence[float], prepared: Sequence[Prepared]) -> None:
    for torque, each in zip(torques, prepared, strict=True):
        say(f"{torque:g} N m, {each.reason}")
