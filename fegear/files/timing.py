"""Where the time goes: named stages recorded around a piece of work."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from lumped.common.workers import require_running

_recorder: ContextVar[dict[str, float] | None] = ContextVar("recorder", default=None)


@contextmanager
def recorded_stages() -> Iterator[dict[str, float]]:
    """Seconds by stage name, filled while the block runs."""
    seconds: dict[str, float] = {}
    token = _recorder.set(seconds)
    try:
        yield seconds
    finally:
        _recorder.reset(token)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Count the block's time toward `name` if anyone records.

    It does not begin in a task that is to end, after Ctrl-C.
    """
    require_running()
    seconds = _recorder.get()
    start = time.perf_counter()
    try:
        yield
    finally:
        if seconds is not None:
            seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start
