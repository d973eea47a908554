"""The command `fegear stability`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "stability",
        "Parametric instability of a train with tooth friction.",
        __name__,
        "Stability",
        section="Vibration",
        place=80,
    ),
)
