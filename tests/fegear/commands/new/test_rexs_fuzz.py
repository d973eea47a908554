"""Damaged REXS files are refused in one line, or read; nothing else happens."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from rexs_files import RexsWriter, as_json, as_xml
from typer.testing import CliRunner

from fegear import load_gear_set
from fegear.cli import app
from fegear.commands.new.study import gear_set_of_rexs, problems_of
from fegear.files.errors import InputError

TREE = RexsWriter(load_gear_set("liu-countershaft")).tree()
TEXTS = (as_xml(TREE), as_json(TREE))
WORDS = [
    *("", "0", "-1", "1e999", "nan", "-inf", "1e-320", "true", "null", "{}", "[]"),
    *(
        "<",
        ">",
        "&",
        "&a;",
        '"',
        "'",
        "\x00",
        "\u202e",
        "\ud7ff",
        "9" * 5000,
        "[" * 3000,
    ),
    *("mm", "deg", "none", "stage", "gear_1", "cylindrical_gear", "ring_gear", "model"),
    *("<a>" * 2000, "<![CDATA[", "]]>", "<?x?>", "<array><c>1</c></array>"),
]
NUMBER = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")
WORD = re.compile(r"[A-Za-z_]{2,}")


def damaged(text: str, chance: random.Random) -> bytes:
    """The text with a few changes of numbers, words, pieces or bytes."""
    for _ in range(chance.randint(1, 4)):
        kind = chance.randrange(6)
        spots = list((NUMBER if kind in (0, 5) else WORD).finditer(text))
        if kind in (0, 1, 5) and spots:
            spot = chance.choice(spots)
            new = str(chance.randint(-3, 40)) if kind == 5 else chance.choice(WORDS)
            text = text[: spot.start()] + new + text[spot.end() :]
        elif kind == 2:  # a piece is missing
            start = chance.randrange(len(text) + 1)
            text = text[:start] + text[start + chance.randint(1, 300) :]
        elif kind == 3:  # a piece is there twice
            start = chance.randrange(len(text) + 1)
            piece = text[start : start + chance.randint(1, 300)]
            text = text[:start] + piece + text[start:]
        else:
            start = chance.randrange(len(text) + 1)
            text = text[:start] + chance.choice(WORDS) + text[start:]
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    if data and chance.random() < 0.2:
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def refusal(path: Path) -> str:
    """Why a file is refused, or nothing where it is read."""
    try:
        assert "\n" not in "".join(problems_of(gear_set_of_rexs(path)))
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("seed", range(10))
def test_damaged_files(tmp_path, seed):
    chance, refused = random.Random(seed), 0
    path = tmp_path / "box.rexs"
    for number in range(50):
        path.write_bytes(damaged(TEXTS[number % 2], chance))
        message = refusal(path)
        refused += bool(message)
        assert not message or message.startswith(str(path))
        assert "\n" not in message
    assert refused >= 15


def test_a_refused_file_ends_the_command(tmp_path):
    path, target = tmp_path / "box.rexs", tmp_path / "set.toml"
    path.write_text("<model/>")
    result = CliRunner().invoke(app, ["new", "--from", str(path), "-o", str(target)])
    assert result.exit_code != 0
    assert "version = missing" in str(result.exception)
    assert not target.exists()


def test_a_gear_set_that_is_refused_is_written_with_its_problem(tmp_path):
    """A tip that no gear can have: the author mends the file."""
    path, target = tmp_path / "box.rexs", tmp_path / "set.toml"
    text = re.sub(r'(id="tip_diameter" unit="mm">)', r"\g<1>9", TEXTS[0], count=1)
    path.write_text(text)
    result = CliRunner().invoke(app, ["new", "--from", str(path), "-o", str(target)])
    assert result.exit_code == 0
    assert "to mend: gear " in result.stdout
    assert "tip_diameter_mm = 97" in result.stdout
    assert target.exists()
