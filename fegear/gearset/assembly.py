"""Whether planets fit between sun and ring, and beside each other.

Angles in degrees, as in files. A planet fits where (z_s + z_r) times its angle to the
first planet is a whole number of turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from fegear.files.errors import InputError
from fegear.gearset.members import Members

WHOLE = 1e-4  # deviation from a whole number that is round-off of positions
MOST_PLANETS = 12


def require_assembly(members: Members, positions_deg: Sequence[float]) -> None:
    """Require that all planets fit; raises InputError with the nearest that would."""
    teeth = members.sun + members.ring
    steps = [(p - positions_deg[0]) * teeth / 360.0 for p in positions_deg]
    off = [n for n, step in enumerate(steps) if abs(step - round(step)) > WHOLE]
    if not off:
        return
    fitting = [positions_deg[0] + round(step) * 360.0 / teeth for step in steps]
    listed = ", ".join(f"{angle:.10g}" for angle in fitting)
    raise InputError(
        f"planetary: planet {off[0] + 1} cannot be assembled; teeth of sun and ring, "
        f"{teeth}, times the angle to the first planet are {steps[off[0]]:.6g} turns, "
        f"a whole number is needed; nearest positions_deg = [{listed}]; equally "
        f"spaced {_listed(equal_numbers(teeth))} planets fit"
    )


def equal_numbers(teeth: int) -> list[int]:
    """Numbers of equally spaced planets that fit; teeth : of sun and ring together."""
    return [n for n in range(2, MOST_PLANETS + 1) if teeth % n == 0]


def require_room(
    radius: float, tip_radius: float, positions_deg: Sequence[float]
) -> None:
    """Require that tips of neighbouring planets do not meet.

    radius : of the circle of their centres [m]; tip_radius : of a planet [m]
    """
    turned = sorted(math.fmod(math.fmod(p, 360.0) + 360.0, 360.0) for p in positions_deg)
    gaps = [b - a for a, b in zip(turned, [*turned[1:], turned[0] + 360.0], strict=True)]
    least = math.degrees(2.0 * math.asin(min(1.0, tip_radius / radius)))
    if min(gaps) > least:
        return
    most = math.ceil(360.0 / least) - 1
    overlap = 2e3 * (tip_radius - radius * math.sin(math.radians(0.5 * min(gaps))))
    raise InputError(
        f"planetary: tips of neighbouring planets overlap by {overlap:.4g} mm at "
        f"{min(gaps):.6g} deg between them; more than {least:.6g} deg is needed, "
        f"{most} equally spaced planets at most"
    )


def _listed(numbers: Sequence[int]) -> str:
    if not numbers:
        return f"no number up to {MOST_PLANETS} of"
    return " or ".join(map(str, numbers))
