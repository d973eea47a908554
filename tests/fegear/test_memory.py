"""Peaks of resident memory, one after the other in the same process."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

from fegear.files import memory
from fegear.files.memory import memory_level

linux = pytest.mark.skipif(sys.platform != "linux", reason="Linux counts it")


def rise(megabytes):
    """Of the peak above the start [MB], while so much is held and let go."""
    level = memory_level()
    held = np.ones(int(megabytes * 1e6 / 8))
    del held
    return level.peak_MB - level.resident_MB


@pytest.mark.slow
@linux
def test_a_peak_is_seen_and_does_not_last():
    assert rise(200.0) == pytest.approx(200.0, abs=20.0)
    assert abs(rise(1.0)) < 20.0
    assert rise(100.0) == pytest.approx(100.0, abs=20.0)


@linux
def test_what_is_freed_before_does_not_hide_a_later_need():
    # below the size from which the allocator maps each block by itself
    small = [bytes(50_000) for _ in range(4000)]
    del small
    level = memory_level()
    again = [bytes(50_000) for _ in range(4000)]
    assert len(again) == 4000
    assert level.peak_MB - level.resident_MB == pytest.approx(200.0, abs=20.0)


@pytest.mark.parametrize(
    "content",
    [
        None,
        "Name:\tpython\n",
        "VmHWM:\nVmRSS:\n",
        "VmHWM:\t 900000 kB\nVmRSS:\t 100000 kB\n",
    ],
)
def test_what_the_system_does_not_tell_is_not_made_up(content, tmp_path, monkeypatch):
    path = tmp_path / "status"
    if content is not None:
        path.write_text(content)
    monkeypatch.setattr(memory, "STATUS_FILE", path)
    level = memory_level()
    assert math.isnan(level.resident_MB)
    assert math.isnan(level.peak_MB)


@linux
def test_a_mark_that_may_not_be_set_back_is_not_read(tmp_path, monkeypatch):
    held = np.ones(25_000_000)
    del held
    monkeypatch.setattr(memory, "RESET_FILE", tmp_path / "nothing" / "clear_refs")
    assert math.isnan(memory_level().peak_MB)
