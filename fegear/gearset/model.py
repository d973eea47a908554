"""What a gear set is once read and checked: frozen values in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from fegear.files.errors import InputError
from fegear.gearset.faults.tooth_faults import NO_FAULTS, Faults
from fegear.gearset.field_checks import require_fields, require_positive, require_within
from fegear.gearset.housing import HousingFile
from fegear.gearset.modifications import UNMODIFIED, FlankModifications, Flanks
from fegear.gearset.planes import DEFAULT_PLANE, Plane
from fegear.gearset.planetary.members import Member, Members
from fegear.gearset.shaft_bodies import ShaftBody
from lumped.bearings.rolling import BallBearing, RollerBearing
from lumped.common.short_repr import ShortRepr
from meshes import GearPair, SpurGear

CARRIER = "carrier"  # its name, as that of a gear
MAX_COUNT = 1e18  # of any number, beyond all limits of files


@dataclass(frozen=True, kw_only=True)
class Gear(ShortRepr):
    """A gear with its width, material and, optionally, inertia.

    material : name, for those who read the figures; the values count
    thickness_origin : measure with its value that gave the tooth thickness, or empty
    pitch_errors : how far each tooth is set back from contact on the flank that
        carries load in the gear's first mesh [m], or empty; positive opens a gap
    inertia, mass : as given [kg m2], [kg]; see `inertia_of` and `mass_of`
    bearing_stiffness : kx, ky [N/m], or None for a centre that does not move
    rolling_bearing : in place of a bearing_stiffness, or None
    coupling_stiffness : torsional, to ground [N m/rad]
    faults : damage and errors of mounting
    groove : width between the halves of a double helical gear, whose geometry is that
        of the near half [m]; 0 of others
    plane : state of the finite elements where no other is chosen
    """

    name: str
    geometry: SpurGear
    face_width: float
    young_modulus: float
    poisson_ratio: float
    density: float
    material: str = "as given"
    thickness_origin: str = ""
    inertia: float | None = None
    mass: float | None = None
    pitch_errors: tuple[float, ...] = ()
    bearing_stiffness: tuple[float, float] | None = None
    rolling_bearing: BallBearing | RollerBearing | None = None
    coupling_stiffness: float = 0.0
    faults: Faults = NO_FAULTS
    groove: float = 0.0
    plane: Plane = DEFAULT_PLANE

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, *("face_width", "young_modulus", "density"))
        require_positive(self, *("inertia", "mass", "bearing_stiffness"))
        require_within(self, "poisson_ratio", 0.0, 0.5)
        require_within(self, "coupling_stiffness", 0.0, MAX_COUNT)
        require_within(self, "groove", 0.0, self.face_width)
        teeth, errors = self.geometry.teeth, len(self.pitch_errors)
        if errors not in (0, teeth):
            raise InputError(f"pitch_errors = {errors} values; {teeth} teeth need each")
        for tooth in self.faults.teeth:
            if not 0 <= tooth < teeth:
                raise InputError(f"faults of tooth {tooth}; must be 0 to {teeth - 1}")

    @property
    def helix_width(self) -> float:
        """Face width of the teeth along one helix [m], of a double one that of a half.

        Halves are free of each other at the groove.
        """
        return 0.5 * self.toothed_width if self.groove else self.face_width

    @property
    def toothed_width(self) -> float:
        """Face width without the groove of a double helical gear [m]."""
        return self.face_width - self.groove


@dataclass(frozen=True, kw_only=True)
class Mesh(ShortRepr):
    """Two gears in mesh; indices into the gear set's gears.

    torques : on the driver, the set's load cases [N m]
    phase : position of this mesh's cycle relative to the first mesh's, in base
        pitches, or None to leave it open; see `mesh_phases`
    center_line : direction from driver to driven, counter-clockwise from x [rad],
        or None for centres in a row along x
    backlash : along the line of action, as given or as the teeth have it [m]
    misalignment : of the axes, gap at the far end of the common width that decreases
        linearly to none at the near end [m]
    offset : middle of the driven gear's width from the driver's, along the axis [m]
    has_uneven_damage : whether a spall off the middle or a broken corner of either gear
        makes loads vary over the face width
    on_shafts : whether shafts and bearings of a gear yield under the forces of teeth
    mean_stiffness : over the mesh cycle, for analytic stiffness waves [N/m]
    stiffness_variation : peak to peak over the mean
    load_share : of a pair at the start of double contact
    """

    driver: int
    driven: int
    pair: GearPair
    backlash: float
    driver_flank: FlankModifications = UNMODIFIED
    driven_flank: FlankModifications = UNMODIFIED
    misalignment: float = 0.0
    offset: float = 0.0
    has_uneven_damage: bool = False
    on_shafts: bool = False
    torques: tuple[float, ...] = ()
    phase: float | None = None
    center_line: float | None = None
    mean_stiffness: float | None = None
    stiffness_variation: float | None = None
    load_share: float | None = None

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, "torques", "mean_stiffness", "load_share")
        require_within(self, "backlash", 0.0, MAX_COUNT)
        require_within(self, "stiffness_variation", 0.0, 1.0)
        require_within(self, "load_share", 0.0, 1.0)

    @property
    def gears(self) -> tuple[int, int]:
        return self.driver, self.driven

    @property
    def is_helical(self) -> bool:
        return self.pair.driver.twist != 0.0

    @property
    def varies_over_width(self) -> bool:
        """Whether teeth carry different loads along the face width."""
        has_gap = any(flank.varies_over_width for flank in self.flanks)
        is_aligned = self.offset == 0.0 and self.misalignment == 0.0
        is_even = is_aligned and not self.has_uneven_damage and not self.on_shafts
        return self.is_helical or has_gap or not is_even

    @property
    def flanks(self) -> Flanks:
        """Modifications of driver and driven gear."""
        return self.driver_flank, self.driven_flank

    @property
    def direction(self) -> float:
        """The centre line [rad], along x where none is given."""
        return 0.0 if self.center_line is None else self.center_line


@dataclass(frozen=True, kw_only=True)
class Shaft(ShortRepr):
    """Gears on one axis, in order along it, by their indices.

    stiffness : torsional, between successive gears [N m/rad], or None for rigid
    body : the shaft that bends, or None where nothing is known of it
    """

    gears: tuple[int, ...]
    stiffness: float | None = None
    body: ShaftBody | None = None

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, "stiffness")


@dataclass(frozen=True, kw_only=True)
class PlanetCarrier(ShortRepr):
    """Carrier of the planets between a sun and a ring, by their indices.

    Senses of rotation and mesh frequencies of the gear set are relative to it.

    members : teeth and roles of sun, ring and carrier, by which their speeds and
        torques are related
    radius : of the circle of the planets' axes [m]
    angles : direction of each planet's axis, counter-clockwise from x [rad]
    inertia, mass : without planets [kg m2], [kg]
    bearing_stiffness : kx, ky [N/m], or None for an axis that does not move
    coupling_stiffness : torsional, to ground [N m/rad]
    torques : on the input member, the set's load cases [N m]
    position_errors : displacement of each planet's pin along its circle [m], positive
        in the sense of the carrier's rotation, see
        `fegear.gearset.position_errors.carrier_sense`; empty for none
    """

    members: Members
    sun: int
    planets: tuple[int, ...]
    ring: int
    radius: float
    angles: tuple[float, ...]
    inertia: float
    mass: float
    name: str = CARRIER
    bearing_stiffness: tuple[float, float] | None = None
    coupling_stiffness: float = 0.0
    torques: tuple[float, ...] = ()
    position_errors: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, "radius", "inertia", "mass", "bearing_stiffness")
        require_within(self, "coupling_stiffness", 0.0, MAX_COUNT)
        errors = len(self.position_errors)
        if errors not in (0, len(self.planets)):
            raise InputError(
                f"position_errors = {errors} values; {len(self.planets)} planets need "
                "each"
            )
        if len(self.planets) != len(self.angles):
            raise InputError(
                f"angles = {len(self.angles)} values; {len(self.planets)} planets need "
                "each"
            )

    def gear_of(self, member: Member) -> int | None:
        """Index of the gear that is a member, None for the carrier."""
        return {"sun": self.sun, "ring": self.ring, "carrier": None}[member]

    def is_held(self, gear: int) -> bool:
        """Whether a gear is the member that does not rotate."""
        return gear == self.gear_of(self.members.held)


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Source of a gear set: its name or path, and the values that were set by key."""

    name: str
    edits: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class GearSet(ShortRepr):
    """Gears, their meshes and shafts.

    Gear sets are read from files or made of tables, see `fegear.load_gear_set` and
    `fegear.make_gear_set`.

    Parameters
    ----------
    name : str
        Name of the gear set.
    description : str
        One line on it, or empty.
    gears : tuple of fegear.gearset.model.Gear
        Gears with width, material and, if given, inertia; one or more.
    meshes : tuple of fegear.gearset.model.Mesh
        Meshes, with indices into `gears`; one or more.
    shafts : tuple of fegear.gearset.model.Shaft, optional
        Gears on one axis, by their indices.
    damping_ratio : float or None, optional
        Damping ratio of every vibration mode, from 0 to below 1; None leaves it open.
    inferences : tuple of str, optional
        Sentences on what the file did not give and how it was inferred.
    carrier : fegear.gearset.model.PlanetCarrier or None, optional
        Carrier of the planets of a planetary set.
    housing : fegear.gearset.housing.HousingFile or None, optional
        Housing that holds bearings of the shafts.
    origin : fegear.gearset.model.Origin or None, optional
        Where it was read, with what was changed; no part of what it is.

    Raises
    ------
    InputError
        If a value is not allowed or an index names no gear.

    Notes
    -----
    In statics both gears of a mesh are as wide as the narrower one, for their
    compliance, contact pressure and root stress. In motion a body has the inertia and
    the elasticity of its own width, and what that lacks of the compliance follows at
    once.
    """

    name: str
    description: str
    gears: tuple[Gear, ...]
    meshes: tuple[Mesh, ...]
    shafts: tuple[Shaft, ...] = ()
    damping_ratio: float | None = None
    inferences: tuple[str, ...] = ()
    carrier: PlanetCarrier | None = None
    housing: HousingFile | None = None
    origin: Origin | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        require_fields(self)
        require_within(self, "damping_ratio", 0.0, 1.0)
        for name in ("gears", "meshes"):
            if not getattr(self, name):
                raise InputError(f"{name} = (); one or more are needed")
        last = len(self.gears) - 1
        indices: list[tuple[int, ...]] = [mesh.gears for mesh in self.meshes]
        indices += [shaft.gears for shaft in self.shafts]
        if (carrier := self.carrier) is not None:
            indices.append((carrier.sun, *carrier.planets, carrier.ring))
        for gear in (gear for gears in indices for gear in gears):
            if not 0 <= gear <= last:
                raise InputError(
                    f"gear index = {gear}; must be 0 to {last}, there are {last + 1} "
                    "gears"
                )

    @property
    def plane(self) -> Plane:
        """State of the finite elements where no other is chosen."""
        return self.gears[0].plane

    @property
    def title(self) -> str:
        """The name, and the description if there is one."""
        return f"{self.name}: {self.description}" if self.description else self.name

    def common_width(self, index: int) -> float:
        """Face width over which the gears of a mesh face each other [m].

        That of the narrower one, unless an axial offset leaves less; of double helical
        gears that of both halves, without the groove.

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        float
            Face width [m].
        """
        low, high = self._common_ends(index)
        return high - low - self.common_groove(index)

    def common_groove(self, index: int) -> float:
        """Width between both halves of a mesh of double helical gears, else 0 [m].

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        float
            The wider groove of both gears.
        """
        return max(self.gears[gear].groove for gear in self.meshes[index].gears)

    def helix_width(self, index: int) -> float:
        """Common face width along one helix, of double helical gears that of a half.

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        float
            Face width [m].
        """
        halves = 2 if self.common_groove(index) else 1
        return self.common_width(index) / halves

    def width_middles(self, index: int) -> tuple[float, float]:
        """Middle of the common width from that of driver and driven gear [m].

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        tuple of float
            Of the driver, then of the driven gear [m].
        """
        middle = 0.5 * sum(self._common_ends(index))
        return middle, middle - self.meshes[index].offset

    def overlap_ratio(self, index: int) -> float:
        """Base pitches by which the helix leads over the common width along it.

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        float
            Overlap ratio, 0 of spur gears.
        """
        return self.meshes[index].pair.overlap_ratio(self.helix_width(index))

    def engagement(self, index: int) -> tuple[float, float]:
        """Positions at which a tooth pair comes into contact and leaves it.

        The path of contact, longer by the overlap ratio where gears are helical.

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        tuple of float
            Of the pair in the middle of the common width, from the pitch point [base
            pitches].
        """
        start, end = self.meshes[index].pair.path
        half_overlap = 0.5 * self.overlap_ratio(index)
        return start - half_overlap, end + half_overlap

    def _common_ends(self, index: int) -> tuple[float, float]:
        """Ends of the common width from the middle of the driver's width [m]."""
        spec = self.meshes[index]
        one, two = (0.5 * self.gears[gear].face_width for gear in spec.gears)
        return max(-one, spec.offset - two), min(one, spec.offset + two)

    def axis(self, gear: int) -> tuple[int, ...]:
        """The gears that turn about a gear's axis with it, itself first.

        Parameters
        ----------
        gear : int
            Index of the gear, from 0.

        Returns
        -------
        tuple of int
            Indices of the gears.
        """
        groups = (shaft.gears for shaft in self.shafts)
        group = next((gears for gears in groups if gear in gears), ())
        return (gear, *(other for other in group if other != gear))

    def meshes_of_same_flanks(self, index: int) -> tuple[int, ...]:
        """The meshes of a planetary set in which the same flanks meet those of planets.

        Teeth of the sun, or of the ring, pass all planets with one flank, and the
        planets are equal.

        Parameters
        ----------
        index : int
            Index of the mesh in `meshes`, from 0.

        Returns
        -------
        tuple of int
            Indices of the meshes, in order; of the mesh alone without a carrier.
        """
        if self.carrier is None:
            return (index,)
        centers = {self.carrier.sun, self.carrier.ring}
        center = centers.intersection(self.meshes[index].gears)
        return tuple(
            n for n, other in enumerate(self.meshes) if center & set(other.gears)
        )

    @cached_property
    def meshes_of(self) -> Mapping[int, tuple[int, ...]]:
        """Meshes that each gear takes part in, by their indices."""
        by_gear: dict[int, list[int]] = {gear: [] for gear in range(len(self.gears))}
        for number, mesh in enumerate(self.meshes):
            by_gear[mesh.driver].append(number)
            by_gear[mesh.driven].append(number)
        return {gear: tuple(numbers) for gear, numbers in by_gear.items()}

    @cached_property
    def senses(self) -> tuple[int, ...]:
        """1 where a gear turns counter-clockwise, -1 where clockwise.

        The first mesh's driver turns counter-clockwise, and so does the first gear
        of whatever is not linked to it.
        """
        senses: dict[int, int] = {}
        for start in (self.meshes[0].driver, *range(len(self.gears))):
            self._propagate_sense(start, senses)
        return tuple(senses[index] for index in range(len(self.gears)))

    def _propagate_sense(self, start: int, senses: dict[int, int]) -> None:
        """Fill in a gear that turns counter-clockwise and all that are linked to it."""
        waiting = [(start, 1)]
        while waiting:
            gear, sense = waiting.pop()
            if gear in senses:
                continue
            senses[gear] = sense
            waiting += [(other, sense) for other in self.axis(gear)]
            for mesh in (self.meshes[number] for number in self.meshes_of[gear]):
                other = mesh.driver + mesh.driven - gear
                waiting.append((other, -sense * mesh.pair.sign))
