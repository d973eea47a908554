"""Contact of an undercut pinion against finite elements of whole gears."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import islice

import numpy as np
import pytest
from oracles.relieved_flanks import Flank, closing_way
from scipy.spatial import cKDTree
from skfem import Basis, ElementTriP2, ElementVector, MeshTri2, condense, solve
from skfem.models.elasticity import linear_elasticity

from fegear.contact.edges import edge_arcs
from fegear.contact.loads import patch_load
from fegear.contact.problem import run_kernel, solve_cycle
from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.statics.plausibility import undercut_warnings
from fegear.statics.solving import RESOLUTIONS, Resolution, StaticsSettings, solve_mesh
from fegear.studies.stiffness import table_warnings
from meshes import MeshSize, sector_mesh
from meshes.profile import flank_tangents, roll_length_at_arc, turn

TORQUE = 100.0
TABLES = {
    "name": "undercut",
    "defaults": {"module_mm": 4.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "pinion", "teeth": 12, "hub_radius_mm": 10.0},
        {"name": "wheel", "teeth": 45, "hub_radius_mm": 60.0},
    ],
    "mesh": [{"driver": "pinion", "driven": "wheel", "center_distance_mm": 114.02}],
    "load": {"gear": "pinion", "torques_Nm": [TORQUE]},
}
SIZE = MeshSize(flank_edges=160, flank_grading=0.0, fillet_edges=16)


@lru_cache(maxsize=8)
def solved(resolution="default", positions=64):
    settings = StaticsSettings(
        resolution=resolution, positions=positions, estimate_error=False
    )
    return solve_mesh(make_gear_set(TABLES), 0, [TORQUE], settings)


def work_on_whole_gear(gear, loads):
    """Work of the loads of tooth pairs on a whole gear, over their displacement [N].

    loads : (tooth, arcs (n,), line loads (n,) [N/m]) of each pair, teeth to the right

    Plane stress; the hub is held; shares the mesh of the sector with the program.
    """
    sector = sector_mesh(gear, SIZE)
    angles = 2.0 * np.pi * np.arange(gear.teeth) / gear.teeth
    copies = np.vstack([turn(sector.points, a) for a in angles])
    near = cKDTree(copies).query_ball_point(copies, 1e-9)
    unique, merged = np.unique([min(n) for n in near], return_inverse=True)
    shift = len(sector.points) * np.arange(gear.teeth)[:, None, None]
    triangles = (sector.triangles[None] + shift).reshape(-1, 6)
    mesh = MeshTri2(copies[unique].T.copy(), merged[triangles].T.copy())
    basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
    E, nu = 206e9, 0.3
    stiffness = linear_elasticity(E * nu / (1 - nu**2), 0.5 * E / (1 + nu))
    K, places = stiffness.assemble(basis), basis.doflocs.T
    force, tree = np.zeros(basis.N), cKDTree(places)
    for tooth, arcs, normal in loads:
        angle = tooth * gear.pitch_angle
        for nodes, vectors in nodal_loads(gear, sector, arcs, normal):
            points = turn(sector.points[nodes], angle)
            for point, vector in zip(points, turn(vectors, angle), strict=True):
                force[sorted(tree.query_ball_point(point, 1e-9))] += vector
    held = np.flatnonzero(np.hypot(*places.T) < gear.hub_radius * (1 + 1e-6))
    return float(force @ solve(*condense(K, force, D=held)))


def nodal_loads(gear, sector, arcs, loads):
    """Nodes (3,) and forces (3, 2) of the flank's edges under a piecewise linear load.

    arcs : (n,) equally spaced; loads : (n,) of the hats [N/m]
    """
    order = np.argsort(arcs)
    arcs, pressure = arcs[order], loads[order] / np.abs(np.diff(arcs)).mean()
    x, weight = np.polynomial.legendre.leggauss(8)
    x, weight = 0.5 * (1.0 + x), 0.5 * weight
    shapes = np.stack([(1 - x) * (1 - 2 * x), x * (2 * x - 1), 4 * x * (1 - x)])
    ends = zip(sector.flank_arcs[:-1], sector.flank_arcs[1:], strict=True)
    for edge, (low, high) in zip(sector.edges["flank"], ends, strict=True):
        arc = low + (high - low) * x
        p = np.interp(arc, arcs, pressure, left=0.0, right=0.0)
        tangent = flank_tangents(gear, roll_length_at_arc(gear, arc))
        inward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        yield edge, (high - low) * np.einsum("sq,q,q,qc->sc", shapes, weight, p, inward)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("position", "pairs", "tolerance"), [(0.1, 1, 2e-3), (0.55, 2, 5e-3)]
)
def test_deflection_is_that_of_whole_gears(position, pairs, tolerance):
    """Under the contact pressure: transmission error less gaps, weighted by loads."""
    problem = solved().problem
    result = run_kernel(problem, np.array([TORQUE]), np.array([position]))
    touching = np.flatnonzero(result.nodes.force.any(axis=1))
    assert touching.size == pairs
    loads = [patch_load(problem, result, int(pair)) for pair in touching]
    total, on_gaps = (
        sum(load.normal @ weight for load, weight in zip(loads, weights, strict=True))
        for weights in (
            [np.ones(load.normal.size) for load in loads],
            [result.nodes.gap[pair] for pair in touching],
        )
    )
    work = work_on_whole_gear(
        problem.pair.driver, [(x.tooth, x.driver_arcs, x.normal) for x in loads]
    )
    work += work_on_whole_gear(
        problem.pair.driven, [(-x.tooth, x.driven_arcs, x.normal) for x in loads]
    )
    ste = (work + on_gaps) / total
    assert result.rows.ste[0, 0] == pytest.approx(ste, rel=tolerance)


@pytest.mark.slow
def test_mean_transmission_error_converges(monkeypatch):
    """At first order on the path, which begins at an edge; better with its contact."""
    positions = np.arange(64) / 64

    def means(factor):
        nodes = 1 + 2 * round(12 * factor)
        finer = Resolution(MeshSize().refined(factor), nodes)
        monkeypatch.setitem(RESOLUTIONS, "default", finer)
        problem = solved.__wrapped__(positions=1).problem
        on_path = replace(problem, corner_contact=False)
        return [
            solve_cycle(p, [TORQUE], positions).ste.mean() for p in (on_path, problem)
        ]

    best = np.array(means(2.8))
    errors = [np.abs(means(factor) / best - 1.0) for factor in (0.5, 0.71, 1.0)]
    assert np.max(errors) < 2e-3
    assert np.log2(errors[0][0] / errors[2][0]) > 0.8
    assert errors[2][1] < 3e-4


def test_without_corner_contact_no_pair_touches_below_the_form_circle():
    problem = replace(solved().problem, corner_contact=False)
    cycle = solve_cycle(problem, [TORQUE], np.arange(64) / 64)
    pair = problem.pair
    s1 = pair.pitch_point + pair.base_pitch * np.add.outer(cycle.position, cycle.teeth)
    below = s1 < pair.driver.form_roll_length
    assert below.any()
    assert not cycle.load[0][below].any()
    assert np.isinf(cycle.gap[0][below]).all()
    assert cycle.residual.max() < 1e-10


def test_gap_of_the_edge_is_that_of_the_geometry():
    """Before the path begins, the edge of the undercut touches the mate's flank."""
    problem = solved().problem
    pair, none = problem.pair, np.zeros_like
    flanks = [
        Flank(gear.base_radius, gear.tip_roll_length, gear.form_roll_length, none)
        for gear in (pair.driver, pair.driven)
    ]
    start = pair.path[0]
    positions = start + np.array([-0.25, -0.15, -0.05, -0.01, 0.02, 0.1])
    cycle = solve_cycle(problem, [TORQUE], positions)
    gap = cycle.gap[0][:, cycle.teeth.tolist().index(0)]
    rolls = pair.pitch_point + pair.base_pitch * positions
    exact = [closing_way(*flanks, pair.center_distance, roll) for roll in rolls]
    assert max(exact) > 5e-6
    # the lever of the force at the edge changes while the gap closes
    np.testing.assert_allclose(gap, exact, rtol=1e-3, atol=1e-11)


def test_transmission_error_does_not_jump_where_the_path_begins():
    problem = solved().problem
    positions = problem.pair.path[0] + np.array([-2e-3, -1e-3, 1e-3, 2e-3])
    ste = solve_cycle(problem, [TORQUE], positions).ste[0]
    assert np.ptp(ste) < 5e-3 * ste.mean()
    without = replace(problem, corner_contact=False)
    assert np.ptp(solve_cycle(without, [TORQUE], positions).ste) > 0.3 * ste.mean()


def test_driver_and_driven_gear_can_change_roles():
    mesh = {"driver": "wheel", "driven": "pinion", "center_distance_mm": 114.02}
    load = {"gear": "wheel", "torques_Nm": [TORQUE * 45 / 12]}
    gears = make_gear_set(TABLES | {"mesh": [mesh], "load": load})
    settings = StaticsSettings(estimate_error=False)
    swapped = solve_mesh(gears, 0, load["torques_Nm"], settings)
    assert swapped.problem.pair.contact_ratio == pytest.approx(
        solved().problem.pair.contact_ratio
    )
    one, two = (result.table["ste_m"][0] for result in (solved(), swapped))
    mirrored = np.roll(two[::-1], 1)  # position p is -p, and the jump moves by one
    assert np.median(np.abs(mirrored / one - 1.0)) < 1e-6


def test_back_flanks_of_an_undercut_gear_touch_alike():
    problem = solved().problem
    positions = np.arange(16) / 16 + 0.01
    back = solve_cycle(problem, [-TORQUE], positions)
    assert back.residual.max() < 1e-10
    assert (back.ste < 0.0).all()


def random_pair(rng):
    """Two gears of which one is undercut, as tables in mesh; None if refused."""
    angle, teeth = rng.uniform(14.5, 25.0), (rng.integers(8, 17), rng.integers(12, 70))
    gears = [
        {
            "name": name,
            "teeth": int(count),
            "profile_shift": rng.uniform(-0.3, 0.3),
            "hub_radius_mm": 0.8 * count,
        }
        for name, count in zip(("pinion", "wheel"), teeth, strict=True)
    ]
    mesh = {"driver": "pinion", "driven": "wheel"}
    mesh["operating_pressure_angle_deg"] = angle + rng.uniform(0.2, 4.0)
    defaults = TABLES["defaults"] | {"pressure_angle_deg": angle}
    try:
        gear_set = make_gear_set(
            TABLES | {"defaults": defaults, "gear": gears, "mesh": [mesh]}
        )
    except InputError:
        return None
    pair = gear_set.meshes[0].pair
    return gear_set if pair.driver.is_undercut or pair.driven.is_undercut else None


@pytest.mark.slow
def test_random_undercut_pairs_have_solutions_that_grow_with_the_torque():
    rng = np.random.default_rng(20261125)
    pairs = (gear_set for _ in range(400) if (gear_set := random_pair(rng)))
    positions = np.arange(16) / 16
    settings = StaticsSettings(resolution="coarse", estimate_error=False, positions=1)
    for gear_set in islice(pairs, 8):
        problem = solve_mesh(gear_set, 0, [TORQUE], settings).problem
        drive = solve_cycle(problem, [0.1 * TORQUE, TORQUE, 3.0 * TORQUE], positions)
        back = solve_cycle(problem, [-TORQUE], positions)
        assert max(drive.residual.max(), back.residual.max()) < 1e-10
        assert (np.diff(drive.ste, axis=0) > 0.0).all()


def test_the_end_of_an_undercut_flank_is_an_edge():
    problem = solved().problem
    edges = edge_arcs(problem)
    assert edges[0][-1] == pytest.approx(problem.pair.driver.flank_length)
    assert edges[1].size == 1


def test_a_warning_says_how_much_of_the_path_is_lost():
    (line,) = undercut_warnings(1, solved().problem.pair)
    assert "contact ratio 1.254" in line
    assert line.endswith("[W27]")
    assert line in table_warnings(solved())
