"""Contact problems whose flanks differ from those of another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fegear.contact.problem import ContactProblem


def with_flanks(problem: ContactProblem, **changes: Any) -> ContactProblem:
    """The problem with other values of a flank, such as `driver_tip_relief`."""
    flanks: dict[str, Any] = {"driver": problem.driver, "driven": problem.driven}
    for name, value in changes.items():
        role, _, attribute = name.partition("_")
        flanks[role] = replace(flanks[role], **{attribute: value})
    return replace(problem, **flanks)
