"""The command `fegear render`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "render",
        "Pictures and films of the stress of gears in mesh.",
        __name__,
        "ContactPictures",
        section="Statics",
        place=70,
    ),
)
