"""Gear sets from REXS files, the open exchange format of gearboxes."""

from fegear.commands.new.rexs.gear_set import RexsGearSet, convert_gearbox
from fegear.commands.new.rexs.reading import ENDINGS, read_rexs

__all__ = ["ENDINGS", "RexsGearSet", "convert_gearbox", "read_rexs"]
