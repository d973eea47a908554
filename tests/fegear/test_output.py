"""Files are written whole or not at all."""

from __future__ import annotations

import errno
import fcntl
import os
import subprocess
import sys

import pytest

import fegear
from fegear.files.errors import InputError
from fegear.files.output import (
    read_content,
    read_text,
    require_writable,
    write_whole,
)


def test_writer_fills_the_file(tmp_path):
    path = tmp_path / "a.txt"
    write_whole(path, lambda beside: beside.write_text("whole"))
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]


def test_failed_writer_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fail(beside):
        beside.write_text("half")
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_whole(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_suffix_is_kept_for_the_writer(tmp_path):
    suffixes = []
    write_whole(tmp_path / "a.npz", lambda temporary: suffixes.append(temporary.suffix))
    assert suffixes == [".npz"]


def test_permissions_are_those_of_a_usual_file(tmp_path):
    plain, path = tmp_path / "plain", tmp_path / "a"
    plain.write_text("")
    write_whole(path, lambda beside: beside.write_text("x"))
    assert path.stat().st_mode == plain.stat().st_mode


def test_a_device_is_written_directly():
    assert require_writable(os.devnull)
    write_whole(os.devnull, lambda path: path.write_text("gone"))


def test_require_writable_leaves_nothing(tmp_path):
    assert require_writable(tmp_path / "a.txt") == tmp_path / "a.txt"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["none/a.txt", "", "file/a.txt"])
def test_unwritable_path_is_named(tmp_path, name):
    (tmp_path / "file").write_text("")
    path = tmp_path / name
    with pytest.raises(InputError) as caught:
        require_writable(path)
    assert str(caught.value).startswith(f"{path}: ")
    with pytest.raises(InputError):
        write_whole(path, lambda beside: beside.write_text("x"))


KILLED = """
import sys, time
from fegear.files.output import write_whole

def write(beside):
    beside.write_text("half")
    print(beside, flush=True)
    time.sleep(60)

write_whole(sys.argv[1], write)
"""


def test_what_a_killed_process_left_is_swept_away(tmp_path):
    path, mine = tmp_path / "a.png", tmp_path / ".fegear-notes.png"
    mine.write_text("mine")
    command = [sys.executable, "-c", KILLED, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        temporary = writer.stdout.readline().strip()
        again = [sys.executable, "-c", KILLED.replace("sleep(60)", "sleep(0)")]
        subprocess.run([*again, str(path)], check=True, capture_output=True)
        assert os.path.exists(temporary), "its process still runs"
        writer.kill()
    assert os.path.exists(temporary)
    write_whole(tmp_path / "b.csv", lambda place: place.write_text("whole"))
    assert sorted(p.name for p in tmp_path.iterdir()) == [mine.name, "a.png", "b.csv"]


def test_files_are_swept_by_their_locks_not_by_process_numbers(tmp_path):
    """The number of process 1, which runs, may be that of another container's."""
    abandoned = tmp_path / ".fegear-1-abcdefgh.csv"
    abandoned.write_text("half")
    locked = tmp_path / ".fegear-999999999-abcdefgh.csv"
    with locked.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        write_whole(tmp_path / "a.csv", lambda place: place.write_text("whole"))
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [locked.name, "a.csv"]


def test_a_file_that_is_being_written_is_locked(tmp_path):
    def write(place):
        with place.open("w") as file, pytest.raises(BlockingIOError):
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        place.write_text("whole")

    write_whole(tmp_path / "a.csv", write)
    assert (tmp_path / "a.csv").read_text() == "whole"


def test_without_locks_files_are_written_all_the_same(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    other = tmp_path / ".fegear-999999999-abcdefgh.csv"
    other.write_text("half")
    write_whole(tmp_path / "a.csv", lambda place: place.write_text("whole"))
    assert (tmp_path / "a.csv").read_text() == "whole"
    assert other.exists(), "somebody may be writing it"


def test_long_names_and_suffixes_can_be_written(tmp_path):
    for name in ("a" * 250 + ".csv", "a." + "b" * 250):
        write_whole(tmp_path / name, lambda place: place.write_text("whole"))
        assert (tmp_path / name).read_text() == "whole"


def test_texts_are_read_without_a_byte_order_mark(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes("\ufeffname = 1\r\n".encode())
    assert read_text(path) == "name = 1\r\n"
    path.write_bytes(b"ab\xff")
    with pytest.raises(InputError, match="not UTF-8 text, byte 2 is 0xff"):
        read_text(path)


def test_a_file_without_end_is_refused(tmp_path):
    path = tmp_path / "endless.toml"
    path.symlink_to("/dev/zero")
    with pytest.raises(InputError, match=r"endless.toml: larger than 64 MiB$"):
        read_text(path)
    with pytest.raises(InputError, match=r"endless.toml: larger than 64 MiB$"):
        fegear.load_gear_set(path)


def test_a_file_larger_than_its_reader_takes_is_refused(tmp_path):
    path = tmp_path / "long.txt"
    path.write_bytes(bytes(2**20 + 1))
    with pytest.raises(InputError, match=r"long.txt: larger than 1 MiB$"):
        read_content(path, 2**20)
    assert len(read_content(path, 2**20 + 1)) == 2**20 + 1
