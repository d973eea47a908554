"""fegear map: a response over a grid of parameters."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import edit_entries, parsed_edits, refuse_idle_edits
from fegear.cli.lumped_options import (
    Damping,
    Excitation,
    Harmonics,
    LoadCase,
    MaxPeriods,
    Method,
    MethodChoice,
    Model,
    Physics,
    Ramp,
    SolvedPlane,
    SolvedResolution,
    Steps,
    Tolerance,
    Translations,
    checked_settings,
    middle_torque,
    speeds_of,
)
from fegear.cli.map_axes import parsed_axes
from fegear.cli.map_report import map_summary, map_warnings, print_map
from fegear.cli.options import (
    AsJson,
    Edits,
    Plot,
    SetName,
    progress_bar,
    refuse_idle,
    require,
    require_outputs,
)
from fegear.cli.screen import complain, print_json, warn
from fegear.cli.systems import (
    excitations_of,
    file_header,
    integration_in_words,
    require_elements_used,
    system_at,
)
from fegear.errors import InputError, file_error

if TYPE_CHECKING:
    import threading

    from fegear.gearset.model import GearSet
    from lumped.maps import Cell, ParameterMap, Point
    from lumped.settings import Settings
    from lumped.system import LumpedSystem

EXAMPLE = "fegear map liu-idler --over mesh.2.phase=0:1:41 --at 1605 --plot map.png"
TORQUE, DAMPING = "torque_Nm", "damping_ratio"  # axes that are no keys of a gear set
SHORT = {DAMPING: "dynamics.damping_ratio"}


def map_command(
    set_name: SetName,
    over: Annotated[
        list[str],
        typer.Option(
            "--over",
            metavar="KEY=A:B:N",
            help="Axis of the map: a key of the gear set, torque_Nm or damping_ratio, "
            "and N values from A to B, or values with commas. Give it twice for two "
            "axes.",
        ),
    ],
    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            metavar="HZ",
            help="Mesh frequency of the first mesh [Hz] at which each point is "
            "settled from rest; this or --band.",
        ),
    ] = None,
    band: Annotated[
        str | None,
        typer.Option(
            "--band",
            metavar="A:B:STEP",
            help="Mesh frequencies of the first mesh [Hz] that each point is swept "
            "over, up and down, for its largest response; this or --at.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the points to this CSV file as they are finished; points that "
            "it holds already are not computed again.",
        ),
    ] = None,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Compute the points in --output anew."),
    ] = False,
    plot: Plot = None,
    edits: Edits = None,
    model: Model = 1,
    torque: LoadCase = None,
    damping: Damping = None,
    translations: Translations = False,
    excitation: Excitation = None,
    ramp: Ramp = None,
    harmonics: Harmonics = None,
    plane: SolvedPlane = None,
    resolution: SolvedResolution = None,
    steps: Steps = None,
    method: Method = MethodChoice.rk4,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    as_json: AsJson = False,
) -> None:
    """Vibration of a lumped train over a grid of parameters.

    The same command goes on with an interrupted map.
    """
    from fegear.gearset import load_gear_set
    from fegear.gearset.edit import require_known_key
    from lumped.maps import ParameterMap

    begin = time.perf_counter()
    require_outputs([output], [set_name], plot)
    if output is None:
        refuse_idle("needs --output", overwrite=overwrite)
    fixed = parsed_edits(edits, torque=torque, damping=damping)
    axes = parsed_axes(over)
    _refuse_overruled({axis.name for axis in axes}, torque, damping, fixed)
    gear_set = load_gear_set(set_name, fixed)
    physics = Physics(
        model=model,
        translations=translations,
        damping=damping,
        excitation=excitation,
        ramp=ramp,
        harmonics=harmonics,
        plane=plane,
        resolution=resolution,
    )
    refuse_idle_edits(fixed, physics)
    settings = checked_settings(method, steps, tolerance, max_periods)
    for axis in axes:
        if axis.name != TORQUE:
            require_known_key(SHORT.get(axis.name, axis.name))
    on_axis = [axis.values for axis in axes if axis.name == TORQUE]
    load = max(on_axis[0]) if on_axis else middle_torque(gear_set, torque)
    excitations = excitations_of(physics, gear_set)
    first = system_at(gear_set, load, physics, excitations)
    require_elements_used(physics, excitations)
    words = integration_in_words(settings)
    header = file_header(gear_set, physics, words, first.train.damping_ratio)
    header |= {"model": str(model)}
    if {DAMPING, SHORT[DAMPING]} & {axis.name for axis in axes}:
        del header["damping ratio"]
    if not on_axis:
        header |= {"torque on the input gear [N m]": f"{load:g}"}
    header |= edit_entries(fixed) | {"digest of the gear set": digest(gear_set)}
    where, evaluate = _evaluation(at, band, settings)
    grid = ParameterMap(axes, len(gear_set.meshes), header | {"response": where})
    found = grid if overwrite else _taken_up(grid, output)

    def build(point: Point) -> LumpedSystem:
        values = {
            axis.name: int(v) if v.is_integer() else v
            for axis, v in zip(axes, point, strict=True)
        }
        on_input = values.pop(TORQUE, load)
        changed = fixed | {SHORT.get(name, name): v for name, v in values.items()}
        varied = load_gear_set(set_name, changed)
        return system_at(varied, on_input, physics, excitations)

    with progress_bar(enabled=not as_json) as report:
        found = _run(found, build, evaluate, output, report)
    reasons = {cell.status for cell in found.cells.values()}
    if all(reason.startswith("impossible") for reason in reasons):
        raise InputError(f"no point of the map is possible: {min(reasons)[12:]}")
    values = map_summary(found, where)
    values["warnings"] = list(map_warnings(found, gear_set))
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    _draw(found, plot)
    if as_json:
        print_json(values)
    else:
        print_map(values)
    warn(values["warnings"])


def _refuse_overruled(
    names: set[str],
    torque: float | None,
    damping: float | None,
    edits: Mapping[str, Any],
) -> None:
    """What an axis varies cannot be fixed as well."""
    if TORQUE in names:
        refuse_idle(f"--over {TORQUE} replaces it, leave it out", torque=torque)
    if {DAMPING, SHORT[DAMPING]} & names:
        refuse_idle(f"--over {DAMPING} replaces it, leave it out", damping=damping)
    for name in {SHORT.get(name, name) for name in names} & edits.keys():
        raise InputError(f"--set {name}; --over varies it, leave it out")


def digest(gear_set: GearSet) -> str:
    """Tells gear sets apart that have one name, such as a file that was edited."""
    import hashlib

    return hashlib.sha256(repr(gear_set).encode()).hexdigest()[:16]


def _evaluation(
    at: float | None, band: str | None, settings: Settings
) -> tuple[str, Callable[[LumpedSystem, threading.Event], Cell | None]]:
    """What is asked of every point, in words and as a function."""
    from lumped.confirmed import respond_confirmed
    from lumped.maps import cell_of
    from lumped.sweep import sweep

    if (at is None) == (band is None):
        raise InputError("--at HZ or --band A:B:STEP is needed, not both")
    if at is not None:
        require(0.0 < at < 1e9, "--at", at, "must be above 0 and below 1e9 Hz")
        return (
            f"at {at:g} Hz of the first mesh, from rest",
            lambda system, stop: cell_of([respond_confirmed(system, at, settings)[0]]),
        )
    assert band is not None
    speeds = speeds_of(band, "--band")

    def over_band(system: LumpedSystem, stop: threading.Event) -> Cell | None:
        branches = [
            sweep(system, speeds, direction, settings, stop=stop)
            for direction in ("up", "down")
        ]
        if stop.is_set():
            return None
        return cell_of([r for branch in branches for r in branch.responses])

    return f"largest over {band} Hz of the first mesh, up and down", over_band


def _taken_up(grid: ParameterMap, output: Path | None) -> ParameterMap:
    """The map with the points that its file holds already."""
    from lumped.maps import MapError, read_cells

    if output is None or not output.is_file() or not output.stat().st_size:
        return grid
    try:
        return replace(grid, cells=read_cells(output, grid))
    except MapError as error:
        raise InputError(f"{error}; choose another -o or --overwrite") from None


def _run(
    grid: ParameterMap,
    build: Callable[[Point], LumpedSystem],
    evaluate: Callable[[LumpedSystem, threading.Event], Cell | None],
    output: Path | None,
    report: Callable[[str, int, int], None],
) -> ParameterMap:
    """Compute what is missing; the file grows point by point and ends in order."""
    from fegear.output import write_text
    from lumped.maps import format_cell, format_map, run_map

    def tell(done: int, total: int) -> None:
        report("points", done, total)

    if output is None:
        return run_map(grid, build, evaluate, report=tell)
    write_text(output, format_map(grid))  # mends a torn last line
    kept = len(grid.cells)

    def keep(point: Point, cell: Cell) -> None:
        nonlocal kept
        text = format_cell(point, cell)
        try:  # closed each time, so that a full disk is told here and only here
            with open(output, "a", encoding="utf-8", newline="") as file:
                file.write(text)
        except OSError as error:
            raise file_error(output, "written", error) from None
        kept += 1

    try:
        found = run_map(grid, build, evaluate, keep, tell)
    except KeyboardInterrupt:
        complain(
            f"{kept} of {len(grid.points)} points are in {output}; the same command "
            "goes on from there"
        )
        raise
    write_text(output, format_map(found))
    return found


def _draw(found: ParameterMap, plot: Path | None) -> None:
    if plot is None:
        return
    from fegear.output import write_whole
    from fegear.plots import save_figure
    from lumped.map_figure import draw_map

    write_whole(plot, lambda path: save_figure(draw_map(found), path))
