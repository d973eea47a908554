"""Keys of values that are compared with printed ones, as cases name them."""

from __future__ import annotations

import re

NATURAL = "natural"
STATICS = (
    r"mesh([1-9])\."
    "(mean_stiffness|stiffness_variation|friction_recess|friction_approach)"
)
CURVE = r"mesh([1-9])\.(up|down)\.(jump|peak)"
CYCLE = r"mesh([1-9])\.wave([1-9])\.(force_peak|contact_loss)"


def require_key(key: str) -> str:
    if not any(
        re.fullmatch(pattern, key) for pattern in (NATURAL, STATICS, CURVE, CYCLE)
    ):
        allowed = "natural or such as mesh1.mean_stiffness, mesh1.up.jump"
        raise ValueError(f"must be {allowed} or mesh1.wave1.force_peak")
    return key
