"""Progress: a bar on a terminal, elsewhere a line a minute, as in a log file."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fegear.cli.screen import print_error

if TYPE_CHECKING:
    from lumped.common.progress import Progress

INTERVAL_S = 60.0  # s between lines; shorter commands write none
Write = Callable[[str], None]
Wait = Callable[[float], bool]


@contextmanager
def progress_bar(enabled: bool) -> Iterator[Progress]:
    """Show a bar on the error stream, and remove it when the work is done.

    A pipe or file gets a line a minute instead.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from fegear.files.printable import printable

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description:<28}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    if enabled and not console.is_terminal:
        with progress_lines(print_error) as report_lines:
            yield report_lines
        return
    hidden = not enabled
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        task = bar.add_task("", total=1)

        def report(stage: str, done: int, total: int) -> None:
            description = printable(stage)
            bar.update(task, description=description, completed=done, total=total)

        yield report


@contextmanager
def progress_lines(write: Write, wait: Wait | None = None) -> Iterator[Progress]:
    """Write how far the work has come once a minute, however seldom it reports.

    wait : function that waits for so many seconds, and returns whether the work is done
    """
    done = threading.Event()
    latest = ["preparation"]
    lines = threading.Thread(
        target=_write_lines, args=(latest, write, wait or done.wait), daemon=True
    )
    lines.start()

    def report(stage: str, done: int, total: int) -> None:
        latest[0] = f"{stage}, {done} of {total}" if total > 1 else stage

    try:
        yield report
    finally:
        done.set()
        lines.join()


def _write_lines(latest: list[str], write: Write, wait: Wait) -> None:
    minutes = 0
    while not wait(INTERVAL_S):
        minutes += 1
        write(f"{minutes * INTERVAL_S / 60.0:g} min: {latest[0]}")
