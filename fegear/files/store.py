"""Results on disk, which are trusted only if they match their inputs and are whole.

A checkpoint holds the finished speeds of a long run in an SQLite file, a transaction
for each, so that a killed run loses at most one. It refuses a second process.
"""

from __future__ import annotations

import json
import sqlite3
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any

from fegear.files.array_bytes import Array, pack, unpack
from fegear.files.contents import sha256
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
# the last state belongs to the last speed, and none before it is missing
DROP_UNFINISHED = (
    "delete from speeds where number > coalesce((select number from states"
    " where states.branch = speeds.branch), -1)",
    "delete from speeds where branch in (select branch from speeds join states"
    " using (branch) group by branch having count(*) <= states.number)",
    "delete from states where branch not in (select branch from speeds)",
)
EXCERPT_LENGTH = 40  # characters of a value in a message
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
                        seal = _row_digest(branch, number, content)
                        self._connection.execute(
                            f"insert or replace into {table} values (?, ?, ?, ?)",
                            (branch, number, content, seal),
                        )
            except sqlite3.OperationalError as error:
                raise OSError(0, str(error), str(self.path)) from None

    def report_resumed(
        self,
        branches: Sequence[str],
        total: int,
        notify: Callable[[str], None],
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
        notify(f"{self.path}: {amount} finished")
        if self.damaged:
            damaged = f"{unit} is" if self.damaged == 1 else f"{unit}s are"
            notify(f"{self.path}: {self.damaged} {damaged} damaged and computed again")

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
            subject = f"{output} is finished and" if output.exists() else "it"
            notify(f"there is no {path}, {subject} is computed from the start")
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
        raise _unreadable_error(path, error) from None
    except UnicodeDecodeError:  # of a message of SQLite on damaged names
        connection.close()
        raise _no_checkpoint_error(path) from None
    except BaseException:
        connection.close()
        raise
    return Checkpoint(path, damaged, connection)


def _unreadable_error(path: Path, error: sqlite3.DatabaseError) -> InputError:
    if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
        return InputError(
            f"{path}: another process works on it; wait for it to end, or name "
            "another output"
        )
    if isinstance(error, sqlite3.OperationalError):
        return file_error(path, "used", OSError(0, str(error)))
    return _no_checkpoint_error(path)


def _no_checkpoint_error(path: Path) -> InputError:
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
        raise _no_checkpoint_error(path)


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
        previous_value, current_value = stored.get(name), inputs.get(name)
        if previous_value != current_value:
            pairs = zip(previous_value or "", current_value or "", strict=False)
            shared_length = sum(
                1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs)
            )
            previous, current = (
                _excerpt(value, shared_length)
                for value in (previous_value, current_value)
            )
            raise InputError(
                f"{path}: was begun with {name} = {previous}, now {current}; resume "
                "with what it was begun with, or remove it"
            )


def _excerpt(value: str | None, shared_length: int) -> str:
    """A value for a message, of a long one the part after `shared_length`."""
    if value is None or len(value) <= EXCERPT_LENGTH:
        return "nothing" if value is None else repr(value)
    start = max(0, shared_length - EXCERPT_LENGTH // 2)
    part = repr(value[start : start + EXCERPT_LENGTH])
    return f"{'...' * (start > 0)}{part}{'...' * (len(value) > start + EXCERPT_LENGTH)}"


def _drop_damaged(connection: sqlite3.Connection) -> int:
    """Drop speeds behind damaged ones or without a state; how many.

    Damage may have made another type of a content.
    """
    (before,) = connection.execute("select count(*) from speeds").fetchone()
    for table in ("speeds", "states"):
        columns = "rowid, branch, number, content, seal"
        rows = connection.execute(f"select {columns} from {table}")
        damaged = [
            (row_id,)
            for row_id, branch, number, content, seal in rows
            if type(content) is not bytes
            or seal != _row_digest(branch, number, content)
        ]
        connection.executemany(f"delete from {table} where rowid = ?", damaged)
    for command in DROP_UNFINISHED:
        connection.execute(command)
    (after,) = connection.execute("select count(*) from speeds").fetchone()
    return int(before - after)


def _row_digest(branch: str, number: int, content: bytes) -> str:
    return sha256(f"{branch} {number!r} ".encode() + content)
