"""Speed of a gear set, as mesh frequency and as speed of rotation."""

from __future__ import annotations

from fegear.gearset.model import GearSet

SECONDS_PER_MINUTE = 60.0


def driver_teeth(gears: GearSet) -> int:
    """Number of teeth of the first mesh's driver, whose speed is that of the set."""
    return gears.gears[gears.meshes[0].driver].geometry.teeth


def mesh_frequency(teeth: int, rpm: float) -> float:
    """Frequency of a mesh [Hz] at a speed of its driver [rpm]."""
    return rpm * teeth / SECONDS_PER_MINUTE


def driver_rpm(teeth: int, frequency: float) -> float:
    """Speed of a driver [rpm] at a frequency of its mesh [Hz], without round-off."""
    return float(f"{SECONDS_PER_MINUTE * frequency / teeth:.14g}")
