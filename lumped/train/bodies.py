"""Gears and carriers of a train, and checks of its parts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lumped.bearings.rolling import BallBearing, RollerBearing
from lumped.common.checks import (
    format_value,
    is_finite,
    is_number,
    require_fields,
)
from lumped.common.short_repr import ShortRepr


class TrainError(ValueError):
    """Raised for an impossible train; the message names the part and allowed values.

    It is a ValueError.
    """


@dataclass(frozen=True, kw_only=True)
class Gear(ShortRepr):
    """Rigid disk with teeth.

    Parameters
    ----------
    name : str
        Name of the gear.
    teeth : int
        Number of teeth; only ratios matter, for the mesh frequencies.
    base_radius : float
        Base radius [m], negative of an internal gear.
    inertia : float
        Polar moment of inertia about the axis [kg m2].
    mass : float, optional
        Mass [kg], required only with bearings.
    bearing_stiffness : tuple of 2 float, optional
        Stiffnesses kx, ky [N/m]; None for a fixed centre.
    bearing_direction : float, optional
        Direction of kx, counter-clockwise from x [rad].
    rolling_bearing : BallBearing or RollerBearing, optional
        Bearing whose force replaces that of the stiffnesses, which then are its own
        under load, see `linearise_bearings`.
    coupling_stiffness : float, optional
        Torsional stiffness to ground [N m/rad].
    torque : float, optional
        Constant external torque [N m], positive counter-clockwise.
    is_held : bool, optional
        Whether its rotation is prevented.

    Raises
    ------
    TrainError
        If a value is not allowed.
    ValueError
        If a value is not of its type.
    """

    name: str
    teeth: int
    base_radius: float
    inertia: float
    mass: float | None = None
    bearing_stiffness: tuple[float, float] | None = None
    bearing_direction: float = 0.0
    rolling_bearing: BallBearing | RollerBearing | None = None
    coupling_stiffness: float = 0.0
    torque: float = 0.0
    is_held: bool = False

    def __post_init__(self) -> None:
        prefix = f"gear {self.name!r}: "
        teeth = is_number(self.teeth) and self.teeth >= 1
        require_that(teeth, f"{prefix}teeth", self.teeth, "at least 1")
        radius = self.base_radius
        allowed = is_number(radius) and 0.0 < abs(radius) < math.inf
        require_that(allowed, f"{prefix}base_radius", radius, "finite and not 0")
        require_finite_values(f"{prefix}bearing_direction", self.bearing_direction)
        _require_body(self, prefix)
        if self.rolling_bearing is not None and self.mass is None:
            raise TrainError(f"{prefix}mass is needed with a rolling_bearing")


@dataclass(frozen=True, kw_only=True)
class Carrier:
    """Rigid body that carries the centres of gears around its axis.

    The bearings of its gears support them on it. Its rotation moves their centres
    along their circle; coordinates are those of the frame that rotates with it at its
    nominal speed.

    Parameters
    ----------
    name : str
        Name of the carrier.
    gears : tuple of int
        Indices of its gears, from 0.
    radius : float
        Distance of their centres from its axis [m].
    angles : tuple of float
        Direction of each centre, counter-clockwise from x [rad].
    inertia : float
        Polar moment of inertia about its axis without its gears [kg m2].
    mass : float, optional
        Mass without its gears [kg], required only with bearings.
    bearing_stiffness : tuple of 2 float, optional
        Stiffnesses kx, ky [N/m] of its bearing; None for a fixed axis.
    coupling_stiffness : float, optional
        Torsional stiffness to ground [N m/rad].
    torque : float, optional
        Constant external torque [N m], positive counter-clockwise.
    is_held : bool, optional
        Whether its rotation is prevented.
    speed : float, optional
        Its rotation per rotation of the first mesh's driver relative to it, positive
        counter-clockwise. None for the speed at which a held gear is at rest, and 0
        without a held gear.

    Raises
    ------
    TrainError
        If a value is not allowed.
    ValueError
        If a value is not of its type.
    """

    name: str
    gears: tuple[int, ...]
    radius: float
    angles: tuple[float, ...]
    inertia: float
    mass: float | None = None
    bearing_stiffness: tuple[float, float] | None = None
    coupling_stiffness: float = 0.0
    torque: float = 0.0
    is_held: bool = False
    speed: float | None = None

    def __post_init__(self) -> None:
        prefix = f"carrier {self.name!r}: "
        require_positive_values(f"{prefix}radius", self.radius)
        if self.speed is not None:
            require_finite_values(f"{prefix}speed", self.speed)
        _require_body(self, prefix)
        if len(self.gears) != len(self.angles) or not self.gears:
            counts = f"{len(self.gears)} gears and {len(self.angles)} angles"
            raise TrainError(f"{prefix}{counts}; as many are needed, one or more")


def _require_body(body: Gear | Carrier, prefix: str) -> None:
    """Require values of a rotating body within their limits."""
    require_positive_values(f"{prefix}inertia", body.inertia)
    require_not_negative(f"{prefix}coupling_stiffness", body.coupling_stiffness)
    require_finite_values(f"{prefix}torque", body.torque)
    require_fields(body)
    if body.bearing_stiffness is not None:
        for stiffness in body.bearing_stiffness:
            require_not_negative(f"{prefix}bearing_stiffness", stiffness)
        if body.mass is None:
            raise TrainError(f"{prefix}mass is needed with a bearing_stiffness")
    if body.mass is not None:
        require_positive_values(f"{prefix}mass", body.mass)


def require_that(ok: bool, name: str, value: object, allowed: str) -> None:
    if not ok:
        raise TrainError(f"{name} = {format_value(value)}; must be {allowed}")


def require_finite_values(name: str, value: float) -> None:
    require_that(is_finite(value), name, value, "finite")


def require_positive_values(name: str, value: float) -> None:
    allowed = is_number(value) and 0.0 < value < math.inf
    require_that(allowed, name, value, "positive and finite")


def require_not_negative(name: str, value: float) -> None:
    allowed = is_number(value) and 0.0 <= value < math.inf
    require_that(allowed, name, value, "0 or more and finite")
