"""The command `fegear mesh`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "mesh",
        "Write the finite-element mesh of a gear.",
        __name__,
        "GearMesh",
        section="Gears and files",
        place=50,
    ),
)
