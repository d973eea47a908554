"""Mesh stiffness, transmission error and load sharing of a gear pair."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from fegear.boundary import mesh_index
from fegear.commands.stiffness.crack_tips import crack_tips
from fegear.commands.stiffness.result import StiffnessResult
from fegear.contact.problem import ContactFailure
from fegear.files.errors import InputError
from fegear.files.output import INTO_PICTURE
from fegear.gearset.faults.checks import without_faults
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from fegear.studies.problem import Job, Task
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torques, torques_setting
from fegear.studies.trains.shafts import require_shafts_used
from fegear.studies.trains.train_problem import refuse_edits
from lumped.common.options import Range

ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose(
        *("positions", "friction", "plane", "resolution", "body", "corner_contact"),
        "shafts",
    ),
)
MIN_POSITIONS = 2
TABLE_HELP = {
    "cracks": "Write stress intensities and energy release rate of all open cracks to "
    "this CSV file.",
    "root_stresses": "Write root stress of all teeth in loaded pairs, over the face "
    "width, to this CSV file; needs what the file of loads needs.",
    "face_loads": "Write load per length and pressure over the face width to this CSV "
    "file; needs helical gears, a lead modification or an axial offset.",
    "harmonics": "Write amplitude and phase of the first harmonics of transmission "
    "error and stiffness to this CSV file.",
}
PICTURE_HELP = {
    "path": f"Draw pressure, root stress, load share and sliding {INTO_PICTURE}: over "
    "the driver's roll angle along the path of contact.",
    "face": "Draw pressure over the flank, and load and root stress over the width, "
    f"{INTO_PICTURE}; needs helical gears, a lead modification or an axial offset.",
    "harris": "Draw the transmission error at each torque, and its peak to peak over "
    f"the torque, {INTO_PICTURE}; needs two torques or more.",
}


@dataclass(frozen=True, kw_only=True)
class MeshStiffness(
    Study,
    command="stiffness",
    example="stiffness liu-idler --mesh 2 -o mesh2.csv --plot mesh2.png",
):
    """Mesh stiffness, transmission error and load sharing.

    Contact pressures are those of plane strain, in which material below a narrow
    contact is, whatever the plane of the teeth; JSON has those of plane stress too.
    The largest one and that at the pitch point leave out tooth pairs that touch at a
    tip corner or a kink of a flank, where a pressure has no limit and follows the
    contact grid; the column max_pressure_Pa has all pairs.
    """

    more_tables = TABLE_HELP
    pictures = PLOT | PICTURE_HELP

    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    torque: tuple[float, ...] = torques_setting("driving gear of the mesh")
    harmonic_count: int = setting(
        5,
        "Number of harmonics of the mesh frequency, in the JSON summary and in the "
        "table of harmonics.",
        Range(1, 1000),
    )
    elements: StaticsSettings = group(ELEMENTS)

    def __post_init__(self) -> None:
        super().__post_init__()
        positions = self.elements.positions
        if positions < MIN_POSITIONS:
            raise InputError(
                f"positions = {positions}; must be {MIN_POSITIONS} or more, as a "
                "single position has no peak to peak"
            )

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError for an edit that changes nothing."""
        refuse_edits(self, {"torque": self.torque}, translations=False)
        gears = self.gear_set.loaded
        require_shafts_used(self.elements, gears, self.mesh, ELEMENTS)
        return self.elements.on_shafts(gears)

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if "cracks" in outputs and not any(g.faults.cracks for g in self.gears.gears):
            yield "cracks", "needs a gear with cracks"
        for name in ("face_loads", "root_stresses", "face"):
            if name in outputs:
                index = mesh_index(self.gears, self.mesh)
                if not self.gears.meshes[index].varies_over_width:
                    yield name, "needs loads that vary over the face width"
        if "harris" in outputs:
            torques = chosen_torques(self.gears, self.torque, self.mesh)
            if len(torques) < 2:
                yield "harris", "needs two values of {torque} or more"

    def tasks(self) -> Iterator[Task]:
        index = mesh_index(self.gears, self.mesh)
        torques = chosen_torques(self.gears, self.torque, self.mesh)
        yield Task("table", partial(self._solve_stiffness, self.gears, index, torques))

    def _solve_stiffness(
        self, gears: GearSet, index: int, torques: tuple[float, ...], job: Job
    ) -> StiffnessResult:
        solved, unsolved = self._solve_torques(gears, index, torques, job)
        torques = tuple(torque for torque in torques if torque not in unsolved)
        healthy = None
        if any(gears.gears[gear].faults.any for gear in gears.meshes[index].gears):
            alone = replace(self.elements, estimate_error=False, root_stress=False)
            healthy = mesh_statics(without_faults(gears), index, torques, alone).table
        warnings = tuple(gear_set_warnings(gears))
        tips = crack_tips(gears, solved, self.elements)
        return StiffnessResult(
            self, gears.name, solved, warnings, healthy, tips, tuple(unsolved.items())
        )

    def _solve_torques(
        self, gears: GearSet, index: int, torques: tuple[float, ...], job: Job
    ) -> tuple[StaticsResult, dict[float, str]]:
        """The table of the torques [N m] that are solved, and why others are not."""
        solve = partial(mesh_statics, gears, index, settings=self.elements)
        try:
            return solve(torques, progress=job.report), {}
        except ContactFailure:
            if len(torques) == 1:
                raise
        unsolved = dict[float, str]()
        for torque in torques:
            try:
                solve((torque,), progress=job.report)
            except ContactFailure as error:
                unsolved[torque] = str(error)
                failure = error
        left = tuple(torque for torque in torques if torque not in unsolved)
        if not left:
            raise failure
        return solve(left, progress=job.report), unsolved
