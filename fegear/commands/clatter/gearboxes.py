"""Gearboxes that may clatter, from TOML files and the built-in collection."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError, model_validator

from fegear.files.errors import InputError
from fegear.files.kinds import require_kind
from fegear.files.output import read_text
from fegear.gearset.problems import first_problem
from fegear.gearset.read import parsed_toml, path_of
from fegear.gearset.schema import (
    Entries,
    Keys,
    Name,
    require_all_or_none,
    require_exactly_one,
)
from lumped.clatter.gearbox import (
    Excitation,
    Freedom,
    Gearbox,
    Harmonics,
    LooseWheel,
    SpeedSignal,
    Variation,
)
from lumped.common.csv_text import TableError, parse_csv

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
    """A table [[wheel]]; see `lumped.clatter.gearbox.Wheel`."""

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
        if abs(self.tooth_play_amplitude_mm or 0.0) >= self.tooth_play_mm:
            raise ValueError(
                f"tooth_play_amplitude_mm = {self.tooth_play_amplitude_mm:g}; its size "
                f"must be below tooth_play_mm = {self.tooth_play_mm:g}"
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
                    f"wheel {self.name}: {key} = {getattr(self, key):g}; must be at "
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


@dataclass(frozen=True, eq=False)
class NamedGearbox:
    """A gearbox with its name; text : of its file, and of its speed file."""

    name: str
    description: str
    inferences: tuple[str, ...]
    gearbox: Gearbox
    text: str

    @property
    def heading(self) -> dict[str, Any]:
        """What every summary says of it first."""
        return {
            "gearbox": self.name,
            "description": self.description,
            "inferences": list(self.inferences),
        }


def load_gearbox(name_or_path: str) -> NamedGearbox:
    """A built-in gearbox by its name, or the one in a TOML file.

    Raises InputError, in one line, on anything that cannot be used.
    """
    names = gearbox_names()
    folder = Path(".")
    if name_or_path in names:
        text = (_folder() / f"{name_or_path}.toml").read_text("utf-8")
    else:
        path = path_of(name_or_path, "gearbox", names)
        text, folder = read_text(path), path.parent
    try:
        return _named(text, folder)
    except (InputError, TableError, ValueError) as error:
        raise InputError(f"{name_or_path}: {error}") from None


def gearbox_names() -> list[str]:
    """Names of the gearboxes that come with the program, sorted."""
    files = (Path(item.name) for item in _folder().iterdir())
    return sorted(file.stem for file in files if file.suffix == ".toml")


def _folder() -> Traversable:
    return resources.files("fegear.commands.clatter") / "gearboxes"


def _named(text: str, folder: Path) -> NamedGearbox:
    tables = parsed_toml(text)
    require_kind(tables, "gearbox")
    try:
        file = GearboxFile.model_validate(tables)
    except ValidationError as error:
        raise InputError(first_problem(error, tables, GearboxFile)) from None
    excitation, recorded = _excitation(file.excitation, folder)
    for keys in file.wheel:
        keys.require_slow_fading(excitation.shortest)
    wheels = tuple(_wheel(keys) for keys in file.wheel)
    return NamedGearbox(
        *(file.name, file.description, file.inferences),
        Gearbox(excitation, wheels),
        text + recorded,
    )


def _excitation(keys: ExcitationKeys, folder: Path) -> tuple[Excitation, str]:
    """And the text of its speed file."""
    if keys.speed_file is not None:
        radius = 1e-3 * (keys.base_radius_mm or 0.0)
        return _recorded(folder / keys.speed_file, radius)
    sizes = keys.amplitudes_mm or (keys.amplitude_mm or 0.0,)
    phases = keys.phases_deg or (0.0,) * len(sizes)
    if len(phases) != len(sizes):
        raise InputError(
            f"excitation: phases_deg has {len(phases)} entries; {len(sizes)} needed, "
            "one for each amplitude"
        )
    waves = tuple(1e-3 * size for size in sizes)
    angles = tuple(math.radians(phase) for phase in phases)
    return Harmonics(1.0 / (keys.frequency_Hz or 1.0), waves, angles), ""


def _recorded(path: Path, radius: float) -> tuple[SpeedSignal, str]:
    text = read_text(path)
    table = parse_csv(text, str(path))
    units = {"speed_rpm": RAD_PER_S_PER_RPM, "speed_rad_per_s": 1.0}
    speeds = [name for name in table.names if name in units]
    if "time_s" not in table.names or len(speeds) != 1:
        raise InputError(
            f"{path}: columns are {', '.join(table.names)}; needed are time_s and "
            "either speed_rpm or speed_rad_per_s"
        )
    speed = speeds[0]
    columns = [table.names.index(name) for name in ("time_s", speed)]
    rows = []
    for place, row in table.rows.items():
        try:
            rows.append([float(row[column]) for column in columns])
        except ValueError:
            raise InputError(f"{place}: must hold numbers") from None
    values = np.array(rows).reshape(-1, 2)
    try:
        return SpeedSignal(values[:, 0], units[speed] * values[:, 1], radius), text
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _wheel(keys: WheelKeys) -> LooseWheel:
    return LooseWheel(
        name=keys.name,
        inertia=keys.inertia_kg_m2,
        mass=keys.mass_kg or 1.0,
        base_radius=1e-3 * keys.base_radius_mm,
        rotation=Freedom(
            play=1e-3 * keys.tooth_play_mm,
            restitution=keys.tooth_restitution,
            drag=keys.drag_Nm,
            damping=keys.damping_Nms_per_rad,
        ),
        variation=_variation(keys),
        axial=_shift(keys, "axial"),
        radial=_shift(keys, "radial"),
        helix_angle=math.radians(keys.helix_angle_deg),
        ratio=keys.ratio,
        driver=keys.driver,
    )


def _variation(keys: WheelKeys) -> Variation | None:
    if not keys.tooth_play_amplitude_mm:
        return None
    phase = math.radians(keys.tooth_play_phase_deg or 0.0)
    size = 1e-3 * keys.tooth_play_amplitude_mm
    return Variation(size, keys.tooth_play_order or 1, phase)


def _shift(keys: WheelKeys, side: str) -> Freedom | None:
    play = getattr(keys, f"{side}_play_mm")
    if play is None:
        return None
    return Freedom(
        play=1e-3 * play,
        restitution=getattr(keys, f"{side}_restitution"),
        drag=getattr(keys, f"{side}_drag_N") or 0.0,
        damping=getattr(keys, f"{side}_damping_Ns_per_m") or 0.0,
    )
