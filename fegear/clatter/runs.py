"""Runs of a clattering gearbox: impacts of every wheel, noise, tables and pictures."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.clatter.gearboxes import NamedGearbox
from fegear.errors import InputError, file_error
from fegear.result import Result
from fegear.store import NOTHING, Checkpoint, Keeping
from lumped.clatter.chaos import correlation_dimension, lyapunov_exponent
from lumped.clatter.figure import draw_attractor, draw_motion
from lumped.clatter.gearbox import TEETH, Wheel
from lumped.clatter.groups import Group
from lumped.clatter.maps import follow_map, map_exponent, require_mapped
from lumped.clatter.noise import noise_of
from lumped.clatter.runs import CHUNK, Impacts, State, joined, middle, move, scattered
from lumped.csv_text import exact, format_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fegear.statics import Progress

Array = NDArray[np.float64]
MapKind = Literal["event", "implicit", "fermi"]
MOST_IMPACTS = 20_000_000  # that are kept at a time
PERIODS = 1000  # or impacts of a map, over which an exponent is measured, at most
LEAST_PERIODS = 100
SHOWN = 12  # periods of a plot of the motion


@dataclass(frozen=True, kw_only=True)
class Clatter:
    """Which run is made.

    seconds : from the start; impacts : of a group of wheels, after which it ends sooner
    seed : of a random place in the plays at the start, in the middle of them if None
    kind : the event system, or a map of one wheel
    chaos : whether exponents and dimensions are measured
    """

    seconds: float
    impacts: int = MOST_IMPACTS
    seed: int | None = None
    kind: MapKind = "event"
    chaos: bool = False


@dataclass(frozen=True, eq=False)
class GroupRun:
    """Impacts of wheels that depend on each other, over a time [s].

    end, last_edge : the state from which chaos is measured, and the edge that a map
        has just left there
    """

    group: Group
    impacts: Impacts
    seconds: float
    end: State
    last_edge: int = 0


@dataclass(frozen=True, eq=False, repr=False)
class ClatterResult(Result):
    """Impacts of a gearbox; wheel : the one that is drawn."""

    named: NamedGearbox
    asked: Clatter
    wheel: Wheel
    runs: tuple[GroupRun, ...]

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            **self.named.heading,
            "map": self.asked.kind,
            "wheels": [
                self._wheel(run, wheel)
                for run in self.runs
                for wheel in run.group.wheels
            ],
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        for run in self.runs:
            if run.seconds < self.asked.seconds * (1.0 - 1e-12):
                yield (
                    f"wheel {run.group.wheels[0].name}: ends after {run.seconds:.6g} s "
                    f"and {len(run.impacts)} impacts"
                    f"{self._reason(run)}"
                )

    def _reason(self, run: GroupRun) -> str:
        full = len(run.impacts) >= self.asked.impacts
        return "" if full else ", where it rests on an edge: the map ends there"

    def _wheel(self, run: GroupRun, wheel: Wheel) -> dict[str, Any]:
        noise = noise_of(run.group, run.impacts, run.seconds)
        own = [each for each in noise if each.wheel == wheel.name]
        values: dict[str, Any] = {
            "name": wheel.name,
            "seconds": run.seconds,
            "impacts": sum(each.impacts for each in own),
            "noise_m2_per_s3": sum(each.level for each in own),
            "lost_power_W": sum(each.power for each in own),
            "plays": [
                {
                    "play": each.play,
                    "impacts": each.impacts,
                    "noise_m2_per_s3": each.level,
                    "lost_power_W": each.power,
                    "fastest_m_per_s": each.fastest,
                }
                for each in own
            ],
        }
        if self.asked.chaos:
            values |= self._chaos(run, wheel)
        return values

    def _chaos(self, run: GroupRun, wheel: Wheel) -> dict[str, Any]:
        unit, exponent = self._exponent(run)
        repeats = exponent == -math.inf
        phase, speed, _ = self._teeth(run, wheel)
        dimension, error = math.nan, math.nan
        if not repeats:
            dimension, error = correlation_dimension(phase, speed)
        return {
            f"lyapunov_exponent_per_{unit}": _plain(exponent),
            "forgets_its_start": repeats,
            "correlation_dimension": _plain(dimension),
            "correlation_dimension_error": _plain(error),
        }

    def _exponent(self, run: GroupRun) -> tuple[str, float]:
        """Of events by seconds, of maps by impacts."""
        if self.asked.kind != "event":
            kind, last = self.asked.kind, run.last_edge
            return "impact", map_exponent(run.group, kind, run.end, last, PERIODS)
        periods = int(run.seconds / run.group.excitation.period)
        count = min(max(periods, LEAST_PERIODS), PERIODS)
        return "s", lyapunov_exponent(run.group, run.end, count)

    def _teeth(self, run: GroupRun, wheel: Wheel) -> tuple[Array, Array, Array]:
        """Phases in periods, speeds and edges of impacts of a wheel's teeth."""
        plays = [(each.name, play) for each, play in run.group.plays]
        own = run.impacts.play == plays.index((wheel.name, TEETH))
        turns = run.impacts.time[own] / run.group.excitation.period
        return turns % 1.0, run.impacts.speed[own], run.impacts.edge[own]

    def csv(self) -> str:
        """A row for each contact that was struck, in the order of time."""
        names = [
            *("time_s", "wheel", "play", "edge"),
            *("relative_speed_before_m_per_s", "impulse_Ns", "lost_energy_J"),
        ]
        header = {
            "gearbox": self.named.name,
            "map": self.asked.kind,
            "seconds": exact(self.asked.seconds),
        }
        for number, words in enumerate(self._warnings(), 1):
            header[f"warning {number}"] = words
        return format_csv(names, self._rows(), header)

    def _rows(self) -> Iterator[tuple[object, ...]]:
        return heapq.merge(*map(_rows_of, self.runs), key=lambda row: row[0])

    def draw(self) -> Figure:
        """Plays of the wheel over the first periods of the run."""
        group = self._own.group
        lasts = min(SHOWN * group.excitation.period, self.asked.seconds)
        times = np.linspace(0.0, lasts, 2400)
        start = start_of(group, self.asked.seed)
        return draw_motion(group, self.wheel, start, times, self.named.name)

    def draw_attractor(self) -> Figure:
        """Impacts of the wheel's teeth by phase and speed."""
        return draw_attractor(
            *self._teeth(self._own, self.wheel), f"{self.named.name}: {self.wheel.name}"
        )

    @property
    def _own(self) -> GroupRun:
        return next(run for run in self.runs if self.wheel in run.group.wheels)


def _rows_of(run: GroupRun) -> Iterator[tuple[Any, ...]]:
    names = [(wheel.name, play) for wheel, play in run.group.plays]
    found = run.impacts
    columns = found.time, found.play, found.edge, found.speed, found.impulse, found.lost
    for time, play, edge, *rest in zip(*(c.tolist() for c in columns), strict=True):
        yield time, *names[play], "upper" if edge > 0 else "lower", *rest


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None


def start_of(group: Group, seed: int | None) -> State:
    return middle(group) if seed is None else scattered(group, seed)


def find_clatter(
    named: NamedGearbox,
    asked: Clatter,
    wheel: str | None = None,
    report: Progress = lambda what, done, total: None,
    keeping: Keeping = NOTHING,
) -> ClatterResult:
    """Impacts of every wheel of a gearbox.

    wheel : name of the one that is drawn, the first by default
    keeping : of parts of the run that are finished
    """
    shown = _chosen(named, wheel)
    box = named.gearbox
    if asked.seconds > box.excitation.lasts * (1.0 + 1e-12):
        raise InputError(
            f"seconds = {asked.seconds:g}; the speed file of {named.name} ends after "
            f"{box.excitation.lasts:.9g} s"
        )
    groups = [Group(wheels, box.excitation) for wheels in box.groups]
    if asked.kind != "event":
        return _mapped(named, asked, shown)
    inputs = {
        "gearbox": named.text,
        "seconds": str(asked.seconds),
        "impacts": str(asked.impacts),
        "seed": str(asked.seed),
    }
    checkpoint, done = keeping.open(inputs), False
    try:
        runs = tuple(_run(group, asked, report, checkpoint) for group in groups)
        done = True
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=not done)
    return ClatterResult(named, asked, shown, runs)


def _chosen(named: NamedGearbox, wheel: str | None) -> Wheel:
    wheels = {each.name: each for each in named.gearbox.wheels}
    if wheel is None:
        return named.gearbox.wheels[0]
    if wheel not in wheels:
        names = ", ".join(wheels)
        raise InputError(f"wheel = {wheel}; {named.name} has {names}")
    return wheels[wheel]


def _mapped(named: NamedGearbox, asked: Clatter, wheel: Wheel) -> ClatterResult:
    """By a map, from the first impact of the event system on."""
    group = Group((wheel,), named.gearbox.excitation)
    name = asked.kind
    try:
        require_mapped(group)
    except ValueError as error:
        raise InputError(f"{named.name}: wheel {wheel.name} {error}") from None
    if wheel.driver is not None or name == "event":
        raise InputError(f"{named.name}: wheel {wheel.name} has no map of its own")
    state, first = _first_of_teeth(group, asked)
    parts, count = [first], 1
    while parts[-1].time[-1] <= asked.seconds and count < asked.impacts:
        most, edge = min(CHUNK, asked.impacts - count), int(parts[-1].edge[-1])
        part = follow_map(group, name, state, edge, most)
        if not len(part):
            break
        parts.append(part)
        count += len(part)
    found = joined(parts)
    cut = _first(found, min(int(np.sum(found.time <= asked.seconds)), asked.impacts))
    whole = len(cut) < min(len(found), asked.impacts)
    lasts = asked.seconds if whole else float(cut.time[-1])
    run = GroupRun(group, cut, lasts, state, int(found.edge[-1]))
    return ClatterResult(named, asked, wheel, (run,))


def _first_of_teeth(group: Group, asked: Clatter) -> tuple[State, Impacts]:
    """The first impact of teeth by events, and the state after it."""
    state = start_of(group, asked.seed)
    for part in move(group, state, asked.seconds, most=0):
        if part.play[:1] == 0:  # of the group's order, teeth come first
            return state, _first(part, 1)
    name = group.wheels[0].name
    raise InputError(
        f"seconds = {asked.seconds:g}; teeth of wheel {name} do not meet in this time"
    )


def _first(impacts: Impacts, count: int) -> Impacts:
    return Impacts(*(values[:count] for values in vars(impacts).values()))


def _run(
    group: Group, asked: Clatter, report: Progress, checkpoint: Checkpoint | None
) -> GroupRun:
    name = group.wheels[0].name
    state, parts = _finished(checkpoint, name)
    state = state or start_of(group, asked.seed)
    count, period = sum(map(len, parts)), group.excitation.period
    tell = _teller(report, name, asked)
    tell(count, state.time * period)
    most = min(CHUNK, asked.impacts)
    for part in (
        move(group, state, asked.seconds, most) if count < asked.impacts else ()
    ):
        parts.append(part)
        count += len(part)
        _keep(checkpoint, name, part, state)
        tell(count, state.time * period)
        if count >= asked.impacts:
            break
    impacts, lasts = joined(parts), min(state.time * period, asked.seconds)
    if count >= asked.impacts:
        impacts = _first(impacts, asked.impacts)
        lasts = float(impacts.time[-1])
    return GroupRun(group, impacts, lasts, state)


def _teller(
    report: Progress, name: str, asked: Clatter
) -> Callable[[int, float], None]:
    """Report by what ends the run first."""

    def tell(count: int, time: float) -> None:
        part = max(count / asked.impacts, time / asked.seconds)
        report(f"wheel {name}", round(1000 * min(part, 1.0)), 1000)

    return tell


def _finished(
    checkpoint: Checkpoint | None, name: str
) -> tuple[State | None, list[Impacts]]:
    arrays = None if checkpoint is None else checkpoint.state(name)
    if checkpoint is None or arrays is None:
        return None, []
    kept = checkpoint.finished(name)
    parts = [Impacts(*(np.array(part[n]) for n in part)) for part in kept]
    return State(**arrays), parts


def _keep(
    checkpoint: Checkpoint | None, name: str, part: Impacts, state: State
) -> None:
    if checkpoint is None:
        return
    values = {key: own.tolist() for key, own in vars(part).items()}
    try:
        checkpoint.add(name, values, vars(state))
    except OSError as error:
        raise file_error(checkpoint.path, "written", error) from None
