"""The command `fegear show`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "show",
        "Derived geometry of a gear set, forces of its teeth, and what was inferred.",
        __name__,
        "DerivedGeometry",
        section="Gears and files",
        place=40,
    ),
)
