"""The page on kinds of gears says what every command takes and refuses."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from nothing_computed import Computed, arguments_of, nothing_is_computed
from short_uses import SHORT_USES
from small_sets import BALLS, BENT, PLANETARY, Tables

from fegear.cli import run
from fegear.files.toml import toml_text

__all__ = ["nothing_is_computed"]
PAGE = Path(__file__).parents[3] / "docs/reference/kinds.md"
# those that need more than gears, or other files
NOT_OF_GEARS = {"sharing"}
# those that are about shafts; others may refuse more of gears on shafts that yield
OF_SHAFTS = {"campbell", "shafts"}
RING = {"name": "b", "teeth": 60, "internal": True, "rim_radius_mm": 72.0}


def with_gear(tables: Tables, **keys) -> Tables:
    return tables | {"gear": [tables["gear"][0] | keys, tables["gear"][1]]}


def with_mesh(tables: Tables, **keys) -> Tables:
    mesh = {
        name: value for name, value in tables["mesh"][0].items() if name not in keys
    }
    return tables | {"mesh": [mesh | {k: v for k, v in keys.items() if v is not None}]}


def with_defaults(tables: Tables, **keys) -> Tables:
    return tables | {"defaults": tables["defaults"] | keys}


def with_halves(tables: Tables) -> Tables:
    """The gears as double helical ones."""
    gears = [
        gear | {"hand": "double", "gap_mm": 3.0, "face_width_mm": 20.0}
        for gear in tables["gear"]
    ]
    return with_defaults(tables | {"gear": gears}, helix_angle_deg=18.0)


# bearings and shafts for the commands that are about them
SPUR = with_gear(BENT, ball_bearing=BALLS)
INTERNAL = with_mesh(
    with_defaults(SPUR, profile_shift=0.0) | {"gear": [SPUR["gear"][0], RING]},
    operating_pressure_angle_deg=None,
    backlash_um=50.0,
)
SUN = PLANETARY["gear"][0] | {"name": "a"}
PLANETS = PLANETARY | {
    "gear": [SUN, *PLANETARY["gear"][1:]],
    "planetary": [PLANETARY["planetary"][0] | {"sun": "a"}],
    "load": PLANETARY["load"] | {"gear": "a"},
}
KINDS = {
    "spur": SPUR,
    "crowned": with_mesh(SPUR, lead={"crowning_um": 5.0}),
    "helical": with_defaults(SPUR, helix_angle_deg=18.0),
    "internal": INTERNAL,
    "planetary": PLANETS,
    "pitch errors": with_gear(SPUR, pitch_errors_um=[1.0, *18 * [0.0]]),
    "helical ring": with_defaults(INTERNAL, helix_angle_deg=12.0),
    "double helical": with_halves(SPUR),
    "helical planets": with_defaults(PLANETS, helix_angle_deg=12.0),
    "cracked": with_gear(SPUR, cracks=[{"tooth": 1, "depth_mm": 1.0}]),
}


def commands() -> Iterator[str]:
    """Commands whose short use is of the gears of a pair."""
    for name, use in SHORT_USES.items():
        if "SET" in use.text.split() and name not in NOT_OF_GEARS:
            yield name


def declared() -> dict[str, list[str]]:
    """Rows of the table, by command."""
    rows = re.findall(r"^\| `([a-z ]+)` \|(.*)\|$", PAGE.read_text("utf-8"), re.M)
    return {name: [cell.strip() for cell in cells.split("|")] for name, cells in rows}


def is_taken(arguments: list[str], capsys) -> bool:
    """Whether a command begins to compute, or ends well."""
    try:
        code = run(arguments)
    except Computed:
        return True
    error = capsys.readouterr().err
    assert code in (0, 2) or "Computed" in error, error
    return code != 2


def test_the_table_has_all_commands_and_kinds():
    (heading,) = re.findall(r"^\| Command \|(.*)\|$", PAGE.read_text("utf-8"), re.M)
    assert [cell.strip() for cell in heading.split("|")] == list(KINDS)
    assert list(declared()) == sorted(commands())


@pytest.mark.parametrize("name", sorted(commands()))
def test_what_is_taken_and_refused(capsys, name):
    marks = {}
    for kind, tables in KINDS.items():
        skipped = () if name in OF_SHAFTS else ("shaft",)
        taken = {key: value for key, value in tables.items() if key not in skipped}
        Path("set.toml").write_text(toml_text(taken), "utf-8")
        marks[kind] = "x" if is_taken(arguments_of(name), capsys) else "-"
    assert marks == dict(zip(KINDS, declared()[name], strict=True))
