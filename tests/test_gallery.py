"""The gallery names every picture, and its commands are ones the program knows."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from pathlib import Path

import pytest
import typer
from PIL import Image

from fegear.cli import app

DOCS = Path(__file__).parents[1] / "docs"


def script():
    spec = importlib.util.spec_from_file_location("gallery", DOCS / "make_gallery.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["gallery"] = module  # data classes look their module up
    spec.loader.exec_module(module)
    return module


GALLERY = script()
PICTURES = GALLERY.read_gallery()
COMMANDS = [command for picture in PICTURES for command in picture.commands]


def test_pictures_and_entries_belong_together():
    names = [picture.file for picture in PICTURES]
    assert len(set(names)) == len(names)
    assert set(names) == {path.name for path in (DOCS / "images").iterdir()}


@pytest.mark.parametrize("picture", PICTURES, ids=lambda picture: picture.file)
def test_pictures_are_small(picture):
    path = DOCS / "images" / picture.file
    assert path.stat().st_size <= GALLERY.LIMITS[path.suffix]
    with Image.open(path) as image:
        assert image.width >= 600


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_are_known_with_their_options(command):
    program, *arguments = shlex.split(command)
    assert program == "fegear"
    entry = typer.main.get_command(app)
    while hasattr(entry, "commands"):
        entry = entry.get_command(None, arguments.pop(0))
    options = {name for parameter in entry.params for name in parameter.opts}
    used_options = {word for word in arguments if word.startswith("-")}
    assert used_options <= options


def test_every_command_says_where_its_picture_goes():
    for picture in PICTURES:
        last = shlex.split(picture.commands[-1])
        assert picture.made in last or Path(picture.made).parent.name in last


def test_page_is_what_the_script_writes():
    page = (DOCS / "gallery.md").read_text("utf-8")
    assert page == GALLERY.gallery_page(PICTURES)


def test_large_pictures_are_made_smaller(tmp_path):
    path = tmp_path / "large.png"
    Image.effect_noise((1600, 900), 100).convert("RGB").save(path)
    GALLERY.shrink(path)
    with Image.open(path) as image:
        assert image.size == (1280, 720)
        assert image.mode == "P"
