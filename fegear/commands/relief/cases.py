"""The mesh of a gear set at torques and misalignments, before and after a search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fegear.commands.relief.objective import ReliefObjective, peak_to_peak
from fegear.commands.relief.quantities import (
    SCALES,
    Quantity,
    SlopedCycle,
    no_slopes,
    responses,
)
from fegear.contact.result import ContactCycle
from fegear.gearset.model import GearSet
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from lumped.common.array_types import Array

# names of largest values before or after, in rows
LARGEST: Mapping[Quantity, str] = {
    "ste": "{}_um",
    "distribution": "load_distribution_factor_{}",
    "line_load": "line_load_{}_N_per_mm",
    "pressure": "pressure_{}_MPa",
    "root_stress": "root_stress_{}_MPa",
}


@dataclass(frozen=True)
class Cases:
    """A mesh at misalignments, one after the other, and torques.

    gear_sets : with each misalignment; misalignments_um : theirs
    index : of the mesh; settings : of its solution
    """

    gear_sets: tuple[GearSet, ...]
    misalignments_um: tuple[float, ...]
    index: int
    settings: StaticsSettings

    def solved(
        self, torques: Sequence[float], estimate_error: bool = False
    ) -> SolvedCases:
        """All cases; estimate_error : whether tables know their errors."""
        settings = replace(self.settings, estimate_error=estimate_error)
        results = tuple(
            mesh_statics(gears, self.index, torques, settings)
            for gears in self.gear_sets
        )
        return SolvedCases(results, self.misalignments_um, settings.positions)


@dataclass(frozen=True)
class SolvedCases:
    """Solutions of cases; positions : of a base pitch."""

    results: tuple[StaticsResult, ...]
    misalignments_um: tuple[float, ...]
    positions: int

    @property
    def cycles(self) -> list[ContactCycle]:
        return [result.cycle for result in self.results]

    @property
    def vary_over_width(self) -> bool:
        return not all(cycle.face.is_uniform for cycle in self.cycles)

    def values(self, names: Sequence[Quantity]) -> dict[Quantity, Array]:
        """Quantities (c, q) of all cases."""
        cycles = []
        for result in self.results:
            roots = result.roots.over_width if result.roots else ()
            cycle = result.cycle
            cycles.append(SlopedCycle(cycle, no_slopes(cycle), roots))
        every = responses(names, cycles)
        return {name: one.values for name, one in every.items()}

    def objective(self, objective: ReliefObjective) -> float:
        """Objective over one base pitch or several."""
        pitches = self.cycles[0].position.size // self.positions
        orders = tuple(pitches * order for order in objective.harmonics)
        others = tuple(
            replace(term, harmonics=tuple(pitches * n for n in term.harmonics))
            for term in objective.others
        )
        of_pitches = replace(objective, harmonics=orders, others=others)
        return of_pitches.of(self.values(objective.quantities))

    @property
    def largest_error(self) -> float:
        """Largest transmission error [m]."""
        return max(float(np.abs(cycle.ste).max()) for cycle in self.cycles)

    def largest(self) -> dict[Quantity, Array]:
        """Peak to peak of the transmission error, and largest values over the width,
        of each case (c,) in the units of LARGEST.
        """
        names: list[Quantity] = list(LARGEST) if self.vary_over_width else ["ste"]
        if not all(result.roots for result in self.results):
            names = [name for name in names if name != "root_stress"]
        return {
            name: (peak_to_peak(one) if name == "ste" else one.max(axis=1))
            / SCALES[name]
            for name, one in self.values(names).items()
        }


def compared_rows(
    before: SolvedCases, after: SolvedCases, misaligned: bool
) -> list[dict[str, Any]]:
    """Rows of the same cases before and after, side by side.

    With what there is over the width before as well as after.

    misaligned : whether the command names misalignments in place of the gear set's
    """
    torques = before.cycles[0].torque.tolist()
    rows: list[dict[str, Any]] = [
        {"torque_Nm": torque} | ({"misalignment_um": gap} if misaligned else {})
        for gap in before.misalignments_um
        for torque in torques
    ]
    one, other = before.largest(), after.largest()
    for name in (name for name in one if name in other):
        for when, values in (("before", one[name]), ("after", other[name])):
            for row, value in zip(rows, values.tolist(), strict=True):
                row[LARGEST[name].format(when)] = value
    return rows
