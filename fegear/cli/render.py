"""fegear render: pictures of two gears in contact."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import SolvedPlane
from fegear.cli.options import (
    DriverTorque,
    Mesh,
    PlaneChoice,
    Resolution,
    ResolutionChoice,
    SetName,
    driver_torque,
    progress_bar,
    refuse_idle,
    require,
    require_friction,
    require_mesh,
)
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.pictures import Contact, PictureSettings
    from fegear.rendering.recorded import RecordedMotion
    from fegear.statics import StaticsSettings

EXAMPLE = "fegear render liu-pair --position 0.5 --zoom tooth -o contact.png"


class FieldChoice(StrEnum):
    von_mises = "von-mises"
    principal = "principal"
    displacement = "displacement"
    pressure = "pressure"


class ZoomChoice(StrEnum):
    contact = "contact"
    tooth = "tooth"
    gear = "gear"


@dataclass(frozen=True, kw_only=True)
class DrawnContact:
    """Which contact is drawn: at rest at a position, or of a recorded motion."""

    set_name: SetName = "liu-pair"
    mesh: Mesh = 1
    position: float | None = option(
        "Mesh position [base pitches] from the pitch point, 0 to 1, or until the "
        "tooth pairs repeat where they have pitch errors. [default: 0]"
    )
    torque: DriverTorque = None
    friction: float | None = option("Coulomb friction coefficient. [default: 0]")
    time_history: Path | None = option(
        "Draw this recorded motion of the gear set, a file of `fegear dynamics "
        "--history`, by static fields under the loads of each moment.",
        metavar="FILE",
    )

    def __post_init__(self) -> None:
        if self.friction is not None:
            require_friction(self.friction)


@dataclass(frozen=True, kw_only=True)
class Picture:
    """What the picture shows, and how large it is."""

    field: FieldChoice | None = option(
        "What the colours show: von Mises stress, largest principal stress, "
        "displacement or contact pressure. [default: von-mises]"
    )
    scale: str | None = option(
        "Magnification of the motion, a number or auto. [default: auto]"
    )
    zoom: ZoomChoice = option(
        "What is in view: the contact, a tooth or a gear.",
        default=ZoomChoice.contact,
    )
    width: int | None = option(
        "Width of a picture or film [pixels]. [default: 1920, of films 960]"
    )
    frames: int | None = option("Number of pictures in a film. [default: 60]")

    def settings(self, suffix: str) -> PictureSettings:
        """For a file of that ending; refuses what it cannot show."""
        from fegear.pictures import DRAWN, FILMS, PictureSettings

        if suffix == ".vtu":
            reason = "a .vtu file holds all fields"
            refuse_idle(reason, field=self.field, scale=self.scale)
        if suffix not in DRAWN:
            refuse_idle(f"a {suffix} file has no pixels", width=self.width)
        if suffix not in FILMS:
            refuse_idle("only films have frames, .gif and .mp4", frames=self.frames)
        found = PictureSettings(
            shown=(self.field or FieldChoice.von_mises).value,
            zoom=self.zoom.value,
            motion_scale=_scale(self.scale or "auto"),
            width=self.width,
        )
        if self.frames is not None:
            ok = 2 <= self.frames <= 1000
            require(ok, "--frames", self.frames, "allowed 2 to 1000")
            found = replace(found, frames=self.frames)
        if self.width is not None:
            even = self.width % 2 == 0 and 480 <= self.width <= 7680
            allowed = "allowed even numbers from 480 to 7680"
            require(even, "--width", self.width, allowed)
        return found


@grouped
def render_command(
    *,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="File to write. .png: a picture; .gif, .mp4: a film of the mesh "
            "cycle; .html: a page for browsers; .vtu: all fields for ParaView.",
        ),
    ],
    drawn: DrawnContact,
    picture: Picture,
    plane: SolvedPlane = None,
    resolution: Resolution = ResolutionChoice.default,
) -> None:
    """Pictures and films of the stress of two gears in mesh.

    With --time-history the contact of a motion: a film of its period, or the moment
    of its largest mesh force. Each moment shows the static fields under its own
    loads.
    """
    from fegear.pictures import FILMS, draw_contact, require_drawable_file
    from fegear.statics import StaticsSettings

    film = output.suffix in FILMS
    if film and drawn.position is not None:
        raise InputError(
            f"--position = {drawn.position:g}; a film shows all positions, leave it out"
        )
    require_drawable_file(output)
    settings = picture.settings(output.suffix)
    statics = StaticsSettings(resolution=resolution.value)
    made = _moving_contact if drawn.time_history else _contact
    contact = made(drawn, plane, statics, film)
    with progress_bar(enabled=True) as report:
        draw_contact(contact, output, settings, report)


def _contact(
    drawn: DrawnContact,
    plane: PlaneChoice | None,
    statics: StaticsSettings,
    film: bool,
) -> Contact:
    """Of gears at rest."""
    from fegear.gearset import load_gear_set
    from fegear.gearset.pitch_errors import error_periods
    from fegear.pictures import contact_at_rest

    gear_set = load_gear_set(drawn.set_name)
    require_mesh(gear_set, drawn.mesh)
    torque = driver_torque(gear_set, drawn.mesh, drawn.torque)
    statics = replace(
        statics,
        friction=drawn.friction or 0.0,
        plane=(plane or PlaneChoice.stress).value,
    )
    position, period = drawn.position or 0.0, error_periods(gear_set)[drawn.mesh - 1]
    ok = 0.0 <= position <= period
    require(ok, "--position", position, f"allowed 0 to {period}")
    contact = contact_at_rest(gear_set, drawn.mesh - 1, torque, position, statics)
    if period > 1 and film:
        title = f"{contact.title}, the first of {period} base pitches with pitch errors"
        contact = replace(contact, title=title)
    return contact


def _moving_contact(
    drawn: DrawnContact,
    plane: PlaneChoice | None,
    statics: StaticsSettings,
    film: bool,
) -> Contact:
    """Of a recorded motion, in the gear set as it was changed for it."""
    from fegear.gearset import load_gear_set
    from fegear.gearset.edit import parsed_value
    from fegear.pictures import contact_in_motion
    from fegear.rendering.recorded import mesh_motion, read_history

    assert drawn.time_history is not None
    file = read_history(drawn.time_history)
    edits = {key: parsed_value(value) for key, value in file.edits.items()}
    gear_set = load_gear_set(drawn.set_name, edits)
    require_mesh(gear_set, drawn.mesh)
    motion = mesh_motion(file, gear_set, drawn.mesh - 1)
    _require_same(drawn, plane, motion)
    statics = replace(statics, friction=motion.friction, plane=motion.plane)
    contact = contact_in_motion(gear_set, drawn.mesh - 1, motion, statics)
    title = contact.title
    first, count = motion.filmed
    if film and count < motion.cycles:
        title += f", cycle {first + 1} of {motion.cycles}"
    changes = "".join(f", {key} = {value}" for key, value in file.edits.items())
    title += f", {motion.torque:g} N m on the input{changes}"
    return replace(contact, title=title)


def _require_same(
    drawn: DrawnContact, plane: PlaneChoice | None, motion: RecordedMotion
) -> None:
    """Options beside --time-history may only repeat what its file says."""
    file = drawn.time_history
    if drawn.position is not None:
        raise InputError(
            f"--position = {drawn.position:g}; {file} has positions of its own, "
            "leave it out"
        )
    for name, value, recorded in (
        ("--torque", drawn.torque, motion.torque),
        ("--friction", drawn.friction, motion.friction),
    ):
        if value is not None and not math.isclose(value, recorded, rel_tol=1e-6):
            raise InputError(f"{name} = {value:g}; {file} was run at {recorded:g}")
    if plane not in (None, motion.plane):
        raise InputError(f"--plane {plane}; {file} is of plane {motion.plane}")


def _scale(text: str) -> float | None:
    """Drawn over true motion, None for auto."""
    if text == "auto":
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < 1e6:
        raise InputError(f"--scale = {text}; allowed auto, or 0 to below 1e6")
    return value
