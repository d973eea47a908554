"""Which gear set, with which changes, and which of its meshes."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from fegear.boundary import require_gear_set
from fegear.files.contents import exact_repr
from fegear.files.errors import InputError
from fegear.files.toml import toml_value
from fegear.gearset import load_gear_set
from fegear.gearset.edit import parsed_value
from fegear.gearset.faults.checks import require_no_faults, require_nominal
from fegear.gearset.faults.tooth_faults import FAULT_KINDS
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.read import files_of_gear_set
from fegear.studies.settings import argument, display_name, require_settings, setting
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, kw_only=True)
class GearSetRef(ShortRepr):
    """A gear set by its name, and what is changed in it for one run.

    preloaded : the gear set itself, in place of one that is read
    """

    name: str = argument(
        "SET",
        "Name of a built-in gear set, or path of a gear-set file (TOML).",
        reads=True,
    )
    edits: tuple[str, ...] = setting(
        (),
        "Change a key of the gear set for this run, such as "
        "mesh.1.tip_relief.magnitude_um=10; may be repeated.",
        option="--set",
        metavar="KEY=VALUE",
    )
    preloaded: GearSet | None = None

    def __post_init__(self) -> None:
        require_settings(self)
        _ = self.overrides  # refuses what is no change

    @classmethod
    def of(cls, value: str | GearSet) -> GearSetRef:
        """A gear set by its name, or itself.

        One that was loaded and is as it was is that of its name and edits, which files
        and commands have.
        """
        if isinstance(value, str):
            return cls(name=value)
        require_gear_set(value)
        with suppress(InputError):
            if value.origin and value == load_gear_set(
                value.origin.name, value.origin.edits
            ):
                changes = value.origin.edits.items()
                edits = tuple(f"{key}={toml_value(new)}" for key, new in changes)
                return cls(name=value.origin.name, edits=edits)
        return cls(name=value.name, preloaded=value)

    @cached_property
    def overrides(self) -> dict[str, Any]:
        """Values by key; InputError where there is no `=` or a key comes twice."""
        values: dict[str, Any] = {}
        for text in self.edits:
            key, separator, value = (part.strip() for part in text.partition("="))
            if not (separator and key and value):
                raise self.rejection(text, "KEY=VALUE is needed")
            if key in values:
                raise self.rejection(text, f"{key} is given more than once")
            values[key] = parsed_value(value)
        return values

    @cached_property
    def loaded(self) -> GearSet:
        """The gear set as changed."""
        return self.changed({})

    def warnings(self, joins_housing: bool = False) -> tuple[str, ...]:
        """Warnings of the gear set, a line each.

        joins_housing : whether shafts are in the housing
        """
        return tuple(gear_set_warnings(self.loaded, joins_housing))

    def healthy(self, model: str) -> GearSet:
        """The gear set; InputError with faults, which a model leaves out."""
        require_no_faults(self.loaded, FAULT_KINDS, model)
        return self.loaded

    def nominal(self, model: str) -> GearSet:
        """The gear set; InputError with faults or errors, which a model leaves out."""
        require_nominal(self.loaded, model)
        return self.loaded

    def changed(self, values: Mapping[str, Any]) -> GearSet:
        """The gear set with other values of keys as well."""
        changes = {**self.overrides, **values}
        if self.preloaded is None:
            return load_gear_set(self.name, changes)
        if changes:
            raise InputError(
                f"{', '.join(changes)}: needs the name of a gear set or of its file, "
                "this one was made in Python"
            )
        return self.preloaded

    def rejection(self, text: str, reason: str) -> InputError:
        """Why a change is not made, or does nothing."""
        return InputError(f"{display_name(self, 'edits')} {text}; {reason}")

    @property
    def entries(self) -> dict[str, str]:
        """Entries for the header of a file: what was changed."""
        return {f"set {key}": str(value) for key, value in self.overrides.items()}

    @property
    def inputs(self) -> str:
        """All that a checkpoint must agree with."""
        return exact_repr(self.loaded)

    @property
    def named_files(self) -> list[str]:
        """Files that the gear-set file names."""
        return self.files_with({})

    def files_with(self, values: Mapping[str, Any]) -> list[str]:
        """Files that the gear-set file names, with other values of keys as well."""
        if self.preloaded is not None:
            return []
        return files_of_gear_set(self.name, {**self.overrides, **values})


DEFAULT_PAIR = GearSetRef(name="liu-pair")


def mesh_setting() -> Any:
    return setting(1, "Number of the mesh, counted from 1.")
