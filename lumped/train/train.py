"""Components of a parallel-axis gear train made of lumped masses and springs.

Rotations and torques are positive counter-clockwise; the first mesh's driver rotates
counter-clockwise. Only gears with bearings have rigid translations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from lumped.bearings.rolling import BallBearing, RollerBearing
from lumped.common.checks import (
    format_value,
    is_finite,
    is_number,
    require_fields,
)


class TrainError(ValueError):
    """Raised for an impossible train; the message names the part and allowed values.

    It is a ValueError.
    """


@dataclass(frozen=True, kw_only=True)
class Gear:
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
        _require(teeth, f"{prefix}teeth", self.teeth, "at least 1")
        radius = self.base_radius
        allowed = is_number(radius) and 0.0 < abs(radius) < math.inf
        _require(allowed, f"{prefix}base_radius", radius, "finite and not 0")
        _require_finite(f"{prefix}bearing_direction", self.bearing_direction)
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
        _require_positive(f"{prefix}radius", self.radius)
        if self.speed is not None:
            _require_finite(f"{prefix}speed", self.speed)
        _require_body(self, prefix)
        if len(self.gears) != len(self.angles) or not self.gears:
            counts = f"{len(self.gears)} gears and {len(self.angles)} angles"
            raise TrainError(f"{prefix}{counts}; as many are needed, one or more")


def _require_body(body: Gear | Carrier, prefix: str) -> None:
    """Require values of a rotating body within their limits."""
    _require_positive(f"{prefix}inertia", body.inertia)
    _require_not_negative(f"{prefix}coupling_stiffness", body.coupling_stiffness)
    _require_finite(f"{prefix}torque", body.torque)
    require_fields(body)
    if body.bearing_stiffness is not None:
        for stiffness in body.bearing_stiffness:
            _require_not_negative(f"{prefix}bearing_stiffness", stiffness)
        if body.mass is None:
            raise TrainError(f"{prefix}mass is needed with a bearing_stiffness")
    if body.mass is not None:
        _require_positive(f"{prefix}mass", body.mass)


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Two gears in mesh, by their indices in the train.

    Parameters
    ----------
    driver : int
        Index of the driver, from 0.
    driven : int
        Index of the driven gear, from 0.
    pressure_angle : float
        Operating pressure angle [rad], below a right angle.
    center_line : float, optional
        Direction from driver to driven, counter-clockwise from x [rad].
    backlash : float, optional
        Backlash along the line of action, from drive side to back side [m].
    phase : float, optional
        Position of this mesh's cycle when the first mesh is at its pitch point
        [base pitches].

    Raises
    ------
    TrainError
        If a value is not allowed.
    ValueError
        If a value is not of its type.
    """

    driver: int
    driven: int
    pressure_angle: float
    center_line: float = 0.0
    backlash: float = math.inf
    phase: float = 0.0

    def __post_init__(self) -> None:
        angle, backlash = self.pressure_angle, self.backlash
        allowed = is_number(angle) and abs(angle) < 0.5 * math.pi
        _require(allowed, "pressure_angle", angle, "below a right angle")
        allowed = is_number(backlash) and backlash >= 0.0
        _require(allowed, "backlash", backlash, "0 or more")
        for name in ("center_line", "phase"):
            _require_finite(name, getattr(self, name))
        require_fields(self, infinite=("backlash",))


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """Shaft between two gears on one axis.

    Parameters
    ----------
    gears : tuple of 2 int
        Indices of the gears, from 0.
    stiffness : float, optional
        Torsional stiffness [N m/rad]; None if the gears move as one.

    Raises
    ------
    TrainError
        If the stiffness is not positive.
    ValueError
        If a value is not of its type.
    """

    gears: tuple[int, int]
    stiffness: float | None = None

    def __post_init__(self) -> None:
        if self.stiffness is not None:
            _require_positive("shaft stiffness", self.stiffness)
        require_fields(self)


@dataclass(frozen=True, kw_only=True)
class Train:
    """Gears, meshes and shafts.

    Parameters
    ----------
    gears : tuple of Gear
        Gears.
    meshes : tuple of Mesh
        Meshes, with indices into `gears`; one or more.
    shafts : tuple of Shaft, optional
        Shafts, with indices into `gears`.
    damping_ratio : float, optional
        Damping ratio of every vibration mode.
    carrier : Carrier, optional
        Carrier of some of the gears; speeds and senses are those relative to it.

    Raises
    ------
    TrainError
        If a value is not allowed, an index names no gear or the gears cannot rotate.
    ValueError
        If a value is not of its type.
    """

    gears: tuple[Gear, ...]
    meshes: tuple[Mesh, ...]
    shafts: tuple[Shaft, ...] = ()
    damping_ratio: float = 0.0
    carrier: Carrier | None = None

    def __post_init__(self) -> None:
        _require_not_negative("damping_ratio", self.damping_ratio)
        require_fields(self)
        if not self.meshes:
            raise TrainError("meshes: at least one is needed")
        indices = [
            index for mesh in self.meshes for index in (mesh.driver, mesh.driven)
        ]
        indices += [index for shaft in self.shafts for index in shaft.gears]
        indices += self.carrier.gears if self.carrier else ()
        count = len(self.gears)
        for index in indices:
            allowed = f"0 to {count - 1}"
            _require(0 <= index < count, "gear index", index, allowed)
        for mesh in self.meshes:
            if mesh.driver == mesh.driven:
                raise TrainError(f"mesh of gear {mesh.driver} with itself")
            if max(self.gears[g].base_radius for g in (mesh.driver, mesh.driven)) < 0:
                raise TrainError(
                    f"mesh of gears {mesh.driver} and {mesh.driven}, both internal"
                )
        _ = self.speeds  # raises if the gears cannot rotate

    def is_internal(self, mesh: Mesh) -> bool:
        """Whether one of a mesh's gears is internal: both rotate in one sense.

        Parameters
        ----------
        mesh : Mesh
            A mesh of this train.

        Returns
        -------
        bool
            True for an internal gear with an external one.
        """
        radii = (self.gears[g].base_radius for g in (mesh.driver, mesh.driven))
        return math.prod(radii) < 0.0

    @cached_property
    def speeds(self) -> tuple[Fraction, ...]:
        """Nominal rotation of each gear per rotation of the first mesh's driver.

        Both are relative to the carrier, if there is one.
        """
        speeds: dict[int, Fraction] = {}
        for start in (self.meshes[0].driver, *range(len(self.gears))):
            if start not in speeds:
                speeds[start] = Fraction(1)
                _propagate_speeds(start, speeds, list(self._links()))
        return tuple(speeds[index] for index in range(len(self.gears)))

    def _links(self) -> Iterator[tuple[int, int, Fraction]]:
        """Links (gear, other gear, speed of the other over that of the gear)."""
        for mesh in self.meshes:
            teeth = self.gears[mesh.driver].teeth, self.gears[mesh.driven].teeth
            sign = 1 if self.is_internal(mesh) else -1
            yield mesh.driver, mesh.driven, sign * Fraction(*teeth)
        for shaft in self.shafts:
            yield *shaft.gears, Fraction(1)

    @cached_property
    def carrier_speed(self) -> float:
        """Rotation of the carrier per rotation of the first mesh's driver.

        The latter is relative to the carrier. Where gears are held that could only be
        at rest together, nothing rotates, and the speed is 0.
        """
        if self.carrier is None or self.carrier.is_held:
            return 0.0
        if self.carrier.speed is not None:
            return self.carrier.speed
        held = {
            speed
            for gear, speed in zip(self.gears, self.speeds, strict=True)
            if gear.is_held
        }
        return -float(held.pop()) if len(held) == 1 else 0.0

    def carrier_angular_speed(self, frequency: float) -> float:
        """Angular speed of the carrier.

        Parameters
        ----------
        frequency : float
            Frequency of the first mesh [Hz].

        Returns
        -------
        float
            Angular speed [rad/s], positive counter-clockwise, 0 without a carrier.
        """
        teeth = self.gears[self.meshes[0].driver].teeth
        return 2.0 * math.pi * frequency * self.carrier_speed / teeth

    @cached_property
    def mesh_rates(self) -> tuple[Fraction, ...]:
        """Mesh frequency of each mesh over that of the first."""
        tooth_rates = [
            self.gears[m.driver].teeth * self.speeds[m.driver] for m in self.meshes
        ]
        return tuple(abs(rate / tooth_rates[0]) for rate in tooth_rates)

    @cached_property
    def common_period(self) -> tuple[int, ...]:
        """Shortest time after which all meshes repeat, in periods of each mesh."""
        denominators = [rate.denominator for rate in self.mesh_rates]
        first = math.lcm(*denominators)
        return tuple(int(first * rate) for rate in self.mesh_rates)

    def sense(self, gear: int) -> int:
        """Sense of rotation of a gear.

        Parameters
        ----------
        gear : int
            Index of the gear, from 0.

        Returns
        -------
        int
            1 if counter-clockwise, -1 if clockwise.
        """
        return 1 if self.speeds[gear] > 0 else -1


def _propagate_speeds(
    start: int,
    speeds: dict[int, Fraction],
    links: list[tuple[int, int, Fraction]],
) -> None:
    """Fill in the speeds of all gears that are linked to `start`."""
    symmetric_links = links + [(b, a, 1 / ratio) for a, b, ratio in links]
    queue = [start]
    while queue:
        gear = queue.pop()
        for a, b, ratio in symmetric_links:
            if a != gear:
                continue
            if b not in speeds:
                speeds[b] = speeds[gear] * ratio
                queue.append(b)
            elif speeds[b] != speeds[gear] * ratio:
                raise TrainError(f"gears {a} and {b}: a closed train that cannot turn")


def _require(ok: bool, name: str, value: object, allowed: str) -> None:
    if not ok:
        raise TrainError(f"{name} = {format_value(value)}; must be {allowed}")


def _require_finite(name: str, value: float) -> None:
    _require(is_finite(value), name, value, "finite")


def _require_positive(name: str, value: float) -> None:
    allowed = is_number(value) and 0.0 < value < math.inf
    _require(allowed, name, value, "positive and finite")


def _require_not_negative(name: str, value: float) -> None:
    allowed = is_number(value) and 0.0 <= value < math.inf
    _require(allowed, name, value, "0 or more and finite")
