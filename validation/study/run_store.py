"""Finished runs kept in directories, and found again while nothing has changed.

inputs.json   what a run was made of
...           its own files
result.json   its result, with digests of the other files and of itself; written last

Files are read once, and what does not fit the digests is not looked into.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from fegear.files.array_files import digest
from fegear.files.errors import InputError, file_error
from fegear.files.output import make_directory, require_writable, write_text

INPUTS, RESULT = "inputs.json", "result.json"
FILES, SEAL = "sha256 of the files", "sha256 of the rest"  # keys of the result
Run = TypeVar("Run")


def inputs_text(inputs: Mapping[str, str]) -> str:
    return json.dumps(inputs, indent=2, sort_keys=True) + "\n"


def with_digests(
    inputs: Mapping[str, str], texts: Mapping[str, str], result: Mapping[str, Any]
) -> dict[str, str]:
    """Texts by the name of their file, the result last."""
    contents = {INPUTS: inputs_text(inputs)} | dict(texts)
    values = dict(result)
    values[FILES] = {name: _sha256(text.encode()) for name, text in contents.items()}
    values[SEAL] = digest(values)
    return contents | {RESULT: json.dumps(values, indent=2) + "\n"}


def read_or_compute(
    directory: Path,
    inputs: Mapping[str, str],
    names: Sequence[str],
    read: Callable[..., Run | None],
    compute: Callable[[], Mapping[str, str]],
    subject: str = "the run",
) -> Run:
    """Read a run, and compute it before where the directory does not hold it.

    names : of its own files
    read : function of `reused` that reads the run; None where a file does not fit
    compute : function that returns the texts of all files by name, the result last
    subject : of the message where another process changes the directory meanwhile

    Raises InputError where files cannot be read or written.
    """
    stored = read(reused=True)
    if stored is not None:
        return stored
    begin_run(make_directory(directory), inputs, names)
    write_texts(directory, compute())
    computed = read(reused=False)
    if computed is None:
        raise InputError(
            f"{directory}: was changed while {subject} was made; run again"
        )
    return computed


def begin_run(directory: Path, inputs: Mapping[str, str], names: Sequence[str]) -> None:
    """Write what a run is made of; InputError where a file could not be written.

    names : of its own files
    """
    for name in (INPUTS, *names, RESULT):
        require_writable(directory / name)
    write_text(directory / INPUTS, inputs_text(inputs))


def write_texts(directory: Path, texts: Mapping[str, str]) -> None:
    for name, text in texts.items():
        write_text(directory / name, text)


def read_verified(
    directory: Path, inputs: Mapping[str, str], names: Sequence[str]
) -> dict[str, str] | None:
    """All files as they were written of these inputs, None where one is not.

    Raises InputError where files are there and cannot be read.
    """
    names = (INPUTS, *names, RESULT)
    contents = {name: _read(directory / name) for name in names}
    data = {name: read for name, read in contents.items() if read is not None}
    if len(data) < len(names) or data[INPUTS] != inputs_text(inputs).encode():
        return None
    try:
        result = json.loads(data[RESULT])
        seal, files = result.pop(SEAL), result[FILES]
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    if seal != digest(result):
        return None
    if files != {name: _sha256(data[name]) for name in names if name != RESULT}:
        return None
    return {name: read.decode("utf-8") for name, read in data.items()}


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _read(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise file_error(path, "read", error) from None
