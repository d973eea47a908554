"""Speed of a gear set, as mesh frequency and as speed of rotation."""

from __future__ import annotations

from fegear.gearset.model import GearSet

SECONDS_PER_MINUTE = 60.0


def cycles_per_turn(gears: GearSet) -> float:
    """Cycles of the first mesh per turn of the gear whose speed is that of the set.

    They are the teeth of the first mesh's driver; in a planetary set they are those of
    a turn of its input.
    """
    if gears.carrier is not None:
        return gears.carrier.members.cycles_per_turn
    return float(gears.gears[gears.meshes[0].driver].geometry.teeth)


def mesh_frequency(cycles: float, rpm: float) -> float:
    """Frequency of a mesh [Hz] at a speed [rpm], by its cycles per turn."""
    return rpm * cycles / SECONDS_PER_MINUTE


def driver_rpm(cycles: float, frequency: float) -> float:
    """Speed [rpm] at a frequency of a mesh [Hz], without round-off."""
    return float(f"{SECONDS_PER_MINUTE * frequency / cycles:.14g}")
