"""Memory that is left, as each system tells it."""

from __future__ import annotations

import ctypes
import math
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from fegear.files import free_memory
from fegear.files.free_memory import available_bytes

GONE = Path("/nowhere")


def test_this_machine_tells_its_memory():
    assert 1e7 < available_bytes() < 1e15


@pytest.fixture
def linux(monkeypatch, tmp_path):
    meminfo = tmp_path / "meminfo"
    meminfo.write_text("MemTotal:  4000 kB\nMemAvailable:   3000 kB\n")
    monkeypatch.setattr(free_memory, "MEMINFO", meminfo)
    monkeypatch.setattr(free_memory, "GROUP", tmp_path)
    return tmp_path


def test_linux_tells_what_is_available(linux):
    assert available_bytes() == 3000 * 1024


@pytest.mark.parametrize(
    ("limit", "expected"), [("2500000", 1.5e6), ("max", 3072000), ("9999999", 3072000)]
)
def test_a_container_may_have_less(linux, limit, expected):
    (linux / "memory.max").write_text(f"{limit}\n")
    (linux / "memory.current").write_text("1000000\n")
    assert available_bytes() == expected


def test_windows_fills_a_structure(monkeypatch):
    def fill(reference):
        status = reference._obj
        assert status.length == ctypes.sizeof(status) == 64  # bytes of MEMORYSTATUSEX
        status.total, status.available = 8_000_000_000, 5_000_000_000
        return 1

    kernel = SimpleNamespace(kernel32=SimpleNamespace(GlobalMemoryStatusEx=fill))
    monkeypatch.setattr(free_memory, "MEMINFO", GONE)
    monkeypatch.setattr(ctypes, "windll", kernel, raising=False)
    assert available_bytes() == 5e9


@pytest.mark.skipif(sys.platform == "win32", reason="has no sysconf")
def test_other_systems_tell_what_is_installed(monkeypatch):
    monkeypatch.setattr(free_memory, "MEMINFO", GONE)
    assert available_bytes() == os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def test_a_system_that_tells_nothing_has_enough(monkeypatch):
    monkeypatch.setattr(free_memory, "MEMINFO", GONE)
    monkeypatch.setattr(os, "sysconf", lambda name: int("none"), raising=False)
    assert available_bytes() == math.inf
