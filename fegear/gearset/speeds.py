"""Speed of a gear set, as mesh frequency and as speed of rotation."""

from __future__ import annotations

from fegear.gearset.model import GearSet

SECONDS_PER_MINUTE = 60.0


def mesh_frequency(gears: GearSet, rpm: float) -> float:
    """Mesh frequency of the first mesh [Hz] at a speed of its driver [rpm]."""
    return rpm * _driver_teeth(gears) / SECONDS_PER_MINUTE


def driver_rpm(gears: GearSet, frequency: float) -> float:
    """Speed of the first mesh's driver [rpm] at a frequency of the mesh [Hz]."""
    return SECONDS_PER_MINUTE * frequency / _driver_teeth(gears)


def _driver_teeth(gears: GearSet) -> int:
    return gears.gears[gears.meshes[0].driver].geometry.teeth
