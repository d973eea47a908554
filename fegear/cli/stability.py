"""fegear stability: where over speed a gear train shakes, its teeth with friction."""

from __future__ import annotations

import math
import time
from dataclasses import MISSING, dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import (
    LoadCase,
    Rubbing,
    TabledOptions,
    require_axis_of_teeth,
    require_one_of,
    speeds_of,
)
from fegear.cli.options import ResumedOutputs, named_options, refuse_idle
from fegear.cli.screen import complain, counted, number, ruled_table, screen
from fegear.cli.varied import parsed_axes, varied_set
from fegear.errors import InputError
from fegear.speeds import MESH_FREQUENCY

if TYPE_CHECKING:
    from fegear.parameter_maps import VariedSet
    from lumped.maps import Axis

EXAMPLE = "fegear stability liu-pair --over friction=0:0.2:21 --speeds 500:6000:25"
MOST_SHOWN = 12  # intervals on the screen


@dataclass(frozen=True, kw_only=True)
class Varied(Rubbing):
    """What varies, and the friction of the teeth."""

    over: str = option(
        "What varies: friction (coefficient), friction_bending (ratio), a key of the "
        "gear set, torque_Nm or damping_ratio, and N values from A to B, or values "
        "with commas.",
        metavar="KEY=A:B:N",
        default=MISSING,
    )

    @property
    def rubs(self) -> bool:
        return super().rubs or self.over.startswith("friction=")

    def axis(self) -> Axis:
        """What varies; refuses what is given twice or changes nothing."""
        (axis,) = parsed_axes([self.over])
        if axis.name == MESH_FREQUENCY:
            raise InputError(f"--over {axis.name}; is the speed, --speeds A:B:STEP")
        require_axis_of_teeth(axis, self)
        return axis

    def of_set(
        self, subject: EditedSet, model: TabledOptions, torque: float | None
    ) -> VariedSet:
        """The gear set with friction, as the axis varies it."""
        from fegear.parameter_maps import OF_TEETH

        axis = self.axis()
        if axis.name not in OF_TEETH:
            refuse_idle("--over varies what tables hold", table=model.table)
        varied = varied_set(subject, (axis,), model, torque)
        if model.model != "1":
            raise InputError(f"--model = {model.model}; allowed is 1, of tooth pairs")
        return replace(varied, model=self.of(varied.model))


@grouped
def stability_command(
    *,
    subject: EditedSet,
    figure: Varied,
    speeds: Annotated[
        str,
        typer.Option(
            metavar="A:B:STEP",
            help="Mesh frequencies of the first mesh [Hz] of the chart.",
        ),
    ],
    method: Annotated[
        str,
        typer.Option(
            help="How Floquet multipliers are found. peano-baker: by the series of the "
            "state transition; exponential: by exponentials of mean stiffness on parts "
            "of the cycle. `bench stability` has both beside integration."
        ),
    ] = "peano-baker",
    torque: LoadCase = None,
    model: TabledOptions,
    outputs: ResumedOutputs,
) -> None:
    """Speeds at which a train shakes, its teeth with friction.

    Parametric instability while teeth stay in contact: Floquet multipliers over speed
    and one figure. The edges of unstable intervals are traced, also of those that are
    narrower than the steps of speed. With --output each value is kept in FILE.partial
    until the file is written; --resume goes on there.
    """
    begin = time.perf_counter()
    outputs.require(subject.set_name, *(model.table or ()))
    require_one_of("--method", method, ("peano-baker", "exponential"))
    varied = figure.of_set(subject, model, torque)
    chart = speeds_of(speeds)
    if not all(0.1 <= speed <= 1e6 for speed in chart):
        raise InputError(f"--speeds = {speeds}; allowed 0.1 to 1e6 Hz")
    from fegear.stability import find_stability

    with named_options("over", "speeds", "bending"), outputs.progress() as report:
        found = find_stability(
            *(varied, chart, method),  # type: ignore[arg-type]
            keeping=outputs.keeping,
            progress=report,
        )
    found = replace(found, header={**found.header, **edit_entries(varied.fixed)})
    outputs.write(found.csv)
    outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_stability)
    if not found.complete:
        if outputs.checkpoint is not None:
            complain(f"{outputs.checkpoint} is kept, --resume goes on there")
        raise typer.Exit(130)


def print_stability(values: dict[str, Any]) -> None:
    console = screen()
    from fegear.headings import title_of

    console.print(title_of(values))
    natural = ", ".join(
        f"f{i} {number(hertz, 5)}"
        for i, hertz in enumerate(values["natural_frequencies_Hz"], start=1)
    )
    console.print(f"natural frequencies of modes that strain a mesh [Hz]: {natural}")
    columns = values["columns"]
    unstable = [each for each in columns if each["intervals"]]
    console.print(
        f"{counted(len(columns), 'value', 'values')} of {values['over']}, at "
        f"{len(unstable)} of them vibration grows at some speed"
    )
    largest = max(each["largest_multiplier"] for each in columns)
    console.print(f"largest multiplier at the speeds {number(largest, 6)}")
    table = ruled_table(
        *("combination", f"{values['over']}\nfrom", "to", "widest\nat"),
        *("from\n[Hz]", "to\n[Hz]", "largest\nmultiplier"),
    )
    table.columns[0].no_wrap = True
    for row in _rows(columns)[:MOST_SHOWN]:
        table.add_row(*row)
    if unstable:
        console.print(table)
    console.print(f"wall time {values['wall_time_s']:.2f} s")


def _rows(columns: list[dict[str, Any]]) -> list[list[str]]:
    """For each combination, the widest first: where it is, and its widest interval."""
    found: dict[str, list[tuple[float, float, dict[str, Any]]]] = {}
    for column in columns:
        for each in column["intervals"]:
            width = each["to_Hz"] - each["from_Hz"]
            found.setdefault(each["kind"], []).append((width, column["value"], each))
    rows = []
    for kind, own in found.items():
        width, value, widest = max(own, key=lambda each: (each[0], -each[1]))
        ends = min(v for _, v, _ in own), max(v for _, v, _ in own)
        cells = widest["from_Hz"], widest["to_Hz"], widest["floquet_max"]
        shown = [f"{v:g}" for v in (*ends, value)]
        shown += [number(v, 6) if math.isfinite(v) else "" for v in cells]
        rows.append((width, [kind or "none", *shown]))
    return [row for _, row in sorted(rows, key=lambda each: -each[0])]
