"""A machine that may rattle from two gears in mesh of a gear set.

Rotations are those of the driver: the driven gear's over the ratio of base radii, its
inertia and drag times that ratio squared. Figures are over the driver's inertia.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from fegear.errors import InputError
from fegear.gearset.inertia import inertia_of
from fegear.gearset.model import Gear, GearSet
from lumped.progress import Progress, silent
from lumped.rattle.assembly import Assembly, Shafts
from lumped.rattle.machine import Machine
from lumped.rattle.quiet import quiet_motion

if TYPE_CHECKING:
    from fegear.statics import StaticsSettings

UM = 1e-6
OF_MESH = (
    "mean_stiffness_N_per_m",
    "peak_to_peak_over_mean",
    "mean_local_stiffness_N_per_m",
)
LEAST_TORQUE = 1e-6  # N m on the driver, less is lost in round-off


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """How two gears run.

    speed : of the driver [turns per second]
    drag : of both shafts, as a torque on the driver [N m]
    eccentricity : amplitude of the transmission error at the driver's turn [m]
    driven_share : of the drag; by default in the ratio of the inertias
    driving_inertia, driven_inertia : of all on the shaft [kg m2]; by default the gear's
    """

    speed: float
    drag: float
    eccentricity: float
    driven_share: float | None = None
    driving_inertia: float | None = None
    driven_inertia: float | None = None


@dataclass(frozen=True)
class MachineOfGears:
    """The machine and the figures of the gears that it is made from."""

    name: str
    inferences: tuple[str, ...]
    assembly: Assembly
    figures: Mapping[str, Any]
    warnings: tuple[str, ...]

    @property
    def description(self) -> str:
        one, two = self.figures["teeth"]
        return (
            f"{one}/{two} gears of {self.figures['gear_set']} at "
            f"{self.figures['speed_rpm']:g} rpm, drag {self.figures['drag_Nm']:g} N m"
        )

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        machine = self.assembly.machine
        critical = quiet_motion(self.assembly).critical_eccentricity
        return {
            "machine": self.name,
            "description": self.description,
            "inferences": list(self.inferences),
            **self.figures,
            "damping": machine.damping,
            "eccentricity_rad": machine.eccentricity,
            "half_backlash_rad": machine.half_backlash,
            "stiffness": machine.stiffness,
            "shafts": asdict(self.assembly.shafts),
            "critical_eccentricity_rad": critical,
            "critical_eccentricity_um": critical * self.figures["base_radius_mm"] * 1e3,
            "warnings": list(self.warnings),
        }

    @property
    def text(self) -> str:
        """Of a machine file."""
        machine = self.assembly.machine
        notes = (f"# {key} = {_toml(value)}" for key, value in self.figures.items())
        quoted = "".join(f"    {_toml(each)},\n" for each in self.inferences)
        figures = {
            "damping": machine.damping,
            "eccentricity_rad": machine.eccentricity,
            "half_backlash_rad": machine.half_backlash,
            "stiffness": machine.stiffness,
        }
        return "\n".join(
            (
                *notes,
                "",
                f"name = {_toml(self.name)}",
                f"description = {_toml(self.description)}",
                f"inferences = [\n{quoted}]",
                "",
                "[machine]",
                *(f"{key} = {_toml(value)}" for key, value in figures.items()),
                "",
                "[shafts]",
                *(
                    f"{key} = {_toml(value)}"
                    for key, value in asdict(self.assembly.shafts).items()
                ),
                "",
            )
        )


@dataclass(frozen=True)
class _Pair:
    """Two gears as they run, rotations and torques those of the driver.

    inertia : of the driving shaft; other : of the driven one [kg m2]
    share : of the drag on the driven shaft
    """

    gear_set: GearSet
    mesh: int
    conditions: Conditions

    @property
    def gears(self) -> tuple[Gear, Gear]:
        driver, driven = self.gear_set.meshes[self.mesh].gears
        return self.gear_set.gears[driver], self.gear_set.gears[driven]

    @property
    def backlash(self) -> float:
        return self.gear_set.meshes[self.mesh].backlash

    @property
    def radius(self) -> float:
        return self.gears[0].geometry.base_radius

    @property
    def ratio(self) -> float:
        return self.radius / self.gears[1].geometry.base_radius

    @property
    def inertia(self) -> float:
        return self.conditions.driving_inertia or inertia_of(self.gears[0])

    @property
    def other(self) -> float:
        own = self.conditions.driven_inertia or inertia_of(self.gears[1])
        return own * self.ratio**2

    @property
    def share(self) -> float:
        in_ratio = self.other / (self.inertia + self.other)
        return self.conditions.driven_share or in_ratio

    @property
    def torque(self) -> float:
        """What the drag of the driven shaft takes [N m]."""
        return self.conditions.drag * self.share

    def require(self) -> None:
        """Raises InputError for what cannot rattle or is lost in round-off."""
        name = f"{self.gear_set.name} mesh {self.mesh + 1}"
        if not self.backlash > 0.0:
            raise InputError(
                f"{name}: backlash 0, must be above 0; set backlash_um or "
                "tooth_thinning_um"
            )
        if not self.torque >= LEAST_TORQUE:
            raise InputError(
                f"drag of the driven shaft = {self.torque:g} N m; allowed from "
                f"{LEAST_TORQUE:g}"
            )

    def assembly(self, stiffness: float) -> Assembly:
        """In dimensionless figures; stiffness : of the mesh [N/m]."""
        conditions = self.conditions
        scale = self.inertia * conditions.speed**2
        try:
            machine = Machine(
                damping=conditions.drag / (4.0 * math.pi * scale),
                eccentricity=conditions.eccentricity / self.radius,
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
        conditions = self.conditions
        return {
            "gear_set": self.gear_set.name,
            "mesh": self.mesh + 1,
            "teeth": [gear.geometry.teeth for gear in self.gears],
            "speed_rpm": 60.0 * conditions.speed,
            "drag_Nm": conditions.drag,
            "driven_drag_Nm": self.torque,
            "base_radius_mm": 1e3 * self.radius,
            "backlash_um": self.backlash / UM,
            "eccentricity_um": conditions.eccentricity / UM,
            "driving_inertia_kg_m2": self.inertia,
            "driven_inertia_kg_m2": self.other / self.ratio**2,
        }


def machine_of_gears(
    gear_set: GearSet,
    mesh: int,
    conditions: Conditions,
    settings: StaticsSettings,
    report: Progress = silent,
) -> MachineOfGears:
    """The machine of a mesh (index from 0), its stiffness by finite elements.

    The stiffness is the mean one at the torque that the driven shaft's drag takes.
    Raises InputError without backlash.
    """
    from fegear.statics import solve_mesh

    pair = _Pair(gear_set, mesh, conditions)
    pair.require()
    solved = solve_mesh(gear_set, mesh, (pair.torque,), settings, report).summary
    row = solved["torques"][0]
    return MachineOfGears(
        f"{gear_set.name}-mesh-{mesh + 1}",
        tuple(_inferences(gear_set, conditions)),
        pair.assembly(row["mean_stiffness_N_per_m"]),
        pair.figures | {name: row[name] for name in OF_MESH},
        tuple(solved.get("warnings", ())),
    )


def _inferences(gear_set: GearSet, conditions: Conditions) -> Iterator[str]:
    yield "stiffness: the mean over the mesh cycle, which it is taken to keep"
    if conditions.driven_share is None:
        yield "drag of the shafts: in the ratio of their inertias"
    if gear_set.inferences:
        yield f"figures of the gears: listed by fegear show {gear_set.name}"


def _toml(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
