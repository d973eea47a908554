"""Sizes that a MAT file of version 5 declares, checked before SciPy reserves memory."""

from __future__ import annotations

import math
import struct
import zlib

from fegear.files.errors import InputError

HEADER_BYTES, TAG_BYTES = 128, 8
MIN_SHAPE_BYTES = 8  # of two dimensions
COMPRESSED, MATRIX = 15, 14  # types of elements
INT8, INT32, UINT32, UTF8 = 1, 5, 6, 16
# of values in single elements, and of arrays; SciPy looks up others out of bounds
TYPES = frozenset((INT8, 2, 3, 4, INT32, UINT32, 7, 9, 12, 13, MATRIX, UTF8, 17, 18))
COMPOSITE_CLASSES = (1, 2, 3)  # classes of arrays: cells, structs and objects
CHARS, SPARSE, NUMBERS = 4, 5, range(6, 16)
# elements after the head of an array by its class, one more where it is complex
PARTS_OF_CLASS = {CHARS: 1, SPARSE: 3, **dict.fromkeys(NUMBERS, 1)}
COMPLEX_FLAG = 8
OPAQUE_CLASS = 17  # of objects of the newer kind
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
    """Types of all elements are those of the format; arrays have sound heads.

    Arrays of parts have at most as many as there are bytes for their tags.
    """
    stretches_to_read = [(0, len(content))]
    while stretches_to_read:
        start, end = stretches_to_read.pop()
        while start + TAG_BYTES <= end:
            kind, size = struct.unpack_from(f"{order}II", content, start)
            inner = start + TAG_BYTES
            if (kind & 0xFFFF) not in TYPES:
                raise _damaged(path)
            if kind >> 16:  # a small element, whose tag has its values
                start = inner
                continue
            if kind == MATRIX and size:
                matrix = content[inner : min(inner + size, end)]
                body = _require_head(matrix, order, path)
                stretches_to_read.append((inner + body, min(inner + size, end)))
            start = inner + size + -size % TAG_BYTES


def _require_head(matrix: bytes, order: str, path: str) -> int:
    """Bytes of the head of an array: flags, dimensions and name, in this order.

    SciPy reads these without a look at their types.
    """
    if len(matrix) < 24:
        raise _damaged(path)
    flags, flags_size = struct.unpack_from(f"{order}II", matrix, 0)
    if (flags, flags_size) != (UINT32, 8):
        raise _damaged(path)
    if matrix[8 if order == "<" else 11] == OPAQUE_CLASS:  # has no dimensions
        return 16
    kind, size = struct.unpack_from(f"{order}II", matrix, 16)
    name = 24 + size + -size % TAG_BYTES
    is_shape = kind in (INT32, UINT32) and size >= MIN_SHAPE_BYTES
    if not is_shape or name + TAG_BYTES > len(matrix):
        raise _damaged(path)
    _require_shape(matrix, order, path)
    (name_kind,) = struct.unpack_from(f"{order}I", matrix, name)
    if (name_kind & 0xFFFF) not in (INT8, UTF8):
        raise _damaged(path)
    flag_bytes = matrix[8:12] if order == "<" else matrix[11:7:-1]
    parts = PARTS_OF_CLASS.get(flag_bytes[0], 0)
    if parts and _count_elements(matrix, name, order) != 1 + parts + bool(
        flag_bytes[1] & COMPLEX_FLAG
    ):
        raise _damaged(path)
    return name


def _count_elements(matrix: bytes, start: int, order: str) -> int:
    """Number of elements from a place on, 0 where one ends beyond the array."""
    count = 0
    while start + TAG_BYTES <= len(matrix):
        kind, size = struct.unpack_from(f"{order}II", matrix, start)
        start += TAG_BYTES if kind >> 16 else TAG_BYTES + size + -size % TAG_BYTES
        count += 1
    return count if start == len(matrix) else 0


def _require_shape(matrix: bytes, order: str, path: str) -> None:
    """The array's flags, 16 bytes, come first and its dimensions second."""
    if matrix[8 if order == "<" else 11] not in COMPOSITE_CLASSES:
        return
    _, size = struct.unpack_from(f"{order}II", matrix, 16)
    count = min(size, len(matrix) - 24) // 4
    sizes = struct.unpack_from(f"{order}{count}i", matrix, 24)
    if min(sizes, default=0) < 0 or math.prod(sizes) > len(matrix):
        raise _damaged(path)


def _damaged(path: str) -> InputError:
    return InputError(f"{path}: is no MAT file, or damaged")
