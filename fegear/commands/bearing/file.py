"""A file of one rolling bearing, without gears."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import Field, ValidationError, model_validator

from fegear.files.errors import InputError
from fegear.files.kinds import SIGNS
from fegear.gearset.bearing_keys import BallBearingEntry, RollerBearingEntry
from fegear.gearset.edit import with_values
from fegear.gearset.problems import first_problem
from fegear.gearset.schema import ROLLING_KEYS, Keys, Name
from lumped.bearings.rolling import RollingBearing


class BearingFile(Keys):
    """A bearing file."""

    name: Name = Field(default="bearing", description="Name of the bearing.")
    description: str = Field(default="", description="A line about the bearing.")
    ball_bearing: BallBearingEntry | None = Field(
        default=None, description="Ball bearing."
    )
    roller_bearing: RollerBearingEntry | None = Field(
        default=None,
        description="Cylindrical roller bearing, instead of ball_bearing.",
    )

    @model_validator(mode="after")
    def _one_bearing(self) -> BearingFile:
        if len(self.present(*ROLLING_KEYS)) != 1:
            raise ValueError(f"one of {' and '.join(ROLLING_KEYS)} is needed")
        return self

    def build(self) -> RollingBearing:
        """The bearing in SI units; InputError if elements do not fit."""
        (key,) = self.present(*ROLLING_KEYS)
        try:
            bearing: RollingBearing = getattr(self, key).build()
        except ValueError as error:
            raise InputError(f"{key}: {error}") from None
        return bearing


class NamedBearing(NamedTuple):
    """A bearing with its name."""

    name: str
    bearing: RollingBearing


def bearing_of(
    tables: Mapping[str, Any], edits: Mapping[str, Any], source: str
) -> NamedBearing | None:
    """The bearing in tables of a bearing file, None of another file.

    edits : values to set, by `table.key`
    source : where the tables come from, with which messages of InputError begin
    """
    kinds = [kind for kind, names in SIGNS.items() if set(names) & tables.keys()]
    if kinds != ["bearing"]:
        return None
    changed = with_values(tables, edits)
    try:
        file = BearingFile.model_validate(changed)
        return NamedBearing(file.name, file.build())
    except ValidationError as error:
        text = first_problem(error, changed, BearingFile)
        raise InputError(f"{source}: {text}") from None
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
