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

from lumped.common.checks import (
    is_number,
    require_fields,
)
from lumped.common.short_repr import ShortRepr
from lumped.train.bodies import (
    Carrier,
    Gear,
    TrainError,
    require_finite_values,
    require_not_negative,
    require_positive_values,
    require_that,
)


@dataclass(frozen=True, kw_only=True)
class Mesh(ShortRepr):
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
        require_that(allowed, "pressure_angle", angle, "below a right angle")
        allowed = is_number(backlash) and backlash >= 0.0
        require_that(allowed, "backlash", backlash, "0 or more")
        for name in ("center_line", "phase"):
            require_finite_values(name, getattr(self, name))
        require_fields(self, infinite=("backlash",))


@dataclass(frozen=True, kw_only=True)
class Shaft(ShortRepr):
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
            require_positive_values("shaft stiffness", self.stiffness)
        require_fields(self)


@dataclass(frozen=True, kw_only=True)
class Train(ShortRepr):
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
        require_not_negative("damping_ratio", self.damping_ratio)
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
            require_that(0 <= index < count, "gear index", index, allowed)
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
