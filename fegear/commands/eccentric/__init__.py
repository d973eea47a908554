"""The command `fegear eccentric`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "eccentric",
        "An eccentric circular wheel, and the wheel that it drives.",
        __name__,
        "Eccentric",
        section="Gears and files",
        place=60,
    ),
)
