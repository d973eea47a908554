"""`fegear sets`: the gear sets that come with the program."""

from __future__ import annotations


def sets_command() -> None:
    """List the built-in gear sets."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from fegear.gearset import builtin_names, load_gear_set

    table = Table("Name", "Gears", "Meshes", "Description", box=None)
    for name in builtin_names():
        gear_set = load_gear_set(name)
        counts = str(len(gear_set.gears)), str(len(gear_set.meshes))
        table.add_row(name, *counts, Text(gear_set.description))
    Console().print(table)
