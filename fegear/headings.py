"""What branches of a gear set are of, from the header of their file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

FIXED = {  # in a summary, by the entry of the header
    "speed_Hz": "speed_Hz",
    "torque_Nm": "torque_Nm",
    "damping_ratio": "damping ratio",
}
WORDS = {  # of what a summary holds fixed
    "model": "model {}",
    "excitation": "{}",
    "speed_Hz": "{:g} Hz",
    "torque_Nm": "{:g} N m",
    "damping_ratio": "damping ratio {:g}",
    "harmonics": "harmonics up to {}",
}


def heading(header: Mapping[str, str], over: str) -> dict[str, Any]:
    """Plain values, ready for JSON, of what is fixed; None for what varies.

    over : the figure that varies
    """
    fixed = {
        key: float(header[entry]) if entry in header else None
        for key, entry in FIXED.items()
    }
    return {
        "gear_set": header["gear set"],
        "model": header["model"],
        "excitation": header["excitation"],
        "over": over,
        **fixed,
    }


def title_of(values: Mapping[str, Any]) -> str:
    """The heading of a summary in words."""
    fixed = (
        text.format(values[name])
        for name, text in WORDS.items()
        if values.get(name) is not None
    )
    return ", ".join([values["gear_set"], *fixed])


def friction_of(header: Mapping[str, str]) -> float:
    """Coefficient of friction of the teeth, 0 where the header has none."""
    return float(header.get("friction coefficient", "0"))


def friction_in_words(coefficient: float) -> str:
    """For a title or a line, empty without friction."""
    return f", friction {coefficient:g}" if coefficient else ""
