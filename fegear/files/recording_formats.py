"""Channels of recordings, by the format of the file.

Each reader takes the content of a file and its path, and raises InputError where it is
no such file or damaged.
"""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from fegear.files.errors import InputError, refused_foreign_errors
from fegear.files.hdf5_groups import read_ranked_group
from fegear.files.matlab import is_hdf5, matlab_tree, read_matlab
from fegear.files.output import HDF5_NEEDED, TDMS_NEEDED, has_package
from fegear.files.stored_channels import (
    StoredChannels,
    channels_of_arrays,
    recording_rank,
    seconds_of,
)
from lumped.common.array_types import Array
from lumped.common.csv_text import TableError, parse_csv, separator_of

RIFF_HEADER, CHUNK_HEADER = 12, 8  # bytes
UNSIGNED_MIDDLE = 128  # of bytes, the one unsigned type of WAV files


def read_text_channels(content: bytes, path: str) -> StoredChannels:
    """Columns of a table with names above them; the first one may be the time."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = f"byte {error.start} is 0x{content[error.start]:02x}"
        raise InputError(f"{path}: not UTF-8 text, {byte}") from None
    try:
        names, rows = _names_and_rows(text, path)
    except TableError as error:
        raise InputError(str(error)) from None
    columns = dict(zip(names, rows.T, strict=True))
    seconds = seconds_of(names[0])
    time = seconds * columns.pop(names[0]) if seconds else None
    return StoredChannels(columns, time)


def _names_and_rows(text: str, path: str) -> tuple[list[str], Array]:
    """Names (c,) and values (n, c) of a table; TableError where it is none."""
    lines = text.splitlines()
    first = next((n for n, line in enumerate(lines) if _is_row(line)), len(lines) - 1)
    names = [n.strip() for n in parse_csv("\n".join(lines[: first + 1]), path).names]
    if any(map(_is_number, names)) or not all(names):
        shown = ", ".join(names)
        raise TableError(
            f"{path}, line {first + 1}: {shown}; names of the columns are needed here"
        )
    rows = lines[first + 1 :]
    if not any(map(_is_row, rows)):
        raise TableError(f"{path}: no rows below the names")
    try:
        values = np.loadtxt(
            rows, delimiter=separator_of(lines[first]), ndmin=2, comments="#"
        )
    except ValueError:  # decimal commas, empty cells, or an error that it does not name
        return names, _parsed_rows(text, path)
    if values.shape[1] != len(names):
        parse_csv(text, path)  # names the line
    return names, values


def _is_row(line: str) -> bool:
    return bool(line.strip()) and not line.startswith("#")


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _parsed_rows(text: str, path: str) -> Array:
    """Values (n, c) of a table, cell by cell; an empty cell is NaN."""
    table = parse_csv(text, path)
    return np.array(
        [
            [
                _number(cell, name, place)
                for name, cell in zip(table.names, row, strict=True)
            ]
            for place, row in table.rows.items()
        ]
    )


def _number(cell: str, name: str, place: str) -> float:
    if not cell.strip():
        return np.nan
    try:
        return float(cell)
    except ValueError:
        raise TableError(
            f"{place}: column {name} has {cell!r}; must be a number"
        ) from None


def read_mat_channels(content: bytes, path: str) -> StoredChannels:
    """Vectors and matrices of a MAT file, at its top or in a struct."""
    if is_hdf5(content):
        return read_hdf5_channels(content, path)
    variables = read_matlab(content, path)
    with refused_foreign_errors(path, "MAT file"):
        parts = list(_parts({n: matlab_tree(v) for n, v in variables.items()}))
        ranks = [recording_rank(_names_of_vectors(part)) for part in parts]
        return channels_of_arrays(parts[ranks.index(max(ranks))])


def _parts(tree: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """A tree and all trees in it, from the top."""
    yield tree
    for part in tree.values():
        if isinstance(part, Mapping):
            yield from _parts(part)


def _names_of_vectors(part: Mapping[str, Any]) -> list[str]:
    return [
        name
        for name, value in part.items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiu"
    ]


def read_hdf5_channels(content: bytes, path: str) -> StoredChannels:
    """Vectors and matrices in the group of an HDF5 file that has times or a rate."""
    if not has_package("h5py"):
        raise InputError(f"{path}: {HDF5_NEEDED}")
    part = read_ranked_group(content, recording_rank, path)
    return channels_of_arrays(part or {})


def read_wav_channels(content: bytes, path: str) -> StoredChannels:
    """Channels of a WAV file, integers over their largest value."""
    from scipy.io import wavfile

    stream: Any = io.BytesIO(content)
    with refused_foreign_errors(path, "WAV file"):
        _require_complete_chunks(content)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rate, samples = wavfile.read(stream)
        values = np.atleast_2d(samples.T).astype(float)
        if samples.dtype.kind == "u":
            values = (values - UNSIGNED_MIDDLE) / UNSIGNED_MIDDLE
        elif samples.dtype.kind == "i":
            values /= 2.0 ** (8 * samples.dtype.itemsize - 1)
    names = [f"channel{number}" for number in range(1, 1 + len(values))]
    columns = dict(zip(names, values, strict=True))
    return StoredChannels(columns, rates=dict.fromkeys(names, float(rate)))


def _require_complete_chunks(content: bytes) -> None:
    """ValueError for a file that ends within its data, which SciPy would read.

    A file of more than 4 GiB states its sizes elsewhere; it is too large here.
    """
    order = {b"RIFF": "<", b"RIFX": ">"}[content[:4]]
    start = RIFF_HEADER
    while start + CHUNK_HEADER <= len(content):
        (size,) = struct.unpack_from(f"{order}I", content, start + 4)
        start += CHUNK_HEADER + size
        if start > len(content):
            raise ValueError("cut short")
        start += size % 2


def read_tdms_channels(content: bytes, path: str) -> StoredChannels:
    """Channels of numbers of a TDMS file, each with its rate."""
    if not has_package("nptdms"):
        raise InputError(f"{path}: {TDMS_NEEDED}")
    from nptdms import TdmsFile

    with refused_foreign_errors(path, "TDMS file"):
        _require_complete_segments(TdmsFile, content)
        channels = [
            channel
            for group in TdmsFile.read(io.BytesIO(content)).groups()
            for channel in group.channels()
            if channel.dtype.kind in "fiu" and len(channel)
        ]
        names = [channel.name for channel in channels]
        columns, rates, starts = dict[str, Array](), {}, {}
        time = None
        for channel in channels:
            name, values = channel.name, np.array(channel[:], float)
            step = channel.properties.get("wf_increment")
            seconds = seconds_of(name)
            if step is None and time is None and seconds:
                time = seconds * values
                continue
            if names.count(name) > 1:
                name = f"{channel.group_name}/{name}"
            columns[name] = values
            if step is not None:
                rates[name] = 1.0 / float(step)
                starts[name] = float(channel.properties.get("wf_start_offset", 0.0))
    return StoredChannels(columns, time, rates, starts)


def _require_complete_segments(kind: Any, content: bytes) -> None:
    """ValueError for more values than bytes, and for a last segment that is cut short.

    Values are not compressed: sizes are checked before memory is reserved.
    """
    file = kind.read_metadata(io.BytesIO(content))
    channels = [channel for group in file.groups() for channel in group.channels()]
    if sum(map(len, channels)) > len(content):
        raise ValueError("more values than bytes")
    if file.file_status.incomplete_final_segment:
        raise ValueError("cut short")


READERS: Mapping[str, Callable[[bytes, str], StoredChannels]] = {
    ".csv": read_text_channels,
    ".txt": read_text_channels,
    ".mat": read_mat_channels,
    ".h5": read_hdf5_channels,
    ".hdf5": read_hdf5_channels,
    ".wav": read_wav_channels,
    ".tdms": read_tdms_channels,
}
