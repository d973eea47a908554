"""Vibration of a gear set's lumped train over a grid of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from fegear.errors import InputError, file_error
from fegear.excitation import ExcitationSource
from fegear.gearset import GearSet, load_gear_set
from fegear.lumped_models import (
    LumpedModel,
    body_entries,
    file_header,
    integration_in_words,
    lumped_system,
    require_method,
)
from fegear.output import write_text
from fegear.unphysical import doubts_of_meshes
from lumped.csv_text import exact
from lumped.maps import (
    Axis,
    Cell,
    MapError,
    ParameterMap,
    Point,
    cell_of,
    format_cell,
    format_map,
    read_cells,
    run_map,
)
from lumped.progress import Progress, silent
from lumped.respond import respond_confirmed
from lumped.settings import Settings
from lumped.sweep import BOTH, Direction, sweep
from lumped.system import LumpedSystem
from lumped.workers import Cluster, NoClusterError, Stop

Evaluate = Callable[[LumpedSystem, Stop], Cell | None]
TORQUE, DAMPING = "torque_Nm", "damping_ratio"  # axes that are no keys of a gear set,
FRICTION, BENDING = "friction", "friction_bending"  # of teeth, the same of all meshes
ENTRIES = {FRICTION: "friction coefficient", BENDING: "friction-bending ratio"}
OF_TEETH = {FRICTION: "friction", BENDING: "bending"}  # fields of a lumped model
SHORT = {DAMPING: "dynamics.damping_ratio"}


@dataclass(frozen=True)
class VariedSet:
    """A gear set whose figures the axes of a map vary.

    gear_set : with what is fixed, `fixed`, by key
    load : torque on the input gear where no axis varies it [N m]
    """

    set_name: str
    gear_set: GearSet
    axes: tuple[Axis, ...]
    load: float
    model: LumpedModel
    fixed: Mapping[str, Any] = field(default_factory=dict)
    speeds: Sequence[float] = ()

    def _first(self, model: LumpedModel) -> LumpedSystem:
        return lumped_system(
            self.gear_set, self.load, model, self.excitations, self.speeds
        )

    @cached_property
    def _alike(self) -> LumpedSystem | None:
        """Whose body modes all points have: they are then of one family."""
        coupled = self.model.number == "coupled"
        return self._first(self.model) if coupled else None

    @cached_property
    def excitations(self) -> ExcitationSource:
        """One for all points, whose tables are solved once each."""
        return self.model.excitations

    def system(self, point: Point) -> LumpedSystem:
        """The lumped system of a point."""
        values = {
            axis.name: int(v) if v.is_integer() else v
            for axis, v in zip(self.axes, point, strict=True)
        }
        torque = values.pop(TORQUE, self.load)
        own = OF_TEETH.keys() & values.keys()
        of_teeth: dict[str, Any] = {OF_TEETH[name]: values.pop(name) for name in own}
        try:
            model = replace(self.model, **of_teeth)
        except ValueError as error:
            raise InputError(str(error)) from None
        changed = {SHORT.get(name, name): value for name, value in values.items()}
        gear_set = self._loaded(tuple(changed.items()))
        return lumped_system(
            *(gear_set, torque, model, self.excitations),
            *(self.speeds, self._alike),
        )

    @cached_property
    def _loaded(self) -> Callable[[tuple[tuple[str, float], ...]], GearSet]:
        """The gear set with other values of keys; the last one is kept."""

        def loaded(changed: tuple[tuple[str, float], ...]) -> GearSet:
            return load_gear_set(self.set_name, {**self.fixed, **dict(changed)})

        return lru_cache(maxsize=1)(loaded)

    def grid(self, settings: Settings, entries: dict[str, str]) -> ParameterMap:
        """The map without its points; refuses a gear set that gives no system.

        entries : added to its header
        """
        require_method(self.model, settings)
        header = self.header(
            integration_in_words(settings, self.model.number == "coupled")
        )
        if TORQUE not in self.names:
            header |= {"torque on the input gear [N m]": exact(self.load)}
        return ParameterMap(self.axes, len(self.gear_set.meshes), header | entries)

    @property
    def names(self) -> set[str]:
        """Of the axes."""
        return {axis.name for axis in self.axes}

    @property
    def inputs(self) -> dict[str, str]:
        """What tells it from others that have the same header."""
        fixed = {f"--set {key}": repr(value) for key, value in self.fixed.items()}
        return fixed | {"digest of the gear set": digest(self.gear_set)}

    def header(self, integration: str) -> dict[str, str]:
        """Entries of a file without what the axes vary; see `file_header`."""
        model = self.model
        if BENDING in self.names:
            model = replace(model, bending=0.0)  # no mesh table need have it
        first = self._first(model)
        ratio = first.train.damping_ratio
        described = replace(self.model, friction=self._largest_friction)
        header = file_header(self.gear_set, described, ratio, integration)
        if self.speeds:
            header |= body_entries(first, self.speeds)
        if {DAMPING, SHORT[DAMPING]} & self.names:
            del header["damping ratio"]
        for name, entry in ENTRIES.items():
            if name in self.names:
                header.pop(entry, None)
        return header | {"model": self.model.name}

    @property
    def _largest_friction(self) -> float:
        """Of all points: how teeth rub is told unless none of them does."""
        of_axes = (max(axis.values) for axis in self.axes if axis.name == FRICTION)
        return next(of_axes, self.model.friction)


def digest(gear_set: GearSet) -> str:
    """Tells gear sets apart that have one name, such as a file that was edited."""
    return sha256(repr(gear_set).encode()).hexdigest()[:16]


def respond_at(frequency: float, settings: Settings) -> Evaluate:
    """The response at a frequency of the first mesh [Hz], from rest."""
    return partial(_response_at, frequency, settings)


def _response_at(
    frequency: float, settings: Settings, system: LumpedSystem, stop: Stop
) -> Cell:
    return cell_of([respond_confirmed(system, frequency, settings)[0]])


def respond_over(
    frequencies: Sequence[float],
    settings: Settings,
    directions: Sequence[Direction] = BOTH,
) -> Evaluate:
    """The largest response of sweeps [Hz], None where they were stopped."""
    return partial(_response_over, tuple(frequencies), settings, tuple(directions))


def _response_over(
    frequencies: Sequence[float],
    settings: Settings,
    directions: Sequence[Direction],
    system: LumpedSystem,
    stop: Stop,
) -> Cell | None:
    branches = [
        sweep(system, frequencies, direction, settings, stop=stop)
        for direction in directions
    ]
    if stop.is_set():
        return None
    return cell_of([r for branch in branches for r in branch.responses])


def take_up(grid: ParameterMap, path: Path | None) -> ParameterMap:
    """The map with the points that its file holds already."""
    if path is None or not path.is_file() or not path.stat().st_size:
        return grid
    try:
        return replace(grid, cells=read_cells(path, grid))
    except MapError as error:
        raise InputError(str(error)) from None


def compute_map(
    grid: ParameterMap,
    varied: VariedSet,
    evaluate: Evaluate,
    path: Path | None = None,
    progress: Progress = silent,
    tell: Callable[[str], None] = lambda message: None,
    workers: Cluster | None = None,
) -> ParameterMap:
    """Compute what is missing; the file grows point by point and ends in order.

    tell : called with what the file holds after Ctrl-C
    workers : that compute points; threads, one a core, where there are none
    Raises InputError where no point is possible or a cluster cannot be used.
    """

    def report(done: int, total: int) -> None:
        progress("points", done, total)

    if path is None:
        try:
            found = run_map(
                grid, varied.system, evaluate, report=report, workers=workers
            )
        except NoClusterError as error:
            raise InputError(str(error)) from None
        return _require_possible(found)
    write_text(path, format_map(grid))  # mends a torn last line
    kept = len(grid.cells)

    def keep(point: Point, cell: Cell) -> None:
        nonlocal kept
        text = format_cell(point, cell)
        try:  # closed each time, so that a full disk is told here and only here
            with open(path, "a", encoding="utf-8", newline="") as file:
                file.write(text)
        except OSError as error:
            raise file_error(path, "written", error) from None
        kept += 1

    try:
        found = run_map(grid, varied.system, evaluate, keep, report, workers)
    except NoClusterError as error:
        raise InputError(str(error)) from None
    except KeyboardInterrupt:
        tell(
            f"{kept} of {len(grid.points)} points are in {path}; the same map "
            "goes on from there"
        )
        raise
    write_text(path, format_map(found))
    return _require_possible(found)


def _require_possible(found: ParameterMap) -> ParameterMap:
    reasons = {cell.status for cell in found.cells.values()}
    if all(reason.startswith("impossible") for reason in reasons):
        raise InputError(f"no point of the map is possible: {min(reasons)[12:]}")
    return found


def summarise_map(found: ParameterMap, gear_set: GearSet) -> dict[str, Any]:
    """Smallest and largest vibration of every mesh, where, and doubts about them."""

    statuses = [cell.status.partition(":")[0] for cell in found.cells.values()]
    names = [axis.name for axis in found.axes]
    extremes = []
    for mesh in range(found.meshes):
        rms = found.on_grid("dte_rms_m", mesh).ravel()
        for kind, pick in (("smallest", np.nanargmin), ("largest", np.nanargmax)):
            if np.isnan(rms).all():
                continue
            place = int(pick(rms))
            extremes.append(
                {
                    "mesh": mesh + 1,
                    "extreme": kind,
                    "dte_rms_m": float(rms[place]),
                    "at": dict(zip(names, found.points[place], strict=True)),
                }
            )
    return {
        "gear_set": found.header["gear set"],
        "excitation": found.header["excitation"],
        "response": found.header["response"],
        "points": len(found.points),
        "statuses": {
            status: statuses.count(status) for status in sorted(set(statuses))
        },
        "reasons": sorted(
            {c.status for c in found.cells.values() if c.status.startswith("imp")}
        ),
        "extremes": extremes,
        "warnings": list(_map_warnings(found, gear_set)),
    }


def _map_warnings(found: ParameterMap, gear_set: GearSet) -> Iterator[str]:
    """What changes nothing, and where the largest values cannot be physical."""
    for place, axis in enumerate(found.axes):
        if len(axis.values) > 1 and _changes_nothing(found, place):
            yield f"{axis.name} does not change the response"
    peaks, backs = (
        [
            float(np.fmax.reduce(found.on_grid(name, m), axis=None))
            for m in range(found.meshes)
        ]
        for name in ("dte_peak_m", "back_side_fraction")
    )
    where = ", at its worst point"
    yield from doubts_of_meshes(gear_set.meshes, where, peaks, backs)


def _changes_nothing(found: ParameterMap, place: int) -> bool:
    """Whether all vibrations along an axis are the same, to the bit."""
    if len(found.cells) < len(found.points):
        return False
    sizes = [found.on_grid("dte_rms_m", m) for m in range(found.meshes)]
    return all(
        np.array_equal(rms, np.take(rms, [0], place).repeat(rms.shape[place], place))
        for rms in sizes
    )
