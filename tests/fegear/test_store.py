"""Checkpoints survive kills, damage and full disks; nothing else is touched."""

from __future__ import annotations

import gc
import math
import random
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.files.array_bytes import pack, unpack
from fegear.files.errors import InputError
from fegear.files.store import open_checkpoint

INPUTS = {"gear set": "pair.toml", "torque_Nm": "100.0", "speeds": "100 200 300"}
UP, DOWN = "100-up", "100-down"
AWKWARD = (math.nan, math.inf, -math.inf, -0.0, 0.1, 5e-324, 1.7976931348623157e308)


@pytest.fixture
def place(tmp_path) -> Path:
    return tmp_path / "out.csv.partial"


def values_of(index: int) -> dict:
    return {"speed_Hz": 0.1 * index, "rms": [math.sqrt(index), -0.0], "status": "ok"}


def state_of(index: int, size: int = 5) -> dict[str, np.ndarray]:
    return {"q": np.arange(size) + 0.1 * index, "v": np.full((2, 1), -0.1 * index)}


def fill(checkpoint, branch: str, count: int) -> None:
    for index in range(len(checkpoint.finished(branch)), count):
        checkpoint.add(branch, values_of(index), state_of(index))


def assert_true(checkpoint, branch: str) -> int:
    """Every finished speed and the state are what was added; how many there are."""
    records = checkpoint.finished(branch)
    assert records == [values_of(index) for index in range(len(records))]
    state = checkpoint.state(branch)
    if not records:
        assert state is None
        return 0
    expected = state_of(len(records) - 1)
    assert list(state) == list(expected)
    for name, array in expected.items():
        np.testing.assert_array_equal(state[name], array, strict=True)
    return len(records)


@contextmanager
def opened(place: Path, resume: bool = True, keep: bool = True, inputs=INPUTS):
    checkpoint = open_checkpoint(place, inputs, resume)
    try:
        yield checkpoint
    finally:
        checkpoint.close(keep)


def bits(value: float) -> bytes:
    return struct.pack("d", value)


def test_finished_speeds_are_there_on_resume(place):
    with opened(place, resume=False) as checkpoint:
        fill(checkpoint, UP, 4)
        fill(checkpoint, DOWN, 2)
        assert assert_true(checkpoint, UP) == 4
    with opened(place) as checkpoint:
        assert checkpoint.damaged == 0
        assert assert_true(checkpoint, UP) == 4
        assert assert_true(checkpoint, DOWN) == 2
        assert assert_true(checkpoint, "200-up") == 0
        fill(checkpoint, UP, 6)
        assert assert_true(checkpoint, UP) == 6


def rows(place: Path, table: str = "speeds") -> list[tuple]:
    with closing(sqlite3.connect(place)) as connection:
        return connection.execute(f"select * from {table} order by 1, 2").fetchall()


def test_only_the_last_state_of_a_branch_is_kept(place):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 4)
        fill(checkpoint, DOWN, 3)
    assert [row[:2] for row in rows(place, "states")] == [(DOWN, 2), (UP, 3)]


def test_closing_removes_the_checkpoint(place):
    with opened(place, keep=False) as checkpoint:
        fill(checkpoint, UP, 3)
    assert not list(place.parent.iterdir())
    checkpoint.close(keep=False)  # twice does no harm


def test_finished_speeds_are_not_thrown_away(place):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 3)
    with pytest.raises(InputError, match="holds what an interrupted run"):
        open_checkpoint(place, {"torque_Nm": "5"}, resume=False)
    with opened(place) as checkpoint:
        assert assert_true(checkpoint, UP) == 3


def test_where_nothing_was_finished_other_inputs_are_taken(place):
    open_checkpoint(place, INPUTS, resume=False).close(keep=True)
    other = {"torque_Nm": "5"}
    open_checkpoint(place, other, resume=False).close(keep=True)
    assert dict(rows(place, "inputs")) == other


@given(
    st.dictionaries(st.text(), st.floats(allow_nan=False) | st.sampled_from(AWKWARD)),
    st.lists(st.floats()),
)
@settings(max_examples=50, deadline=None)
def test_floats_come_back_to_the_bit(figures, numbers):
    state = {"q": np.array(numbers), "file": np.array(3.5), "": np.array(AWKWARD)}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "j"
        with opened(place) as checkpoint:
            checkpoint.add(UP, {"figures": figures}, state)
        with opened(place) as checkpoint:
            stored_figures = checkpoint.finished(UP)[0]["figures"]
            arrays = checkpoint.state(UP)
    assert list(stored_figures) == list(figures)
    assert [bits(v) for v in stored_figures.values()] == [
        bits(v) for v in figures.values()
    ]
    assert list(arrays) == list(state)
    for name, array in state.items():
        assert arrays[name].tobytes() == array.tobytes()


def test_state_without_arrays(place):
    with opened(place) as checkpoint:
        checkpoint.add(UP, {}, {})
        assert checkpoint.state(UP) == {}


def test_numpy_floats_and_tuples_are_values(place):
    with opened(place) as checkpoint:
        checkpoint.add(UP, {"rms": (np.float64(0.1), -np.float64(0.0))}, {})
        rms = checkpoint.finished(UP)[0]["rms"]
    assert [bits(value) for value in rms] == [bits(0.1), bits(-0.0)]


@pytest.mark.parametrize(
    ("values", "state", "error", "message"),
    [
        ({"x": object()}, {}, TypeError, "not JSON serializable"),
        (
            {},
            {"q": np.array([None])},
            ValueError,
            "type of q = object; must be numbers",
        ),
    ],
)
def test_wrong_additions_change_nothing(place, values, state, error, message):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 2)
        with pytest.raises(error, match=message):
            checkpoint.add(UP, values, state)
        assert assert_true(checkpoint, UP) == 2
        fill(checkpoint, UP, 3)
        assert assert_true(checkpoint, UP) == 3


def test_other_inputs_are_refused_and_named(place):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 2)
    with pytest.raises(InputError) as caught:
        open_checkpoint(place, INPUTS | {"torque_Nm": "120.0"}, resume=True)
    assert str(caught.value) == (
        f"{place}: was begun with torque_Nm = '100.0', now '120.0'; resume with what "
        "it was begun with, or remove it"
    )
    with opened(place) as checkpoint:  # nothing was changed, and the lock is free
        assert assert_true(checkpoint, UP) == 2


def test_order_of_inputs_does_not_matter(place):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 2)
    with opened(place, inputs=dict(reversed(INPUTS.items()))) as checkpoint:
        assert assert_true(checkpoint, UP) == 2


@pytest.mark.parametrize(
    ("inputs", "part"),
    [
        ({}, "gear set = 'pair.toml', now nothing"),
        (INPUTS | {"width": "2"}, "width = nothing, now '2'"),
    ],
)
def test_missing_and_new_inputs_are_named(place, inputs, part):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 1)
    with pytest.raises(InputError, match=part):
        open_checkpoint(place, inputs, resume=True)


@pytest.mark.parametrize("resume", [True, False])
def test_a_checkpoint_with_nothing_finished_takes_other_inputs(place, resume):
    open_checkpoint(place, INPUTS, resume=True).close(keep=True)
    other = INPUTS | {"torque_Nm": "120.0"}
    open_checkpoint(place, other, resume).close(keep=False)


def test_long_inputs_are_shown_where_they_differ(place):
    long = "\n".join(f"line {i}" for i in range(1000))
    with opened(place, inputs={"file": long}) as checkpoint:
        fill(checkpoint, UP, 1)
    with pytest.raises(InputError) as caught:
        open_checkpoint(place, {"file": long.replace("500", "5OO")}, resume=True)
    message = str(caught.value)
    assert "line 500" in message
    assert "line 5OO" in message
    assert len(message) < 400
    assert "\n" not in message


@pytest.mark.parametrize("resume", [True, False])
def test_foreign_files_are_left_alone(place, resume):
    place.write_text("years of work" * 100)
    with pytest.raises(InputError, match="is no checkpoint"):
        open_checkpoint(place, INPUTS, resume)
    assert place.read_text() == "years of work" * 100
    place.unlink()
    with closing(sqlite3.connect(place)) as connection:
        connection.execute("create table speeds (mine)")
    with pytest.raises(InputError, match="is no checkpoint"):
        open_checkpoint(place, INPUTS, resume)
    place.unlink()
    place.mkdir()
    with pytest.raises(InputError, match="cannot be used"):
        open_checkpoint(place, INPUTS, resume)
    assert list(place.parent.iterdir()) == [place]


def test_killed_before_the_first_speed(place):
    place.touch()
    with opened(place, keep=False) as checkpoint:
        assert checkpoint.finished(UP) == []
    assert not place.exists()


def test_lock_is_held_until_closed(place):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 2)
        for resume in (True, False):
            with pytest.raises(InputError, match="another process works on it"):
                open_checkpoint(place, INPUTS, resume)
        assert assert_true(checkpoint, UP) == 2
    with opened(place) as checkpoint:
        assert assert_true(checkpoint, UP) == 2


def test_a_damaged_name_of_a_table_is_told(place):
    """SQLite quotes its bytes, which are no text."""
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 1)
    content = place.read_bytes()
    place.write_bytes(content.replace(b"tablespeeds", b"table\xf3peeds"))
    assert place.read_bytes() != content
    with pytest.raises(InputError, match="is no checkpoint or damaged"):
        open_checkpoint(place, INPUTS, resume=True)


@pytest.mark.parametrize(
    ("table", "number", "left"),
    [("states", 3, 0), ("speeds", 3, 0), ("speeds", 1, 0), ("speeds", 0, 0)],
)
def test_without_its_state_no_speed_is_finished(place, table, number, left):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 4)
        fill(checkpoint, DOWN, 2)
    with closing(sqlite3.connect(place)) as connection, connection:
        change = f"update {table} set content = x'00' where branch = ? and number = ?"
        assert connection.execute(change, [UP, number]).rowcount == 1
    with opened(place) as checkpoint:
        assert checkpoint.damaged == 4 - left
        assert assert_true(checkpoint, UP) == left
        assert assert_true(checkpoint, DOWN) == 2


def test_an_entry_under_another_name_is_not_taken(place):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 1)
    with closing(sqlite3.connect(place)) as connection, connection:
        for table in ("speeds", "states"):
            copied = f"select '{DOWN}', number, content, seal from {table}"
            connection.execute(f"insert into {table} {copied}")
    with opened(place) as checkpoint:
        assert assert_true(checkpoint, UP) == 1
        assert assert_true(checkpoint, DOWN) == 0


@contextmanager
def file_size_limit(size: int):
    """Writing beyond a size fails, as it does on a full disk."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize(
    ("values", "state"),
    [({}, {"q": np.zeros(10_000)}), ({"text": "x" * 60_000}, {"q": np.zeros(1)})],
    ids=["state", "values"],
)
def test_full_disk_leaves_a_usable_checkpoint(place, values, state):
    with opened(place) as checkpoint:
        fill(checkpoint, UP, 3)
        with file_size_limit(60_000), pytest.raises(OSError, match="disk"):
            checkpoint.add(UP, values, state)
        assert assert_true(checkpoint, UP) == 3
        fill(checkpoint, UP, 4)
        assert assert_true(checkpoint, UP) == 4
    with opened(place) as checkpoint:
        assert assert_true(checkpoint, UP) == 4


def test_threads_read_arrays_at_once():
    """Garbage is collected while one reads, which lets others read, at another depth
    of calls.
    """
    arrays = {f"a{i}": np.full((3, 4), float(i)) for i in range(5)}
    content, thresholds = pack(arrays), gc.get_threshold()
    interval = sys.getswitchinterval()

    def read_at(depth: int) -> list[dict[str, Any]]:
        return read_at(depth - 1) if depth else [unpack(content) for _ in range(30)]

    def hand_over(*_: object) -> None:
        time.sleep(0.0)

    gc.callbacks.append(hand_over)
    gc.set_threshold(10)
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as pool:
            read = [
                found for all_ in pool.map(read_at, [0, 7, 14, 21]) for found in all_
            ]
    finally:
        sys.setswitchinterval(interval)
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(hand_over)
    assert len(read) == 4 * 30
    assert all(np.array_equal(found[n], arrays[n]) for found in read for n in arrays)


def test_threads_share_a_checkpoint(place):
    with opened(place) as checkpoint, ThreadPoolExecutor(4) as pool:
        list(pool.map(partial(fill, checkpoint, count=20), "abcdefgh"))
    with opened(place) as checkpoint:
        assert all(assert_true(checkpoint, branch) == 20 for branch in "abcdefgh")


WRITER = """
import sys
from pathlib import Path
import numpy as np
from fegear.files.store import open_checkpoint

checkpoint = open_checkpoint(Path(sys.argv[1]), {"a": "b"}, resume=True)
count = int(sys.argv[2])
print("open", flush=True)
for branch in ("1-up", "1-down"):
    done = checkpoint.finished(branch)
    state = checkpoint.state(branch)
    x = state["x"] if done else np.linspace(0.1, 0.9, 20_000)
    for index in range(len(done), count):
        sys.stdin.readline()  # how many it may add
        x = 3.9 * x * (1.0 - x)  # chaos: any wrong bit shows
        values = {"mean": float(x.mean()), "nan": float("nan"), "index": index}
        checkpoint.add(branch, values, {"x": x})
checkpoint.close(keep=True)
"""


def start_writer(place: Path, count: int) -> subprocess.Popen:
    command = [sys.executable, "-c", WRITER, str(place), str(count)]
    pipe = subprocess.PIPE
    writer = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
    assert writer.stdout.readline() == "open\n"
    return writer


def allow(writer: subprocess.Popen, records: int) -> None:
    """Let it add so many records, and wait for more after them."""
    writer.stdin.write("\n" * records)
    writer.stdin.flush()


def contents(place: Path) -> list[list[tuple]]:
    return [rows(place, table) for table in ("inputs", "speeds", "states")]


@pytest.mark.slow
def test_killed_at_any_time_and_resumed_nothing_differs(tmp_path):
    count, chance = 60, random.Random(2)
    with start_writer(tmp_path / "whole", count) as writer:
        start = time.perf_counter()
        allow(writer, 2 * count)
    span = time.perf_counter() - start
    lengths = 0
    for _ in range(8):
        writer = start_writer(tmp_path / "killed", count)
        allow(writer, 14)  # not all in eight times, however long it has
        time.sleep(chance.uniform(0.0, 0.125 * span))
        writer.kill()
        with writer:
            assert writer.wait() != 0
        with opened(tmp_path / "killed", inputs={"a": "b"}) as checkpoint:
            record_count = sum(len(checkpoint.finished(b)) for b in ("1-up", "1-down"))
        assert record_count >= lengths  # a kill loses nothing that was finished
        lengths = record_count
    assert lengths < 2 * count
    with start_writer(tmp_path / "killed", count) as writer:
        allow(writer, 2 * count - lengths)
    assert writer.returncode == 0
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


def test_another_process_is_refused_until_it_is_killed(place):
    writer = start_writer(place, 100_000)
    try:
        with pytest.raises(InputError, match="another process works on it"):
            open_checkpoint(place, {"a": "b"}, resume=False)
    finally:
        writer.kill()
        with writer:
            writer.wait()
    with opened(place, inputs={"a": "b"}, keep=False) as checkpoint:
        checkpoint.finished("1-up")
    assert not place.exists()
