"""Torques that studies of trains take."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from fegear.boundary import require_torque
from fegear.files.errors import InputError
from fegear.files.speed_ranges import parsed_speeds
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import input_torques
from fegear.gearset.torque_limits import TORQUE, TORQUE_LIMITS
from fegear.studies.settings import setting
from lumped.common.checks import format_number
from lumped.steady.maps import Axis


def torque_setting() -> Any:
    return setting(
        None,
        "Torque on the input gear [N\u00a0m]. [default: middle load case of the gear "
        "set]",
    )


def torques_setting(gear: str = "input gear") -> Any:
    """A setting of torques, each a number or `A:B:STEP` in words.

    gear : on which they act
    """
    return setting(
        (),
        f"Torque on the {gear} [N\u00a0m], or several as A:B:STEP or with commas; may "
        "be repeated. [default: all load cases of the gear set]",
        option="--torque",
        metavar="A:B:STEP",
        parse=_torques,
        several=True,
    )


def _torques(text: str) -> tuple[float, ...]:
    with suppress(ValueError):
        return (float(text),)
    return parsed_speeds(text, name="torques")


def chosen_torques(
    gears: GearSet, torques: tuple[float, ...], mesh: int | None = None
) -> tuple[float, ...]:
    """Torques on the input gear [N m]: as asked, or the gear set's load cases.

    mesh : counted from 1, on whose driver they are instead
    """
    free = mesh is None  # gears without load can be integrated, not solved at rest
    for value in torques:
        _require_load(value, "torque", free)
        if torques.count(value) > 1:
            raise InputError(f"torque = {value:.12g}; is given more than once")
    load_cases = (
        input_torques(gears) if mesh is None else gears.meshes[mesh - 1].torques
    )
    if not torques and not load_cases:
        setting_name = "" if free else f" for mesh {mesh}"
        raise InputError(
            f"torque is missing; {gears.name} has no load case{setting_name}"
        )
    return torques or load_cases


def _require_load(value: float, name: str, is_free: bool) -> None:
    """Refuse a torque that is no load; is_free : whether it may be 0."""
    if not is_free:
        require_torque(name, value, "the driving gear")
    elif value != 0.0 and value not in TORQUE:
        raise InputError(
            f"{name} = {format_number(value)}; must be 0, or {TORQUE_LIMITS}, on the "
            "input gear"
        )


def require_torque_axis(axis: Axis, over: str) -> None:
    """Refuse an axis of torques on the input gear of which one is no load."""
    for value in axis.values:
        _require_load(value, f"{over} {axis.name}", is_free=True)


def chosen_torque(
    gears: GearSet, torque: float | None, mesh: int | None = None
) -> float:
    """The torque that is asked for [N m], or the middle load case."""
    torques = chosen_torques(gears, () if torque is None else (torque,), mesh)
    return torques[len(torques) // 2]
