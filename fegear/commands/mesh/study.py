"""The finite-element mesh of a gear."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fegear.files.errors import InputError
from fegear.files.output import write_whole
from fegear.gearset.model import Gear, GearSet
from fegear.statics.settings import StaticsSettings
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.trains.gear_sets import DEFAULT_PAIR, GearSetRef
from fegear.studies.trains.train_problem import refuse_edits
from meshes import SectorMesh, sector_mesh
from meshes.files import FORMATS, write_mesh


@dataclass(frozen=True, kw_only=True)
class GearMesh(
    Study, command="mesh", example="mesh liu-idler --gear 2 --whole -o idler.vtu"
):
    """Write the finite-element mesh of a gear.

    One tooth sector, or all of them, of second-order triangles.
    """

    pictures = NO_PICTURES
    output = "File to write [m]; its ending is .msh or .vtu."
    endings = tuple(FORMATS)
    must_write = True

    gear_set: GearSetRef = DEFAULT_PAIR
    gear: int = setting(1, "Number of the gear, counted from 1.")
    elements: StaticsSettings = group(
        SettingsGroup(kind=StaticsSettings, exposed=expose("resolution"))
    )
    whole: bool = setting(
        False, "Write all teeth instead of one tooth sector.", option="--whole"
    )

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError for an edit that changes nothing."""
        refuse_edits(self, {}, translations=False)
        return self.gear_set.healthy("meshes of gears")

    @property
    def meshed(self) -> Gear:
        """The gear that is meshed; InputError where there is none."""
        gears = self.gears.gears
        if not 1 <= self.gear <= len(gears):
            has = f"{self.gears.name} has {len(gears)} gears"
            raise InputError(f"gear = {self.gear}; {has}")
        return gears[self.gear - 1]

    def tasks(self) -> Iterator[Task]:
        yield Task("mesh", partial(self._sector, self.gears.name, self.meshed))

    def _sector(self, name: str, gear: Gear, job: Job) -> GearMeshResult:
        sector = sector_mesh(gear.geometry, self.elements.size)
        return GearMeshResult(self, name, gear.name, gear.geometry.teeth, sector)


@dataclass(frozen=True, eq=False)
class GearMeshResult(StudyResult):
    """The mesh of a sector; files have as many as are asked for."""

    study: GearMesh
    gear_set: str
    gear: str
    teeth: int
    sector: SectorMesh

    @property
    def copies(self) -> int:
        return self.teeth if self.study.whole else 1

    @property
    def summary(self) -> dict[str, Any]:
        return {
            "gear_set": self.gear_set,
            "gear": self.gear,
            "sectors": self.copies,
            "triangles": self.copies * len(self.sector.triangles),
            "nodes": self.copies * len(self.sector.points),
        }

    def write(self, path: str | Path) -> None:
        """Write the mesh by the ending of the path, .msh or .vtu."""
        arguments = self.copies, self.teeth
        write_whole(path, lambda file: write_mesh(self.sector, file, *arguments))

    def page(self) -> Page:
        section = ", transverse section" if self.study.meshed.geometry.twist else ""
        counts = "{gear} of {gear_set}: {triangles} triangles, {nodes} nodes"
        yield counts.format_map(self.summary) + section
