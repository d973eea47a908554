"""Arrays as bytes."""

from __future__ import annotations

import io
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
NUMBERS = "biufc"  # kinds of arrays that are saved without pickle
# NumPy reads the headers of arrays with `ast`, which in CPython 3.11 fails now and then
# where several threads do so at once (python/cpython#106905)
_ONE_READER = threading.Lock()


def pack(arrays: Mapping[str, Array]) -> bytes:
    """Arrays of numbers by any name as an NPZ archive; ValueError for other kinds."""
    for name, values in arrays.items():
        if np.asarray(values).dtype.kind not in NUMBERS:
            kind = np.asarray(values).dtype
            raise ValueError(f"type of {name} = {kind}; must be numbers")
    out = io.BytesIO()
    marked: dict[str, Any] = {f"_{name}": values for name, values in arrays.items()}
    np.savez(out, **marked)  # unmarked, `file` would be an option of its own
    return out.getvalue()


def unpack(content: bytes) -> dict[str, Array]:
    with _ONE_READER, np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name[1:]: archive[name] for name in archive.files}
