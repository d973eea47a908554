"""The command `fegear branches`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "branches",
        "Periodic motions over speed or a parameter, stable and unstable.",
        __name__,
        "Branches",
        section="Vibration",
        place=50,
    ),
)
