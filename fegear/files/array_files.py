"""Arrays in files with a digest, and as bytes.

Arrays that take long to compute are kept in files named after a digest of what
determines them. Processes may share them: files appear whole by renaming.
"""

from __future__ import annotations

import hashlib
import io
import json
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError
from fegear.files.output import make_directory, write_whole

Array = NDArray[Any]
NUMBERS = "biufc"  # kinds of arrays that are saved without pickle
SEAL_SIZE = hashlib.sha256().digest_size
# NumPy reads the headers of arrays with `ast`, which in CPython 3.11 fails now and then
# where several threads do so at once (python/cpython#106905)
_ONE_READER = threading.Lock()


def digest(inputs: Mapping[str, Any]) -> str:
    """SHA-256 of plain values, whatever their order."""
    text = json.dumps(inputs, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def save_arrays(path: Path, key: str, arrays: Mapping[str, Array]) -> None:
    """Store arrays under a key of their inputs, if the disk takes them.

    The archive is followed by a digest of the key and of all its bytes.
    """
    content = pack(arrays)
    sealed = content + _arrays_seal(key, content)
    try:
        make_directory(path.parent)
        write_whole(path, lambda beside: beside.write_bytes(sealed))
    except InputError:  # next time they are computed again, which is only slower
        return


def load_arrays(path: Path, key: str) -> dict[str, Array] | None:
    """The arrays of that key; None if the file is missing, damaged or another's.

    The checksums of NumPy's archives do not cover all of their headers.
    """
    try:
        data = path.read_bytes()
    except OSError:
        return None
    content, seal = data[:-SEAL_SIZE], data[-SEAL_SIZE:]
    return unpack(content) if seal == _arrays_seal(key, content) else None


def _arrays_seal(key: str, content: bytes) -> bytes:
    return hashlib.sha256(key.encode() + content).digest()


def pack(arrays: Mapping[str, Array]) -> bytes:
    """Arrays of numbers by any name as an NPZ archive; ValueError for other kinds."""
    for name, values in arrays.items():
        if np.asarray(values).dtype.kind not in NUMBERS:
            kind = np.asarray(values).dtype
            raise ValueError(f"{name} must be numbers, got {kind}")
    out = io.BytesIO()
    marked: dict[str, Any] = {f"_{name}": values for name, values in arrays.items()}
    np.savez(out, **marked)  # unmarked, `file` would be an option of its own
    return out.getvalue()


def unpack(content: bytes) -> dict[str, Array]:
    with _ONE_READER, np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name[1:]: archive[name] for name in archive.files}
