"""Options of the commands of lumped models, and their checks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fegear.cli.options import named_options

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet

LoadCase = Annotated[
    float | None,
    typer.Option(
        help="Torque on the input gear [N\u00a0m]. [default: middle load case of the "
        "gear set]"
    ),
]


def middle_torque(gear_set: GearSet, asked: float | None) -> float:
    """The torque asked for on the input gear, or the middle one of the load cases."""
    from fegear.studies.trains import chosen_torques

    with named_options("torque"):
        torques = chosen_torques(gear_set, () if asked is None else (asked,))
    return torques[len(torques) // 2]
