"""The command `fegear explain`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "explain",
        "Explain the codes of warnings and of evidence lines.",
        __name__,
        "Explanation",
        section="Evidence and upkeep",
        place=10,
    ),
)
