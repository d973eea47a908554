"""The command `fegear bearing`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "bearing",
        "Load on a bearing's balls or rollers, and its stiffness.",
        __name__,
        "BearingLoad",
        section="Statics",
        place=90,
    ),
)
