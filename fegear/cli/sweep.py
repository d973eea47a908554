"""fegear sweep: the frequency response of a gear set."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
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
from fegear.cli.options import (
    Outputs,
    draw_into,
    named_options,
    require_ending,
    require_outputs,
)
from fegear.cli.sweep_report import show_sweep, title_of_sweep
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from fegear.sweeps import SweepResult
    from lumped.settings import Settings

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


@dataclass(frozen=True, kw_only=True)
class SweepOutputs(Outputs):
    """Responses, and the spectra of the motions that they are of."""

    spectra: Path | None = option(
        "Write the lines of the spectra of all motions to this CSV file, as amplitudes "
        "of the dynamic transmission error [m]."
    )
    waterfall: Path | None = option(
        "Draw them over speed into this file, .png, .pdf or .svg: a Campbell diagram, "
        "and harmonics of the mesh frequency."
    )

    def require(self, *inputs: Path | str) -> None:
        """Files can be written and replace no input."""
        super().require(*inputs)
        require_ending(self.spectra)
        others = [path for path in (self.output, self.plot) if path is not None]
        require_outputs([self.spectra], [*inputs, *others], self.waterfall)

    def draw_spectra(self, result: SweepResult, settings: Settings) -> None:
        """Of the motions of all branches, where they are asked for."""
        from fegear.output import write_text
        from lumped.waterfall import draw_waterfall, spectra_csv, spectra_over_speed

        if self.spectra is None and self.waterfall is None:
            return
        every = [spectra_over_speed(*each, settings) for each in result.found]
        found = [each for each in every if each.lines]
        if self.spectra is not None and found:
            write_text(self.spectra, spectra_csv(found, result.header))
        if self.waterfall is not None and found:
            title = title_of_sweep(result)
            draw_into(self.waterfall, lambda: draw_waterfall(found, title))


@grouped
def sweep_command(
    *,
    subject: EditedSet,
    swept: SpeedsOfEither,
    torque: LoadCases = None,
    model: AnyModel,
    friction: MovingTeeth,
    integration: Integration,
    outputs: SweepOutputs,
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
    result = replace(result, header=result.header | edit_entries(changes))
    outputs.draw_spectra(result, numerics)
    show_sweep(result, outputs, begin)
