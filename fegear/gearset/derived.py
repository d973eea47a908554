"""What follows from a gear set: the figures that `fegear show` prints.

Units are in the names, as on the screen and in JSON.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fegear.gearset.inertia import inertia_of, mass_of
from fegear.gearset.model import Gear, GearSet, Mesh, Relief
from fegear.gearset.phases import geometric_phase, mesh_phases
from fegear.gearset.pitch_errors import tooth_pair_errors
from fegear.gearset.zones import Zones, zones
from meshes.gear import SpurGear

DERIVED = "derived"  # of the body between bore and tooth outline


@dataclass(frozen=True, kw_only=True)
class GearFigures:
    """A gear on its own; inertia and mass are given or derived, as stated."""

    name: str
    teeth: int
    module_mm: float
    pressure_angle_deg: float
    profile_shift: float
    reference_radius_mm: float
    base_radius_mm: float
    tip_radius_mm: float
    root_radius_mm: float
    form_radius_mm: float
    hub_radius_mm: float
    rack_tip_radius_mm: float
    tip_thickness_mm: float
    form_roll_angle_deg: float
    tip_roll_angle_deg: float
    face_width_mm: float
    young_modulus_GPa: float
    poisson_ratio: float
    density_kg_per_m3: float
    inertia_kg_m2: float
    inertia_origin: str
    mass_kg: float
    mass_origin: str
    bearing_kx_N_per_m: float | None
    bearing_ky_N_per_m: float | None
    coupling_stiffness_Nm_per_rad: float
    largest_pitch_error_um: float


@dataclass(frozen=True, kw_only=True)
class ReliefFigures:
    """Where a relief begins; its length is the roll angle over the pitch angle."""

    magnitude_um: float
    start_roll_angle_deg: float
    length_pitches: float
    shape: str


@dataclass(frozen=True, kw_only=True)
class FlankFigures:
    """One gear's flank in one mesh.

    sap : start of the active profile; lpstc, hpstc : lowest and highest point of
        single-tooth contact, None where two pairs always touch
    """

    gear: str
    role: str
    sap_radius_mm: float
    form_roll_angle_deg: float
    sap_roll_angle_deg: float
    lpstc_roll_angle_deg: float | None
    hpstc_roll_angle_deg: float | None
    tip_roll_angle_deg: float
    tip_root_clearance_mm: float
    tip_relief: ReliefFigures | None
    root_relief: ReliefFigures | None


@dataclass(frozen=True, kw_only=True)
class MeshFigures:
    """Two gears in mesh; approach and recess lie before and after the pitch point.

    normal_backlash_um : of the teeth; backlash_um : for lumped models
    geometric_phase_pitches : phase that teeth and centre lines ask for, whatever is
        given; None where no earlier mesh shares a gear with this one
    """

    driver: str
    driven: str
    ratio: float
    center_distance_mm: float
    operating_pressure_angle_deg: float
    contact_ratio: float
    base_pitch_mm: float
    normal_backlash_um: float
    backlash_um: float
    approach_pitches: float
    recess_pitches: float
    center_line_deg: float | None
    phase_pitches: float
    phase_origin: str
    geometric_phase_pitches: float | None
    mean_stiffness_N_per_m: float | None
    stiffness_variation: float | None
    load_share: float | None
    driver_torques_Nm: tuple[float, ...]
    pitch_errors_repeat_pitches: int | None
    flanks: tuple[FlankFigures, FlankFigures]


@dataclass(frozen=True, kw_only=True)
class ShaftFigures:
    """Gears on one axis; stiffness between successive ones, None for rigid."""

    gears: tuple[str, ...]
    stiffness_Nm_per_rad: float | None


@dataclass(frozen=True, kw_only=True)
class GearSetFigures:
    """All figures of a gear set."""

    name: str
    description: str
    gears: tuple[GearFigures, ...]
    meshes: tuple[MeshFigures, ...]
    shafts: tuple[ShaftFigures, ...]
    damping_ratio: float | None
    inferences: tuple[str, ...]


def gear_set_figures(gear_set: GearSet) -> GearSetFigures:
    names = [gear.name for gear in gear_set.gears]
    return GearSetFigures(
        name=gear_set.name,
        description=gear_set.description,
        gears=tuple(map(gear_figures, gear_set.gears)),
        meshes=tuple(mesh_figures(gear_set, n) for n in range(len(gear_set.meshes))),
        shafts=tuple(
            ShaftFigures(
                gears=tuple(names[index] for index in shaft.gears),
                stiffness_Nm_per_rad=shaft.stiffness,
            )
            for shaft in gear_set.shafts
        ),
        damping_ratio=gear_set.damping_ratio,
        inferences=gear_set.inferences,
    )


def gear_figures(gear: Gear) -> GearFigures:
    teeth = gear.geometry
    kx, ky = gear.bearing_stiffness or (None, None)
    return GearFigures(
        name=gear.name,
        teeth=teeth.teeth,
        module_mm=1e3 * teeth.module,
        pressure_angle_deg=math.degrees(teeth.pressure_angle),
        profile_shift=teeth.profile_shift,
        reference_radius_mm=1e3 * teeth.reference_radius,
        base_radius_mm=1e3 * teeth.base_radius,
        tip_radius_mm=1e3 * teeth.tip_radius,
        root_radius_mm=1e3 * teeth.root_radius,
        form_radius_mm=1e3 * teeth.form_radius,
        hub_radius_mm=1e3 * teeth.hub_radius,
        rack_tip_radius_mm=1e3 * teeth.rack_tip_radius,
        tip_thickness_mm=1e3 * teeth.tip_thickness,
        form_roll_angle_deg=roll_angle_deg(teeth, teeth.form_roll_length),
        tip_roll_angle_deg=roll_angle_deg(teeth, teeth.tip_roll_length),
        face_width_mm=1e3 * gear.face_width,
        young_modulus_GPa=1e-9 * gear.young_modulus,
        poisson_ratio=gear.poisson_ratio,
        density_kg_per_m3=gear.density,
        inertia_kg_m2=inertia_of(gear),
        inertia_origin=DERIVED if gear.inertia is None else "given",
        mass_kg=mass_of(gear),
        mass_origin=DERIVED if gear.mass is None else "given",
        bearing_kx_N_per_m=kx,
        bearing_ky_N_per_m=ky,
        coupling_stiffness_Nm_per_rad=gear.coupling_stiffness,
        largest_pitch_error_um=1e6 * max(map(abs, gear.pitch_errors), default=0.0),
    )


def roll_angle_deg(gear: SpurGear, roll_length: float) -> float:
    """Roll angle [deg] at a roll length [m]."""
    return math.degrees(roll_length / gear.base_radius)


def mesh_figures(gear_set: GearSet, number: int) -> MeshFigures:
    mesh, gears = gear_set.meshes[number], gear_set.gears
    pair, line = mesh.pair, mesh.center_line
    phase = mesh_phases(gear_set)[number]
    return MeshFigures(
        driver=gears[mesh.driver].name,
        driven=gears[mesh.driven].name,
        ratio=pair.driven.teeth / pair.driver.teeth,
        center_distance_mm=1e3 * pair.center_distance,
        operating_pressure_angle_deg=math.degrees(pair.operating_pressure_angle),
        contact_ratio=pair.contact_ratio,
        base_pitch_mm=1e3 * pair.base_pitch,
        normal_backlash_um=1e6 * pair.backlash,
        backlash_um=1e6 * mesh.backlash,
        approach_pitches=(pair.pitch_point - pair.path_start) / pair.base_pitch,
        recess_pitches=(pair.path_end - pair.pitch_point) / pair.base_pitch,
        center_line_deg=None if line is None else math.degrees(line),
        phase_pitches=phase.value,
        phase_origin=phase.origin,
        geometric_phase_pitches=geometric_phase(gear_set, number),
        mean_stiffness_N_per_m=mesh.mean_stiffness,
        stiffness_variation=mesh.stiffness_variation,
        load_share=mesh.load_share,
        driver_torques_Nm=mesh.torques,
        pitch_errors_repeat_pitches=tooth_pair_errors(gear_set, number).size or None,
        flanks=(
            _flank_figures(gear_set, mesh, "driver"),
            _flank_figures(gear_set, mesh, "driven"),
        ),
    )


def _flank_figures(gear_set: GearSet, mesh: Mesh, role: str) -> FlankFigures:
    flank, pair = zones(mesh.pair, role), mesh.pair
    driving = role == "driver"
    index, mate = (mesh.driver, pair.driven) if driving else (mesh.driven, pair.driver)
    tip, root = (
        (mesh.driver_tip_relief, mesh.driver_root_relief)
        if driving
        else (mesh.driven_tip_relief, mesh.driven_root_relief)
    )
    gear = flank.gear
    single = flank.low <= flank.high
    clearance = pair.center_distance - gear.tip_radius - mate.root_radius
    return FlankFigures(
        gear=gear_set.gears[index].name,
        role=role,
        sap_radius_mm=1e3 * math.hypot(gear.base_radius, flank.start),
        form_roll_angle_deg=flank.roll_angle_deg(gear.form_roll_length),
        sap_roll_angle_deg=flank.roll_angle_deg(flank.start),
        lpstc_roll_angle_deg=flank.roll_angle_deg(flank.low) if single else None,
        hpstc_roll_angle_deg=flank.roll_angle_deg(flank.high) if single else None,
        tip_roll_angle_deg=flank.roll_angle_deg(flank.tip),
        tip_root_clearance_mm=1e3 * clearance,
        tip_relief=_relief_figures(tip, flank, flank.tip),
        root_relief=_relief_figures(root, flank, flank.start),
    )


def _relief_figures(
    relief: Relief | None, flank: Zones, end: float
) -> ReliefFigures | None:
    """A relief that grows from its start to roll length `end` [m]."""
    if relief is None:
        return None
    return ReliefFigures(
        magnitude_um=1e6 * relief.magnitude,
        start_roll_angle_deg=flank.roll_angle_deg(relief.start_roll_length),
        length_pitches=abs(end - relief.start_roll_length) / flank.gear.base_pitch,
        shape=relief.shape,
    )
