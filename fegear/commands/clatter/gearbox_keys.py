"""Keys of gearbox files."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from fegear.gearset.schema import (
    Entries,
    Keys,
    Name,
    require_all_or_none,
    require_exactly_one,
)
from lumped.common.checks import format_number

# Limits far beyond any gearbox, so that no product of them leaves the range of numbers.
Positive = Annotated[float, Field(ge=1e-9, le=1e9)]

NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]

Signed = Annotated[float, Field(ge=-1e9, le=1e9)]

Play = Annotated[float, Field(ge=1e-6, le=1e3)]  # mm

Part = Annotated[float, Field(ge=0.0, le=1.0)]

Size = Annotated[float, Field(ge=-1e3, le=1e3)]  # mm

RAD_PER_S_PER_RPM = 2.0 * math.pi / 60.0

GYRATION_RANGE = 0.01, 10.0  # radius of gyration of a wheel over its base radius


# largest rate of damping, in the excitation's shortest time of change
MAX_DAMPING_RATE = 1e4


class ExcitationKeys(Keys):
    """The table [excitation]: harmonics of a frequency, or a recorded speed."""

    frequency_Hz: Positive | None = Field(
        default=None, description="Frequency of the first harmonic."
    )
    amplitude_mm: Size | None = Field(
        default=None,
        description="Amplitude of one harmonic, at the input's base circle.",
    )
    amplitudes_mm: Annotated[Entries[Size], Field(min_length=1)] | None = Field(
        default=None,
        description="Amplitudes of harmonics 1, 2, ..., instead of amplitude_mm.",
    )
    phases_deg: Entries[Signed] | None = Field(
        default=None, description="Phases of the harmonics. [default: 0]"
    )
    speed_file: str | None = Field(
        default=None,
        description="Recorded speed, a table with time and speed, instead of harmonics;"
        " a path from the file's directory.",
    )
    base_radius_mm: Positive | None = Field(
        default=None, description="Base radius of the input gear, with a speed_file."
    )

    @model_validator(mode="after")
    def _one_kind(self) -> ExcitationKeys:
        require_exactly_one(self, "amplitude_mm", "amplitudes_mm", "speed_file")
        require_all_or_none(self, "speed_file", "base_radius_mm")
        waves = self.present("frequency_Hz", "phases_deg")
        if self.speed_file is not None and waves:
            raise ValueError(f"{waves[0]} belongs to amplitudes, not to a speed_file")
        if self.speed_file is None and self.frequency_Hz is None:
            raise ValueError("frequency_Hz is missing")
        return self


class WheelKeys(Keys):
    """A table [[wheel]]; see `LooseWheel`."""

    name: Name = Field(description="Name of the wheel.")
    driver: str | None = Field(
        default=None,
        description="Name of the loose wheel that drives it. [default: the input]",
    )
    ratio: Annotated[float, Field(ge=1e-3, le=1e3)] = Field(
        default=1.0,
        description="Displacement of the driving teeth over that of the input.",
    )
    base_radius_mm: Positive = Field(description="Base radius.")
    helix_angle_deg: Annotated[float, Field(ge=-60.0, le=60.0)] = Field(
        default=0.0, description="Helix angle of the mesh that drives the wheel."
    )
    inertia_kg_m2: Positive = Field(description="Moment of inertia.")
    mass_kg: Positive | None = Field(
        default=None, description="Mass, where the bearing has play."
    )
    tooth_play_mm: Play = Field(description="Play of the teeth.")
    tooth_restitution: Part = Field(
        description="Coefficient of restitution of the teeth."
    )
    tooth_play_amplitude_mm: Size | None = Field(
        default=None, description="Amplitude of the variation of the tooth play."
    )
    tooth_play_order: Annotated[int, Field(ge=1, le=100)] | None = Field(
        default=None,
        description="Periods of the variation of the tooth play per period of the "
        "excitation. [default: 1]",
    )
    tooth_play_phase_deg: Signed | None = Field(
        default=None,
        description="Phase of the variation of the tooth play. [default: 0]",
    )
    drag_Nm: Signed = Field(
        default=0.0, description="Drag torque; negative against the rotation."
    )
    damping_Nms_per_rad: NotNegative = Field(
        default=0.0, description="Damping of the rotation."
    )
    axial_play_mm: Play | None = Field(
        default=None, description="Axial play of the bearing."
    )
    axial_restitution: Part | None = Field(
        default=None, description="Coefficient of restitution of the axial stops."
    )
    axial_drag_N: Signed | None = Field(
        default=None, description="Axial force. [default: 0]"
    )
    axial_damping_Ns_per_m: NotNegative | None = Field(
        default=None, description="Damping of the axial motion. [default: 0]"
    )
    radial_play_mm: Play | None = Field(
        default=None, description="Radial play of the bearing."
    )
    radial_restitution: Part | None = Field(
        default=None, description="Coefficient of restitution of the bearing."
    )
    radial_drag_N: Signed | None = Field(
        default=None, description="Radial force. [default: 0]"
    )
    radial_damping_Ns_per_m: NotNegative | None = Field(
        default=None, description="Damping of the radial motion. [default: 0]"
    )

    @model_validator(mode="after")
    def _whole_plays(self) -> WheelKeys:
        for side in ("axial", "radial"):
            play, bounce = f"{side}_play_mm", f"{side}_restitution"
            require_all_or_none(self, play, bounce)
            others = self.present(f"{side}_drag_N", f"{side}_damping_Ns_per_m")
            if others and getattr(self, play) is None:
                raise ValueError(f"{others[0]} needs {play}")
            if getattr(self, play) is not None and self.mass_kg is None:
                raise ValueError(f"{play} needs mass_kg")
        if self.mass_kg is not None and not self.present(
            "axial_play_mm", "radial_play_mm"
        ):
            raise ValueError("mass_kg needs axial_play_mm or radial_play_mm")
        self._require_open_play()
        self._require_gyration()
        return self

    def _require_open_play(self) -> None:
        waves = self.present("tooth_play_order", "tooth_play_phase_deg")
        if waves and not self.tooth_play_amplitude_mm:
            raise ValueError(f"{waves[0]} needs tooth_play_amplitude_mm, other than 0")
        amplitude = self.tooth_play_amplitude_mm or 0.0
        if abs(amplitude) >= self.tooth_play_mm:
            raise ValueError(
                f"tooth_play_amplitude_mm = {format_number(amplitude)}; its size "
                f"must be below tooth_play_mm = {format_number(self.tooth_play_mm)}"
            )

    def _require_gyration(self) -> None:
        if self.mass_kg is None:
            return
        radius = 1e3 * math.sqrt(self.inertia_kg_m2 / self.mass_kg)
        low, high = (ratio * self.base_radius_mm for ratio in GYRATION_RANGE)
        if not low <= radius <= high:
            raise ValueError(
                f"inertia_kg_m2 = {self.inertia_kg_m2:g} and mass_kg = "
                f"{self.mass_kg:g} contradict each other: the radius of gyration, "
                f"{radius:.4g} mm, must be {low:g} to {high:g} mm for this "
                "base_radius_mm"
            )

    def require_slow_fading(self, time_s: float) -> None:
        """Raises ValueError for damping that stops the wheel in a part of this time."""
        masses = {
            "damping_Nms_per_rad": self.inertia_kg_m2,
            "axial_damping_Ns_per_m": self.mass_kg,
            "radial_damping_Ns_per_m": self.mass_kg,
        }
        for key, mass in masses.items():
            most = MAX_DAMPING_RATE * (mass or 0.0) / time_s
            if (getattr(self, key) or 0.0) > most:
                raise ValueError(
                    f"wheel {self.name}: {key} = {format_number(getattr(self, key))}; "
                    "must be at "
                    f"most {most:.4g}, with which the wheel follows the oil within "
                    f"{time_s / MAX_DAMPING_RATE:.3g} s"
                )


class GearboxFile(Keys):
    """A gearbox file."""

    name: Name = Field(description="Name of the gearbox.")
    description: str = Field(default="", description="A line about the gearbox.")
    inferences: Entries[str] = Field(
        default=(),
        description="Values that the source lacks, and how they were chosen.",
    )
    excitation: ExcitationKeys = Field(description="Motion of the input.")
    wheel: Annotated[Entries[WheelKeys], Field(min_length=1)] = Field(
        description="Loose wheels."
    )

    @model_validator(mode="after")
    def _used_plays(self) -> GearboxFile:
        for wheel in self.wheel:
            if self.excitation.speed_file and wheel.tooth_play_amplitude_mm is not None:
                raise ValueError(
                    f"wheel {wheel.name}: tooth_play_amplitude_mm belongs to a "
                    "frequency_Hz, not to a speed_file"
                )
            meshes = [driven for driven in self.wheel if driven.driver == wheel.name]
            still = all(keys.helix_angle_deg == 0.0 for keys in (wheel, *meshes))
            if wheel.axial_play_mm is not None and still:
                raise ValueError(
                    f"wheel {wheel.name}: axial_play_mm needs helix_angle_deg, other "
                    "than 0, of it or of a wheel that it drives"
                )
        return self

    @model_validator(mode="after")
    def _in_motion(self) -> GearboxFile:
        excitation = self.excitation
        still = excitation.amplitude_mm == 0.0 or not any(
            excitation.amplitudes_mm or (1.0,)
        )
        drags = "drag_Nm", "axial_drag_N", "radial_drag_N"
        if still and not any(getattr(w, key) for w in self.wheel for key in drags):
            raise ValueError(
                "excitation has no amplitude other than 0 and no wheel a drag, so that "
                "nothing moves"
            )
        return self
