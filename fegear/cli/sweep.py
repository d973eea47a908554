"""fegear sweep: the frequency response of a gear set."""

from __future__ import annotations

import time
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from fegear.cli.edits import edit_entries, parsed_edits, refuse_idle_edits
from fegear.cli.lumped_options import (
    Damping,
    Excitation,
    Harmonics,
    LoadCases,
    MaxPeriods,
    Method,
    MethodChoice,
    Model,
    Physics,
    Ramp,
    SolvedPlane,
    SolvedResolution,
    Speeds,
    Steps,
    Tables,
    Tolerance,
    Translations,
    checked_settings,
    chosen_torques,
    speeds_of,
)
from fegear.cli.options import (
    AsJson,
    Edits,
    Output,
    Plot,
    SetName,
    progress_bar,
    require_outputs,
)
from fegear.cli.sweep_report import SweepOutputs, SweepResult, tell_sweep
from fegear.cli.systems import (
    excitations_of,
    file_header,
    integration_in_words,
    require_elements_used,
    system_at,
    usual_speeds,
)

if TYPE_CHECKING:
    from fegear.cli.sweep_report import Branches
    from fegear.gearset.model import GearSet
    from lumped.sweep import Branch, Direction

EXAMPLE = "fegear sweep liu-idler --speeds 800:4200:20 -o s.csv --plot s.png"


class DirectionChoice(StrEnum):
    up = "up"
    down = "down"
    both = "both"

    @property
    def directions(self) -> tuple[Direction, ...]:
        return ("up", "down") if self.value == "both" else (self.value,)  # type: ignore[return-value]


SweepDirection = Annotated[
    DirectionChoice,
    typer.Option(
        "--direction",
        help="Whether the speed rises, falls, or first rises and then falls.",
    ),
]


def sweep_command(
    set_name: SetName,
    model: Model = 1,
    speeds: Speeds = None,
    rpm: Annotated[
        str | None,
        typer.Option(
            "--rpm",
            metavar="A:B:STEP",
            help="Rotational speeds of the first mesh's driver [rpm], in place of "
            "--speeds.",
        ),
    ] = None,
    direction: SweepDirection = DirectionChoice.both,
    torque: LoadCases = None,
    edits: Edits = None,
    damping: Damping = None,
    translations: Translations = False,
    excitation: Excitation = None,
    ramp: Ramp = None,
    harmonics: Harmonics = None,
    plane: SolvedPlane = None,
    resolution: SolvedResolution = None,
    table: Tables = None,
    steps: Steps = None,
    method: Method = MethodChoice.rk4,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    output: Output = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Vibration of a lumped train over speed.

    Resonances, jumps and loss of contact, with the speed rising and falling.
    """
    from fegear.gearset import load_gear_set

    require_outputs([output], [set_name, *(table or ())], plot)
    changes = parsed_edits(edits, torque=torque, damping=damping)
    gear_set = load_gear_set(set_name, changes)
    physics = Physics(
        model=model,
        translations=translations,
        damping=damping,
        excitation=excitation,
        ramp=ramp,
        harmonics=harmonics,
        tables=tuple(table or ()),
        plane=plane,
        resolution=resolution,
    )
    refuse_idle_edits(changes, physics)
    settings = checked_settings(method, steps, tolerance, max_periods)
    frequencies = asked_frequencies(gear_set, speeds, rpm)
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    excitations = excitations_of(physics, gear_set)
    from lumped.sweep import sweep_all

    with progress_bar(enabled=not as_json) as report:
        report("stiffness", 0, 1)
        systems = [system_at(gear_set, each, physics, excitations) for each in torques]
        require_elements_used(physics, excitations)
        frequencies = frequencies or usual_speeds(systems[0])
        branches = sweep_all(
            systems,
            frequencies,
            direction.directions,
            settings,
            lambda done, total: report("sweep", done, total),
        )
    ratio = systems[0].train.damping_ratio
    words = integration_in_words(settings)
    header = file_header(gear_set, physics, words, ratio) | edit_entries(changes)
    result = SweepResult(
        gear_set=gear_set,
        model=str(model),
        header=header,
        frequencies=frequencies,
        found=at_torques(torques, direction, branches),
    )
    tell_sweep(result, SweepOutputs(csv=output, plot=plot, as_json=as_json), begin)


def asked_frequencies(
    gear_set: GearSet, speeds: str | None, rpm: str | None
) -> list[float] | None:
    """Frequencies of the first mesh [Hz] by either option, None if neither is given."""
    from fegear.errors import InputError

    if speeds is not None and rpm is not None:
        raise InputError("--speeds and --rpm exclude each other")
    if rpm is not None:
        teeth = gear_set.gears[gear_set.meshes[0].driver].geometry.teeth
        return [turns * teeth / 60.0 for turns in speeds_of(rpm, "--rpm")]
    return None if speeds is None else speeds_of(speeds)


def at_torques(
    torques: tuple[float, ...], direction: DirectionChoice, branches: list[Branch]
) -> Branches:
    """Branches with their torques; all directions of a torque follow each other."""
    each = [torque for torque in torques for _ in direction.directions]
    return list(zip(each, branches, strict=True))
