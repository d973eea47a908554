"""What determines a result, as text: values to the last bit, files by their content."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fegear.files.errors import file_error

SHOWN = 16  # characters of a digest


def content_digest(content: bytes) -> str:
    """Start of the SHA-256 of a content."""
    return sha256(content)[:SHOWN]


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def file_digests(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Each name that is a file's, with the digest of its content.

    Other names are those of what comes with the program. Raises InputError for a file
    that cannot be read.
    """
    for name in names:
        path = Path(name)
        try:
            if path.is_file():
                yield name, content_digest(path.read_bytes())
        except (OSError, ValueError) as error:
            raise file_error(path, "read", error) from None


def exact_repr(value: Any) -> str:
    """`repr` of a value in which arrays are digests of their content.

    NumPy shortens long arrays, and results show sizes only. Fields that are neither
    compared nor shown are no part of a value.
    """
    if isinstance(value, np.ndarray):
        content = content_digest(np.ascontiguousarray(value).tobytes())
        return f"<array {value.dtype} {value.shape} {content}>"
    if is_dataclass(value) and not isinstance(value, type):
        parts = (
            f"{f.name}={exact_repr(getattr(value, f.name))}"
            for f in fields(value)
            if f.compare or f.repr
        )
        return f"{type(value).__qualname__}({', '.join(parts)})"
    if isinstance(value, Mapping):
        pairs = (f"{exact_repr(k)}: {exact_repr(v)}" for k, v in value.items())
        return f"{{{', '.join(pairs)}}}"
    if type(value) is tuple:
        return f"({', '.join(map(exact_repr, value))}{',' * (len(value) == 1)})"
    if type(value) is list:
        return f"[{', '.join(map(exact_repr, value))}]"
    return repr(value)
