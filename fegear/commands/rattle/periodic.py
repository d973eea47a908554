"""Stable and unstable periodic motions of a machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any, ClassVar

from fegear.commands.rattle.machine_studies import MachineStudy
from fegear.commands.rattle.machines import NamedMachine, parameters
from fegear.commands.rattle.single_impact import (
    single_impact_lines,
    single_impact_summary,
)
from fegear.files.codes import with_code
from fegear.studies.page import Columns, Page, RowTable, cell, heading, number
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from lumped.common.options import Range
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import Orbit, find_orbits
from lumped.rattle.periodic_orbits import (
    has_closed_form,
    simple_rattle,
    two_sided_rattle,
)
from lumped.rattle.return_map import distance
from lumped.rattle.single_impact import single_impact
from lumped.rattle.sticking import Sticking, sticking_motions


@dataclass(frozen=True, kw_only=True)
class PeriodicOrbits(
    MachineStudy,
    Study,
    command="rattle periodic",
    example="rattle periodic roots-scaled --max-liftoffs 2",
):
    """Periodic motions P(m, n+, n-), stable or not.

    Fixed points of the return map by Newton's method from a grid of lift-offs: m turns,
    n+ lift-offs from the upper flank and n- impacts on the lower flank. Where
    impacts lose speed, flanks may chatter and stick until the load separates them:
    sticking(m), identified by its release from rest, whatever the number of impacts.
    """

    pictures: ClassVar[Mapping[str, str]] = {}

    max_liftoffs: int = setting(
        2,
        "Largest number of lift-offs from the upper flank in a period of the "
        "listed motions.",
        Range(1, 12),
    )

    def tasks(self) -> Iterator[Task]:
        yield Task("motions", self._find_motions)

    def _find_motions(self, job: Job) -> PeriodicResult:
        machine = self.named.machine
        motions = [
            *map(_from_orbit, find_orbits(machine, self.max_liftoffs, self.speeds)),
            *map(_from_sticking, sticking_motions(machine)),
        ]
        return PeriodicResult(self, self.named, tuple(motions))


@dataclass(frozen=True)
class PeriodicMotion:
    """A motion that repeats after so many turns.

    liftoffs : (time [turns], speed [rad per turn]) of each from the upper flank
    orbit : None for sticking motions (multipliers 0)
    """

    name: str
    turns: int
    stable: bool
    largest_multiplier: float
    liftoffs: tuple[tuple[float, float], ...]
    orbit: Orbit | None = None

    def distance_to_closed_form(self, machine: Machine) -> float | None:
        """Distance of the lift-off from that of the closed form, where there is one."""
        if self.orbit is None or not has_closed_form(machine):
            return None
        turns, upper, lower = self.orbit.itinerary
        if upper > 1 or lower > 1:
            return None
        exact = (two_sided_rattle if lower else simple_rattle)(machine, turns)
        (liftoff,) = self.orbit.departures
        distances = (distance(liftoff, (form.time, form.velocity)) for form in exact)
        return min(distances, default=None)


def _from_orbit(orbit: Orbit) -> PeriodicMotion:
    largest = max(map(abs, orbit.multipliers))
    properties = orbit.name, orbit.itinerary.turns, orbit.stable, largest
    return PeriodicMotion(
        *properties, tuple((t, v) for t, v in orbit.departures), orbit
    )


def _from_sticking(motion: Sticking) -> PeriodicMotion:
    time, speed = motion.point
    return PeriodicMotion(motion.name, motion.turns, True, 0.0, ((time, speed),))


@dataclass(frozen=True, eq=False)
class PeriodicResult(StudyResult):
    """Motions of a named machine that repeat."""

    study: PeriodicOrbits
    named: NamedMachine
    motions: tuple[PeriodicMotion, ...]

    @cached_property
    def summary(self) -> dict[str, Any]:
        machine = self.named.machine
        conditions = single_impact(machine) if has_closed_form(machine) else None
        impacts = single_impact_summary(conditions)
        return {
            **self.named.heading,
            **parameters(machine),
            "max_liftoffs": self.study.max_liftoffs,
            "velocity_rad_per_turn": list(self.study.speeds),
            "least_eccentricity_of_P(1,1,0)_rad": (
                impacts["from_rad"] if impacts else None
            ),
            "single_impact": impacts,
            "orbits": [
                {
                    "name": motion.name,
                    "turns": motion.turns,
                    "stable": motion.stable,
                    "largest_multiplier": motion.largest_multiplier,
                    "liftoffs": [list(point) for point in motion.liftoffs],
                    "distance_to_closed_form": motion.distance_to_closed_form(machine),
                }
                for motion in self.motions
            ],
        }

    @property
    def table(self) -> Table:
        """A row for each lift-off."""
        names = "motion", "stable", "largest_multiplier", "time_turns"
        rows = [
            (motion.name, int(motion.stable), motion.largest_multiplier, *point)
            for motion in self.motions
            for point in motion.liftoffs
        ]
        header = {"machine": self.named.name}
        return Table((*names, "speed_rad_per_turn"), lambda: rows, header)

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        yield f"motions of up to {self.study.max_liftoffs} lift-offs a period"
        columns: Columns = {
            "motion": itemgetter("name"),
            "stable": lambda row: "yes" if row["stable"] else "no",
            "largest\nmultiplier": cell("largest_multiplier"),
            "lift-offs:\ntime [turns]": lambda row: _lines(row["liftoffs"], 0),
            "speed\n[rad per turn]": lambda row: _lines(row["liftoffs"], 1),
        }
        yield RowTable(values["orbits"], columns)
        yield from single_impact_lines(
            values["single_impact"], "P(1,1,0)", values["eccentricity_rad"]
        )
        distances = (orbit["distance_to_closed_form"] for orbit in values["orbits"])
        if errors := [error for error in distances if error is not None]:
            line = f"P(m,1,n-) are within {max(errors):.1g} of closed forms"
            yield with_code("E17", line)


def _lines(liftoffs: list[list[float]], column: int) -> str:
    return "\n".join(number(point[column], 4) for point in liftoffs)
