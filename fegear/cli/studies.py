"""Commands of studies: options, files, screen and progress from the declaration."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import make_dataclass
from pathlib import Path
from typing import Any

from fegear.cli.groups import grouped, named_as_options, option
from fegear.cli.options import (
    Outputs,
    ResumedOutputs,
    TableOutputs,
    draw_into,
    refuse_idle,
    require_outputs,
)
from fegear.cli.screen import complain, ruled_table, say, screen
from fegear.studies.page import Grid, Page
from fegear.studies.study import Group, Setting, Study, group_of, offered, options_of


def command_of(study: type[Study]) -> Callable[..., None]:
    """The command that runs a study, as typer sees it."""
    others = {name: text for name, text in study.pictures.items() if name != "plot"}
    pictures = make_dataclass(
        "Pictures",
        [(name, Path | None, option(text)) for name, text in others.items()],
        kw_only=True,
    )

    def command(*, asked: Any, drawn: Any, outputs: Any) -> None:
        begin = time.perf_counter()
        _require(asked, drawn, outputs)
        found, summary = _found(asked, drawn, outputs)
        seconds = time.perf_counter() - begin
        values = {**summary, "wall_time_s": round(seconds, 3)}
        outputs.show(values, lambda values: _show(found.page(), seconds))

    command.__doc__ = study.__doc__
    command.__annotations__ = {
        "asked": study,
        "drawn": pictures,
        "outputs": _outputs_of(study),
    }
    return grouped(command)


def _outputs_of(study: type[Study]) -> type[TableOutputs]:
    if study.resumes:
        return ResumedOutputs
    return Outputs if "plot" in study.pictures else TableOutputs


def _require(asked: Study, drawn: Any, outputs: Any) -> None:
    """Files can be written, and nothing is asked for that changes nothing."""
    files = {"plot": outputs.plot, **vars(drawn)}
    given = {"resume": getattr(outputs, "resume", False), **files}
    given = {name: value for name, value in given.items() if value}
    names = options_of(group_of(asked))
    names |= {name: f"--{name}" for name in (*files, "resume")}
    for name, reason in asked.idle(given.keys()):
        value = given.get(name, getattr(asked, name, None))
        refuse_idle(reason.format_map(names), **{name: value})
    read = list(_read_files(asked, group_of(asked)))
    outputs.require(*read)
    for path in vars(drawn).values():
        require_outputs([outputs.output, outputs.plot], read, path)


def _read_files(asked: Any, group: Group) -> Iterator[str]:
    """Values of arguments, which may be paths."""
    for each in offered(group):
        value = getattr(asked, each.name)
        if each.group is not None:
            yield from _read_files(value, each.group)
        elif isinstance(each.declared, Setting):
            if each.declared.place:
                yield str(value)
            elif each.declared.reads:
                yield from value


def _found(asked: Study, drawn: Any, outputs: Any) -> tuple[Any, Mapping[str, Any]]:
    """The result and its summary, files written; a bar moves all the while."""
    from fegear.store import NOTHING
    from fegear.studies.running import run

    keeping = outputs.keeping if asked.resumes else NOTHING
    kept = keeping.checkpoint
    try:
        with named_as_options(group_of(asked)), outputs.progress() as report:
            found = run(asked, keeping, report)
            report("results", 0, 1)
            outputs.write(found.table.csv)
            for name, path in {"plot": outputs.plot, **vars(drawn)}.items():
                if path is not None:
                    draw_into(path, found.figures[name])
            return found, found.summary
    except KeyboardInterrupt:
        if kept is not None and kept.exists():
            complain(f"{kept} is kept, --resume goes on with it")
        raise


def _show(page: Page, seconds: float) -> None:
    console = screen()
    for part in page:
        if isinstance(part, Grid):
            table = ruled_table(*part.columns, title=part.title, words=part.words)
            for cells in part.cells():
                table.add_row(*cells)
            console.print(table)
        else:
            console.print(part)
    say(f"wall time {seconds:.2f} s")
