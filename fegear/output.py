"""Files that appear whole or not at all, and text for machines."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fegear.errors import InputError


def require_writable(path: str | os.PathLike[str]) -> Path:
    """The path, if a file can be written there; nothing is left behind.

    Raises InputError otherwise, so that no work is done for nothing.
    """
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{target}: is a directory, a file name is needed")
    if target.exists() and not target.is_file():
        return target  # /dev/stdout and the like
    if target.exists() and not os.access(target, os.W_OK):
        raise InputError(f"{target}: cannot be written, permission denied")
    try:
        _temporary_beside(target).unlink()
    except OSError as error:
        raise InputError(f"{target}: cannot be written, {_reason(error)}") from None
    return target


def make_directory(path: str | os.PathLike[str]) -> Path:
    """The directory, made with its parents; InputError where that is not possible."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made, {_reason(error)}") from None
    return Path(path)


def write_whole(path: str | os.PathLike[str], writer: Callable[[Path], object]) -> None:
    """Let `writer` fill a file beside `path`, then move it into place.

    The file beside has the suffix of `path`. If the writer fails, `path` is as it
    was. Raises InputError where the file cannot be written.
    """
    target = Path(path)
    device = target.exists() and not (target.is_file() or target.is_dir())
    try:
        if device:
            writer(target)
        else:
            _fill_and_replace(target, writer)
    except OSError as error:
        raise InputError(f"{target}: cannot be written, {_reason(error)}") from None


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a whole text as it is, line ends too; see `write_whole`."""
    write_whole(path, lambda place: place.write_bytes(text.encode()))


def strict_json(values: Mapping[str, Any]) -> str:
    """JSON without NaN: what is not finite becomes null."""
    import json

    return json.dumps(_finite(values), indent=2, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _fill_and_replace(target: Path, writer: Callable[[Path], object]) -> None:
    beside = _temporary_beside(target)
    try:
        writer(beside)
        beside.chmod(_mode_of(target))
        os.replace(beside, target)
    finally:
        beside.unlink(missing_ok=True)


def _temporary_beside(target: Path) -> Path:
    """A new empty file in the same folder, so that a rename is atomic."""
    handle, name = tempfile.mkstemp(
        suffix=target.suffix, prefix=f".{target.stem}-", dir=target.parent
    )
    os.close(handle)
    return Path(name)


def _mode_of(target: Path) -> int:
    """Permissions of the file that is replaced, or those a new file would get."""
    if target.exists():
        return target.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()
