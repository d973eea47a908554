"""The command `fegear wear`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "wear",
        "Wear of both flanks of a mesh by Archard's law.",
        __name__,
        "FlankWear",
        section="Statics",
        place=60,
    ),
)
