"""The command `fegear keys`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "keys",
        "List the keys of files: unit, default, limits and meaning.",
        __name__,
        "KeyList",
        section="Gears and files",
        place=30,
    ),
)
