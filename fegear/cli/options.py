"""What commands share: choices, checks and the progress bar."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from fegear.statics import Progress


class PlaneChoice(StrEnum):
    stress = "stress"
    strain = "strain"


class ResolutionChoice(StrEnum):
    coarse = "coarse"
    default = "default"
    fine = "fine"


def checked_torques(torques: list[float]) -> list[float]:
    for value in torques:
        ok = 0.0 < value < 1e9
        require(ok, "--torque", value, "must be positive, on the driving gear [N m]")
    return torques


def require(ok: bool, option: str, value: float, allowed: str) -> None:
    from fegear.errors import InputError

    if not ok:
        raise InputError(f"{option} = {value:g}; {allowed}")


@contextmanager
def progress_bar(enabled: bool) -> Iterator[Progress]:
    """A bar on the error stream that goes away when the work is done."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description:<28}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    shown = enabled and console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=not shown) as bar:
        task = bar.add_task("", total=1)

        def report(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total)

        yield report


def require_outputs(
    outputs: Sequence[Path | None], inputs: Sequence[Path | str] = ()
) -> None:
    """Files can be written, differ from each other, and replace no input."""
    from pathlib import Path

    from fegear.errors import InputError
    from fegear.output import require_writable

    taken = {Path(path).resolve() for path in inputs}
    for path in outputs:
        if path is None:
            continue
        require_writable(path)
        place = path.resolve()
        if place in taken and not str(path).startswith("/dev/"):
            raise InputError(f"{path}: is read or written already by this command")
        taken.add(place)
