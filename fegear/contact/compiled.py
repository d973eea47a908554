"""numba's compiler with an on-disk cache that may be unavailable."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def _compile(function: F, **options: Any) -> F:
    options["error_model"] = "numpy"  # division by zero gives inf, caught as such
    try:
        return njit(cache=True, **options)(function)
    except RuntimeError:  # numba found no writable place, neither here nor at home
        return njit(**options)(function)


def compiled(function: F) -> F:
    """Compile on first call; cache on disk where some directory can be written."""
    return _compile(function)


def compiled_part(function: F) -> F:
    """Compile for use in other compiled functions only, in half the time.

    Python calls it uncompiled as `function.py_func`.
    """
    return _compile(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)
