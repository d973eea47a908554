"""Plausibility checks of results.

The equations are linear in the teeth and know no strength, so they answer any load.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import inf
from typing import TYPE_CHECKING

from fegear.files.codes import with_code
from meshes.pairing import tip_clearance

if TYPE_CHECKING:
    from fegear.gearset.model import Mesh
    from meshes import GearPair

MAX_DEFLECTION = 0.1  # of a module: no tooth is still one beyond it
MAX_STEEL_PRESSURE = 1.5e9  # Pa, contact pressure that case-hardened gears endure
MAX_PRESSURE = 10.0 * MAX_STEEL_PRESSURE
# relative, of what two laws of mechanics give for the same quantity
MAX_IMBALANCE = 1e-3
MAX_ERROR_ESTIMATE = 1e-2  # relative, of what two meshes give for it


def plausibility_warnings(
    where: str,
    module: float,
    *,
    transmission_error: float = 0.0,
    pressure: float = 0.0,
    backlash: float = inf,
    back_side: float = 0.0,
) -> Iterator[str]:
    """A line for each reason why a result of a mesh cannot be physical.

    Of its largest values; what is not known is left out.

    where : such as `mesh 1 at 100 N m`
    module : [m]; transmission_error : of either sign [m]; pressure : [Pa]
    backlash : [m]; back_side : part of the time with contact of the back flanks
    """
    limit = MAX_DEFLECTION * module
    if abs(transmission_error) > limit:
        yield with_code(
            "W01",
            f"{where}: transmission error "
            f"{1e6 * abs(transmission_error):.4g} um exceeds a tenth of the "
            f"module, {1e6 * limit:.4g} um; the result cannot be physical",
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


def mesh_warnings(
    meshes: Sequence[Mesh],
    where: str,
    dte_peak: Iterable[float],
    back_side: Iterable[float],
) -> Iterator[str]:
    """`plausibility_warnings` of every mesh of a motion.

    where : follows the mesh's number, such as ` at 100 N m`
    dte_peak : largest dynamic transmission errors [m]
    back_side : as in `plausibility_warnings`
    """
    per_mesh = zip(meshes, dte_peak, back_side, strict=True)
    for number, (mesh, peak, back) in enumerate(per_mesh, start=1):
        yield from plausibility_warnings(
            f"mesh {number}{where}",
            mesh.pair.driver.module,
            transmission_error=float(peak),
            backlash=mesh.backlash,
            back_side=float(back),
        )
