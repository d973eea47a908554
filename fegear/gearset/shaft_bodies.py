"""The shaft that carries gears: sections, bearings and disks along its axis, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lumped.bearings.mounted import MountedBearing
from lumped.common.checks import require_fields

ShaftEnd = Literal["start", "end"]  # the near one and the far one


@dataclass(frozen=True, kw_only=True)
class ShaftBearing:
    """Bearing of a shaft.

    position : from the shaft's first end [m]
    stiffness : kxx, kxy, kyx, kyy [N/m]
    axial_stiffness : along the axis, 0 of a floating bearing; None where the gear set
        does not state it [N/m]
    tilt_stiffness : moment per angle about a diameter [N m/rad]
    damping : cxx, cyy [N s/m]
    mounted : rolling bearing, in place of stiffnesses and damping; None of linear ones
    """

    position: float
    stiffness: tuple[float, float, float, float]
    axial_stiffness: float | None = None
    tilt_stiffness: float = 0.0
    damping: tuple[float, float] = (0.0, 0.0)
    mounted: MountedBearing | None = None


@dataclass(frozen=True, kw_only=True)
class ShaftDisk:
    """Rigid disk on a shaft besides its gears.

    position : from the shaft's first end [m]
    mass, inertia, transverse_inertia : inertia is polar [kg], [kg m2]
    """

    position: float
    mass: float
    inertia: float
    transverse_inertia: float


@dataclass(frozen=True, kw_only=True)
class ShaftBody:
    """Shaft that bends.

    lengths, diameters, bores : of its sections [m]
    gear_positions : of the middles of its gears from the first end [m]
    driven_from : end at which a torque from outside enters or leaves, None if unknown
    """

    lengths: tuple[float, ...]
    diameters: tuple[float, ...]
    bores: tuple[float, ...]
    gear_positions: tuple[float, ...]
    young_modulus: float
    poisson_ratio: float
    density: float
    bearings: tuple[ShaftBearing, ...] = ()
    disks: tuple[ShaftDisk, ...] = ()
    driven_from: ShaftEnd | None = None

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def mounted_bearings(self) -> tuple[tuple[float, MountedBearing], ...]:
        """Rolling bearings and their positions [m]; none where bearings are linear."""
        return tuple(
            (bearing.position, bearing.mounted)
            for bearing in self.bearings
            if bearing.mounted is not None
        )
