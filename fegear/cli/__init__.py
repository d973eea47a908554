"""The command line: a file per command, everything heavy imported where used."""

from __future__ import annotations

import os
import sys
from io import TextIOWrapper

import typer

from fegear.cli.bench import bench_app
from fegear.cli.compare import compare_command
from fegear.cli.dynamics import dynamics_command
from fegear.cli.identify import identify_command
from fegear.cli.map import map_command
from fegear.cli.mesh import mesh_command
from fegear.cli.modes import modes_command
from fegear.cli.render import render_command
from fegear.cli.screen import complain
from fegear.cli.sets import sets_command
from fegear.cli.show import show_command
from fegear.cli.stiffness import stiffness_command
from fegear.cli.sweep import sweep_command
from fegear.cli.validate import validate_command
from fegear.cli.wave import wave_command

INTERRUPTED = "interrupted; finished rows and compliances are kept"
ABOUT = (
    "Spur gears: mesh stiffness and transmission error by finite elements, and the "
    "vibration of gear trains that they excite."
)

app = typer.Typer(
    name="fegear",
    help=ABOUT,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("sets")(sets_command)
app.command("show")(show_command)
app.command("mesh")(mesh_command)
app.command("stiffness")(stiffness_command)
app.command("compare")(compare_command)
app.command("identify")(identify_command)
app.command("modes")(modes_command)
app.command("sweep")(sweep_command)
app.command("wave")(wave_command)
app.command("map")(map_command)
app.command("dynamics")(dynamics_command)
app.command("render")(render_command)
app.command("validate")(validate_command)
app.add_typer(bench_app, name="bench")


@app.callback(help=ABOUT)
def options(
    debug: bool = typer.Option(
        False, "--debug", help="Show a traceback where something fails; any place."
    ),
) -> None:
    """What the tool is for stands in ABOUT; this takes the options before a command."""


def main() -> None:
    """Entry point of the command line."""
    # The matrices are small: threads gain nothing, and on a busy machine they wait
    # for each other twenty times as long as the work takes.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # names may not fit the screen's letters
            stream.reconfigure(errors="backslashreplace")
    sys.exit(run(sys.argv[1:]))


def run(words: list[str]) -> int:
    """Run a command: exit code 0, 1 failed, 2 for wrong input, 130 after Ctrl-C.

    Whatever goes wrong is one line on the error stream; --debug raises it instead.
    """
    debug = "--debug" in words
    arguments = [word for word in words if word != "--debug"] or ["--help"]
    try:
        code = app(arguments, standalone_mode=False) or 0
        sys.stdout.flush()
    except SystemExit as end:  # the reader of the output has gone, such as `head`
        return int(end.code or 0)
    except BaseException as error:
        if debug:
            raise
        code, message = _explained(error)
        complain(message)
        return code
    if code == 130:  # Ctrl-C, turned into a code on the way
        complain(INTERRUPTED)
    return code


def _explained(error: BaseException) -> tuple[int, str]:
    """Exit code and what to say."""
    from fegear.errors import InputError, file_error
    from lumped.train import TrainError
    from meshes.gmsh_session import MissingSystemLibrary

    if isinstance(error, KeyboardInterrupt):
        return 130, INTERRUPTED
    if isinstance(error, InputError | TrainError):
        return 2, str(error)
    if hasattr(error, "format_message"):  # wrong words, such as an unknown option
        return 2, str(error.format_message())
    if isinstance(error, MissingSystemLibrary):
        return 1, str(error)
    if isinstance(error, OSError):
        _close_full_output()
        return 2, str(file_error(error.filename or "output", "written", error))
    kind = type(error).__name__
    return 1, f"{kind}: {error} (run again with --debug for a traceback)"


def _close_full_output() -> None:
    """So that Python does not try and fail again at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
