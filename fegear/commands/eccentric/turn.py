"""Contact of an eccentric gearing over a turn of its driven wheel."""

from __future__ import annotations

import numpy as np

from fegear.commands.eccentric.elastic_wheel import ElasticWheel
from fegear.commands.eccentric.gearing import Gearing
from fegear.commands.eccentric.wheel_contact import solve_contact_cycle
from fegear.elasticity.material import PlaneMaterial
from fegear.files.errors import InputError
from lumped.common.array_types import Array
from meshes import GeometryError
from meshes.eccentric.outline import WheelEdges
from meshes.eccentric.teeth import ToothedPair
from meshes.eccentric.wheel_mesh import WheelMesh, default_bore, wheel_mesh

Columns = dict[str, list[float]]  # of some positions
STEEL = PlaneMaterial(2.06e11, 0.3)
FINENESS = {"coarse": 0.7, "default": 1.0, "fine": 1.7}
MAX_TEETH = 2_000  # of both wheels: 200 MB for every thousand


def contact_columns(
    toothed: ToothedPair,
    driver: ElasticWheel,
    driven: ElasticWheel,
    load: float,
    arcs: Array,
) -> Columns:
    """Columns of some positions, by the names of the table."""
    contact = solve_contact_cycle(toothed, driver, driven, load, arcs)
    columns = {
        "driver_angle_deg": np.degrees(contact.driver_turn),
        "driven_angle_deg": np.degrees(contact.driven_turn),
        "torque_ratio": toothed.pair.torque_ratio(contact.angle),
        "contact_torque_ratio": contact.torque_ratio,
        "transmission_error_um": 1e6 * contact.error,
        "driver_error_urad": 1e6 * contact.driver_error,
        "contact_pressure_MPa": 1e-6 * contact.pressure,
        "pairs": contact.pairs.astype(float),
        "largest_load_share": contact.largest_share,
    }
    return {name: values.tolist() for name, values in columns.items()}


def wheel_meshes(
    gearing: Gearing, bore_mm: float | None, resolution: str
) -> tuple[WheelMesh, WheelMesh]:
    """Meshes of driver and driven wheel; raises InputError for a bore that does not
    fit.
    """
    toothed = gearing.toothed
    if toothed is None:
        raise InputError("teeth is missing: a mesh is made of toothed wheels")
    if toothed.driver.teeth + toothed.driven.teeth > MAX_TEETH:
        raise InputError(
            f"teeth = {gearing.teeth}; at most {MAX_TEETH} on both wheels in meshes"
        )
    edges = WheelEdges().refined(FINENESS[resolution])
    meshes = []
    for wheel in (toothed.driver, toothed.driven):
        bore = default_bore(wheel) if bore_mm is None else 1e-3 * bore_mm
        try:
            meshes.append(wheel_mesh(wheel, bore, edges))
        except GeometryError as error:
            raise InputError(f"{error.field} = {error.message}") from None
    return meshes[0], meshes[1]
