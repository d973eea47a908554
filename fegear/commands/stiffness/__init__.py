"""The command `fegear stiffness`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "stiffness",
        "Mesh stiffness, transmission error and load sharing.",
        __name__,
        "MeshStiffness",
        section="Statics",
        place=10,
    ),
)
