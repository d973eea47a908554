"""The command `fegear signals`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "signals",
        "Signals of sensors, their averages over turns and sidebands.",
        __name__,
        "Signals",
        section="Vibration",
        place=90,
    ),
)
