"""Spinning shafts: stepped beams with rigid disks on bearings, coupled by gear meshes.

The axes of all rotors are along z, rotations are counter-clockwise about it. Positions
are along a rotor's own axis, from its first end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from lumped.common.array_types import Array
from lumped.common.checks import format_number, require_fields
from lumped.common.options import Range
from lumped.rotors.housing import Housing, HousingNode

POSITION_RTOL = 1e-9  # of a length, below which two positions are one
# Over the length of the shaft: sections are not shorter, and parts that are closer to a
# node are on a rigid arm, for stiffnesses of elements grow with the cube of the inverse
MIN_ELEMENT = 1e-3
RIGID_MOTIONS = 11  # of two gears in mesh: the transmission error, and five each
RIGHT_ANGLE = 0.5 * math.pi


class RotorError(ValueError):
    """A rotor that cannot be modelled, in one line."""


def _positive() -> Any:
    return field(metadata={"allowed": Range(above=0.0, below=math.inf)})


def _not_negative(default: float = 0.0) -> Any:
    allowed = Range(least=0.0, below=math.inf)
    return field(default=default, metadata={"allowed": allowed})


@dataclass(frozen=True, kw_only=True)
class Section:
    """Part of a shaft with one diameter.

    length, diameter, bore : along the axis, outer and inner [m]
    asymmetry : difference of the principal second moments of area over their sum,
        positive where the shaft is stiffer in the plane x-z that turns with it; only
        `rotating_frame` takes shafts that have some
    """

    length: float = _positive()
    diameter: float = _positive()
    bore: float = _not_negative()
    asymmetry: float = field(
        default=0.0, metadata={"allowed": Range(above=-1.0, below=1.0)}
    )

    def __post_init__(self) -> None:
        require_fields(self)
        if not self.bore < self.diameter:
            raise RotorError(
                f"bore = {format_number(self.bore)}; must be less than diameter = "
                f"{format_number(self.diameter)}"
            )

    @property
    def area(self) -> float:
        """Area of the section [m2]."""
        return 0.25 * math.pi * (self.diameter**2 - self.bore**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter, the mean of both [m4]."""
        return math.pi / 64.0 * (self.diameter**4 - self.bore**4)


@dataclass(frozen=True, kw_only=True)
class Disk:
    """Rigid disk, or gear, on a shaft.

    position : of its centre of mass [m]
    mass : [kg]
    polar_inertia, transverse_inertia : about the axis and about a diameter [kg m2]
    """

    position: float = _not_negative()
    mass: float = _not_negative()
    polar_inertia: float = _not_negative()
    transverse_inertia: float = _not_negative()

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearisedSupport:
    """Force of a bearing on a shaft at displacements u: force - stiffness u.

    Components are along x, y, z and about x and y.

    stiffness : tangent (5, 5) [N/m], [N], [N m]
    force : (5,) at no displacement, which vibration leaves out [N], [N m]
    """

    stiffness: Array
    force: Array


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """Linear bearing between a shaft and ground.

    position : along the shaft [m]
    stiffness : kxx, kxy, kyx, kyy, forces along the first axis by displacements along
        the second [N/m]
    damping : likewise [N s/m]
    axial_stiffness, axial_damping : along the axis, 0 of a floating bearing; read by
        `statics` and where shafts move along their axes [N/m], [N s/m]
    tilt_stiffness : moment per angle about both diameters [N m/rad]
    torsional_stiffness : of a spring to ground about the axis [N m/rad]
    linearised : in place of stiffnesses but the torsional one; see
        `lumped.rotors.rolling_statics`
    """

    position: float = _not_negative()
    stiffness: tuple[float, float, float, float]
    damping: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    axial_stiffness: float = _not_negative()
    axial_damping: float = _not_negative()
    tilt_stiffness: float = _not_negative()
    torsional_stiffness: float = _not_negative()
    linearised: LinearisedSupport | None = None

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """Shaft of Euler-Bernoulli elements with its disks and bearings.

    young_modulus, shear_modulus : of the shaft [Pa]
    density : of the shaft [kg/m3]
    speed_ratio : of its rotation over that of the system, negative where clockwise
    rotary_inertia : whether slices of the shaft resist tilting, with their gyroscopic
        moments (Rayleigh's beam)
    internal_damping : stress by rate of strain over Young's modulus, of a viscous
        material that turns with the shaft [s]
    """

    name: str
    sections: tuple[Section, ...]
    disks: tuple[Disk, ...] = ()
    bearings: tuple[Bearing, ...] = ()
    young_modulus: float = _positive()
    shear_modulus: float = _positive()
    density: float = _positive()
    speed_ratio: float = 1.0
    rotary_inertia: bool = True
    internal_damping: float = _not_negative()

    def __post_init__(self) -> None:
        require_fields(self)
        if not self.sections:
            raise RotorError(f"rotor {self.name!r}: sections = (); one or more needed")
        for section in self.sections:
            if section.length < MIN_ELEMENT * self.length:
                raise RotorError(
                    f"rotor {self.name!r}: a section is {section.length:g} m long; "
                    f"{MIN_ELEMENT:g} of the {self.length:g} m of the shaft are needed"
                )
        for kind, parts in (("disk", self.disks), ("bearing", self.bearings)):
            for part in parts:
                self.require_position(kind, part.position)

    @property
    def length(self) -> float:
        """Length of the shaft [m]."""
        return math.fsum(section.length for section in self.sections)

    def require_position(self, kind: str, position: float) -> None:
        """Raise RotorError for a position that is not on the shaft."""
        length = self.length
        if not 0.0 <= position <= length * (1.0 + POSITION_RTOL):
            raise RotorError(
                f"rotor {self.name!r}: {kind} at {position:g} m; the shaft is "
                f"{length:g} m long"
            )


@dataclass(frozen=True, kw_only=True)
class MeshSpring:
    """Mean stiffness of the teeth of two gears, along their line of action.

    The stiffness is spread evenly over the plane of action, the face width times the
    path of contact, so that gears which tilt against each other feel a moment.

    rotors : driver and driven, by their indices
    positions : of both gears' centres on their shafts [m]
    offsets : of the middle of the teeth in mesh from these centres [m]
    base_radii : negative of an internal gear [m]
    direction : unit vector of the driver's push on the driven gear, see
        `lumped.train.coordinates.line_of_action`
    sense : of the driver's rotation, see `lumped.train.coordinates.rolling_sense`
    stiffness : force in the section over transmission error [N/m]
    width : face width in mesh [m]
    teeth : of the driver, for mesh frequencies
    base_helix_angle : positive where the driver pushes the driven gear along z, toward
        greater positions [rad]
    pressure_angle : of operation in the section, needed for helical gears [rad]
    path : roll lengths of the driver at start and end of contact, negative of an
        internal driver, needed for helical gears; the same twice for teeth that touch
        in one point of the section [m]
    matrix : (11, 11) stiffness against the transmission error and the motions of driver
        and driven gear, in place of `stiffness` spread evenly: displacements along the
        push, along the normal from the driver's centre to the line of action and along
        the axis, and slopes of the first two over the axis [N/m, N and N m]
    """

    rotors: tuple[int, int]
    positions: tuple[float, float]
    base_radii: tuple[float, float]
    direction: tuple[float, float]
    sense: int = 1
    stiffness: float = _positive()
    offsets: tuple[float, float] = (0.0, 0.0)
    width: float = _not_negative()
    teeth: int = field(default=1, metadata={"allowed": Range(least=1, below=10**6)})
    base_helix_angle: float = field(
        default=0.0, metadata={"allowed": Range(above=-RIGHT_ANGLE, below=RIGHT_ANGLE)}
    )
    pressure_angle: float | None = field(
        default=None, metadata={"allowed": Range(above=0.0, below=RIGHT_ANGLE)}
    )
    path: tuple[float, float] | None = None
    matrix: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        require_fields(self)
        if abs(math.hypot(*self.direction) - 1.0) > POSITION_RTOL:
            raise RotorError(f"direction = {self.direction}; must be a unit vector")
        counts = [len(row) for row in self.matrix or ()]
        if counts and counts != [RIGID_MOTIONS] * RIGID_MOTIONS:
            raise RotorError(
                f"matrix has rows of {counts} values; must be {RIGID_MOTIONS} rows of "
                f"{RIGID_MOTIONS}"
            )
        for name in ("pressure_angle", "path"):
            if self.base_helix_angle and getattr(self, name) is None:
                angle = format_number(self.base_helix_angle)
                raise RotorError(
                    f"{name} is missing; base_helix_angle = {angle} needs it"
                )

    @property
    def path_length(self) -> float:
        """Length of the path of contact, 0 where it is not stated [m]."""
        start, end = self.path or (0.0, 0.0)
        return abs(end - start)

    @property
    def middle_roll_lengths(self) -> tuple[float, float]:
        """Roll lengths of driver and driven gear in the middle of the path [m].

        Both add up to the line of action between the base circles, which is negative of
        a pair with an internal gear.
        """
        driver = 0.5 * sum(self.path or (0.0, 0.0))
        line = sum(self.base_radii) * math.tan(self.pressure_angle or 0.0)
        return driver, line - driver


@dataclass(frozen=True, kw_only=True)
class RotorSystem:
    """Rotors and the meshes between them.

    elements : least number of elements of every shaft, which are about equally long
    axial_motion : whether shafts move along their axes; else they are held in place.
        One choice for the whole machine, whose coordinates along axes follow all
        others, leaves matrices and modes of machines without it as they are
    housing : that holds bearings, None where all are on ground
    """

    rotors: tuple[Rotor, ...]
    meshes: tuple[MeshSpring, ...] = ()
    elements: int = field(default=12, metadata={"allowed": Range(least=1, most=1000)})
    axial_motion: bool = False
    housing: Housing | None = None

    def __post_init__(self) -> None:
        require_fields(self)
        if not self.rotors:
            raise RotorError("rotors = (); one or more are needed")
        for mesh in self.meshes:
            for rotor, position in zip(mesh.rotors, mesh.positions, strict=True):
                if not 0 <= rotor < len(self.rotors):
                    raise RotorError(
                        f"rotor index = {rotor}; must be 0 to {len(self.rotors) - 1}"
                    )
                self.rotors[rotor].require_position("gear", position)
        for node in () if self.housing is None else self.housing.nodes:
            if node is not None:
                self._require_bearing(node)

    def _require_bearing(self, node: HousingNode) -> None:
        """Raise RotorError for a bearing in the housing that no rotor has."""
        count = len(self.rotors)
        if not 0 <= node.rotor < count:
            raise RotorError(
                f"housing: rotor index = {node.rotor}; must be 0 to {count - 1}"
            )
        count = len(self.rotors[node.rotor].bearings)
        if not 0 <= node.bearing < count:
            raise RotorError(
                f"housing: bearing index = {node.bearing}; rotor {node.rotor} has "
                f"{count} bearings, from 0"
            )
