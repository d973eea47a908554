"""fegear sets: the gear sets that come with the program."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from fegear.cli.options import AsJson
from fegear.cli.screen import print_json, ruled_table, screen

EXAMPLE = "fegear sets"


@dataclass(frozen=True)
class BuiltIn:
    name: str
    gears: int
    meshes: int
    description: str


def sets_command(as_json: AsJson = False) -> None:
    """List the built-in gear sets."""
    from fegear.gearset import builtin_names, load_gear_set

    found = []
    for name in builtin_names():
        gear_set = load_gear_set(name)
        counts = len(gear_set.gears), len(gear_set.meshes)
        found.append(BuiltIn(name, *counts, gear_set.description))
    if as_json:
        print_json({"gear_sets": [asdict(each) for each in found]})
        return
    columns = ("name", "gears", "meshes", "description")
    table = ruled_table(*columns, words=("name", "description"))
    for each in found:
        table.add_row(*map(str, asdict(each).values()))
    screen().print(table)
