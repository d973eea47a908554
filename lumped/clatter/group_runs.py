"""Runs of wheels that depend on each other, by events or by a map of their teeth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lumped.clatter.chaos import lyapunov_exponent
from lumped.clatter.gearbox import TEETH, LooseWheel
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import CHUNK, Impacts, State, join_impacts, simulate
from lumped.clatter.maps import MapName, follow_map, map_exponent, require_mapped
from lumped.common.array_types import Array

MapKind = Literal["event", "implicit", "fermi"]
# Most periods, or impacts of a map, over which an exponent is measured
MAX_PERIODS = 1000
MIN_PERIODS = 100


@dataclass(frozen=True, eq=False)
class GroupRun:
    """Impacts of wheels that depend on each other, over a time [s].

    end, last_edge : state from which chaos is measured, and the edge that a map has
        just left there
    """

    group: WheelGroup
    impacts: Impacts
    seconds: float
    end: State
    last_edge: int = 0

    @property
    def name(self) -> str:
        """Name of the first wheel."""
        return self.group.wheels[0].name

    def exponent(self, kind: MapKind) -> tuple[str, float]:
        """Unit and largest Lyapunov exponent, per second or per impact of a map."""
        if kind != "event":
            last = self.last_edge
            return "impact", map_exponent(self.group, kind, self.end, last, MAX_PERIODS)
        periods = int(self.seconds / self.group.excitation.period)
        count = min(max(periods, MIN_PERIODS), MAX_PERIODS)
        return "s", lyapunov_exponent(self.group, self.end, count)

    def teeth(self, wheel: LooseWheel) -> tuple[Array, Array, Array]:
        """Phases in periods, speeds and edges of impacts of a wheel's teeth."""
        plays = [(owner.name, play) for owner, play in self.group.plays]
        tooth_impacts = self.impacts.play == plays.index((wheel.name, TEETH))
        turns = self.impacts.time[tooth_impacts] / self.group.excitation.period
        speed, edge = (
            self.impacts.speed[tooth_impacts],
            self.impacts.edge[tooth_impacts],
        )
        return turns % 1.0, speed, edge


def run_events(
    group: WheelGroup,
    state: State,
    seconds: float,
    max_impacts: int,
    previous_impacts: Sequence[Impacts] = (),
    callback: Callable[[Impacts, int], None] = lambda part, count: None,
) -> GroupRun:
    """Compute all impacts until a time [s] or up to a number of impacts.

    state : initial state, which is advanced
    previous_impacts : impacts before it
    callback : function called after each part with it and the number of impacts so far
    """
    parts, count = list(previous_impacts), sum(map(len, previous_impacts))
    parts_to_come = simulate(group, state, seconds, min(CHUNK, max_impacts))
    while count < max_impacts and (part := next(parts_to_come, None)) is not None:
        parts.append(part)
        count += len(part)
        callback(part, count)
    impacts = join_impacts(parts)
    duration = min(state.time * group.excitation.period, seconds)
    if count >= max_impacts:
        impacts = _first_impacts(impacts, max_impacts)
        duration = float(impacts.time[-1])
    return GroupRun(group, impacts, duration, state)


def run_map(
    group: WheelGroup, name: MapName, state: State, seconds: float, max_impacts: int
) -> GroupRun:
    """Compute impacts of one wheel by a map, after a first impact by events.

    Raises ValueError for wheels that have no map, or whose teeth do not meet.
    """
    require_mapped(group)
    if group.wheels[0].driver is not None:
        raise ValueError("has no map of its own")
    parts = [_first_tooth_impact(group, state, seconds)]
    count = 1
    while parts[-1].time[-1] <= seconds and count < max_impacts:
        edge = int(parts[-1].edge[-1])
        part = follow_map(group, name, state, edge, min(CHUNK, max_impacts - count))
        if not len(part):
            break
        parts.append(part)
        count += len(part)
    impacts = join_impacts(parts)
    cut = _first_impacts(
        impacts, min(int(np.sum(impacts.time <= seconds)), max_impacts)
    )
    is_complete = len(cut) < min(len(impacts), max_impacts)
    duration = seconds if is_complete else float(cut.time[-1])
    return GroupRun(group, cut, duration, state, int(impacts.edge[-1]))


def _first_tooth_impact(group: WheelGroup, state: State, seconds: float) -> Impacts:
    """First impact of teeth by events; the state is advanced to it."""
    for part in simulate(group, state, seconds, max_impacts=0):
        if part.play[:1] == 0:  # in the order of the group, teeth come first
            return _first_impacts(part, 1)
    raise ValueError(f"has teeth that do not meet in {seconds:g} s")


def _first_impacts(impacts: Impacts, count: int) -> Impacts:
    return Impacts(*(values[:count] for values in vars(impacts).values()))


def is_superstable(exponent: float) -> bool:
    """Whether a wheel in contact loses the memory of its initial state."""
    return exponent == -math.inf
