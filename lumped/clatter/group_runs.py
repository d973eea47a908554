"""Runs of wheels that depend on each other, by events or by a map of their teeth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lumped.clatter.chaos import lyapunov_exponent
from lumped.clatter.gearbox import TEETH, LooseWheel
from lumped.clatter.groups import WheelGroup
from lumped.clatter.maps import MapName, follow_map, map_exponent, require_mapped
from lumped.clatter.runs import CHUNK, Impacts, State, joined, simulate

Array = NDArray[np.float64]
MapKind = Literal["event", "implicit", "fermi"]
PERIODS = 1000  # most periods, or impacts of a map, over which an exponent is measured
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
            return "impact", map_exponent(self.group, kind, self.end, last, PERIODS)
        periods = int(self.seconds / self.group.excitation.period)
        count = min(max(periods, MIN_PERIODS), PERIODS)
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
    most: int,
    before: Sequence[Impacts] = (),
    passed: Callable[[Impacts, int], None] = lambda part, count: None,
) -> GroupRun:
    """Compute all impacts until a time [s] or up to a number of impacts.

    state : initial state, which is advanced
    before : number of impacts before it
    passed : function called after each part with it and the number of impacts so far
    """
    parts, count = list(before), sum(map(len, before))
    parts_to_come = simulate(group, state, seconds, min(CHUNK, most))
    while count < most and (part := next(parts_to_come, None)) is not None:
        parts.append(part)
        count += len(part)
        passed(part, count)
    impacts = joined(parts)
    lasts = min(state.time * group.excitation.period, seconds)
    if count >= most:
        impacts = _first(impacts, most)
        lasts = float(impacts.time[-1])
    return GroupRun(group, impacts, lasts, state)


def run_map(
    group: WheelGroup, name: MapName, state: State, seconds: float, most: int
) -> GroupRun:
    """Compute impacts of one wheel by a map, after a first impact by events.

    Raises ValueError for wheels that have no map, or whose teeth do not meet.
    """
    require_mapped(group)
    if group.wheels[0].driver is not None:
        raise ValueError("has no map of its own")
    parts = [_first_of_teeth(group, state, seconds)]
    count = 1
    while parts[-1].time[-1] <= seconds and count < most:
        edge = int(parts[-1].edge[-1])
        part = follow_map(group, name, state, edge, min(CHUNK, most - count))
        if not len(part):
            break
        parts.append(part)
        count += len(part)
    impacts = joined(parts)
    cut = _first(impacts, min(int(np.sum(impacts.time <= seconds)), most))
    is_complete = len(cut) < min(len(impacts), most)
    lasts = seconds if is_complete else float(cut.time[-1])
    return GroupRun(group, cut, lasts, state, int(impacts.edge[-1]))


def _first_of_teeth(group: WheelGroup, state: State, seconds: float) -> Impacts:
    """First impact of teeth by events; the state is advanced to it."""
    for part in simulate(group, state, seconds, most=0):
        if part.play[:1] == 0:  # in the order of the group, teeth come first
            return _first(part, 1)
    raise ValueError(f"has teeth that do not meet in {seconds:g} s")


def _first(impacts: Impacts, count: int) -> Impacts:
    return Impacts(*(values[:count] for values in vars(impacts).values()))


def is_superstable(exponent: float) -> bool:
    """Whether a wheel in contact loses the memory of its initial state."""
    return exponent == -math.inf
