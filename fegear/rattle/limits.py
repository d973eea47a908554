"""How far motions of rattle are followed, and what to do where they need more."""

from __future__ import annotations

from typing import Any

from fegear.studies.study import called

LEAST_RETURNS, MOST_RETURNS = 100, 10_000_000  # until motions count as settled


def unsettled(study: Any, part: float, what: str, iterations: int, needed: int) -> str:
    """What to do about departures of a study that have not settled."""
    name = called(study, "iterations")
    more = f"half the damping ends transients in {needed}: {name} {needed}"
    if needed > MOST_RETURNS:
        more = (
            f"half the damping ends transients in {needed:.3g}, which {name} "
            f"cannot be: {MOST_RETURNS} are the most"
        )
    elif iterations >= needed:
        more = "irregular motion may last long before it ends"
        if iterations < MOST_RETURNS:
            more += f": more {name}"
    return (
        f"{100.0 * part:.3g} % of the {what} have not settled in {iterations} returns; "
        f"{more}"
    )
