"""What follows from a gear set: the figures that `fegear show` prints.

Plain values, ready for JSON, in the order of the screen; units are in the names.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fegear.commands.show.fault_values import fault_figures
from fegear.commands.show.force_values import force_figures
from fegear.commands.show.planetary_values import planetary_figures
from fegear.gearset.helix import hand_of_gear
from fegear.gearset.inertia import inertia_of, mass_of
from fegear.gearset.leads import width_gap
from fegear.gearset.model import Gear, GearSet, Mesh
from fegear.gearset.modifications import (
    FlankLead,
    FlankProfile,
    FlankTopography,
    Relief,
)
from fegear.gearset.phases import geometric_phase, mesh_phases
from fegear.gearset.pitch_errors import tooth_pair_errors
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.shaft_bodies import ShaftBody
from fegear.gearset.zones import Zones, zones
from meshes import GearPair, SpurGear
from meshes.helical import HelicalGear, HelicalInternalGear
from meshes.internal import InternalGear
from meshes.involute import inverse_involute, involute
from meshes.tooth_thickness import (
    default_pin_diameter,
    default_span_teeth,
    pin_dimension,
    span,
)


def gear_set_figures(gear_set: GearSet) -> dict[str, Any]:
    """All figures of a gear set."""
    gears, meshes = gear_set.gears, range(len(gear_set.meshes))
    return {
        "name": gear_set.name,
        "description": gear_set.description,
        "gears": [gear_figures(gear) for gear in gears],
        "meshes": [mesh_figures(gear_set, number) for number in meshes],
        "shafts": [
            {
                "gears": [gears[index].name for index in shaft.gears],
                "stiffness_Nm_per_rad": shaft.stiffness,
                **_body_figures(shaft.body),
            }
            for shaft in gear_set.shafts
        ],
        "housing": gear_set.housing and gear_set.housing.stated,
        **force_figures(gear_set),
        "planetary": planetary_figures(gear_set),
        "damping_ratio": gear_set.damping_ratio,
        "inferences": list(gear_set.inferences),
        "warnings": list(gear_set_warnings(gear_set)),
    }


def _body_figures(body: ShaftBody | None) -> dict[str, Any]:
    """Figures of a shaft that bends, none where nothing is known of it."""
    if body is None:
        return {}
    sections = zip(body.lengths, body.diameters, body.bores, strict=True)
    volume = math.fsum(
        0.25 * math.pi * length * (diameter**2 - bore**2)
        for length, diameter, bore in sections
    )
    axial = [bearing.axial_stiffness for bearing in body.bearings]
    is_stated = any(stiffness is not None for stiffness in axial)
    rolling = _rolling_figures(body)
    return {
        "length_mm": 1e3 * math.fsum(body.lengths),
        "mass_kg": body.density * volume,
        "bearings": len(body.bearings),
        **({"bearing_kz_N_per_m": axial} if is_stated else {}),
        **({"driven_from": body.driven_from} if body.driven_from else {}),
        **({"rolling_bearings": rolling} if rolling else {}),
    }


def _rolling_figures(body: ShaftBody) -> list[dict[str, Any]]:
    """Figures of the rolling bearings of a shaft."""
    return [
        {
            "position_mm": 1e3 * position,
            f"{mounted.bearing.noun}s": mounted.bearing.elements,
            f"{mounted.bearing.noun}_diameter_mm": 1e3
            * mounted.bearing.element_diameter,
            "pitch_diameter_mm": 1e3 * mounted.bearing.pitch_diameter,
            "radial_gap_um": 1e6 * mounted.bearing.free_gap,
            "contact_stiffness_N_per_m_n": mounted.bearing.coefficient,
            "free_contact_angle_deg": math.degrees(mounted.free_contact_angle),
            "axial_preload_um": 1e6 * mounted.axial_preload,
        }
        for position, mounted in body.mounted_bearings
    ]


def gear_figures(gear: Gear) -> dict[str, Any]:
    """A gear on its own.

    inertia, mass : given, or derived from the body between bore and tooth outline
    """
    teeth = gear.geometry
    kx, ky = gear.bearing_stiffness or (None, None)
    return {
        "name": gear.name,
        "teeth": teeth.teeth,
        **_rack_figures(gear),
        "tooth_thinning_um": 1e6 * teeth.tooth_thinning,
        "internal": teeth.sign < 0,
        "reference_radius_mm": 1e3 * abs(teeth.reference_radius),
        "base_radius_mm": 1e3 * abs(teeth.base_radius),
        "tip_radius_mm": 1e3 * abs(teeth.tip_radius),
        "form_radius_mm": 1e3 * abs(teeth.form_radius),
        "root_radius_mm": 1e3 * abs(teeth.root_radius),
        "hub_radius_mm": 1e3 * abs(teeth.hub_radius),
        **_spring_figures(gear),
        "rack_tip_radius_mm": 1e3 * teeth.rack_tip_radius,
        "tip_thickness_mm": 1e3 * teeth.tip_thickness,
        **_normal_tip_figures(teeth),
        "tooth_thickness_mm": 1e3 * teeth.tooth_thickness,
        **_measured_figures(teeth, gear.helix_width),
        "form_roll_angle_deg": math.degrees(teeth.form_roll_length / teeth.base_radius),
        "tip_roll_angle_deg": math.degrees(teeth.tip_roll_length / teeth.base_radius),
        "face_width_mm": 1e3 * gear.face_width,
        **({"gap_mm": 1e3 * gear.groove} if gear.groove else {}),
        "largest_pitch_error_um": 1e6 * max(map(abs, gear.pitch_errors), default=0.0),
        "inertia_kg_m2": inertia_of(gear),
        "inertia_origin": "derived" if gear.inertia is None else "given",
        "mass_kg": mass_of(gear),
        "mass_origin": "derived" if gear.mass is None else "given",
        "bearing_kx_N_per_m": kx,
        "bearing_ky_N_per_m": ky,
        "coupling_stiffness_Nm_per_rad": gear.coupling_stiffness,
        "material": gear.material,
        "young_modulus_GPa": 1e-9 * gear.young_modulus,
        "poisson_ratio": gear.poisson_ratio,
        "density_kg_per_m3": gear.density,
        "faults": fault_figures(gear) if gear.faults.any else None,
    }


def _rack_figures(gear: Gear) -> dict[str, Any]:
    """The rack in the normal section, and across the axis of helical gears."""
    teeth = gear.geometry
    across = 1e3 * teeth.module, math.degrees(teeth.pressure_angle)
    if not isinstance(teeth, HelicalGear | HelicalInternalGear):
        names = "module_mm", "pressure_angle_deg", "profile_shift"
        return dict(zip(names, (*across, teeth.profile_shift), strict=True))
    normal = math.atan(math.tan(teeth.pressure_angle) * teeth.helix_cosine)
    return {
        "module_mm": 1e3 * teeth.normal_module,
        "pressure_angle_deg": math.degrees(normal),
        "profile_shift": teeth.normal_profile_shift,
        "helix_angle_deg": math.degrees(abs(teeth.helix_angle)),
        "hand": hand_of_gear(gear),
        "base_helix_angle_deg": math.degrees(abs(teeth.base_helix_angle)),
        "transverse_module_mm": across[0],
        "transverse_pressure_angle_deg": across[1],
    }


def _normal_tip_figures(teeth: SpurGear) -> dict[str, float]:
    """Tip thickness of helical teeth in the normal section of the tip cylinder."""
    if not teeth.twist:
        return {}
    cosine = math.cos(math.atan(teeth.twist * teeth.tip_radius))
    return {"normal_tip_thickness_mm": 1e3 * cosine * teeth.tip_thickness}


def _spring_figures(gear: Gear) -> dict[str, float]:
    """Springs that carry a ring, and what they make of it as a rigid body."""
    teeth = gear.geometry
    if not (isinstance(teeth, InternalGear) and teeth.foundation):
        return {}
    springs, width, radius = teeth.foundation, gear.face_width, teeth.outer_radius
    return {
        "rim_radial_stiffness_N_per_mm3": 1e-9 * springs.radial,
        "rim_tangential_stiffness_N_per_mm3": 1e-9 * springs.tangential,
        "rim_translation_stiffness_N_per_m": width * springs.translation(radius),
        "rim_rotation_stiffness_Nm_per_rad": width * springs.rotation(radius),
    }


def _measured_figures(teeth: SpurGear, width: float) -> dict[str, Any]:
    """Return the measures of tooth thickness that a drawing states.

    None where nothing fits.
    """
    number, pin = default_span_teeth(teeth, width), default_pin_diameter(teeth)
    thickness = teeth.tooth_thickness
    return {
        "span_teeth": number,
        "span_mm": None if number is None else 1e3 * span(teeth, thickness, number),
        "pin_diameter_mm": None if pin is None else 1e3 * pin,
        "pin_dimension_mm": pin and 1e3 * pin_dimension(teeth, thickness, pin),
    }


def _center_distance_figures(pair: GearPair) -> dict[str, float]:
    """Sum of profile shifts, that which fits the centre distance, and the distance
    that fits the sum: teeth of full thickness have no backlash."""
    driver, driven = pair.driver, pair.driven
    teeth, alpha = (
        driver.sign * driver.teeth + driven.sign * driven.teeth,
        driver.pressure_angle,
    )
    shifts = driver.profile_shift + driven.profile_shift
    rate = 2.0 * math.tan(alpha) / teeth
    at_distance = (involute(pair.operating_pressure_angle) - involute(alpha)) / rate
    value, bases = (
        involute(alpha) + rate * shifts,
        abs(driver.base_radius + driven.base_radius),
    )
    distance = bases / math.cos(inverse_involute(value)) if value > 0.0 else math.nan
    # shifts of files are in modules of the normal section
    return {
        "profile_shift_sum": shifts / driver.helix_cosine,
        "fitting_profile_shift_sum": at_distance / driver.helix_cosine,
        "fitting_center_distance_mm": 1e3 * distance,
    }


def mesh_figures(gear_set: GearSet, number: int) -> dict[str, Any]:
    """Two gears in mesh; approach and recess lie before and after the pitch point.

    normal_backlash_um : of the teeth; backlash_um : for lumped models
    geometric_phase_pitches : phase that follows from teeth and centre lines, even if
        one is given; None where no earlier mesh shares a gear with this one
    """
    mesh, gears = gear_set.meshes[number], gear_set.gears
    pair, line = mesh.pair, mesh.center_line
    phase = mesh_phases(gear_set)[number]
    helix_cosine = math.cos(pair.driver.base_helix_angle)
    return {
        "driver": gears[mesh.driver].name,
        "driven": gears[mesh.driven].name,
        "ratio": pair.driven.teeth / pair.driver.teeth,
        "center_distance_mm": 1e3 * pair.center_distance,
        "operating_pressure_angle_deg": math.degrees(pair.operating_pressure_angle),
        **_center_distance_figures(pair),
        "contact_ratio": pair.contact_ratio,
        **_face_figures(gear_set, number),
        "base_pitch_mm": 1e3 * pair.base_pitch,
        "normal_backlash_um": 1e6 * pair.backlash * helix_cosine,
        "backlash_um": 1e6 * mesh.backlash,
        "approach_pitches": -pair.path[0],
        "recess_pitches": pair.path[1],
        "phase_pitches": phase.value,
        "phase_origin": phase.origin,
        "geometric_phase_pitches": geometric_phase(gear_set, number),
        "center_line_deg": None if line is None else math.degrees(line),
        "driver_torques_Nm": list(mesh.torques),
        "pitch_errors_repeat_pitches": tooth_pair_errors(gear_set, number).size or None,
        "mean_stiffness_N_per_m": mesh.mean_stiffness,
        "stiffness_variation": mesh.stiffness_variation,
        "load_share": mesh.load_share,
        "flanks": [
            _flank_figures(gears[mesh.driver], mesh, "driver"),
            _flank_figures(gears[mesh.driven], mesh, "driven"),
        ],
    }


def _face_figures(gear_set: GearSet, number: int) -> dict[str, float]:
    """The overlap of helical gears, and what differs over the width of others.

    normal_width_gap : between both flanks along their normal, by leads and misalignment
    """
    mesh, figures = gear_set.meshes[number], {}
    width = gear_set.common_width(number)
    if mesh.is_helical:
        overlap = gear_set.overlap_ratio(number)
        figures["overlap_ratio"] = overlap
        figures["total_contact_ratio"] = mesh.pair.contact_ratio + overlap
    if mesh.misalignment:
        figures["misalignment_um"] = 1e6 * mesh.misalignment
    if any(flank.lead for flank in mesh.flanks) or mesh.misalignment:
        cosine = math.cos(mesh.pair.driver.base_helix_angle)
        gaps = width_gap(gear_set, number, np.array([-0.5, 0.0, 0.5]) * width)
        names = (f"normal_width_gap_{end}_um" for end in ("near", "middle", "far"))
        figures |= zip(names, (1e6 * cosine * gaps).tolist(), strict=True)
    if mesh.offset:
        figures["offset_mm"] = 1e3 * mesh.offset
        figures["common_face_width_mm"] = 1e3 * width
    return figures


def _flank_figures(gear: Gear, mesh: Mesh, role: str) -> dict[str, Any]:
    """One gear's flank in one mesh.

    sap : start of the active profile; lpstc, hpstc : lowest and highest point of
        single-tooth contact, None where two pairs always touch
    """
    flank = zones(mesh.pair, role)
    modified = mesh.driver_flank if role == "driver" else mesh.driven_flank
    teeth = flank.gear
    single = flank.start <= flank.low <= flank.high
    distance = mesh.pair.sign * mesh.pair.center_distance
    clearance = distance - teeth.tip_radius - flank.mate.root_radius
    return {
        "gear": gear.name,
        "role": role,
        "sap_radius_mm": 1e3 * math.hypot(teeth.base_radius, flank.start),
        "form_roll_angle_deg": flank.roll_angle_deg(teeth.form_roll_length),
        "sap_roll_angle_deg": flank.roll_angle_deg(flank.start),
        "lpstc_roll_angle_deg": flank.roll_angle_deg(flank.low) if single else None,
        "hpstc_roll_angle_deg": flank.roll_angle_deg(flank.high) if single else None,
        "tip_roll_angle_deg": flank.roll_angle_deg(flank.tip),
        "tip_root_clearance_mm": 1e3 * clearance,
        "tip_relief": _relief_figures(modified.tip_relief, flank, flank.tip),
        "root_relief": _relief_figures(modified.root_relief, flank, flank.start),
        "profile": _profile_figures(modified.profile, flank),
        "lead": _lead_figures(modified.lead),
        "topography": _topography_figures(modified.topography),
    }


def _relief_figures(
    relief: Relief | None, flank: Zones, end: float
) -> dict[str, Any] | None:
    """A relief that grows from its start to roll length `end` [m].

    Its length is the roll angle over the pitch angle.
    """
    if relief is None:
        return None
    length = abs(end - relief.start_roll_length) / flank.gear.base_pitch
    return {
        "magnitude_um": 1e6 * relief.magnitude,
        "start_roll_angle_deg": flank.roll_angle_deg(relief.start_roll_length),
        "length_pitches": length,
        "shape": relief.shape,
    }


def _lead_figures(lead: FlankLead | None) -> dict[str, float] | None:
    if lead is None:
        return None
    return {
        "crowning_um": 1e6 * lead.crowning,
        "slope_um": 1e6 * lead.slope,
        "end_relief_um": 1e6 * lead.end_relief,
        "end_relief_length_mm": 1e3 * lead.end_length,
    }


def _topography_figures(
    topography: FlankTopography | None,
) -> dict[str, float] | None:
    """Number of points and range of depths of a topography."""
    if topography is None:
        return None
    depths = np.array(topography.depths)
    return {
        "roll_angles": len(topography.roll_lengths),
        "places": len(topography.places),
        "least_depth_um": 1e6 * float(depths.min()),
        "largest_depth_um": 1e6 * float(depths.max()),
    }


def _profile_figures(
    profile: FlankProfile | None, flank: Zones
) -> dict[str, Any] | None:
    """Deviations of the active profile, measured ones by their number and range."""
    if profile is None:
        return None
    figures: dict[str, Any] = {
        "crowning_um": 1e6 * profile.crowning,
        "slope_um": 1e6 * profile.slope,
        "measured_points": len(profile.roll_lengths),
    }
    if profile.is_measured:
        figures |= {
            "measured_from_roll_angle_deg": flank.roll_angle_deg(
                profile.roll_lengths[0]
            ),
            "measured_to_roll_angle_deg": flank.roll_angle_deg(
                profile.roll_lengths[-1]
            ),
            "least_deviation_um": 1e6 * min(profile.deviations),
            "largest_deviation_um": 1e6 * max(profile.deviations),
            "interpolation": profile.interpolation,
        }
    return figures
