"""numba's compiler with an on-disk cache that may be unavailable."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile on first call; cache on disk where some directory can be written."""
    try:
        return njit(cache=True)(function)
    except RuntimeError:  # numba found no writable place, neither here nor at home
        return njit(function)
