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


TORQUE_WORDS = {
    "nominal": "of gears without friction",
    "input": "of the input gear with friction",
}
TORQUE_OF = "torque"  # entry of a header where it is that of the input with friction


def torque_of(header: Mapping[str, str]) -> str | None:
    """Which torque is given, nominal or that of the input gear; None without friction,
    where they are the same."""
    if not friction_of(header):
        return None
    return "input" if TORQUE_OF in header else "nominal"


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


def friction_of_summary(values: Mapping[str, Any]) -> str:
    """`friction_in_words` of a summary."""
    names = "friction_coefficient", "sliding", "torque_of"
    return friction_in_words(*(values[name] for name in names))


def friction_in_words(
    coefficient: float, sliding: str | None = None, torque: str | None = None
) -> str:
    """For a title or a line, empty without friction.

    sliding, torque : as by `sliding_of` and `torque_of`
    """
    if not coefficient:
        return ""
    turned = " turned by vibration" if sliding == "instantaneous" else ""
    of = "" if torque is None else f", torque {TORQUE_WORDS[torque]}"
    return f", friction {coefficient:g}{turned}{of}"


def edits_in_words(header: Mapping[str, str]) -> str:
    """`KEY = VALUE, ...` of the entries in a header, for a title."""
    changes = (item for item in header.items() if item[0].startswith("set "))
    return ", ".join(f"{key[4:]} = {value}" for key, value in changes)
