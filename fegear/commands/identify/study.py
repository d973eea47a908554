"""Face width and hub radii of a gear set from its measured mesh stiffness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from fegear.commands.identify.least_squares import (
    MeasuredStiffness,
    identify,
    stiffness_model,
)
from fegear.commands.identify.result import IdentificationResult
from fegear.files.errors import InputError
from fegear.gearset.leads import require_uniform_loads
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.settings import StaticsSettings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import SettingsGroup, display_name, expose, group, setting
from fegear.studies.study import Study
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.train_problem import refuse_edits
from lumped.common.options import Range

PART = Range(above=0.0, below=1.0)


@dataclass(frozen=True, kw_only=True)
class Identification(
    Study,
    command="identify",
    example="identify liu-pair --mean 2.9e8 --variation 0.35",
):
    """Face width and hub radii that give measured stiffnesses.

    A weighted least-squares fit of one factor on all face widths and of every gear's
    hub radius. Where several sets are equally good, they are listed as well.
    """

    gear_set: GearSetRef
    mean: tuple[float, ...] = setting(
        (),
        "Measured mean mesh stiffness [N/m], once for each mesh in order. [default: "
        "mean_stiffness_N_per_m of the gear set]",
        Range(above=0.0, below=1e12, unit="N/m"),
    )
    variation: tuple[float, ...] = setting(
        (),
        "Measured peak-to-peak mesh stiffness over its mean, once for each mesh in "
        "order. [default: stiffness_variation of the gear set]",
        PART,
    )
    mean_std: float = setting(
        MeasuredStiffness.mean_std,
        "Relative standard deviation of the mean stiffnesses.",
        PART,
    )
    variation_std: float = setting(
        MeasuredStiffness.variation_std,
        "Standard deviation of the variations.",
        PART,
    )
    hold_width: bool = setting(
        False,
        "Identify hub radii only; the face widths stay.",
        option="--hold-width",
    )
    along: str | None = setting(
        None,
        "Gear whose hub radius parametrises the valley of equally good sets. "
        "[default: the first gear]",
        metavar="GEAR",
    )
    torque: float | None = torque_setting()
    elements: StaticsSettings = group(
        SettingsGroup(kind=StaticsSettings, exposed=expose("plane", "resolution"))
    )

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError for an edit that changes nothing."""
        refuse_edits(self, {"torque": self.torque}, translations=False, figures=True)
        return self.gear_set.healthy("identification")

    @property
    def start(self) -> int:
        """Index of the gear whose hub radius runs."""
        names = [gear.name for gear in self.gears.gears]
        if self.along not in (None, *names):
            choices = ", ".join(names)
            raise InputError(f"along {self.along}; {self.gears.name} has {choices}")
        return 0 if self.along is None else names.index(self.along)

    @property
    def measured(self) -> MeasuredStiffness:
        """What the settings and the gear set know of the meshes."""
        torque, name, meshes = (
            chosen_torque(self.gears, self.torque),
            self.gears.name,
            self.gears.meshes,
        )
        if torque <= 0.0:
            allowed = "must be positive, on the input gear [N m]"
            raise InputError(f"torque = {torque:.12g}; {allowed}")
        for word, values in (("mean", self.mean), ("variation", self.variation)):
            if values and len(values) != len(meshes):
                raise InputError(
                    f"{word} is given {len(values)} times; {name} has {len(meshes)} "
                    "meshes, one for each is needed"
                )
        mean = self.mean or [mesh.mean_stiffness for mesh in meshes]
        variation = self.variation or [mesh.stiffness_variation for mesh in meshes]
        if not any(mean) and not any(variation):
            raise InputError(
                f"{display_name(self, 'mean')} or "
                f"{display_name(self, 'variation')} is missing; "
                f"{name} has no mean_stiffness_N_per_m and no stiffness_variation"
            )
        return MeasuredStiffness(
            torque=np.array(mesh_torques_at(self.gears, torque)),
            mean=np.array(mean, float),
            variation=np.array(variation, float),
            mean_std=self.mean_std,
            variation_std=self.variation_std,
        )

    def tasks(self) -> Iterator[Task]:
        require_uniform_loads(self.gears, "identifications")
        work = partial(self._identify, self.gears, self.start, self.measured)
        yield Task("hubs", work)

    def _identify(
        self, gears: GearSet, start: int, measured: MeasuredStiffness, job: Job
    ) -> IdentificationResult:
        model = stiffness_model(gears, measured.torque, self.elements, job.report)
        solution = identify(model, measured, self.hold_width, start, job.report)
        return IdentificationResult(self, gears, measured, solution)
