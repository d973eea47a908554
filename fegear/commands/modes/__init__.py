"""The command `fegear modes`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "modes",
        "Natural frequencies of a train, and what its modes strain.",
        __name__,
        "NaturalModes",
        section="Vibration",
        place=10,
    ),
)
