"""Run time against error of contact over the face width of helical gears.

A solution of higher degree, on a finer mesh and with more slices is the reference.
Errors are differences of the transmission error, divided by its mean. The compliance of
both gears is computed without cache.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.wide_flank import MESH, WideFlank, wide_flank, width_modes
from fegear.gearset import make_gear_set
from fegear.gearset.model import Gear, GearSet
from lumped.common.progress import Progress
from meshes import MeshSize
from validation.commands.bench import benchmark as bench

PAIR = {
    "name": "helical",
    "defaults": {"module_mm": 3.0, "helix_angle_deg": 20.0, "face_width_mm": 30.0},
    "gear": [
        {"name": "pinion", "teeth": 25, "hub_radius_mm": 18.0},
        {"name": "wheel", "teeth": 44, "hub_radius_mm": 30.0},
    ],
    "mesh": [{"driver": "pinion", "driven": "wheel"}],
}
TORQUE = 150.0  # N m
BY_DEGREE, BY_MESH, BY_SLICES = "degree", "mesh", "slices"


@dataclass(frozen=True)
class Sizes:
    """degrees : of the polynomials over the width; slices : of the face width

    meshes : refinement of the section's mesh
    degree, count, mesh : what stays while another one changes
    reference : degree, slices and mesh of the reference
    positions : of a mesh period
    """

    degrees: tuple[int, ...] = (0, 2, 4, 6, 8)
    slices: tuple[int, ...] = (8, 16, 24, 32, 48)
    meshes: tuple[float, ...] = (0.6, 0.8, 1.0)
    degree: int = 8
    count: int = 32
    mesh: float = 1.0
    reference: tuple[int, int, float] = (10, 64, 1.3)
    positions: int = 32


FULL = Sizes()
QUICK = Sizes(
    degrees=(0, 1),
    slices=(4, 8),
    meshes=(0.6,),
    degree=1,
    count=8,
    mesh=0.6,
    reference=(2, 12, 0.6),
    positions=2,
)


@dataclass(frozen=True)
class WidthCost:
    """Run times [s] and errors of one variant, over the mean transmission error.

    mesh : refinement of the section's mesh
    """

    study: str
    degree: int
    slices: int
    mesh: float
    compliance_s: float
    contact_s: float
    error_mean: float
    error_largest: float

    @property
    def total_s(self) -> float:
        return self.compliance_s + self.contact_s


def measure(report: Progress, sizes: Sizes = FULL) -> bench.Benchmark:
    """Over degree, mesh of the section and slices, of one helical pair."""
    points = measure_variants(report, sizes)
    rows, interrupted = bench.collect((bench.POINTS, point) for point in points)
    costs = rows[bench.POINTS]
    return bench.Benchmark(
        name="width",
        title=f"Loads over the width of a helical pair, {TORQUE:g} N m",
        about="Transmission error over the degree of polynomials, the mesh of the "
        "section and the slices of the face width, against finer ones.",
        tables=bench.plain(rows),
        panels=[
            bench.Panel(
                "largest error of the STE over its mean",
                "run time of both gears and a mesh cycle [s]",
                bench.curves_of(
                    [cost for cost in costs if cost.study != BY_SLICES],
                    lambda cost: cost.study,
                    lambda cost: (cost.error_largest, cost.total_s),
                    lambda cost: cost.degree if cost.study == BY_DEGREE else cost.mesh,
                ),
            ),
            bench.Panel(
                "largest error of the STE over its mean",
                "run time of a mesh cycle [s]",
                bench.curves_of(
                    [cost for cost in costs if cost.study == BY_SLICES],
                    lambda cost: cost.study,
                    lambda cost: (cost.error_largest, cost.contact_s),
                    lambda cost: cost.slices,
                ),
            ),
        ],
        interrupted=interrupted,
    )


def measure_variants(report: Progress, sizes: Sizes) -> Iterator[WidthCost]:
    """Points one by one, so that those finished are kept."""
    gears = make_gear_set(PAIR)
    usual = sizes.degree, sizes.count, sizes.mesh
    todo = [(BY_SLICES, (sizes.degree, count, sizes.mesh)) for count in sizes.slices]
    todo += [(BY_DEGREE, (n, sizes.count, sizes.mesh)) for n in sizes.degrees]
    todo += [(BY_MESH, (sizes.degree, sizes.count, mesh)) for mesh in sizes.meshes]
    report("reference", 0, len(todo) + 1)
    wide, _ = _compliance(gears, *sizes.reference[::2])
    _solved(gears, wide, usual[1], 1)  # compiles
    reference, _ = _solved(gears, wide, sizes.reference[1], sizes.positions)
    kept: tuple[tuple[int, float], tuple[list[WideFlank], float]] | None = None
    for i, (study, (degree, count, mesh)) in enumerate(todo):
        report(study, i + 1, len(todo) + 1)
        if kept is None or kept[0] != (degree, mesh):
            kept = (degree, mesh), _compliance(gears, degree, mesh)
        wide, seconds = kept[1]
        cycle, contact = _solved(gears, wide, count, sizes.positions)
        apart = np.abs(cycle.ste - reference.ste).max() / reference.ste.mean()
        yield WidthCost(
            study=study,
            degree=degree,
            slices=count,
            mesh=mesh,
            compliance_s=seconds,
            contact_s=contact,
            error_mean=abs(float(cycle.ste.mean() / reference.ste.mean()) - 1.0),
            error_largest=float(apart),
        )


def _compliance(
    gears: GearSet, degree: int, mesh: float
) -> tuple[list[WideFlank], float]:
    """Compliance of both gears, and the run time of its finite elements [s]."""
    flanks, seconds = [], 0.0
    for gear in gears.gears:
        material = _material(gear)
        start = time.perf_counter()
        modes = width_modes(gear.geometry, material, degree, MESH.refined(mesh))
        seconds += time.perf_counter() - start
        section = cached_flank_compliance(gear.geometry, material.section, MeshSize())
        flanks.append(wide_flank(gear.geometry, section, modes, gear.face_width))
    return flanks, seconds


def _material(gear: Gear) -> PlaneMaterial:
    constants = gear.young_modulus, gear.poisson_ratio
    return PlaneMaterial(*constants, "width", gear.face_width)


def _solved(
    gears: GearSet, wide: list[WideFlank], slices: int, positions: int
) -> tuple[ContactCycle, float]:
    """Contact over a mesh cycle, and its run time [s]."""
    width = gears.common_width(0)
    driver, driven = (
        ContactFlank(
            compliance=cached_flank_compliance(
                gear.geometry, _material(gear).section, MeshSize()
            )
        )
        for gear in gears.gears
    )
    problem = ContactProblem(
        pair=gears.meshes[0].pair,
        driver=driver,
        driven=driven,
        face_width=width,
        solver=WidthContact(
            driver=wide[0],
            driven=wide[1],
            width=width,
            gap=np.zeros(slices),
            back_gap=np.zeros(slices),
        ),
    )
    start = time.perf_counter()
    cycle = solve_cycle(problem, [TORQUE], np.arange(positions) / positions)
    return cycle, time.perf_counter() - start
