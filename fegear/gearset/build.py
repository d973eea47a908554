"""From a checked gear set file to frozen values in SI units."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from fegear.files.errors import InputError, nearest
from fegear.gearset.agreement import with_common_values
from fegear.gearset.bearing_keys import rolling_bearing
from fegear.gearset.faults.building import faults_of
from fegear.gearset.faults.checks import require_running
from fegear.gearset.faults.keys import is_uneven
from fegear.gearset.helix import hand_inferences, hands
from fegear.gearset.housing_keys import housing_file
from fegear.gearset.leads import leads_by_key, misalignment, require_faces
from fegear.gearset.materials import NamedMaterial, materials
from fegear.gearset.model import Gear, GearSet, Mesh, Shaft
from fegear.gearset.modifications import FlankModifications, FlankProfile, Relief
from fegear.gearset.pitch_errors import require_room
from fegear.gearset.planes import DEFAULT_PLANE
from fegear.gearset.planetary.carriers import carrier_inferences, carrier_of
from fegear.gearset.problems import shown
from fegear.gearset.profiles import flank_profile
from fegear.gearset.refusals import Key, KeyOf, Refusal, build_or_refuse, in_unit
from fegear.gearset.rounding import rounding_of_backlash
from fegear.gearset.schema import MATERIAL_KEYS, Document, GearEntry, MeshEntry
from fegear.gearset.shafts import shaft_body
from fegear.gearset.teeth import Blank, Tip, blank_of
from fegear.gearset.tips import CONTACT_RATIO_TOLERANCE, Spacing, find_tips, spacing
from fegear.gearset.topographies import topographies_by_key
from fegear.gearset.torques import mesh_torques, torque_inferences
from fegear.gearset.torsion import require_outside_torque
from fegear.gearset.zones import relief
from lumped.common.units import MM, UM
from meshes import GearPair, GeometryError, SpurGear
from meshes.gear import floored
from meshes.pairing import BACKLASH_RTOL


def build_gear_set(document: Document, folder: Path) -> GearSet:
    """The gear set; raises InputError on the first thing that does not fit.

    folder : where files lie that the document names
    """
    return build_or_refuse(document, lambda changed: _build_gear_set(changed, folder))


def _build_gear_set(document: Document, folder: Path) -> GearSet:
    require_known_gears(document)
    document = with_common_values(document)
    blanks = list(map(blank_of, document.gear, hands(document)))
    index_of_name = {name: i for i, name in enumerate(document.gear_names)}
    spacings = [
        spacing(
            mesh, blanks[index_of_name[mesh.driver]], blanks[index_of_name[mesh.driven]]
        )
        for mesh in document.mesh
    ]
    tips = find_tips(document, spacings)
    geometries = [blank.cut(tip) for blank, tip in zip(blanks, tips, strict=True)]
    torques = mesh_torques(document)
    meshes = [
        _build_mesh(
            document, number, mesh_spacing, tips, geometries, torques[number], folder
        )
        for number, mesh_spacing in enumerate(spacings)
    ]
    gears = tuple(
        replace(
            _build_gear(blank, gear),
            plane=document.plane or DEFAULT_PLANE,
            faults=faults_of(blank.entry, gear, number, meshes),
        )
        for number, (blank, gear) in enumerate(zip(blanks, geometries, strict=True))
    )
    distances = [mesh_spacing.center_distance for mesh_spacing in spacings]
    bodies = [
        shaft_body(shaft, f"shaft {number}")
        for number, shaft in enumerate(document.shaft, 1)
    ]
    gear_set = GearSet(
        name=document.name,
        description=document.description,
        gears=gears,
        meshes=tuple(meshes),
        shafts=tuple(
            Shaft(
                gears=tuple(index_of_name[name] for name in shaft.gears),
                stiffness=shaft.stiffness_Nm_per_rad,
                body=body,
            )
            for shaft, body in zip(document.shaft, bodies, strict=True)
        ),
        damping_ratio=document.dynamics.damping_ratio,
        inferences=(
            *document.inferences,
            *_inferences(blanks, spacings, tips),
            *hand_inferences(document),
            *carrier_inferences(document),
            *torque_inferences(document),
        ),
        carrier=carrier_of(document, gears, distances),
        housing=housing_file(document.housing, bodies, folder),
    )
    require_faces(gear_set)
    require_outside_torque(gear_set)
    require_room(gear_set)
    require_running(gear_set)
    return gear_set


def require_known_gears(document: Document) -> None:
    """Require every named gear to exist, and to be on one shaft at most."""
    names = document.gear_names
    uses = [(mesh.label, "driver", mesh.driver) for mesh in document.mesh]
    uses += [(mesh.label, "driven", mesh.driven) for mesh in document.mesh]
    for number, shaft in enumerate(document.shaft, 1):
        uses += [(f"shaft {number}", "gears", name) for name in shaft.gears]
    if document.load and not document.planetary:
        uses.append(("load", "gear", document.load.gear))
    for where, key, name in uses:
        if name not in names:
            known_names = ", ".join(names)
            raise InputError(
                f'{where}: {key} = "{name}"; no such gear{nearest(name, names)} '
                f"(gears: {known_names})"
            )
    names_on_shafts = [name for shaft in document.shaft for name in shaft.gears]
    for name in names:
        if names_on_shafts.count(name) > 1:
            raise InputError(f'shaft: gears: "{name}" is listed more than once')


def _inferences(
    blanks: list[Blank], spacings: list[Spacing], tips: list[Tip]
) -> list[str]:
    """Sentences on what followed from other keys, or was taken by default."""
    parts_with_inference = [blank.thickness for blank in blanks], spacings, tips
    return [
        part.inference
        for parts in parts_with_inference
        for part in parts
        if part.inference
    ]


def _material_of_gear(entry: GearEntry) -> tuple[str, NamedMaterial]:
    """Name with what differs from it, and the values."""
    named_material = materials()[entry.material]
    stated_values = {
        key: getattr(entry, key)
        for key in MATERIAL_KEYS
        if getattr(entry, key) not in (None, getattr(named_material, key))
    }
    if not stated_values:
        return entry.material, named_material
    is_named = "material" in entry.model_fields_set
    name = (
        f"{entry.material}, {' and '.join(stated_values)} as given"
        if is_named
        else "as given"
    )
    return name, replace(named_material, **stated_values)


def _build_gear(blank: Blank, teeth: SpurGear) -> Gear:
    entry = blank.entry
    name, material = _material_of_gear(entry)
    kx, ky = entry.bearing_kx_N_per_m, entry.bearing_ky_N_per_m
    rolling = rolling_bearing(entry.name, entry.ball_bearing, entry.roller_bearing)
    return Gear(
        name=entry.name,
        geometry=teeth,
        face_width=entry.face_width_mm * MM,
        material=name,
        thickness_origin=blank.thickness.origin,
        young_modulus=material.young_modulus_GPa * 1e9,
        poisson_ratio=material.poisson_ratio,
        density=material.density_kg_per_m3,
        inertia=entry.inertia_kg_m2,
        mass=entry.mass_kg,
        pitch_errors=tuple(error * UM for error in entry.pitch_errors_um or ()),
        bearing_stiffness=None if kx is None or ky is None else (kx, ky),
        rolling_bearing=rolling,
        coupling_stiffness=entry.coupling_stiffness_Nm_per_rad,
        groove=(entry.gap_mm or 0.0) * MM,
    )


def _build_mesh(
    document: Document,
    number: int,
    mesh_spacing: Spacing,
    tips: list[Tip],
    geometries: list[SpurGear],
    torques: tuple[float, ...],
    folder: Path,
) -> Mesh:
    entry, names = document.mesh[number], document.gear_names
    driver, driven = names.index(entry.driver), names.index(entry.driven)
    pair = _build_pair(
        entry,
        (geometries[driver], geometries[driven]),
        mesh_spacing,
        (tips[driver], tips[driven]),
    )
    width, mate_width = (document.gear[i].face_width_mm for i in (driver, driven))
    widths = width * MM, mate_width * MM
    flanks = _flanks_by_field(entry, pair, widths, folder)
    return Mesh(
        driver=driver,
        driven=driven,
        pair=pair,
        driver_flank=flanks["driver_flank"],
        driven_flank=flanks["driven_flank"],
        torques=torques,
        phase=_phase(entry, is_first_mesh=number == 0),
        center_line=_center_line(entry),
        backlash=_backlash(entry, pair),
        misalignment=misalignment(entry),
        offset=entry.offset_mm * MM,
        has_uneven_damage=any(
            is_uneven(document.gear[index]) for index in (driver, driven)
        ),
        mean_stiffness=entry.mean_stiffness_N_per_m,
        stiffness_variation=entry.stiffness_variation,
        load_share=entry.load_share,
    )


def _center_line(entry: MeshEntry) -> float | None:
    """[rad], None where the file leaves the centres in a row."""
    angle_deg = entry.center_line_deg
    return None if angle_deg is None else math.radians(angle_deg)


def _backlash(entry: MeshEntry, pair: GearPair) -> float:
    """Backlash as given, otherwise that of the teeth without its round-off [m]."""
    if entry.backlash_um is not None:
        return entry.backlash_um * UM
    return pair.backlash if pair.backlash > BACKLASH_RTOL * pair.base_pitch else 0.0


def _phase(entry: MeshEntry, is_first_mesh: bool) -> float | None:
    if not is_first_mesh:
        return entry.phase
    if entry.phase:
        raise InputError(
            f"{entry.label}: phase = {shown(entry.phase)}; the first mesh is the "
            "reference of all phases, 0 or nothing is allowed"
        )
    return 0.0


def _build_pair(
    entry: MeshEntry,
    gears: tuple[SpurGear, SpurGear],
    mesh_spacing: Spacing,
    tips: tuple[Tip, Tip],
) -> GearPair:
    try:
        rounding = rounding_of_backlash(entry, mesh_spacing.one, mesh_spacing.two)
        pair = GearPair(*gears, mesh_spacing.center_distance, rounding)
    except GeometryError as error:
        raise _refusal_of_pair(entry, error, tips, mesh_spacing) from None
    ratio = entry.contact_ratio
    if ratio is not None and ratio - pair.contact_ratio > CONTACT_RATIO_TOLERANCE:
        raise InputError(
            f"{entry.label}: contact_ratio = {shown(ratio)}; undercut leaves "
            f"{floored(pair.contact_ratio)}"
        )
    return pair


def _refusal_of_pair(
    entry: MeshEntry, error: GeometryError, tips: tuple[Tip, Tip], mesh_spacing: Spacing
) -> InputError:
    if error.field == "tip_radius":
        is_driver = error.role == "driver"
        name = entry.driver if is_driver else entry.driven
        tip = tips[0 if is_driver else 1]
        where = f'{entry.label}: {tip.origin} for gear "{name}"'
        return tip.refusal(where, error)
    name = entry.spacing_key
    stated_spacing = f"{entry.label}: {name} = {shown(getattr(entry, name))}"
    if mesh_spacing.inference:
        stated_spacing = mesh_spacing.inference
    if error.bound is None:
        return InputError(f"{stated_spacing}; {error.message}")
    key = Key("mesh", entry.label, (name,))
    if name == "center_distance_mm":
        return Refusal(key, stated_spacing, in_unit(error.bound, MM), "mm")
    base_radius_sum = abs(mesh_spacing.one.base_radius + mesh_spacing.two.base_radius)

    def angle_deg(distance: float) -> float:
        return math.degrees(math.acos(base_radius_sum / distance))

    return Refusal(key, stated_spacing, error.bound.mapped(angle_deg), "deg")


def _reliefs_by_key(entry: MeshEntry, pair: GearPair) -> dict[str, Relief | None]:
    """All four reliefs of a mesh by their keys."""
    reliefs: dict[str, Relief | None] = {}
    for role in ("driver", "driven"):
        for tip_or_root in ("tip", "root"):
            shared_key, name = f"{tip_or_root}_relief", f"{role}_{tip_or_root}_relief"
            key = name if getattr(entry, name) else shared_key
            key_of_relief = _key_of_modification(entry, key, role)
            reliefs[name] = relief(
                getattr(entry, key), pair, role, tip_or_root, key_of_relief
            )
    return reliefs


def _flanks_by_field(
    entry: MeshEntry, pair: GearPair, widths: tuple[float, float], folder: Path
) -> dict[str, FlankModifications]:
    """Modifications of both gears of a mesh by their names in `Mesh`.

    widths : face widths of both gears [m]
    """
    reliefs, profiles = (
        _reliefs_by_key(entry, pair),
        _profiles_by_key(entry, pair, folder),
    )
    leads = leads_by_key(entry)
    topographies = topographies_by_key(entry, pair, widths, folder)
    return {
        f"{role}_flank": FlankModifications(
            tip_relief=reliefs[f"{role}_tip_relief"],
            root_relief=reliefs[f"{role}_root_relief"],
            profile=profiles[f"{role}_profile"],
            lead=leads[f"{role}_lead"],
            topography=topographies[f"{role}_topography"],
        )
        for role in ("driver", "driven")
    }


def _profiles_by_key(
    entry: MeshEntry, pair: GearPair, folder: Path
) -> dict[str, FlankProfile | None]:
    """Both profiles of a mesh by their keys."""
    profiles: dict[str, FlankProfile | None] = {}
    for role in ("driver", "driven"):
        name = f"{role}_profile"
        key = name if getattr(entry, name) else "profile"
        key_of_profile = _key_of_modification(entry, key, role)
        profiles[name] = flank_profile(
            getattr(entry, key), pair, role, key_of_profile, folder
        )
    return profiles


def _key_of_modification(entry: MeshEntry, key: str, role: str) -> KeyOf:
    """A table of reliefs or profiles for the gear of a role."""
    gear = f'gear "{getattr(entry, role)}"'
    path = Key("mesh", entry.label, (key,))
    return KeyOf(f"{entry.label}: {key}", path, gear, getattr(entry, key))
