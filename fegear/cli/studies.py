"""Build the command of a study from the fields that its class declares."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, make_dataclass, replace
from pathlib import Path
from typing import Any

import typer

from fegear.cli.groups import grouped, named_as_options, option
from fegear.cli.options import (
    InThreads,
    Outputs,
    ResumedOutputs,
    Workers,
    refuse_unused_options,
    require_outputs,
)
from fegear.cli.screen import (
    print_announcement,
    print_columns,
    print_error,
    print_line,
    ruled_table,
    screen,
)
from fegear.files.output import (
    SINGLE_TABLES,
    make_directory,
    protected_inputs,
    require_ending,
)
from fegear.studies.page import ColumnTable, RowTable
from fegear.studies.settings import group_of, options_of
from fegear.studies.study import Study, files_read


def command_of(study_class: type[Study]) -> Callable[..., None]:
    """The command that runs a study, as typer sees it."""

    def command(*, study: Any, workers: Any, outputs: Any) -> None:
        begin = time.perf_counter()
        with protected_inputs(files_read(study)):
            _check_outputs(study, outputs)
            outputs = _make_directory(study, outputs)
            result, summary, said = _run_study(study, workers.chosen, outputs)
        seconds = time.perf_counter() - begin
        values = {**summary, "wall_time_s": round(seconds, 3)}
        with named_as_options(group_of(study)):
            outputs.show(values, lambda _: _show(result, outputs, seconds), said)
        _exit_with_status(result, outputs)

    command.__doc__ = study_class.description
    command.__annotations__ = {
        "study": study_class,
        "workers": Workers if study_class.distributes else InThreads,
        "outputs": _outputs_of(study_class),
    }
    return grouped(command)


def _outputs_of(study: type[Study]) -> type[Outputs]:
    """Options of all files that a study writes."""
    texts = {**study.more_tables, **study.pictures}
    texts |= {name: text for name, (text, _) in study.more_files.items()}
    default = MISSING if study.must_write else None
    kind = "DIR" if study.folder else None
    output_option = option(
        study.output, *study.output_names, default=default, metavar=kind
    )
    files: list[Any] = (
        [("output", Path | None, output_option)] if study.output_names else []
    )
    files += [(name, Path | None, option(text)) for name, text in texts.items()]
    if study.resumes:
        run = f"an interrupted run with the same --{study.checkpoint_beside}"
        anew = f"Discard {run}."
        files.append(("resume", bool, option(f"Resume {run}.", default=False)))
        files.append(("overwrite", bool, option(anew, default=False)))
    return make_dataclass(
        "Written",
        files,
        bases=(ResumedOutputs if study.resumes else Outputs,),
        namespace={
            "endings": study.endings,
            "checkpoint_beside": study.checkpoint_beside,
            "folder": study.folder,
        },
        frozen=True,
        kw_only=True,
    )


def _files(study: Study, outputs: Any) -> dict[str, Path | None]:
    """Further output files of a study, by name."""
    names = *study.more_tables, *study.more_files, *study.pictures
    return {name: getattr(outputs, name) for name in names}


def _check_outputs(study: Study, outputs: Any) -> None:
    """Refuse files that cannot be written and options that would have no effect."""
    files = _files(study, outputs)
    written: dict[str, Any] = {"output": outputs.output, **files}
    names = options_of(group_of(study)) | {name: f"--{name}" for name in written}
    written |= {n: getattr(outputs, n, False) for n in ("resume", "overwrite")}
    written = {name: value for name, value in written.items() if value}
    for name, reason in study.unused_options(written):
        value = written.get(name, getattr(study, name, None))
        refuse_unused_options(reason.format_map(names), **{name: value})
    outputs.require()
    others = [*filter(None, (outputs.output, files.pop("plot", None)))]
    for name, path in files.items():
        if name in study.pictures:
            require_outputs([], others, path)
        else:
            require_ending(path, study.more_files.get(name, ("", SINGLE_TABLES))[1])
            require_outputs([path], others)
        others += [path] if path is not None else []


def _make_directory(study: Study, outputs: Any) -> Any:
    """The outputs; the directory of a study that writes one is made."""
    directory = outputs.output or study.default_output
    if not study.folder or directory is None:
        return outputs
    folder = make_directory(directory)
    require_outputs([folder / name for name in study.files])
    return replace(outputs, output=folder)


def _run_study(
    study: Study, workers: Any, outputs: Any
) -> tuple[Any, Mapping[str, Any], Sequence[str]]:
    """Run with a progress bar and write the files.

    Returns the result, its summary and the lines that were printed before it.
    """
    from fegear.files.store import NO_CHECKPOINT
    from fegear.studies.running import run

    checkpoint_options, computed = (
        outputs.checkpoint_options if study.resumes else NO_CHECKPOINT,
        False,
    )
    try:
        with named_as_options(group_of(study)), outputs.progress() as report:
            said: list[str] = []

            def notify(line: str) -> None:
                said.append(line)
                print_announcement(line)

            def deliver(result: Any) -> None:
                nonlocal computed
                computed = True
                report("results", 0, 1)
                if not result.empty:
                    _write(result, outputs)

            options = checkpoint_options, report, workers, deliver, notify
            result = run(study, *options)
            return result, result.summary, said
    except BaseException as error:
        if computed or isinstance(error, KeyboardInterrupt):
            _print_checkpoint(outputs)
        raise


def _write(result: Any, outputs: Any) -> None:
    if outputs.output is not None:
        result.write(outputs.output)
    for name, path in _files(result.study, outputs).items():
        if path is None:
            continue
        if name in result.study.more_tables:
            result.write_table(path, name)
        elif name in result.study.more_files:
            result.more_files[name](path)
        else:
            result.draw(path, name)


def _print_checkpoint(outputs: Any) -> None:
    checkpoint = getattr(outputs, "checkpoint", None)
    if checkpoint is not None and checkpoint.exists():
        print_error(f"{checkpoint} is stored; --resume continues from it")


def _exit_with_status(result: Any, outputs: Any) -> None:
    """Exit code 1 after a failure, 130 after Ctrl-C; files are written by then."""
    if result.complete:
        return
    output_path = getattr(outputs, result.study.checkpoint_beside)
    written = output_path is not None and not result.empty
    message = (
        f"finished {'parts' if result.study.folder else 'rows'} are in {output_path}"
    )
    if result.failure:
        print_error(f"{result.failure}; {message}" if written else result.failure)
    elif written:
        print_error(message)
    _print_checkpoint(outputs)
    if result.failure:
        raise typer.Exit(1)
    raise KeyboardInterrupt


def _show(result: Any, outputs: Any, seconds: float) -> None:
    console = screen()
    for part in result.page():
        if isinstance(part, RowTable):
            table = ruled_table(
                *part.columns, title=part.title, text_columns=part.text_columns
            )
            table.columns[0].no_wrap = part.whole or table.columns[0].no_wrap
            for cells in part.cells():
                table.add_row(*cells)
            console.print(table)
        elif isinstance(part, ColumnTable):
            print_columns(console, part.corner, part.labels, part.columns, part.title)
        elif console.is_terminal:
            console.print(part)
        else:  # a file or a pipe: lines are not wrapped
            print_line(part)
    if result.study.folder and outputs.output is not None:
        print_line(
            f"wrote {', '.join(str(outputs.output / n) for n in result.study.files)}"
        )
    print_line(f"wall time {seconds:.2f} s")
