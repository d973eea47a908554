"""Memory that is left, in a container with a limit too."""

from __future__ import annotations

from types import SimpleNamespace

import psutil
import pytest

from fegear.dynamics import memory
from fegear.dynamics.memory import available_bytes


def test_this_machine_has_some_memory():
    assert 1e7 < available_bytes() < 1e15


@pytest.mark.parametrize(
    ("limit", "expected"), [("2500000", 1.5e6), ("max", 3e6), ("9999999", 3e6)]
)
def test_a_container_may_have_less(monkeypatch, tmp_path, limit, expected):
    (tmp_path / "memory.max").write_text(f"{limit}\n")
    (tmp_path / "memory.current").write_text("1000000\n")
    monkeypatch.setattr(memory, "GROUP", tmp_path)
    free = SimpleNamespace(available=3_000_000)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: free)
    assert available_bytes() == expected
