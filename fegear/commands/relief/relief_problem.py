"""Reliefs, leads and topographies that are sought, and what they change.

The transmission error of a loaded pair of gears answers a change of the gap of one
tooth pair by that pair's part of the next increment of the load, its slope over the
sum of all slopes: this follows from the contact conditions of the nodes that touch,
whose forces balance the torque before and after. Reliefs and leads are such gaps, so
that the solution of the contact gives the derivative of the transmission error with
respect to all of them without another solution, what they do to moment arms included;
over the width it gives those of the loads as well. What is left out is that the nodes
of a contact patch follow the point of contact, 1 % of the derivatives and less with
more nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from fegear.commands.relief.quantities import (
    Quantity,
    SlopedCycle,
    SlopedValues,
    Slopes,
    no_slopes,
    responses,
)
from fegear.commands.relief.topography_range import TopographyRange
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.flank_changes import changed_flanks
from fegear.elasticity.wide_root import WideRoot
from fegear.gearset.modifications import LEAD_SIZES, FlankLead, Relief, ReliefShape
from fegear.gearset.zones import Zones, zones
from fegear.statics.root_stress import root_stresses_over_width
from lumped.common.array_types import Array
from lumped.common.units import MM, UM

Lead = Literal["crowning", "slope", "end_relief"]
PLACES = ("driver_tip", "driven_tip", "driver_root", "driven_root")
ROLES = "driver", "driven"
MIN_MAGNITUDE = 1e-12  # of a relief [m], by which its derivative is known
MIN_LENGTH = 0.05  # of a relief [base pitches], and of an end relief [half face widths]
# sizes of each lead, and their units in a design
LEADS: dict[Lead, dict[str, float]] = {
    "crowning": {"crowning": UM},
    "slope": {"slope": UM},
    "end_relief": {"end_relief": UM, "end_length": MM},
}


class SizeSlope(NamedTuple):
    """A slope of a cycle that is one by a size of a design, as far as a factor.

    field, at : as in `fegear.contact.width.flank_changes.FlankChange`
    """

    field: str
    at: tuple[int, ...]
    factor: float


@dataclass(frozen=True)
class ReliefRange:
    """A relief whose magnitude and length are sought.

    place : one of PLACES
    flank : zones of its gear
    end : roll length at which the relief is largest [m]
    lengths : shortest and longest, over the base pitch
    """

    place: str
    flank: Zones
    end: float
    lengths: tuple[float, float]

    @property
    def is_tip(self) -> bool:
        return self.place.endswith("tip")

    @property
    def role(self) -> str:
        return self.place.partition("_")[0]

    def start(self, length: float, base_pitch: float) -> float:
        """Roll length where a relief of a length in base pitches begins [m]."""
        distance = length * base_pitch
        return self.end - distance if self.is_tip else self.end + distance

    def slopes(self, base_pitch: float) -> tuple[SizeSlope, SizeSlope]:
        """Slopes by the magnitude [um] and the length [base pitches]."""
        at = ROLES.index(self.role), 0 if self.is_tip else 1
        sign = -1.0 if self.is_tip else 1.0
        return (
            SizeSlope("relief_slope", (*at, 0), UM),
            SizeSlope("relief_slope", (*at, 1), sign * base_pitch),
        )


@dataclass(frozen=True)
class LeadRange:
    """A lead modification of one gear that is sought.

    role : of the gear; name : of the lead
    limits : lowest and highest of each of its sizes, in um and mm
    """

    role: str
    name: Lead
    limits: tuple[tuple[float, float], ...]

    @property
    def units(self) -> dict[str, float]:
        return LEADS[self.name]

    def slopes(self) -> Iterator[SizeSlope]:
        """Slopes by each of its sizes."""
        for name, unit in self.units.items():
            at = ROLES.index(self.role), LEAD_SIZES.index(name)
            yield SizeSlope("lead_slope", at, unit)


@dataclass(frozen=True)
class ReliefProblem:
    """Sizes of reliefs and leads that make a quantity least.

    contact : of the mesh without the reliefs and leads that are sought
    ranges : reliefs that are sought
    torques : on the driver (t,) [N m]; positions : of the mesh cycle (p,)
    max_magnitude : of reliefs [m]
    symmetric : whether reliefs of both gears have one magnitude and one length in
        base pitches
    leads : that are sought
    solvers : of cases with other misalignment, in place of that of `contact`
    quantities : that are asked for
    topography : whose depths are sought, or None
    roots : root stress of driver and driven gear, where it is asked for
    """

    contact: ContactProblem
    ranges: tuple[ReliefRange, ...]
    torques: Array
    positions: Array
    max_magnitude: float
    shape: ReliefShape = "linear"
    symmetric: bool = False
    leads: tuple[LeadRange, ...] = ()
    solvers: tuple[PlaneContact | WidthContact, ...] = ()
    quantities: tuple[Quantity, ...] = ("ste",)
    roots: tuple[WideRoot, ...] = ()
    topography: TopographyRange | None = None

    @property
    def groups(self) -> tuple[tuple[ReliefRange, ...], ...]:
        """Ranges that share their magnitude and length, n groups."""
        if not self.symmetric:
            return tuple((entry,) for entry in self.ranges)
        ends = True, False
        groups = [tuple(e for e in self.ranges if e.is_tip == tip) for tip in ends]
        return tuple(group for group in groups if group)

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Limits of a design (x,).

        Magnitudes of n groups [um], then their lengths [base pitches], then sizes of
        leads [um], of end reliefs also their length [mm], then depths of the topography
        [um].
        """
        magnitudes = [(0.0, self.max_magnitude / UM)] * len(self.groups)
        limits = [[entry.lengths for entry in group] for group in self.groups]
        lengths = [
            (max(low for low, _ in group_limits), min(high for _, high in group_limits))
            for group_limits in limits
        ]
        leads = [limit for lead in self.leads for limit in lead.limits]
        depths = self.topography.limits if self.topography else []
        return magnitudes + lengths + leads + depths

    def parts(self, design: Array) -> tuple[Array, Array, Array]:
        """Magnitudes (n,) and lengths (n,) of groups, and sizes of leads and depths."""
        count = len(self.groups)
        return design[:count], design[count : 2 * count], design[2 * count :]

    @property
    def depths(self) -> list[int]:
        """Which of the sizes of a design are depths of reliefs and leads [um]."""
        groups = len(self.groups)
        indices, i = list(range(groups)), 2 * groups
        for lead in self.leads:
            indices.append(i)
            i += len(lead.units)
        return indices

    def separate(self, design: Array) -> tuple[ReliefProblem, Array]:
        """The problem with each relief by itself, and the design that is the same."""
        sizes = [len(group) for group in self.groups]
        ranges = tuple(entry for group in self.groups for entry in group)
        *of_reliefs, of_leads = self.parts(design)
        reliefs = [np.repeat(part, sizes) for part in of_reliefs]
        separate = np.concatenate([*reliefs, of_leads])
        return replace(self, ranges=ranges, symmetric=False), separate

    def lead_sizes(self, design: Array) -> Iterator[tuple[LeadRange, dict[str, float]]]:
        """Sought leads with their sizes in a design [um], [mm]."""
        remaining = list(self.parts(design)[2])
        for entry in self.leads:
            yield entry, {name: float(remaining.pop(0)) for name in entry.units}

    def topography_depths(self, design: Array) -> Array:
        """Depths of the topography in a design (h,) [um]."""
        count = self.topography.size if self.topography else 0
        return design[design.size - count :]

    def contact_of(self, design: Array) -> ContactProblem:
        """The contact problem with the reliefs and leads of a design."""
        pitch = self.contact.pair.base_pitch
        problem, design = self.separate(design)
        magnitudes, lengths, _ = problem.parts(design)
        changed: dict[str, dict[str, Any]] = {role: {} for role in ROLES}
        for entry, size, length in zip(
            problem.ranges, magnitudes, lengths, strict=True
        ):
            relief = Relief(
                magnitude=max(UM * float(size), MIN_MAGNITUDE),
                start_roll_length=entry.start(float(length), pitch),
                shape=self.shape,
            )
            _, _, place = entry.place.partition("_")
            changed[entry.role][f"{place}_relief"] = relief
        for lead, sizes in problem.lead_sizes(design):
            flank: ContactFlank = getattr(self.contact, lead.role)
            before = changed[lead.role].get("lead", flank.lead or FlankLead())
            metres = {name: lead.units[name] * size for name, size in sizes.items()}
            changed[lead.role]["lead"] = replace(before, **metres)
        if self.topography:
            depths = self.topography.of(self.topography_depths(design))
            changed[self.topography.role] |= {
                "topography": depths,
                "depths_sought": True,
            }
        return replace(
            self.contact,
            driver=replace(self.contact.driver, **changed["driver"]),
            driven=replace(self.contact.driven, **changed["driven"]),
        )

    def _cases(self, design: Array) -> Iterator[ContactProblem]:
        """The contact problem of a design at every misalignment."""
        contact = self.contact_of(design)
        for solver in self.solvers or (contact.solver,):
            yield replace(contact, solver=solver)

    def values(self, design: Array) -> dict[Quantity, Array]:
        """What is asked for, in cases of misalignment and torque (c, q)."""
        cycles = []
        for case in self._cases(design):
            cycle = solve_cycle(case, self.torques, self.positions)
            cycles.append(self._with_roots(case, cycle, no_slopes(cycle)))
        solved = responses(self.quantities, cycles)
        return {name: response.values for name, response in solved.items()}

    def responses(self, design: Array) -> dict[Quantity, SlopedValues]:
        """What is asked for, with slopes by the sizes of a design."""
        cycles = []
        for case in self._cases(design):
            cycle = solve_cycle(case, self.torques, self.positions, with_slopes=True)
            cycles.append(self._with_roots(case, cycle, self._slopes(case, cycle)))
        return responses(self.quantities, cycles)

    def _with_roots(
        self, case: ContactProblem, cycle: ContactCycle, slopes: Slopes
    ) -> SlopedCycle:
        """A solved cycle with its root stress, where that is asked for."""
        solver = case.solver
        if "root_stress" not in self.quantities or isinstance(solver, PlaneContact):
            return SlopedCycle(cycle, slopes)
        stresses = root_stresses_over_width(
            case, solver, cycle, self.roots, slopes.load
        )
        return SlopedCycle(cycle, slopes, stresses.over_width)

    def _slopes(self, contact: ContactProblem, cycle: ContactCycle) -> Slopes:
        by_size = list(self._size_slopes())
        ste = np.zeros((*cycle.ste.shape, len(by_size)))
        load = np.zeros((*cycle.face.load.shape, len(by_size)))
        over_width = not cycle.face.is_uniform
        changes = changed_flanks(contact) if over_width else ()
        index = {(one.field, one.at): c for c, one in enumerate(changes)}
        for i, slopes in enumerate(by_size):
            for field, at, factor in slopes:
                ste[..., i] += factor * getattr(cycle, field)[(..., *at)]
                if over_width:
                    load[..., i] += (
                        factor * cycle.face.load_change[..., index[field, at]]
                    )
        return Slopes(ste, load)

    def _size_slopes(self) -> Iterator[Sequence[SizeSlope]]:
        """Slopes whose sum is that by each size of a design."""
        pitch = self.contact.pair.base_pitch
        for i in range(2):
            for group in self.groups:
                yield [entry.slopes(pitch)[i] for entry in group]
        for lead in self.leads:
            for slope in lead.slopes():
                yield [slope]
        if self.topography:
            gear = ROLES.index(self.topography.role)
            for i in range(self.topography.size):
                yield [SizeSlope("topography_slope", (gear, i), UM)]


def relief_ranges(
    contact: ContactProblem, places: Sequence[str]
) -> tuple[ReliefRange, ...]:
    """Ranges of reliefs, at most from the pitch point on."""
    pair = contact.pair
    pitch_points = {
        "driver": pair.pitch_point,
        "driven": pair.line_of_action - pair.pitch_point,
    }
    ranges = []
    for place in places:
        role = place.partition("_")[0]
        flank = zones(pair, role)
        end = flank.tip if place.endswith("tip") else flank.start
        longest = abs(end - pitch_points[role]) / pair.base_pitch
        ranges.append(ReliefRange(place, flank, end, (MIN_LENGTH, longest)))
    return tuple(ranges)


def lead_ranges(
    role: str, names: Sequence[Lead], largest: float, width: float
) -> tuple[LeadRange, ...]:
    """Ranges of the leads of one gear.

    largest : depth at an end of the width [m]; width : of its face [m]
    """
    depth, half = largest / UM, 0.5 * width / MM
    limits: dict[Lead, tuple[tuple[float, float], ...]] = {
        "crowning": ((0.0, depth),),
        "slope": ((-depth, depth),),
        "end_relief": ((0.0, depth), (MIN_LENGTH * half, half)),
    }
    return tuple(LeadRange(role, name, limits[name]) for name in names)
