"""Finished speeds survive kills, damage and full disks; nothing else is touched."""

from __future__ import annotations

import json
import math
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.dynamics.journal import open_journal
from fegear.errors import InputError

INPUTS = {"gear set": "pair.toml", "torque_Nm": "100.0", "speeds": "100 200 300"}
UP, DOWN = "100-up", "100-down"
AWKWARD = (math.nan, math.inf, -math.inf, -0.0, 0.1, 5e-324, 1.7976931348623157e308)
STORIES = 120  # random damages in one test


@pytest.fixture
def place(tmp_path) -> Path:
    return tmp_path / "out.csv.partial"


def values_of(index: int) -> dict:
    return {"speed_Hz": 0.1 * index, "rms": [math.sqrt(index), -0.0], "status": "ok"}


def state_of(index: int, size: int = 5) -> dict[str, np.ndarray]:
    return {"q": np.arange(size) + 0.1 * index, "v": np.full((2, 1), -0.1 * index)}


def fill(journal, branch: str, count: int) -> None:
    for index in range(len(journal.finished(branch)), count):
        journal.add(branch, index, values_of(index), state_of(index))


def assert_true(journal, branch: str) -> int:
    """Every finished entry and the state are what was added; how many there are."""
    entries = journal.finished(branch)
    assert [entry.index for entry in entries] == list(range(len(entries)))
    for entry in entries:
        assert entry.values == values_of(entry.index)
    state = journal.state(branch)
    if not entries:
        assert state is None
        return 0
    expected = state_of(len(entries) - 1)
    assert list(state) == list(expected)
    for name, array in expected.items():
        np.testing.assert_array_equal(state[name], array, strict=True)
    return len(entries)


@contextmanager
def opened(place: Path, resume: bool = True, keep: bool = True, inputs=INPUTS):
    journal = open_journal(place, inputs, resume)
    try:
        yield journal
    finally:
        journal.close(keep)


def bits(value: float) -> bytes:
    return struct.pack("d", value)


def test_finished_speeds_are_there_on_resume(place):
    with opened(place, resume=False) as journal:
        fill(journal, UP, 4)
        fill(journal, DOWN, 2)
        assert assert_true(journal, UP) == 4
    with opened(place) as journal:
        assert assert_true(journal, UP) == 4
        assert assert_true(journal, DOWN) == 2
        assert assert_true(journal, "200-up") == 0
        fill(journal, UP, 6)
        assert assert_true(journal, UP) == 6


def test_only_the_last_state_of_a_branch_is_kept(place):
    with opened(place) as journal:
        fill(journal, UP, 4)
        fill(journal, DOWN, 3)
    names = sorted(path.name for path in place.glob("*.npz"))
    assert names == [f"{DOWN}.000002.npz", f"{UP}.000003.npz"]


def test_branches_with_alike_names_are_apart(place):
    names = ["1", "1-up", "1.5-up", "1.000000", "1.000000.json", "inputs", "lock"]
    with opened(place) as journal:
        for count, name in enumerate(names):
            fill(journal, name, count + 1)
        for count, name in enumerate(names):
            assert assert_true(journal, name) == count + 1


def test_closing_removes_the_journal(place):
    with opened(place, keep=False) as journal:
        fill(journal, UP, 3)
    assert not place.exists()
    journal.close(keep=False)  # twice does no harm
    with pytest.raises(ValueError, match="closed"):
        journal.add(UP, 3, {}, {})


def test_without_resume_an_old_journal_is_emptied(place):
    with opened(place) as journal:
        fill(journal, UP, 3)
    with opened(place, resume=False, inputs={"torque_Nm": "5"}) as journal:
        assert journal.finished(UP) == []
    assert sorted(path.name for path in place.iterdir()) == ["inputs.json", "lock"]


@given(
    st.dictionaries(st.text(), st.floats(allow_nan=False) | st.sampled_from(AWKWARD)),
    st.lists(st.floats()),
)
@settings(max_examples=50, deadline=None)
def test_floats_come_back_to_the_bit(figures, numbers):
    state = {"q": np.array(numbers), "file": np.array(3.5), "": np.array(AWKWARD)}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "j"
        with opened(place) as journal:
            journal.add(UP, 0, {"figures": figures}, state)
        with opened(place) as journal:
            found = journal.finished(UP)[0].values["figures"]
            arrays = journal.state(UP)
    assert list(found) == list(figures)
    assert [bits(v) for v in found.values()] == [bits(v) for v in figures.values()]
    assert list(arrays) == list(state)
    for name, array in state.items():
        assert arrays[name].tobytes() == array.tobytes()


def test_state_without_arrays(place):
    with opened(place) as journal:
        journal.add(UP, 0, {}, {})
        assert journal.state(UP) == {}


def test_numpy_floats_and_tuples_are_values(place):
    with opened(place) as journal:
        journal.add(UP, 0, {"rms": (np.float64(0.1), -np.float64(0.0))}, {})
        found = journal.finished(UP)[0].values["rms"]
    assert [bits(value) for value in found] == [bits(0.1), bits(-0.0)]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((UP, 3, {}, {}), ValueError, "index must be 2, got 3"),
        ((UP, 1, {}, {}), ValueError, "index must be 2, got 1"),
        (("../up", 0, {}, {}), ValueError, "branch must match"),
        (("", 0, {}, {}), ValueError, "branch must match"),
        ((UP, 2, {"x": object()}, {}), TypeError, "not JSON serializable"),
        ((UP, 2, {}, {"q": np.array([None])}), ValueError, "state q must be numbers"),
    ],
)
def test_wrong_additions_change_nothing(place, arguments, error, message):
    with opened(place) as journal:
        fill(journal, UP, 2)
        before = {path: path.read_bytes() for path in place.iterdir()}
        with pytest.raises(error, match=message):
            journal.add(*arguments)
        assert {path: path.read_bytes() for path in place.iterdir()} == before
        fill(journal, UP, 3)
        assert assert_true(journal, UP) == 3


def test_other_inputs_are_refused_and_named(place):
    with opened(place) as journal:
        fill(journal, UP, 2)
    with pytest.raises(InputError) as caught:
        open_journal(place, INPUTS | {"torque_Nm": "120.0"}, resume=True)
    assert str(caught.value) == (
        f"{place}: was begun with torque_Nm = '100.0', now '120.0'; resume with what "
        "it was begun with, or start without resuming, which discards its finished "
        "speeds"
    )
    with opened(place) as journal:  # nothing was changed, and the lock is free
        assert assert_true(journal, UP) == 2


def test_order_of_inputs_does_not_matter(place):
    with opened(place) as journal:
        fill(journal, UP, 2)
    with opened(place, inputs=dict(reversed(INPUTS.items()))) as journal:
        assert assert_true(journal, UP) == 2


@pytest.mark.parametrize(
    ("inputs", "part"),
    [
        ({}, "gear set = 'pair.toml', now nothing"),
        (INPUTS | {"width": "2"}, "width = nothing, now '2'"),
    ],
)
def test_missing_and_new_inputs_are_named(place, inputs, part):
    open_journal(place, INPUTS, resume=True).close(keep=True)
    with pytest.raises(InputError, match=part):
        open_journal(place, inputs, resume=True)


def test_long_inputs_are_shown_where_they_differ(place):
    long = "\n".join(f"line {i}" for i in range(1000))
    open_journal(place, {"file": long}, resume=True).close(keep=True)
    with pytest.raises(InputError) as caught:
        open_journal(place, {"file": long.replace("500", "5OO")}, resume=True)
    message = str(caught.value)
    assert "line 500" in message
    assert "line 5OO" in message
    assert len(message) < 400
    assert "\n" not in message


@pytest.mark.parametrize("resume", [True, False])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("thesis.tex", "years of work"),
        ("inputs.json", '{"torque": 5}'),
        ("lock", "mine"),
        ("100-up.000000.json", "{}"),
        (".hidden", ""),
    ],
)
def test_foreign_directory_is_left_alone(place, name, text, resume):
    place.mkdir()
    (place / name).write_text(text)
    with pytest.raises(InputError, match="no journal"):
        open_journal(place, INPUTS, resume)
    assert [path.name for path in place.iterdir()] == [name]
    assert (place / name).read_text() == text


def test_foreign_files_in_a_journal_outlive_it(place):
    with opened(place) as journal:
        fill(journal, UP, 2)
        (place / "notes.txt").write_text("mine")
        (place / "100-up.json").mkdir()
    with opened(place, resume=False, keep=False):
        pass
    assert sorted(p.name for p in place.iterdir()) == ["100-up.json", "notes.txt"]


def test_a_file_in_its_place_is_named(place):
    place.write_text("mine")
    with pytest.raises(InputError, match="cannot be made"):
        open_journal(place, INPUTS, resume=False)
    assert place.read_text() == "mine"


@pytest.mark.parametrize("name", ["inputs.json.new", "lock"])
def test_killed_before_the_first_file(place, name):
    place.mkdir()
    (place / name).touch()
    with opened(place, keep=False) as journal:
        assert journal.finished(UP) == []
    assert not place.exists()


def test_lock_is_held_until_closed(place):
    with opened(place) as journal:
        fill(journal, UP, 2)
        for resume in (True, False):
            with pytest.raises(InputError, match="another process works on it"):
                open_journal(place, INPUTS, resume)
        assert assert_true(journal, UP) == 2
    with opened(place) as journal:
        assert assert_true(journal, UP) == 2


def damaged(data: bytes, chance: random.Random) -> bytes | None:
    """Cut off, with a byte changed, filled with zeros, or gone."""
    at = chance.randrange(len(data)) if data else 0
    other = bytes([data[at] ^ (1 << chance.randrange(8))]) if data else b"x"
    return chance.choice(
        [data[:at], data[:at] + other + data[at + 1 :], data[:at] + bytes(9), None]
    )


def test_damage_never_yields_a_wrong_value(place, tmp_path):
    with opened(place) as journal:
        fill(journal, UP, 4)
        fill(journal, DOWN, 2)
    chance = random.Random(1)
    names = sorted(path.name for path in place.iterdir() if path.name != "inputs.json")
    for story in range(STORIES):
        copy = tmp_path / f"copy{story}"
        shutil.copytree(place, copy)
        for name in chance.sample(names, chance.choice([1, 1, 2])):
            data = damaged((copy / name).read_bytes(), chance)
            if data is None:
                (copy / name).unlink()
            else:
                (copy / name).write_bytes(data)
        with opened(copy, keep=False) as journal:
            assert_true(journal, UP)
            assert_true(journal, DOWN)
            fill(journal, UP, 5)
            assert assert_true(journal, UP) == 5
        assert not copy.exists()


def test_damaged_inputs_are_refused_but_can_be_discarded(place):
    with opened(place) as journal:
        fill(journal, UP, 2)
    whole = (place / "inputs.json").read_bytes()
    for length in range(len(whole) - 1):
        (place / "inputs.json").write_bytes(whole[:length])
        with pytest.raises(InputError, match="is damaged"):
            open_journal(place, INPUTS, resume=True)
    assert len(list(place.glob("100-up.*.json"))) == 2
    (place / "inputs.json").write_bytes(whole)
    with opened(place) as journal:
        assert assert_true(journal, UP) == 2
    (place / "inputs.json").write_bytes(whole[:17])
    with opened(place, resume=False) as journal:
        assert journal.finished(UP) == []


@pytest.mark.parametrize(
    ("damage", "left"),
    [
        (["000003.npz"], 0),  # the only state
        (["000003.json"], 0),  # its state no longer fits
        (["000001.json"], 0),  # a gap, and no state of entry 0
        (["000002.json", "000003.npz"], 0),
    ],
)
def test_without_its_state_no_run_is_finished(place, damage, left):
    with opened(place) as journal:
        fill(journal, UP, 4)
    for name in damage:
        (place / f"{UP}.{name}").write_bytes(b"")
    with opened(place) as journal:
        assert assert_true(journal, UP) == left


def test_older_state_serves_where_it_is_still_there(place):
    with opened(place) as journal:
        fill(journal, UP, 3)
        older = (place / f"{UP}.000002.npz").read_bytes()
        fill(journal, UP, 5)
    (place / f"{UP}.000002.npz").write_bytes(older)
    (place / f"{UP}.000004.npz").write_bytes(b"damaged")
    with opened(place) as journal:
        assert assert_true(journal, UP) == 3
        fill(journal, UP, 4)
        assert assert_true(journal, UP) == 4
    # what stood beyond the damage is gone for good
    assert not (place / f"{UP}.000004.json").exists()


def test_an_entry_under_another_name_is_not_taken(place):
    with opened(place) as journal:
        fill(journal, UP, 1)
    for kind in ("json", "npz"):
        shutil.copy(place / f"{UP}.000000.{kind}", place / f"{UP}.000001.{kind}")
        shutil.copy(place / f"{UP}.000000.{kind}", place / f"{DOWN}.000000.{kind}")
    with opened(place) as journal:
        assert assert_true(journal, UP) == 1
        assert assert_true(journal, DOWN) == 0


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
    ids=["state", "entry"],
)
def test_full_disk_leaves_a_usable_journal(place, values, state):
    with opened(place) as journal:
        fill(journal, UP, 3)
        with file_size_limit(20_000), pytest.raises(OSError, match="large"):
            journal.add(UP, 3, values, state)
        assert assert_true(journal, UP) == 3
        assert not list(place.glob("*.new"))
        fill(journal, UP, 4)
        assert assert_true(journal, UP) == 4
    with opened(place) as journal:
        assert assert_true(journal, UP) == 4


@pytest.mark.parametrize("broken", ["replace", "fsync", "unlink"])
@pytest.mark.parametrize("calls", [0, 1, 2])
def test_a_failure_at_any_call_is_survived(place, monkeypatch, broken, calls):
    with opened(place) as journal:
        fill(journal, UP, 2)
        true_call, left = getattr(os, broken), [calls]

        def fail(*arguments, **options):
            left[0] -= 1
            if left[0] < 0:
                raise OSError(28, "No space left on device")
            return true_call(*arguments, **options)

        with monkeypatch.context() as patch:
            patch.setattr(os, broken, fail)
            with suppress(OSError):
                journal.add(UP, 2, values_of(2), state_of(2))
        assert assert_true(journal, UP) in (2, 3)
        fill(journal, UP, 5)
        assert assert_true(journal, UP) == 5


WRITER = """
import sys
from pathlib import Path
import numpy as np
from fegear.dynamics.journal import open_journal

journal = open_journal(Path(sys.argv[1]), {"a": "b"}, resume=True)
count = int(sys.argv[2])
print("open", flush=True)
for branch in ("1-up", "1-down"):
    done = journal.finished(branch)
    state = journal.state(branch)
    x = state["x"] if done else np.linspace(0.1, 0.9, 20_000)
    for index in range(len(done), count):
        x = 3.9 * x * (1.0 - x)  # chaos: any wrong bit shows
        values = {"mean": float(x.mean()), "nan": float("nan"), "index": index}
        journal.add(branch, index, values, {"x": x})
journal.close(keep=True)
"""


def start_writer(place: Path, count: int) -> subprocess.Popen:
    command = [sys.executable, "-c", WRITER, str(place), str(count)]
    writer = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert writer.stdout.readline() == "open\n"
    return writer


def contents(place: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in place.iterdir()}


def test_killed_at_any_time_and_resumed_nothing_differs(tmp_path):
    count, chance = 60, random.Random(2)
    with start_writer(tmp_path / "whole", count) as writer:
        began = time.perf_counter()
    span = time.perf_counter() - began
    kills = lengths = 0
    for _ in range(8):
        writer = start_writer(tmp_path / "killed", count)
        time.sleep(chance.uniform(0.0, 0.25 * span))
        writer.kill()
        with writer:
            kills += writer.wait() != 0
        with opened(tmp_path / "killed", inputs={"a": "b"}) as journal:
            found = sum(len(journal.finished(b)) for b in ("1-up", "1-down"))
        assert found >= lengths  # a kill loses nothing that was finished
        lengths = found
    assert kills >= 1
    with start_writer(tmp_path / "killed", count) as writer:
        pass
    assert writer.returncode == 0
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


def test_another_process_is_refused_until_it_is_killed(place):
    writer = start_writer(place, 100_000)
    try:
        with pytest.raises(InputError, match="another process works on it"):
            open_journal(place, {"a": "b"}, resume=False)
    finally:
        writer.kill()
        with writer:
            writer.wait()
    with opened(place, inputs={"a": "b"}, keep=False) as journal:
        journal.finished("1-up")
    assert not place.exists()


def test_entries_are_plain_json(place):
    with opened(place) as journal:
        fill(journal, UP, 1)
    content = json.loads((place / f"{UP}.000000.json").read_text())
    assert content["entry"]["values"] == values_of(0)
