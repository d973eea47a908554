"""Commands of studies: options, files, screen and progress from the declaration."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
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
    require_ending,
    require_outputs,
)
from fegear.cli.screen import (
    print_columns,
    print_error,
    print_line,
    ruled_table,
    screen,
)
from fegear.files.output import make_directory, write_text
from fegear.studies.page import ColumnTable, RowTable
from fegear.studies.study import (
    TABLES,
    Study,
    files_read,
    group_of,
    options_of,
)


def command_of(study: type[Study]) -> Callable[..., None]:
    """The command that runs a study, as typer sees it."""

    def command(*, asked: Any, workers: Any, outputs: Any) -> None:
        begin = time.perf_counter()
        _require(asked, outputs)
        outputs = _placed(asked, outputs)
        found, summary = _found(asked, workers.chosen, outputs)
        seconds = time.perf_counter() - begin
        values = {**summary, "wall_time_s": round(seconds, 3)}
        with named_as_options(group_of(asked)):
            outputs.show(values, lambda values: _show(found, outputs, seconds))
        _end(found, outputs)

    command.__doc__ = study.__doc__
    command.__annotations__ = {
        "asked": study,
        "workers": Workers if study.distributes else InThreads,
        "outputs": _outputs_of(study),
    }
    return grouped(command)


def _outputs_of(study: type[Study]) -> type[Outputs]:
    """Options of all files that a study writes."""
    texts = {**study.more_tables, **study.pictures}
    texts |= {name: text for name, (text, _) in study.more_files.items()}
    default = MISSING if study.must_write else None
    kind = "DIR" if study.folder else None
    shown = option(study.output, *study.output_names, default=default, metavar=kind)
    files: list[Any] = [("output", Path | None, shown)] if study.output_names else []
    files += [(name, Path | None, option(text)) for name, text in texts.items()]
    if study.resumes:
        run = f"an interrupted run to the same --{study.checkpoint_beside}"
        anew = f"Start anew where {run} has kept something."
        files.append(("resume", bool, option(f"Go on with {run}.", default=False)))
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


def _require(asked: Study, outputs: Any) -> None:
    """Files can be written, and nothing is asked for that changes nothing."""
    files = _files(asked, outputs)
    given: dict[str, Any] = {"output": outputs.output, **files}
    names = options_of(group_of(asked)) | {name: f"--{name}" for name in given}
    given |= {n: getattr(outputs, n, False) for n in ("resume", "overwrite")}
    given = {name: value for name, value in given.items() if value}
    for name, reason in asked.unused_options(given):
        value = given.get(name, getattr(asked, name, None))
        refuse_unused_options(reason.format_map(names), **{name: value})
    taken = list(files_read(asked))
    outputs.require(*taken)
    taken += map(str, filter(None, (outputs.output, files.pop("plot", None))))
    for name, path in files.items():
        if name in asked.pictures:
            require_outputs([], taken, path)
        else:
            require_ending(path, asked.more_files.get(name, ("", TABLES))[1])
            require_outputs([path], taken)
        taken += [str(path)] if path is not None else []


def _placed(asked: Study, outputs: Any) -> Any:
    """The outputs, with a directory that is made before the run."""
    place = outputs.output or asked.default_output
    if not asked.folder or place is None:
        return outputs
    folder = make_directory(place)
    require_outputs([folder / name for name in asked.files])
    return replace(outputs, output=folder)


def _found(asked: Study, workers: Any, outputs: Any) -> tuple[Any, Mapping[str, Any]]:
    """The result and its summary, files written; a bar moves all the while."""
    from fegear.files.store import NO_CHECKPOINT
    from fegear.studies.running import run

    keeping, computed = (
        outputs.checkpoint_options if asked.resumes else NO_CHECKPOINT,
        False,
    )
    try:
        with named_as_options(group_of(asked)), outputs.progress() as report:

            def deliver(found: Any) -> None:
                nonlocal computed
                computed = True
                report("results", 0, 1)
                if not found.empty:
                    _write(found, outputs)

            found = run(asked, keeping, report, workers, deliver)
            return found, found.summary
    except BaseException as error:
        if computed or isinstance(error, KeyboardInterrupt):
            _say_what_is_kept(outputs)
        raise


def _write(found: Any, outputs: Any) -> None:
    if outputs.output is not None:
        found.write(outputs.output)
    for name, path in _files(found.study, outputs).items():
        if path is None:
            continue
        if name in found.study.more_tables:
            write_text(path, found.more_tables[name].csv())
        elif name in found.study.more_files:
            found.more_files[name](path)
        else:
            found.draw(path, name)


def _say_what_is_kept(outputs: Any) -> None:
    kept = getattr(outputs, "checkpoint", None)
    if kept is not None and kept.exists():
        print_error(f"{kept} is stored; --resume continues from it")


def _end(found: Any, outputs: Any) -> None:
    """Exit code 1 after a failure, 130 after Ctrl-C; files are written by then."""
    if found.complete:
        return
    place = getattr(outputs, found.study.checkpoint_beside)
    written = place is not None and not found.empty
    rows = f"finished {'parts' if found.study.folder else 'rows'} are in {place}"
    if found.failure:
        print_error(f"{found.failure}; {rows}" if written else found.failure)
    elif written:
        print_error(rows)
    _say_what_is_kept(outputs)
    if found.failure:
        raise typer.Exit(1)
    raise KeyboardInterrupt


def _show(found: Any, outputs: Any, seconds: float) -> None:
    console = screen()
    for part in found.page():
        if isinstance(part, RowTable):
            table = ruled_table(*part.columns, title=part.title, words=part.words)
            table.columns[0].no_wrap = part.whole or table.columns[0].no_wrap
            for cells in part.cells():
                table.add_row(*cells)
            console.print(table)
        elif isinstance(part, ColumnTable):
            print_columns(console, part.corner, part.labels, part.columns, part.title)
        elif console.is_terminal:
            console.print(part)
        else:  # lines as long as they are
            print_line(part)
    if found.study.folder and outputs.output is not None:
        print_line(
            f"wrote {', '.join(str(outputs.output / n) for n in found.study.files)}"
        )
    print_line(f"wall time {seconds:.2f} s")
