"""Stored files of every kind: what is damaged is refused or computed again.

A file is empty, foreign, cut short, filled with zeros, or has a bit turned; what is
read of it is what was written, or one line says that it cannot be read.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import fegear
from fegear.files.array_bytes import pack
from fegear.files.errors import InputError
from fegear.files.kept import INPUTS as SEAL
from fegear.files.kept import (
    read_verified_files,
    with_inputs_file,
    write_verified_files,
)
from fegear.files.netcdf import Variable, read_netcdf, write_netcdf
from fegear.files.store import open_checkpoint

KEPT = {"flank.npz": pack({"normal": np.arange(6.0).reshape(1, 2, 3)}), "b": b"1,2"}
GEAR = {"teeth": 38}
SPEEDS = {"up": 4, "down": 2}  # in a checkpoint
INPUTS = {"gear set": "pair.toml"}


def write_directory(path: Path) -> None:
    write_verified_files(path.parent, with_inputs_file(GEAR, KEPT))


def read_directory(path: Path) -> None:
    assert read_verified_files(path.parent, {"teeth": 39}, [*KEPT]) is None
    contents = read_verified_files(path.parent, GEAR, [*KEPT])
    if contents is None:
        raise InputError(f"{path}: is computed again")
    assert contents == KEPT


def write_variables(path: Path) -> None:
    write_netcdf(path, {"a": "text"}, {"b": Variable(np.arange(5.0), "n")})


def read_variables(path: Path) -> None:
    attributes, arrays = read_netcdf(path)
    assert attributes == {"a": "text"}
    np.testing.assert_array_equal(arrays["b"], np.arange(5.0))


RESULT = fegear.run(fegear.BuiltinSets())


def read_result(path: Path) -> None:
    loaded = fegear.load(path)
    assert loaded.study == RESULT.study
    assert loaded.table.csv() == RESULT.table.csv()


def entry(number: int) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    return {"speed_Hz": 0.1 * number}, {"q": np.arange(5) + 0.1 * number}


def write_checkpoint(path: Path) -> None:
    checkpoint = open_checkpoint(path, INPUTS, resume=False)
    for branch, count in SPEEDS.items():
        for number in range(count):
            checkpoint.add(branch, *entry(number))
    checkpoint.close(keep=True)


def read_checkpoint(path: Path) -> None:
    """What is finished, if less, was added; the rest can be added again."""
    checkpoint = open_checkpoint(path, INPUTS, resume=True)
    try:
        for branch, count in SPEEDS.items():
            for number in range(len(checkpoint.finished(branch)), count + 1):
                checkpoint.add(branch, *entry(number))
            records = checkpoint.finished(branch)
            assert records == [entry(number)[0] for number in range(count + 1)]
            state = checkpoint.state(branch)
            np.testing.assert_array_equal(state["q"], entry(count)[1]["q"])
    finally:
        checkpoint.close(keep=False)


class Kind(NamedTuple):
    """A kind of file; read : raises InputError, or asserts what it reads."""

    name: str
    write: Callable[[Path], None]
    read: Callable[[Path], None]


KINDS = {
    "arrays": Kind("flank.npz", write_directory, read_directory),
    "seal": Kind(SEAL, write_directory, read_directory),
    "netCDF": Kind("x.nc", write_variables, read_variables),
    "result": Kind("result.nc", RESULT.save, read_result),
    "checkpoint": Kind("out.csv.partial", write_checkpoint, read_checkpoint),
}


def damages(content: bytes, chance: random.Random) -> Iterator[bytes]:
    """One bit of each byte, or of many of a long file where it has something."""
    yield from (b"", content[:1], b"not an archive" * 50, bytes(range(256)) * 8)
    places = [at for at, byte in enumerate(content) if byte or len(content) < 2000]
    if len(places) > 600:
        places = sorted(chance.sample(places, 600))
    for at in places:
        bit = 1 << chance.randrange(8)
        yield content[:at] + bytes([content[at] ^ bit]) + content[at + 1 :]
    for at in chance.choices(places, k=30):
        yield content[:at]
        yield content[:at] + bytes(9)
    yield content[:-1]


def refusal(kind: Kind, path: Path) -> str:
    """Why a file is not read, empty where it is."""
    try:
        kind.read(path)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_damage_never_yields_a_wrong_value(tmp_path, kind):
    path, refused = tmp_path / kind.name, 0
    kind.write(path)
    content = path.read_bytes()
    kind.read(path)
    for damaged in damages(content, random.Random(1)):
        path.write_bytes(damaged)
        message = refusal(kind, path)
        refused += bool(message)
        assert not message or message.startswith(f"{path}: ")
        assert "\n" not in message
    assert refused > 30
