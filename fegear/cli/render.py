"""fegear render: pictures of two gears in contact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.options import (
    DriverTorque,
    Elements,
    Friction,
    Mesh,
    SetName,
    chosen,
    driver_torque,
    named_options,
    progress_bar,
    refuse_idle,
    require,
    require_mesh,
)
from fegear.cli.screen import say
from fegear.errors import InputError
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.pictures import Contact, PictureSettings
    from fegear.rendering.fields import ContactField
    from fegear.rendering.recorded import RecordedMotion
    from fegear.statics import StaticsSettings

EXAMPLE = "fegear render liu-pair --position 0.5 --zoom tooth -o contact.png"

Field = Literal["von-mises", "principal", "displacement", "pressure"]


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
    friction: Friction = None
    time_history: Path | None = option(
        "Draw this recorded motion of the gear set, a file of `fegear dynamics "
        "--history`, by static fields under the loads of each moment.",
        metavar="FILE",
    )
    elements: Elements


@dataclass(frozen=True, kw_only=True)
class Picture:
    """What the picture shows, and how large it is."""

    field: Field | None = option(
        "What the colours show: von Mises stress, largest principal stress, "
        "displacement or contact pressure. [default: von-mises]"
    )
    scale: str | None = option(
        "Magnification of the motion, a number or auto. [default: auto]"
    )
    zoom: Literal["contact", "tooth", "gear"] = option(
        "What is in view: the contact, a tooth or a gear.",
        default="contact",
    )
    width: int | None = option(
        "Width of a picture or film [pixels]. [default: 1920, of films 960]"
    )
    frames: int | None = option(
        "Number of pictures in a film. [default: 60]", allowed=Range(least=2, most=1000)
    )

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
        if self.width is not None:
            even = self.width % 2 == 0 and 480 <= self.width <= 7680
            allowed = "allowed even numbers from 480 to 7680"
            require(even, "--width", self.width, allowed)
        return PictureSettings(
            zoom=self.zoom,
            motion_scale=_scale(self.scale or "auto"),
            width=self.width,
            **chosen(shown=self.field, frames=self.frames),
        )


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
) -> None:
    """Pictures and films of the stress of two gears in mesh.

    With --time-history the contact of a motion: a film of its period, or the moment
    of its largest mesh force. Each moment shows the static fields under its own
    loads.
    """
    from fegear.pictures import FILMS, draw_contact, require_drawable_file
    from fegear.statics import StaticsSettings

    if output.suffix in FILMS and drawn.position is not None:
        raise InputError(
            f"--position = {drawn.position:g}; a film shows all positions, leave it out"
        )
    require_drawable_file(output)
    settings = picture.settings(output.suffix)
    statics = StaticsSettings(
        **chosen(friction=drawn.friction), **drawn.elements.choices
    )
    contact = (_moving_contact if drawn.time_history else _contact)(drawn, statics)
    with progress_bar(enabled=True) as report:
        shown = draw_contact(contact, output, settings, report)
    say(contact.title)
    say(largest_in_view(shown))
    say(f"wrote {output}")


def largest_in_view(shown: Sequence[ContactField]) -> str:
    """Largest stress of each gear and contact pressure, of one moment or several."""
    gears = zip(*(field.gears for field in shown), strict=True)
    stress = (
        f"{own[0].name} {1e-6 * max(gear.von_mises.max() for gear in own):.0f} MPa"
        for own in gears
    )
    pairs = [pair for field in shown for pair in field.pairs]
    pressure = max((pair.pressure.max() for pair in pairs), default=0.0)
    return (
        f"largest von Mises stress in view: {', '.join(stress)}; largest contact "
        f"pressure {1e-6 * pressure:.0f} MPa"
    )


def _contact(drawn: DrawnContact, statics: StaticsSettings) -> Contact:
    """Of gears at rest."""
    from fegear.gearset import load_gear_set
    from fegear.pictures import contact_at_rest

    gear_set = load_gear_set(drawn.set_name)
    require_mesh(gear_set, drawn.mesh)
    torque = driver_torque(gear_set, drawn.mesh, drawn.torque)
    with named_options("position"):
        return contact_at_rest(
            gear_set, drawn.mesh - 1, torque, drawn.position or 0.0, statics
        )


def _moving_contact(drawn: DrawnContact, statics: StaticsSettings) -> Contact:
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
    _require_same(drawn, motion)
    return contact_in_motion(gear_set, drawn.mesh - 1, motion, statics)


def _require_same(drawn: DrawnContact, motion: RecordedMotion) -> None:
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
    plane = drawn.elements.plane
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
