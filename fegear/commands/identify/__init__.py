"""The command `fegear identify`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "identify",
        "Face width and hub radii that give measured stiffnesses.",
        __name__,
        "Identification",
        section="Statics",
        place=30,
    ),
)
