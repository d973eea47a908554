"""fegear render: pictures of two gears in contact."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

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
from fegear.cli.render_job import DRAWN, ENDINGS, FILMS, Job
from fegear.printable import printable

if TYPE_CHECKING:
    from fegear.elasticity.material import Plane
    from fegear.gearset import GearSet
    from fegear.rendering.fields import MeshScene
    from fegear.rendering.recorded import RecordedMotion
    from fegear.rendering.states import States

EXAMPLE = "fegear render liu-pair --position 0.5 --zoom tooth -o contact.png"
WIDTH, FILM_WIDTH = 1920, 960  # pixels
FRAMES = 60


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
            help="File to write. .png: a picture; .gif, .mp4: a film of the mesh "
            "cycle; .html: a page for browsers; .vtu: all fields for ParaView.",
        ),
    ],
    set_name: SetName = "liu-pair",
    mesh: Mesh = 1,
    position: Annotated[
        float | None,
        typer.Option(
            "--position",
            help="Mesh position [base pitches] from the pitch point, 0 to 1, or until "
            "the tooth pairs repeat where they have pitch errors. [default: 0]",
        ),
    ] = None,
    torque: DriverTorque = None,
    friction: Annotated[
        float | None,
        typer.Option("--friction", help="Coulomb friction coefficient. [default: 0]"),
    ] = None,
    time_history: Annotated[
        Path | None,
        typer.Option(
            "--time-history",
            metavar="FILE",
            help="Draw this recorded motion of the gear set, a file of `fegear "
            "dynamics --history`, by static fields under the loads of each moment.",
        ),
    ] = None,
    field: Annotated[
        FieldChoice | None,
        typer.Option(
            "--field",
            help="What the colours show: von Mises stress, largest principal stress, "
            "displacement or contact pressure. [default: von-mises]",
        ),
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(
            "--scale",
            help="Magnification of the motion, a number or auto. [default: auto]",
        ),
    ] = None,
    zoom: Annotated[
        ZoomChoice,
        typer.Option("--zoom", help="What is in view: the contact, a tooth or a gear."),
    ] = ZoomChoice.contact,
    plane: SolvedPlane = None,
    resolution: Resolution = ResolutionChoice.default,
    width: Annotated[
        int | None,
        typer.Option(
            "--width",
            help=f"Width of a picture or film [pixels]. [default: {WIDTH}, of films "
            f"{FILM_WIDTH}]",
        ),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(
            "--frames",
            help=f"Number of pictures in a film. [default: {FRAMES}]",
        ),
    ] = None,
) -> None:
    """Pictures and films of the stress of two gears in mesh.

    With --time-history the contact of a motion: a film of its period, or the moment
    of its largest mesh force. Each moment shows the static fields under its own
    loads.
    """
    _require_output(output, position)
    if output.suffix == ".vtu":
        refuse_idle("a .vtu file holds all fields", field=field, scale=scale)
    if output.suffix not in DRAWN:
        refuse_idle(f"a {output.suffix} file has no pixels", width=width)
    if output.suffix not in FILMS:
        refuse_idle("only films have frames, .gif and .mp4", frames=frames)
    motion_scale = _scale(scale or "auto")
    if friction is not None:
        require_friction(friction)
    frames = FRAMES if frames is None else frames
    require(2 <= frames <= 1000, "--frames", frames, "allowed 2 to 1000")
    if width is not None:
        even = width % 2 == 0 and 480 <= width <= 7680
        require(even, "--width", width, "allowed even numbers from 480 to 7680")
    film = output.suffix in FILMS
    given = Given(mesh, position, torque, friction, plane, time_history, film)
    case = _moving_case(set_name, given) if time_history else _case(set_name, given)
    from fegear.statics import StaticsSettings

    settings = StaticsSettings(
        friction=case.friction, plane=case.plane, resolution=resolution.value
    )
    with progress_bar(enabled=True) as report, _window(output):
        from fegear.rendering.fields import mesh_scene
        from fegear.rendering.look import picture_aspect

        scene = mesh_scene(case.gear_set, mesh - 1, settings, report)
        Job(
            scene=scene,
            states=case.states(scene),
            view=scene.view(zoom.value, picture_aspect()),
            shown=(field or FieldChoice.von_mises).value,
            motion_scale=motion_scale,
            title=printable(case.title),
            size=_size(width or (FILM_WIDTH if output.suffix in FILMS else WIDTH)),
            frames=frames,
        ).write(output, report)


def _window(output: Path) -> AbstractContextManager[None]:
    """What drawing needs, before anything is computed."""
    from fegear.rendering.headless import drawing_window

    return drawing_window() if output.suffix in DRAWN else nullcontext()


def _size(width: int) -> tuple[int, int]:
    """Sixteen to nine, in even numbers of pixels as films need them."""
    return width, 2 * round(width * 9 / 32)


@dataclass(frozen=True)
class Given:
    """Options that say which contact is drawn."""

    mesh: int
    position: float | None
    torque: float | None
    friction: float | None
    plane: PlaneChoice | None
    time_history: Path | None
    film: bool


@dataclass(frozen=True)
class Case:
    """The contact that is drawn; states are made once its scene is there."""

    gear_set: GearSet
    friction: float
    plane: Plane
    title: str
    states: Callable[[MeshScene], States]


def _case(set_name: str, given: Given) -> Case:
    from fegear.gearset import load_gear_set
    from fegear.gearset.pitch_errors import error_periods

    gear_set = load_gear_set(set_name)
    require_mesh(gear_set, given.mesh)
    torque = driver_torque(gear_set, given.mesh, given.torque)
    friction, position = given.friction or 0.0, given.position or 0.0
    period = error_periods(gear_set)[given.mesh - 1]
    ok = 0.0 <= position <= period
    require(ok, "--position", position, f"allowed 0 to {period}")

    def states(scene: MeshScene) -> States:
        from fegear.rendering.states import AtRest

        return AtRest(scene, torque, position)

    plane: Plane = (given.plane or PlaneChoice.stress).value
    title = _title(gear_set, given.mesh, friction, plane)
    if period > 1 and given.film:
        title += f", the first of {period} base pitches with pitch errors"
    return Case(gear_set, friction, plane, title, states)


def _moving_case(set_name: str, given: Given) -> Case:
    """Of a recorded motion, in the gear set as it was changed for it."""
    from fegear.gearset import load_gear_set
    from fegear.gearset.edit import parsed_value
    from fegear.gearset.phases import mesh_phases
    from fegear.rendering.recorded import mesh_motion, read_history

    assert given.time_history is not None
    file = read_history(given.time_history)
    edits = {key: parsed_value(value) for key, value in file.edits.items()}
    gear_set = load_gear_set(set_name, edits)
    require_mesh(gear_set, given.mesh)
    motion = mesh_motion(file, gear_set, given.mesh - 1)
    _require_same(given, motion)
    phase = mesh_phases(gear_set)[given.mesh - 1].value

    def states(scene: MeshScene) -> States:
        from fegear.rendering.states import InMotion

        return InMotion(scene, motion, phase)

    changes = "".join(f", {key} = {value}" for key, value in file.edits.items())
    title = _title(gear_set, given.mesh, motion.friction, motion.plane)
    first, count = motion.filmed
    if given.film and count < motion.cycles:
        title += f", cycle {first + 1} of {motion.cycles}"
    return Case(
        gear_set,
        motion.friction,
        motion.plane,
        f"{title}, {motion.torque:g} N m on the input{changes}",
        states,
    )


def _require_same(given: Given, motion: RecordedMotion) -> None:
    """Options beside --time-history may only repeat what its file says."""
    from fegear.errors import InputError

    file = given.time_history
    if given.position is not None:
        raise InputError(
            f"--position = {given.position:g}; {file} has positions of its own, "
            "leave it out"
        )
    for option, value, recorded in (
        ("--torque", given.torque, motion.torque),
        ("--friction", given.friction, motion.friction),
    ):
        if value is not None and not math.isclose(value, recorded, rel_tol=1e-6):
            raise InputError(f"{option} = {value:g}; {file} was run at {recorded:g}")
    if given.plane not in (None, motion.plane):
        raise InputError(f"--plane {given.plane}; {file} is of plane {motion.plane}")


def _require_output(output: Path, position: float | None) -> None:
    """A file that can be written, of a kind that suits the other options."""
    from fegear.errors import InputError
    from fegear.output import require_writable

    if output.suffix not in ENDINGS:
        known = ", ".join(ENDINGS)
        raise InputError(f"--output = {output}; allowed endings {known}")
    if output.suffix in FILMS and position is not None:
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


def _title(gear_set: GearSet, mesh: int, friction: float, plane: str) -> str:
    spec = gear_set.meshes[mesh - 1]
    driver, driven = (gear_set.gears[i].name for i in (spec.driver, spec.driven))
    title = f"{gear_set.name}, mesh {mesh}: {driver} drives {driven}, plane {plane}"
    return title + (f", friction {friction:g}" if friction else "")
