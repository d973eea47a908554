"""The command `fegear campbell`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "campbell",
        "Campbell diagram and critical speeds of spinning shafts.",
        __name__,
        "CampbellDiagram",
        section="Vibration",
        place=110,
    ),
)
