"""Names of the package by subject, and the modules that they are loaded from."""

from __future__ import annotations

from textwrap import fill

from fegear.studies.registry import commands, groups, public_names

# what is loaded when it is first asked for, so that `import fegear` is cheap
HOMES = {
    "Gears and files": {
        "load_gear_set": "fegear.gearset",
        "read_gear_set": "fegear.gearset",
        "make_gear_set": "fegear.gearset",
        "builtin_names": "fegear.gearset",
        "GearSet": "fegear.gearset",
    },
    "Statics": {
        "solve_mesh": "fegear.statics.solving",
        "solve_stress": "fegear.rendering.pictures",
        "read_mesh_tables": "fegear.statics.given_tables",
        "StaticsSettings": "fegear.statics.settings",
        "PictureSettings": "fegear.rendering.pictures",
        "StaticsResult": "fegear.statics.mesh_result",
        "MeshTable": "lumped.train.table",
        "FaceLoads": "fegear.contact.result",
    },
    "Vibration": {
        "lumped_system": "fegear.train.lumped_models",
        "LumpedModel": "fegear.train.model_settings",
        "ExcitationSettings": "fegear.statics.excitation_settings",
        "FiniteElements": "fegear.dynamics.build",
        "LumpedSystem": "lumped.train.system",
    },
    "All studies": {
        "run": "fegear.studies.running",
        "load": "fegear.studies.saving",
        "InputError": "fegear.files.errors",
    },
}
TERMINAL = "Evidence and upkeep"  # studies that are used as commands


def public_homes() -> dict[str, str]:
    """Modules of all names that can be loaded, studies of other packages among them."""
    studies = {command.study: command.module for command in commands().values()}
    functions = {n: home for homes in HOMES.values() for n, home in homes.items()}
    return functions | public_names() | studies


def names_by_subject() -> dict[str, list[str]]:
    """Names that are listed, by the headings of the help of the command line."""
    subjects = {subject: list(homes) for subject, homes in HOMES.items()}
    for command in commands().values():
        section = groups()[command.group].section if command.group else command.section
        if section != TERMINAL:
            subjects.setdefault(section, []).append(command.study)
    subjects["Other programs"] = list(public_names())
    subjects["All studies"] = subjects.pop("All studies")  # the last
    return subjects


def names_text() -> str:
    """The listed names, a paragraph for each subject."""
    return "\n".join(
        fill(f"{subject}: {', '.join(names)}", 80, subsequent_indent="    ")
        for subject, names in names_by_subject().items()
    )
