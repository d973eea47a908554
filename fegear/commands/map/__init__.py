"""The command `fegear map`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "map",
        "Vibration of a lumped train over a grid of parameters.",
        __name__,
        "Map",
        section="Vibration",
        place=70,
    ),
)
