"""Contact of an eccentric gearing over a turn of its driven wheel."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.eccentric.contact import solve_turn
from fegear.eccentric.elastic_wheel import ElasticWheel
from fegear.eccentric.gearing import Gearing
from fegear.elasticity.material import PlaneMaterial
from fegear.errors import InputError
from fegear.store import NOTHING, InOrder, Keeping
from fegear.unphysical import doubts, doubts_of_check
from lumped.csv_text import exact, format_csv
from lumped.progress import Progress, silent
from lumped.workers import run_tasks
from meshes import GeometryError
from meshes.eccentric.outline import WheelEdges
from meshes.eccentric.teeth import ToothedPair
from meshes.eccentric.wheel_mesh import WheelMesh, usual_bore, wheel_mesh

Array = NDArray[np.float64]
Columns = dict[str, list[float]]  # of some positions
BLOCK = 8  # positions that are solved and kept together
STEEL = PlaneMaterial(2.06e11, 0.3)
FINENESS = {"coarse": 0.7, "default": 1.0, "fine": 1.7}
MOST_POSITIONS = 100_000
FEWEST_A_TOOTH = 4  # positions, below which peaks are missed
MOST_TEETH = 2_000  # of both wheels: 200 MB for every thousand
LEGEND = {
    "transmission_error_um": "approach of the flanks along the line of action under "
    "the load, which lets the driver turn by driver_error_urad",
    "contact_torque_ratio": "of moments about both bearings of the contact forces on "
    "the flanks as they are meshed",
    "tip corners": "no contact outside of the path of contact",
}


@dataclass(frozen=True, kw_only=True)
class Load:
    """torque_Nm : on the driver; face_width_mm : of both wheels
    positions : of a turn of the driven wheel, evenly spaced along the pitch curve
    bore_mm : radius of both bores, by default two fifths of what fits
    resolution : of the finite elements, a key of FINENESS
    """

    torque_Nm: float
    face_width_mm: float = 10.0
    positions: int | None = None
    bore_mm: float | None = None
    resolution: str = "default"


@dataclass(frozen=True, eq=False)
class TurnTable:
    """Columns (n,) with their units in their names; not complete after Ctrl-C."""

    gearing: Gearing
    load: Load
    columns: Mapping[str, Array]
    complete: bool = True

    def csv(self) -> str:
        rows = zip(*(column.tolist() for column in self.columns.values()), strict=True)
        return format_csv(self.columns, rows, {**self.header, **LEGEND})

    @property
    def header(self) -> Mapping[str, str]:
        load = self.load
        own = {
            "torque_Nm": exact(load.torque_Nm),
            "face_width_mm": exact(load.face_width_mm),
            "resolution": load.resolution,
            "plane": STEEL.plane,
        }
        return {**self.gearing.header, **own}

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        error, ratio = (
            self.columns[name]
            for name in ("transmission_error_um", "contact_torque_ratio")
        )
        off = float(np.abs(ratio / self.columns["torque_ratio"] - 1.0).max())
        pressure = float(self.columns["contact_pressure_MPa"].max())
        where = f"contact at {self.load.torque_Nm:g} N m"
        warnings = [
            *_sparse(self),
            *doubts_of_check(where, "torque ratios against the kinematics", off),
            *doubts(
                where,
                1e-3 * self.gearing.summary["module_mm"],
                transmission_error=1e-6 * float(error.max()),
                pressure=1e6 * pressure,
            ),
        ]
        return {
            "torque_Nm": self.load.torque_Nm,
            "face_width_mm": self.load.face_width_mm,
            "positions": int(error.size),
            "complete": self.complete,
            "mean_transmission_error_um": float(error.mean()),
            "peak_to_peak_transmission_error_um": float(np.ptp(error)),
            "largest_deviation_of_torque_ratio": off,
            "largest_contact_pressure_MPa": pressure,
            "warnings": warnings,
        }


def _sparse(table: TurnTable) -> Iterator[str]:
    """Where positions are too few to tell the largest values."""
    teeth = int(table.gearing.summary["driven_teeth"])
    asked = table.load.positions
    if asked is not None and asked < FEWEST_A_TOOTH * teeth:
        yield (
            f"positions = {asked} is less than {FEWEST_A_TOOTH} for each of the "
            f"{teeth} teeth: largest values and peak to peak may lie between them"
        )


def solve_load(
    gearing: Gearing,
    load: Load,
    keeping: Keeping = NOTHING,
    report: Progress = silent,
) -> TurnTable:
    """Contact over a turn of the driven wheel under a torque on the driver.

    keeping : where finished positions are kept
    After Ctrl-C the table holds the positions that were finished, from the first on.
    Raises InputError for a gearing without teeth, a bore that does not fit, and more
    teeth or positions than fit into memory.
    """
    toothed = gearing.toothed
    if toothed is None:
        raise InputError("--torque needs --teeth: pitch curves alone carry no load")
    count = load.positions or 8 * toothed.driven.teeth
    if count > MOST_POSITIONS:
        raise InputError(f"--positions = {count}; at most {MOST_POSITIONS}")
    report("meshing", 0, 1)
    meshes = wheel_meshes(gearing, load.bore_mm, load.resolution)
    driver, driven = (ElasticWheel(mesh, STEEL) for mesh in meshes)
    for wheel in (driver, driven):  # before threads ask for them
        _ = wheel.factor, wheel.boundary
    arcs = toothed.driven.curve.length * np.arange(count) / count
    blocks = np.split(arcs, np.arange(BLOCK, count, BLOCK))
    checkpoint = keeping.open({**gearing.header, "load": repr(load)})
    kept: InOrder[Columns] = InOrder(checkpoint, "turn", dict, dict)
    if checkpoint is not None and keeping.resume:
        checkpoint.tell_finished(["turn"], len(blocks), keeping.tell, "block")

    def take(number: int, columns: Columns) -> None:
        kept.take(number, columns)
        report("contact", kept.count, len(blocks))

    per_width = load.torque_Nm / (1e-3 * load.face_width_mm)
    tasks = (
        (number, partial(_columns, toothed, driver, driven, per_width, block))
        for number, block in enumerate(blocks)
        if number >= len(kept.done)
    )
    report("contact", kept.count, len(blocks))
    try:
        run_tasks(tasks, take, threading.Event())
    except KeyboardInterrupt:
        if not kept.done:
            raise
    finally:
        finished = len(kept.done)
        if checkpoint is not None:
            checkpoint.close(keep=0 < finished < len(blocks))
    columns = {
        name: np.array([v for own in kept.done for v in own[name]], float)
        for name in kept.done[0]
    }
    return TurnTable(gearing, load, columns, finished == len(blocks))


def _columns(
    toothed: ToothedPair,
    driver: ElasticWheel,
    driven: ElasticWheel,
    load: float,
    arcs: Array,
) -> Columns:
    """Of some positions, by the names of the table."""
    found = solve_turn(toothed, driver, driven, load, arcs)
    columns = {
        "driver_angle_deg": np.degrees(found.driver_turn),
        "driven_angle_deg": np.degrees(found.driven_turn),
        "torque_ratio": toothed.pair.torque_ratio(found.angle),
        "contact_torque_ratio": found.torque_ratio,
        "transmission_error_um": 1e6 * found.error,
        "driver_error_urad": 1e6 * found.driver_error,
        "contact_pressure_MPa": 1e-6 * found.pressure,
        "pairs": found.pairs.astype(float),
        "largest_load_share": found.largest_share,
    }
    return {name: values.tolist() for name, values in columns.items()}


def wheel_meshes(
    gearing: Gearing, bore_mm: float | None, resolution: str
) -> tuple[WheelMesh, WheelMesh]:
    """Of driver and driven wheel; raises InputError for a bore that does not fit."""
    toothed = gearing.toothed
    if toothed is None:
        raise InputError("--teeth is missing: a mesh is made of toothed wheels")
    if toothed.driver.teeth + toothed.driven.teeth > MOST_TEETH:
        raise InputError(
            f"--teeth = {gearing.teeth}; at most {MOST_TEETH} on both wheels in meshes"
        )
    edges = WheelEdges().refined(FINENESS[resolution])
    meshes = []
    for wheel in (toothed.driver, toothed.driven):
        bore = usual_bore(wheel) if bore_mm is None else 1e-3 * bore_mm
        try:
            meshes.append(wheel_mesh(wheel, bore, edges))
        except GeometryError as error:
            raise InputError(f"--{error.field} = {error.message}") from None
    return meshes[0], meshes[1]
