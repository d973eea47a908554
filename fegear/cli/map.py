"""fegear map: a response over a grid of parameters."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import (
    NAMED,
    CoupledOptions,
    Integration,
    LoadCase,
    MovingTeeth,
    require_axis_of_teeth,
    speeds_of,
)
from fegear.cli.options import FREQUENCY, Outputs, Workers, named_options, refuse_idle
from fegear.cli.screen import complain, counted, number, screen
from fegear.cli.varied import parsed_axes, varied_set
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.parameter_maps import Evaluate, VariedSet
    from lumped.settings import Settings

EXAMPLE = "fegear map liu-idler --over mesh.2.phase=0:1:41 --at 1605 --plot map.png"


@dataclass(frozen=True, kw_only=True)
class Response:
    """What is asked of every point."""

    at: float | None = option(
        "Mesh frequency of the first mesh [Hz] at which each point is settled from "
        "rest; this or --band.",
        metavar="HZ",
        allowed=FREQUENCY,
    )
    band: str | None = option(
        "Mesh frequencies of the first mesh [Hz] that each point is swept over, up "
        "and down, for its largest response; this or --at.",
        metavar="A:B:STEP",
    )

    def __post_init__(self) -> None:
        if (self.at is None) == (self.band is None):
            raise InputError("--at HZ or --band A:B:STEP is needed, not both")

    @property
    def words(self) -> str:
        if self.at is not None:
            from lumped.csv_text import exact

            return f"at {exact(self.at)} Hz of the first mesh, from rest"
        return f"largest over {self.band} Hz of the first mesh, up and down"

    @property
    def speeds(self) -> Sequence[float]:
        """Mesh frequencies at which points are evaluated [Hz]."""
        if self.at is not None:
            return (self.at,)
        return speeds_of(self.band or "", "--band")

    def evaluation(self, settings: Settings) -> Evaluate:
        """What a point is asked for, as a function."""
        from fegear.parameter_maps import respond_at, respond_over

        if self.at is not None:
            return respond_at(self.at, settings)
        return respond_over(self.speeds, settings)


@dataclass(frozen=True, kw_only=True)
class MapOutputs(Outputs):
    """Where the map goes; its points are kept as they are finished."""

    output: Path | None = option(
        "Write the points to this CSV file as they are finished; points that it holds "
        "already are not computed again.",
        "-o",
        "--output",
    )
    overwrite: bool = option(
        "Compute the points in --output anew.",
        default=False,
    )

    def __post_init__(self) -> None:
        if self.output is None:
            refuse_idle("needs --output", overwrite=self.overwrite)


@dataclass(frozen=True, kw_only=True)
class Varied(MovingTeeth):
    """What varies, and the friction of the teeth."""

    over: list[str] = option(
        "Axis of the map: a key of the gear set, torque_Nm, damping_ratio, friction "
        "(coefficient) or friction_bending (ratio), and N values from A to B, or "
        "values with commas. Give it twice for two axes.",
        default=MISSING,
        metavar="KEY=A:B:N",
    )

    @property
    def rubs(self) -> bool:
        return super().rubs or any(text.startswith("friction=") for text in self.over)

    def of_set(
        self, subject: EditedSet, model: CoupledOptions, torque: float | None
    ) -> VariedSet:
        """The gear set with friction, as the axes vary it."""
        axes = parsed_axes(self.over)
        for axis in axes:
            require_axis_of_teeth(axis, self)
        varied = varied_set(subject, axes, model, torque)
        if self.rubs and varied.model.number != 1:
            raise InputError(f"friction needs --model 1, got {varied.model.number}")
        return replace(varied, model=self.of(varied.model))


@grouped
def map_command(
    *,
    subject: EditedSet,
    figure: Varied,
    response: Response,
    outputs: MapOutputs,
    torque: LoadCase = None,
    model: CoupledOptions,
    integration: Integration,
    workers: Workers,
) -> None:
    """Vibration of a lumped train over a grid of parameters.

    The same command goes on with an interrupted map.
    """
    begin = time.perf_counter()
    outputs.require(subject.set_name)
    from fegear.parameter_maps import compute_map, digest, summarise_map, take_up
    from lumped.map_figure import draw_map

    varied = replace(figure.of_set(subject, model, torque), speeds=response.speeds)
    settings = integration.settings
    evaluate = response.evaluation(settings)
    entries = edit_entries(varied.fixed) | {
        "digest of the gear set": digest(varied.gear_set),
        "response": response.words,
    }
    with named_options(*NAMED):
        grid = varied.grid(settings, entries)
    if not outputs.overwrite:
        try:
            grid = take_up(grid, outputs.output)
        except InputError as error:
            raise InputError(f"{error}; choose another -o or --overwrite") from None
    with outputs.progress() as report:
        found = compute_map(
            *(grid, varied, evaluate, outputs.output, report, complain),
            workers=workers.chosen,
        )
    values = summarise_map(found, varied.gear_set)
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.draw(lambda: draw_map(found))
    outputs.show(values, print_map)


def print_map(values: dict[str, Any]) -> None:
    console = screen()
    counts = ", ".join(f"{n} {status}" for status, n in values["statuses"].items())
    console.print(
        f"{values['gear_set']}, {values['excitation']}, {values['response']}\n"
        f"{counted(values['points'], 'point', 'points')}: {counts}"
    )
    for reason in itertools.islice(values["reasons"], 3):
        console.print(reason)
    for extreme in values["extremes"]:
        place = ", ".join(f"{name} = {v:g}" for name, v in extreme["at"].items())
        console.print(
            f"mesh {extreme['mesh']}: {extreme['extreme']} RMS of DTE "
            f"{number(1e6 * extreme['dte_rms_m'], 4)} um at {place}"
        )
    console.print(f"wall time {values['wall_time_s']:.2f} s")
