"""fegear render: pictures of two gears in contact."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fegear.cli.options import (
    PlaneChoice,
    ResolutionChoice,
    checked_torques,
    progress_bar,
    require,
)

if TYPE_CHECKING:
    from fegear.fields import ContactField, MeshScene, View
    from fegear.film import Image
    from fegear.gearset import GearSet
    from fegear.scene import Look, Shown
    from fegear.statics import Progress

EPILOG = "Example: fegear render liu-pair --position 0.5 --zoom contact -o contact.png"
ENDINGS = (".png", ".vtu", ".gif", ".mp4")
FILMS = (".gif", ".mp4")
SIZE, FILM_SIZE = (1920, 1080), (960, 540)
FRAMES = 60
SAMPLES = 6  # positions that fix the colours of a film


class FieldChoice(StrEnum):
    von_mises = "von-mises"
    principal = "principal"
    displacement = "displacement"
    pressure = "pressure"


class ZoomChoice(StrEnum):
    contact = "contact"
    tooth = "tooth"
    gear = "gear"


def render_command(
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="A picture .png, a film of the mesh cycle .gif or .mp4, or .vtu with "
            "all fields.",
        ),
    ],
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-pair",
    mesh: Annotated[int, typer.Option(help="Which mesh, counted from 1.")] = 1,
    position: Annotated[
        float | None,
        typer.Option(
            help="Base pitches from the pitch point, 0 to 1.", show_default="0"
        ),
    ] = None,
    torque: Annotated[
        float | None,
        typer.Option(
            help="On the driving gear [N m].", show_default="middle of the set's"
        ),
    ] = None,
    friction: Annotated[float, typer.Option(help="Coulomb coefficient.")] = 0.0,
    field: Annotated[
        FieldChoice, typer.Option(help="What the colours show.")
    ] = FieldChoice.von_mises,
    scale: Annotated[
        str, typer.Option(help="Drawn over true motion, a number or auto.")
    ] = "auto",
    zoom: Annotated[
        ZoomChoice, typer.Option(help="How much is seen.")
    ] = ZoomChoice.contact,
    plane: Annotated[
        PlaneChoice, typer.Option(help="Plane hypothesis.")
    ] = PlaneChoice.stress,
    resolution: Annotated[
        ResolutionChoice, typer.Option(help="Of mesh and contact.")
    ] = ResolutionChoice.default,
) -> None:
    """Draw stress, displacement or contact pressure of two gears in mesh."""
    from fegear.gearset import load_gear_set

    _require_output(output, position)
    motion_scale = _scale(scale)
    if position is not None:
        require(0.0 <= position <= 1.0, "--position", position, "allowed 0 to 1")
    require(0.0 <= friction < 0.5, "--friction", friction, "allowed 0 to below 0.5")
    if torque is not None:
        checked_torques([torque])
    gear_set = load_gear_set(set_name)
    count = len(gear_set.meshes)
    require(1 <= mesh <= count, "--mesh", mesh, f"{gear_set.name} has {count}")
    torque = torque or _middle_torque(gear_set, mesh)
    from fegear.statics import StaticsSettings

    settings = StaticsSettings(
        friction=friction, plane=plane.value, resolution=resolution.value
    )
    title = _title(gear_set, mesh, friction, plane.value)
    with progress_bar(enabled=True) as report, _window(output):
        from fegear.fields import mesh_scene
        from fegear.scene import picture_aspect

        scene = mesh_scene(gear_set, mesh - 1, settings, report)
        view = scene.view(zoom.value, picture_aspect())
        job = Job(scene, view, torque, field.value, motion_scale, title)
        if output.suffix in FILMS:
            job.film(output, report)
        elif output.suffix == ".vtu":
            job.data(output, position or 0.0)
        else:
            job.picture(output, position or 0.0, report)


def _window(output: Path) -> AbstractContextManager[None]:
    """What drawing needs, before anything is computed; data need nothing."""
    from fegear.headless import drawing_window

    return nullcontext() if output.suffix == ".vtu" else drawing_window()


@dataclass(frozen=True)
class Job:
    """What the pictures of one call have in common."""

    scene: MeshScene
    view: View
    torque: float
    shown: Shown
    motion_scale: float | None
    title: str

    def picture(self, output: Path, position: float, report: Progress) -> None:
        from fegear.film import write_picture
        from fegear.output import write_whole
        from fegear.scene import draw

        report("stress", 0, 2)
        found = self._field(position)
        report("picture", 1, 2)
        image = draw(found, self._look([found]), self.title, SIZE)
        write_whole(output, lambda path: write_picture(image, path))

    def data(self, output: Path, position: float) -> None:
        from fegear.output import write_whole
        from fegear.scene import write_vtu

        found = self._field(position)
        write_whole(output, lambda path: write_vtu(found, path))

    def film(self, output: Path, report: Progress) -> None:
        """A mesh cycle, with colours and scales that hold for all of it."""
        from fegear.film import write_film
        from fegear.output import write_whole
        from fegear.scene import palette

        report("colours", 0, 1)
        look = self._look([self._field(i / SAMPLES) for i in range(SAMPLES)])
        images, colours = self._frames(look, report), palette(look.shown)
        write_whole(output, lambda path: write_film(images, path, colours))

    def _frames(self, look: Look, report: Progress) -> Iterator[Image]:
        from fegear.scene import draw

        for i in range(FRAMES):
            report("frames", i, FRAMES)
            found = self._field(i / FRAMES)
            yield draw(found, look, self.title, FILM_SIZE)

    def _field(self, position: float) -> ContactField:
        from fegear.fields import contact_field

        return contact_field(self.scene, self.torque, position, self.view)

    def _look(self, fields: Sequence[ContactField]) -> Look:
        from fegear.scene import look_of

        module = self.scene.mesh.pair.driver.module
        return look_of(fields, self.shown, self.view, module, self.motion_scale)


def _require_output(output: Path, position: float | None) -> None:
    """A file that can be written, of a kind that suits the other options."""
    from fegear.errors import InputError
    from fegear.film import require_film
    from fegear.output import require_writable

    if output.suffix not in ENDINGS:
        known = ", ".join(ENDINGS)
        raise InputError(f"--output = {output}; allowed endings {known}")
    if output.suffix in FILMS:
        require_film(output)
        if position is not None:
            raise InputError(
                f"--position = {position:g}; a film shows all positions, leave it out"
            )
    require_writable(output)


def _scale(text: str) -> float | None:
    """Drawn over true motion, None for auto."""
    from fegear.errors import InputError

    if text == "auto":
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < 1e6:
        raise InputError(f"--scale = {text}; allowed auto, or 0 to below 1e6")
    return value


def _middle_torque(gear_set: GearSet, mesh: int) -> float:
    from fegear.errors import InputError

    torques = gear_set.meshes[mesh - 1].torques
    if not torques:
        raise InputError(
            f"--torque is missing; {gear_set.name} names no load for mesh {mesh}"
        )
    return torques[len(torques) // 2]


def _title(gear_set: GearSet, mesh: int, friction: float, plane: str) -> str:
    spec = gear_set.meshes[mesh - 1]
    driver, driven = (gear_set.gears[i].name for i in (spec.driver, spec.driven))
    title = f"{gear_set.name}, mesh {mesh}: {driver} drives {driven}, plane {plane}"
    return title + (f", friction {friction:g}" if friction else "")


render_command.__doc__ = f"{render_command.__doc__}\n\n{EPILOG}"
