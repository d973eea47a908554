"""Machines that may rattle, from TOML files and the built-in collection."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from fegear.files.errors import InputError
from fegear.files.kinds import require_kind
from fegear.files.output import read_text
from fegear.gearset.edit import with_values
from fegear.gearset.problems import first_problem
from fegear.gearset.read import builtin_names, parsed_toml, path_of
from fegear.gearset.schema import (
    Entries,
    Keys,
    Name,
    require_all_or_none,
    require_exactly_one,
)
from lumped.common.csv_text import format_exact
from lumped.rattle.assembly import Absorber, Assembly, Shafts, SprungGear
from lumped.rattle.machine import Machine, effective_eccentricity

GEAR_ECCENTRICITY_KEYS = (
    "driving_eccentricity_rad",
    "driven_eccentricity_rad",
    "eccentricity_phase_rad",
)
OF_A_GEAR_SET = "is a gear set; fegear rattle gears makes a machine of its gears"
ANGLES = {"eccentricity", "half_backlash", "ripple_phase"}
PARTS = {
    "shafts": Shafts,
    "driving_gear": SprungGear,
    "driven_gear": SprungGear,
    "absorber": Absorber,
}


# Limits far beyond any machine, so that no product of them leaves the range of numbers.
Positive = Annotated[float, Field(ge=1e-9, le=1e9)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]
Signed = Annotated[float, Field(ge=-1e9, le=1e9)]
Length = Annotated[float, Field(ge=1e-6, le=1e3)]
Small = Annotated[float, Field(ge=0.0, le=1e3)]  # angles and lengths


class MachineKeys(Keys):
    """The table [machine]; see `lumped.rattle.machine.Machine`."""

    damping: Positive = Field(
        description="Damping of a shaft over its inertia and its speed in turns per "
        "second."
    )
    eccentricity_rad: Small | None = Field(
        default=None, description="Amplitude of the transmission error."
    )
    driving_eccentricity_rad: Small | None = Field(
        default=None,
        description="Eccentricity of the driving gear over its pitch radius, instead of"
        " eccentricity_rad.",
    )
    driven_eccentricity_rad: Small | None = Field(
        default=None,
        description="Eccentricity of the driven gear over its pitch radius.",
    )
    eccentricity_phase_rad: Signed | None = Field(
        default=None, description="Angle between the long sides of both gears."
    )
    half_backlash_rad: Positive = Field(description="Half of the backlash.")
    stiffness: Annotated[float, Field(ge=1e-9, le=1e15)] = Field(
        default=math.inf,
        description="Stiffness of the flanks over the inertia and the squared speed in "
        "turns per second. [default: infinite, the limit of impacts]",
    )
    restitution: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=1.0, description="Coefficient of restitution, in the limit of impacts."
    )
    ripple: Signed = Field(
        default=0.0,
        description="Amplitude of the torque ripple over the inertia and the squared "
        "speed in turns per second.",
    )
    ripple_order: int = Field(
        default=1, ge=1, le=1000, description="Periods of the torque ripple per turn."
    )
    ripple_phase_rad: Signed = Field(
        default=0.0, description="Phase of the torque ripple."
    )

    @model_validator(mode="after")
    def _one_eccentricity(self) -> MachineKeys:
        require_all_or_none(self, *GEAR_ECCENTRICITY_KEYS)
        require_exactly_one(self, "eccentricity_rad", GEAR_ECCENTRICITY_KEYS[0])
        return self


class ShaftsKeys(Keys):
    """The table [shafts]; see `lumped.rattle.assembly.Shafts`."""

    driving_inertia: Positive = Field(
        default=1.0,
        description="Inertia of the driving shaft over that of equal shafts.",
    )
    driven_inertia: Positive = Field(
        default=1.0,
        description="Inertia of the driven shaft over that of equal shafts.",
    )
    driving_drag: Positive = Field(
        default=1.0, description="Drag of the driving shaft over that of equal shafts."
    )
    driven_drag: Positive = Field(
        default=1.0, description="Drag of the driven shaft over that of equal shafts."
    )


class SprungGearKeys(Keys):
    """The table [driven_gear]; see `lumped.rattle.assembly.SprungGear`."""

    stiffness: Positive = Field(
        description="Stiffness of the spring, scaled as in [machine]."
    )
    inertia: NotNegative = Field(
        default=0.0, description="Inertia of the gear over that of a shaft."
    )
    damping: NotNegative = Field(
        default=0.0, description="Damping of the spring, scaled as in [machine]."
    )


class DrivingGearKeys(SprungGearKeys):
    """The table [driving_gear]."""

    motor_on_gear: bool = Field(
        default=False,
        description="Whether the torque acts on the gear and not on the shaft behind "
        "the spring.",
    )


class AbsorberKeys(Keys):
    """The table [absorber]; see `lumped.rattle.assembly.Absorber`."""

    mass: Annotated[float, Field(ge=1e-12, le=1e9)] = Field(
        description="Mass of the pendulum over inertia over squared pitch radius."
    )
    pivot_radius: Length = Field(
        description="Distance from the gear's centre to that of the path, over the "
        "pitch radius."
    )
    path_radius: Length = Field(description="Radius of the path over the pitch radius.")
    damping: NotNegative = Field(
        default=0.0,
        description="Damping force along the path per angle, over inertia times speed "
        "over pitch radius.",
    )
    gear_eccentricity_rad: Small = Field(
        default=0.0, description="Eccentricity of the gear over the pitch radius."
    )
    offset_angle_rad: Signed = Field(
        default=0.0, description="Angle from the eccentricity to the neutral position."
    )
    gear: Literal["driving", "driven"] = Field(
        default="driving", description="Gear that carries the pendulum."
    )


class MachineFile(Keys):
    """A machine file."""

    name: Name = Field(description="Name of the machine.")
    description: str = Field(default="", description="A line about the machine.")
    inferences: Entries[str] = Field(
        default=(),
        description="Values that the source lacks, and how they were chosen.",
    )
    machine: MachineKeys = Field(description="Two equal shafts geared one to one.")
    shafts: ShaftsKeys = Field(
        default=ShaftsKeys(), description="Shafts that are unequal."
    )
    driving_gear: DrivingGearKeys | None = Field(
        default=None, description="Driving gear on a torsional spring."
    )
    driven_gear: SprungGearKeys | None = Field(
        default=None, description="Driven gear on a torsional spring."
    )
    absorber: AbsorberKeys | None = Field(
        default=None, description="Centrifugal pendulum on a gear."
    )


@dataclass(frozen=True)
class NamedMachine:
    """A machine with its name; inferences : what of it was not printed.

    gear_eccentricities : of the driving and the driven gear and the phase between them
        [rad], where they are known
    """

    name: str
    description: str
    inferences: tuple[str, ...]
    assembly: Assembly
    gear_eccentricities: tuple[float, float, float] | None = None

    @property
    def machine(self) -> Machine:
        """Its one equation of relative motion; InputError where it has more."""
        try:
            return self.assembly.as_machine()
        except ValueError as error:
            raise InputError(
                f"{self.name}: {error}; only fegear rattle critical and noise take a "
                "machine whose relative rotation has no equation of its own"
            ) from None

    @property
    def heading(self) -> dict[str, Any]:
        """What every summary says of it first."""
        return {
            "machine": self.name,
            "description": self.description,
            "inferences": list(self.inferences),
        }


def load_machine(
    name_or_path: str,
    changes: Mapping[str, Any] | None = None,
    edits: Mapping[str, Any] | None = None,
) -> NamedMachine:
    """A built-in machine by its name, or the one in a TOML file.

    changes : figures of `Machine` in place of the file's
    edits : values to set in the file before it is read, by `table.key`
    Raises InputError, in one line, on anything that cannot be used.
    """
    names = machine_names()
    if name_or_path in builtin_names():
        raise InputError(f"{name_or_path}: {OF_A_GEAR_SET}")
    if name_or_path in names:
        text = (_machine_folder() / f"{name_or_path}.toml").read_text("utf-8")
    else:
        text = read_text(path_of(name_or_path, "machine", names))
    try:
        return _machine_from_tables(
            with_values(parsed_toml(text), edits or {}), changes or {}
        )
    except (InputError, ValueError) as error:
        raise InputError(f"{name_or_path}: {error}") from None


def machine_names() -> list[str]:
    """Names of the machines that come with the program, sorted."""
    files = (Path(item.name) for item in _machine_folder().iterdir())
    return sorted(file.stem for file in files if file.suffix == ".toml")


def _machine_folder() -> Traversable:
    return resources.files("fegear.commands.rattle") / "machines"


def _machine_from_tables(
    tables: dict[str, Any], changes: Mapping[str, Any]
) -> NamedMachine:
    if "gear" in tables:
        raise InputError(OF_A_GEAR_SET)
    require_kind(tables, "machine")
    try:
        file = MachineFile.model_validate(tables)
    except ValidationError as error:
        raise InputError(first_problem(error, tables, MachineFile)) from None
    figures = _converted_values(file.machine)
    gears = [figures.pop(name.removesuffix("_rad")) for name in GEAR_ECCENTRICITY_KEYS]
    of_gears = None if gears[0] is None else (gears[0], gears[1], gears[2])
    if of_gears is not None:
        figures["eccentricity"] = effective_eccentricity(*of_gears)
    if "eccentricity" in changes:
        of_gears = None
    machine = replace(Machine(**figures), **changes)
    if not machine.is_impact and machine.restitution != 1.0:
        raise InputError(
            f"restitution = {machine.restitution:g}; belongs to impacts, flanks with a "
            "stiffness have none"
        )
    parts = {
        name: _part(name, keys)
        for name in PARTS
        if (keys := getattr(file, name)) is not None
    }
    return NamedMachine(
        *(file.name, file.description, file.inferences),
        Assembly(machine=machine, **parts),
        of_gears,
    )


def _converted_values(keys: Keys) -> dict[str, Any]:
    return {name.removesuffix("_rad"): value for name, value in dict(keys).items()}


def _part(name: str, keys: Keys) -> Any:
    try:
        return PARTS[name](**_converted_values(keys))
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None


def parameters(machine: Machine) -> dict[str, float | None]:
    """Plain figures with units in their names; None for an infinite stiffness."""
    values = {f.name: getattr(machine, f.name) for f in fields(machine)}
    return {
        unit_name(name): value if math.isfinite(value) else None
        for name, value in values.items()
    }


def header_of(figures: Mapping[str, float | None]) -> dict[str, str]:
    """Parameters of a machine as the header of a table says them."""
    return {k: "impacts" if v is None else format_exact(v) for k, v in figures.items()}


def unit_name(figure: str) -> str:
    """A figure of `Machine` with its unit."""
    return f"{figure}_rad" if figure in ANGLES else figure
