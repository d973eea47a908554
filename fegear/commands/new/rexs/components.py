"""Components, attributes and relations of a REXS model, and their units.

REXS (Reusable Engineering EXchange Standard, https://rexs.info) describes a gearbox by
components, such as `cylindrical_gear`, and by relations between them, such as `stage`.
The standard fixes the unit of every attribute; a file repeats it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from fegear.files.errors import InputError

NONE = ("none", "")
# By quantity: what one of the unit is in the unit of the gear-set file, that of the
# standard first. Units are compared without spaces.
UNITS: dict[str, dict[str, float]] = {
    "length": {"mm": 1.0, "mum": 1e-3, "um": 1e-3, "cm": 10.0, "m": 1e3},
    "angle": {"deg": 1.0, "\u00b0": 1.0, "rad": 180.0 / math.pi},
    "modulus": {"N/mm^2": 1e-3, "MPa": 1e-3, "GPa": 1.0, "Pa": 1e-9, "N/m^2": 1e-9},
    "density": {"kg/dm^3": 1e3, "g/cm^3": 1e3, "kg/m^3": 1.0},
    "torque": {"Nm": 1.0, "Nmm": 1e-3, "kNm": 1e3},
    "speed": {
        "1/min": 1.0,
        "rpm": 1.0,
        "1/s": 60.0,
        "Hz": 60.0,
        "rad/s": 30.0 / math.pi,
    },
    "ratio": {"none": 1.0, "": 1.0, "%": 1e-2},
}
MICRO_SIGNS = str.maketrans("\u00b5\u03bc", "uu")  # both signs for micro


@dataclass(frozen=True)
class Attribute:
    """unit : None where the file states none; value : text, number or list."""

    name: str
    unit: str | None
    value: Any


@dataclass(frozen=True)
class Component:
    """A part of a gearbox, and its attributes by name."""

    number: int
    kind: str
    name: str
    attributes: Mapping[str, Attribute]

    @property
    def label(self) -> str:
        """Type, id and name, as messages call it."""
        return f'{self.kind} {self.number} "{self.name}"'

    def quantity(self, name: str, quantity: str) -> float | None:
        """An attribute in the unit of the gear-set file, None where it is missing.

        quantity : of `UNITS`
        """
        attribute = self.attributes.get(name)
        if attribute is None:
            return None
        return self._number(attribute) * self._factor(attribute, quantity)

    def require_quantity(self, name: str, quantity: str) -> float:
        value = self.quantity(name, quantity)
        if value is None:
            raise InputError(f"{self.label}: attribute {name} is missing")
        return value

    def require_integer(self, name: str) -> int:
        value = self.require_quantity(name, "ratio")
        if not value.is_integer():
            raise self._refusal(name, f"{value:g}", "must be a whole number")
        return int(value)

    def truth(self, name: str) -> bool | None:
        """A truth value, None where it is missing."""
        attribute = self.attributes.get(name)
        if attribute is None:
            return None
        text = str(attribute.value).strip().lower()
        if text not in ("true", "false"):
            raise self._refusal(name, text, "must be true or false")
        return text == "true"

    def vector(self, name: str) -> tuple[float, ...] | None:
        """A list of three lengths [mm], None where there is no such list."""
        attribute = self.attributes.get(name)
        if attribute is None or not isinstance(attribute.value, list):
            return None
        if len(attribute.value) != 3:
            return None
        factor = self._factor(attribute, "length")
        entries = (Attribute(name, None, value) for value in attribute.value)
        return tuple(factor * self._number(entry) for entry in entries)

    def _number(self, attribute: Attribute) -> float:
        value = attribute.value
        try:
            number = math.nan if isinstance(value, bool | list) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not math.isfinite(number):
            text = "a list" if isinstance(value, list) else str(value).strip()
            raise self._refusal(attribute.name, text, "must be a finite number")
        return number

    def _factor(self, attribute: Attribute, quantity: str) -> float:
        units = UNITS[quantity]
        unit = "".join((attribute.unit or "").translate(MICRO_SIGNS).split())
        if unit in NONE:  # then it is that of the standard
            return next(iter(units.values()))
        if unit not in units:
            raise InputError(
                f'{self.label}: {attribute.name} has unit "{attribute.unit}"; allowed '
                f"are {', '.join(filter(None, units))}"
            )
        return units[unit]

    def _refusal(self, name: str, value: str, reason: str) -> InputError:
        return InputError(f"{self.label}: {name} = {value[:40]}; {reason}")


@dataclass(frozen=True)
class Relation:
    """roles : pairs of role and number of the component"""

    number: int
    kind: str
    roles: tuple[tuple[str, int], ...]

    def role(self, name: str) -> int | None:
        """Number of the component in a role, None where there is none."""
        return next((number for role, number in self.roles if role == name), None)


@dataclass(frozen=True)
class RexsModel:
    """A gearbox; load_cases : components by number, with attributes of a load case."""

    version: str
    application: str
    components: Mapping[int, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[Mapping[int, Component], ...]

    def related(self, kind: str, role: str, number: int, other: str) -> Iterator[int]:
        """Components in another role of relations of a kind with a component.

        kind : of the relation, or the end of its name, as in `ordered_assembly`
        """
        for relation in self.relations:
            if relation.kind.endswith(kind) and relation.role(role) == number:
                yield from (n for name, n in relation.roles if name == other)

    def of_kind(self, kind: str) -> list[Component]:
        return [item for item in self.components.values() if item.kind == kind]
