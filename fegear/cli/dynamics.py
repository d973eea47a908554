"""fegear dynamics: the finite-element gears in motion."""

from __future__ import annotations

import time
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from fegear.cli.edits import Edits, edit_entries, parsed_edits
from fegear.cli.lumped_options import (
    Damping,
    MaxPeriods,
    Physics,
    SetName,
    Steps,
    Tolerance,
    Translations,
    checked_settings,
    chosen_torques,
    file_header,
    parsed_speeds,
    strict_json,
    usual_speeds,
)
from fegear.cli.options import progress_bar, require_outputs
from fegear.cli.sweep import (
    DirectionChoice,
    end_sweep,
    print_sweep,
    sweep_summary,
    write_sweep,
)


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
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="A:B:STEP",
            help="Mesh frequencies of the first mesh [Hz]; a number or a list with "
            "commas as well [default: 0.5 to 1.3 times the resonances].",
        ),
    ] = None,
    direction: Annotated[
        DirectionChoice, typer.Option(help="In which the speed changes.")
    ] = DirectionChoice.both,
    torque: Annotated[
        list[float] | None,
        typer.Option(
            help="On the input gear [N m]; may be repeated "
            "[default: all load cases of the gear set]."
        ),
    ] = None,
    edits: Edits = None,
    damping: Damping = None,
    translations: Translations = False,
    steps: Steps = 64,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the rows, CSV.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the response, PNG.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the summary as JSON.")
    ] = False,
) -> None:
    """Vibration over speed with contact solved by finite elements.

    The CSV columns are those of `fegear sweep`, so that one plot overlays both.
    Contact on the back flanks is left out.

    Example: fegear dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv
    """
    from fegear.gearset import load_gear_set

    begin = time.perf_counter()
    require_outputs([output, plot], [set_name])
    changes = parsed_edits(edits)
    gear_set = load_gear_set(set_name, changes)
    physics = Physics(
        model=1,
        translations=translations,
        damping=damping,
        excitation="fe",
        ramp=0.0,
        harmonics=1,
        tables=(),
    )
    settings = checked_settings("rk4", steps, tolerance, max_periods)
    frequencies = None if speeds is None else parsed_speeds(speeds)
    torques = chosen_torques(gear_set, torque or [])
    from fegear.cli.lumped_options import system_at
    from fegear.force_law import LawExcitations
    from lumped.sweep import sweep_all

    laws = LawExcitations()
    # the law knows no back flanks, so that teeth apart stay apart
    open_ended = tuple(replace(m, backlash=float("inf")) for m in gear_set.meshes)
    one_sided = replace(gear_set, meshes=open_ended)
    with progress_bar(enabled=not as_json) as report:
        report("contact law", 0, 1)
        systems = [system_at(one_sided, t, physics, laws) for t in torques]
        if frequencies is None:
            frequencies = usual_speeds(systems[0])
        branches = sweep_all(
            systems,
            frequencies,
            direction.directions,
            settings,
            lambda done, total: report("sweep", done, total),
        )
    each = [t for t in torques for _ in direction.directions]
    found = list(zip(each, branches, strict=True))
    ratio = systems[0].train.damping_ratio
    header = file_header(gear_set, physics, settings, ratio) | edit_entries(changes)
    write_sweep(found, fidelity.value, header, output, plot)
    values = sweep_summary(found, fidelity.value, header, frequencies)
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    if as_json:
        typer.echo(strict_json(values), nl=False)
    else:
        print_sweep(values)
    end_sweep(found)
