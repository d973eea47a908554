"""fegear branches: periodic motions of a gear set, stable and unstable."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import (
    HARMONICS,
    AnyModel,
    LoadCase,
    middle_torque,
)
from fegear.cli.options import (
    FREQUENCY,
    ResumedOutputs,
    chosen,
    refuse_idle,
)
from fegear.cli.screen import complain, counted, number, screen
from fegear.cli.varied import varied_set
from fegear.errors import InputError
from fegear.speeds import MESH_FREQUENCY, limits_of
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.branches import BranchesResult
    from lumped.branches.periodic import BranchSettings

Find = Callable[
    ..., "BranchesResult"
]  # of settings, a report of progress, and what is kept
EXAMPLE = "fegear branches liu-idler --speeds 700:4500 -o b.csv --plot b.png"


@dataclass(frozen=True, kw_only=True)
class BranchModel(AnyModel):
    """A lumped model, and how many harmonics its motions have."""

    harmonics: int | None = option(
        "Harmonics of the first mesh's frequency that motions of models 1 to 3 are "
        "made of. [default: 20]",
        allowed=Range(least=1, most=200),
    )
    wave_harmonics: int | None = option(
        "Harmonics of the stiffness that --excitation fourier keeps. [default: 5]",
        allowed=HARMONICS,
    )

    @property
    def waves(self) -> dict[str, int | None]:
        return {"wave_harmonics": self.wave_harmonics}


@dataclass(frozen=True, kw_only=True)
class Followed:
    """What varies along branches: the speed, or another figure at one speed."""

    speeds: str | None = option(
        "Mesh frequencies of the first mesh [Hz] between which branches are followed; "
        "this or --over. [default: none]",
        metavar="A:B",
    )
    over: str | None = option(
        "Figure that branches are followed over instead, at one speed: a key of the "
        "gear set, torque_Nm or damping_ratio, from A to B. [default: none]",
        metavar="KEY=A:B",
    )
    at: float | None = option(
        "Mesh frequency of the first mesh [Hz] with --over.",
        metavar="HZ",
        allowed=FREQUENCY,
    )

    def __post_init__(self) -> None:
        if self.speeds is None and self.over is None:
            raise InputError("--speeds A:B or --over KEY=A:B is needed")
        if self.speeds is not None and self.over is not None:
            raise InputError("--over; --speeds takes its place, one of them is allowed")
        if (self.over or "").startswith(MESH_FREQUENCY):
            raise InputError(f"--over {MESH_FREQUENCY}; is the speed, --speeds A:B")
        if self.over is None:
            refuse_idle("needs --over", at=self.at)
        elif self.at is None:
            raise InputError("--over KEY=A:B needs a mesh frequency, --at HZ")

    def finder(
        self, subject: EditedSet, model: BranchModel, torque: float | None
    ) -> tuple[Find, Mapping[str, Any]]:
        """What follows the branches, once all that is asked for is checked, and what
        is changed in the gear set."""
        from fegear.branches import find_branches, find_branches_over

        if self.over is None or self.at is None:
            limits = limits_of(f"--speeds = {self.speeds}; must be A:B", self.speeds)
            if not 0.1 <= limits[0] <= limits[1] <= 1e6:
                raise InputError(f"--speeds = {self.speeds}; allowed 0.1 to 1e6 Hz")
            gear_set, changes = model.load(subject, torque)
            at, known = middle_torque(gear_set, torque), model.lumped_model(gear_set)
            return partial(find_branches, gear_set, at, limits, known), changes
        refuse_idle("--over varies what tables hold", table=model.table)
        from lumped.maps import Axis

        name, _, values = self.over.partition("=")
        limits = limits_of(f"--over = {self.over}; must be KEY=A:B", values)
        varied = varied_set(subject, (Axis(name.strip(), limits),), model, torque)
        return partial(find_branches_over, varied, self.at), varied.fixed


@dataclass(frozen=True, kw_only=True)
class MotionOptions:
    """Which motions are looked for, and how contact closes."""

    steepness: float | None = option(
        "Let contact close by tanh of this steepness [1/um], as the source does, in "
        "place of opening at once; to compare, of models 1 to 3. [default: none]",
        metavar="PER_UM",
        allowed=Range(least=0.01, most=1e6),
    )
    period_multiple: int = option(
        "Common periods of all meshes, at most, after which motions repeat: branches "
        "on which the period doubles are followed up to it.",
        default=2,
        allowed=Range(least=1, most=64),
    )
    starts: int = option(
        "Random states, the same each time, from which motions on further branches are "
        "looked for, isolated ones among them.",
        default=0,
        allowed=Range(least=0, most=100_000),
    )

    def settings(self, model: BranchModel) -> BranchSettings:
        """Of the numerics; raises InputError where the model has no such contact."""
        from lumped.branches.periodic import BranchSettings

        if model.model == "coupled":
            idle = "contact of --model coupled is smooth"
            refuse_idle(idle, steepness=self.steepness)
            idle = "motions of --model coupled are integrated"
            refuse_idle(idle, harmonics=model.harmonics)
        return BranchSettings(
            **chosen(harmonics=model.harmonics),
            period_multiple=self.period_multiple,
            starts=self.starts,
            steepness=None if self.steepness is None else 1e6 * self.steepness,
        )


@grouped
def branches_command(
    *,
    subject: EditedSet,
    parameter: Followed,
    torque: LoadCase = None,
    motions: MotionOptions,
    model: BranchModel,
    outputs: ResumedOutputs,
) -> None:
    """Periodic motions over speed or a figure, stable and unstable.

    Harmonic balance, of the coupled model integration over the period, and arc-length
    continuation with folds, period doublings and Floquet multipliers. With --output
    each branch is kept in FILE.partial until the file is written; --resume goes on from
    there.
    """
    outputs.require(subject.set_name, *(model.table or ()))
    settings = motions.settings(model)
    find, changes = parameter.finder(subject, model, torque)
    with outputs.progress() as report:
        found = find(settings, report, outputs.keeping)
    found = replace(found, header={**found.header, **edit_entries(changes)})
    outputs.write(found.csv)
    outputs.draw(found.draw)
    outputs.show(found.summary, print_branches)
    if found.interrupted:
        if outputs.checkpoint is not None:
            complain(f"{outputs.checkpoint} is kept, --resume goes on there")
        raise typer.Exit(130)


def print_branches(values: dict[str, Any]) -> None:
    console = screen()
    from fegear.headings import title_of

    console.print(title_of(values))
    over_speed = values["over"] == MESH_FREQUENCY
    name, unit = ("frequency_Hz", " Hz") if over_speed else ("value", "")
    ends = ("from_Hz", "to_Hz") if over_speed else ("from", "to")
    for place, branch in enumerate(values["branches"], start=1):
        repeats = counted(branch["period_multiple"], "period", "periods")
        largest = _micrometres(branch["largest_dte_rms_m"])
        error = branch["relative_error_of_rms"]
        finer = "more harmonics" if values["harmonics"] else "finer steps"
        beside = f", which shooting does not confirm: {finer} may be needed"
        if error is not None:
            beside = f", {100.0 * error:.2g} % off by shooting"
        console.print(
            f"branch {place}: {counted(branch['points'], 'point', 'points')}, "
            f"{branch['stable_points']} of them stable, {branch[ends[0]]:.6g} to "
            f"{branch[ends[1]]:.6g}{unit}, repeats after {repeats}\n"
            f"  largest RMS of dynamic transmission error of the meshes {largest} um"
            f"{beside}\n"
            f"  begins {branch['origin']}; ends: {branch['end']}"
        )
        for each in branch["bifurcations"]:
            levels = _micrometres(each["dte_rms_m"])
            at = f"{_place(each[name], each['located_by']):>10}{unit}"
            console.print(f"  {at}  {each['kind']:<15} RMS {levels} um")


def _place(value: float, located_by: str) -> str:
    """A parameter in as many digits as it is right to."""
    return f"{value:#.6g}" if located_by == "shooting" else f"~{value:.4g}"


def _micrometres(lengths: list[float]) -> str:
    return ", ".join(number(1e6 * length, 4) for length in lengths)
