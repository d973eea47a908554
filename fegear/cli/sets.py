"""fegear sets: the gear sets that come with the program."""

from __future__ import annotations

from fegear.cli.options import AsJson
from fegear.cli.screen import print_json, ruled_table, screen

EXAMPLE = "fegear sets"


def sets_command(as_json: AsJson = False) -> None:
    """List the built-in gear sets."""
    from fegear.gearset import builtin_names, load_gear_set

    found = []
    for name in builtin_names():
        gear_set = load_gear_set(name)
        counts = {"gears": len(gear_set.gears), "meshes": len(gear_set.meshes)}
        found.append({"name": name, **counts, "description": gear_set.description})
    if as_json:
        print_json({"gear_sets": found})
        return
    table = ruled_table(*found[0], words=("name", "description"))
    for each in found:
        table.add_row(*map(str, each.values()))
    screen().print(table)
