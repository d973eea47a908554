"""Signals of sensors as pictures and screens show them."""

from __future__ import annotations

SHOWN_SIGNALS = 4  # in a picture
SUFFIXES = ("_rad_per_s", "_m_per_s2", "_m", "_N")  # units of signals
SCALES = {
    "m": (1e6, "um"),
    "rad/s": (1e3, "mrad/s"),
    "m/s2": (1.0, "m/s2"),
    "N": (1.0, "N"),
}


def signal_label(name: str) -> str:
    """Name of a signal without its unit, in words."""
    for suffix in SUFFIXES:
        name = name.removesuffix(suffix)
    return name.replace("_dte", ": transmission error").replace("_", " ")
