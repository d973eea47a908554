"""Forces of a rolling bearing on a shaft, by five displacements of its inner ring.

Displacements are along x, y, z and rotations about x and y (tilts) at the middle of the
bearing; the outer ring is fixed. Rings keep their shape and nothing rotates. Ball
bearings: Jones, J. Basic Eng. 82 (1960) 309, without centrifugal forces, and Harris and
Kotzalas, Rolling Bearing Analysis (2007), chapter 7. Rollers are cut into laminae.
The energy of all contacts is a convex function of the displacements.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from lumped.bearings.rolling import BallBearing, RollerBearing
from lumped.common.array_types import Array
from lumped.common.checks import format_number, require_fields
from lumped.common.options import Range

LAMINAE = 30  # of a roller
MAX_CONTACT_ANGLE = math.radians(75.0)
MAX_PRELOAD = 1e-2  # m


@dataclass(frozen=True, eq=False)
class RingState:
    """Contacts of a bearing whose inner ring is displaced, Z elements.

    force : forces along x, y, z and moments about x and y (5,) that displace the ring;
        the bearing pushes the shaft with the opposite ones [N], [N m]
    stiffness : tangent (5, 5) [N/m], [N], [N m]
    energy : strain energy of all contacts [J]
    loads : (Z,) on the elements [N]
    pressures : largest on the inner and on the outer race [Pa]
    """

    force: Array
    stiffness: Array
    energy: float
    loads: Array
    pressures: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class MountedBearing:
    """Ball or roller bearing on a shaft at rest.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
        Its elements and races; no runout and no waves.
    contact_angle : float, optional
        Of an angular-contact ball bearing without load; positive where it takes thrust
        of the shaft along z, negative where it takes the opposite one. It has no
        clearance. 0 of deep-groove bearings, which take both [rad].
    axial_preload : float, optional
        Displacement of the inner ring along z that is set by mounting a ball bearing;
        opposite to z where the contact angle is negative. A negative one is axial
        clearance of an angular-contact bearing [m].
    cage_angle : float, optional
        Angle of the first element, counter-clockwise from x [rad].

    Raises
    ------
    ValueError
        If a value is not of its type or not allowed.
    """

    bearing: BallBearing | RollerBearing
    contact_angle: float = field(
        default=0.0,
        metadata={"allowed": Range(least=-MAX_CONTACT_ANGLE, most=MAX_CONTACT_ANGLE)},
    )
    axial_preload: float = field(
        default=0.0, metadata={"allowed": Range(least=-MAX_PRELOAD, most=MAX_PRELOAD)}
    )
    cage_angle: float = 0.0

    def __post_init__(self) -> None:
        require_fields(self)
        bearing = self.bearing
        if bearing.runout or bearing.waves:
            raise ValueError("runout and waves = not 0; must be 0 in bearings at rest")
        if isinstance(bearing, RollerBearing):
            for name in ("contact_angle", "axial_preload"):
                if value := getattr(self, name):
                    text = format_number(value)
                    raise ValueError(f"{name} = {text}; must be 0 of roller bearings")
        elif self.contact_angle and bearing.clearance:
            raise ValueError(
                f"clearance = {format_number(bearing.clearance)}; must be 0 with a "
                "contact_angle, axial_preload is the other way to state it"
            )

    @property
    def thrust_senses(self) -> tuple[int, ...]:
        """Senses of the thrust of a shaft along z that the bearing takes."""
        if isinstance(self.bearing, RollerBearing):
            return ()
        if self.contact_angle:
            return (1,) if self.contact_angle > 0.0 else (-1,)
        return (-1, 1)

    @property
    def free_contact_angle(self) -> float:
        """Contact angle of a ball bearing at which contact begins under thrust [rad].

        That of a deep-groove bearing follows from its clearance, if this is positive.
        """
        if self.contact_angle or isinstance(self.bearing, RollerBearing):
            return self.contact_angle
        distance = groove_distance(self.bearing)
        return math.acos(min(1.0 - self.bearing.free_gap / distance, 1.0))

    @cached_property
    def angles(self) -> Array:
        """Angles (Z,) of the elements, counter-clockwise from x [rad]."""
        count = self.bearing.elements
        return self.cage_angle + 2.0 * math.pi * np.arange(count) / count

    def state(self, displacement: Array) -> RingState:
        """Contacts at a displacement (5,) of the inner ring [m], [rad]."""
        if isinstance(self.bearing, RollerBearing):
            return _roller_state(self.bearing, self.angles, displacement)
        return self._ball_state(self.bearing, displacement)

    def _ball_state(self, bearing: BallBearing, displacement: Array) -> RingState:
        alpha = self.contact_angle
        sense = -1.0 if alpha < 0.0 else 1.0
        D, A = bearing.element_diameter, groove_distance(bearing)
        # of the inner groove's centre from that of the ball without load
        beyond = (bearing.inner_conformity - 0.5) * D
        radius = 0.5 * bearing.pitch_diameter + beyond * math.cos(alpha)
        across = _radial_motion(self.angles, beyond * math.sin(alpha))
        along = _axial_motion(self.angles, radius)
        # of the inner groove's centre from the outer one's, in the plane of a ball
        radial = A * math.cos(alpha) - 0.5 * bearing.clearance + across @ displacement
        axial = A * math.sin(alpha) + sense * self.axial_preload + along @ displacement
        if alpha:  # one shoulder only; the other side of the race is a cylinder
            low = sense * axial < 0.0
            axial, along = np.where(low, 0.0, axial), np.where(low[:, None], 0.0, along)
        length = np.hypot(radial, axial)
        cosine, sine = (radial / length)[:, None], (axial / length)[:, None]
        rolling = _inclined(bearing, alpha)
        loads, slopes, energy = _hertz(
            rolling, length - A + 2.0 * bearing.film_thickness
        )
        normal, turn = cosine * across + sine * along, sine * across - cosine * along
        return RingState(
            force=normal.T @ loads,
            stiffness=(normal.T * slopes) @ normal + (turn.T * (loads / length)) @ turn,
            energy=energy,
            loads=loads,
            pressures=rolling.pressures(float(loads.max())),
        )


def groove_distance(bearing: BallBearing) -> float:
    """Distance A of the centres of both races' grooves around an unloaded ball [m]."""
    total = bearing.inner_conformity + bearing.outer_conformity
    return (total - 1.0) * bearing.element_diameter


@lru_cache(maxsize=64)
def _inclined(bearing: BallBearing, contact_angle: float) -> BallBearing:
    """Bearing whose races are curved as cones are in the planes of rolling."""
    diameter = bearing.pitch_diameter / math.cos(contact_angle)
    return replace(bearing, pitch_diameter=diameter)


def _roller_state(
    bearing: RollerBearing, angles: Array, displacement: Array
) -> RingState:
    """Contacts of rollers, each midway between both races, which are equally stiff."""
    places = bearing.length * ((np.arange(LAMINAE) + 0.5) / LAMINAE - 0.5)
    normal = np.concatenate([_radial_motion(angles, place) for place in places])
    stiffness = bearing.coefficient / LAMINAE
    lamina = replace(bearing, contact_stiffness=stiffness)
    loads, slopes, energy = _hertz(lamina, normal @ displacement - bearing.free_gap)
    return RingState(
        force=normal.T @ loads,
        stiffness=(normal.T * slopes) @ normal,
        energy=energy,
        loads=loads.reshape(LAMINAE, -1).sum(axis=0),
        pressures=bearing.pressures(LAMINAE * float(loads.max())),
    )


def _hertz(
    bearing: BallBearing | RollerBearing, approach: Array
) -> tuple[Array, Array, float]:
    """Loads [N] and their slopes [N/m] at approaches of both races, and the energy."""
    n, coefficient = bearing.exponent, bearing.coefficient
    positive = np.maximum(approach, 0.0)
    slopes = coefficient * positive ** (n - 1.0)
    loads = slopes * positive
    return loads, n * slopes, float(loads @ positive) / (n + 1.0)


def _radial_motion(angles: Array, place: float) -> Array:
    """Motion (Z, 5) away from the axis of points of the ring, by its displacements.

    place : of the points along z from the middle of the bearing [m]
    """
    cosine, sine = np.cos(angles), np.sin(angles)
    none = np.zeros_like(angles)
    return np.stack([cosine, sine, none, -place * sine, place * cosine], axis=1)


def _axial_motion(angles: Array, radius: float) -> Array:
    """Motion (Z, 5) along z of points of the ring, by its displacements."""
    none = np.zeros_like(angles)
    tilts = radius * np.sin(angles), -radius * np.cos(angles)
    return np.stack([none, none, none + 1.0, *tilts], axis=1)
