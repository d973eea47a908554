"""The command `fegear dynamics`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "dynamics",
        "Vibration of finite-element gears over speed.",
        __name__,
        "Dynamics",
        section="Vibration",
        place=120,
    ),
)
