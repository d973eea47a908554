"""The gear set file as it is written: TOML keys, units in their names.

Strict about types, keys and finite numbers; what the numbers mean for the teeth is
checked when they are cut. Every default of the format is here.
"""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    Strict,
    model_validator,
)

from fegear.gearset.bearing_keys import (
    BallBearingEntry,
    MountedBearingEntry,
    RollerBearingEntry,
)
from fegear.gearset.faults.keys import (
    BrokenTips,
    Cracks,
    Eccentricity,
    EccentricityAngle,
    MissingTeeth,
    Spalls,
    WornTeeth,
    require_faults,
)
from fegear.gearset.materials import STEEL, material_names, require_material
from fegear.gearset.modifications import Interpolation, ReliefShape
from fegear.gearset.planes import Plane
from fegear.gearset.planetary.members import MAX_PLANETS, Member
from fegear.gearset.rack_keys import (
    DEFAULT_PRESSURE_ANGLE_DEG,
    MAX_MODULE_MM,
    MIN_MODULE_MM,
    MM_PER_INCH,
    MODULE_KEYS,
    PRESSURE_ANGLE_KEYS,
    restated,
)
from fegear.gearset.shaft_bodies import ShaftEnd
from fegear.gearset.torque_limits import MAX_TORQUE, MIN_TORQUE
from lumped.common.checks import format_number
from meshes.gear import floored

Item = TypeVar("Item")


def _require_not_blank(name: str) -> str:
    if not name.strip():
        raise ValueError("must not be empty")
    return name


NAME = r'^[^"\p{Cc}\p{Cf}\p{Co}\p{Zl}\p{Zp}]+$'
Name = Annotated[str, Field(pattern=NAME), AfterValidator(_require_not_blank)]
# Limits far beyond any gear, so that no product of them leaves the range of numbers.
Positive = Annotated[float, Field(gt=0.0, le=1e5)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e5)]
Signed = Annotated[float, Field(ge=-1e5, le=1e5)]
Stiffness = Annotated[float, Field(ge=1e-3, le=1e15)]  # N/m or N m/rad
Inertia = Annotated[float, Field(ge=1e-15, le=1e9)]  # kg m2
Mass = Annotated[float, Field(ge=1e-12, le=1e9)]  # kg
Length = Annotated[float, Field(ge=1e-3, le=1e5)]  # mm, far beyond any gear
Height = Annotated[float, Field(ge=-1e5, le=1e5)]
Teeth = Annotated[int, Field(ge=5, le=10000, description="Number of teeth.")]
Module = Annotated[float, Field(ge=MIN_MODULE_MM, le=MAX_MODULE_MM)]
DiametralPitch = Annotated[
    float, Field(ge=MM_PER_INCH / MAX_MODULE_MM, le=MM_PER_INCH / MIN_MODULE_MM)
]
FaceWidth = Annotated[Length, Field(description="Face width.")]
MaterialName = Annotated[
    str,
    AfterValidator(require_material),
    Field(json_schema_extra={"enum": list(material_names())}),
]
Angle = Annotated[float, Field(ge=5.0, le=35.0)]
Shift = Annotated[float, Field(ge=-2.0, le=2.0)]
HelixAngle = Annotated[float, Field(ge=0.0, le=45.0)]
Hand = Literal["right", "left", "double"]
MAX_GAP = 0.8  # between the halves of a double helical gear, over the face width
Entries = Annotated[tuple[Item, ...], Strict(False)]  # a TOML array is a list


class Keys(BaseModel):
    """A TOML table that accepts its own keys only."""

    model_config = ConfigDict(
        defer_build=True,
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
    )

    def present(self, *names: str) -> list[str]:
        """Keys that have a value."""
        return [name for name in names if getattr(self, name) is not None]


def require_at_most_one(keys: Keys, *names: str) -> None:
    present = keys.present(*names)
    if len(present) > 1:
        raise ValueError(f"{' and '.join(present)} are given; only one is allowed")


def require_exactly_one(keys: Keys, *names: str) -> None:
    require_at_most_one(keys, *names)
    if not keys.present(*names):
        which = f"one of {', '.join(names)}" if len(names) > 1 else names[0]
        raise ValueError(f"{which} is needed")


def require_all_or_none(keys: Keys, *names: str) -> None:
    present = keys.present(*names)
    missing = [name for name in names if name not in present]
    if present and missing:
        raise ValueError(
            f"{' and '.join(present)} is given; {' and '.join(missing)} is needed "
            "with it"
        )


TIP_KEYS = ("tip_radius_mm", "tip_diameter_mm", "addendum_mm")
HUB_KEYS = ("hub_radius_mm", "hub_diameter_mm")
RIM_KEY = "rim_radius_mm"
SPAN_KEYS = ("span_mm", "span_teeth")
PIN_KEYS = ("pin_dimension_mm", "pin_diameter_mm")
MATERIAL_KEYS = ("young_modulus_GPa", "poisson_ratio", "density_kg_per_m3")
START_KEYS = ("length_pitches", "start_roll_angle_deg", "start")
SPACING_KEYS = ("center_distance_mm", "operating_pressure_angle_deg")
POINT_KEYS = ("roll_angle_deg", "diameter_mm")
GRID_KEYS = ("roll_angle_deg", "place_mm", "depth_um")
BEARING_KEYS = ("bearing_kx_N_per_m", "bearing_ky_N_per_m")
ROLLING_KEYS = ("ball_bearing", "roller_bearing")
# Groups of sets of keys that say the same thing: a key replaces those of other sets.
ALTERNATIVES = (
    *(tuple((key,) for key in keys) for keys in (TIP_KEYS, (*HUB_KEYS, RIM_KEY))),
    *(tuple((key,) for key in keys) for keys in (MODULE_KEYS, PRESSURE_ANGLE_KEYS)),
    (SPAN_KEYS, PIN_KEYS),
    *(tuple((key,) for key in keys) for keys in (START_KEYS, SPACING_KEYS)),
    *((("file",), (key,)) for key in (*POINT_KEYS, "deviation_um")),
    tuple((key,) for key in POINT_KEYS),
    (BEARING_KEYS, *((key,) for key in ROLLING_KEYS)),
)
# of bores and of measures over teeth, which internal gears have not; and the reverse
INTERNAL_LACKS = (*HUB_KEYS, *SPAN_KEYS, *PIN_KEYS)
RIM_STIFFNESS_KEYS = (
    "rim_radial_stiffness_N_per_mm3",
    "rim_tangential_stiffness_N_per_mm3",
)
EXTERNAL_LACKS = (RIM_KEY, *RIM_STIFFNESS_KEYS, "cutter_teeth")


def replaced_keys(key: str) -> set[str]:
    """Keys that a key replaces, by `ALTERNATIVES`; a material replaces its values."""
    if key == "material":
        return set(MATERIAL_KEYS)
    groups = [sets for sets in ALTERNATIVES if any(key in keys for keys in sets)]
    return {
        other for sets in groups for keys in sets if key not in keys for other in keys
    }


def require_none(gear: GearEntry, *names: str) -> None:
    """Require that an internal, or an external, gear has no keys of the other kind."""
    for name in gear.present(*names):
        kind = "an internal" if gear.internal else "an external"
        raise ValueError(
            f"{name} = {getattr(gear, name):g}; not allowed for {kind} gear, "
            f"internal = {str(gear.internal).lower()}"
        )


class GearDefaults(Keys):
    """Keys that gears may share through the [defaults] table."""

    teeth: Teeth | None = None
    module_mm: Module | None = Field(
        default=None,
        description="Module of the normal section; this or one of the next three keys "
        "is needed.",
    )
    transverse_module_mm: Module | None = Field(
        default=None,
        description="Module across the axis, instead of module_mm, which is this times "
        "the cosine of the helix angle.",
    )
    diametral_pitch_per_in: DiametralPitch | None = Field(
        default=None,
        description="Diametral pitch of the normal section, instead of module_mm, "
        "which is 25.4 mm over it.",
    )
    transverse_diametral_pitch_per_in: DiametralPitch | None = Field(
        default=None,
        description="Diametral pitch across the axis, teeth per inch of the pitch "
        "diameter, instead of module_mm.",
    )
    pressure_angle_deg: Angle | None = Field(
        default=None,
        description="Pressure angle of the rack, of the normal section.",
        json_schema_extra={"default": DEFAULT_PRESSURE_ANGLE_DEG},
    )
    transverse_pressure_angle_deg: Angle | None = Field(
        default=None,
        description="Pressure angle across the axis, instead of pressure_angle_deg.",
    )
    helix_angle_deg: HelixAngle = Field(
        default=0.0,
        description="Helix angle on the reference cylinder. Profile shift and rack are "
        "those of the normal section, and so are lengths in modules.",
    )
    profile_shift: Shift | None = Field(
        default=None,
        description="Profile shift over the module. [default: 0, or as span_mm or "
        "pin_dimension_mm has it]",
    )
    tip_radius_mm: Length | None = Field(
        default=None,
        description="Radius of the tip circle. [default: from addendum_mm, or from "
        "contact_ratio]",
    )
    tip_diameter_mm: Length | None = Field(
        default=None,
        description="Diameter of the tip circle, instead of tip_radius_mm.",
    )
    addendum_mm: Height | None = Field(
        default=None,
        description="Height of the tip above the reference circle, instead of "
        "tip_radius_mm. [default: (1 + profile_shift) module]",
    )
    dedendum_mm: Length | None = Field(
        default=None,
        description="Depth of the root below the reference circle of a gear without "
        "profile shift. [default: 1.25 module]",
    )
    rack_tip_radius_mm: Length | None = Field(
        default=None,
        description="Radius of the rack's tip, which cuts the fillet; of an internal "
        "gear that of the shaper cutter, across the axis. [default: 0.3 module or, if "
        "less, what fits the space]",
    )
    cutter_teeth: Teeth | None = Field(
        default=None,
        description="Number of teeth of the shaper cutter of an internal gear. "
        "[default: a third of its teeth]",
    )
    face_width_mm: FaceWidth | None = None
    hub_radius_mm: Length | None = Field(
        default=None, description="Radius of the bore, which is fixed to the shaft."
    )
    hub_diameter_mm: Length | None = Field(
        default=None, description="Diameter of the bore, instead of hub_radius_mm."
    )
    rim_radius_mm: Length | None = Field(
        default=None,
        description="Outer radius of an internal gear, where it is held or carried.",
    )
    rim_radial_stiffness_N_per_mm3: Annotated[float, Field(ge=0.0, le=1e12)] | None = (
        Field(
            default=None,
            description="Radial stiffness, per area, of springs that carry the whole "
            "outside of an internal gear; needs the tangential one. [default: held "
            "rigidly]",
        )
    )
    rim_tangential_stiffness_N_per_mm3: (
        Annotated[float, Field(ge=1e-3, le=1e12)] | None
    ) = Field(
        default=None,
        description="Tangential stiffness, per area, of the same springs.",
    )
    tooth_thinning_um: Signed | None = Field(
        default=None,
        description="Reduction of the arc thickness on the reference circle, across "
        "the axis. [default: 0, or as span_mm or pin_dimension_mm has it]",
    )
    span_mm: Length | None = Field(
        default=None,
        description="Base tangent length over span_teeth teeth, which sets the tooth "
        "thickness: with profile_shift it gives tooth_thinning_um, without it "
        "profile_shift.",
    )
    span_teeth: Annotated[int, Field(ge=1, le=5000)] | None = Field(
        default=None, description="Number of teeth that span_mm is measured over."
    )
    pin_dimension_mm: Length | None = Field(
        default=None,
        description="Dimension over two pins, or balls of helical teeth, in opposite "
        "spaces, or nearly opposite if the number of teeth is odd; instead of span_mm.",
    )
    pin_diameter_mm: Length | None = Field(
        default=None, description="Diameter of the pins or balls of pin_dimension_mm."
    )
    material: MaterialName = Field(
        default=STEEL,
        description="Material, whose values are those of young_modulus_GPa, "
        "poisson_ratio and density_kg_per_m3 where they are left out.",
    )
    young_modulus_GPa: Annotated[float, Field(ge=1e-3, le=1e5)] | None = Field(
        default=None, description="Young's modulus. [default: that of material]"
    )
    poisson_ratio: Annotated[float, Field(ge=0.0, le=0.49)] | None = Field(
        default=None, description="Poisson's ratio. [default: that of material]"
    )
    density_kg_per_m3: Annotated[float, Field(ge=1e-3, le=1e6)] | None = Field(
        default=None, description="Density. [default: that of material]"
    )
    inertia_kg_m2: Inertia | None = Field(
        default=None,
        description="Moment of inertia. [default: of the body between bore and tooth "
        "outline]",
    )
    mass_kg: Mass | None = Field(
        default=None,
        description="Mass. [default: of the body between bore and tooth outline]",
    )
    pitch_errors_um: Entries[Signed] | None = Field(
        default=None,
        description="Distance of each tooth behind its contact, on the flank that "
        "carries load in the gear's first mesh; teeth in the order in which"
        " they come into contact, that of the reference pair first.",
    )
    bearing_kx_N_per_m: Stiffness | None = Field(
        default=None,
        description="Stiffness of the bearing along x; without it the centre does not "
        "move.",
    )
    bearing_ky_N_per_m: Stiffness | None = Field(
        default=None,
        description="Stiffness of the bearing along y; without it the centre does not "
        "move.",
    )
    ball_bearing: BallBearingEntry | None = Field(
        default=None,
        description="Ball bearing of the gear, instead of bearing_kx_N_per_m and "
        "bearing_ky_N_per_m.",
    )
    roller_bearing: RollerBearingEntry | None = Field(
        default=None,
        description="Cylindrical roller bearing of the gear, instead of ball_bearing.",
    )
    coupling_stiffness_Nm_per_rad: Annotated[float, Field(ge=0.0, le=1e15)] = Field(
        default=0.0, description="Torsional stiffness of a spring to ground."
    )

    @model_validator(mode="after")
    def _stated_once(self) -> GearDefaults:
        require_at_most_one(self, *MODULE_KEYS)
        require_at_most_one(self, *PRESSURE_ANGLE_KEYS)
        require_at_most_one(self, *TIP_KEYS)
        require_at_most_one(self, *HUB_KEYS)
        require_at_most_one(self, SPAN_KEYS[0], PIN_KEYS[0])
        return self


class GearEntry(GearDefaults):
    """[[gear]], defaults filled in."""

    name: Name = Field(description="Name of the gear.")
    internal: bool = Field(
        default=False,
        description="Whether the teeth point inward, as those of a ring do.",
    )
    hand: Hand | None = Field(
        default=None,
        description="Hand of the helix; double has two halves of opposite hands, the "
        "near one right-handed on the first such gear. [default: that of its mates "
        "reversed, of an internal gear that of its mates, right of the first gear]",
    )
    gap_mm: Length | None = Field(
        default=None,
        description="Width of the groove between the halves of a double helical gear, "
        "part of the face width.",
    )
    teeth: Teeth
    face_width_mm: FaceWidth
    cracks: Cracks = ()
    spalls: Spalls = ()
    broken_tips: BrokenTips = ()
    missing_teeth: MissingTeeth = ()
    worn_teeth: WornTeeth = ()
    eccentricity_um: Eccentricity = 0.0
    eccentricity_angle_deg: EccentricityAngle = 0.0

    @model_validator(mode="after")
    def _whole(self) -> GearEntry:
        require_exactly_one(self, *MODULE_KEYS)
        require_none(self, *(INTERNAL_LACKS if self.internal else EXTERNAL_LACKS))
        require_exactly_one(self, *((RIM_KEY,) if self.internal else HUB_KEYS))
        for keys in (BEARING_KEYS, SPAN_KEYS, PIN_KEYS, RIM_STIFFNESS_KEYS):
            require_all_or_none(self, *keys)
        require_at_most_one(self, BEARING_KEYS[0], *ROLLING_KEYS)
        return self

    @model_validator(mode="after")
    def _helix(self) -> GearEntry:
        """Require what is known of helical gears."""
        if self.helix_angle_deg == 0.0 and self.hand is not None:
            raise ValueError(f'hand = "{self.hand}"; helix_angle_deg is needed')
        if (self.hand == "double") != (self.gap_mm is not None):
            key = "gap_mm" if self.gap_mm is None else 'hand = "double"'
            raise ValueError(f"{key} is needed; a double helical gear has both")
        if self.gap_mm is not None and not self.gap_mm <= MAX_GAP * self.face_width_mm:
            most = floored(MAX_GAP * self.face_width_mm)
            raise ValueError(
                f"gap_mm = {format_number(self.gap_mm)}; must be at most {most}, "
                f"{MAX_GAP:g} of the face width"
            )
        return self

    @model_validator(mode="after")
    def _thickness_once(self) -> GearEntry:
        """Require two of shift, thinning and measured thickness at most."""
        measured = self.present(SPAN_KEYS[0], PIN_KEYS[0])
        given = self.present("profile_shift", "tooth_thinning_um")
        if measured and len(given) == 2:
            raise ValueError(
                f"{' and '.join(given)} are given; only one is allowed with "
                f"{measured[0]}"
            )
        return self

    @model_validator(mode="after")
    def _faults(self) -> GearEntry:
        require_faults(self)
        return self

    @model_validator(mode="after")
    def _error_for_each_tooth(self) -> GearEntry:
        errors = self.pitch_errors_um
        if errors is not None and len(errors) != self.teeth:
            raise ValueError(
                f"pitch_errors_um has {len(errors)} entries; "
                f"one for each of the {self.teeth} teeth is needed"
            )
        most = 500.0 * self.rack_value("module_mm")
        for number, error in enumerate(errors or (), start=1):
            if abs(error) > most:
                raise ValueError(
                    f"pitch_errors_um entry {number} = {format_number(error)}; must "
                    "be from "
                    f"-{floored(most)} to {floored(most)}, half the module"
                )
        return self

    @property
    def module_key(self) -> str:
        """The one key that states the module."""
        return self.present(*MODULE_KEYS)[0]

    @property
    def pressure_angle_key(self) -> str:
        """The key that states the pressure angle, or has it by default."""
        return next(iter(self.present(*PRESSURE_ANGLE_KEYS)), PRESSURE_ANGLE_KEYS[0])

    def rack_value(self, key: str) -> float:
        """Value of a key of the module or pressure angle, whichever key states it."""
        stated_key = self.module_key if key in MODULE_KEYS else self.pressure_angle_key
        value = getattr(self, stated_key)
        if value is None:
            value = DEFAULT_PRESSURE_ANGLE_DEG
        return restated(stated_key, value, key, self.helix_angle_deg)

    def with_rack_value(self, key: str, value: float) -> GearEntry:
        """The gear with its module, or pressure angle, stated by a key."""
        keys = MODULE_KEYS if key in MODULE_KEYS else PRESSURE_ANGLE_KEYS
        return self.model_copy(update={**dict.fromkeys(keys), key: value})


START = (
    "Point where the relief starts: of single-tooth contact the highest (HPSTC) or the "
    "lowest (LPSTC). [default: HPSTC at the tip, LPSTC at the root, if no length or "
    "roll angle is given]"
)


class ReliefEntry(Keys):
    """A relief; exactly one key says where it starts."""

    magnitude_um: Positive = Field(description="Depth at the end of the flank.")
    length_pitches: Positive | None = Field(
        default=None, description="Length, as roll angle over the pitch angle."
    )
    start_roll_angle_deg: Positive | None = Field(
        default=None, description="Roll angle at which the relief starts."
    )
    start: Literal["HPSTC", "LPSTC"] | None = Field(default=None, description=START)
    shape: ReliefShape = Field(
        default="linear", description="Depth over the roll angle."
    )

    @model_validator(mode="after")
    def _one_start(self) -> ReliefEntry:
        require_exactly_one(self, *START_KEYS)
        return self


class TipReliefEntry(ReliefEntry):
    start: Literal["HPSTC"] | None = Field(default=None, description=START)


class RootReliefEntry(ReliefEntry):
    start: Literal["LPSTC"] | None = Field(default=None, description=START)


class ProfileEntry(Keys):
    """A profile modification of flanks; measured points are given here or in a file."""

    crowning_um: Signed = Field(
        default=0.0,
        description="Material missing at both ends of the active profile, by a "
        "parabola over the roll angle that is zero in the middle.",
    )
    slope_um: Signed = Field(
        default=0.0,
        description="Profile slope deviation: excess of material at the tip, linear "
        "over the roll angle from zero at the start of the active profile.",
    )
    file: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="CSV file with columns roll_angle_deg or diameter_mm, and "
        "deviation_um; beside the gear-set file unless its path is absolute.",
    )
    roll_angle_deg: Entries[NotNegative] | None = Field(
        default=None, description="Roll angles of measured points, increasing."
    )
    diameter_mm: Entries[Length] | None = Field(
        default=None,
        description="Diameters of measured points, instead of roll_angle_deg.",
    )
    deviation_um: Entries[Signed] | None = Field(
        default=None,
        description="Measured deviations at these points, positive where there is "
        "excess of material; constant beyond the first and the last.",
    )
    interpolation: Interpolation = Field(
        default="cubic",
        description="Between measured points: shape-preserving cubic, or linear with a "
        "kink at each point.",
    )

    @model_validator(mode="after")
    def _one_source(self) -> ProfileEntry:
        require_at_most_one(self, "file", "deviation_um")
        require_at_most_one(self, "file", *POINT_KEYS)
        require_at_most_one(self, *POINT_KEYS)
        if self.deviation_um is not None:
            require_exactly_one(self, *POINT_KEYS)
        for key in self.present(*POINT_KEYS):
            require_all_or_none(self, key, "deviation_um")
        return self


class LeadEntry(Keys):
    """A modification of flanks over the face width."""

    crowning_um: Signed = Field(
        default=0.0,
        description="Material missing at both ends of the face width, by a parabola "
        "that is zero in the middle.",
    )
    slope_um: Signed = Field(
        default=0.0,
        description="Material missing at the far end of the face width, linear from "
        "none at the near end: helix slope deviation. In lead, which names no gear, "
        "that of both gears together, as misalignment_um. Seen from the near end the "
        "driver of the first mesh turns counter-clockwise.",
    )
    end_relief_um: NotNegative = Field(
        default=0.0,
        description="Material missing at both ends, by a parabola over "
        "end_relief_length_mm.",
    )
    end_relief_length_mm: Length | None = Field(
        default=None, description="Length of the end relief, from each end."
    )

    @model_validator(mode="after")
    def _length_of_relief(self) -> LeadEntry:
        if self.end_relief_um and self.end_relief_length_mm is None:
            raise ValueError(
                f"end_relief_um = {self.end_relief_um:g}; end_relief_length_mm is "
                "needed with it"
            )
        if self.end_relief_length_mm is not None and not self.end_relief_um:
            raise ValueError(
                f"end_relief_length_mm = {self.end_relief_length_mm:g}; end_relief_um "
                "above 0 is needed with it"
            )
        return self


class TopographyEntry(Keys):
    """A modification of one gear's drive flanks over profile and face width."""

    bias_um: Signed = Field(
        default=0.0,
        description="Twist of the flanks: half of it is missing at the tip of the far "
        "end and at the root of the near end, and is in excess at both other corners; "
        "bilinear over the roll angle of the active profile and the face width.",
    )
    file: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="CSV file of measured points in any order, one for each roll angle "
        "at each place, with columns roll_angle_deg, place_mm and deviation_um "
        "(positive where there is excess of material); beside the gear-set file unless "
        "its path is absolute.",
    )
    roll_angle_deg: Entries[NotNegative] | None = Field(
        default=None, description="Roll angles of points, increasing."
    )
    place_mm: Entries[Signed] | None = Field(
        default=None,
        description="Places of points along the gear's face width from its middle, "
        "increasing toward the far end.",
    )
    depth_um: Entries[Entries[Signed]] | None = Field(
        default=None,
        description="Material missing at these points along the line of action: a list "
        "for each roll angle, of a depth for each place; bilinear between points and "
        "constant beyond the outer ones.",
    )

    @model_validator(mode="after")
    def _one_source(self) -> TopographyEntry:
        require_all_or_none(self, *GRID_KEYS)
        require_at_most_one(self, "file", "depth_um")
        return self


class MeshKeys(Keys):
    """Keys of a mesh that do not say which gears are where.

    A relief, profile or lead without a gear's role applies to both gears.
    """

    contact_ratio: Annotated[float, Field(ge=1.0, le=1e2)] | None = Field(
        default=None,
        description="Contact ratio, from which tips follow that are not given.",
    )
    tip_shortening: bool = Field(
        default=False,
        description="Shorten tips that are not given by as much as the sum of profile "
        "shifts is more than the distance of the reference circles, which keeps the "
        "tip clearance (DIN 3960); of external gears.",
    )
    backlash_um: NotNegative | None = Field(
        default=None,
        description="Backlash along the line of action. [default: that of the teeth]",
    )
    mean_stiffness_N_per_m: Stiffness | None = Field(
        default=None, description="Mean stiffness of analytic stiffness waves."
    )
    stiffness_variation: Annotated[float, Field(ge=0.0, lt=1.0)] | None = Field(
        default=None,
        description="Peak to peak of analytic stiffness waves, over the mean.",
    )
    load_share: Annotated[float, Field(gt=0.0, lt=1.0)] | None = Field(
        default=None,
        description="Share of the load that a pair carries at the start of double "
        "contact, of analytic stiffness waves.",
    )
    tip_relief: TipReliefEntry | None = Field(
        default=None, description="Tip relief of both gears."
    )
    root_relief: RootReliefEntry | None = Field(
        default=None, description="Root relief of both gears."
    )
    driver_tip_relief: TipReliefEntry | None = Field(
        default=None, description="Tip relief of the driving gear."
    )
    driven_tip_relief: TipReliefEntry | None = Field(
        default=None, description="Tip relief of the driven gear."
    )
    driver_root_relief: RootReliefEntry | None = Field(
        default=None, description="Root relief of the driving gear."
    )
    driven_root_relief: RootReliefEntry | None = Field(
        default=None, description="Root relief of the driven gear."
    )
    profile: ProfileEntry | None = Field(
        default=None,
        description="Profile modification of both gears, each of which has all of it.",
    )
    driver_profile: ProfileEntry | None = Field(
        default=None, description="Profile modification of the driving gear."
    )
    driven_profile: ProfileEntry | None = Field(
        default=None, description="Profile modification of the driven gear."
    )
    lead: LeadEntry | None = Field(
        default=None,
        description="Lead modification of both gears: each has all of its crowning and "
        "end relief, which add up along the normal; its slope counts once.",
    )
    driver_lead: LeadEntry | None = Field(
        default=None, description="Lead modification of the driving gear."
    )
    driven_lead: LeadEntry | None = Field(
        default=None, description="Lead modification of the driven gear."
    )
    driver_topography: TopographyEntry | None = Field(
        default=None,
        description="Modification of the driving gear over profile and face width.",
    )
    driven_topography: TopographyEntry | None = Field(
        default=None,
        description="Modification of the driven gear over profile and face width.",
    )
    misalignment_um: Signed = Field(
        default=0.0,
        description="Misalignment of the axes in the plane of action: gap at the far "
        "end of the common face width, linear from none at the near end, once for "
        "both gears. Seen from the near end the driver of the first mesh turns "
        "counter-clockwise.",
    )
    offset_mm: Signed = Field(
        default=0.0,
        description="Middle of the driven gear's face width from that of the driving "
        "one, along the axis toward the far end.",
    )

    @model_validator(mode="after")
    def _exclusive(self) -> MeshKeys:
        for place in ("tip_relief", "root_relief", "profile", "lead"):
            for role in ("driver", "driven"):
                require_at_most_one(self, place, f"{role}_{place}")
        if self.misalignment_um and self.lead is not None and self.lead.slope_um:
            raise ValueError(
                f"misalignment_um = {self.misalignment_um:g} and lead.slope_um = "
                f"{self.lead.slope_um:g} are given; only one is allowed, they are the "
                "same gap"
            )
        return self


class MeshEntry(MeshKeys):
    """[[mesh]]."""

    driver: Name = Field(description="Name of the driving gear.")
    driven: Name = Field(description="Name of the driven gear.")
    center_distance_mm: Length | None = Field(
        default=None,
        description="Centre distance. [default: that at which teeth of full thickness "
        "have no backlash, by the sum of profile shifts]",
    )
    operating_pressure_angle_deg: Annotated[float, Field(ge=5.0, le=45.0)] | None = (
        Field(
            default=None,
            description="Operating pressure angle, instead of center_distance_mm.",
        )
    )
    phase: Signed | None = Field(
        default=None,
        description="Position of the mesh cycle when the first mesh is at its pitch "
        "point, in base pitches. [default: that of the teeth, where they "
        "fix it]",
    )
    center_line_deg: Signed | None = Field(
        default=None,
        description="Direction from driver to driven gear, counter-clockwise from x. "
        "[default: all centres in a row along x]",
    )

    @model_validator(mode="after")
    def _two_gears(self) -> MeshEntry:
        require_at_most_one(self, *SPACING_KEYS)
        if self.driver == self.driven:
            raise ValueError(f'driven = "{self.driven}"; must differ from the driver')
        return self

    @property
    def label(self) -> str:
        return mesh_label(self.driver, self.driven)

    @property
    def spacing_key(self) -> str:
        """The one of the two exclusive keys that sets the centre distance."""
        return next(iter(self.present(*SPACING_KEYS)), SPACING_KEYS[0])


def mesh_label(driver: str, driven: str) -> str:
    return f'mesh "{driver}"-"{driven}"'


GEOMETRY_KEYS = ("lengths_mm", "diameters_mm", "positions_mm")
BEARING_ON_SHAFT = "bearing_positions_mm"
STIFFNESSES_ON_SHAFT = ("bearing_kx_N_per_m", "bearing_ky_N_per_m")
LINEAR_BEARING_KEYS = (
    *STIFFNESSES_ON_SHAFT,
    "bearing_kxy_N_per_m",
    "bearing_kyx_N_per_m",
    "bearing_kz_N_per_m",
    "bearing_tilt_stiffness_Nm_per_rad",
    "bearing_cx_Ns_per_m",
    "bearing_cy_Ns_per_m",
)
DISK_KEYS = ("disk_positions_mm", "disk_masses_kg", "disk_inertias_kg_m2")
# lists of a shaft by the list that has as many entries
COUNTED_KEYS = {
    "lengths_mm": ("diameters_mm", "bores_mm"),
    "gears": ("positions_mm",),
    BEARING_ON_SHAFT: LINEAR_BEARING_KEYS,
    DISK_KEYS[0]: (*DISK_KEYS[1:], "disk_transverse_inertias_kg_m2"),
}
Positions = Annotated[float, Field(ge=0.0, le=1e5)]  # mm
CrossStiffness = Annotated[float, Field(ge=-1e15, le=1e15)]  # N/m
NotNegativeStiffness = Annotated[float, Field(ge=0.0, le=1e15)]  # N/m or N m/rad
Damping = Annotated[float, Field(ge=0.0, le=1e12)]  # N s/m
ShaftInertia = Annotated[float, Field(ge=0.0, le=1e9)]  # kg m2


class ShaftEntry(Keys):
    """[[shaft]]: gears on one axis, and the shaft that bends, for `fegear campbell`."""

    gears: Annotated[Entries[Name], Field(min_length=1)] = Field(
        description="Names of the gears on the shaft, in order; two or more, or one "
        "with lengths_mm."
    )
    stiffness_Nm_per_rad: Stiffness | None = Field(
        default=None,
        description="Torsional stiffness between successive gears. [default: rigid]",
    )
    lengths_mm: Entries[Length] | None = Field(
        default=None,
        description="Lengths of the shaft's sections, from its first end, which is the "
        "near one.",
    )
    diameters_mm: Entries[Length] | None = Field(
        default=None, description="Diameter of every section."
    )
    bores_mm: Entries[NotNegative] | None = Field(
        default=None, description="Bore of every section. [default: solid]"
    )
    positions_mm: Entries[Positions] | None = Field(
        default=None,
        description="Distance of the middle of every gear from the first end.",
    )
    material: MaterialName = Field(
        default=STEEL, description="Material of the shaft itself."
    )
    bearing_positions_mm: Entries[Positions] | None = Field(
        default=None, description="Distance of every bearing from the first end."
    )
    bearing_kx_N_per_m: Entries[Stiffness] | None = Field(
        default=None, description="Stiffness of every bearing along x."
    )
    bearing_ky_N_per_m: Entries[Stiffness] | None = Field(
        default=None, description="Stiffness of every bearing along y."
    )
    bearing_kxy_N_per_m: Entries[CrossStiffness] | None = Field(
        default=None,
        description="Force of every bearing along x per displacement along y, against "
        "it. [default: 0]",
    )
    bearing_kyx_N_per_m: Entries[CrossStiffness] | None = Field(
        default=None,
        description="Force of every bearing along y per displacement along x, against "
        "it. [default: 0]",
    )
    bearing_kz_N_per_m: Entries[NotNegativeStiffness] | None = Field(
        default=None,
        description="Stiffness of every bearing along the axis; 0 for a floating "
        "bearing. [default: it is not known which bearing locates the shaft]",
    )
    bearing_tilt_stiffness_Nm_per_rad: Entries[NotNegativeStiffness] | None = Field(
        default=None,
        description="Moment of every bearing about a diameter per angle by which the "
        "shaft tilts in it. [default: 0]",
    )
    bearing_cx_Ns_per_m: Entries[Damping] | None = Field(
        default=None, description="Damping of every bearing along x. [default: 0]"
    )
    bearing_cy_Ns_per_m: Entries[Damping] | None = Field(
        default=None, description="Damping of every bearing along y. [default: 0]"
    )
    driven_from: ShaftEnd | None = Field(
        default=None,
        description="End of the shaft at which torque from outside enters or leaves; "
        "start is the near end, from which positions_mm count. Its gear then twists "
        "over the face width at rest. "
        "[default: it is not known, and the gear does not twist]",
    )
    rolling_bearings: Entries[MountedBearingEntry] = Field(
        default=(),
        description="Rolling bearings instead of stiffnesses, as many as "
        "bearing_positions_mm; shafts that vibrate have them linearised at rest.",
    )
    disk_positions_mm: Entries[Positions] | None = Field(
        default=None,
        description="Distance of every rigid disk, such as an impeller, from the first "
        "end.",
    )
    disk_masses_kg: Entries[Mass] | None = Field(
        default=None, description="Mass of every disk."
    )
    disk_inertias_kg_m2: Entries[ShaftInertia] | None = Field(
        default=None, description="Polar moment of inertia of every disk."
    )
    disk_transverse_inertias_kg_m2: Entries[ShaftInertia] | None = Field(
        default=None,
        description="Moment of inertia of every disk about a diameter. [default: half "
        "the polar one, of a thin disk]",
    )

    @model_validator(mode="after")
    def _whole(self) -> ShaftEntry:
        require_all_or_none(self, *GEOMETRY_KEYS)
        if self.rolling_bearings:
            self._require_rolling_bearings_only()
        else:
            require_all_or_none(self, BEARING_ON_SHAFT, *STIFFNESSES_ON_SHAFT)
        require_all_or_none(self, *DISK_KEYS)
        if self.lengths_mm is None:
            if len(self.gears) < 2:
                raise ValueError(
                    "gears has 1 entries; at least 2 needed without lengths_mm"
                )
            for key in self.present("bores_mm", BEARING_ON_SHAFT, DISK_KEYS[0]):
                raise ValueError(f"{key} is given; lengths_mm is needed with it")
        if self.driven_from is not None and self.bearing_positions_mm is None:
            raise ValueError(
                f"driven_from is given; {BEARING_ON_SHAFT} is needed with it"
            )
        if len(self.gears) < 2 and self.stiffness_Nm_per_rad is not None:
            raise ValueError(
                "stiffness_Nm_per_rad is given; it is that between gears, and the "
                "shaft has one"
            )
        for counted_key, keys in COUNTED_KEYS.items():
            self._require_as_many(counted_key, keys)
        return self

    def _require_rolling_bearings_only(self) -> None:
        for key in self.present(*LINEAR_BEARING_KEYS):
            raise ValueError(
                f"{key} and rolling_bearings are given; only one is allowed"
            )
        self._require_as_many(BEARING_ON_SHAFT, ("rolling_bearings",))

    def _require_as_many(self, counted_key: str, keys: tuple[str, ...]) -> None:
        entries = getattr(self, counted_key)
        for key in self.present(*keys):
            count = len(getattr(self, key))
            if entries is None:
                raise ValueError(f"{key} is given; {counted_key} is needed with it")
            if count != len(entries):
                raise ValueError(
                    f"{key} has {count} entries; as many as {counted_key} are needed, "
                    f"{len(entries)}"
                )


PositionError = Annotated[float, Field(ge=-1e3, le=1e3)]


class PlanetaryEntry(Keys):
    """[[planetary]]: equal planets on a carrier between a sun and a ring.

    Its planets and meshes become [[gear]] and [[mesh]] tables, see `expanded`.
    """

    sun: Name = Field(description="Name of the sun gear.")
    planet: Name = Field(
        description="Name of the gear that all planets are equal to, which become "
        "NAME-1, NAME-2 and so on."
    )
    ring: Name = Field(description="Name of the internal gear.")
    planets: Annotated[int, Field(ge=2, le=MAX_PLANETS)] = Field(
        description="Number of planets."
    )
    input: Member = Field(default="sun", description="Member that is driven.")
    output: Member = Field(default="carrier", description="Member that drives.")
    held: Member = Field(default="ring", description="Member that does not rotate.")
    center_distance_mm: Length | None = Field(
        default=None,
        description="Distance of the planets' axes from that of the sun. [default: "
        "half the module times the teeth of sun and planet, without profile shift]",
    )
    positions_deg: Entries[Signed] | None = Field(
        default=None,
        description="Direction of each planet, counter-clockwise from x. [default: "
        "equally spaced, the first along x]",
    )
    position_errors_um: Entries[PositionError] | None = Field(
        default=None,
        description="Displacement of each planet's pin, or of its axis where it has no "
        "bearing, along the circle of the axes; positive in the sense of the "
        "carrier's rotation, where the carrier is held in that of the input.",
    )
    carrier_inertia_kg_m2: Inertia | None = Field(
        default=None,
        description="Moment of inertia of the carrier without planets. [default: of "
        "two disks that reach to the axes of the planets, together as thick as a "
        "planet is wide and of its density]",
    )
    carrier_mass_kg: Mass | None = Field(
        default=None,
        description="Mass of the carrier without planets. [default: of these disks]",
    )
    carrier_bearing_kx_N_per_m: Stiffness | None = Field(
        default=None,
        description="Stiffness of the carrier's bearing along x; without it its axis "
        "does not move.",
    )
    carrier_bearing_ky_N_per_m: Stiffness | None = Field(
        default=None,
        description="Stiffness of the carrier's bearing along y; without it its axis "
        "does not move.",
    )
    carrier_coupling_stiffness_Nm_per_rad: Annotated[float, Field(ge=0.0, le=1e15)] = (
        Field(
            default=0.0,
            description="Torsional stiffness of a spring between carrier and ground.",
        )
    )
    sun_mesh: MeshKeys | None = Field(
        default=None, description="Keys of all meshes of the sun."
    )
    ring_mesh: MeshKeys | None = Field(
        default=None, description="Keys of all meshes of the ring."
    )

    @model_validator(mode="after")
    def _whole(self) -> PlanetaryEntry:
        require_all_or_none(self, *(f"carrier_{key}" for key in BEARING_KEYS))
        members = self.input, self.output, self.held
        if len(set(members)) < len(members):
            raise ValueError(
                f'input = "{self.input}", output = "{self.output}", held = '
                f'"{self.held}"; must be sun, carrier and ring, each once'
            )
        if len({self.sun, self.planet, self.ring}) < 3:
            raise ValueError("sun, planet and ring; must be three gears")
        for name in ("positions_deg", "position_errors_um"):
            entries = getattr(self, name)
            if entries is not None and len(entries) != self.planets:
                raise ValueError(
                    f"{name} has {len(entries)} entries; one for each of the "
                    f"{self.planets} planets is needed"
                )
        return self

    @property
    def planet_names(self) -> list[str]:
        return [f"{self.planet}-{n}" for n in range(1, self.planets + 1)]


def _require_driving_torque(torque: float) -> float:
    if not torque > 0.0:
        raise ValueError(
            "torque of the wrong sign; must be positive, in the sense of rotation"
        )
    if torque < MIN_TORQUE:
        raise ValueError(f"must be at least {MIN_TORQUE:g} N m")
    return torque


def _require_distinct_torques(torques: tuple[float, ...]) -> tuple[float, ...]:
    for torque in torques:
        if torques.count(torque) > 1:
            raise ValueError(f"{torque:g} N m is there more than once")
    return torques


class LoadEntry(Keys):
    """[load]: the torque cases."""

    gear: Name = Field(
        description="Name of the input gear, in a planetary set also of the carrier; "
        "without planets also of the output gear, on which torques are then given and "
        "divided by the ratio."
    )
    torques_Nm: Annotated[
        Entries[
            Annotated[
                float,
                Field(lt=MAX_TORQUE, json_schema_extra={"minimum": MIN_TORQUE}),
                AfterValidator(_require_driving_torque),
            ]
        ],
        Field(min_length=1),
        AfterValidator(_require_distinct_torques),
    ] = Field(description="Torques on the input gear.")


class HousingEntry(Keys):
    """[housing]: matrices of a housing that holds bearings, for `fegear campbell`."""

    file: Annotated[str, Field(min_length=1)] = Field(
        description="MAT file up to version 7 with stiffness and mass, n x n in SI "
        "units, nodes, b x 2 numbers of shaft and bearing from 1, and damping where it "
        "has some. Every node has six coordinates: displacements along x, y and z and "
        "rotations about them; coordinates of modes may follow. A node 0, k is a "
        "further one; bearings that no node names stay on ground. The file is beside "
        "the gear-set file unless its path is absolute.",
    )


class DynamicsEntry(Keys):
    """[dynamics]: what a lumped model needs in addition to the parts."""

    damping_ratio: Annotated[float, Field(ge=0.0, lt=1.0)] | None = Field(
        default=None, description="Damping ratio of every vibration mode."
    )


def _require_at_most_one_planetary(
    entries: tuple[PlanetaryEntry, ...],
) -> tuple[PlanetaryEntry, ...]:
    if len(entries) > 1:
        raise ValueError(f"{len(entries)} planetary sets; one is allowed")
    return entries


class Document(Keys):
    """A whole gear set file."""

    name: Name = Field(description="Name of the gear set.")
    description: str = Field(default="", description="A line about the gear set.")
    inferences: Entries[str] = Field(
        default=(),
        description="Values that the source lacks, and how they were chosen.",
    )
    plane: Plane | None = Field(
        default=None,
        description="State of the finite elements, stress, strain or width. [default: "
        "width, teeth of their true width]",
    )
    defaults: GearDefaults = Field(
        default=GearDefaults(), description="Keys that gears share."
    )
    planetary: Annotated[
        Entries[PlanetaryEntry], AfterValidator(_require_at_most_one_planetary)
    ] = Field(default=(), description="Planets on a carrier between a sun and a ring.")
    gear: Annotated[Entries[GearEntry], Field(min_length=1)] = Field(
        description="The gears."
    )
    mesh: Annotated[Entries[MeshEntry], Field(min_length=1)] = Field(
        description="Pairs of gears in mesh."
    )
    shaft: Entries[ShaftEntry] = Field(default=(), description="Gears on one axis.")
    housing: HousingEntry | None = Field(
        default=None, description="Housing that holds the bearings of shafts."
    )
    load: LoadEntry | None = Field(default=None, description="Torque cases.")
    dynamics: DynamicsEntry = Field(
        default=DynamicsEntry(), description="Damping of lumped models."
    )

    @model_validator(mode="after")
    def _unique(self) -> Document:
        for name, count in Counter(gear.name for gear in self.gear).items():
            if count > 1:
                raise ValueError(f'gear "{name}": the name is used {count} times')
        pairs = Counter(frozenset((mesh.driver, mesh.driven)) for mesh in self.mesh)
        for mesh in self.mesh:
            if pairs[frozenset((mesh.driver, mesh.driven))] > 1:
                raise ValueError(f"{mesh.label}: the two gears mesh more than once")
        return self

    @property
    def gear_names(self) -> list[str]:
        return [gear.name for gear in self.gear]


def with_defaults(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables with [defaults] filled into every gear that lacks the key.

    A gear's own key replaces those shared ones that say the same thing, such as the
    tip under another key. Keys of bores are not for internal gears, nor keys of rings
    for external ones.
    """
    shared, gears = tables.get("defaults"), tables.get("gear")
    if not isinstance(shared, dict) or not isinstance(gears, list):
        return tables
    return tables | {"gear": [_filled(gear, shared) for gear in gears]}


def _filled(gear: Any, shared: dict[str, Any]) -> Any:
    if not isinstance(gear, dict):
        return gear
    replaced = {other for key in gear for other in replaced_keys(key)}
    replaced |= set(INTERNAL_LACKS if gear.get("internal") else EXTERNAL_LACKS)
    return {key: value for key, value in shared.items() if key not in replaced} | gear
