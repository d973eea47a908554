"""Plausibility checks of results.

The equations are linear in the teeth and know no strength, so they answer any load.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from fegear.files.codes import with_code
from fegear.gearset.modifications import named_reliefs
from fegear.gearset.pitch_errors import tooth_pair_errors
from meshes.pairing import tip_clearance

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet, Mesh
    from fegear.statics.mesh_result import StaticsResult
    from meshes import GearPair

MAX_DEFLECTION = 0.1  # of a module: no tooth is still one beyond it
MAX_STEEL_PRESSURE = 1.5e9  # Pa, contact pressure that case-hardened gears endure
MAX_PRESSURE = 10.0 * MAX_STEEL_PRESSURE
# Ra of superfinished flanks [m], the smoothest that gears have; what is below it is
# carried by asperities, and no tool makes it
MIN_ROUGHNESS = 0.05e-6
MIN_RELIEF_SHARE = 0.01  # of the deflection, which a relief changes
# relative, of what two laws of mechanics give for the same quantity
MAX_IMBALANCE = 1e-3
MAX_ERROR_ESTIMATE = 1e-2  # relative, of what two meshes give for it
MAX_SLICE_CHANGE = 0.03  # relative, of the largest load per length by fewer slices


def plausibility_warnings(
    where: str,
    module: float,
    *,
    deflection: float = 0.0,
    pressure: float = 0.0,
    backlash: float = inf,
    back_side: float = 0.0,
) -> Iterator[str]:
    """A line for each reason why a result of a mesh cannot be physical.

    Of its largest values; what is not known is left out.

    where : such as `mesh 1 at 100 N m`
    module : [m]; deflection : of either sign [m]; pressure : [Pa]
    backlash : [m]; back_side : part of the time with contact of the back flanks
    """
    limit = MAX_DEFLECTION * module
    if abs(deflection) > limit:
        yield with_code(
            "W01",
            f"{where}: deflection {1e6 * abs(deflection):.4g} um exceeds a tenth of "
            f"the module, {1e6 * limit:.4g} um; the result cannot be physical",
        )
    if pressure > MAX_PRESSURE:
        yield with_code(
            "W02",
            f"{where}: contact pressure {1e-6 * pressure:.4g} MPa "
            f"exceeds {1e-6 * MAX_PRESSURE:.4g} MPa, ten times what steel endures; the "
            "result cannot be physical",
        )
    if backlash == 0.0 and back_side > 0.0:
        yield with_code(
            "W03",
            f"{where}: without backlash the back flanks touch for "
            f"{100.0 * back_side:.3g} % of the time and the teeth jam; set "
            "backlash_um, or center_distance_mm and tooth_thinning_um",
        )


def check_warnings(
    code: str, where: str, quantity: str, off: float, allowed: float = MAX_IMBALANCE
) -> Iterator[str]:
    """A line where a self-check does not hold.

    code : of the warning; quantity : is compared, in the plural
    off : its largest deviation, relative
    """
    if not abs(off) <= allowed:  # not a number does not hold either
        yield with_code(
            code,
            f"{where}: {quantity} are off by {abs(off):.2g}, more than {allowed:.2g}; "
            "the result cannot be trusted",
        )


def unit_warnings(solved: StaticsResult) -> Iterator[str]:
    """A line for each relief or load of a mesh table that seems to have a wrong unit.

    By the least and the largest deflection of the table.
    """
    where, cycle = f"mesh {solved.mesh}", solved.cycle
    deflection = np.abs(cycle.ste - cycle.no_load).mean(axis=1)
    least, largest = float(deflection.min()), float(deflection.max())
    if largest < MIN_ROUGHNESS:
        yield with_code(
            "W54",
            f"{where}: mean deflection {1e6 * largest:.2g} um at "
            f"{np.abs(cycle.torque).max():g} N m is below {1e6 * MIN_ROUGHNESS:g} um, "
            "the roughness of the smoothest flanks; the unit of the torque is N m",
        )
    limit = MAX_DEFLECTION * solved.problem.pair.driver.module
    for key, relief in named_reliefs(solved.problem.flanks):
        stated = f"{where}: {key}.magnitude_um = {1e6 * relief.magnitude:.6g}"
        if relief.magnitude > limit:
            pairs = (cycle.load[np.abs(cycle.torque).argmax()] != 0.0).sum(axis=-1)
            yield with_code(
                "W52",
                f"{stated} exceeds a tenth of the module, {1e6 * limit:.4g} um, which "
                f"no teeth deflect; under the largest torque {pairs.mean():.3g} pairs "
                "are in contact on average",
            )
        elif relief.magnitude < min(MIN_ROUGHNESS, MIN_RELIEF_SHARE * least):
            yield with_code(
                "W53",
                f"{stated} is {relief.magnitude / least:.1g} of the mean deflection, "
                f"{1e6 * least:.3g} um, and below the roughness of flanks; it changes "
                "nothing",
            )


def tip_warnings(
    number: int, torque: float, pair: GearPair, deflection: float
) -> Iterator[str]:
    """A line for each undercut gear whose edge the mate's tip meets under load.

    number : of the mesh, from 1; torque : on its driver [N m]
    deflection : largest transmission error of the loaded side [m]
    """
    where = f"mesh {number} at {torque:g} N m"
    for role, gear, mate in (
        ("driver", pair.driver, pair.driven),
        ("driven gear", pair.driven, pair.driver),
    ):
        clearance = tip_clearance(gear, mate, pair.center_distance)
        if not (gear.is_undercut and clearance < deflection):
            continue
        yield with_code(
            "W36",
            f"{where}: the mate's tip passes the edge of the undercut {role} "
            f"({gear.teeth} teeth) at a clearance of {1e6 * clearance:.3g} um, which "
            f"the transmission error of {1e6 * deflection:.3g} um closes",
        )


def motion_warnings(
    gear_set: GearSet,
    where: str,
    dte_peak: Iterable[float],
    back_side: Iterable[float],
) -> Iterator[str]:
    """`mesh_warnings` of largest dynamic transmission errors [m].

    What deviations of the gears add to them without load is no deflection.
    """
    deflections = [
        max(0.0, abs(peak) - kinematic_error(gear_set, number))
        for number, peak in enumerate(dte_peak)
    ]
    yield from mesh_warnings(gear_set.meshes, where, deflections, back_side)


def kinematic_error(gear_set: GearSet, number: int) -> float:
    """Bound of the transmission error of a mesh without load [m].

    number : of the mesh, from 0

    By eccentricity, pitch errors and, in a planetary set, errors of the pins. Where
    teeth are missing a gear flies, by less than half a base pitch.
    """
    mesh, carrier = gear_set.meshes[number], gear_set.carrier
    eccentricity = sum(gear_set.gears[gear].faults.eccentricity for gear in mesh.gears)
    pitch = np.abs(tooth_pair_errors(gear_set, number)).max(initial=0.0)
    pins = max(map(abs, carrier.position_errors), default=0.0) if carrier else 0.0
    is_missing = any(gear_set.gears[gear].faults.missing for gear in mesh.gears)
    flight = 0.5 * mesh.pair.base_pitch if is_missing else 0.0
    return float(eccentricity + pitch + pins + flight)


def mesh_warnings(
    meshes: Sequence[Mesh],
    where: str,
    deflections: Iterable[float],
    back_side: Iterable[float],
) -> Iterator[str]:
    """`plausibility_warnings` of every mesh of a motion.

    where : follows the mesh's number, such as ` at 100 N m`
    deflections : the largest [m]
    back_side : as in `plausibility_warnings`
    """
    per_mesh = zip(meshes, deflections, back_side, strict=True)
    for number, (mesh, deflection, back) in enumerate(per_mesh, start=1):
        yield from plausibility_warnings(
            f"mesh {number}{where}",
            mesh.pair.driver.module,
            deflection=float(deflection),
            backlash=mesh.backlash,
            back_side=float(back),
        )
