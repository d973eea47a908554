"""The command `fegear clatter`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "clatter",
        "Clattering gearboxes: impacts of loose wheels.",
        __name__,
        "Clatter",
        section="Machines",
        place=10,
    ),
)
