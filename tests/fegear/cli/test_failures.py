"""Whatever goes wrong is one harmless line and the right exit code."""

from __future__ import annotations

import cProfile
import io
import os
import pstats
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest
from cli_commands import refused
from drawn_figures import saved_figures
from matplotlib.text import Text

from fegear.cli import run
from fegear.files.errors import file_error
from fegear.files.printable import HARMFUL, printable

FULL = OSError(28, "No space left on device")
RECTANGULAR = ["liu-idler", "--excitation", "rectangular", "--torque", "100"]
QUASISTATIC = ["dynamics", "liu-pair", "--fidelity", "quasistatic", "--torque", "100"]
LONG = "a" * 300
STEERING = "\x1b[31m\x9b\u202e\u2066\u200f\x07\x7f\udc80"
CHAIN = """
name = "chain"
[defaults]
module_mm = 2
face_width_mm = 20
hub_radius_mm = 8
teeth = 30
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ["show", LONG],
        ["show", f"{LONG}.toml"],
        ["show", "liu-pair", "-o", f"{LONG}.png"],
        ["stiffness", "-o", f"{LONG}.csv"],
        ["stiffness", "--plot", f"{LONG}.png"],
        ["sweep", *RECTANGULAR, "--speeds", "900", "-o", LONG],
        ["sweep", "liu-pair", "--speeds", "900", "--table", LONG],
        ["map", *RECTANGULAR, "--over", "mesh.2.phase=0,1", "--at", "900", "-o", LONG],
        [*QUASISTATIC, "--speeds", "900", "-o", LONG],
        [*QUASISTATIC, "--speeds", "900", "--history", LONG],
        ["mesh", "-o", f"{LONG}.vtu"],
        ["render", "-o", f"{LONG}.png"],
        ["render", "-o", "a.png", "--time-history", LONG],
        ["validate", LONG, "-o", "report"],
        ["validate", f"{LONG}.toml", "-o", "report"],
        ["validate", "idler", "-o", LONG],
        ["bench", "stiffness", "-o", LONG],
    ],
    ids=lambda arguments: " ".join(arguments).replace(LONG, "LONG"),
)
def test_names_that_are_too_long(capsys, monkeypatch, tmp_path, arguments):
    monkeypatch.chdir(tmp_path)
    assert LONG in refused(capsys, *arguments)


@pytest.mark.parametrize(
    ("arguments", "kind"), [(["show"], "gear set"), (["rattle", "critical"], "machine")]
)
def test_no_name(capsys, arguments, kind):
    line = refused(capsys, *arguments, "")
    assert f"no name of a {kind} (built-in: " in line


@pytest.mark.parametrize(
    "arguments",
    [
        ["map", *RECTANGULAR, "--over", "mesh.2.phase=0,1", "--at", "900"],
        [*QUASISTATIC, "--resolution", "coarse", "--speeds", "2500"],
    ],
    ids=["map", "dynamics"],
)
def test_a_full_disk_under_a_checkpoint(capsys, monkeypatch, tmp_path, arguments):
    path = tmp_path / "m.csv"

    def full(*_):
        raise FULL

    monkeypatch.setattr("fegear.files.store.Checkpoint.add", full)
    line = refused(capsys, *arguments, "-o", path)
    reason = "cannot be written, no space left on device"
    assert line == f"fegear: {path}.partial: {reason}\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full is of Linux")
@pytest.mark.parametrize("arguments", [["sets"], ["show", "liu-pair", "--json"]])
def test_a_full_screen(arguments):
    command = [sys.executable, "-c", "from fegear.cli import main; main()", *arguments]
    with open("/dev/full", "w") as full:
        process = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert process.returncode == 2
    line = "fegear: standard output: cannot be written, no space left on device\n"
    assert process.stderr == line


def test_letters_that_the_screen_does_not_have(tmp_path):
    path = tmp_path / "日本.toml"
    command = [sys.executable, "-c", "from fegear.cli import main; main()"]
    process = subprocess.run(
        [*command, "show", str(path)],
        capture_output=True,
        env={"PYTHONIOENCODING": "cp1252", "PATH": ""},
    )
    assert process.returncode == 2
    assert rb"\u65e5\u672c.toml: cannot be read" in process.stderr


def test_a_long_chain_is_shown_at_once(tmp_path, capsys):
    """Calls grow no faster than the square; once they grew with the cube."""
    calls = []
    for count in (75, 150):
        gears = [f'[[gear]]\nname = "g{i}"' for i in range(count + 1)]
        meshes = [
            f'[[mesh]]\ndriver = "g{i}"\ndriven = "g{i + 1}"\ncenter_distance_mm = 60.2'
            for i in range(count)
        ]
        path = tmp_path / "chain.toml"
        path.write_text("\n".join([CHAIN, *gears, *meshes]))
        profile = cProfile.Profile()
        profile.enable()
        assert run(["show", "--json", str(path)]) == 0
        profile.disable()
        calls.append(pstats.Stats(profile).total_calls)
        assert f'"g{count}"' in capsys.readouterr().out
    assert calls[1] < 4.5 * calls[0]


@pytest.mark.parametrize(
    "arguments",
    [
        ["show", f"{STEERING}.toml"],
        ["show", "liu-pair", f"--{STEERING}"],
        [STEERING],
        ["sweep", "liu-pair", "--set", f"{STEERING}=1"],
        ["sweep", "liu-pair", "--set", f"gear.{STEERING}.teeth=1"],
        ["sweep", "liu-pair", "--set", f"mesh.1.phase={STEERING}"],
        ["sweep", "liu-pair", "--speeds", STEERING],
        ["map", "liu-pair", "--over", f"{STEERING}=1:2:3", "--at", "900"],
        ["stiffness", "-o", f"{STEERING}/t.csv"],
        ["validate", STEERING, "-o", "report"],
    ],
    ids=lambda arguments: printable(" ".join(arguments)),
)
def test_no_message_steers_the_terminal(capsys, monkeypatch, tmp_path, arguments):
    monkeypatch.chdir(tmp_path)
    line = refused(capsys, *arguments)
    assert not harmful(line)


def harmful(text: str) -> set[str]:
    return {c for c in text if c != "\n" and unicodedata.category(c) in HARMFUL}


def test_no_table_or_picture_steers_its_reader(capsys, tmp_path, monkeypatch, recwarn):
    """What a file says of itself is free text."""
    monkeypatch.chdir(tmp_path)
    escaped = STEERING.replace("\udc80", "").encode("unicode_escape").decode()
    escaped = escaped.replace("\\x", "\\u00")
    description = f'description = "{escaped}"\ninferences = ["{escaped}"]\n'
    text = CHAIN.replace('"chain"\n', '"a$\\\\foo_{ $日本"\n' + description)
    gears = '[[gear]]\nname = "a"\n[[gear]]\nname = "b"\n'
    mesh = '[[mesh]]\ndriver = "a"\ndriven = "b"\ncenter_distance_mm = 60.2\n'
    (tmp_path / "own.toml").write_text(text + gears + mesh, encoding="utf-8")
    with saved_figures() as figures:
        assert run(["show", "own.toml", "-o", "own.png"]) == 0
    page = capsys.readouterr().out
    assert r"\x1b[31m\x9b\u202e" in page
    assert not harmful(page)
    (figure,) = figures
    drawn = [text.get_text() for text in figure.findobj(Text)]
    assert any(r"\x1b[31m\x9b\u202e" in text for text in drawn)
    assert not any(harmful(text) for text in drawn)
    assert not recwarn.list


def test_a_gear_set_is_not_replaced_by_a_table(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text("mine")
    line = refused(capsys, "theory", *RECTANGULAR, "-o", "own.toml")
    assert "name must end in .csv" in line
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [
        ("own.toml", "mine")
    ]


@pytest.mark.parametrize("letter", ["\\u001b", "\\u009b", "\\u202e", "\\u200b", "\\n"])
def test_names_are_without_control_characters(capsys, tmp_path, letter):
    path = tmp_path / "own.toml"
    path.write_text(CHAIN.replace('"chain"', f'"chain{letter}"'))
    assert "control or format characters" in refused(capsys, "show", path)


def test_what_numpy_says_of_a_full_disk_is_told_in_words():
    error = OSError("75356 requested and 7155 written")
    line = str(file_error("a.msh", "written", error))
    assert line == "a.msh: cannot be written, there is no room for all of it"


@pytest.mark.parametrize(
    "arguments", [["show", "liu-pair"], ["sets"], ["show", "liu-pair", "--json"]]
)
def test_a_reader_that_has_gone_ends_a_command_without_a_word(arguments):
    """Such as `head`: 128 and the number of SIGPIPE, as of other programs."""
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "fegear", *arguments]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_what_is_printed_at_the_end_has_gone_as_well(monkeypatch, tmp_path):
    class Gone(io.StringIO):
        """Others may close the file of a stream that fails."""

        def flush(self):
            raise BrokenPipeError(32, "Broken pipe")

        def fileno(self):
            return file.fileno()

    monkeypatch.setattr("fegear.cli._close_full_output", lambda: None)
    with (tmp_path / "f").open("wb") as file:
        monkeypatch.setattr(sys, "stdout", Gone())
        assert run(["sets"]) == 141
