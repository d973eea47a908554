"""Pictures on disk: single ones and films."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError

Image = NDArray[np.uint8]  # (height, width, 3)
FILMS = ".gif", ".mp4"  # endings
FRAMES_PER_SECOND = 20
FAILED = "the film cannot be written: ffmpeg failed, is there room on the disk?"


def write_picture(image: Image, path: Path) -> None:
    from PIL import Image as pillow

    pillow.fromarray(image).save(path, format="png")


def write_film(images: Iterable[Image], path: Path, palette: Image) -> None:
    """A GIF or MP4 that goes round and round; images are taken one by one.

    palette : (256, 3) colours of a GIF, the same in all of its images
    """
    if path.suffix == ".gif":
        _write_gif(images, path, palette)
    else:
        _write_mp4(images, path)


def _write_gif(images: Iterable[Image], path: Path, palette: Image) -> None:
    from PIL import Image as pillow

    colours = pillow.new("P", (1, 1))
    colours.putpalette(palette.tobytes())
    reduced = [
        pillow.fromarray(image).quantize(palette=colours, dither=pillow.Dither.NONE)
        for image in images
    ]
    first, *others = reduced
    first.save(
        path,
        format="gif",
        save_all=True,
        append_images=others,
        duration=1000 // FRAMES_PER_SECOND,
        loop=0,
    )


def _write_mp4(images: Iterable[Image], path: Path) -> None:
    """H.264 as browsers play it; sizes must be even."""
    from imageio_ffmpeg import write_frames  # type: ignore[import-untyped]

    waiting = iter(images)
    first = next(waiting)
    pipe = write_frames(
        str(path),
        (first.shape[1], first.shape[0]),
        fps=FRAMES_PER_SECOND,
        quality=7,
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        ffmpeg_log_level="quiet",
        output_params=["-movflags", "+faststart"],
    )
    count = 0
    try:
        pipe.send(None)
        for image in chain([first], waiting):
            pipe.send(np.ascontiguousarray(image))
            count += 1
    except OSError:  # the message is a page long and says no more
        raise InputError(FAILED) from None
    finally:
        pipe.close()
    if path.is_file() and _frames_of(path) != count:
        raise InputError(FAILED)


def _frames_of(path: Path) -> int:
    """How many frames can be read; an encoder ends in silence on a full disk."""
    from imageio_ffmpeg import count_frames_and_secs

    try:
        return int(count_frames_and_secs(str(path))[0])
    except RuntimeError:
        return 0
