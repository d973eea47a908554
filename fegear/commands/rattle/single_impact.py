"""Whether a machine has rattle of one impact a turn, in words and as plain values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lumped.rattle.single_impact import SingleImpact


def single_impact_summary(conditions: SingleImpact | None) -> dict[str, Any] | None:
    """Conditions as plain values ready for JSON."""
    if conditions is None:
        return None
    window = conditions.window
    return {
        "from_rad": window[0] if window else None,
        "to_rad": window[1] if window else None,
        "orbit_from_rad": conditions.orbit_from,
        "least_play_rad": conditions.least_play,
        "play_rad": conditions.play,
        "flights": [
            {
                "in_phase": flight.in_phase,
                "height_rad": flight.height,
                "meets_flank": flight.meets,
            }
            for flight in conditions.flights
        ],
    }


def single_impact_lines(
    values: Mapping[str, Any] | None, subject: str, eccentricity: float
) -> Iterator[str]:
    """Where rattle exists, and which condition fails at the machine's eccentricity.

    values : of `single_impact_summary`
    subject : what exists, the first words of a sentence
    """
    if values is None:
        return
    orbit_from, play = values["orbit_from_rad"], values["play_rad"]
    if values["from_rad"] is not None:
        yield (
            f"{subject} exists from {values['from_rad']:.4g} rad up to "
            f"{values['to_rad']:.4g} rad"
        )
    elif values["least_play_rad"] is None:
        yield f"{subject} exists at no eccentricity: flanks do not rebound"
    else:
        yield (
            f"{subject} exists at no eccentricity: impacts balance the drag from "
            f"{orbit_from:.4g} rad on, but a flight needs a play above "
            f"{values['least_play_rad']:.4g} rad and has {play:.4g} rad"
        )
    if not values["flights"]:
        yield (
            f"at {eccentricity:g} rad impacts do not balance the drag, which they do "
            f"from {orbit_from:.4g} rad on"
        )
    for flight in values["flights"]:
        phase = "in phase" if flight["in_phase"] else "out of phase"
        flank = flight["meets_flank"]
        fate = f"meets the {flank} flank" if flank else "stays between the flanks"
        yield (
            f"at {eccentricity:g} rad its flight {phase} is {flight['height_rad']:.4g} "
            f"rad high, the play is {play:.4g} rad: it {fate}"
        )
