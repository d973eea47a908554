"""Module and pressure angle of a gear by the keys that may state them.

The rack is known in the normal section. With helix angle b on the reference cylinder

    m_n = m_t cos(b),    tan(alpha_n) = tan(alpha_t) cos(b),    m = 25.4 mm / DP

(DIN 3960). The geometry is that of the section across the axis, so that
values of transverse keys are used as they are.
"""

from __future__ import annotations

import math

from lumped.common.units import MM

MM_PER_INCH = 25.4
MODULE_KEYS = (
    "module_mm",
    "transverse_module_mm",
    "diametral_pitch_per_in",
    "transverse_diametral_pitch_per_in",
)
PRESSURE_ANGLE_KEYS = ("pressure_angle_deg", "transverse_pressure_angle_deg")
DEFAULT_PRESSURE_ANGLE_DEG = 20.0  # in the normal section
RESTATED_RTOL = 1e-12  # round-off of a value that is restated by another key
MIN_MODULE_MM, MAX_MODULE_MM = 0.01, 1000.0


def module_across(key: str, value: float, helix_angle: float) -> float:
    """Module across the axis [m] by a key of `MODULE_KEYS`; helix_angle in rad."""
    module = (MM_PER_INCH / value if _is_pitch(key) else value) * MM
    if helix_angle and not _is_transverse(key):
        module /= math.cos(helix_angle)
    return module


def value_of_module(key: str, module: float, helix_angle: float) -> float:
    """Value that a key of `MODULE_KEYS` has for a module across the axis [m]."""
    if helix_angle and not _is_transverse(key):
        module *= math.cos(helix_angle)
    return MM_PER_INCH / (module / MM) if _is_pitch(key) else module / MM


def angle_across(key: str, value: float, helix_angle: float) -> float:
    """Pressure angle across the axis [rad] by a key of `PRESSURE_ANGLE_KEYS`."""
    angle = math.radians(value)
    if helix_angle and not _is_transverse(key):
        angle = math.atan(math.tan(angle) / math.cos(helix_angle))
    return angle


def value_of_angle(key: str, angle: float, helix_angle: float) -> float:
    """Value [deg] of a key of `PRESSURE_ANGLE_KEYS` for an angle across the axis."""
    if helix_angle and not _is_transverse(key):
        angle = math.atan(math.tan(angle) * math.cos(helix_angle))
    return math.degrees(angle)


def restated(key: str, value: float, other: str, helix_angle_deg: float) -> float:
    """Value that another key of the same quantity has for the value of a key."""
    if other == key:
        return value
    helix_angle = math.radians(helix_angle_deg)
    if key in MODULE_KEYS:
        module = module_across(key, value, helix_angle)
        return value_of_module(other, module, helix_angle)
    angle = angle_across(key, value, helix_angle)
    return value_of_angle(other, angle, helix_angle)


def _is_pitch(key: str) -> bool:
    return key.endswith("diametral_pitch_per_in")


def _is_transverse(key: str) -> bool:
    return key.startswith("transverse_")
