"""Runs of a gearbox: impacts in the order of time, their noise, and the last state."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from lumped.clatter.groups import WheelGroup
from lumped.clatter.kernels import events
from lumped.clatter.kernels.contact import N_TERMS
from lumped.clatter.kernels.group_arrays import (
    RECORD_COLUMNS,
    GroupArrays,
    new_workspace,
)
from lumped.common.array_types import Array

CHUNK = 50_000  # impacts that are computed at a time


class LostMotion(ArithmeticError):
    """Raised if the next event of a motion is not found."""


@dataclass(eq=False)
class State:
    """State of the wheels of a group, with times in periods and lengths in metres.

    clock : (2,) whole periods and the fraction of one
    q, v : (n,) coordinates and velocities
    held : (p,) edge of each play in sustained contact, otherwise 0, as in `GroupArrays`
    """

    clock: Array
    q: Array
    v: Array
    held: NDArray[np.int64]

    @property
    def time(self) -> float:
        """Time in periods."""
        return float(self.clock.sum())

    def copy(self) -> State:
        return State(*(array.copy() for array in vars(self).values()))


def centred_state(group: WheelGroup) -> State:
    """State in the middle of every play, at rest."""
    return _state_at(group, np.full(len(group.plays), 0.5))


def random_state(group: WheelGroup, seed: int) -> State:
    """State at rest at random positions in the plays."""
    random = np.random.default_rng(seed)
    return _state_at(group, random.uniform(0.05, 0.95, len(group.plays)))


def _state_at(group: WheelGroup, fractions: Array) -> State:
    """State at rest, at fractions of the plays from their lower edges."""
    n, start = len(group.plays), np.zeros(1)
    e = float(group.excitation.at(start)[0])
    shifts = (fractions - 1.0) * group.widths(start)[0] - group.ratios * e
    q: Array = np.linalg.solve(group.rows, shifts).astype(np.float64)
    held = np.zeros(group.box.low.size, np.int64)
    return State(np.zeros(2), q, np.zeros(n), held)


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of a group, with one entry for each contact that is struck.

    time : [s]
    play : index among the group's plays
    edge : 1 for the upper edge, -1 for the lower one
    speed : approach speed [m/s]
    impulse : [N s]
    lost : dissipated energy [J]
    """

    time: Array
    play: NDArray[np.int64]
    edge: NDArray[np.int64]
    speed: Array
    impulse: Array
    lost: Array

    def __len__(self) -> int:
        return len(self.time)


def simulate(
    group: WheelGroup, state: State, end: float, max_impacts: int = CHUNK
) -> Iterator[Impacts]:
    """Compute impacts until a time [s] in parts; the state is advanced with them.

    max_impacts : approximate number of impacts of each part

    Raises LostMotion if an event is not found.
    """
    box, period = group.box, group.excitation.period
    n = len(group.plays)
    work = new_workspace(n, box.low.size, N_TERMS)
    fraction, periods = math.modf(end / period)
    goal = periods, fraction
    records = np.empty((max_impacts + box.low.size, RECORD_COLUMNS))
    status = events.RECORDS_FULL
    while status == events.RECORDS_FULL:
        count, status = events.run_events(
            *(box, work, state.clock, state.q, state.v, state.held, goal, records)
        )
        if status == events.NOT_FOUND:
            raise LostMotion(f"no event is found after {state.time * period:.9g} s")
        yield _impacts(records[:count], box, period)


def _impacts(records: Array, box: GroupArrays, period: float) -> Impacts:
    return Impacts(
        (records[:, 0] + records[:, 1]) * period,
        box.roundoff_coordinate[records[:, 2].astype(np.int64)],
        records[:, 3].astype(np.int64),
        records[:, 4] / period,
        records[:, 5] / period,
        records[:, 6] / period**2,
    )


def join_impacts(parts: list[Impacts]) -> Impacts:
    names = [column.name for column in fields(Impacts)]
    return Impacts(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))


def energy(group: WheelGroup, state: State) -> float:
    """Kinetic energy [J]."""
    speeds = state.v / group.excitation.period
    return float(0.5 * np.sum(group.masses * speeds**2))


@dataclass(frozen=True)
class PlayNoise:
    """Noise of a play of a wheel.

    impacts : number of impacts
    level : sum of squared approach speeds per time [m2/s3]
    power : energy dissipated by the impacts per time [W]
    """

    wheel: str
    play: str
    impacts: int
    level: float
    power: float
    fastest: float


def noise_of(group: WheelGroup, impacts: Impacts, seconds: float) -> list[PlayNoise]:
    """Noise of each play of a group, over a time [s]."""
    noises = []
    for number, (wheel, name) in enumerate(group.plays):
        of_play = impacts.play == number
        speed = impacts.speed[of_play]
        noises.append(
            PlayNoise(
                *(wheel.name, name, int(of_play.sum())),
                level=float(np.sum(speed**2)) / seconds,
                power=float(np.sum(impacts.lost[of_play])) / seconds,
                fastest=float(speed.max(initial=0.0)),
            )
        )
    return noises
