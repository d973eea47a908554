"""Build the command of a study from the fields that its class declares."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.outputs import (
    Outputs,
    check_outputs,
    make_output_directory,
    output_parameters,
    write_outputs,
)
from fegear.cli.parameters import (
    group_value,
    named_as_options,
    option_parameter,
    require_allowed,
    setting_parameters,
)
from fegear.cli.screen import (
    print_announcement,
    print_error,
    print_line,
)
from fegear.files.errors import InputError
from fegear.files.output import protected_inputs
from fegear.studies.page_text import print_page, screen
from fegear.studies.settings import group_of
from fegear.studies.study import Study, files_read

if TYPE_CHECKING:
    from lumped.common.workers import Cluster


def command_of(study_class: type[Study]) -> Callable[..., None]:
    """The command that runs a study, as typer sees it."""
    group = group_of(study_class)
    parameters = [
        *setting_parameters(group),
        *(_worker_parameters() if study_class.distributes else ()),
        *output_parameters(study_class),
    ]

    def command(**values: Any) -> None:
        require_allowed(parameters, values)
        study = group_value(group, values)
        _run_command(study, _workers(values), Outputs.of(study_class, values))

    command.__doc__ = study_class.description
    command.__dict__["__signature__"] = Signature(parameters)
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    return command


def _worker_parameters() -> Iterator[Parameter]:
    text = "Compute in worker processes of dask.distributed, one a core."
    yield option_parameter("cluster", bool, text, default=False)
    text = (
        "Address of a dask scheduler that runs, such as tcp://host:8786, on whose "
        "workers to compute. [default: none]"
    )
    yield option_parameter("scheduler", str | None, text)


def _workers(values: Mapping[str, Any]) -> Cluster | None:
    """Worker processes that compute tasks, None for threads of this process."""
    from lumped.common.workers import Cluster

    cluster, scheduler = values.get("cluster", False), values.get("scheduler")
    if cluster and scheduler is not None:
        raise InputError("--cluster; --scheduler takes its place")
    return Cluster(scheduler or "") if cluster or scheduler is not None else None


def _run_command(study: Study, workers: Cluster | None, outputs: Outputs) -> None:
    start_time = time.perf_counter()
    with protected_inputs(files_read(study)):
        check_outputs(study, outputs)
        outputs = make_output_directory(study, outputs)
        result, summary, printed_lines = _run_study(study, workers, outputs)
    seconds = time.perf_counter() - start_time
    values = {**summary, "wall_time_s": round(seconds, 3)}
    with named_as_options(group_of(study)):
        outputs.show(
            values, lambda _: _show_result(result, outputs, seconds), printed_lines
        )
    _exit_with_status(result, outputs)


def _run_study(
    study: Study, workers: Cluster | None, outputs: Outputs
) -> tuple[Any, Mapping[str, Any], Sequence[str]]:
    """Run with a progress bar and write the files.

    Returns the result, its summary and the lines that were printed before it.
    """
    from fegear.studies.running import run

    checkpoint_options, is_computed = outputs.checkpoint_options(study), False
    try:
        with named_as_options(group_of(study)), outputs.progress() as report:
            printed_lines: list[str] = []

            def notify(line: str) -> None:
                printed_lines.append(line)
                print_announcement(line)

            def deliver(result: Any) -> None:
                nonlocal is_computed
                is_computed = True
                report("results", 0, 1)
                if not result.empty:
                    write_outputs(result, outputs)

            arguments = checkpoint_options, report, workers, deliver, notify
            result = run(study, *arguments)
            return result, result.summary, printed_lines
    except BaseException as error:
        if is_computed or isinstance(error, KeyboardInterrupt):
            _print_checkpoint(study, outputs)
        raise


def _print_checkpoint(study: Study, outputs: Outputs) -> None:
    checkpoint = outputs.checkpoint(study)
    if checkpoint is not None and checkpoint.exists():
        print_error(f"{checkpoint} is stored; --resume continues from it")


def _exit_with_status(result: Any, outputs: Outputs) -> None:
    """Exit code 1 after a failure, 130 after Ctrl-C; files are written by then."""
    if result.complete:
        return
    paths = {"output": outputs.output, **outputs.files}
    output_path = paths.get(result.study.checkpoint_beside)
    is_written = output_path is not None and not result.empty
    message = (
        f"finished {'parts' if result.study.folder else 'rows'} are in {output_path}"
    )
    if result.failure:
        print_error(f"{result.failure}; {message}" if is_written else result.failure)
    elif is_written:
        print_error(message)
    _print_checkpoint(result.study, outputs)
    if result.failure:
        raise typer.Exit(1)
    raise KeyboardInterrupt


def _show_result(result: Any, outputs: Outputs, seconds: float) -> None:
    print_page(result.page(), screen())
    if result.study.folder and outputs.output is not None:
        print_line(
            f"wrote {', '.join(str(outputs.output / n) for n in result.study.files)}"
        )
    print_line(f"wall time {seconds:.2f} s")
