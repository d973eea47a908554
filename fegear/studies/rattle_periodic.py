"""Motions of a machine that repeat, stable or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any, ClassVar

from fegear.rattle.machines import parameters
from fegear.studies.machines import MachineStudy
from fegear.studies.page import Columns, Page, RowTable, cell, heading, number
from fegear.studies.study import Job, Range, Study, StudyResult, Task, setting
from fegear.studies.table import Table
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import Orbit, find_orbits
from lumped.rattle.periodic import (
    has_closed_form,
    min_eccentricity,
    simple_rattle,
    two_sided_rattle,
)
from lumped.rattle.return_map import distance
from lumped.rattle.sticking import Sticking, sticking_motions


@dataclass(frozen=True, kw_only=True)
class PeriodicOrbits(
    MachineStudy,
    Study,
    command="rattle periodic",
    example="rattle periodic roots-scaled --departures 2",
):
    """Periodic motions P(m, n+, n-), stable or not.

    Fixed points of the return map by Newton's method from a grid of departures: m
    turns, n+ departures from the upper flank and n- impacts on the lower flank. Where
    impacts lose speed, flanks may chatter and stick until the load separates them:
    sticking(m), identified by its release from rest, whatever the number of impacts.
    """

    pictures: ClassVar[Mapping[str, str]] = {}

    departures: int = setting(
        2,
        "Largest number of departures from the upper flank in a period of the "
        "listed motions.",
        Range(1, 12),
    )

    def tasks(self) -> Iterator[Task]:
        yield Task("motions", self._found)

    def _found(self, job: Job) -> PeriodicResult:
        machine = self.named.machine
        found = [
            *map(_of_orbit, find_orbits(machine, self.departures, self.speeds)),
            *map(_of_rest, sticking_motions(machine)),
        ]
        return PeriodicResult(self, tuple(found))


@dataclass(frozen=True)
class Repeating:
    """A motion that repeats after so many turns.

    departures : (time [turns], speed [rad per turn]) of each from the upper flank
    orbit : None of one that comes to rest, which forgets all changes
    """

    name: str
    turns: int
    stable: bool
    largest_multiplier: float
    departures: tuple[tuple[float, float], ...]
    orbit: Orbit | None = None

    def from_construction(self, machine: Machine) -> float | None:
        """Distance of the departure from a constructed one, where there is one."""
        if self.orbit is None or not has_closed_form(machine):
            return None
        turns, upper, lower = self.orbit.itinerary
        if upper > 1 or lower > 1:
            return None
        exact = (two_sided_rattle if lower else simple_rattle)(machine, turns)
        (departure,) = self.orbit.departures
        known = (distance(departure, (each.time, each.velocity)) for each in exact)
        return min(known, default=None)


def _of_orbit(orbit: Orbit) -> Repeating:
    largest = max(map(abs, orbit.multipliers))
    own = orbit.name, orbit.itinerary.turns, orbit.stable, largest
    return Repeating(*own, tuple((t, v) for t, v in orbit.departures), orbit)


def _of_rest(motion: Sticking) -> Repeating:
    time, speed = motion.point
    return Repeating(motion.name, motion.turns, True, 0.0, ((time, speed),))


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicResult(StudyResult):
    """Motions of a named machine that repeat."""

    study: PeriodicOrbits
    motions: tuple[Repeating, ...]

    @cached_property
    def summary(self) -> dict[str, Any]:
        machine = self.study.named.machine
        known = has_closed_form(machine)
        return {
            **self.study.named.heading,
            **parameters(machine),
            "departures": self.study.departures,
            "velocity_rad_per_turn": list(self.study.speeds),
            "least_eccentricity_of_P(1,1,0)_rad": (
                min_eccentricity(machine) if known else None
            ),
            "orbits": [
                {
                    "name": each.name,
                    "turns": each.turns,
                    "stable": each.stable,
                    "largest_multiplier": each.largest_multiplier,
                    "departures": [list(point) for point in each.departures],
                    "from_construction": each.from_construction(machine),
                }
                for each in self.motions
            ],
        }

    @property
    def table(self) -> Table:
        """A row for each departure."""
        names = "motion", "stable", "largest_multiplier", "time_turns"
        rows = [
            (each.name, int(each.stable), each.largest_multiplier, *point)
            for each in self.motions
            for point in each.departures
        ]
        header = {"machine": self.study.named.name}
        return Table((*names, "speed_rad_per_turn"), lambda: rows, header)

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.study.named)
        yield f"motions of up to {self.study.departures} departures a period"
        columns: Columns = {
            "motion": itemgetter("name"),
            "stable": lambda row: "yes" if row["stable"] else "no",
            "largest\nmultiplier": cell("largest_multiplier"),
            "departures:\ntime [turns]": lambda row: _lines(row["departures"], 0),
            "speed\n[rad per turn]": lambda row: _lines(row["departures"], 1),
        }
        yield RowTable(values["orbits"], columns)
        least = values["least_eccentricity_of_P(1,1,0)_rad"]
        if least is not None:
            yield f"P(1,1,0) exists from an eccentricity of {least:.4g} rad on"
        known = (each["from_construction"] for each in values["orbits"])
        if found := [each for each in known if each is not None]:
            yield f"P(m,1,n-) are within {max(found):.1g} of constructed ones"


def _lines(departures: list[list[float]], place: int) -> str:
    return "\n".join(number(point[place], 4) for point in departures)
