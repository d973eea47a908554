"""Summaries of trains in the words of screens and titles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

WORDS = {  # of what a summary holds fixed
    "model": "model {}",
    "excitation": "{}",
    "speed_Hz": "{:g} Hz",
    "torque_Nm": "{:g} N m",
    "damping_ratio": "damping ratio {:g}",
    "harmonics": "harmonics up to {}",
}
SHOWN_FREQUENCIES = 8  # natural frequencies in a line
TORQUE_WORDS = {
    "nominal": "of gears without friction",
    "input": "of the input gear with friction",
}


def title_of(values: Mapping[str, Any]) -> str:
    """The heading of a summary in words."""
    constants = (
        text.format(values[name])
        for name, text in WORDS.items()
        if values.get(name) is not None
    )
    return ", ".join([values["gear_set"], *constants])


def friction_of_summary(values: Mapping[str, Any]) -> str:
    """`friction_in_words` of a summary."""
    names = "friction_coefficient", "sliding", "torque_of"
    return friction_in_words(*(values[name] for name in names))


def friction_in_words(
    coefficient: float, sliding: str | None = None, torque: str | None = None
) -> str:
    """For a title or a line, empty without friction.

    sliding, torque : `sliding` and `torque_of` of the model
    """
    if not coefficient:
        return ""
    turned_text = " turned by vibration" if sliding == "instantaneous" else ""
    of = "" if torque is None else f", torque {TORQUE_WORDS[torque]}"
    return f", friction {coefficient:g}{turned_text}{of}"


def edits_in_words(header: Mapping[str, str]) -> str:
    """`KEY = VALUE, ...` of the entries in a header, for a title."""
    changes = (item for item in header.items() if item[0].startswith("set "))
    return ", ".join(f"{key[4:]} = {value}" for key, value in changes)


def first_frequencies(frequencies: Sequence[float]) -> str:
    """The lowest frequencies [Hz], and how many more there are."""
    lines = ", ".join(f"{f:.1f}" for f in frequencies[:SHOWN_FREQUENCIES])
    more = len(frequencies) - SHOWN_FREQUENCIES
    return f"{lines} and {more} more, all by --json" if more > 0 else lines
