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
from fegear.gearset.model import GearSet
from lumped.rattle.assembly import Assembly, Shafts
from lumped.rattle.machine import Machine
from lumped.rattle.quiet import quiet_motion

if TYPE_CHECKING:
    from fegear.statics import Progress, StaticsSettings

UM = 1e-6
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


def machine_of_gears(
    gear_set: GearSet,
    mesh: int,
    conditions: Conditions,
    settings: StaticsSettings,
    report: Progress = lambda what, done, total: None,
) -> MachineOfGears:
    """The machine of a mesh (index from 0), its stiffness by finite elements.

    The stiffness is the mean one at the torque that the driven shaft's drag takes.
    Raises InputError without backlash.
    """
    from fegear.statics import solve_mesh

    own = gear_set.meshes[mesh]
    driver, driven = (gear_set.gears[i] for i in own.gears)
    if not own.backlash > 0.0:
        raise InputError(
            f"{gear_set.name} mesh {mesh + 1}: backlash 0, must be above 0; set "
            "backlash_um or tooth_thinning_um"
        )
    radius = driver.geometry.base_radius
    ratio = radius / driven.geometry.base_radius
    inertia = conditions.driving_inertia or inertia_of(driver)
    other = (conditions.driven_inertia or inertia_of(driven)) * ratio**2
    share = conditions.driven_share or other / (inertia + other)
    torque = conditions.drag * share
    if not torque >= LEAST_TORQUE:
        raise InputError(
            f"drag of the driven shaft = {torque:g} N m; allowed from {LEAST_TORQUE:g}"
        )
    solved = solve_mesh(gear_set, mesh, (torque,), settings, report).summary
    row = solved["torques"][0]
    stiffness = row["mean_stiffness_N_per_m"]
    scale = inertia * conditions.speed**2
    try:
        machine = Machine(
            damping=conditions.drag / (4.0 * math.pi * scale),
            eccentricity=conditions.eccentricity / radius,
            half_backlash=0.5 * own.backlash / radius,
            stiffness=stiffness * radius**2 / scale,
        )
        shafts = Shafts(
            driven_inertia=other / inertia,
            driving_drag=2.0 * (1.0 - share),
            driven_drag=2.0 * share,
        )
        assembly = Assembly(machine=machine, shafts=shafts)
    except ValueError as error:
        raise InputError(f"{gear_set.name}: {error}") from None
    figures = {
        "gear_set": gear_set.name,
        "mesh": mesh + 1,
        "teeth": [gear.geometry.teeth for gear in (driver, driven)],
        "speed_rpm": 60.0 * conditions.speed,
        "drag_Nm": conditions.drag,
        "driven_drag_Nm": torque,
        "base_radius_mm": 1e3 * radius,
        "backlash_um": own.backlash / UM,
        "eccentricity_um": conditions.eccentricity / UM,
        "driving_inertia_kg_m2": inertia,
        "driven_inertia_kg_m2": other / ratio**2,
        "mean_stiffness_N_per_m": stiffness,
        "peak_to_peak_over_mean": row["peak_to_peak_over_mean"],
        "mean_local_stiffness_N_per_m": row["mean_local_stiffness_N_per_m"],
    }
    return MachineOfGears(
        f"{gear_set.name}-mesh-{mesh + 1}",
        tuple(_inferences(gear_set, conditions)),
        assembly,
        figures,
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
