"""Commands that a signal ends after so many records or reports, however fast they are.

A process that is watched from outside may have ended before the one that watches looks
again, on a busy machine for seconds.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ENDED = """
import os
import sys
from itertools import count

from fegear.cli import main
from {module} import {owner}

known, numbers = {owner}.{method}, count(1)


def counted(*given):
    known(*given)
    if next(numbers) == {number}:
        os.kill(os.getpid(), {sent:d})


{owner}.{method} = counted
main()
"""
RECORDS = {"module": "fegear.files.store", "owner": "Checkpoint", "method": "add"}
REPORTS = {
    "module": "fegear.studies.running",
    "owner": "TaskProgress",
    "method": "report",
}


def killed_after(records: int, arguments: Sequence[str]) -> None:
    """Run a command until its checkpoint has so many records, then kill it."""
    code = ENDED.format(**RECORDS, number=records, sent=signal.SIGKILL)
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True)
    assert done.returncode == -signal.SIGKILL, done.stderr


def interrupted_after(
    reports: int, arguments: Sequence[str], folder: Path
) -> subprocess.CompletedProcess[str]:
    """Run a command until it has reported so often, then press Ctrl-C."""
    code = ENDED.format(**REPORTS, number=reports, sent=signal.SIGINT)
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )
