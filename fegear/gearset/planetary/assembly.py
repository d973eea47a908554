"""Whether planets fit between sun and ring, and beside each other.

Angles in degrees, as in files. A planet fits where (z_s + z_r) times its angle to the
first planet is a whole number of turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from fegear.files.errors import InputError
from fegear.gearset.planetary.members import MAX_PLANETS, Members
from meshes.gear import ceiled

WHOLE = 1e-4  # deviation from a whole number that is round-off of positions


def require_assembly(
    members: Members,
    positions_deg: Sequence[float],
    radius: float,
    tip_radius: float,
) -> None:
    """Require that all planets fit; raises InputError with the nearest that would.

    radius : of the circle of their axes; tip_radius : of a planet
    """
    teeth, least = members.sun + members.ring, least_angle(radius, tip_radius)
    steps = [(p - positions_deg[0]) * teeth / 360.0 for p in positions_deg]
    equal = f"equally spaced, {_listed(equal_numbers(teeth, least))} fit"
    off = [n for n, step in enumerate(steps) if abs(step - round(step)) > WHOLE]
    if off:
        fitting = [
            positions_deg[0] + step * 360.0 / teeth
            for step in _opposed_steps(steps, teeth) or map(round, steps)
        ]
        listed = ", ".join(f"{angle:.10g}" for angle in fitting)
        gap = least_gap(fitting)
        nearest = f"nearest positions_deg = [{listed}]; " if gap > least else ""
        raise InputError(
            f"planetary: planet {off[0] + 1} cannot be assembled; teeth of sun and "
            f"ring, {teeth}, times the angle to the first planet are "
            f"{steps[off[0]]:.6g} turns, a whole number is needed; {nearest}{equal}"
        )
    gap = least_gap(positions_deg)
    if not gap > least:
        overlap = 2e3 * (tip_radius - radius * math.sin(math.radians(0.5 * gap)))
        raise InputError(
            f"planetary: tips of neighbouring planets overlap by {overlap:.4g} mm at "
            f"{gap:.6g} deg between them; more than {ceiled(least)} deg is needed; "
            f"{equal}"
        )


def _opposed_steps(steps: Sequence[float], teeth: int) -> list[int]:
    """Whole numbers next to steps with planets opposite to each other in pairs.

    Forces and masses of such planets are balanced. Empty where half a turn does not
    fit, or where a planet would be more than a step from its position.

    steps : angles to the first planet, of which a turn has the number of teeth
    """
    planets = len(steps)
    if planets % 2 or teeth % 2:
        return []
    order = sorted(range(planets), key=lambda n: steps[n] % teeth)
    order = order[order.index(0) :] + order[: order.index(0)]
    half_turn, fitting = teeth // 2, [0] * planets
    for one, other in zip(order, order[planets // 2 :], strict=False):
        beyond = math.remainder(steps[other] - steps[one] - half_turn, teeth)
        fitting[one] = round(steps[one] + 0.5 * beyond) if one else 0
        turns = round((steps[other] - fitting[one] - half_turn) / teeth)
        fitting[other] = fitting[one] + half_turn + turns * teeth
    near = (abs(a - b) <= 1.0 for a, b in zip(fitting, steps, strict=True))
    return fitting if all(near) else []


def equal_numbers(teeth: int, least: float = 0.0) -> list[int]:
    """Numbers of equally spaced planets that fit.

    teeth : of sun and ring together; least : angle between neighbours [deg]
    """
    numbers = range(2, MAX_PLANETS + 1)
    return [n for n in numbers if teeth % n == 0 and 360.0 / n > least]


def least_angle(radius: float, tip_radius: float) -> float:
    """Angle between neighbours whose tips just touch [deg]."""
    return math.degrees(2.0 * math.asin(min(1.0, tip_radius / radius)))


def least_gap(positions_deg: Sequence[float]) -> float:
    """Smallest angle between neighbouring planets [deg]."""
    turned = sorted(position % 360.0 for position in positions_deg)
    following = [*turned[1:], turned[0] + 360.0]
    return min(b - a for a, b in zip(turned, following, strict=True))


def _listed(numbers: Sequence[int]) -> str:
    return " or ".join(map(str, numbers)) or f"no number of 2 to {MAX_PLANETS}"
