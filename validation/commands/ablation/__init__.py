"""The command `fegear ablation`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "ablation",
        "Contribution of each part of the coupled model.",
        __name__,
        "Ablation",
        section="Evidence and upkeep",
        place=30,
    ),
)
