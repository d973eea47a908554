"""The command `fegear sweep`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "sweep",
        "Vibration of a lumped train over speed.",
        __name__,
        "Sweep",
        section="Vibration",
        place=30,
    ),
)
