"""Flank tolerances of ISO 1328-1:2013, and the default one of centre distances.

A tolerance limits the amount of a deviation: profile slope and single pitch may be
from minus to plus its value. Lengths are in metres.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources

from fegear.files.errors import InputError
from lumped.common.units import MM, UM
from meshes import GearPair, SpurGear

BASE_GRADE = 5  # of the formulas; each further grade has sqrt(2) times its tolerances
# in millimetres
DIAMETERS, MODULES = (5.0, 15_000.0), (0.5, 70.0)
SIZE_RTOL = 1e-9  # by which sizes may be beyond the limits


@dataclass(frozen=True)
class FlankTolerances:
    """Tolerances of the flanks of one gear [m]."""

    single_pitch: float
    profile_slope: float
    profile_form: float


def flank_tolerances(gear: SpurGear, grade: int) -> FlankTolerances:
    """Tolerances of a grade, 1 to 11, rounded as the standard says.

    f_pT = 0.001 d + 0.4 m + 5, f_HalphaT = 0.4 m + 0.001 d + 4 and
    f_falphaT = 0.55 m + 5, with the reference diameter d and the module m [mm], in
    micrometres for grade 5 and times sqrt(2) for each further grade.

    Raises InputError for sizes that the standard does not cover.
    """
    d, m = 2.0 * abs(gear.reference_radius) / MM, gear.module / MM
    _require_size("reference diameter", d, DIAMETERS)
    _require_size("module", m, MODULES)
    step = math.sqrt(2.0) ** (grade - BASE_GRADE)
    formulas = 0.001 * d + 0.4 * m + 5.0, 0.4 * m + 0.001 * d + 4.0, 0.55 * m + 5.0
    return FlankTolerances(*(UM * rounded_um(step * value) for value in formulas))


def _require_size(name: str, value: float, limits: tuple[float, float]) -> None:
    low, high = limits
    if not low * (1.0 - SIZE_RTOL) <= value <= high * (1.0 + SIZE_RTOL):
        raise InputError(
            f"{name} = {value:.9g} mm; ISO 1328-1 has tolerances from {low:g} to "
            f"{high:g} mm: give tolerances in place of a grade"
        )


def rounded_um(value: float) -> float:
    """A tolerance [um] as the standard rounds it.

    To whole micrometres above 10, to halves above 5, else to tenths.
    """
    step = 1.0 if value > 10.0 else 0.5 if value > 5.0 else 0.1
    return round(math.floor(value / step + 0.5) * step, 1)


@cache
def _it7() -> tuple[tuple[float, float], ...]:
    text = (resources.files("fegear.commands.tolerances") / "it7.toml").read_text(
        "utf-8"
    )
    table = tomllib.loads(text)
    return tuple(zip(table["up_to_mm"], table["width_um"], strict=True))


def center_distance_tolerance(center_distance: float) -> float:
    """Largest deviation of a centre distance of tolerance class js7, ISO 286 [m].

    Half the width of grade IT7, of which the sign is either.
    """
    size = center_distance / MM * (1.0 - SIZE_RTOL)
    for largest, width in _it7():
        if size <= largest:
            return 0.5 * UM * width
    raise InputError(
        f"centre distance = {size:.9g} mm; ISO 286-1 has tolerances up to "
        f"{_it7()[-1][0]} mm: give one in its place"
    )


def tolerances_of_pair(
    pair: GearPair, grades: tuple[int, int], amounts: Mapping[str, float | None]
) -> dict[str, float]:
    """Tolerances [m] by name, those of flanks with `driver_` or `driven_` before it.

    grades : of driver and driven gear
    amounts : tolerances [um] by name that take the place of those of a grade
    """
    limits: dict[str, float] = {}
    gears = zip(("driver", "driven"), (pair.driver, pair.driven), grades, strict=True)
    flanks = [field.name for field in fields(FlankTolerances)]
    for role, gear, grade in gears:
        if any(amounts[name] is None for name in flanks):
            limits |= {
                f"{role}_{name}": value
                for name, value in vars(flank_tolerances(gear, grade)).items()
            }
    for name, amount in amounts.items():
        names = [f"{role}_{name}" for role in ("driver", "driven")]
        if amount is not None:
            limits |= dict.fromkeys(names if name in flanks else [name], UM * amount)
    if "center_distance" not in limits:
        limits["center_distance"] = center_distance_tolerance(pair.center_distance)
    return limits
