"""Keys of a rolling bearing in a gear-set file, and the bearing that they describe."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, Strict, model_validator

from fegear.files.errors import InputError
from lumped.bearings.mounted import MountedBearing
from lumped.bearings.rolling import (
    CONFORMITY,
    MAX_ELEMENTS,
    MIN_ELEMENTS,
    BallBearing,
    RollerBearing,
    Waviness,
)
from lumped.common.units import MM, UM
from meshes.gear import floored

MAX_ORDERS = 1000  # of waves around a race
Count = Annotated[int, Field(ge=MIN_ELEMENTS, le=MAX_ELEMENTS)]
Diameter = Annotated[float, Field(ge=1e-3, le=1e5)]
Deviation = Annotated[float, Field(ge=0.0, le=1e4)]
ContactAngle = Annotated[float, Field(ge=-75.0, le=75.0)]
Preload = Annotated[float, Field(ge=-1e4, le=1e4)]
Amplitudes = Annotated[
    tuple[Deviation, ...], Strict(False), Field(max_length=MAX_ORDERS)
]
CONTACT_KEYS = ("race_conformity", "contact_stiffness_N_per_m_n")


class BearingEntry(BaseModel):
    """Keys that ball and roller bearings share."""

    model_config = ConfigDict(
        defer_build=True, extra="forbid", frozen=True, strict=True, allow_inf_nan=False
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
    inner_waviness_um: Amplitudes = Field(
        default=(),
        description="Amplitudes of waves around the inner race, of 1, 2, 3 waves per "
        "circumference and so on; all have a crest at the first rolling element.",
    )
    outer_waviness_um: Amplitudes = Field(
        default=(), description="Amplitudes of waves around the outer race, likewise."
    )

    def require_room(self, elements: str, diameter: str) -> None:
        """Require that rolling elements fit beside each other; ValueError."""
        count, size = getattr(self, elements), getattr(self, diameter)
        room = self.pitch_diameter_mm * math.sin(math.pi / count)
        if size > room:
            raise ValueError(
                f"{diameter} = {size:.12g}; at most {floored(room)} mm for {count} "
                f"{elements} on pitch_diameter_mm = {self.pitch_diameter_mm:.12g}"
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
                *_waves(self.inner_waviness_um, True),
                *_waves(self.outer_waviness_um, False),
            ),
        }


def _waves(amplitudes_um: tuple[float, ...], inner: bool) -> Iterator[Waviness]:
    for order, amplitude in enumerate(amplitudes_um, start=1):
        if amplitude > 0.0:
            yield Waviness(order=order, amplitude=amplitude * UM, inner=inner)


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
        self.require_room("balls", "ball_diameter_mm")
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
        self.require_room("rollers", "roller_diameter_mm")
        return RollerBearing(
            rollers=self.rollers,
            element_diameter=self.roller_diameter_mm * MM,
            length=self.roller_length_mm * MM,
            **self.shared,
        )


class MountedBearingEntry(BaseModel):
    """rolling_bearings of a shaft."""

    model_config = BearingEntry.model_config

    ball_bearing: BallBearingEntry | None = Field(
        default=None, description="Ball bearing."
    )
    roller_bearing: RollerBearingEntry | None = Field(
        default=None,
        description="Cylindrical roller bearing, which takes no thrust, instead of "
        "ball_bearing.",
    )
    contact_angle_deg: ContactAngle = Field(
        default=0.0,
        description="Contact angle of an angular-contact ball bearing without load; "
        "positive where it takes thrust of the shaft toward the far end, negative "
        "where it takes that toward the near end. [default: a deep-groove bearing, "
        "which takes both]",
    )
    axial_preload_um: Preload = Field(
        default=0.0,
        description="Displacement along the axis of the inner ring of a ball bearing "
        "that is set by mounting, in the sense that presses the balls of an "
        "angular-contact bearing, toward the far end in a deep-groove bearing; a "
        "negative one is axial clearance of an angular-contact bearing.",
    )

    @model_validator(mode="after")
    def _consistent(self) -> MountedBearingEntry:
        bearings = [
            (key, bearing)
            for key in ("ball_bearing", "roller_bearing")
            if (bearing := getattr(self, key)) is not None
        ]
        if len(bearings) != 1:
            count = "both are" if bearings else "none is"
            raise ValueError(
                f"ball_bearing or roller_bearing is needed, {count} present"
            )
        ((key, bearing),) = bearings
        for name in ("runout_um", "inner_waviness_um", "outer_waviness_um"):
            if getattr(bearing, name):
                raise ValueError(
                    f"{key}.{name} is not 0; bearings of shafts at rest have none"
                )
        if self.roller_bearing is not None:
            for name in ("contact_angle_deg", "axial_preload_um"):
                if value := getattr(self, name):
                    raise ValueError(
                        f"{name} = {value:.12g}; a roller_bearing has none"
                    )
        elif self.contact_angle_deg and bearing.clearance_um:
            raise ValueError(
                f"ball_bearing.clearance_um = {bearing.clearance_um:.12g}; must be 0 "
                "with contact_angle_deg, axial_preload_um is negative for clearance"
            )
        return self

    def build(self) -> MountedBearing:
        """The bearing in SI units; ValueError if elements do not fit."""
        entry = self.ball_bearing or self.roller_bearing
        if entry is None:
            raise ValueError("ball_bearing or roller_bearing is needed")
        return MountedBearing(
            bearing=entry.build(),
            contact_angle=math.radians(self.contact_angle_deg),
            axial_preload=self.axial_preload_um * UM,
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
