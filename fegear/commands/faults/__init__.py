"""The command `fegear faults`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "faults",
        "Labelled data sets of signals of gears with faults.",
        __name__,
        "FaultSignals",
        section="Vibration",
        place=100,
    ),
)
