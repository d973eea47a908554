"""Checks of the arguments of public functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeVar

from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from lumped.common.checks import format_value, require_arguments, shorten

P = ParamSpec("P")
R = TypeVar("R")


def public(function: Callable[P, R]) -> Callable[P, R]:
    """A function of the package, whose arguments must be what their types say."""

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        arguments = signature(function).bind(*args, **kwargs).arguments
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


def require_mesh(gear_set: GearSet, mesh: int) -> None:
    """An index from 0 of a mesh."""
    last = len(gear_set.meshes) - 1
    if not 0 <= mesh <= last:
        raise InputError(
            f"mesh = {mesh}; must be 0 to {last}, counted from 0; {gear_set.name} has "
            f"{last + 1}"
        )
