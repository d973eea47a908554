"""The command `fegear warmup`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "warmup",
        "Compile all kernels on all cores, for later runs.",
        __name__,
        "Warmup",
        section="Evidence and upkeep",
        place=60,
    ),
)
