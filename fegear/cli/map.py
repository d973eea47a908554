"""fegear map: a response over a grid of parameters."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped
from fegear.cli.lumped_options import (
    Integration,
    LoadCase,
    LumpedOptions,
    middle_torque,
    speeds_of,
)
from fegear.cli.map_axes import parsed_axes
from fegear.cli.map_report import map_summary, map_warnings, print_map
from fegear.cli.options import (
    AsJson,
    Plot,
    progress_bar,
    refuse_idle,
    require,
    require_outputs,
    save_plot,
    show,
)
from fegear.cli.screen import complain
from fegear.errors import InputError, file_error

if TYPE_CHECKING:
    import threading

    from matplotlib.figure import Figure

    from fegear.excitation import ExcitationSource
    from fegear.gearset.model import GearSet
    from fegear.lumped_system import LumpedModel
    from lumped.maps import Axis, Cell, ParameterMap, Point
    from lumped.settings import Settings
    from lumped.system import LumpedSystem

    Evaluate = Callable[[LumpedSystem, threading.Event], Cell | None]

EXAMPLE = "fegear map liu-idler --over mesh.2.phase=0:1:41 --at 1605 --plot map.png"
TORQUE, DAMPING = "torque_Nm", "damping_ratio"  # axes that are no keys of a gear set
SHORT = {DAMPING: "dynamics.damping_ratio"}


@dataclass(frozen=True, kw_only=True)
class Response:
    """What is asked of every point."""

    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            metavar="HZ",
            help="Mesh frequency of the first mesh [Hz] at which each point is "
            "settled from rest; this or --band.",
        ),
    ] = None
    band: Annotated[
        str | None,
        typer.Option(
            "--band",
            metavar="A:B:STEP",
            help="Mesh frequencies of the first mesh [Hz] that each point is swept "
            "over, up and down, for its largest response; this or --at.",
        ),
    ] = None

    def __post_init__(self) -> None:
        if (self.at is None) == (self.band is None):
            raise InputError("--at HZ or --band A:B:STEP is needed, not both")
        if self.at is not None:
            ok = 0.0 < self.at < 1e9
            require(ok, "--at", self.at, "must be above 0 and below 1e9 Hz")

    @property
    def words(self) -> str:
        if self.at is not None:
            return f"at {self.at:g} Hz of the first mesh, from rest"
        return f"largest over {self.band} Hz of the first mesh, up and down"

    def evaluation(self, settings: Settings) -> Evaluate:
        """The response of a system, None where it was stopped."""
        from lumped.maps import cell_of
        from lumped.respond import respond_confirmed
        from lumped.sweep import sweep

        if self.at is not None:
            at = self.at
            return lambda system, stop: cell_of(
                [respond_confirmed(system, at, settings)[0]]
            )
        speeds = speeds_of(self.band or "", "--band")

        def over_band(system: LumpedSystem, stop: threading.Event) -> Cell | None:
            branches = [
                sweep(system, speeds, direction, settings, stop=stop)
                for direction in ("up", "down")
            ]
            if stop.is_set():
                return None
            return cell_of([r for branch in branches for r in branch.responses])

        return over_band


@dataclass(frozen=True, kw_only=True)
class MapOutputs:
    """Where the map goes; its points are kept as they are finished."""

    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the points to this CSV file as they are finished; points that "
            "it holds already are not computed again.",
        ),
    ] = None
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Compute the points in --output anew."),
    ] = False
    plot: Plot = None
    as_json: AsJson = False

    def __post_init__(self) -> None:
        if self.output is None:
            refuse_idle("needs --output", overwrite=self.overwrite)


@grouped
def map_command(
    *,
    subject: EditedSet,
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
    response: Response,
    outputs: MapOutputs,
    torque: LoadCase = None,
    model: LumpedOptions,
    integration: Integration,
) -> None:
    """Vibration of a lumped train over a grid of parameters.

    The same command goes on with an interrupted map.
    """
    begin = time.perf_counter()
    require_outputs([outputs.output], [subject.set_name], outputs.plot)
    axes = parsed_axes(over)
    _refuse_overruled({axis.name for axis in axes}, torque, model.train.damping)
    gear_set, fixed = model.load(subject, torque)
    varied = _varied(subject.set_name, gear_set, axes, fixed, torque)
    evaluate = response.evaluation(integration.settings)
    description = model.lumped_model(gear_set)
    excitations = description.excitations
    grid = varied.grid(description, excitations, integration.settings, response.words)
    found = grid if outputs.overwrite else _taken_up(grid, outputs.output)
    build = partial(varied.system, description, excitations)
    with progress_bar(enabled=not outputs.as_json) as report:
        found = _run(found, build, evaluate, outputs.output, report)
    reasons = {cell.status for cell in found.cells.values()}
    if all(reason.startswith("impossible") for reason in reasons):
        raise InputError(f"no point of the map is possible: {min(reasons)[12:]}")
    values = map_summary(found, response.words)
    values["warnings"] = list(map_warnings(found, gear_set))
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    save_plot(outputs.plot, partial(_figure, found))
    show(values, outputs.as_json, print_map)


@dataclass(frozen=True)
class Varied:
    """A gear set whose figures the axes of a map vary.

    gear_set : with what is fixed, `fixed`; load : torque on the input gear where no
        axis varies it [N m]
    """

    set_name: str
    gear_set: GearSet
    axes: tuple[Axis, ...]
    fixed: Mapping[str, Any]
    load: float

    @property
    def names(self) -> set[str]:
        return {axis.name for axis in self.axes}

    def system(
        self, model: LumpedModel, excitations: ExcitationSource, point: Point
    ) -> LumpedSystem:
        """The lumped system of a point."""
        from fegear.gearset import load_gear_set
        from fegear.lumped_system import lumped_system

        values = {
            axis.name: int(v) if v.is_integer() else v
            for axis, v in zip(self.axes, point, strict=True)
        }
        torque = values.pop(TORQUE, self.load)
        changed = {SHORT.get(name, name): value for name, value in values.items()}
        gear_set = load_gear_set(self.set_name, {**self.fixed, **changed})
        return lumped_system(gear_set, torque, model, excitations)

    def grid(
        self,
        model: LumpedModel,
        excitations: ExcitationSource,
        settings: Settings,
        response: str,
    ) -> ParameterMap:
        """The map without its points; refuses a gear set that gives no system."""
        from fegear.lumped_system import (
            file_header,
            integration_in_words,
            lumped_system,
        )
        from lumped.maps import ParameterMap

        first = lumped_system(self.gear_set, self.load, model, excitations)
        ratio, words = first.train.damping_ratio, integration_in_words(settings)
        header = file_header(self.gear_set, model, ratio, words)
        header |= {"model": str(model.number)}
        if {DAMPING, SHORT[DAMPING]} & self.names:
            del header["damping ratio"]
        if TORQUE not in self.names:
            header |= {"torque on the input gear [N m]": f"{self.load:g}"}
        header |= edit_entries(self.fixed)
        header |= {"digest of the gear set": digest(self.gear_set)}
        meshes = len(self.gear_set.meshes)
        return ParameterMap(self.axes, meshes, header | {"response": response})


def _varied(
    set_name: str,
    gear_set: GearSet,
    axes: tuple[Axis, ...],
    fixed: Mapping[str, Any],
    torque: float | None,
) -> Varied:
    """Checks that every axis is known and none is fixed as well."""
    from fegear.gearset.edit import require_known_key

    for axis in axes:
        key = SHORT.get(axis.name, axis.name)
        if key in fixed:
            raise InputError(f"--set {key}; --over varies it, leave it out")
        if axis.name != TORQUE:
            require_known_key(key)
    on_axis = [axis.values for axis in axes if axis.name == TORQUE]
    load = max(on_axis[0]) if on_axis else middle_torque(gear_set, torque)
    return Varied(set_name, gear_set, axes, fixed, load)


def _refuse_overruled(
    names: set[str], torque: float | None, damping: float | None
) -> None:
    """What an axis varies cannot be given by an option as well."""
    if TORQUE in names:
        refuse_idle(f"--over {TORQUE} replaces it, leave it out", torque=torque)
    if {DAMPING, SHORT[DAMPING]} & names:
        refuse_idle(f"--over {DAMPING} replaces it, leave it out", damping=damping)


def digest(gear_set: GearSet) -> str:
    """Tells gear sets apart that have one name, such as a file that was edited."""
    import hashlib

    return hashlib.sha256(repr(gear_set).encode()).hexdigest()[:16]


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


def _figure(found: ParameterMap) -> Figure:
    from lumped.map_figure import draw_map

    return draw_map(found)
