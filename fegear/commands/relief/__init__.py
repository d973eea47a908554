"""The command `fegear relief`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "relief",
        "Profile relief of least transmission error over torque.",
        __name__,
        "ReliefDesign",
        section="Statics",
        place=40,
    ),
)
