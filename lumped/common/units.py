"""Units of keys, columns and figures, and factors of those that are not of SI."""

from __future__ import annotations

MM, UM = 1e-3, 1e-6  # [m]
TO_MM, TO_UM = 1e3, 1e6  # of a length in metres
# by the end of a key or of a column, longer ends first
UNITS = {
    "rad2_per_turn3": "rad2/turn3",
    "rad_per_turn": "rad/turn",
    "Nm_per_rad": "N m/rad",
    "Nms_per_rad": "N m s/rad",
    "kg_per_m3": "kg/m3",
    "N_per_mm3": "N/mm3",
    "N_per_mm": "N/mm",
    "MPa_sqrt_m": "MPa sqrt(m)",
    "J_per_m2": "J/m2",
    "m2_per_N": "m2/N",
    "Ns_per_m": "N s/m",
    "N_per_m_n": "N/m^n",
    "N_per_m": "N/m",
    "m_per_N": "m/N",
    "rad_per_s": "rad/s",
    "m_per_s2": "m/s2",
    "m_per_s": "m/s",
    "per_period": "1/period",
    "per_turn": "1/turn",
    "per_s": "1/s",
    "per_in": "1/in",
    "kg_m2": "kg m2",
    "seconds": "s",
    "per_cent": "%",
    "percent": "%",
    "pitches": "base pitches",
    "turns": "turns",
    "urad": "urad",
    "deg": "deg",
    "rad": "rad",
    "rpm": "rpm",
    "GPa": "GPa",
    "MPa": "MPa",
    "Pa": "Pa",
    "Nm": "N m",
    "Ns": "N s",
    "Hz": "Hz",
    "MB": "MB",
    "mm": "mm",
    "um": "um",
    "ms": "ms",
    "us": "us",
    "kg": "kg",
    "J": "J",
    "N": "N",
    "W": "W",
    "m": "m",
    "s": "s",
}


def split_unit(name: str) -> tuple[str, str]:
    """A name without its unit, and the unit, which is empty where there is none."""
    for end, unit in UNITS.items():
        if f"_{name}".endswith(f"_{end}"):
            return name.removesuffix(end).removesuffix("_"), unit
    return name, ""
