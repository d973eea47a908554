"""Eccentric gearing in user units, and its summary."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fegear.files.errors import InputError
from lumped.common.array_types import Array
from lumped.common.checks import format_number
from lumped.common.csv_text import format_exact
from meshes import GeometryError
from meshes.eccentric import EccentricPair, PitchCurve
from meshes.eccentric.base import (
    LEADING,
    TRAILING,
    Feasibility,
    Side,
    base_points,
    feasibility,
)
from meshes.eccentric.outline import WheelEdges, outline_points
from meshes.eccentric.teeth import ToothedPair

POINTS = 721  # of a pitch or base curve, on every turn of the driver
ANGLES = (5.0, 35.0)  # pressure angles [deg]


@dataclass(frozen=True)
class Gearing:
    """An eccentric gearing.

    radius_mm, eccentricity_mm : of the driver's pitch circle and of its bearing
    ratio : turns of the driver for a turn of the driven wheel
    teeth : of the driver, none for pitch and base curves alone
    addendum, dedendum : of the teeth, in modules

    Raises InputError where there is no such gearing.
    """

    radius_mm: float
    eccentricity_mm: float
    ratio: float
    pressure_angle_deg: float
    teeth: int | None = None
    addendum: float = 1.0
    dedendum: float = 1.25

    def __post_init__(self) -> None:
        low, high = ANGLES
        if not low <= self.pressure_angle_deg <= high:
            raise InputError(
                f"pressure_angle = {format_number(self.pressure_angle_deg)} deg; must "
                "be "
                f"{low:g} to {high:g}"
            )
        try:
            _ = self.pair, self.toothed
        except GeometryError as error:
            raise InputError(f"{error.field} = {error.message}") from None

    @cached_property
    def pair(self) -> EccentricPair:
        sizes = 1e-3 * self.radius_mm, 1e-3 * self.eccentricity_mm
        return EccentricPair(*sizes, self.ratio)

    @property
    def pressure_angle(self) -> float:
        return math.radians(self.pressure_angle_deg)

    @cached_property
    def toothed(self) -> ToothedPair | None:
        if self.teeth is None:
            return None
        heights = self.addendum, self.dedendum
        return ToothedPair(self.pair, self.pressure_angle, self.teeth, *heights)

    @cached_property
    def feasibility(self) -> Feasibility:
        return feasibility(self.pair, self.pressure_angle)

    @cached_property
    def curves(self) -> dict[str, Array]:
        """Closed curves (n, 2) of each wheel's own frame [m], the first point once more
        at the end."""
        wheels: dict[str, tuple[PitchCurve, Side]] = {
            "driver": (self.pair.driver, TRAILING),
            "driven": (self.pair.driven, LEADING),
        }
        curves = {}
        for name, (curve, side) in wheels.items():
            angle = np.linspace(0.0, 2.0 * math.pi * curve.turns, 1 + _count(curve))
            frames = curve.frames(angle)
            curves[f"{name}_pitch"] = frames.point
            with np.errstate(divide="ignore", invalid="ignore"):
                base = base_points(frames, self.pressure_angle, side)
            curves[f"{name}_base"] = base
        if self.toothed is not None:
            for name, wheel in (
                ("driver", self.toothed.driver),
                ("driven", self.toothed.driven),
            ):
                curves[f"{name}_tooth"] = outline_points(wheel, WheelEdges())
        return curves

    def rows(self) -> Iterator[tuple[str, int, float, float]]:
        """Points of all curves [mm]."""
        for name, points in self.curves.items():
            for index, (x, y) in enumerate((1e3 * points).tolist()):
                yield name, index, x, y

    @property
    def header(self) -> Mapping[str, str]:
        return {
            key: format_exact(value) if isinstance(value, float) else str(value)
            for key, value in self.summary.items()
            if value is not None
        }

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        pair, limits = self.pair, self.feasibility
        distance, approximate_distance = (
            pair.center_distance,
            pair.approximate_center_distance,
        )
        ratio = pair.torque_ratio(np.array([0.0, math.pi]))
        values: dict[str, Any] = {
            "radius_mm": self.radius_mm,
            "eccentricity_mm": self.eccentricity_mm,
            "ratio": pair.lobes,
            "pressure_angle_deg": self.pressure_angle_deg,
            "center_distance_mm": 1e3 * distance,
            "burmester_center_distance_mm": 1e3 * approximate_distance,
            "burmester_error_mm": 1e3 * (approximate_distance - distance),
            "burmester_closing_error_deg": math.degrees(
                pair.closing_error(approximate_distance)
            ),
            "feasible": limits.feasible,
            "reason": limits.reason or None,
            "largest_pressure_angle_deg": math.degrees(limits.largest_pressure_angle),
            "largest_eccentricity_mm": 1e3 * limits.largest_eccentricity,
            "least_torque_ratio": float(ratio[1]),
            "largest_torque_ratio": float(ratio[0]),
        }
        if self.toothed is not None:
            contact = self.toothed.contact_ratio
            values |= {
                "driver_teeth": self.toothed.driver.teeth,
                "driven_teeth": self.toothed.driven.teeth,
                "module_mm": 1e3 * self.toothed.rack.module,
                "addendum_mm": 1e3 * self.toothed.rack.addendum,
                "dedendum_mm": 1e3 * self.toothed.rack.dedendum,
                "least_contact_ratio": float(contact.min()),
                "largest_contact_ratio": float(contact.max()),
            }
        return values


def _count(curve: PitchCurve) -> int:
    return (POINTS - 1) * curve.turns
