"""Runs kept in directories by `fegear.files.kept`, with a result.json of each."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from fegear.files.errors import InputError
from fegear.files.kept import (
    INPUTS,
    read_verified_files,
    with_inputs_file,
    write_verified_files,
)
from fegear.files.output import make_directory, require_writable

RESULT = "result.json"
Run = TypeVar("Run")


def run_contents(
    inputs: Mapping[str, str], texts: Mapping[str, str], result: Mapping[str, Any]
) -> dict[str, bytes]:
    """All files of a run by name: texts, the result, and what they are of."""
    texts = {**texts, RESULT: json.dumps(result, indent=2) + "\n"}
    return with_inputs_file(
        inputs, {name: text.encode() for name, text in texts.items()}
    )


def read_or_compute(
    directory: Path,
    names: Sequence[str],
    read: Callable[..., Run | None],
    compute: Callable[[], Mapping[str, bytes]],
    subject: str = "the run",
) -> Run:
    """Read a run, and compute it before where the directory does not hold it.

    names : of its own files
    read : function of `reused` that reads the run; None where a file does not fit
    compute : function that returns `run_contents`
    subject : of the message where another process changes the directory meanwhile

    Raises InputError where files cannot be read or written.
    """
    stored = read(reused=True)
    if stored is not None:
        return stored
    make_directory(directory)
    for name in (*names, RESULT, INPUTS):
        require_writable(directory / name)
    write_verified_files(directory, compute())
    computed = read(reused=False)
    if computed is None:
        raise InputError(
            f"{directory}: was changed while {subject} was made; run again"
        )
    return computed


def read_texts(
    directory: Path, inputs: Mapping[str, str], names: Sequence[str]
) -> dict[str, str] | None:
    """Texts of its own files and of the result, None where one is not as written.

    Raises InputError where files are there and cannot be read.
    """
    contents = read_verified_files(directory, inputs, (*names, RESULT))
    if contents is None:
        return None
    return {name: content.decode() for name, content in contents.items()}
