"""The command `fegear tolerances`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "tolerances",
        "Scatter of stiffness and transmission error by tolerances.",
        __name__,
        "Tolerances",
        section="Statics",
        place=50,
    ),
)
