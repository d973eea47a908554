"""Runs of a gearbox: impacts in the order of time, state to go on from, noise."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from lumped.clatter.groups import Group
from lumped.clatter.kernels import events
from lumped.clatter.kernels.arrays import RECORD, Box, work_for
from lumped.clatter.kernels.contact import TERMS

Array = NDArray[np.float64]
CHUNK = 50_000  # impacts that are taken at a time


class LostMotion(ArithmeticError):
    """A motion whose next event was not found."""


@dataclass(eq=False)
class State:
    """State of the wheels of a group; time in periods and lengths in metres.

    clock (2,) : whole periods and the part of one; q, v (n,)
    held (p,) : the edge of each play that holds, else 0, as `Box` counts them
    """

    clock: Array
    q: Array
    v: Array
    held: NDArray[np.int64]

    @property
    def time(self) -> float:
        """In periods."""
        return float(self.clock.sum())

    def copy(self) -> State:
        return State(*(each.copy() for each in vars(self).values()))


def middle(group: Group) -> State:
    """Every play half open, teeth moving with the excitation's start at rest."""
    return _placed(group, np.full(len(group.plays), 0.5))


def scattered(group: Group, seed: int) -> State:
    """A state anywhere in the plays, otherwise as `middle`."""
    random = np.random.default_rng(seed)
    return _placed(group, random.uniform(0.05, 0.95, len(group.plays)))


def _placed(group: Group, parts: Array) -> State:
    """At rest, at parts of the plays from their lower edges."""
    n, start = len(group.plays), np.zeros(1)
    e = float(group.excitation.at(start)[0])
    shifts = (parts - 1.0) * group.widths(start)[0] - group.ratios * e
    q: Array = np.linalg.solve(group.rows, shifts).astype(np.float64)
    held = np.zeros(group.box.low.size, np.int64)
    return State(np.zeros(2), q, np.zeros(n), held)


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of a group, a row of each contact that was struck.

    time [s], play : number among the group's plays, edge : 1 upper, -1 lower
    speed : of approach [m/s], impulse [N s], lost : energy [J]
    """

    time: Array
    play: NDArray[np.int64]
    edge: NDArray[np.int64]
    speed: Array
    impulse: Array
    lost: Array

    def __len__(self) -> int:
        return len(self.time)


def move(
    group: Group, state: State, until: float, most: int = CHUNK
) -> Iterator[Impacts]:
    """Impacts until a time [s], some at a time; the state moves on with them.

    most : impacts, about, of each part
    Raises LostMotion where an event is not found.
    """
    box, period = group.box, group.excitation.period
    n = len(group.plays)
    work = work_for(n, box.low.size, TERMS)
    part, whole = math.modf(until / period)
    goal = whole, part
    records = np.empty((most + box.low.size, RECORD))
    status = events.FULL
    while status == events.FULL:
        taken, status = events.run(
            *(box, work, state.clock, state.q, state.v, state.held, goal, records)
        )
        if status == events.LOST:
            raise LostMotion(f"no event is found after {state.time * period:.9g} s")
        yield _impacts(records[:taken], box, period)


def _impacts(records: Array, box: Box, period: float) -> Impacts:
    return Impacts(
        (records[:, 0] + records[:, 1]) * period,
        box.turning[records[:, 2].astype(np.int64)],
        records[:, 3].astype(np.int64),
        records[:, 4] / period,
        records[:, 5] / period,
        records[:, 6] / period**2,
    )


def joined(parts: list[Impacts]) -> Impacts:
    names = [each.name for each in fields(Impacts)]
    return Impacts(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))


def energy(group: Group, state: State) -> float:
    """Kinetic energy [J]."""
    speeds = state.v / group.excitation.period
    return float(0.5 * np.sum(group.masses * speeds**2))
