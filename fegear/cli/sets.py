"""`fegear sets`: the gear sets that come with the program."""

from __future__ import annotations


def sets_command() -> None:
    """List the built-in gear sets."""
    from fegear.cli.screen import ruled_table, screen
    from fegear.gearset import builtin_names, load_gear_set

    table = ruled_table("name", "gears", "meshes", "description", text=4)
    for name in builtin_names():
        gear_set = load_gear_set(name)
        counts = str(len(gear_set.gears)), str(len(gear_set.meshes))
        table.add_row(name, *counts, gear_set.description)
    screen().print(table)
