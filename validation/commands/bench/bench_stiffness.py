"""Run time against error of the static mesh stiffness.

Every point is one whole computation without cache: both flank compliances and the
contact cycle. Errors are those of the transmission error, relative to an overkill
reference of its own; the compiled kernel is warm.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.elasticity.flank import flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from fegear.gearset.model import GearSet
from lumped.common.progress import Progress
from meshes import MeshSize
from validation.commands.bench import benchmark as bench

REFERENCE_VARIANT = MeshSize(
    flank_edges=120,
    flank_grading=7.5,
    fillet_edges=34,
    tooth_size=0.09,
    hub_size=0.36,
)
UNSPLIT_NODES = 5  # more make the unsplit compliance indefinite
GRID = "contact grid"  # the study in which the mesh is one


@dataclass(frozen=True)
class Sizes:
    """factors : of the mesh; unsplit_edges : of a flank; nodes : of the contact grid

    reference, reference_nodes : mesh and contact grid of the reference
    positions : of a mesh period
    """

    factors: tuple[float, ...] = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0)
    unsplit_edges: tuple[int, ...] = (32, 64, 128, 256)
    nodes: tuple[int, ...] = (9, 13, 17, 25, 33, 49, 73)
    reference: MeshSize = REFERENCE_VARIANT
    reference_nodes: int = 161
    positions: int = 64


FULL = Sizes()
QUICK = Sizes(
    factors=FULL.factors[:2],
    unsplit_edges=FULL.unsplit_edges[:2],
    nodes=FULL.nodes[:2],
    reference=MeshSize(),
    reference_nodes=73,
    positions=8,
)


@dataclass(frozen=True)
class Variant:
    """One way to compute; `study` is what varies along a curve."""

    study: str
    size: MeshSize
    order: int = 2
    nodes: int = 25
    split: bool = True


@dataclass(frozen=True)
class StiffnessCost:
    """Run times [s] and relative errors of one variant."""

    study: str
    element_order: int
    half_plane_split: bool
    flank_edges: int
    contact_nodes: int
    edge_at_pitch_mm: float
    compliance_s: float
    contact_s: float
    total_s: float
    error_mean: float
    error_path: float
    error_corner: float


def variants(sizes: Sizes = FULL) -> Iterator[Variant]:
    base = MeshSize()
    for order in (2, 1):
        for factor in sizes.factors:
            study = f"order {order}, split"
            yield Variant(study, base.refined(factor), order, 73)
    for edges in sizes.unsplit_edges:
        # a uniform flank mesh has to resolve the contact by itself
        factor = edges / base.flank_edges
        size = MeshSize(
            flank_edges=edges,
            flank_grading=0.0,
            fillet_edges=round(base.fillet_edges * min(2.0, factor)),
            tooth_size=base.tooth_size / min(2.0, factor),
            hub_size=base.hub_size,
        )
        yield Variant("order 2, no split", size, 2, UNSPLIT_NODES, False)
    for nodes in sizes.nodes:
        yield Variant(GRID, base, 2, nodes)


def measure(
    gear_set: GearSet, torque: float, report: Progress, sizes: Sizes = FULL
) -> bench.Benchmark:
    """Over mesh size, element order, grid and split, at a torque [N m].

    torque : on the driver of the first mesh
    """
    studies = measure_variants(gear_set, torque, report, sizes)
    rows, interrupted = bench.collect((bench.POINTS, point) for point in studies)
    points, title = rows[bench.POINTS], f"Statics of {gear_set.name}, {torque:g} N m"
    orders = {
        f"observed order of the mean STE, {study}": observed_order(points, study)
        for study in dict.fromkeys(p.study for p in points)
        if study != GRID
    }
    return bench.Benchmark(
        name="stiffness",
        title=title,
        about="Static transmission error over mesh size, element order, contact grid "
        "and split, against a reference of much finer meshes.",
        tables=bench.plain(rows),
        panels=figure_panels(points),
        facts=orders,
        left_out=("element_order", "half_plane_split", "edge_at_pitch_mm", "total_s"),
        findings=[f"{name}: {order:.2f}" for name, order in orders.items()],
        interrupted=interrupted,
    )


def measure_variants(
    gear_set: GearSet, torque: float, report: Progress, sizes: Sizes
) -> Iterator[StiffnessCost]:
    """Points one by one, so that those finished are kept."""
    todo = list(variants(sizes))
    report("reference", 0, len(todo) + 1)
    finest = Variant("", sizes.reference, 2, sizes.reference_nodes)
    reference_problem = _problem(gear_set, finest)
    reference = _solved_cycle(reference_problem, torque, sizes.positions)
    for i, variant in enumerate(todo):
        report(variant.study, i + 1, len(todo) + 1)
        yield _measure_variant(gear_set, torque, variant, reference_problem, reference)


def _solved_cycle(
    problem: ContactProblem, torque: float, positions: int
) -> ContactCycle:
    return solve_cycle(problem, [torque], np.arange(positions) / positions)


def _problem(gear_set: GearSet, variant: Variant) -> ContactProblem:
    spec = gear_set.meshes[0]
    gears = [gear_set.gears[spec.driver], gear_set.gears[spec.driven]]
    flanks = [
        flank_compliance(
            CyclicSector(
                gear.geometry,
                PlaneMaterial(gear.young_modulus, gear.poisson_ratio),
                variant.size,
                variant.order,
            ),
            variant.split,
        )
        for gear in gears
    ]
    return ContactProblem(
        pair=spec.pair,
        driver=ContactFlank(compliance=flanks[0]),
        driven=ContactFlank(compliance=flanks[1]),
        face_width=gear_set.common_width(0),
        solver=PlaneContact(nodes=variant.nodes),
    )


def _measure_variant(
    gear_set: GearSet,
    torque: float,
    variant: Variant,
    reference_problem: ContactProblem,
    reference: ContactCycle,
) -> StiffnessCost:
    start = time.perf_counter()
    problem = _problem(gear_set, variant)
    middle = time.perf_counter()
    cycle = _solved_cycle(problem, torque, reference.ste.shape[1])
    end = time.perf_counter()
    error = np.abs(cycle.ste[0] / reference.ste[0] - 1.0)
    corner = reference.corner_positions(0)
    means = cycle.ste.mean() / reference.ste.mean()
    return StiffnessCost(
        study=variant.study,
        element_order=variant.order,
        half_plane_split=variant.split,
        flank_edges=variant.size.flank_edges,
        contact_nodes=variant.nodes,
        edge_at_pitch_mm=1e3 * _edge_at_pitch(gear_set, variant.size),
        compliance_s=middle - start,
        contact_s=end - middle,
        total_s=end - start,
        error_mean=abs(float(means) - 1.0),
        error_path=float(error[~corner].max()),
        error_corner=float(error[corner].max()) if corner.any() else math.nan,
    )


def _edge_at_pitch(gear_set: GearSet, size: MeshSize) -> float:
    """Length of the driver's flank edge at the pitch point [m]."""
    from meshes.outline import flank_arcs
    from meshes.profile import arc_from_tip

    pair = gear_set.meshes[0].pair
    arcs = flank_arcs(pair.driver, size)
    at = np.searchsorted(arcs, arc_from_tip(pair.driver, pair.pitch_point))
    return float(arcs[at] - arcs[at - 1])


def observed_order(points: Sequence[StiffnessCost], study: str) -> float:
    """Observed order of the mean error over the flank edges, of one study."""
    chosen = [p for p in points if p.study == study]
    edges, errors = [p.flank_edges for p in chosen], [p.error_mean for p in chosen]
    return -bench.slope(edges, errors)


def figure_panels(points: Sequence[StiffnessCost]) -> list[bench.Panel]:
    """Run time against error, and error against mesh size."""
    cost, size = [], []
    studies = dict.fromkeys(p.study for p in points)
    for study, marker in zip(studies, "osv^D", strict=False):
        chosen = [p for p in points if p.study == study]
        times = [(p.error_path, p.total_s) for p in chosen]
        cost.append(bench.CostCurve(study, marker, times))
        if study != GRID:
            label = f"{study}: order {observed_order(points, study):.1f}"
            edges = [(p.edge_at_pitch_mm, p.error_mean) for p in chosen]
            size.append(bench.CostCurve(label, marker, edges))
    return [
        bench.Panel(
            "largest relative error of STE on the nominal path",
            "run time of compliances and 64 positions [s]",
            cost,
            (2e-3, "0.2 %"),
        ),
        bench.Panel(
            "flank edge at the pitch point [mm]", "relative error of mean STE", size
        ),
    ]
