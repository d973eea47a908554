"""The command `fegear validate`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "validate",
        "Lumped models against finite elements, with tolerances.",
        __name__,
        "Validation",
        section="Evidence and upkeep",
        place=20,
    ),
)
