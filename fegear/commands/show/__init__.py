"""The command `fegear show`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "show",
        "Geometry and forces of a gear set, and what was inferred.",
        __name__,
        "DerivedGeometry",
        section="Gears and files",
        place=40,
    ),
)
