"""The command `fegear sharing`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "sharing",
        "Load sharing between the planets of a planetary set at rest.",
        __name__,
        "PlanetLoadSharing",
        section="Statics",
        place=80,
    ),
)
