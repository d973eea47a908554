"""Where the time goes: named stages recorded around a piece of work."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from lumped.common.workers import require_running

COMPILING_STAGE = "compiling"
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
    """Count the block's time toward `name` if anyone records, compiling apart from it.

    It does not begin in a task that is to end, after Ctrl-C.
    """
    require_running()
    seconds = _recorder.get()
    start, compiled = time.perf_counter(), _compiling_s()
    try:
        yield
    finally:
        if seconds is not None:
            compiling = _compiling_s() - compiled
            elapsed_s = {name: time.perf_counter() - start - compiling}
            if compiling > 0.0:
                elapsed_s[COMPILING_STAGE] = compiling
            for stage_s, value in elapsed_s.items():
                seconds[stage_s] = seconds.get(stage_s, 0.0) + value


def _compiling_s() -> float:
    """Time that this process has spent on compiling kernels [s]."""
    compiled = sys.modules.get("lumped.common.compiled")  # loaded with the kernels
    return 0.0 if compiled is None else float(compiled.CLOCK.seconds)
