"""Checks of settings, made once at the interface; computations rely on them.

Each raises ValueError with the name of the setting, the allowed values and the value
received.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import fields
from functools import lru_cache, wraps
from inspect import signature
from numbers import Integral, Real
from operator import is_
from types import NoneType, UnionType
from typing import (
    Any,
    Literal,
    ParamSpec,
    TypeGuard,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from lumped.common.options import Range, allowed_of

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")
MAX_FLOAT = sys.float_info.max
MAX_SHOWN_LENGTH = 200  # letters of a value in a message
TYPE_DESCRIPTIONS = {
    bool: "True or False",
    int: "a whole number",
    float: "a finite number",
    str: "text",
    NoneType: "None",
}


def require_present(value: T | None, name: str) -> T:
    """A value that is there; ValueError that names what is missing."""
    if value is None:
        raise ValueError(f"{name} is missing")
    return value


def require_between(
    name: str,
    value: float,
    low: float,
    high: float,
    above: bool = False,
    below: bool = False,
) -> None:
    """Require a number from low to high; `above` excludes low, `below` high."""
    inside = is_number(value) and low <= value <= high
    if inside and not (above and value == low) and not (below and value == high):
        return
    first, last = (
        f"{end:.12g}".replace("e+0", "e").replace("e-0", "e-") for end in (low, high)
    )
    start, end = "above " if above else "", "below " if below else ""
    raise ValueError(
        f"{name} = {format_value(value)}; must be {start}{first} to {end}{last}"
    )


def require_in(
    name: str, value: object, allowed: Range, words: Collection[object] = ()
) -> None:
    """Require a number of a range; words : that are allowed in its place."""
    if words and not (is_number(value) and value in allowed):
        choices = ", ".join(map(str, words))
        raise ValueError(
            f"{name} = {format_value(value)}; must be {choices}, or {allowed}"
        )
    above, below = allowed.least == -math.inf, allowed.most == math.inf
    low = allowed.above if above else allowed.least
    high = allowed.below if below else allowed.most
    require_between(name, value, low, high, above, below)  # type: ignore[arg-type]


def require_choice(name: str, value: object, allowed: Collection[object]) -> None:
    """Require one of several values."""
    if not any(_equals(value, choice) for choice in allowed):
        raise ValueError(
            f"{name} = {format_value(value)}; must be {_join_choices(allowed)}"
        )


def require_fields(settings: Any, infinite: Collection[str] = ()) -> None:
    """Require that the fields of a dataclass match their types, are finite and allowed.

    Limits are those of `lumped.common.options.option`. NumPy's numbers, also in
    tuples, become Python's. The contents of arrays and mappings are checked elsewhere.

    infinite : fields whose number may also be infinite
    """
    for name, (kind, allowed) in _field_types(settings.__class__).items():
        value = plain = getattr(settings, name)
        if type(value) is list and get_origin(kind) is tuple:
            plain = tuple(value)
        if value is not (plain := plain_numbers(plain)):
            object.__setattr__(settings, name, plain)
            value = plain
        choices = _words_of_type(kind)
        is_other = bool(choices) and not _matches_type(value, kind)
        if allowed is not None and (is_number(value) or is_other):
            require_in(name, value, allowed, choices)
        if not (name in infinite and is_number(value) and value == math.inf):
            require_kind(name, value, kind)


def plain_numbers(value: Any) -> Any:
    """A number or tuple with Python's numbers in place of all others, else as it is.

    Others are those of NumPy, fractions and the like.
    """
    if isinstance(value, np.generic):
        value = value.item()  # of a longer float it is the same again
    if isinstance(value, Real) and not isinstance(value, int | float):
        return int(value) if isinstance(value, Integral) else _to_float(value)
    if type(value) is tuple:
        plain = tuple(map(plain_numbers, value))
        return value if all(map(is_, plain, value)) else plain
    return value


def _to_float(value: Any) -> float:
    """The nearest float, infinite for what is beyond all floats."""
    try:
        with np.errstate(over="ignore"):  # of longer floats, which become infinite
            return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate an interface function so that it checks the types of its arguments."""

    @wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        require_arguments(function, bound_arguments(function, args, kwargs))
        return function(*args, **kwargs)

    return run


def bound_arguments(
    function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]
) -> dict[str, Any]:
    """Arguments of a call by their names; TypeError lists those that there are."""
    its_signature = signature(function)
    try:
        return its_signature.bind(*args, **kwargs).arguments
    except TypeError as error:
        names = ", ".join(its_signature.parameters)
        raise TypeError(
            f"{function.__name__}: {error}; its arguments are {names}"
        ) from None


def require_arguments(
    function: Callable[..., Any], arguments: Mapping[str, object]
) -> None:
    """Require that arguments, given by name, match the types of a function."""
    kinds = _argument_types(function)
    for name, value in arguments.items():
        require_kind(name, value, kinds[name])


def require_kind(name: str, value: object, kind: Any) -> None:
    """Require a value of a type: a float is finite, a Literal is one of its words."""
    if _matches_type(value, kind):
        return
    if get_origin(kind) is tuple and Ellipsis in get_args(kind):
        for element in value if isinstance(value, tuple) else ():
            require_kind(name, element, get_args(kind)[0])
    raise ValueError(f"{name} = {format_value(value)}; must be {_describe_type(kind)}")


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a real number, also NumPy's, and neither NaN nor a Boolean."""
    number = isinstance(value, Real) and not isinstance(value, bool)
    return number and bool(value == value)


def is_finite(value: object) -> bool:
    """Whether a value is a real number in the range of floats, and no Boolean."""
    plain = plain_numbers(value)
    return is_number(plain) and abs(plain) <= MAX_FLOAT


def format_value(value: object) -> str:
    """Received value as text for a message: numbers as printed, all else by repr.

    Of a long one it is the beginning.
    """
    try:
        return shorten(str(value) if isinstance(value, Real) else repr(value))
    except ValueError:  # of whole numbers with thousands of digits
        return "a number of too many digits"


def format_number(value: float) -> str:
    """Received number as text for a message, which no other number has.

    Short, but exact: it differs from any limit that it misses.
    """
    short = f"{value:.12g}"
    return short if float(short) == value or value != value else str(float(value))


def shorten(text: str, max_length: int = MAX_SHOWN_LENGTH) -> str:
    """A text for a message, of a long one the beginning."""
    return text if len(text) <= max_length else f"{text[: max_length - 3]}..."


@lru_cache(maxsize=256)
def _field_types(kind: Any) -> dict[str, tuple[Any, Range | None]]:
    """Type and limits of each field."""
    hints = get_type_hints(kind)
    return {
        entry.name: (hints[entry.name], allowed_of(entry)) for entry in fields(kind)
    }


@lru_cache(maxsize=256)
def _argument_types(function: Callable[..., Any]) -> dict[str, Any]:
    return get_type_hints(function)


def _matches_type(value: object, kind: Any) -> bool:
    simple: dict[Any, Callable[[object], bool]] = {
        bool: lambda v: isinstance(v, bool | np.bool_),
        int: lambda v: isinstance(v, Integral) and not isinstance(v, bool),
        float: is_finite,
    }
    if kind in simple:
        return simple[kind](value)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return any(_matches_type(value, member) for member in arguments)
    if origin is Literal:
        return any(_equals(value, choice) for choice in arguments)
    if origin is tuple:
        return isinstance(value, tuple) and _match_types(value, arguments)
    if origin is Sequence:
        return _is_sequence(value) and all(
            _matches_type(element, *arguments) for element in value
        )
    plain = origin or kind
    checkable = isinstance(plain, type) and plain is not Any and not _is_protocol(plain)
    return isinstance(value, plain) if checkable else True


def _match_types(values: tuple[object, ...], kinds: tuple[Any, ...]) -> bool:
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(values)
    return len(kinds) == len(values) and all(map(_matches_type, values, kinds))


def _words_of_type(kind: Any) -> list[object]:
    """Choices of a type that has others besides."""
    if get_origin(kind) not in (Union, UnionType):
        return []
    members = [member for member in get_args(kind) if get_origin(member) is Literal]
    return [choice for member in members for choice in get_args(member)]


def _is_sequence(value: object) -> TypeGuard[Sequence[object]]:
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str)


def _is_protocol(kind: type) -> bool:
    return bool(getattr(kind, "_is_protocol", False))


def _equals(value: object, choice: object) -> bool:
    """Whether a value equals a choice, also as a NumPy number; 1 is not True or 1.0."""
    plain = value.item() if isinstance(value, np.generic) else value
    return type(plain) is type(choice) and plain == choice


def _describe_type(kind: Any) -> str:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        choices = _words_of_type(kind)
        if choices and set(arguments) - {NoneType} == {Literal[*choices]}:
            return _join_choices([*choices, None])
        return " or ".join(map(_describe_type, arguments))
    if origin is Literal:
        return _join_choices(arguments)
    if origin is tuple:
        members = [_describe_type(a) for a in arguments if a is not Ellipsis]
        if Ellipsis in arguments:
            return f"a list, each {members[0]}"
        return f"a tuple of {', '.join(members)}"
    if origin is Sequence:
        return f"a list, each {_describe_type(arguments[0])}"
    named = str(getattr(kind, "__name__", kind))
    article = "an" if named[0] in "AEIOU" else "a"
    return TYPE_DESCRIPTIONS.get(kind, f"{article} {named}")


def _join_choices(choices: Collection[object]) -> str:
    *others, last = map(str, choices)
    return f"{', '.join(others)} or {last}" if others else last
