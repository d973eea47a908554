"""Gearboxes that may clatter, from TOML files and the built-in collection."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from fegear.commands.clatter.gearbox_keys import (
    RAD_PER_S_PER_RPM,
    ExcitationKeys,
    GearboxFile,
    WheelKeys,
)
from fegear.files.errors import InputError
from fegear.files.kinds import require_kind
from fegear.files.output import read_text
from fegear.gearset.problems import first_problem
from fegear.gearset.read import parsed_toml, path_of
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
        text = (_gearbox_folder() / f"{name_or_path}.toml").read_text("utf-8")
    else:
        path = path_of(name_or_path, "gearbox", names)
        text, folder = read_text(path), path.parent
    try:
        return _named_gearbox(text, folder)
    except (InputError, TableError, ValueError) as error:
        raise InputError(f"{name_or_path}: {error}") from None


def gearbox_names() -> list[str]:
    """Names of the gearboxes that come with the program, sorted."""
    files = (Path(item.name) for item in _gearbox_folder().iterdir())
    return sorted(file.stem for file in files if file.suffix == ".toml")


def _gearbox_folder() -> Traversable:
    return resources.files("fegear.commands.clatter") / "gearboxes"


def _named_gearbox(text: str, folder: Path) -> NamedGearbox:
    tables = parsed_toml(text)
    require_kind(tables, "gearbox")
    try:
        file = GearboxFile.model_validate(tables)
    except ValidationError as error:
        raise InputError(first_problem(error, tables, GearboxFile)) from None
    excitation, recorded_speed = _excitation_of_keys(file.excitation, folder)
    for keys in file.wheel:
        keys.require_slow_fading(excitation.shortest)
    wheels = tuple(_wheel_of_keys(keys) for keys in file.wheel)
    return NamedGearbox(
        *(file.name, file.description, file.inferences),
        Gearbox(excitation, wheels),
        text + recorded_speed,
    )


def _excitation_of_keys(keys: ExcitationKeys, folder: Path) -> tuple[Excitation, str]:
    """And the text of its speed file."""
    if keys.speed_file is not None:
        radius = 1e-3 * (keys.base_radius_mm or 0.0)
        return _recorded_speed(folder / keys.speed_file, radius)
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


def _recorded_speed(path: Path, radius: float) -> tuple[SpeedSignal, str]:
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


def _wheel_of_keys(keys: WheelKeys) -> LooseWheel:
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
        variation=_play_variation(keys),
        axial=_freedom_of_side(keys, "axial"),
        radial=_freedom_of_side(keys, "radial"),
        helix_angle=math.radians(keys.helix_angle_deg),
        ratio=keys.ratio,
        driver=keys.driver,
    )


def _play_variation(keys: WheelKeys) -> Variation | None:
    if not keys.tooth_play_amplitude_mm:
        return None
    phase = math.radians(keys.tooth_play_phase_deg or 0.0)
    size = 1e-3 * keys.tooth_play_amplitude_mm
    return Variation(size, keys.tooth_play_order or 1, phase)


def _freedom_of_side(keys: WheelKeys, side: str) -> Freedom | None:
    play = getattr(keys, f"{side}_play_mm")
    if play is None:
        return None
    return Freedom(
        play=1e-3 * play,
        restitution=getattr(keys, f"{side}_restitution"),
        drag=getattr(keys, f"{side}_drag_N") or 0.0,
        damping=getattr(keys, f"{side}_damping_Ns_per_m") or 0.0,
    )
