"""Resident memory of this process while something runs, as Linux counts it.

In one process peaks add up: the largest resident memory so far hides what a later run
needs. So the system's high-water mark is set back before a run and read after it.
What ran before still counts in two ways: modules, compiled code and tables that stay
loaded are below the level at the start, and memory that could not be given back to
the system is used again without a trace.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import math
from dataclasses import dataclass
from pathlib import Path

STATUS_FILE, RESET_FILE = Path("/proc/self/status"), Path("/proc/self/clear_refs")
RESET_PEAK = "5"  # of clear_refs, proc(5): the mark becomes what is resident now
PEAK, NOW = "VmHWM", "VmRSS"  # of status
SLACK_MB = 16.0  # MB between mark and resident memory, which are not read at once


@dataclass(frozen=True)
class MemoryLevel:
    """Resident memory [MB] where a measurement begins; NaN where it is not known."""

    resident_MB: float

    @property
    def peak_MB(self) -> float:
        """Largest resident memory since then [MB], NaN where it is not known."""
        return peak_memory_MB() if math.isfinite(self.resident_MB) else math.nan


def peak_memory_MB() -> float:
    """Largest resident memory of this process [MB], NaN where it is not known.

    Since the mark was set back, if it ever was.
    """
    return _status(PEAK)


def memory_level() -> MemoryLevel:
    """Set the mark back, with what is no longer used given back to the system.

    One measurement at a time: another one within it takes its peak away.
    """
    _release_memory()
    with contextlib.suppress(OSError):
        RESET_FILE.write_text(RESET_PEAK)
    resident = _status(NOW)
    # a mark that stays up belongs to something earlier
    was_reset = peak_memory_MB() - resident <= SLACK_MB
    return MemoryLevel(resident if was_reset else math.nan)


def _status(key: str) -> float:
    """An entry of the process's status [MB], NaN where the system has none."""
    try:
        lines = STATUS_FILE.read_text(encoding="utf-8").splitlines()
        tokens = next(line.split() for line in lines if line.startswith(f"{key}:"))
        return int(tokens[1]) * 1024 / 1e6
    except (OSError, StopIteration, ValueError, IndexError):
        return math.nan


def _release_memory() -> None:
    """Collect garbage, and let the allocator give back what it holds free."""
    gc.collect()
    # glibc alone has it; other systems have no memory figures here
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
