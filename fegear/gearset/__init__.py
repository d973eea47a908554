"""Gear sets: what their TOML files hold, read, checked and described."""

from fegear.gearset.model import Gear, GearSet, Mesh, Shaft
from fegear.gearset.modifications import FlankProfile, Relief
from fegear.gearset.read import (
    builtin_names,
    load_gear_set,
    make_gear_set,
    read_gear_set,
    read_gear_set_file,
)

__all__ = [
    "FlankProfile",
    "Gear",
    "GearSet",
    "Mesh",
    "Relief",
    "Shaft",
    "builtin_names",
    "load_gear_set",
    "make_gear_set",
    "read_gear_set",
    "read_gear_set_file",
]
