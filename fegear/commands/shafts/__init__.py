"""The command `fegear shafts`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "shafts",
        "Deflection of shafts, loads on bearings, and what they do to meshes.",
        __name__,
        "LoadedShafts",
        section="Statics",
        place=75,
    ),
)
