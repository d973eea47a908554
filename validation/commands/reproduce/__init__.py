"""The command `fegear reproduce`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "reproduce",
        "Figures and tables of the sources, recomputed.",
        __name__,
        "Reproduction",
        section="Evidence and upkeep",
        place=40,
    ),
)
