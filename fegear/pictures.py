"""Stress of two gears in contact, and its pictures, films and data files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from fegear.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import error_periods
from fegear.output import require_writable, write_text, write_whole
from fegear.printable import printable
from fegear.rendering.fields import ContactField, MeshScene, Zoom, mesh_scene
from fegear.rendering.frames import View
from fegear.rendering.look import Look, Shown, look_of, palette, picture_aspect
from fegear.rendering.recorded import RecordedMotion
from fegear.rendering.states import AtRest, InMotion, States
from fegear.statics import Progress, StaticsSettings
from fegear.train import mesh_torques_at
from lumped.csv_text import format_csv

if TYPE_CHECKING:
    from fegear.rendering.film import Image

COLUMNS = (
    *("gear", "x_m", "y_m", "motion_x_m", "motion_y_m"),
    *("stress_xx_Pa", "stress_yy_Pa", "stress_xy_Pa", "von_mises_Pa"),
)
FILMS = (".gif", ".mp4")
DRAWN = (".png", *FILMS)  # by VTK, which needs a window
ENDINGS = (*DRAWN, ".html", ".vtu")
WIDTH, FILM_WIDTH = 1920, 960  # pixels


@dataclass(frozen=True, kw_only=True)
class PictureSettings:
    """What a picture shows, and how large.

    shown : von-mises, principal, displacement or pressure
    zoom : contact, tooth or gear
    motion_scale : magnification of the motion, None for one that can be seen
    width : of a picture or film [pixels], an even number; None for the usual one
    frames : of a film
    """

    shown: Shown = "von-mises"
    zoom: Zoom = "contact"
    motion_scale: float | None = None
    width: int | None = None
    frames: int = 60


@dataclass(frozen=True)
class Contact:
    """The contact that is drawn; its states are made once the scene is there.

    mesh : index from 0
    """

    gear_set: GearSet
    mesh: int
    statics: StaticsSettings
    title: str
    states: Callable[[MeshScene], States]


def contact_at_rest(
    gear_set: GearSet,
    mesh: int,
    torque: float,
    position: float,
    statics: StaticsSettings,
) -> Contact:
    """Of a mesh (index from 0) under a torque on its driver [N m].

    position : base pitches from the pitch point
    """
    period = error_periods(gear_set)[mesh]
    if not 0.0 <= position <= period:
        raise InputError(f"position = {position:.12g}; allowed 0 to {period}")
    title = _title(gear_set, mesh, statics)
    return Contact(
        *(gear_set, mesh, statics, title),
        lambda scene: AtRest(scene, torque, position),
    )


def contact_in_motion(
    gear_set: GearSet, mesh: int, motion: RecordedMotion, statics: StaticsSettings
) -> Contact:
    """Of a recorded motion of a mesh (index from 0)."""
    phase = mesh_phases(gear_set)[mesh].value
    return Contact(
        *(gear_set, mesh, statics, _title(gear_set, mesh, statics)),
        lambda scene: InMotion(scene, motion, phase),
    )


def _title(gear_set: GearSet, mesh: int, statics: StaticsSettings) -> str:
    spec = gear_set.meshes[mesh]
    driver, driven = (gear_set.gears[i].name for i in (spec.driver, spec.driven))
    title = (
        f"{gear_set.name}, mesh {mesh + 1}: {driver} drives {driven}, "
        f"plane {statics.plane}"
    )
    return title + (f", friction {statics.friction:g}" if statics.friction else "")


@dataclass(frozen=True, eq=False)
class StressResult:
    """Stress in the teeth of a mesh around its contact.

    field : displacement, stress and contact pressure at the nodes in view
    """

    contact: Contact
    scene: MeshScene
    field: ContactField

    @property
    def largest_Pa(self) -> dict[str, float]:
        """Largest von Mises stress of each gear, by its name [Pa]."""
        return {gear.name: float(gear.von_mises.max()) for gear in self.field.gears}

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write displacement and stress of all nodes."""
        rows = [
            [gear.name, *map(float, row)]
            for gear in self.field.gears
            for row in np.column_stack(
                [gear.points, gear.motion, gear.stress, gear.von_mises]
            )
        ]
        write_text(path, format_csv(COLUMNS, rows, {"contact": self.contact.title}))

    def draw(
        self, path: str | PathLike[str], picture: PictureSettings | None = None
    ) -> None:
        """Write a picture, film, page or data file, whatever the ending says.

        A film shows the whole mesh cycle.
        """
        output = Path(path)
        require_drawable_file(output)
        with _window(output):
            drawing = _drawing(
                self.contact, self.scene, output, picture or PictureSettings()
            )
            drawing.write(output, lambda what, done, total: None)


def solve_stress(
    gear_set: GearSet,
    torque: float,
    *,
    mesh: int = 0,
    position: float = 0.0,
    zoom: Zoom = "contact",
    settings: StaticsSettings | None = None,
) -> StressResult:
    """Stress of a mesh (index from 0) under a torque on the input gear [N m].

    position : of the mesh, base pitches from the pitch point
    zoom : what is in view, and solved: the contact, a tooth or a gear
    """
    settings = settings or StaticsSettings()
    on_driver = mesh_torques_at(gear_set, torque)[mesh]
    contact = contact_at_rest(gear_set, mesh, on_driver, position, settings)
    scene = mesh_scene(gear_set, mesh, settings)
    view = scene.view(zoom, picture_aspect())
    return StressResult(contact, scene, contact.states(scene).still(view))


def draw_contact(
    contact: Contact,
    output: Path,
    picture: PictureSettings,
    report: Progress = lambda what, done, total: None,
) -> None:
    """Write a picture, film, page or data file, whatever the ending says."""
    require_drawable_file(output)
    with _window(output):
        scene = mesh_scene(contact.gear_set, contact.mesh, contact.statics, report)
        _drawing(contact, scene, output, picture).write(output, report)


def _drawing(
    contact: Contact, scene: MeshScene, output: Path, picture: PictureSettings
) -> Drawing:
    usual = FILM_WIDTH if output.suffix in FILMS else WIDTH
    return Drawing(
        scene=scene,
        states=contact.states(scene),
        view=scene.view(picture.zoom, picture_aspect()),
        shown=picture.shown,
        motion_scale=picture.motion_scale,
        title=printable(contact.title),
        size=_size(picture.width or usual),
        frames=picture.frames,
    )


def require_drawable_file(output: Path) -> None:
    """A file of a known ending that can be written."""
    if output.suffix not in ENDINGS:
        known = ", ".join(ENDINGS)
        raise InputError(f"output = {output}; allowed endings {known}")
    require_writable(output)


def _window(output: Path) -> AbstractContextManager[None]:
    """What drawing needs, before anything is computed."""
    from fegear.rendering.headless import drawing_window

    return drawing_window() if output.suffix in DRAWN else nullcontext()


def _size(width: int) -> tuple[int, int]:
    """Sixteen to nine, in even numbers of pixels as films need them."""
    return width, 2 * round(width * 9 / 32)


@dataclass(frozen=True)
class Drawing:
    """What the pictures of one call have in common.

    size : of a picture or film [pixels]; frames : of a film
    """

    scene: MeshScene
    states: States
    view: View
    shown: Shown
    motion_scale: float | None
    title: str
    size: tuple[int, int]
    frames: int

    def write(self, output: Path, report: Progress) -> None:
        """The file whose ending says what it is."""
        if output.suffix in FILMS:
            self._film(output, report)
        elif output.suffix == ".vtu":
            self._data(output)
        elif output.suffix == ".html":
            self._page(output, report)
        else:
            self._picture(output, report)

    def _picture(self, output: Path, report: Progress) -> None:
        from fegear.rendering.film import write_picture
        from fegear.rendering.scene import draw

        report("stress", 0, 2)
        found = self.states.still(self.view)
        report("picture", 1, 2)
        image = draw(found, self._look([found], self.shown), self.title, self.size)
        write_whole(output, lambda path: write_picture(image, path))

    def _data(self, output: Path) -> None:
        from fegear.rendering.scene import write_vtu

        found = self.states.still(self.view)
        write_whole(output, lambda path: write_vtu(found, path))

    def _page(self, output: Path, report: Progress) -> None:
        from fegear.rendering.page import page

        report("stress", 0, 1)
        found = self.states.still(self.view)
        shown: list[Shown] = [self.shown]
        shown += [each for each in get_args(Shown) if each != self.shown]
        looks = [self._look([found], each) for each in shown]
        write_text(output, page(found, looks, self.title))

    def _film(self, output: Path, report: Progress) -> None:
        """Colours and scales hold for all frames."""
        from fegear.rendering.film import write_film

        report("colours", 0, 1)
        look = self._look(self.states.samples(self.view), self.shown)
        images, colours = self._images(look, report), palette(look.shown)
        write_whole(output, lambda path: write_film(images, path, colours))

    def _images(self, look: Look, report: Progress) -> Iterator[Image]:
        from fegear.rendering.scene import draw

        for i in range(self.frames):
            report("frames", i, self.frames)
            found = self.states.frame(i, self.frames, self.view)
            yield draw(found, look, self.title, self.size)

    def _look(self, fields: Sequence[ContactField], shown: Shown) -> Look:
        module = self.scene.mesh.pair.driver.module
        return look_of(fields, shown, self.view, module, self.motion_scale)
