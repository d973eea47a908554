"""Pictures, films, pages and data files of contact over the face width."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fegear.figures.film import FILMS
from fegear.files.output import write_text, write_whole
from fegear.files.printable import printable
from fegear.rendering.pictures import (
    FILM_WIDTH,
    WIDTH,
    PictureSettings,
    drawing_context,
    require_drawable_file,
    size_in_pixels,
)
from fegear.rendering.width_contact import WidthMoments, WidthSequence
from fegear.rendering.width_look import style_of, view_aspect, width_palette
from lumped.common.progress import Progress, silent

if TYPE_CHECKING:
    from fegear.figures.film import Image


def draw_width_contact(
    sequence: WidthSequence,
    output: Path,
    picture: PictureSettings,
    report: Progress = silent,
) -> WidthMoments:
    """Write a picture, film, page or data file, whatever the ending says.

    Returns the moments that it shows.
    """
    require_drawable_file(output)
    with drawing_context(output):
        return WidthDrawing(sequence, picture).write(output, report)


@dataclass(frozen=True)
class WidthDrawing:
    """A contact over the face width, and how it is shown."""

    sequence: WidthSequence
    picture: PictureSettings

    def write(self, output: Path, report: Progress = silent) -> WidthMoments:
        """Write the file whose ending says what it is."""
        if output.suffix in FILMS:
            return self._write_film(output, report)
        moments = self.sequence.solved([self.sequence.position], report)
        report("picture", 1, 2)
        if output.suffix == ".vtu":
            self._write_data(moments, output)
        elif output.suffix == ".html":
            self._write_page(moments, output)
        else:
            self._write_picture(moments, output)
        return moments

    def _write_picture(self, moments: WidthMoments, output: Path) -> None:
        from fegear.figures.film import write_picture

        (image,) = self._images(moments, self.sequence.title, WIDTH)
        write_whole(output, lambda path: write_picture(image, path))

    def _write_data(self, moments: WidthMoments, output: Path) -> None:
        from fegear.rendering.width_scene import write_width_vtu

        write_whole(
            output, lambda path: write_width_vtu(moments[0], moments.pairs, path)
        )

    def _write_page(self, moments: WidthMoments, output: Path) -> None:
        from fegear.rendering.width_page import width_page

        write_text(output, width_page(moments, printable(self.sequence.title)))

    def _write_film(self, output: Path, report: Progress) -> WidthMoments:
        """Colours and views hold for all frames."""
        from fegear.figures.film import write_film

        count = self.picture.frames
        moments = self.sequence.solved([i / count for i in range(count)], report)
        title = self.sequence.title + self.sequence.film_title
        images = self._images(moments, title, FILM_WIDTH, report)
        colours = width_palette("root-stress" if moments.tensions else "pressure")
        write_whole(output, lambda path: write_film(images, path, colours))
        return moments

    def _images(
        self,
        moments: WidthMoments,
        title: str,
        default_width: int,
        report: Progress = silent,
    ) -> Iterator[Image]:
        """A picture of every moment."""
        from fegear.rendering.width_scene import draw_over_width

        size = size_in_pixels(self.picture.width or default_width)
        style = style_of(moments, view_aspect(size))
        for index in range(len(moments)):
            report("frames", index, len(moments))
            yield draw_over_width(moments[index], style, printable(title), size)
