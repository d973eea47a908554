"""What `fegear render` does once its options are understood."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fegear.rendering.fields import ContactField, MeshScene
    from fegear.rendering.film import Image
    from fegear.rendering.frames import View
    from fegear.rendering.look import Look, Shown
    from fegear.rendering.states import States
    from fegear.statics import Progress

FILMS = (".gif", ".mp4")
DRAWN = (".png", *FILMS)  # by VTK, which needs a window
ENDINGS = (*DRAWN, ".html", ".vtu")


@dataclass(frozen=True)
class Job:
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
        from fegear.output import write_whole
        from fegear.rendering.film import write_picture
        from fegear.rendering.scene import draw

        report("stress", 0, 2)
        found = self.states.still(self.view)
        report("picture", 1, 2)
        image = draw(found, self._look([found], self.shown), self.title, self.size)
        write_whole(output, lambda path: write_picture(image, path))

    def _data(self, output: Path) -> None:
        from fegear.output import write_whole
        from fegear.rendering.scene import write_vtu

        found = self.states.still(self.view)
        write_whole(output, lambda path: write_vtu(found, path))

    def _page(self, output: Path, report: Progress) -> None:
        from typing import get_args

        from fegear.output import write_text
        from fegear.rendering.look import Shown
        from fegear.rendering.page import page

        report("stress", 0, 1)
        found = self.states.still(self.view)
        shown: list[Shown] = [self.shown]
        shown += [each for each in get_args(Shown) if each != self.shown]
        looks = [self._look([found], each) for each in shown]
        write_text(output, page(found, looks, self.title))

    def _film(self, output: Path, report: Progress) -> None:
        """Colours and scales hold for all frames."""
        from fegear.output import write_whole
        from fegear.rendering.film import write_film
        from fegear.rendering.look import palette

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
        from fegear.rendering.look import look_of

        module = self.scene.mesh.pair.driver.module
        return look_of(fields, shown, self.view, module, self.motion_scale)
