"""Sizes that a MAT file of version 5 declares, checked before SciPy reserves memory."""

from __future__ import annotations

import math
import struct
import zlib

from fegear.files.errors import InputError

HEADER_BYTES, TAG_BYTES = 128, 8
COMPRESSED, MATRIX = 15, 14  # types of elements
COMPOSITE_CLASSES = (1, 2, 3)  # classes of arrays: cells, structs and objects
MAX_BYTES = 2**27  # of all elements when they are unpacked


def require_sound_sizes(content: bytes, path: str) -> None:
    """Refuse elements that unpack to too much, or arrays of more parts than bytes.

    Other damage is for SciPy to find. A file of version 4 has no such elements.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[HEADER_BYTES - 2 : HEADER_BYTES])
    if order is None:
        return
    budget, start = MAX_BYTES, HEADER_BYTES
    while start + TAG_BYTES <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, start)
        element = content[start : start + TAG_BYTES + size]
        if kind == COMPRESSED:
            element = zlib.decompressobj().decompress(element[TAG_BYTES:], budget + 1)
        budget -= len(element)
        if budget < 0:
            raise InputError(f"{path}: larger than {MAX_BYTES // 2**20} MiB unpacked")
        _require_parts(element, order, path)
        start += TAG_BYTES + size


def _require_parts(content: bytes, order: str, path: str) -> None:
    """Arrays of parts have at most as many as there are bytes for their tags."""
    stretches_to_read = [(0, len(content))]
    while stretches_to_read:
        start, end = stretches_to_read.pop()
        while start + TAG_BYTES <= end:
            kind, size = struct.unpack_from(f"{order}II", content, start)
            inner = start + TAG_BYTES
            if kind >> 16:  # a small element, whose tag has its values
                start = inner
                continue
            if kind == MATRIX:
                _require_shape(content[inner : min(inner + size, end)], order, path)
                stretches_to_read.append((inner, min(inner + size, end)))
            start = inner + size + -size % TAG_BYTES


def _require_shape(matrix: bytes, order: str, path: str) -> None:
    """The array's flags, 16 bytes, come first and its dimensions second."""
    if len(matrix) < 24 or matrix[8 if order == "<" else 11] not in COMPOSITE_CLASSES:
        return
    _, size = struct.unpack_from(f"{order}II", matrix, 16)
    count = min(size, len(matrix) - 24) // 4
    sizes = struct.unpack_from(f"{order}{count}i", matrix, 24)
    if min(sizes, default=0) < 0 or math.prod(sizes) > len(matrix):
        raise InputError(f"{path}: is no MAT file, or damaged")
