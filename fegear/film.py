"""Pictures on disk: single ones and films."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.errors import InputError

Image = NDArray[np.uint8]  # (height, width, 3)
FRAMES_PER_SECOND = 20


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


def require_film(path: Path) -> None:
    """Raises InputError where what is needed for such a film is not installed."""
    if path.suffix == ".mp4":
        _mp4_writer()


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
    writer = _mp4_writer().write_frames
    pipe = None
    for image in images:
        if pipe is None:
            height, width = image.shape[:2]
            pipe = writer(str(path), (width, height), fps=FRAMES_PER_SECOND, quality=7)
            pipe.send(None)
        pipe.send(np.ascontiguousarray(image))
    if pipe is not None:
        pipe.close()


def _mp4_writer() -> Any:
    """imageio-ffmpeg, which brings an encoder and is no dependency of this program."""
    try:
        return import_module("imageio_ffmpeg")
    except ImportError:
        raise InputError(
            "cannot write .mp4: imageio-ffmpeg is not installed, "
            "pip install imageio-ffmpeg or choose .gif"
        ) from None
