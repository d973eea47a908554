"""fegear dynamics: the finite-element gears in motion."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import Annotated

import typer

from fegear.cli.edits import Edits, parsed_edits
from fegear.cli.lumped_options import (
    AsJson,
    Damping,
    LoadCases,
    MaxPeriods,
    Output,
    Physics,
    Plot,
    SetName,
    Speeds,
    Steps,
    Tolerance,
    Translations,
    checked_settings,
    chosen_torques,
    parsed_speeds,
)
from fegear.cli.options import require_outputs
from fegear.cli.sweep import DirectionChoice, SweepTask, run_sweep


class FidelityChoice(StrEnum):
    quasistatic = "quasistatic"


def dynamics_command(
    set_name: SetName,
    fidelity: Annotated[
        FidelityChoice,
        typer.Option(
            help="quasistatic: hub motion on the contact law of the finite elements, "
            "without elastic inertia."
        ),
    ] = FidelityChoice.quasistatic,
    speeds: Speeds = None,
    direction: Annotated[
        DirectionChoice, typer.Option(help="In which the speed changes.")
    ] = DirectionChoice.both,
    torque: LoadCases = None,
    edits: Edits = None,
    damping: Damping = None,
    translations: Translations = False,
    steps: Steps = 64,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    output: Output = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Vibration over speed with contact solved by finite elements.

    The CSV columns are those of `fegear sweep`, so that one plot overlays both.
    Contact on the back flanks is left out.

    Example: fegear dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv
    """
    from fegear.gearset import load_gear_set

    require_outputs([output, plot], [set_name])
    changes = parsed_edits(edits)
    gear_set = load_gear_set(set_name, changes)
    physics = Physics(model=1, translations=translations, damping=damping)
    settings = checked_settings("rk4", steps, tolerance, max_periods)
    frequencies = None if speeds is None else parsed_speeds(speeds)
    torques = chosen_torques(gear_set, torque or [])
    from fegear.force_law import LawExcitations

    # the law knows no back flanks, so that teeth apart stay apart
    open_ended = tuple(replace(m, backlash=math.inf) for m in gear_set.meshes)
    run_sweep(
        SweepTask(
            gear_set=replace(gear_set, meshes=open_ended),
            word=fidelity.value,
            physics=physics,
            excitations=LawExcitations(),
            settings=settings,
            frequencies=frequencies,
            directions=direction.directions,
            torques=torques,
            changes=changes,
            output=output,
            plot=plot,
            as_json=as_json,
        )
    )
