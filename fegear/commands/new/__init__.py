"""The command `fegear new`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "new",
        "Write a commented file to begin with, which runs as it is.",
        __name__,
        "NewFile",
        section="Gears and files",
        place=20,
    ),
)
