"""Finished speeds of a long sweep, kept so that a killed run loses at most one.

A journal is a directory beside the output:

    inputs.json             what determines the results, as canonical JSON
    lock                    held by the process that works on the journal
    BRANCH.000012.json      figures of a speed, sealed by a checksum
    BRANCH.000012.npz       state to go on from, of a branch's last speed only

Every file is written beside its place and then moved there, the state of a speed
before its entry, and older state is removed last. So at any instant the entries of a
branch and one state that fits the last of them are whole. Files of other names are
left alone.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from fegear.errors import InputError, file_error
from fegear.output import make_directory

Array = NDArray[Any]
FORMAT = "fegear speed journal 1"
START = f'{{"format":"{FORMAT}"'  # of inputs.json, by which a journal is recognised
INPUTS, LOCK, BESIDE = "inputs.json", "lock", ".new"
NUMBERS = "biufc"  # kinds of arrays that are saved without pickle
SHOWN = 40  # characters of a value in a message

BRANCH = re.compile(r"[A-Za-z0-9][\w.+-]{0,99}", re.ASCII)
FILE = re.compile(rf"({BRANCH.pattern})\.(\d{{6,}})\.(json|npz)(\.new)?", re.ASCII)
SEALED = re.compile(rb'\{"sha256":"([0-9a-f]{64})","entry":(.*)\}\n', re.DOTALL)


@dataclass(frozen=True)
class Entry:
    """A finished speed.

    values : as they were added, tuples as lists; floats to the bit, but every NaN
        is the usual one
    state_names, state_sha256 : of the state that was saved with it
    """

    branch: str
    index: int
    values: Mapping[str, Any]
    state_names: tuple[str, ...]
    state_sha256: str


@dataclass(frozen=True, eq=False)
class Journal:
    """An open journal; no other process has it until it is closed or this one ends.

    Processes forked while it is open hold it as well, until they end.
    A branch is a short word, letters, digits and `_ . + -`, such as 100-up.
    """

    directory: Path
    _lock: FileLock
    _lengths: dict[str, int] = field(default_factory=dict)  # of branches seen so far

    def finished(self, branch: str) -> list[Entry]:
        """Entries 0, 1, ... up to the last one that is whole and has its state."""
        return self._whole(branch)[0]

    def entry_files(self, branch: str) -> int:
        """Number of entries that lie in the directory, whole or not."""
        return sum(
            (name, kind, path.suffix) == (branch, "json", ".json")
            for path, (name, _, kind) in _own_files(self.directory)
        )

    def state(self, branch: str) -> dict[str, Array] | None:
        """State of the last finished entry, None where there is none."""
        entries, data = self._whole(branch)
        return _arrays(data, entries[-1].state_names) if entries else None

    def add(
        self,
        branch: str,
        index: int,
        values: Mapping[str, Any],
        state: Mapping[str, Array],
    ) -> None:
        """Keep the speed that follows the finished ones, and its state.

        values : what JSON can hold, also NaN and infinities
        state : name -> array of numbers; only that of the last speed is kept

        Raises ValueError if index is not the next one or a state is not numbers,
        TypeError for values that are not JSON, OSError where the disk is full; the
        journal is then as it was.
        """
        if not self._lock.is_locked:
            raise ValueError(f"{self.directory}: the journal is closed")
        if index != self._length(branch):
            wanted = self._length(branch)
            raise ValueError(f"{branch}: index must be {wanted}, got {index}")
        data = _npz(state)
        entry = Entry(branch, index, values, tuple(state), _sha256(data))
        text = _sealed(entry)
        del self._lengths[branch]  # counted anew if anything below fails
        # what lies beyond a gap or damage must not follow the new entry
        self._remove(branch, lambda other, _: other >= index)
        _replace(self._path(branch, index, "npz"), data)
        _replace(self._path(branch, index, "json"), text)
        self._lengths[branch] = index + 1
        with contextlib.suppress(OSError):  # done all the same; the next one retries
            self._remove(branch, lambda other, kind: other < index and kind == "npz")

    def close(self, keep: bool) -> None:
        """Let other processes in; without `keep` remove the journal's files first."""
        if not self._lock.is_locked:
            return
        if keep:
            self._lock.release()
            return
        try:
            _discard(self.directory)
            (self.directory / INPUTS).unlink(missing_ok=True)
            with contextlib.suppress(PermissionError):  # Windows: removed by release
                (self.directory / LOCK).unlink(missing_ok=True)
        finally:
            self._lock.release()
        with contextlib.suppress(OSError):  # something of the user's is in there
            self.directory.rmdir()

    def _length(self, branch: str) -> int:
        if branch not in self._lengths:
            self._lengths[branch] = len(self.finished(branch))
        return self._lengths[branch]

    def _whole(self, branch: str) -> tuple[list[Entry], bytes]:
        """The finished entries and the state file of the last of them."""
        if not BRANCH.fullmatch(branch):
            raise ValueError(f"branch must match {BRANCH.pattern}, got {branch!r}")
        entries: list[Entry] = []
        while entry := self._entry(branch, len(entries)):
            entries.append(entry)
        while entries:
            data = _read(self._path(branch, entries[-1].index, "npz"))
            if data is not None and _sha256(data) == entries[-1].state_sha256:
                return entries, data
            entries.pop()
        return [], b""

    def _entry(self, branch: str, index: int) -> Entry | None:
        data = _read(self._path(branch, index, "json"))
        entry = None if data is None else _unsealed(data)
        is_own = entry is not None and (entry.branch, entry.index) == (branch, index)
        return entry if is_own else None

    def _path(self, branch: str, index: int, kind: str) -> Path:
        return self.directory / f"{branch}.{index:06d}.{kind}"

    def _remove(self, branch: str, chosen: Callable[[int, str], bool]) -> None:
        for path, (name, index, kind) in _own_files(self.directory):
            if name == branch and chosen(index, kind):
                path.unlink()


def open_journal(directory: Path, inputs: Mapping[str, str], resume: bool) -> Journal:
    """The journal in a directory, which is made where there is none.

    inputs : everything that determines the results
    resume : go on with what a journal of the same inputs holds; else an existing
        one is emptied

    Raises InputError where the directory cannot be used, is not a journal, belongs to
    other inputs, or another process works on it; then nothing in it is changed.
    """
    _require_journal(make_directory(directory))
    lock = _locked(directory)
    try:
        if resume and (directory / INPUTS).exists():
            _require_inputs(directory, inputs)
        else:
            _discard(directory)
            _replace(directory / INPUTS, _inputs_text(inputs).encode())
    except BaseException as error:
        lock.release()
        if isinstance(error, OSError):
            raise file_error(directory, "used", error) from None
        raise
    return Journal(directory, lock)


def _require_journal(directory: Path) -> None:
    """Raise InputError unless the directory is a journal or has nothing in it."""
    try:
        inside = {item.name: item for item in directory.iterdir()}
        known = [inside[INPUTS]] if INPUTS in inside else inside.values()
        is_journal = all(_is_own(path) for path in known)
    except OSError as error:
        raise file_error(directory, "used", error) from None
    if not is_journal:
        raise InputError(
            f"{directory}: is no journal of a sweep and not empty; nothing in it was "
            "changed, move it away or name another output"
        )


def _is_own(path: Path) -> bool:
    """Whether a file that is neither entry nor state is one of a journal.

    The inputs may be cut off, and the lock is there first.
    """
    if path.name not in (INPUTS, INPUTS + BESIDE, LOCK) or not path.is_file():
        return False
    if path.name == LOCK:
        return path.stat().st_size == 0
    text = path.read_text(encoding="utf-8", errors="replace")
    return text.startswith(START) or START.startswith(text)


def _locked(directory: Path) -> FileLock:
    """The lock of a journal, held until it is released or the process ends."""
    # sweeps run in threads, and each of them may be the one that closes
    lock = FileLock(directory / LOCK, timeout=0, thread_local=False)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(
            f"{directory}: another process works on it; wait for it to end, or "
            "name another output"
        ) from None
    except OSError as error:
        raise file_error(directory / LOCK, "used", error) from None
    return lock


def _require_inputs(directory: Path, inputs: Mapping[str, str]) -> None:
    advice = "or remove the directory, which discards its finished speeds"
    stored = _stored_inputs((directory / INPUTS).read_bytes())
    if stored is None:
        raise InputError(
            f"{directory / INPUTS}: is damaged, so it is not known what the finished "
            f"speeds belong to; restore it, {advice}"
        )
    for key in {**inputs, **stored}:
        if inputs.get(key) != stored.get(key):
            before, now = _shortened(stored.get(key), inputs.get(key))
            raise InputError(
                f"{directory}: was begun with {key} = {before}, now {now}; resume with "
                f"what it was begun with, {advice}"
            )


def _inputs_text(inputs: Mapping[str, str]) -> str:
    listed = json.dumps(dict(inputs), sort_keys=True, separators=(",", ":"))
    return f'{START},"inputs":{listed}}}\n'


def _stored_inputs(data: bytes) -> dict[str, str] | None:
    """What `_inputs_text` was made of, None where it is damaged."""
    try:
        stored = json.loads(data)["inputs"]
    except (ValueError, KeyError, TypeError):
        return None
    is_text = isinstance(stored, dict) and all(
        isinstance(value, str) for value in stored.values()
    )
    return stored if is_text else None


def _shortened(one: str | None, other: str | None) -> tuple[str, str]:
    """Two values for a message, of long ones the part where they begin to differ."""
    letters = zip(one or "", other or "", strict=False)
    common = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], letters))
    start = max(0, common - SHOWN // 2)

    def part(value: str | None) -> str:
        if value is None:
            return "nothing"
        if len(value) <= SHOWN:
            return repr(value)
        ends = ("..." if start else "", "..." if len(value) > start + SHOWN else "")
        return ends[0] + repr(value[start : start + SHOWN]) + ends[1]

    return part(one), part(other)


def _own_files(directory: Path) -> Iterator[tuple[Path, tuple[str, int, str]]]:
    """Paths of entries and states, also half-written ones: (branch, index, kind)."""
    for path in sorted(directory.iterdir()):
        if match := FILE.fullmatch(path.name):
            yield path, (match[1], int(match[2]), match[3])


def _discard(directory: Path) -> None:
    """Remove all but the inputs and the lock."""
    for path, _ in _own_files(directory):
        path.unlink()
    (directory / (INPUTS + BESIDE)).unlink(missing_ok=True)


def _sealed(entry: Entry) -> bytes:
    """The entry as a JSON object with its checksum; TypeError if it is not JSON."""
    content = {
        "branch": entry.branch,
        "index": entry.index,
        "state_names": list(entry.state_names),
        "state_sha256": entry.state_sha256,
        "values": dict(entry.values),
    }
    text = json.dumps(content, separators=(",", ":")).encode()
    return b'{"sha256":"%b","entry":%b}\n' % (_sha256(text).encode(), text)


def _unsealed(data: bytes) -> Entry | None:
    match = SEALED.fullmatch(data)
    if not match or match[1].decode() != _sha256(match[2]):
        return None
    content = json.loads(match[2])
    return Entry(**content | {"state_names": tuple(content["state_names"])})


def _npz(state: Mapping[str, Array]) -> bytes:
    """Arrays by position, since not every name may be one of a keyword."""
    arrays = {name: np.asarray(values) for name, values in state.items()}
    for name, values in arrays.items():
        if values.dtype.kind not in NUMBERS:
            raise ValueError(f"state {name} must be numbers, got {values.dtype}")
    out = io.BytesIO()
    np.savez(out, *arrays.values())
    return out.getvalue()


def _arrays(data: bytes, names: tuple[str, ...]) -> dict[str, Array]:
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        return {name: file[f"arr_{n}"] for n, name in enumerate(names)}


def _replace(path: Path, data: bytes) -> None:
    """Write a file whole or not at all; OSError where that fails."""
    beside = path.with_name(path.name + BESIDE)
    try:
        with beside.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())  # before older state goes, for a power cut
        os.replace(beside, path)
    except BaseException:
        with contextlib.suppress(OSError):  # what went wrong first is to be told
            beside.unlink(missing_ok=True)
        raise


def _read(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
