"""A machine that may rattle from two gears in mesh of a gear set.

Rotations are those of the driver: the driven gear's over the ratio of base radii, its
inertia and drag times that ratio squared. Figures are over the driver's inertia.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from fegear.boundary import mesh_index
from fegear.files.errors import InputError
from fegear.files.output import write_text
from fegear.files.toml import toml_value
from fegear.gearset.inertia import inertia_of
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.torque_limits import MIN_TORQUE
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from fegear.statics.table_warnings import table_warnings
from fegear.studies.page import Page, heading
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import (
    SettingsGroup,
    declared_fields,
    expose,
    group,
    setting,
)
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.trains.gear_sets import GearSetRef, mesh_setting
from lumped.common.checks import format_number
from lumped.common.options import Range
from lumped.common.units import UM
from lumped.rattle.assembly import Assembly, Shafts
from lumped.rattle.machine import Machine
from lumped.rattle.permanent_contact import quiet_motion

ABOVE = Range(above=0.0, below=math.inf)
OF_MESH = (
    "mean_stiffness_N_per_m",
    "peak_to_peak_over_mean",
    "mean_local_stiffness_N_per_m",
)
UNCHANGED = SettingsGroup(
    kind=GearSetRef, exposed={"name": declared_fields(GearSetRef)["name"]}
)
ELEMENTS = SettingsGroup(kind=StaticsSettings, exposed=expose("plane", "resolution"))


@dataclass(frozen=True, kw_only=True)
class MachineFromGears(
    Study,
    command="rattle gears",
    example="rattle gears liu-pair --speed-rpm 1500 --drag-Nm 1 --eccentricity-um 9",
):
    """A machine of two gears in mesh, for the other commands of rattle.

    Its stiffness is the mean mesh stiffness of `fegear stiffness` at the load of the
    drag; its backlash and inertias are those of the gear set.
    """

    pictures = NO_PICTURES
    output = "Write the machine to this TOML file."
    endings = (".toml",)

    gear_set: GearSetRef = field(metadata={"group": UNCHANGED})
    mesh: int = mesh_setting()
    speed_rpm: float = setting(MISSING, "Speed of the driving gear [rpm].", ABOVE)
    drag_Nm: float = setting(
        MISSING,
        "Total drag torque, referred to the driving gear [N\u00a0m].",
        ABOVE,
        option="--drag-Nm",
    )
    eccentricity_um: float = setting(
        MISSING,
        "Once-per-turn transmission error amplitude of the driving gear [um].",
        Range(0.0, below=math.inf),
    )
    driven_share: float | None = setting(
        None,
        "Share of the drag on the driven shaft, a ratio above 0 and below 1. [default: "
        "that of its inertia]",
        Range(above=0.0, below=1.0),
    )
    driving_inertia_kgm2: float | None = setting(
        None,
        "Total inertia of the driving shaft [kg m2]. [default: the gear's]",
        ABOVE,
    )
    driven_inertia_kgm2: float | None = setting(
        None,
        "Total inertia of the driven shaft [kg m2]. [default: the gear's]",
        ABOVE,
    )
    elements: StaticsSettings = group(ELEMENTS)

    @property
    def pair(self) -> Pair:
        """The gears as they run."""
        return Pair(self, self.gear_set.healthy("machines that rattle"))

    def tasks(self) -> Iterator[Task]:
        self.pair.require()
        yield Task("stiffness", self._build_machine)

    def _build_machine(self, job: Job) -> MachineOfGearsResult:
        pair = self.pair
        place = pair.gear_set, self.mesh - 1, (pair.torque,)
        solved = mesh_statics(*place, self.elements, job.report)
        entries = solved.key_figures[0]
        row = {name: entries[name] for name in OF_MESH}
        assembly = pair.assembly(row["mean_stiffness_N_per_m"])
        warnings = [*motion_warnings(pair.gear_set), *table_warnings(solved)]
        return MachineOfGearsResult(
            self, assembly, pair.figures | row, list(pair.inferences), warnings
        )


@dataclass(frozen=True)
class Pair:
    """Two gears as they run, rotations and torques those of the driver."""

    study: MachineFromGears
    gear_set: GearSet

    @property
    def gears(self) -> tuple[Gear, Gear]:
        driver, driven = self.gear_set.meshes[self.study.mesh - 1].gears
        return self.gear_set.gears[driver], self.gear_set.gears[driven]

    @property
    def backlash(self) -> float:
        return self.gear_set.meshes[self.study.mesh - 1].backlash

    @property
    def radius(self) -> float:
        return abs(self.gears[0].geometry.base_radius)

    @property
    def ratio(self) -> float:
        return self.radius / abs(self.gears[1].geometry.base_radius)

    @property
    def inertia(self) -> float:
        """Inertia of the driving shaft [kg m2]."""
        return self.study.driving_inertia_kgm2 or inertia_of(self.gears[0])

    @property
    def other(self) -> float:
        """Inertia of the driven shaft [kg m2]."""
        inertia = self.study.driven_inertia_kgm2 or inertia_of(self.gears[1])
        return inertia * self.ratio**2

    @property
    def share(self) -> float:
        """Share of the drag on the driven shaft."""
        in_ratio = self.other / (self.inertia + self.other)
        return self.study.driven_share or in_ratio

    @property
    def torque(self) -> float:
        """What the drag of the driven shaft takes [N m]."""
        return self.study.drag_Nm * self.share

    def require(self) -> None:
        """Raises InputError for what cannot rattle or is lost in round-off."""
        name, mesh = self.gear_set.name, self.study.mesh
        mesh_index(self.gear_set, mesh)
        if not self.backlash > 0.0:
            raise InputError(
                f"{name} mesh {mesh}: backlash 0, must be above 0; set backlash_um or "
                "tooth_thinning_um"
            )
        if not self.torque >= MIN_TORQUE:
            raise InputError(
                f"drag of the driven shaft = {format_number(self.torque)} N m; must "
                "be from "
                f"{MIN_TORQUE:g}"
            )

    def assembly(self, stiffness: float) -> Assembly:
        """In dimensionless figures; stiffness : of the mesh [N/m]."""
        scale = self.inertia * (self.study.speed_rpm / 60.0) ** 2
        try:
            machine = Machine(
                damping=self.study.drag_Nm / (4.0 * math.pi * scale),
                eccentricity=UM * self.study.eccentricity_um / self.radius,
                half_backlash=0.5 * self.backlash / self.radius,
                stiffness=stiffness * self.radius**2 / scale,
            )
            shafts = Shafts(
                driven_inertia=self.other / self.inertia,
                driving_drag=2.0 * (1.0 - self.share),
                driven_drag=2.0 * self.share,
            )
            return Assembly(machine=machine, shafts=shafts)
        except ValueError as error:
            raise InputError(f"{self.gear_set.name}: {error}") from None

    @property
    def figures(self) -> dict[str, Any]:
        """In the units of their names."""
        return {
            "gear_set": self.gear_set.name,
            "mesh": self.study.mesh,
            "teeth": [gear.geometry.teeth for gear in self.gears],
            "speed_rpm": self.study.speed_rpm,
            "drag_Nm": self.study.drag_Nm,
            "driven_drag_Nm": self.torque,
            "base_radius_mm": 1e3 * self.radius,
            "backlash_um": self.backlash / UM,
            "eccentricity_um": self.study.eccentricity_um,
            "driving_inertia_kg_m2": self.inertia,
            "driven_inertia_kg_m2": self.other / self.ratio**2,
        }

    @property
    def inferences(self) -> Iterator[str]:
        """What was not given."""
        yield "stiffness: the mean over the mesh cycle, which it is taken to keep"
        if self.study.driven_share is None:
            yield "drag of the shafts: in the ratio of their inertias"
        if self.gear_set.inferences:
            yield f"figures of the gears: listed by fegear show {self.gear_set.name}"


@dataclass(frozen=True, eq=False)
class MachineOfGearsResult(StudyResult):
    """The machine and the figures of the gears that it is made from."""

    study: MachineFromGears
    assembly: Assembly
    of_gears: Mapping[str, Any]
    inferences: list[str]
    warnings: list[str]

    @property
    def name(self) -> str:
        return f"{self.of_gears['gear_set']}-mesh-{self.study.mesh}"

    @property
    def description(self) -> str:
        one, two = self.of_gears["teeth"]
        return (
            f"{one}/{two} gears of {self.of_gears['gear_set']} at "
            f"{self.study.speed_rpm:g} rpm, drag {self.study.drag_Nm:g} N m"
        )

    @property
    def _of_machine(self) -> dict[str, float]:
        machine = self.assembly.machine
        return {
            "damping": machine.damping,
            "eccentricity_rad": machine.eccentricity,
            "half_backlash_rad": machine.half_backlash,
            "stiffness": machine.stiffness,
        }

    @cached_property
    def summary(self) -> dict[str, Any]:
        critical = quiet_motion(self.assembly).critical_eccentricity
        return {
            "machine": self.name,
            "description": self.description,
            "inferences": self.inferences,
            **self.of_gears,
            **self._of_machine,
            "shafts": asdict(self.assembly.shafts),
            "critical_eccentricity_rad": critical,
            "critical_eccentricity_um": critical
            * self.of_gears["base_radius_mm"]
            * 1e3,
            "warnings": self.warnings,
        }

    @property
    def text(self) -> str:
        """Text of the machine file."""
        quoted = "".join(
            f"    {toml_value(inference)},\n" for inference in self.inferences
        )
        return "\n".join(
            (
                *(f"# {line}" for line in _lines(self.of_gears)),
                "",
                f"name = {toml_value(self.name)}",
                f"description = {toml_value(self.description)}",
                f"inferences = [\n{quoted}]",
                "",
                "[machine]",
                *_lines(self._of_machine),
                "",
                "[shafts]",
                *_lines(asdict(self.assembly.shafts)),
                "",
            )
        )

    def write(self, path: str | Path) -> None:
        """Write the machine file."""
        write_text(path, self.text)

    def page(self) -> Page:
        values = self.summary
        yield from heading(self)
        yield (
            f"mean mesh stiffness {values['mean_stiffness_N_per_m']:.4g} N/m, peak to "
            f"peak over mean {values['peak_to_peak_over_mean']:.3g}, at "
            f"{values['driven_drag_Nm']:.4g} N m; backlash {values['backlash_um']:.4g} "
            "um"
        )
        yield (
            f"damping {values['damping']:.4g}, stiffness {values['stiffness']:.4g}, "
            f"half backlash {values['half_backlash_rad']:.4g} rad, inertia of the "
            f"driven shaft {values['shafts']['driven_inertia']:.4g} of the driving one"
        )
        yield (
            f"eccentricity {values['eccentricity_um']:.4g} um, critical "
            f"{values['critical_eccentricity_um']:.4g} um or "
            f"{values['critical_eccentricity_rad']:.4g} rad"
        )


def _lines(values: Mapping[str, Any]) -> Iterator[str]:
    return (f"{key} = {toml_value(value)}" for key, value in values.items())
