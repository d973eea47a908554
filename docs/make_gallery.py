"""Make the pictures of docs/images by the commands in gallery.toml, and gallery.md.

python docs/make_gallery.py                       every picture, some take minutes
python docs/make_gallery.py liu-pair-contact.png  those named
python docs/make_gallery.py --pages               gallery.md alone
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"
WIDEST = 1280  # pixels of a picture that is made smaller
LIMITS = {".png": 300_000, ".gif": 1_500_000}  # bytes
HEAD = """# Gallery

Every picture is made by the commands below it; `python docs/make_gallery.py NAME` runs
them again. This page is written by that script from `gallery.toml`.
"""


@dataclass(frozen=True)
class Picture:
    """An entry of gallery.toml; made : where the commands leave the file."""

    file: str
    title: str
    text: str
    commands: tuple[str, ...]
    made: str


def read_gallery() -> list[Picture]:
    entries = tomllib.loads((DOCS / "gallery.toml").read_text("utf-8"))["picture"]
    return [
        Picture(
            file=entry["file"],
            title=entry["title"],
            text=entry["text"],
            commands=tuple(entry["commands"]),
            made=entry.get("made", entry["file"]),
        )
        for entry in entries
    ]


def gallery_page(pictures: Sequence[Picture]) -> str:
    """gallery.md as text."""
    parts = [HEAD]
    for each in pictures:
        commands = "\n".join(each.commands)
        parts.append(
            f"## {each.title}\n\n{each.text}\n\n"
            f"![{each.title}](images/{each.file})\n\n```\n{commands}\n```\n"
        )
    return "\n".join(parts)


def make(picture: Picture) -> None:
    """Run the commands and put the picture in its place, small enough."""
    program = shutil.which("fegear", path=str(Path(sys.executable).parent)) or "fegear"
    with tempfile.TemporaryDirectory() as folder:
        for command in picture.commands:
            words = shlex.split(command)
            subprocess.run([program, *words[1:]], cwd=folder, check=True)
        place = Path(folder, picture.made)
        if place.suffix == ".png" and place.stat().st_size > LIMITS[".png"]:
            shrink(place)
        size = place.stat().st_size
        if size > LIMITS[place.suffix]:
            sys.exit(f"{picture.file}: {size} bytes, allowed {LIMITS[place.suffix]}")
        shutil.copy(place, IMAGES / picture.file)


def shrink(place: Path) -> None:
    """A PNG of 256 colours, no wider than the pages need."""
    with Image.open(place) as image:
        small = image.convert("RGB")
    if small.width > WIDEST:
        height = round(small.height * WIDEST / small.width)
        small = small.resize((WIDEST, height), Image.Resampling.LANCZOS)
    small.quantize(256, dither=Image.Dither.NONE).save(place, optimize=True)


def main(names: Sequence[str]) -> None:
    pictures = read_gallery()
    unknown = set(names) - {each.file for each in pictures} - {"--pages"}
    if unknown:
        sys.exit(f"not in gallery.toml: {', '.join(sorted(unknown))}")
    for each in pictures:
        if each.file in names or not names:
            make(each)
    (DOCS / "gallery.md").write_text(gallery_page(pictures), encoding="utf-8")
    for each in pictures:
        size = (IMAGES / each.file).stat().st_size
        done = "made" if each.file in names or not names else "kept"
        sys.stdout.write(f"{done}  {size / 1000:7.0f} kB  {each.file}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
