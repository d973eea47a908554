"""fegear bifurcations: what settled motions become over a parameter."""

from __future__ import annotations

import time
from dataclasses import MISSING, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import typer

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import NAMED, CoupledOptions, Integration, LoadCase
from fegear.cli.options import (
    FREQUENCY,
    ResumedOutputs,
    chosen,
    named_options,
    refuse_idle,
)
from fegear.cli.screen import Cells, cell, complain, counted, filled_table, screen
from fegear.cli.varied import parsed_axes, varied_set
from fegear.errors import InputError
from fegear.speeds import MESH_FREQUENCY
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.bifurcations import AttractorSettings, BifurcationsResult
    from fegear.parameter_maps import VariedSet
    from lumped.maps import Axis
    from lumped.settings import Settings

EXAMPLE = "fegear bifurcations liu-idler --over mesh_frequency_Hz=900:1700:161"


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """What varies, in which order, and the speed where that is not it."""

    over: str = option(
        "What varies: mesh_frequency_Hz of the first mesh, a key of the gear set, "
        "torque_Nm or damping_ratio, and N values from A to B, or values with commas.",
        metavar="KEY=A:B:N",
        default=MISSING,
    )
    at: float | None = option(
        "Mesh frequency of the first mesh [Hz], where another figure varies.",
        metavar="HZ",
        allowed=FREQUENCY,
    )
    direction: Literal["up", "down", "both"] = option(
        "Whether the values rise, fall, or one and the other side by side; each motion "
        "starts from where the one before has settled.",
        default="both",
    )

    def axis(self) -> Axis:
        """The values; checks that the speed is known once."""
        (axis,) = parsed_axes([self.over])
        if axis.name == MESH_FREQUENCY:
            refuse_idle(
                f"--over {MESH_FREQUENCY} replaces it, leave it out", at=self.at
            )
            for value in axis.values:
                if value not in FREQUENCY:
                    raise InputError(
                        f"--over {MESH_FREQUENCY} = {value:g}; allowed {FREQUENCY}"
                    )
        elif self.at is None:
            raise InputError(f"--over {axis.name} needs a mesh frequency, --at HZ")
        return axis

    def varied(
        self,
        axis: Axis,
        subject: EditedSet,
        model: CoupledOptions,
        torque: float | None,
    ) -> VariedSet:
        axes = () if axis.name == MESH_FREQUENCY else (axis,)
        return varied_set(subject, axes, model, torque)


@dataclass(frozen=True, kw_only=True)
class Sections:
    """How settled motions are looked at."""

    sections: int | None = option(
        "Points of the Poincar\u00e9 section, one in each common period of all meshes, "
        "of a motion that does not repeat. [default: 100]",
    )
    period_multiple: int = option(
        "Common periods of all meshes, at most, after which a motion counts as one "
        "that repeats.",
        default=32,
        allowed=Range(least=1, most=64),
    )

    def settings(self, integration: Settings, direction: str) -> AttractorSettings:
        from fegear.bifurcations import AttractorSettings
        from lumped.attractors import SectionSettings
        from lumped.sweep import BOTH

        with named_options("sections"):
            sections = SectionSettings(**chosen(sections=self.sections))
        return AttractorSettings(
            integration=replace(integration, multiples=self.period_multiple),
            sections=sections,
            directions=tuple(each for each in BOTH if direction in (each, "both")),
        )


@grouped
def bifurcations_command(
    *,
    subject: EditedSet,
    parameter: Parameter,
    sections: Sections,
    torque: LoadCase = None,
    model: CoupledOptions,
    integration: Integration,
    outputs: ResumedOutputs,
) -> None:
    """Period doublings and chaos over speed or another figure.

    Poincaré sections and the largest Lyapunov exponent. With --output each finished
    value is kept in FILE.partial until the file is written; --resume goes on there.
    """
    begin = time.perf_counter()
    outputs.require(subject.set_name)
    axis = parameter.axis()
    settings = sections.settings(integration.settings, parameter.direction)
    varied = parameter.varied(axis, subject, model, torque)
    from fegear.bifurcations import find_bifurcations

    with outputs.progress() as report, named_options(*NAMED, "over", "sections"):
        found = find_bifurcations(
            varied, axis, parameter.at, settings, outputs.keeping, report
        )
    found = replace(found, header={**found.header, **edit_entries(varied.fixed)})
    if any(branch.values for branch in found.branches):
        outputs.write(found.csv)
        outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_bifurcations)
    _end(found, outputs)


def _end(found: BifurcationsResult, outputs: ResumedOutputs) -> None:
    """Exit code 1 after a divergence, 130 after Ctrl-C; rows are written by then."""
    if found.complete:
        return
    if outputs.output is not None:
        complain(
            f"finished values are in {outputs.output}; {outputs.checkpoint} is kept, "
            "--resume goes on there"
        )
    if not found.diverged:
        raise KeyboardInterrupt
    for branch in found.branches:
        if branch.attractors and branch.attractors[-1].kind == "diverged":
            at = f"{found.parameter} = {branch.values[-1]:.12g}"
            complain(f"the motion diverged at {at}, {branch.direction}")
    raise typer.Exit(1)


STRETCH: Cells = {
    "from": lambda row: f"{row['first']:.6g}",
    "to": lambda row: f"{row['last']:.6g}",
    "motion": lambda row: str(row["motion"]),
    "largest exponent\n[1/period]": cell("largest_lyapunov_per_period", 1.0, 3),
    "begins by": lambda row: str(row["begins_by"]),
}


def print_bifurcations(values: dict[str, Any]) -> None:
    console = screen()
    from fegear.branches import title_of

    console.print(title_of({**values, "harmonics": None}))
    for branch in values["branches"]:
        done = counted(branch["finished_values"], "value", "values")
        words = "rising" if branch["direction"] == "up" else "falling"
        title = f"{values['over']}, {done}, {words}"
        console.print(
            filled_table(STRETCH, branch["stretches"], title, ("motion", "begins by"))
        )
        if not branch["complete"]:
            console.print(f"ended after {done} of {values['values']}")
    console.print(f"wall time {values['wall_time_s']:.2f} s")
