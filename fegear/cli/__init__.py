"""The command line: a file per command, everything heavy imported where used."""

from __future__ import annotations

import os
import sys

import typer

from fegear.cli.bench import bench_app
from fegear.cli.compare import compare_command
from fegear.cli.dynamics import dynamics_command
from fegear.cli.identify import identify_command
from fegear.cli.map import map_command
from fegear.cli.mesh import mesh_command
from fegear.cli.modes import modes_command
from fegear.cli.render import render_command
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
    """Entry point; wrong input ends with one line and exit code 2."""
    # The matrices are small: threads gain nothing, and on a busy machine they wait
    # for each other twenty times as long as the work takes.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    debug = "--debug" in sys.argv
    arguments = [word for word in sys.argv[1:] if word != "--debug"] or ["--help"]
    try:
        code = app(arguments, standalone_mode=False) or 0
    except KeyboardInterrupt:
        _end(INTERRUPTED, 130, debug)
    except BrokenPipeError:  # the reader of a pipe has gone, such as `head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        _end(*_explained(error), debug)
    else:
        if code == 130:  # Ctrl-C, turned into a code below
            sys.stderr.write(f"fegear: {INTERRUPTED}\n")
        sys.exit(code)


def _explained(error: Exception) -> tuple[str, int]:
    from fegear.errors import InputError
    from lumped.train import TrainError
    from meshes.gmsh_session import MissingSystemLibrary

    if isinstance(error, InputError | TrainError):
        return str(error), 2
    if hasattr(error, "format_message"):  # wrong words, such as an unknown option
        return str(error.format_message()), 2
    if isinstance(error, MissingSystemLibrary):
        return str(error), 1
    kind = type(error).__name__
    return f"{kind}: {error} (run again with --debug for a traceback)", 1


def _end(message: str, code: int, debug: bool) -> None:
    if debug:
        raise
    sys.stderr.write(f"fegear: {' '.join(message.split())}\n")
    sys.exit(code)
