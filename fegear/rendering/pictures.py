"""Stress of gears in contact, and its pictures, films and data files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.boundary import mesh_index, public, require_torque
from fegear.figures.film import FILMS
from fegear.files.errors import InputError
from fegear.files.output import require_writable, write_text, write_whole
from fegear.files.printable import printable
from fegear.gearset.leads import require_uniform_loads
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.rendering.contact_sequence import (
    ContactSequence,
    contact_at_rest,
    contacts_of_set,
)
from fegear.rendering.extremes import PeaksInView
from fegear.rendering.fields import ContactField
from fegear.rendering.frames import View
from fegear.rendering.gear_set_scene import GearSetScene
from fegear.rendering.look import (
    PLANE_SHOWN,
    RenderStyle,
    Shown,
    look_of,
    palette,
    picture_aspect,
)
from fegear.rendering.mesh_scene import MeshScene, Zoom
from fegear.result import Result
from fegear.statics.settings import StaticsSettings
from lumped.common.checks import require_fields
from lumped.common.csv_text import format_csv
from lumped.common.options import Range, documented, option
from lumped.common.progress import Progress, silent
from lumped.common.short_repr import ShortRepr

if TYPE_CHECKING:
    from fegear.figures.film import Image

COLUMNS = (
    *("gear", "x_m", "y_m", "motion_x_m", "motion_y_m"),
    *("stress_xx_Pa", "stress_yy_Pa", "stress_xy_Pa", "von_mises_Pa"),
)
DRAWN = (".png", *FILMS)  # by VTK, which needs a window
ENDINGS = (*DRAWN, ".html", ".vtu")
WIDTH, FILM_WIDTH = 1920, 960  # pixels


@documented
@dataclass(frozen=True, kw_only=True)
class PictureSettings(ShortRepr):
    """What a picture shows, and how large."""

    shown: Shown | None = option(
        None,
        "Quantity that the colours show: von Mises stress, largest principal stress, "
        "displacement or contact pressure; where loads vary over the face width "
        "pressure or root-stress. [default: von-mises, or pressure]",
    )
    zoom: Zoom = option(
        "contact",
        "Field of view: the contact, a tooth or a gear of one mesh, or the whole gear "
        "set with all its meshes loaded.",
    )
    motion_scale: float | None = option(
        None,
        "Magnification of the motion, a number or auto. [default: auto]",
        Range(0.0, below=1e6),
    )
    width: int | None = option(
        None,
        "Width of a picture or film [pixels]. [default: 1920 for pictures, 960 for "
        "films]",
        Range(480, 7680),
    )
    frames: int = option(60, "Number of pictures in a film.", Range(2, 1000))
    turns: float | None = option(
        None,
        "Rotation of the carrier, or of the input where there is none, that a film of "
        "a whole set shows as seen from the ground [turns]. [default: one mesh cycle, "
        "seen from the carrier]",
        Range(most=100.0, above=0.0),
    )

    def __post_init__(self) -> None:
        require_fields(self)
        if (self.width or 0) % 2:
            raise ValueError(f"width = {self.width}; must be an even number")


@dataclass(frozen=True, eq=False)
class StressResult(Result):
    """Stress in the teeth of a mesh around its contact, or of a whole gear set.

    Attributes
    ----------
    contact : ContactSequence
        Contact that was solved, with its torque and settings.
    scene : MeshScene or GearSetScene
        The gears in their position.
    field : ContactField
        Displacement [m], stress [Pa] and contact pressure [Pa] at the nodes in view.
    """

    contact: ContactSequence
    scene: MeshScene | GearSetScene
    field: ContactField

    @property
    def largest_Pa(self) -> dict[str, float]:
        """Largest von Mises stress of each gear, by its name [Pa]."""
        return {gear.name: float(gear.von_mises.max()) for gear in self.field.gears}

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write displacement and stress of all nodes.

        Parameters
        ----------
        path : str or path-like
            CSV file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
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

        Parameters
        ----------
        path : str or path-like
            File to write.
        picture : PictureSettings, optional
            What is shown, and how large.

        Raises
        ------
        InputError
            If the ending names no such file or the file cannot be written.
        """
        output = Path(path)
        require_drawable_file(output)
        with drawing_context(output):
            default_zoom: Zoom = "contact" if self.contact.mesh is not None else "set"
            picture = picture or PictureSettings(zoom=default_zoom)
            Drawing(self.contact, self.scene, picture).write(output)


@public
def solve_stress(
    gear_set: GearSet,
    torque_on_driver: float,
    *,
    mesh: int = 1,
    position: float = 0.0,
    zoom: Zoom = "contact",
    settings: StaticsSettings | None = None,
) -> StressResult:
    """Stress of a mesh under a torque on its driver [N m].

    Parameters
    ----------
    gear_set : GearSet
        Gear set of the mesh.
    torque_on_driver : float
        Torque on the driver of the mesh [N m].
    mesh : int, optional
        Number of the mesh, counted from 1 as in files and commands.
    position : float, optional
        Position of the mesh, with zoom 'set' of the first mesh, past the pitch point
        of the reference pair [base pitches].
    zoom : {'contact', 'tooth', 'gear', 'set'}, optional
        What is in view and solved. With 'set' all meshes of the gear set are, loaded
        at once; the torque is still that on the driver of `mesh`.
    settings : StaticsSettings, optional
        Settings of the finite elements and of the contact.

    Returns
    -------
    StressResult
        Displacement, stress and contact pressure at the nodes in view.

    Raises
    ------
    InputError
        If there is no such mesh or position, the torque is outside its range, or loads
        vary over the face width, as those of helical gears.
    """
    settings = settings or StaticsSettings()
    index = mesh_index(gear_set, mesh)
    require_torque("torque_on_driver", torque_on_driver, "the driver")
    if zoom == "set" or gear_set.meshes[index].varies_over_width:
        require_uniform_loads(gear_set, "stress in the plane of the gears")
    if zoom == "set":
        torque_on_input = torque_on_driver / _torque_factor(gear_set, index)
        contact = contacts_of_set(gear_set, torque_on_input, position, settings)
    else:
        contact = contact_at_rest(gear_set, index, torque_on_driver, position, settings)
    scene = contact.scene()
    view = scene.view(zoom, picture_aspect())
    return StressResult(contact, scene, contact.field(scene, contact.still, view))


def _torque_factor(gear_set: GearSet, mesh: int) -> float:
    """Torque on the driver of a mesh per torque on the input."""
    factor = mesh_torques_at(gear_set, 1.0)[mesh]
    if factor == 0.0:
        raise InputError(f"mesh = {mesh + 1}; must pass power on from the input")
    return factor


def draw_contact(
    contact: ContactSequence,
    output: Path,
    picture: PictureSettings,
    report: Progress = silent,
) -> PeaksInView:
    """Write a picture, film, page or data file, whatever the ending says.

    Returns the largest values that it shows, of a film those of all its frames.
    """
    require_drawable_file(output)
    with drawing_context(output):
        return Drawing(contact, contact.scene(report), picture).write(output, report)


def require_drawable_file(output: Path) -> None:
    """A file of a known ending that can be written."""
    if output.suffix not in ENDINGS:
        endings = ", ".join(ENDINGS)
        raise InputError(f"output = {output}; allowed endings {endings}")
    require_writable(output)


def drawing_context(output: Path) -> AbstractContextManager[None]:
    """What drawing needs, before anything is computed."""
    from fegear.rendering.headless import drawing_window

    return drawing_window() if output.suffix in DRAWN else nullcontext()


@dataclass(frozen=True)
class Drawing:
    """A contact whose scene is made, and how it is shown."""

    contact: ContactSequence
    scene: MeshScene | GearSetScene
    picture: PictureSettings

    def write(self, output: Path, report: Progress = silent) -> PeaksInView:
        """Write the file whose ending says what it is; returns its largest values."""
        if output.suffix in FILMS:
            return self._write_film(output, report)
        report("stress", 0, 2)
        field = self._field_at(self.contact.still)
        report("picture", 1, 2)
        if output.suffix == ".vtu":
            self._write_data(field, output)
        elif output.suffix == ".html":
            self._write_page(field, output)
        else:
            self._write_picture(field, output)
        peaks = PeaksInView()
        peaks.add(field)
        return peaks

    def _write_picture(self, field: ContactField, output: Path) -> None:
        from fegear.figures.film import write_picture
        from fegear.rendering.scene import draw

        look = self._style_of_fields([field], self._shown)
        image = draw(field, look, printable(self.contact.title), self._size(WIDTH))
        write_whole(output, lambda path: write_picture(image, path))

    def _write_data(self, field: ContactField, output: Path) -> None:
        from fegear.rendering.scene import write_vtu

        write_whole(output, lambda path: write_vtu(field, path))

    def _write_page(self, field: ContactField, output: Path) -> None:
        from fegear.rendering.viewer_page import page

        quantities = dict.fromkeys((self._shown, *PLANE_SHOWN))
        looks = [self._style_of_fields([field], shown) for shown in quantities]
        write_text(output, page(field, looks, printable(self.contact.title)))

    def _write_film(self, output: Path, report: Progress) -> PeaksInView:
        """Colours and scales hold for all frames."""
        from fegear.figures.film import write_film

        report("colours", 0, 1)
        sample_fields = [self._field_at(moment) for moment in self.contact.samples]
        look = self._style_of_fields(sample_fields, self._shown)
        peaks, colours = PeaksInView(), palette(look.shown)
        images = self._draw_frames(look, peaks, report)
        write_whole(output, lambda path: write_film(images, path, colours))
        return peaks

    def _draw_frames(
        self, look: RenderStyle, peaks: PeaksInView, report: Progress
    ) -> Iterator[Image]:
        """Every frame; its largest values go to the peaks."""
        from fegear.rendering.scene import draw

        title = printable(self.contact.title + self.contact.film_title)
        count, size = self.picture.frames, self._size(FILM_WIDTH)
        for i, moment in enumerate(self.contact.frames(count)):
            report("frames", i, count)
            field = self._field_at(moment)
            peaks.add(field)
            yield draw(field, look, title, size)

    @property
    def _shown(self) -> Shown:
        return self.picture.shown or "von-mises"

    @property
    def _view(self) -> View:
        return self.scene.view(self.picture.zoom, picture_aspect())

    def _field_at(self, moment: Any) -> ContactField:
        return self.contact.field(self.scene, moment, self._view)

    def _style_of_fields(
        self, fields: Sequence[ContactField], shown: Shown
    ) -> RenderStyle:
        module, scale = self.scene.module, self.picture.motion_scale
        return look_of(fields, shown, self._view, module, scale)

    def _size(self, default_width: int) -> tuple[int, int]:
        return size_in_pixels(self.picture.width or default_width)


def size_in_pixels(width: int) -> tuple[int, int]:
    """Sixteen to nine, in even numbers of pixels as films need them."""
    return width, 2 * round(width * 9 / 32)
