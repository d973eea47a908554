"""The command `fegear relief`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "relief",
        "Best reliefs and leads over torque and misalignment.",
        __name__,
        "ReliefDesign",
        section="Statics",
        place=40,
    ),
)
