"""A store of results on disk, whose directories are verified and never trusted.

A directory is named after a digest of all that determines what it holds. Its
inputs.json has these inputs and the digests of the other files, and is written last.
Files are read once, and what does not fit is not looked into but computed again.
Processes may share a directory: files appear whole by renaming.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fegear.files.contents import content_digest, sha256
from fegear.files.errors import file_error
from fegear.files.output import make_directory, write_bytes

INPUTS = "inputs.json"


def directory_of_inputs(store: Path, label: str, inputs: Mapping[str, Any]) -> Path:
    """The directory in a store of a result, by its inputs in any order."""
    text = json.dumps(inputs, sort_keys=True)
    return store / f"{label}-{content_digest(text.encode())}"


def with_inputs_file(
    inputs: Mapping[str, Any], contents: Mapping[str, bytes]
) -> dict[str, bytes]:
    """Contents by the name of their file, with inputs.json as the last."""
    digests = {name: sha256(content) for name, content in contents.items()}
    seal = json.dumps({"inputs": inputs, "sha256": digests}, indent=2, sort_keys=True)
    return {**contents, INPUTS: f"{seal}\n".encode()}


def write_verified_files(directory: Path, contents: Mapping[str, bytes]) -> None:
    """Write contents of `with_inputs_file`; InputError where they cannot be written."""
    make_directory(directory)
    for name, content in contents.items():
        write_bytes(directory / name, content)


def read_verified_files(
    directory: Path, inputs: Mapping[str, Any], names: Sequence[str]
) -> dict[str, bytes] | None:
    """Contents as they were written of these inputs, None where one is not.

    names : of all files but inputs.json

    Raises InputError where files are there and cannot be read.
    """
    read = {name: _read(directory / name) for name in (*names, INPUTS)}
    contents = {name: data for name, data in read.items() if data is not None}
    seal = contents.pop(INPUTS, None)
    fits = (
        len(contents) == len(names)
        and seal == with_inputs_file(inputs, contents)[INPUTS]
    )
    return contents if fits else None


def _read(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise file_error(path, "read", error) from None
