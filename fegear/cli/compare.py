"""fegear compare: finite elements beside the closed forms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fegear.cli.options import PlaneChoice, checked_torques, require
from fegear.cli.screen import print_json, ruled_table, screen

if TYPE_CHECKING:
    from validation.compare import Comparison


def compare_command(
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-pair",
    mesh: Annotated[int, typer.Option(help="Which mesh, counted from 1.")] = 1,
    torque: Annotated[
        float | None, typer.Option(help="Torque on the driving gear [N m].")
    ] = None,
    plane: Annotated[
        PlaneChoice, typer.Option(help="Plane hypothesis.")
    ] = PlaneChoice.stress,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Finite elements beside ISO 6336, potential energy, Hertz and ring twist.

    Example: fegear compare liu-pair --torque 100
    """
    from fegear.errors import InputError
    from fegear.gearset import load_gear_set

    gear_set = load_gear_set(set_name)
    count = len(gear_set.meshes)
    require(1 <= mesh <= count, "--mesh", mesh, f"{gear_set.name} has {count}")
    cases = gear_set.meshes[mesh - 1].torques
    chosen = checked_torques([torque] if torque is not None else list(cases))
    if not chosen:
        raise InputError(f"--torque is missing; {gear_set.name} names no load")
    from fegear.statics import StaticsSettings
    from validation.compare import compare_mesh

    at = chosen[len(chosen) // 2]
    settings = StaticsSettings(plane=plane.value, estimate_error=False)
    rows = compare_mesh(gear_set, mesh - 1, at, settings)
    if as_json:
        from dataclasses import asdict

        lines = [asdict(row) | {"per_cent": row.per_cent} for row in rows]
        values = {"gear_set": gear_set.name, "torque_Nm": at, "comparisons": lines}
        print_json(values)
        return
    _print_rows(rows, f"{gear_set.name} mesh {mesh}, {at:g} N m, plane {plane.value}")


def _print_rows(rows: list[Comparison], title: str) -> None:
    names = ("finite\nelements", "closed\nform", "closed form\n- FE [%]")
    table = ruled_table("quantity", "closed form", *names, title=title, text=2)
    for row in rows:
        slope = "" if row.slope == "-" else f", {row.slope} slope"
        unit = "" if row.unit == "-" else f" [{row.unit}]"
        quantity = f"{row.quantity}{slope}{unit}"
        numbers = (f"{row.finite_elements:.4g}", f"{row.expected:.4g}")
        table.add_row(quantity, row.oracle, *numbers, f"{row.per_cent:+.1f}")
    screen().print(table)
