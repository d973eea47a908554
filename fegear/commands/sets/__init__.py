"""The command `fegear sets`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "sets",
        "List the built-in gear sets.",
        __name__,
        "BuiltinSets",
        section="Gears and files",
        place=10,
    ),
)
