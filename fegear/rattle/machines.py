"""Machines that may rattle, from TOML files and the built-in collection."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from fegear.errors import InputError
from fegear.gearset.problems import first_problem
from fegear.gearset.read import parsed_toml, path_of
from fegear.gearset.schema import Entries, Keys, Name
from fegear.output import read_text
from lumped.rattle.machine import Machine


class MachineKeys(Keys):
    """The table [machine]; see `lumped.rattle.machine.Machine`."""

    damping: float
    eccentricity_rad: float
    half_backlash_rad: float
    stiffness: float = math.inf
    restitution: float = 1.0
    ripple: float = 0.0
    ripple_order: int = Field(default=1, ge=1, le=1000)
    ripple_phase_rad: float = 0.0


class MachineFile(Keys):
    """A machine file."""

    name: Name
    description: str = ""
    inferences: Entries[str] = ()
    machine: MachineKeys


@dataclass(frozen=True)
class NamedMachine:
    """A machine with its name; inferences : what of it was not printed."""

    name: str
    description: str
    inferences: tuple[str, ...]
    machine: Machine


def load_machine(
    name_or_path: str, changes: Mapping[str, Any] | None = None
) -> NamedMachine:
    """A built-in machine by its name, or the one in a TOML file.

    changes : figures of `Machine` in place of the file's
    Raises InputError, in one line, on anything that cannot be used.
    """
    known = machine_names()
    if name_or_path in known:
        text = (_folder() / f"{name_or_path}.toml").read_text("utf-8")
    else:
        text = read_text(path_of(name_or_path, "machine", known))
    try:
        return _machine(text, changes or {})
    except (InputError, ValueError) as error:
        raise InputError(f"{name_or_path}: {error}") from None


def machine_names() -> list[str]:
    """Names of the machines that come with the program, sorted."""
    files = (Path(item.name) for item in _folder().iterdir())
    return sorted(file.stem for file in files if file.suffix == ".toml")


def _folder() -> Traversable:
    return resources.files("fegear.rattle") / "machines"


def _machine(text: str, changes: Mapping[str, Any]) -> NamedMachine:
    tables = parsed_toml(text)
    try:
        given = MachineFile.model_validate(tables)
    except ValidationError as error:
        raise InputError(first_problem(error, tables)) from None
    keys = {name.removesuffix("_rad"): v for name, v in dict(given.machine).items()}
    machine = replace(Machine(**keys), **changes)
    if not machine.is_impact and machine.restitution != 1.0:
        raise InputError(
            f"restitution = {machine.restitution:g}; belongs to impacts, flanks with a "
            "stiffness have none"
        )
    return NamedMachine(given.name, given.description, given.inferences, machine)


def figures_of(machine: Machine) -> dict[str, float | None]:
    """Plain figures with units in their names; None for an infinite stiffness."""
    units = {name: f"{name}_rad" for name in ("eccentricity", "half_backlash")}
    units["ripple_phase"] = "ripple_phase_rad"
    values = {f.name: getattr(machine, f.name) for f in fields(machine)}
    return {
        units.get(name, name): value if math.isfinite(value) else None
        for name, value in values.items()
    }
