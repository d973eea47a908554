"""Checks of the arguments of public functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.torque_limits import TORQUE, TORQUE_LIMITS
from lumped.common.checks import (
    bound_arguments,
    format_number,
    format_value,
    require_arguments,
    shorten,
)

P = ParamSpec("P")
R = TypeVar("R")


def public(function: Callable[P, R]) -> Callable[P, R]:
    """A function of the package, whose arguments must be what their types say."""

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        arguments = bound_arguments(function, args, kwargs)
        if "gear_set" in arguments:
            require_gear_set(arguments["gear_set"])
        require_arguments(function, arguments)
        return function(*args, **kwargs)

    return run


def require_gear_set(value: object) -> None:
    if not isinstance(value, GearSet):
        named = f'("{shorten(value)}")' if isinstance(value, str) else ""
        makes = f"load_gear_set{named}"
        raise InputError(
            f"gear_set = {format_value(value)}; must be a gear set, {makes} makes one"
        )


def mesh_index(gear_set: GearSet, mesh: int) -> int:
    """Index of a mesh in its gear set by its number, which counts from 1.

    Raises InputError where it is not there.
    """
    count = len(gear_set.meshes)
    if not 1 <= mesh <= count:
        meshes = "1 mesh" if count == 1 else f"{count} meshes"
        raise InputError(f"mesh = {mesh}; {gear_set.name} has {meshes}, from mesh 1 on")
    return mesh - 1


def require_torque(name: str, torque: float, gear: str) -> None:
    """Require a torque within its limits; gear : on which it acts."""
    if torque not in TORQUE:
        raise InputError(
            f"{name} = {format_number(torque)}; must be {TORQUE_LIMITS}, on {gear}"
        )
