"""The command `fegear bifurcations`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "bifurcations",
        "Period doublings and chaos over speed or a parameter.",
        __name__,
        "Bifurcations",
        section="Vibration",
        place=60,
    ),
)
