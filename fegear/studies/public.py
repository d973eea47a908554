"""Names of the package, and the modules that they are loaded from."""

from __future__ import annotations

from fegear.studies.registry import commands, public_names

# what is loaded when it is first asked for, so that `import fegear` is cheap
HOMES = {
    "FiniteElements": "fegear.dynamics.build",
    "GearSet": "fegear.gearset",
    "InputError": "fegear.files.errors",
    "LumpedModel": "fegear.train.model_settings",
    "PictureSettings": "fegear.rendering.pictures",
    "StaticsSettings": "fegear.statics.settings",
    "ExcitationSettings": "fegear.statics.excitation_settings",
    "builtin_names": "fegear.gearset",
    "load": "fegear.studies.saving",
    "load_gear_set": "fegear.gearset",
    "lumped_system": "fegear.train.lumped_models",
    "make_gear_set": "fegear.gearset",
    "read_gear_set": "fegear.gearset",
    "read_mesh_tables": "fegear.statics.given_tables",
    "solve_mesh": "fegear.statics.solving",
    "solve_stress": "fegear.rendering.pictures",
    "run": "fegear.studies.running",
}


def public_homes() -> dict[str, str]:
    """Modules of all public names, studies of other packages among them."""
    studies = {command.study: command.module for command in commands().values()}
    return HOMES | public_names() | studies
