"""The command line: a command for each study, loaded when it is asked for."""

from __future__ import annotations

import logging
import os
import sys
from io import TextIOWrapper
from typing import Annotated

import typer

from fegear.cli.command import TYPER_OPTIONS
from fegear.cli.screen import print_error, print_line
from fegear.cli.study_group import group_class
from fegear.studies.registry import groups, listed

# the others are the solvers' own: they say what was not solved, and where
BUILTIN_FAILURES = (ZeroDivisionError, OverflowError, FloatingPointError)
INTERRUPTED = "interrupted"
BROKEN_PIPE = 141  # 128 and the number of the signal, as shells have it
PROGRAM_HELP = (
    "Spur and helical gears: mesh stiffness and transmission error by finite "
    "elements, and the vibration of gear trains that they excite."
)

app = typer.Typer(
    name="fegear", help=PROGRAM_HELP, cls=group_class(listed()), **TYPER_OPTIONS
)
for group in groups().values():
    members = group_class(listed(group.name), f"{group.name} ")
    commands_of_group = typer.Typer(help=group.title, cls=members, **TYPER_OPTIONS)
    app.add_typer(commands_of_group, name=group.name)


def _print_version(is_requested: bool) -> None:
    if is_requested:
        from fegear.files.version import package_version

        print_line(f"fegear {package_version()}")
        raise typer.Exit


@app.callback(help=PROGRAM_HELP)
def options(
    debug: Annotated[
        bool,
        typer.Option("--debug", help="Show a traceback where something fails."),
    ] = False,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Print the version and exit.",
            is_eager=True,
            callback=_print_version,
        ),
    ] = False,
) -> None:
    """Options before a command."""


def main() -> None:
    """Entry point of the command line."""
    # The matrices are small: threads gain nothing, and on a busy machine they wait
    # for each other twenty times as long as the work takes.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # names may not fit the screen's letters
            stream.reconfigure(errors="backslashreplace")
    log = logging.getLogger("lumped")  # such as that kernels are compiled
    log.addHandler(Announcer())
    log.setLevel(logging.INFO)
    sys.exit(run(sys.argv[1:]))


def _open_closed_streams() -> None:
    """Streams that the shell has closed (`>&-`) lead nowhere.

    Else a file that is opened later takes their place, and what is printed.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, os.O_RDWR)
            mode = "r" if name == "stdin" else "w"
            setattr(sys, name, os.fdopen(handle, mode, encoding="utf-8"))


class Announcer(logging.Handler):
    """Lines of a log on the error stream."""

    def emit(self, record: logging.LogRecord) -> None:
        print_error(record.getMessage())


def run(argv: list[str]) -> int:
    """Run a command: exit code 0, 1 failed, 2 for wrong input, 130 after Ctrl-C, 141
    where the reader of the output has gone, such as `head`.

    Whatever goes wrong is one line on the error stream; --debug raises it instead.
    """
    debug = "--debug" in argv
    arguments = [word for word in argv if word != "--debug"] or ["--help"]
    try:
        code = app(arguments, prog_name="fegear", standalone_mode=False) or 0
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit) as end:  # Typer and Rich make it an exit
        _close_full_output()
        return BROKEN_PIPE if getattr(end, "code", BROKEN_PIPE) else 0
    except BaseException as error:
        if debug:
            raise
        code, message = _exit_code_and_message(error)
        print_error(message)
        return code
    if code == 130:  # Ctrl-C, turned into a code on the way
        print_error(INTERRUPTED)
    return code


def _exit_code_and_message(error: BaseException) -> tuple[int, str]:
    """Exit code and what to say."""
    from fegear.files.errors import InputError, file_error
    from lumped.train.bodies import TrainError
    from meshes.gmsh_session import MissingSystemLibrary

    if isinstance(error, KeyboardInterrupt):
        return 130, INTERRUPTED
    if isinstance(error, InputError | TrainError):
        return 2, str(error)
    if hasattr(error, "format_message"):  # wrong words, such as an unknown option
        return 2, str(error.format_message())
    failed = isinstance(error, ArithmeticError) and type(error) not in BUILTIN_FAILURES
    if failed or isinstance(error, MissingSystemLibrary):
        return 1, str(error)
    if isinstance(error, OSError):
        _close_full_output()
        return 2, str(file_error(error.filename or "standard output", "written", error))
    kind = type(error).__name__
    return 1, f"{kind}: {error} (run again with --debug for a traceback)"


def _close_full_output() -> None:
    """So that Python does not try and fail again at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
