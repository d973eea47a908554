"""A counter-shaft of 23/67 and 21/55 teeth, whose meshes repeat after 67 periods."""

from __future__ import annotations

from fegear.gearset import GearSet, read_gear_set

TEETH = {"input": 23, "wheel": 67, "pinion": 21, "output": 55}


def counter_shaft(hub_mm: float, shaft: str = "", lone: str = "") -> GearSet:
    """The gear set with hubs of a diameter.

    shaft : more keys of its shaft; lone : a gear without mesh
    """
    gears = "".join(
        f'[[gear]]\nname = "{name}"\nteeth = {teeth}\n' for name, teeth in TEETH.items()
    )
    text = f"""
name = "counter-shaft"
[defaults]
module_mm = 2.0
face_width_mm = 20.0
hub_diameter_mm = {hub_mm}
tooth_thinning_um = 40.0
{gears}{lone}
[[mesh]]
driver = "input"
driven = "wheel"
[[mesh]]
driver = "pinion"
driven = "output"
[[shaft]]
gears = ["wheel", "pinion"]
{shaft}
[load]
gear = "input"
torques_Nm = [60.0]
"""
    return read_gear_set(text)
