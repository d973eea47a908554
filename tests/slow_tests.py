"""Slow tests run by `-m slow`, or where an argument names them, as `x.py::test_y`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

# One study of each form, which contract tests of all studies run in the quick tier: of
# a mesh, of motions, of a file that is written, of figures that are read, of pictures,
# of machines and gearboxes, of evidence
FORMS = {
    *("stiffness", "sweep", "new", "theory", "show", "rattle periodic", "clatter"),
    *("bench stiffness", "reproduce"),
}


def in_tier_of(command: str, *values: Any, id: str | None = None) -> Any:
    """Values of a test of a study, quick if it is the one of its form."""
    marks = [] if command in FORMS else [pytest.mark.slow]
    return pytest.param(command, *values, marks=marks, id=id)


def first_are_quick(cases: Iterable[Any], count: int = 2) -> list[Any]:
    """Cases of a parametrised test. All but the first `count` are marked slow."""
    return [
        case if number < count else pytest.param(case, marks=pytest.mark.slow)
        for number, case in enumerate(cases)
    ]


def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Leave out slow tests that nothing on the command line selects."""
    if config.option.markexpr:
        return
    selected, left_out = list[pytest.Item](), list[pytest.Item]()
    for item in items:
        is_slow = item.get_closest_marker("slow") is not None
        (left_out if is_slow and not _is_named(item, config) else selected).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = selected


def _is_named(item: pytest.Item, config: pytest.Config) -> bool:
    _, _, test = item.nodeid.partition("::")
    for argument in config.args:
        path, _, name = argument.partition("::")
        if not name or (config.invocation_params.dir / path).resolve() != item.path:
            continue
        if test == name or test.startswith((f"{name}[", f"{name}::")):
            return True
    return False
