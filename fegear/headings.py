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


BENDING = "friction-bending ratio"  # entry of a header of lumped models
TURNED = "direction of friction"  # entry of a header where vibration can turn it


def friction_of(header: Mapping[str, str]) -> float:
    """Coefficient of friction of the teeth, 0 where the header has none."""
    return float(header.get("friction coefficient", "0"))


def sliding_of(header: Mapping[str, str]) -> str | None:
    """Whose sliding friction opposes, nominal or instantaneous.

    None without friction, and of finite elements, which have a rule of their own.
    """
    if not friction_of(header) or BENDING not in header:
        return None
    return "instantaneous" if TURNED in header else "nominal"


def friction_in_words(coefficient: float, sliding: str | None = None) -> str:
    """For a title or a line, empty without friction."""
    if not coefficient:
        return ""
    turned = " turned by vibration" if sliding == "instantaneous" else ""
    return f", friction {coefficient:g}{turned}"
