"""The command `fegear export`."""

from fegear.studies.registry import Command

COMMANDS = (
    Command(
        "export",
        "Mass, damping and stiffness matrices for other programs.",
        __name__,
        "ModelExport",
        section="Vibration",
        place=130,
    ),
)
PUBLIC = dict.fromkeys(("to_opentorsion", "to_ross"), f"{__name__}.other_programs")
