"""The command `fegear motion`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "motion",
        "Steady-state motion of a lumped train at one speed.",
        __name__,
        "Motion",
        section="Vibration",
        place=40,
    ),
)
