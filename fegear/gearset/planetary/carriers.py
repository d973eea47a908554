"""The carrier of a checked file's planetary set, in SI units."""

from __future__ import annotations

import math

from fegear.files.errors import InputError
from fegear.gearset.model import CARRIER, Gear, PlanetCarrier
from fegear.gearset.planetary.assembly import require_assembly
from fegear.gearset.planetary.members import Members
from fegear.gearset.schema import ROLLING_KEYS, Document, PlanetaryEntry


def carrier_of(
    document: Document, gears: tuple[Gear, ...], distances: list[float]
) -> PlanetCarrier | None:
    """The carrier, None without a planetary set.

    Raises InputError where gears and meshes are not those of the set, or where its
    planets do not fit.

    distances : centre distance of every mesh [m]
    """
    if not document.planetary:
        return None
    entry = document.planetary[0]
    _require_set(document, entry)
    _require_no_more(document)
    index = {name: i for i, name in enumerate(document.gear_names)}
    planets = tuple(index[name] for name in entry.planet_names)
    sun, ring = index[entry.sun], index[entry.ring]
    members = members_of(document)
    positions = [_position(document, entry, name) for name in entry.planet_names]
    if max(distances) - min(distances) > 1e-9 * max(distances):
        raise InputError("planetary: center_distance_mm of all meshes must be the same")
    tip_radius = max(gears[planet].geometry.tip_radius for planet in planets)
    require_assembly(members, positions, distances[0], tip_radius)
    kx, ky = entry.carrier_bearing_kx_N_per_m, entry.carrier_bearing_ky_N_per_m
    mass = default_mass(gears[planets[0]], distances[0])
    inertia = 0.5 * mass * distances[0] ** 2
    torques = document.load.torques_Nm if document.load else ()
    return PlanetCarrier(
        members=members,
        sun=sun,
        planets=planets,
        ring=ring,
        radius=distances[0],
        angles=tuple(map(math.radians, positions)),
        inertia=entry.carrier_inertia_kg_m2 or inertia,
        mass=entry.carrier_mass_kg or mass,
        bearing_stiffness=None if kx is None or ky is None else (kx, ky),
        coupling_stiffness=entry.carrier_coupling_stiffness_Nm_per_rad,
        torques=torques,
        position_errors=tuple(1e-6 * error for error in entry.position_errors_um or ()),
    )


def _require_no_more(document: Document) -> None:
    """Require that no key contradicts the set, or is not for gears of one."""
    for mesh in document.mesh:
        if mesh.phase is not None:
            raise InputError(
                f"{mesh.label}: phase = {mesh.phase:g}; phases of a planetary set "
                "follow from its teeth and positions, leave it out"
            )
    for gear in document.gear:
        for key in ROLLING_KEYS:
            if getattr(gear, key) is not None:
                raise InputError(
                    f'gear "{gear.name}": {key}; gears of planetary sets have linear '
                    "bearings, bearing_kx_N_per_m and bearing_ky_N_per_m are allowed"
                )


def members_of(document: Document) -> Members:
    """Members of the first planetary set."""
    entry = document.planetary[0]
    teeth = {gear.name: gear.teeth for gear in document.gear}
    return Members(
        sun=teeth[entry.sun],
        ring=teeth[entry.ring],
        planets=entry.planets,
        input=entry.input,
        output=entry.output,
        held=entry.held,
    )


def input_name(document: Document) -> str:
    """Name of the gear that is the input member, or of the carrier."""
    entry = document.planetary[0]
    names = {"sun": entry.sun, "carrier": CARRIER, "ring": entry.ring}
    return names[entry.input]


def default_mass(planet: Gear, radius: float) -> float:
    """Mass of two disks to the planets' axes, together as thick as a planet [kg]."""
    return planet.density * planet.face_width * math.pi * radius**2


def carrier_inferences(document: Document) -> list[str]:
    """A sentence on the carrier's body where it is not given."""
    return [
        f"{key}: of two disks that reach to the axes of the planets, together as thick "
        "as a planet is wide"
        for entry in document.planetary
        for key in ("carrier_inertia_kg_m2", "carrier_mass_kg")
        if getattr(entry, key) is None
    ]


def _require_set(document: Document, entry: PlanetaryEntry) -> None:
    """Require gears and meshes of this set and no others."""
    names = {entry.sun, entry.ring, *entry.planet_names}
    if CARRIER in document.gear_names:
        raise InputError(f'gear "{CARRIER}": the name is that of the carrier')
    if set(document.gear_names) != names or len(document.mesh) != 2 * entry.planets:
        raise InputError(
            "planetary: gears and meshes are not those of its planets; a file with "
            f'planets of its own has gears "{entry.planet}-1" to '
            f'"{entry.planet}-{entry.planets}" and two meshes for each'
        )
    if document.shaft:
        raise InputError("planetary: [[shaft]] is not allowed beside it")
    rings = {gear.name for gear in document.gear if gear.internal}
    for name in (entry.sun, *entry.planet_names, entry.ring):
        if (name in rings) != (name == entry.ring):
            wrong = "must be internal" if name == entry.ring else "must not be internal"
            raise InputError(f'planetary: gear "{name}" {wrong}')


def _position(document: Document, entry: PlanetaryEntry, planet: str) -> float:
    """Direction of a planet from the axis [deg], by the centre line of its meshes."""
    for mesh in document.mesh:
        line = mesh.center_line_deg
        if line is None:
            raise InputError(f"{mesh.label}: center_line_deg is needed")
        if (mesh.driver, mesh.driven) in ((entry.sun, planet), (entry.ring, planet)):
            return line
    raise InputError(f'planetary: gear "{planet}" has no mesh with sun or ring')
