"""fegear rattle noise: how loud a machine is, and how likely quiet."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

from fegear.cli.groups import Range, grouped, option
from fegear.cli.options import Outputs
from fegear.cli.rattle.machine import (
    MachineName,
    MotionFigures,
    Velocity,
    print_machine,
    speeds_of,
)
from fegear.cli.screen import number, ruled_table, screen
from fegear.rattle.limits import LEAST_RETURNS, MOST_RETURNS

EXAMPLE = "fegear rattle noise roots-scaled --starts 2000 -o noise.csv"


@dataclass(frozen=True, kw_only=True)
class RandomRuns:
    """Which runs are made."""

    starts: int = option(
        "Runs from random departures, spread evenly over a turn and the speeds.",
        default=1000,
        allowed=Range(least=1, most=10_000_000),
    )
    seed: int = option(
        "Number from which the random departures are made.",
        default=1,
        allowed=Range(least=0, most=2**32),
    )
    iterations: int | None = option(
        "Returns to the upper flank before noise is measured; turns where parts of the "
        "machine move on their own. [default: 1499, more where damping needs more to "
        "end transients, but not with parts]",
        allowed=Range(least=LEAST_RETURNS, most=MOST_RETURNS),
    )
    turns: int = option(
        "Turns of the machine over which it is measured.",
        default=200,
        allowed=Range(least=1, most=1_000_000),
    )


@grouped
def noise_command(
    *,
    machine: MachineName,
    figures: MotionFigures,
    velocity: Velocity = None,
    runs: RandomRuns,
    outputs: Outputs,
) -> None:
    """How loud a machine is, and how likely it runs quietly.

    The noise level of a run that has settled is the sum of the squared speeds at which
    flanks meet, over the time. Runs start at random departures from the upper flank;
    the same seed gives the same runs.
    """
    begin = time.perf_counter()
    outputs.require(machine)
    named = figures.load(machine)
    from fegear.rattle.noise import Runs, find_noise

    speeds = speeds_of(velocity, named)
    asked = Runs(velocity=speeds, **vars(runs))
    with outputs.progress() as report:
        found = find_noise(named, asked, report)
    outputs.write(found.csv)
    outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_noise)


def print_noise(values: dict[str, Any]) -> None:
    print_machine(values)
    console = screen()
    low, high = values["quiet_probability_within"]
    console.print(
        f"quiet with a probability of {100.0 * values['quiet_probability']:.1f} %, "
        f"{100.0 * low:.1f} to {100.0 * high:.1f} % by {values['starts']} runs from "
        f"speeds up to {values['velocity_rad_per_turn'][1]:.4g} rad per turn"
    )
    if values["noise_rad2_per_turn3"] is not None:
        within = values["noise_within_rad2_per_turn3"]
        error = "" if within is None else f" +- {within:.2g}"
        console.print(
            f"noise level {values['noise_rad2_per_turn3']:.4g}{error} "
            f"rad2 per turn3, {values['impacts_per_turn']:.3g} impacts per turn"
        )
    table = ruled_table(
        *("motion", "part [%]", "noise level\n[rad2 per turn3]", "impacts\nper turn")
    )
    for each in values["motions"]:
        level, impacts = each["noise_rad2_per_turn3"], each["impacts_per_turn"]
        shown = ("" if v is None else number(v, 4) for v in (level, impacts))
        table.add_row(each["name"], f"{100.0 * each['fraction']:.2f}", *shown)
    console.print(table)
    if values["unclear_fraction"]:
        part = 100.0 * values["unclear_fraction"]
        console.print(
            f"not clear what is settled to, and left out of the noise level: "
            f"{part:.2f} % of runs"
        )
    console.print(f"wall time {values['wall_time_s']:.2f} s")
