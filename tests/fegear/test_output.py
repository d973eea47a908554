"""Files are written whole or not at all."""

from __future__ import annotations

import os

import pytest

from fegear.errors import InputError
from fegear.output import require_writable, write_whole


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
    seen = []
    write_whole(tmp_path / "a.npz", lambda beside: seen.append(beside.suffix))
    assert seen == [".npz"]


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
