"""Keys of a rolling bearing in a gear-set file, and the bearing that they describe."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, model_validator

from fegear.files.errors import InputError
from lumped.bearings.rolling import (
    CONFORMITY,
    MAX_ELEMENTS,
    MIN_ELEMENTS,
    BallBearing,
    RollerBearing,
    Waviness,
)

Item = TypeVar("Item")
MM, UM = 1e-3, 1e-6
Count = Annotated[int, Field(ge=MIN_ELEMENTS, le=MAX_ELEMENTS)]
Diameter = Annotated[float, Field(ge=1e-3, le=1e5)]
Deviation = Annotated[float, Field(ge=0.0, le=1e4)]
CONTACT_KEYS = ("race_conformity", "contact_stiffness_N_per_m_n")


class WavinessEntry(BaseModel):
    """A wave around a race."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False
    )

    order: Annotated[int, Field(ge=1, le=10_000)] = Field(
        description="Number of waves per circumference."
    )
    amplitude_um: Deviation = Field(description="Excess of material at a crest.")
    phase_deg: Annotated[float, Field(ge=-1e5, le=1e5)] = Field(
        default=0.0, description="Phase of the wave at the first rolling element."
    )


class BearingEntry(BaseModel):
    """Keys that ball and roller bearings share."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False
    )

    pitch_diameter_mm: Diameter = Field(
        description="Diameter of the circle of the rolling elements' centres."
    )
    clearance_um: Annotated[float, Field(ge=-1e4, le=1e4)] = Field(
        default=0.0,
        description="Radial internal clearance, by which the unloaded inner ring moves "
        "from one extreme to the other; negative with preload.",
    )
    contact_stiffness_N_per_m_n: Annotated[float, Field(ge=1.0, le=1e20)] | None = (
        Field(
            default=None,
            description="Load of a rolling element over its approach between both "
            "races to the power n, 3/2 for balls and 10/9 for rollers. [default: from "
            "geometry and steel]",
        )
    )
    film_thickness_um: Deviation = Field(
        default=0.0,
        description="Thickness of the film of lubricant in each contact, which adds "
        "to the approach.",
    )
    runout_um: Deviation = Field(
        default=0.0, description="Eccentricity of the inner race on its shaft."
    )
    inner_waviness: Annotated[tuple[WavinessEntry, ...], Strict(False)] = Field(
        default=(), description="Waves around the inner race."
    )
    outer_waviness: Annotated[tuple[WavinessEntry, ...], Strict(False)] = Field(
        default=(), description="Waves around the outer race."
    )

    @property
    def shared(self) -> dict[str, Any]:
        """Values of `RollingBearing` in SI units."""
        return {
            "pitch_diameter": self.pitch_diameter_mm * MM,
            "clearance": self.clearance_um * UM,
            "contact_stiffness": self.contact_stiffness_N_per_m_n,
            "film_thickness": self.film_thickness_um * UM,
            "runout": self.runout_um * UM,
            "waves": (
                *_waves(self.inner_waviness, True),
                *_waves(self.outer_waviness, False),
            ),
        }


def _waves(entries: tuple[WavinessEntry, ...], inner: bool) -> Iterator[Waviness]:
    for entry in entries:
        yield Waviness(
            order=entry.order,
            amplitude=entry.amplitude_um * UM,
            phase=math.radians(entry.phase_deg),
            inner=inner,
        )


class BallBearingEntry(BearingEntry):
    """ball_bearing of a gear."""

    balls: Count = Field(description="Number of balls.")
    ball_diameter_mm: Diameter = Field(description="Diameter of a ball.")
    race_conformity: Annotated[float, Field(gt=0.5, le=1e6)] | None = Field(
        default=None,
        description="Groove radius of both races over the diameter of a ball. "
        f"[default: {CONFORMITY}]",
    )

    @model_validator(mode="after")
    def _one_contact(self) -> BallBearingEntry:
        present = [key for key in CONTACT_KEYS if getattr(self, key) is not None]
        if len(present) > 1:
            raise ValueError(f"{' and '.join(present)} are given; only one is allowed")
        return self

    def build(self) -> BallBearing:
        """The bearing in SI units; ValueError if elements do not fit."""
        conformity = self.race_conformity or CONFORMITY
        return BallBearing(
            balls=self.balls,
            element_diameter=self.ball_diameter_mm * MM,
            inner_conformity=conformity,
            outer_conformity=conformity,
            **self.shared,
        )


class RollerBearingEntry(BearingEntry):
    """roller_bearing of a gear."""

    rollers: Count = Field(description="Number of rollers.")
    roller_diameter_mm: Diameter = Field(description="Diameter of a roller.")
    roller_length_mm: Diameter = Field(description="Effective length of a roller.")

    def build(self) -> RollerBearing:
        """The bearing in SI units; ValueError if elements do not fit."""
        return RollerBearing(
            rollers=self.rollers,
            element_diameter=self.roller_diameter_mm * MM,
            length=self.roller_length_mm * MM,
            **self.shared,
        )


def rolling_bearing(
    name: str, ball: BallBearingEntry | None, roller: RollerBearingEntry | None
) -> BallBearing | RollerBearing | None:
    """The rolling bearing of a gear, None if it has none.

    Raises InputError where its elements do not fit on their circle.
    """
    for key, entry in (("ball_bearing", ball), ("roller_bearing", roller)):
        if entry is None:
            continue
        try:
            return entry.build()
        except ValueError as error:
            raise InputError(f'gear "{name}": {key}: {error}') from None
    return None
