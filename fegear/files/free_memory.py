"""Memory that a computation can still get, on each system."""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
from pathlib import Path

MEMINFO = Path("/proc/meminfo")
GROUP = Path("/sys/fs/cgroup")  # of a container, which may have less than its host


class _Status(ctypes.Structure):
    """MEMORYSTATUSEX of the Windows API."""

    _fields_ = (
        ("length", ctypes.c_uint32),
        ("load", ctypes.c_uint32),
        *((name, ctypes.c_ulonglong) for name in ("total", "available")),
        *((f"other{i}", ctypes.c_ulonglong) for i in range(5)),
    )


def available_bytes() -> float:
    """Free memory, or all memory where a system reports no more; else infinity."""
    for ask in (_linux, _windows, _installed):
        with contextlib.suppress(OSError, ValueError, AttributeError, StopIteration):
            return ask()
    return math.inf


def _linux() -> float:
    lines = MEMINFO.read_text(encoding="utf-8").splitlines()
    tokens = next(line.split() for line in lines if line.startswith("MemAvailable:"))
    available = 1024.0 * int(tokens[1])
    with contextlib.suppress(OSError, ValueError):  # ValueError: "max", no limit
        limit, used = (
            float((GROUP / name).read_text())
            for name in ("memory.max", "memory.current")
        )
        available = min(available, limit - used)
    return available


def _windows() -> float:
    status = _Status(length=ctypes.sizeof(_Status))
    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined, unused-ignore]
    if not kernel.GlobalMemoryStatusEx(ctypes.byref(status)):
        raise OSError("GlobalMemoryStatusEx")
    return float(status.available)


def _installed() -> float:
    return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
