"""fegear branches: periodic motions of a gear set, stable and unstable."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import typer

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import Range, grouped, option
from fegear.cli.lumped_options import (
    HARMONICS,
    AnyModel,
    LoadCase,
    middle_torque,
)
from fegear.cli.options import Outputs
from fegear.cli.screen import counted, number, screen
from fegear.errors import InputError

EXAMPLE = "fegear branches liu-idler --speeds 700:4500 -o b.csv --plot b.png"


@dataclass(frozen=True, kw_only=True)
class BranchModel(AnyModel):
    """A lumped model, and how many harmonics its motions have."""

    harmonics: int = option(
        "Harmonics of the first mesh's frequency that motions are made of.",
        default=20,
        allowed=Range(least=1, most=200),
    )
    wave_harmonics: int | None = option(
        "Harmonics of the stiffness that --excitation fourier keeps. [default: 5]",
        allowed=HARMONICS,
    )

    @property
    def waves(self) -> dict[str, int | None]:
        return {"wave_harmonics": self.wave_harmonics}


@grouped
def branches_command(
    *,
    subject: EditedSet,
    speeds: Annotated[
        str,
        typer.Option(
            metavar="A:B",
            help="Mesh frequencies of the first mesh [Hz] between which branches are "
            "followed.",
        ),
    ],
    torque: LoadCase = None,
    period_multiple: Annotated[
        int,
        typer.Option(
            help="Common periods of all meshes, at most, after which motions repeat: "
            "branches on which the period doubles are followed up to it."
        ),
        Range(least=1, most=64),
    ] = 2,
    model: BranchModel,
    outputs: Outputs,
) -> None:
    """Periodic motions over speed, stable and unstable.

    Harmonic balance and arc-length continuation with folds, period doublings and
    Floquet multipliers.
    """
    outputs.require(subject.set_name, *(model.table or ()))
    gear_set, changes = model.load(subject, torque)
    limits = limits_of(speeds)
    from fegear.branches import find_branches
    from lumped.branches.periodic import BranchSettings

    settings = BranchSettings(
        harmonics=model.harmonics, period_multiple=period_multiple
    )
    at, description = middle_torque(gear_set, torque), model.lumped_model(gear_set)
    with outputs.progress() as report:
        found = find_branches(gear_set, at, limits, description, settings, report)
    found = replace(found, header={**found.header, **edit_entries(changes)})
    outputs.write(found.csv)
    outputs.draw(found.draw)
    outputs.show(found.summary, print_branches)
    if found.interrupted:
        raise typer.Exit(130)


def limits_of(text: str) -> tuple[float, float]:
    """Two frequencies A:B [Hz]; InputError names the option."""
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        raise InputError(f"--speeds = {text}; must be A:B, two frequencies") from None
    if not 0.1 <= low < high <= 1e6:
        raise InputError(
            f"--speeds = {text}; must rise, from 0.1 to 1e6 Hz, to a higher one"
        )
    return low, high


def print_branches(values: dict[str, Any]) -> None:
    console = screen()
    console.print(
        f"{values['gear_set']} at {values['torque_Nm']:g} N m, model "
        f"{values['model']}, {values['excitation']}, damping ratio "
        f"{values['damping_ratio']:g}, {values['harmonics']} harmonics"
    )
    for place, branch in enumerate(values["branches"], start=1):
        repeats = counted(branch["period_multiple"], "period", "periods")
        largest = _micrometres(branch["largest_dte_rms_m"])
        console.print(
            f"branch {place}: {counted(branch['points'], 'point', 'points')}, "
            f"{branch['stable_points']} of them stable, {branch['from_Hz']:.6g} to "
            f"{branch['to_Hz']:.6g} Hz, repeats after {repeats}\n"
            f"  largest RMS of dynamic transmission error of the meshes {largest} um\n"
            f"  begins {branch['origin']}; ends: {branch['end']}"
        )
        for each in branch["bifurcations"]:
            levels = _micrometres(each["dte_rms_m"])
            at = f"{each['frequency_Hz']:10.2f} Hz"
            console.print(f"  {at}  {each['kind']:<15} RMS {levels} um")


def _micrometres(lengths: list[float]) -> str:
    return ", ".join(number(1e6 * length, 4) for length in lengths)
