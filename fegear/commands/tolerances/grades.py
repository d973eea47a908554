"""Flank tolerances of ISO 1328-1:2013, and default ones of the axes of gears.

A tolerance limits the amount of a deviation: profile slope and single pitch may be
from minus to plus its value. Lengths are in metres.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources

from fegear.files.errors import InputError
from lumped.common.units import MM, UM
from meshes import GearPair, SpurGear

BASE_GRADE = 5  # of the formulas; each further grade has sqrt(2) times its tolerances
# in millimetres
DIAMETERS, MODULES, WIDTHS = (5.0, 15_000.0), (0.5, 70.0), (4.0, 1200.0)
SIZE_RTOL = 1e-9  # by which sizes may be beyond the limits


@dataclass(frozen=True)
class FlankTolerances:
    """Tolerances of the flanks of one gear [m]."""

    single_pitch: float
    profile_slope: float
    profile_form: float


@dataclass(frozen=True)
class HelixTolerances:
    """Tolerances of one gear over its face width [m]."""

    helix_slope: float
    helix_form: float

    @property
    def total(self) -> float:
        return math.hypot(self.helix_slope, self.helix_form)


def flank_tolerances(gear: SpurGear, grade: int) -> FlankTolerances:
    """Tolerances of a grade, 1 to 11, rounded as the standard says.

    f_pT = 0.001 d + 0.4 m + 5, f_HalphaT = 0.4 m + 0.001 d + 4 and
    f_falphaT = 0.55 m + 5, with the reference diameter d and the normal module m [mm],
    in micrometres for grade 5 and times sqrt(2) for each further grade.

    Raises InputError for sizes that the standard does not cover.
    """
    d, m = 2.0 * abs(gear.reference_radius) / MM, gear.normal_module / MM
    _require_size("reference diameter", d, DIAMETERS)
    _require_size("module", m, MODULES)
    formulas = 0.001 * d + 0.4 * m + 5.0, 0.4 * m + 0.001 * d + 4.0, 0.55 * m + 5.0
    return FlankTolerances(*(_of_grade(value, grade) for value in formulas))


def helix_tolerances(gear: SpurGear, width: float, grade: int) -> HelixTolerances:
    """Tolerances of a grade over a face width [m], as `flank_tolerances`.

    f_HbetaT = 0.05 sqrt(d) + 0.35 sqrt(b) + 4 and f_fbetaT = 0.07 sqrt(d) +
    0.45 sqrt(b) + 4, with the reference diameter d and the face width b [mm].
    """
    d, b = 2.0 * abs(gear.reference_radius) / MM, width / MM
    _require_size("reference diameter", d, DIAMETERS)
    _require_size("face width", b, WIDTHS)
    d, b = math.sqrt(d), math.sqrt(b)
    formulas = 0.05 * d + 0.35 * b + 4.0, 0.07 * d + 0.45 * b + 4.0
    return HelixTolerances(*(_of_grade(value, grade) for value in formulas))


def _of_grade(value: float, grade: int) -> float:
    """A tolerance [m] by its formula [um]."""
    return UM * rounded_um(math.sqrt(2.0) ** (grade - BASE_GRADE) * value)


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


def tolerances_of_axes(helix: Iterable[HelixTolerances]) -> dict[str, float]:
    """Largest deviations of two axes over the face width of their gears [m].

    ISO/TR 10064-3 recommends 0.5 (L / b) F_beta out of the plane of the axes, over the
    distance L of bearings, and twice that in the plane: over the width b these are
    half of the total helix tolerance F_beta, and all of it. It is that of the gear that
    has the larger one.
    """
    total = max(one.total for one in helix)
    return {"axes_in_plane": total, "axes_out_of_plane": 0.5 * total}


def tolerances_of_pair(
    pair: GearPair,
    grades: tuple[int, int],
    amounts: Mapping[str, float | None],
    widths: tuple[float, float] | None = None,
) -> dict[str, float]:
    """Tolerances [m] by name, those of flanks with `driver_` or `driven_` before it.

    grades : of driver and driven gear
    amounts : tolerances [um] by name that take the place of those of a grade
    widths : of both faces where loads vary over the width [m]
    """
    gears, limits = (pair.driver, pair.driven), dict[str, float]()
    by_gear = [field.name for field in fields(FlankTolerances)]
    if any(amounts[name] is None for name in by_gear):
        limits |= _by_role(map(flank_tolerances, gears, grades))
    if widths is not None:
        of_helix = [field.name for field in fields(HelixTolerances)]
        by_gear += of_helix
        names = *of_helix, "axes_in_plane", "axes_out_of_plane"
        if any(amounts[name] is None for name in names):
            helix = list(map(helix_tolerances, gears, widths, grades))
            limits |= _by_role(helix) | tolerances_of_axes(helix)
    for name, amount in amounts.items():
        names_of_gears = [f"{role}_{name}" for role in ("driver", "driven")]
        if amount is not None:
            every = names_of_gears if name in by_gear else [name]
            limits |= dict.fromkeys(every, UM * amount)
    if "center_distance" not in limits:
        limits["center_distance"] = center_distance_tolerance(pair.center_distance)
    return limits


def _by_role(
    tolerances: Iterable[FlankTolerances] | Iterable[HelixTolerances],
) -> dict[str, float]:
    return {
        f"{role}_{name}": value
        for role, one in zip(("driver", "driven"), tolerances, strict=True)
        for name, value in vars(one).items()
    }
