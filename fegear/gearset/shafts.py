"""The shaft that bends, from a checked [[shaft]] table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from fegear.files.errors import InputError
from fegear.gearset.bearing_keys import MountedBearingEntry
from fegear.gearset.materials import materials
from fegear.gearset.problems import shown
from fegear.gearset.schema import ShaftEntry
from fegear.gearset.shaft_bodies import ShaftBearing, ShaftBody, ShaftDisk
from lumped.bearings.mounted import MountedBearing
from lumped.common.units import MM
from meshes.gear import floored

END_RTOL = 1e-9  # of the length, by which round-off may place a part beyond the end


def shaft_body(entry: ShaftEntry, where: str) -> ShaftBody | None:
    """The body of a checked table; InputError for parts that are not on the shaft.

    where : the table in messages
    """
    if entry.lengths_mm is None:
        return None
    lengths, diameters = entry.lengths_mm, entry.diameters_mm or ()
    bores = entry.bores_mm or (0.0,) * len(lengths)
    for number, (diameter, bore) in enumerate(zip(diameters, bores, strict=True), 1):
        if not bore < diameter:
            raise InputError(
                f"{where}: bores_mm entry {number} = {shown(bore)}; must be below "
                f"{shown(diameter)} mm, the diameter"
            )
    length = math.fsum(lengths)
    for key in ("positions_mm", "bearing_positions_mm", "disk_positions_mm"):
        for number, position in enumerate(getattr(entry, key) or (), 1):
            if position > length * (1.0 + END_RTOL):
                raise InputError(
                    f"{where}: {key} entry {number} = {shown(position)}; at most "
                    f"{floored(length)} mm, the length of the shaft"
                )
    material = materials()[entry.material]
    return ShaftBody(
        lengths=_metres(lengths),
        diameters=_metres(diameters),
        bores=_metres(bores),
        gear_positions=_metres(entry.positions_mm or ()),
        young_modulus=material.young_modulus_GPa * 1e9,
        poisson_ratio=material.poisson_ratio,
        density=material.density_kg_per_m3,
        bearings=_bearings(entry, where),
        disks=_disks(entry),
        driven_from=entry.driven_from,
    )


def _metres(lengths_mm: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(length * MM for length in lengths_mm)


def _bearings(entry: ShaftEntry, where: str) -> tuple[ShaftBearing, ...]:
    positions = _metres(entry.bearing_positions_mm or ())
    if entry.rolling_bearings:
        return tuple(
            ShaftBearing(
                position=position, stiffness=(0.0, 0.0, 0.0, 0.0), mounted=mounted
            )
            for position, mounted in zip(
                positions, _mounted(entry.rolling_bearings, where), strict=True
            )
        )
    none = (0.0,) * len(positions)
    columns = (
        positions,
        entry.bearing_kx_N_per_m or none,
        entry.bearing_kxy_N_per_m or none,
        entry.bearing_kyx_N_per_m or none,
        entry.bearing_ky_N_per_m or none,
        entry.bearing_kz_N_per_m or (None,) * len(positions),
        entry.bearing_tilt_stiffness_Nm_per_rad or none,
        entry.bearing_cx_Ns_per_m or none,
        entry.bearing_cy_Ns_per_m or none,
    )
    return tuple(
        ShaftBearing(
            position=z,
            stiffness=(kx, kxy, kyx, ky),
            axial_stiffness=kz,
            tilt_stiffness=tilt,
            damping=(cx, cy),
        )
        for z, kx, kxy, kyx, ky, kz, tilt, cx, cy in zip(*columns, strict=True)
    )


def _mounted(
    entries: Sequence[MountedBearingEntry], where: str
) -> Iterator[MountedBearing]:
    for number, entry in enumerate(entries, 1):
        try:
            yield entry.build()
        except ValueError as error:
            raise InputError(
                f"{where}: rolling_bearings entry {number}: {error}"
            ) from None


def _disks(entry: ShaftEntry) -> tuple[ShaftDisk, ...]:
    polar = entry.disk_inertias_kg_m2 or ()
    transverse = entry.disk_transverse_inertias_kg_m2
    columns = (
        _metres(entry.disk_positions_mm or ()),
        entry.disk_masses_kg or (),
        polar,
        tuple(0.5 * inertia for inertia in polar) if transverse is None else transverse,
    )
    return tuple(
        ShaftDisk(position=z, mass=m, inertia=j, transverse_inertia=transverse)
        for z, m, j, transverse in zip(*columns, strict=True)
    )
