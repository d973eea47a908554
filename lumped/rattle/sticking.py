"""Motions whose flanks chatter to rest on each other, until the load separates them.

The motion after a release from rest depends only on its time and its flank. The motion
is therefore identified by its releases, however many impacts of the chatter are
counted. Neighbouring motions that come to rest coincide with it exactly: it is stable,
with multipliers 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lumped.rattle.kernels import settle as kernel
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import follow

Release = tuple[float, float]  # time [turns] and speed, negative from the lower flank
AT_ONCE = 1e-8  # distance in turns of releases that are equal
MAX_IMPACTS = 100_000  # largest number of impacts from one release to the next
MAX_RELEASES = 100  # largest number of releases in a period
# Factor of the speed of a second release that is followed with each
SPEED_FACTOR = 10.0
# Factors of the speed that model round-off
SPEED_FACTORS = np.geomspace(1.0, SPEED_FACTOR, 2 * MAX_RELEASES)
INSTANTS_PER_CYCLE = 256  # instants at rest in each cycle of the fastest forcing


@dataclass(frozen=True)
class Sticking:
    """Motion that comes to rest, described by its releases in the order of their times.

    turns : period in turns; 0 if a motion between two releases is so sensitive that
        its duration is lost in round-off
    point : time from 0 to 1 and speed of a departure from the upper flank: a release,
        with speed 0, or the first departure after a release from the lower flank
    """

    turns: int
    releases: tuple[Release, ...]
    point: tuple[float, float]

    @property
    def name(self) -> str:
        return f"sticking({self.turns or 'irregular'})"


def sticking_from(machine: Machine, release: Release) -> Sticking | None:
    """Motion that a release belongs or leads to; None if it comes to rest no more."""
    path, turns = _cycle(machine, release)
    if path and not turns:
        wandered = _wander(machine, release)
        path, turns = _cycle(machine, wandered[-1]) if wandered else ([], 0)
        path = path if turns or not path else wandered[len(wandered) // 2 :]
    return _motion(machine, path, turns) if path else None


def sticking_motions(machine: Machine) -> list[Sticking]:
    """All sticking motions of a machine; releases occur where a flank's load ends."""
    motions: list[Sticking] = []
    for release in _possible_releases(machine):
        motion = sticking_from(machine, release)
        if motion is not None and not any(
            _same(motion, existing) for existing in motions
        ):
            motions.append(motion)
    return sorted(motions, key=lambda cycle: (cycle.turns, cycle.point))


def _cycle(machine: Machine, release: Release) -> tuple[list[Release], int]:
    """Periodic releases that follow a release, none if it comes to rest no more, and
    their period in turns, 0 if uncertain."""
    path, certain = [release], list[bool]()
    while len(path) <= MAX_RELEASES:
        after, clear = _next(machine, path[-1])
        if not math.isfinite(after[0]):
            break
        certain.append(clear)
        for number, earlier in enumerate(path):
            if _alike(earlier, after):
                turns = round(after[0] - earlier[0]) if all(certain[number:]) else 0
                return path[number:], turns
        path.append(after)
    return [], 0


def _wander(machine: Machine, release: Release) -> list[Release]:
    """Successive releases with varied speeds; none if it comes to rest no more."""
    path = [release]
    for factor in SPEED_FACTORS:
        time, speed = path[-1]
        path.append(
            kernel.next_release(machine.arrays, time, factor * speed, MAX_IMPACTS)
        )
        if not math.isfinite(path[-1][0]):
            return []
    return path


def _next(machine: Machine, release: Release) -> tuple[Release, bool]:
    """Next release, and whether a slightly faster release leads to it as well."""
    time, speed = release
    arrays = machine.arrays
    one, other = (
        kernel.next_release(arrays, time, factor * speed, MAX_IMPACTS)
        for factor in (1.0, SPEED_FACTOR)
    )
    return one, abs(one[0] - other[0]) < AT_ONCE and one[1] == other[1]


def _possible_releases(machine: Machine) -> Iterator[Release]:
    if not machine.is_impact or machine.restitution == 1.0:
        return
    count = INSTANTS_PER_CYCLE * machine.ripple_order
    for side in (1, -1):
        releases: list[Release] = []
        for time in np.arange(count) / count:
            later, speed = kernel.release_departure(machine.arrays, time, side)
            if not (math.isfinite(later) and later > time):
                continue
            release = later % 1.0, speed
            releases += (
                []
                if any(_alike(release, existing) for existing in releases)
                else [release]
            )
        yield from releases


def _alike(one: Release, two: Release) -> bool:
    turn = one[0] - two[0]
    return abs(turn - round(turn)) < AT_ONCE and one[1] == two[1]


def _same(one: Sticking, two: Sticking) -> bool:
    return any(_alike(one.releases[0], release) for release in two.releases)


def _motion(machine: Machine, path: list[Release], turns: int) -> Sticking:
    single: dict[tuple[int, float], Release] = {}
    for time, speed in path:
        single.setdefault((round(time % 1.0 / AT_ONCE), speed), (time % 1.0, speed))
    releases = tuple(sorted(single.values()))
    upper = [(time, 0.0) for time, speed in releases if speed > 0.0]
    if not upper:
        after = [follow(machine, release, 2)[1, :2] for release in releases]
        upper = [(float(time % 1.0), float(speed)) for time, speed in after]
    return Sticking(turns, releases, min(upper))
