"""Shafts of a gear set under the forces of its teeth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

from fegear.commands.shafts.loads import (
    loaded_shafts,
    meshes_on_shafts,
    torsion_of_gears,
)
from fegear.commands.shafts.result import LoadedShaftsResult
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.yielding import on_shafts, yielding_shafts
from fegear.statics.axes import require_thrust_on_bearings, yielding_axes
from fegear.statics.contact_problem import require_solvable
from fegear.statics.machine import machine_at_rest
from fegear.statics.settings import StaticsSettings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import SettingsGroup, expose, group
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.train_problem import refuse_edits

ELEMENTS = SettingsGroup(kind=StaticsSettings, exposed=expose("plane", "resolution"))
MODEL = "shafts under the forces of teeth"


@dataclass(frozen=True, kw_only=True)
class LoadedShafts(Study, command="shafts", example="shafts helical-machine"):
    """Deflections of shafts, and loads on bearings and meshes.

    Shafts with sections and bearings bend under the forces of teeth, whose places over
    the face width depend on how the axes tilt. Forces are means over a mesh cycle,
    without friction. For every mesh there is the load over the face width with axes
    that yield and with axes that are held, and which misalignment comes from which
    shaft and bearings.
    """

    pictures = PLOT

    gear_set: GearSetRef
    torque: float | None = torque_setting()
    elements: StaticsSettings = group(ELEMENTS)

    def tasks(self) -> Iterator[Task]:
        refuse_edits(self, {"torque": self.torque}, translations=False)
        gears = shafts_that_yield(self.gear_set.nominal(MODEL))
        torque = chosen_torque(gears, self.torque)
        if torque == 0.0:
            raise InputError("torque = 0; shafts need at least 1e-6 N m")
        settings = replace(self.elements, estimate_error=False, root_stress=False)
        yielding_axes(gears)  # refused early
        require_thrust_on_bearings(gears, mesh_torques_at(gears, torque))
        for mesh in range(len(gears.meshes)):
            require_solvable(gears, mesh, settings)
        yield Task("shafts", partial(self._solve, gears, torque, settings))

    def _solve(
        self, gears: GearSet, torque: float, settings: StaticsSettings, job: Job
    ) -> LoadedShaftsResult:
        machine = machine_at_rest(gears, torque, settings, job.report)
        return LoadedShaftsResult(
            self,
            gears.name,
            torque,
            tuple(loaded_shafts(machine)),
            tuple(meshes_on_shafts(machine)),
            machine.exchanges,
            tuple(gear_set_warnings(gears)),
            tuple(torsion_of_gears(gears)),
        )


def shafts_that_yield(gear_set: GearSet) -> GearSet:
    """The gear set on its shafts; InputError where none is described."""
    if gear_set.carrier is not None:
        raise InputError(
            f"{gear_set.name}: planetary sets have no shafts that bend; gears on "
            "fixed axes are needed"
        )
    if not any(yielding_shafts(gear_set)):
        raise InputError(
            f"{gear_set.name}: no [[shaft]] has lengths_mm, diameters_mm, positions_mm "
            "and bearing_positions_mm; one or more are needed"
        )
    return on_shafts(gear_set)
