"""The command `fegear compare`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "compare",
        "Finite elements compared with ISO 6336 and other closed forms.",
        __name__,
        "ClosedForms",
        section="Statics",
        place=20,
    ),
)
