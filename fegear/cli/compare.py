"""fegear compare: finite elements beside closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from fegear.cli.options import (
    AsJson,
    DriverTorque,
    Mesh,
    Plane,
    SetName,
    chosen,
    driver_torque,
    require_mesh,
    show,
)
from fegear.cli.screen import ruled_table, screen

if TYPE_CHECKING:
    from validation.compare import Comparison

EXAMPLE = "fegear compare liu-pair --torque 100"


def compare_command(
    set_name: SetName = "liu-pair",
    mesh: Mesh = 1,
    torque: DriverTorque = None,
    plane: Plane = None,
    as_json: AsJson = False,
) -> None:
    """Finite elements beside ISO 6336 and other closed forms.

    The others are the potential-energy method, Hertz and the twist of a ring. The
    closed forms know teeth without profile modification or pitch error.
    """
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    require_mesh(gear_set, mesh)
    at = driver_torque(gear_set, mesh, torque)
    from fegear.statics import StaticsSettings
    from validation.compare import compare_mesh

    settings = StaticsSettings(estimate_error=False, **chosen(plane=plane))
    found = compare_mesh(gear_set, mesh - 1, at, settings)
    rows = [asdict(row) | {"per_cent": row.per_cent} for row in found.rows]
    values = {"gear_set": gear_set.name, "torque_Nm": at, "comparisons": rows}
    title = f"{gear_set.name} mesh {mesh}, {at:g} N m, plane {settings.plane}"
    values["warnings"] = found.warnings
    show(values, as_json, lambda _: _print_rows(found.rows, title))


def _print_rows(rows: Sequence[Comparison], title: str) -> None:
    names = ("finite\nelements", "closed\nform", "closed form\n- FE [%]")
    words = ("quantity", "closed form")
    table = ruled_table(*words, *names, title=title, words=words)
    for row in rows:
        slope = "" if row.slope == "-" else f", {row.slope} slope"
        unit = "" if row.unit == "-" else f" [{row.unit}]"
        quantity = f"{row.quantity}{slope}{unit}"
        numbers = (f"{row.finite_elements:.4g}", f"{row.expected:.4g}")
        table.add_row(quantity, row.oracle, *numbers, f"{row.per_cent:+.1f}")
    screen().print(table)
