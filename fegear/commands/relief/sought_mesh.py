"""The mesh of a gear set whose reliefs and leads are sought."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

from fegear.commands.relief.cases import Cases
from fegear.commands.relief.edits import (
    DesignRows,
    lead_edits,
    relief_edits,
    sought_leads,
    topography_edits,
)
from fegear.commands.relief.relief_problem import (
    Lead,
    ReliefProblem,
    lead_ranges,
    relief_ranges,
)
from fegear.commands.relief.topography_range import (
    TopographyRange,
    topography_range,
)
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactProblem
from fegear.elasticity.wide_root import WideRoot
from fegear.gearset.model import GearSet, Mesh
from fegear.gearset.modifications import ReliefShape
from fegear.statics.machine import loaded_problem
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import wide_roots
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.common.array_types import Array
from lumped.common.units import UM

TINY_CROWNING_UM = 1e-6


class LargestDepths(NamedTuple):
    """Depths [m] up to which modifications are sought."""

    relief: float
    lead: float
    topography: float


@dataclass(frozen=True)
class SoughtMesh:
    """A mesh by its index, and what is sought of it.

    places, leads : reliefs of both gears, and leads of the one with fewer teeth
    topography : points over profile and width of the one that is sought of that gear,
        or None
    misalignments_um : in place of that of the gear set, or empty
    settings : of its solution; shape : of reliefs
    """

    gear_set: GearSetRef
    index: int
    places: tuple[str, ...]
    leads: tuple[Lead, ...]
    topography: tuple[int, int] | None
    misalignments_um: tuple[float, ...]
    settings: StaticsSettings
    shape: ReliefShape

    @property
    def mesh(self) -> Mesh:
        return self.gear_set.loaded.meshes[self.index]

    @property
    def role(self) -> str:
        """Role of the gear with fewer teeth, which has the leads."""
        pair = self.mesh.pair
        return "driver" if pair.driver.teeth <= pair.driven.teeth else "driven"

    @property
    def largest_misalignment(self) -> float:
        """Largest size of a misalignment [m]."""
        every = (UM * gap for gap in self.misalignments_um)
        return max(map(abs, every), default=abs(self.mesh.misalignment))

    @property
    def cases(self) -> Cases:
        """The gear set as it is, at all misalignments."""
        return self.changed({})

    def changed(self, edits: Mapping[str, Any]) -> Cases:
        """The gear set with changes, at all misalignments."""
        gaps_um = self.misalignments_um or (self.mesh.misalignment / UM,)
        keys = [self._misalignment_keys(gap) for gap in self.misalignments_um] or [{}]
        sets = tuple(self._solvable({**edits, **more}) for more in keys)
        return Cases(sets, gaps_um, self.index, self.settings)

    def _solvable(self, edits: Mapping[str, Any]) -> GearSet:
        """The gear set with changes, whose loads vary over the width in all cases.

        Without leads and misalignment they do by a crowning that is none.
        """
        gears = self.settings.on_shafts(self.gear_set.changed(edits))
        is_plane = not gears.meshes[self.index].varies_over_width
        sought = self.leads or self.topography or self.misalignments_um
        if not (is_plane and sought):
            return gears
        crowning = {
            f"mesh.{i + 1}.driver_lead.crowning_um": TINY_CROWNING_UM
            for i, _ in self._meshes()
        }
        return self.gear_set.changed({**edits, **crowning})

    def _misalignment_keys(self, gap_um: float) -> dict[str, float]:
        """Keys by which the mesh and those with the same flanks are misaligned."""
        keys: dict[str, float] = {}
        for i in self.gear_set.loaded.meshes_of_same_flanks(self.index):
            keys[f"mesh.{i + 1}.lead.slope_um"] = 0.0
            keys[f"mesh.{i + 1}.misalignment_um"] = gap_um
        return keys

    @cached_property
    def gear_sets(self) -> tuple[GearSet, ...]:
        """The gear set at all misalignments, without the leads that are sought.

        And without the topography.
        """
        if not (self.leads or self.topography):
            return self.cases.gear_sets
        ranges = lead_ranges(self.role, self.leads, 1.0, 1.0)
        edits: dict[str, Any] = {}
        for i, mesh in self._meshes():
            if self.leads:
                leads = sought_leads(mesh.flanks, ranges, [])
                edits |= lead_edits(i + 1, leads, mesh.misalignment)
            if self.topography:
                edits[f"mesh.{i + 1}.{self.role}_topography"] = {}
        return self.changed(edits).gear_sets

    def _meshes(self) -> list[tuple[int, Mesh]]:
        gears = self.gear_set.loaded
        return [(i, gears.meshes[i]) for i in gears.meshes_of_same_flanks(self.index)]

    def keys(self, sought: ReliefProblem, rows: DesignRows) -> dict[str, Any]:
        """Keys that give a design to the mesh and to those with the same flanks."""
        edits: dict[str, Any] = {}
        for i, mesh in self._meshes():
            edits |= relief_edits(i + 1, list(self.places), rows.reliefs, self.shape)
            if sought.leads:
                leads = sought_leads(mesh.flanks, sought.leads, rows.leads)
                edits |= lead_edits(i + 1, leads, mesh.misalignment)
            if sought.topography:
                edits |= topography_edits(i + 1, sought.topography, rows.topography)
        return edits

    def problem(
        self, torques: Array, positions: Array, largest: LargestDepths
    ) -> ReliefProblem:
        """The search for modifications up to their largest depths."""
        contacts = [
            loaded_problem(one, self.index, self.settings, float(torques.max()))
            for one in self.gear_sets
        ]
        nothing: dict[str, Any] = {
            f"{place.partition('_')[2]}_relief": None for place in self.places
        }
        contact = replace(
            contacts[0],
            driver=replace(contacts[0].driver, **nothing),
            driven=replace(contacts[0].driven, **nothing),
        )
        mesh, gears = self.mesh, self.gear_set.loaded.gears
        gear = gears[mesh.driver if self.role == "driver" else mesh.driven]
        return ReliefProblem(
            contact=contact,
            ranges=relief_ranges(contact, self.places),
            torques=torques,
            positions=positions,
            max_magnitude=largest.relief,
            shape=self.shape,
            leads=lead_ranges(self.role, self.leads, largest.lead, gear.face_width),
            solvers=tuple(one.solver for one in contacts),
            roots=self._roots,
            topography=self._topography_range(contact, largest.topography),
        )

    def _topography_range(
        self, contact: ContactProblem, largest: float
    ) -> TopographyRange | None:
        face = contact.solver
        if self.topography is None or isinstance(face, PlaneContact):
            return None
        return topography_range(contact, face, self.role, self.topography, largest)

    @property
    def _roots(self) -> tuple[WideRoot, ...]:
        """Root stress of both gears, where it is asked for."""
        if not self.settings.root_stress:
            return ()
        return wide_roots(self.gear_sets[0], self.index, self.settings)
