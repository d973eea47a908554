"""Shared by commands: options with their help, choices, checks, the progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

from fegear.cli.groups import option
from fegear.cli.progress import progress_lines
from fegear.cli.screen import print_error, print_json, print_warnings
from fegear.files.errors import InputError
from fegear.files.output import (
    TABLES,
    file_identity,
    require_ending,
    require_no_input,
    require_picture,
    require_writable,
    taken_error,
)

if TYPE_CHECKING:
    from fegear.files.store import CheckpointOptions
    from lumped.common.progress import Progress
    from lumped.common.workers import Cluster


AsJson = Annotated[
    bool, typer.Option("--json", help="Print the results as JSON instead of tables.")
]


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """Form of printed results; `command_of` adds the files of a study."""

    as_json: AsJson = False
    output: ClassVar[Path | None] = None
    plot: ClassVar[Path | None] = None
    endings: ClassVar[Sequence[str]] = TABLES
    folder: ClassVar[bool] = False

    def require(self) -> None:
        """Files can be written, and have names that say what they are."""
        if not self.folder:
            require_ending(self.output, self.endings)
        require_outputs([None if self.folder else self.output], plot=self.plot)

    def show(
        self,
        values: dict[str, Any],
        print_values: Callable[[dict[str, Any]], None],
        said: Sequence[str] = (),
    ) -> None:
        """Print the result as JSON or by the function, and a line for each warning.

        said : lines that were printed before
        """
        (print_json if self.as_json else print_values)(values)
        print_warnings(w for w in values.get("warnings", ()) if w not in said)

    def progress(self) -> AbstractContextManager[Progress]:
        """A bar, unless the screen is for JSON."""
        return progress_bar(enabled=not self.as_json)


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Worker processes that compute tasks instead of threads of this process."""

    cluster: bool = option(
        "Compute in worker processes of dask.distributed, one a core.", default=False
    )
    scheduler: str | None = option(
        "Address of a dask scheduler that runs, such as tcp://host:8786, on whose "
        "workers to compute. [default: none]"
    )

    def __post_init__(self) -> None:
        if self.cluster and self.scheduler is not None:
            raise InputError("--cluster; --scheduler takes its place")

    @property
    def chosen(self) -> Cluster | None:
        from lumped.common.workers import Cluster

        on_cluster = self.cluster or self.scheduler is not None
        return Cluster(self.scheduler or "") if on_cluster else None


@dataclass(frozen=True)
class InThreads:
    """The choice of workers of commands that take no `Workers`."""

    chosen: ClassVar[None] = None


@dataclass(frozen=True, kw_only=True)
class ResumedOutputs(Outputs):
    """Output files of a long run, and whether an interrupted run is resumed.

    checkpoint_beside : name of the file next to which finished work is stored
    """

    checkpoint_beside: ClassVar[str]
    resume: bool = False
    overwrite: bool = False

    def __post_init__(self) -> None:
        if self.resume and self.checkpoint is None:
            name = f"--{self.checkpoint_beside}"
            raise InputError(f"--resume needs the {name} of the run to resume")
        if self.checkpoint is None:
            refuse_unused_options(
                f"needs --{self.checkpoint_beside}", overwrite=self.overwrite
            )
        if self.resume:
            refuse_unused_options(
                "--resume keeps what --overwrite drops", overwrite=self.overwrite
            )

    def require(self) -> None:
        super().require()
        if self.checkpoint is not None:
            require_no_input(self.checkpoint)

    @property
    def checkpoint_options(self) -> CheckpointOptions:
        from fegear.files.store import CheckpointOptions

        return CheckpointOptions(
            checkpoint=self.checkpoint,
            resume=self.resume,
            overwrite=self.overwrite,
        )

    @property
    def checkpoint(self) -> Path | None:
        """The checkpoint, which stays until all files are written."""
        path = getattr(self, self.checkpoint_beside)
        return None if path is None else Path(f"{path}.partial")


def refuse_unused_options(reason: str, **options: Any) -> None:
    """Refuse options that would change nothing.

    reason : why, such as `needs --excitation trapezoid`
    options : by name, None for those that are not given
    """
    for name, value in options.items():
        if value is not None and value is not False:
            values = value if isinstance(value, list) else [value]
            texts = (f"{v:.12g}" if isinstance(v, float) else str(v) for v in values)
            shown = "" if value is True else f" = {', '.join(texts)}"
            raise InputError(f"--{name.replace('_', '-')}{shown}; {reason}")


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


def require_outputs(
    outputs: Sequence[Path | None],
    others: Sequence[Path] = (),
    plot: Path | None = None,
) -> None:
    """Files can be written, and differ from each other and from other outputs.

    plot : one more output, a picture by its ending
    """
    if plot is not None:
        require_picture(plot)
    taken = {file_identity(path) for path in others}
    for path in (*outputs, plot):
        if path is None:
            continue
        require_writable(path)
        identity = file_identity(path)
        if identity in taken and not str(path).startswith("/dev/"):
            raise taken_error(path)
        taken.add(identity)
