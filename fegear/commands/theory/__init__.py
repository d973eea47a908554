"""The command `fegear theory`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "theory",
        "Resonances of a lumped train by closed forms.",
        __name__,
        "Theory",
        section="Vibration",
        place=20,
    ),
)
