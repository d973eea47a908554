"""Results on disk, which are trusted only if they match their inputs and are whole.

A checkpoint holds the finished speeds of a long run in an SQLite file, a transaction
for each, so that a killed run loses at most one. It refuses a second process.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any

from fegear.files.array_files import Array, pack, unpack
from fegear.files.errors import InputError, file_error
from fegear.files.output import make_directory
from fegear.files.values import plain_of, value_of

APPLICATION = 0x66656765  # by which SQLite files are known as checkpoints
TABLES = """
create table inputs (name text primary key, value text);
create table speeds (branch text, number integer, content blob, seal text,
                     primary key (branch, number));
create table states (branch text primary key, number integer, content blob, seal text);
"""
SHOWN = 40  # characters of a value in a message
RECORDS_FORMAT = "2"  # changes with what `Records` writes


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """Finished speeds by branch, in order, and where the last of each has settled.

    No other process has it until it is closed or this one ends; threads may share it.
    damaged : speeds that were found damaged and dropped when it was opened
    """

    path: Path
    damaged: int
    _connection: sqlite3.Connection
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def finished(self, branch: str) -> list[dict[str, Any]]:
        """Values of the speeds 0, 1, ...; floats to the bit, tuples as lists."""
        query = "select content from speeds where branch = ? order by number"
        with self._lock:
            rows = self._connection.execute(query, [branch]).fetchall()
        return [json.loads(content) for (content,) in rows]

    def state(self, branch: str) -> dict[str, Array] | None:
        """State of the last finished speed, None where there is none."""
        query = "select content from states where branch = ?"
        with self._lock:
            row = self._connection.execute(query, [branch]).fetchone()
        return None if row is None else unpack(row[0])

    def count(self, branch: str) -> int:
        """Finished speeds of a branch, those of branches `branch/NAME` among them."""
        query = "select count(*) from speeds where branch = ? or instr(branch, ?) = 1"
        with self._lock:
            return self._connection.execute(query, [branch, f"{branch}/"]).fetchone()[0]

    @property
    def has_records(self) -> bool:
        """Whether it has a finished speed."""
        with self._lock:
            return (
                self._connection.execute("select 1 from speeds").fetchone() is not None
            )

    @property
    def has_previous_run(self) -> bool:
        """Whether an earlier run finished a speed, even if it is damaged by now."""
        return self.has_records or self.damaged > 0

    def parts(self, branch: str) -> dict[str, dict[str, Array]]:
        """States of branches `branch/NAME`, by their names."""
        query = "select branch, content from states where instr(branch, ?) = 1"
        with self._lock:
            rows = self._connection.execute(query, [f"{branch}/"]).fetchall()
        return {name[len(branch) + 1 :]: unpack(content) for name, content in rows}

    def add(
        self, branch: str, values: Mapping[str, Any], state: Mapping[str, Array]
    ) -> None:
        """Store the next speed of a branch; its state replaces the one before.

        values : what JSON can hold, also NaN and infinities; state : arrays of numbers

        Raises TypeError or ValueError for others, OSError where the disk is full; the
        checkpoint is then as it was.
        """
        result, arrays = json.dumps(dict(values)).encode(), pack(state)
        count = "select count(*) from speeds where branch = ?"
        with self._lock:
            try:
                with self._connection:
                    self._connection.execute("begin")
                    (number,) = self._connection.execute(count, [branch]).fetchone()
                    for table, content in (("speeds", result), ("states", arrays)):
                        row = (
                            branch,
                            number,
                            content,
                            _row_digest(branch, number, content),
                        )
                        command = f"insert or replace into {table} values (?, ?, ?, ?)"
                        self._connection.execute(command, row)
            except sqlite3.OperationalError as error:
                raise OSError(0, str(error), str(self.path)) from None

    def report_resumed(
        self,
        branches: Sequence[str],
        total: int,
        tell: Callable[[str], None],
        unit: str = "speed",
    ) -> None:
        """Report how many records are finished or damaged.

        total : of all branches in units, which are speeds or other values, 0 where it
            is not known
        """
        finished = sum(map(self.count, branches))
        units = f"{unit}es" if unit.endswith("ch") else f"{unit}s"
        amount = f"1 {unit} is" if finished == 1 else f"{finished} {units} are"
        amount = f"{finished} of {total} {units} are" if total else amount
        tell(f"{self.path}: {amount} finished")
        if self.damaged:
            damaged = f"{unit} is" if self.damaged == 1 else f"{unit}s are"
            tell(f"{self.path}: {self.damaged} {damaged} damaged and computed again")

    def close(self, keep: bool) -> None:
        """Release the lock; without `keep` remove the file."""
        self._connection.close()
        if not keep:
            self.path.unlink(missing_ok=True)


@dataclass
class Records:
    """Values in a branch of a checkpoint, or in none: nothing is stored then."""

    checkpoint: Checkpoint | None
    key: str

    @property
    def records(self) -> list[Any]:
        """Values of an earlier run, in order."""
        stored = [] if self.checkpoint is None else self.checkpoint.finished(self.key)
        return [value_of(plain) for plain in stored]

    @property
    def state(self) -> Mapping[str, Array] | None:
        """State at the end of the last record."""
        return None if self.checkpoint is None else self.checkpoint.state(self.key)

    def add_record(self, record: Any, state: Mapping[str, Array]) -> None:
        """Store a value that `Encoder` can write, and the state to resume from."""
        if self.checkpoint is None:
            return
        try:
            self.checkpoint.add(self.key, plain_of(record), state)
        except OSError as error:
            raise file_error(self.checkpoint.path, "written", error) from None


@dataclass(frozen=True, kw_only=True)
class CheckpointOptions:
    """The checkpoint of a run, and whether the run resumes from it.

    overwrite : discard the records of an earlier run; else it must be resumed
    """

    checkpoint: Path | None = None
    resume: bool = False
    overwrite: bool = False

    def open(
        self, inputs: Mapping[str, str], notify: Callable[[str], None]
    ) -> Checkpoint | None:
        """The checkpoint of a run with these inputs, None if nothing is stored.

        notify : called with a message on the content of the checkpoint
        """
        path = self.checkpoint
        if path is None:
            return None
        if self.resume and not path.exists():
            output = path.with_suffix("")
            done = f"{output} is finished and" if output.exists() else "it"
            notify(f"there is no {path}, {done} is computed from the start")
        return open_checkpoint(path, inputs, self.resume, self.overwrite)


NO_CHECKPOINT = CheckpointOptions()


def open_checkpoint(
    path: Path, inputs: Mapping[str, str], resume: bool, overwrite: bool = False
) -> Checkpoint:
    """The checkpoint at a path, made where there is none.

    inputs : everything that determines the results
    resume : reuse records of the same inputs; else there may be none, or `overwrite`
        discards them

    Raises InputError where the file cannot be used, is no checkpoint or damaged,
    belongs to other inputs, or another process works on it; it is then unchanged.
    """
    make_directory(path.parent)
    try:
        connection = sqlite3.connect(
            path, timeout=0.0, isolation_level=None, check_same_thread=False
        )
    except sqlite3.OperationalError as error:
        raise file_error(path, "used", OSError(0, str(error))) from None
    connection.text_factory = lambda data: data.decode(errors="replace")
    try:
        with connection:
            connection.execute("pragma locking_mode = exclusive")
            connection.execute("begin exclusive")
            _require_checkpoint(connection, path)
            if resume:
                _require_inputs(connection, path, inputs)
            elif overwrite:
                connection.execute("delete from speeds")
                connection.execute("delete from states")
            else:
                _require_nothing_finished(connection, path)
            connection.execute("delete from inputs")
            rows = inputs.items()
            connection.executemany("insert into inputs values (?, ?)", rows)
            damaged = _drop_damaged(connection)
    except sqlite3.DatabaseError as error:
        connection.close()
        raise _refusal(path, error) from None
    except BaseException:
        connection.close()
        raise
    return Checkpoint(path, damaged, connection)


def _refusal(path: Path, error: sqlite3.DatabaseError) -> InputError:
    if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
        return InputError(
            f"{path}: another process works on it; wait for it to end, or name "
            "another output"
        )
    if isinstance(error, sqlite3.OperationalError):
        return file_error(path, "used", OSError(0, str(error)))
    return _no_checkpoint(path)


def _no_checkpoint(path: Path) -> InputError:
    return InputError(
        f"{path}: is no checkpoint or damaged; it was not changed, move it away or "
        "name another output"
    )


def _require_checkpoint(connection: sqlite3.Connection, path: Path) -> None:
    """Tables in an empty file; InputError for a file of others or a damaged one."""
    (tables,) = connection.execute("select count(*) from sqlite_master").fetchone()
    (application,) = connection.execute("pragma application_id").fetchone()
    if not tables and not application:
        connection.execute(f"pragma application_id = {APPLICATION}")
        for command in TABLES.split(";")[:-1]:
            connection.execute(command)
    elif application != APPLICATION or (
        connection.execute("pragma integrity_check").fetchone() != ("ok",)
    ):
        raise _no_checkpoint(path)


def _require_nothing_finished(connection: sqlite3.Connection, path: Path) -> None:
    if connection.execute("select * from speeds").fetchone():
        raise InputError(
            f"{path}: holds what an interrupted run has finished; resume goes on "
            "with it, else remove it or choose another output"
        )


def _require_inputs(
    connection: sqlite3.Connection, path: Path, inputs: Mapping[str, str]
) -> None:
    """Require the inputs of the speeds that the checkpoint holds, if any."""
    if not connection.execute("select * from speeds").fetchone():
        return
    stored = dict(connection.execute("select name, value from inputs"))
    for name in {**inputs, **stored}:
        before, now = stored.get(name), inputs.get(name)
        if before != now:
            pairs = zip(before or "", now or "", strict=False)
            shared = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
            was, becomes = (_excerpt(value, shared) for value in (before, now))
            raise InputError(
                f"{path}: was begun with {name} = {was}, now {becomes}; resume with "
                "what it was begun with, or remove it"
            )


def _excerpt(value: str | None, shared: int) -> str:
    """A value for a message, of a long one the part after what is `shared`."""
    if value is None or len(value) <= SHOWN:
        return "nothing" if value is None else repr(value)
    start = max(0, shared - SHOWN // 2)
    part = repr(value[start : start + SHOWN])
    return f"{'...' * (start > 0)}{part}{'...' * (len(value) > start + SHOWN)}"


def _drop_damaged(connection: sqlite3.Connection) -> int:
    """Drop speeds behind damaged ones or without a state; how many."""
    before = connection.total_changes
    branches = connection.execute("select distinct branch from speeds").fetchall()
    for (branch,) in branches:
        intact_count = _whole_speeds(connection, branch)
        command = "delete from speeds where branch = ? and number >= ?"
        connection.execute(command, [branch, intact_count])
    dropped = connection.total_changes - before
    branch_query = "select branch from speeds"
    connection.execute(f"delete from states where branch not in ({branch_query})")
    return dropped


def _whole_speeds(connection: sqlite3.Connection, branch: str) -> int:
    """Speeds from the first on that are whole and up to the one that has its state."""
    query = "select number, content, seal from {} where branch = ? order by number"
    whole = 0
    for number, content, seal in connection.execute(query.format("speeds"), [branch]):
        if number != whole or seal != _row_digest(branch, number, content):
            break
        whole += 1
    state = connection.execute(query.format("states"), [branch]).fetchone()
    if (
        state is None
        or state[2] != _row_digest(branch, *state[:2])
        or state[0] >= whole
    ):
        return 0
    return int(state[0]) + 1


def _row_digest(branch: str, number: int, content: bytes) -> str:
    """Digest of a row; damage may have made another type of its content."""
    payload = content if isinstance(content, bytes) else b""
    return hashlib.sha256(f"{branch} {number} ".encode() + payload).hexdigest()
