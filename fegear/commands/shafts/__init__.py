"""The command `fegear shafts`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "shafts",
        "Deflections of shafts, and loads on bearings and meshes.",
        __name__,
        "LoadedShafts",
        section="Statics",
        place=75,
    ),
)
