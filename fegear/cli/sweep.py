"""fegear sweep: the frequency response of a gear set."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import (
    NAMED,
    AnyModel,
    Integration,
    LoadCases,
    MovingTeeth,
    SweptSpeeds,
    chosen_torques,
    speeds_of,
)
from fegear.cli.options import Outputs, named_options
from fegear.cli.sweep_report import show_sweep
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet

EXAMPLE = "fegear sweep liu-idler --speeds 800:4200:20 -o s.csv --plot s.png"


@dataclass(frozen=True, kw_only=True)
class SpeedsOfEither(SweptSpeeds):
    """Speeds by mesh frequency or by rotation."""

    rpm: str | None = option(
        "Rotational speeds of the first mesh's driver [rpm], in place of --speeds.",
        metavar="A:B:STEP",
    )

    def frequencies_of(self, gear_set: GearSet) -> list[float]:
        """Of the first mesh [Hz], none if neither option is given."""
        if self.rpm is None:
            return self.frequencies
        if self.speeds is not None:
            raise InputError("--speeds and --rpm exclude each other")
        teeth = gear_set.gears[gear_set.meshes[0].driver].geometry.teeth
        return [turns * teeth / 60.0 for turns in speeds_of(self.rpm, "--rpm")]


@grouped
def sweep_command(
    *,
    subject: EditedSet,
    swept: SpeedsOfEither,
    torque: LoadCases = None,
    model: AnyModel,
    friction: MovingTeeth,
    integration: Integration,
    outputs: Outputs,
) -> None:
    """Vibration of a lumped train over speed.

    Resonances, jumps and loss of contact, with the speed rising and falling.
    """
    outputs.require(subject.set_name, *(model.table or ()))
    gear_set, changes = model.load(subject, torque)
    numerics, frequencies = integration.settings, swept.frequencies_of(gear_set)
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    from fegear.sweeps import SweepSettings, sweep_speeds

    settings = SweepSettings(
        model=friction.of(model.lumped_model(gear_set)),
        integration=numerics,
        directions=swept.directions,
    )
    with outputs.progress() as report, named_options(*NAMED):
        result = sweep_speeds(gear_set, torques, frequencies, settings, report)
    header = result.header | edit_entries(changes)
    show_sweep(replace(result, header=header), outputs, begin)
