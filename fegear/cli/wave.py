"""fegear wave: the motion of a gear set at one speed."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
from typing import Any

import typer

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import (
    NAMED,
    AnyModel,
    Integration,
    LoadCase,
    MovingTeeth,
    middle_torque,
)
from fegear.cli.options import FREQUENCY, Outputs, named_options
from fegear.cli.screen import complain, counted, number, print_columns, screen
from fegear.errors import InputError

EXAMPLE = "fegear wave liu-idler --speed 2100 --from-speed 3000 --plot w.png"


@dataclass(frozen=True, kw_only=True)
class Approach:
    """The speed, and where the motion comes from."""

    speed: float = option(
        "Mesh frequency of the first mesh [Hz].", default=MISSING, allowed=FREQUENCY
    )
    from_speed: float | None = option(
        "Mesh frequency [Hz] at which the motion settles first; from there it is "
        "followed to --speed in steps of 20 Hz at most. Where two motions are "
        "possible, this chooses one. [default: start at rest]",
        allowed=FREQUENCY,
    )

    def __post_init__(self) -> None:
        if self.from_speed == self.speed:
            raise InputError(
                f"--from-speed {self.from_speed:g}; must differ from --speed"
            )


@grouped
def wave_command(
    *,
    subject: EditedSet,
    approach: Approach,
    torque: LoadCase = None,
    model: AnyModel,
    friction: MovingTeeth,
    integration: Integration,
    outputs: Outputs,
) -> None:
    """Settled motion of a lumped train at one speed.

    Forces and contact of every tooth pair, phase plane and spectrum.
    """
    outputs.require(subject.set_name, *(model.table or ()))
    gear_set, changes = model.load(subject, torque)
    settings, at = integration.settings, middle_torque(gear_set, torque)
    from fegear.waves import settle_motion
    from lumped.motion import DivergedError, wave_csv

    description = friction.of(model.lumped_model(gear_set))
    given = gear_set, at, approach.speed, description, settings, approach.from_speed
    try:
        with outputs.progress() as report, named_options(*NAMED):
            found = settle_motion(*given, report)
    except DivergedError as error:
        complain(str(error))
        raise typer.Exit(1) from None
    header = {**found.header, **edit_entries(changes)}
    outputs.write(lambda: wave_csv(found.motion, header))
    outputs.draw(found.draw)
    outputs.show(found.summary, print_wave)


def print_wave(values: dict[str, Any]) -> None:
    from fegear.headings import friction_of_summary

    console = screen()
    console.print(
        f"{values['gear_set']} at {values['speed_Hz']:g} Hz, "
        f"{values['torque_Nm']:g} N m, model {values['model']}, "
        f"{values['excitation']}, damping ratio {values['damping_ratio']:g}"
        f"{friction_of_summary(values)}\n"
        f"{values['status']}, settled for {values['settling_time_s']:.4g} s, "
        f"{counted(values['section_points'], 'point', 'points')} in the Poincaré "
        "section"
    )
    columns = {f"mesh {mesh['mesh']}": _cells(mesh) for mesh in values["meshes"]}
    labels = [*ROWS, "repeats after periods of the mesh", "largest amplitudes [um]"]
    print_columns(console, "", labels, columns)
    from lumped.pair_motions import CONDITIONS

    for mesh in values["meshes"]:
        if "efficiency" in mesh:
            console.print(
                f"mesh {mesh['mesh']}: friction takes "
                f"{mesh['friction_power_mean_W']:.4g} W, at most "
                f"{mesh['friction_power_largest_W']:.4g} W; efficiency "
                f"{100.0 * mesh['efficiency']:.3f} %"
            )
        for name, part in mesh["contact_conditions"].items():
            console.print(
                f"mesh {mesh['mesh']}, two pairs or more engaged, condition {name}, "
                f"{CONDITIONS[name]}: {100.0 * part:.2f} % of the cycle"
            )


# Row header, with its unit, the figure that it shows, and its factor.
ROWS = {
    "RMS of dynamic transmission error [um]": ("dte_rms_m", 1e6),
    "mean [um]": ("dte_mean_m", 1e6),
    "largest value [um]": ("dte_peak_m", 1e6),
    "largest mesh force [N]": ("force_peak_N", 1.0),
    "contact lost [% of the time]": ("contact_loss_fraction", 100.0),
    "back side [% of the time]": ("back_side_fraction", 100.0),
}


def _cells(mesh: dict[str, Any]) -> list[str]:
    cells = [number(factor * mesh[name]) for name, factor in ROWS.values()]
    lines = (
        f"{1e6 * line['amplitude_m']:.3g} at {line['frequency_Hz']:.6g} Hz"
        for line in mesh["largest_lines"]
    )
    return [*cells, str(mesh["period_multiple"] or "none"), "\n".join(lines)]
