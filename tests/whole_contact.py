"""Deflection of gears in contact by finite elements of whole gears.

Under the contact pressure of the program, with which they share the mesh of a sector
but for the vertices on the flanks.
"""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
from scipy.spatial import cKDTree
from skfem import Basis, ElementTriP2, ElementVector, MeshTri2, condense, solve
from skfem.models.elasticity import linear_elasticity

from fegear.contact.loads import patch_load
from fegear.contact.plane.solve import run_kernel
from meshes import sector_mesh
from meshes.profile import flank_points, flank_tangents, roll_length_at_arc, turn


def ste_of_whole_gears(problem, torque, position, size):
    """Transmission error of the program, that of whole gears [m], and pairs in contact.

    Deflection under the contact pressure plus gaps, weighted by loads. size : of the
    mesh off the flanks
    """
    result = run_kernel(problem, np.array([torque]), np.array([position]))
    touching = np.flatnonzero(result.nodes.force.any(axis=1))
    loads = [patch_load(problem, result, int(pair)) for pair in touching]
    arms = result.cells[0, 0].moment_arms[touching, 0]
    forces = np.array([load.normal.sum() for load in loads])
    on_gaps = sum(
        load.normal @ result.nodes.gap[pair]
        for load, pair in zip(loads, touching, strict=True)
    )
    on_driver = [(x.tooth, x.turn[0], x.driver_arcs, x.normal, x.step) for x in loads]
    on_driven = [(-x.tooth, x.turn[1], x.driven_arcs, x.normal, x.step) for x in loads]
    work = work_on_whole_gear(problem.pair.driver, on_driver, size)
    work += work_on_whole_gear(problem.pair.driven, on_driven, size)
    # off the path, a pair closes by less than the transmission error
    closing = forces @ arms / problem.pair.driver.base_radius
    return float(result.rows.ste[0, 0]), (work + on_gaps) / closing, touching.size


def refined_arcs(length, loads):
    """Arcs of a flank's vertices, close together where loads are [m].

    loads : (arcs (n,), line loads (n,), step) of each pair
    """
    narrow = []
    for arcs, normal, step in loads:
        loaded = arcs[normal > 0.0]
        narrow.append((loaded.mean(), 0.5 * np.ptp(loaded) + step))
        narrow.append((arcs[np.argmax(normal)], 3.0 * step))

    def edge(arc):
        near = [max(w / 4.0, 0.3 * (abs(arc - x) - w)) for x, w in narrow]
        return min(*near, 1e-4)

    stops = [0.0]
    while stops[-1] < length:
        stops.append(stops[-1] + edge(stops[-1]))
    return np.array(stops) * length / stops[-1]


def work_on_whole_gear(gear, loads, size):
    """Work of the loads of tooth pairs on a whole gear, over their displacement [N].

    loads : (tooth, sine of the angle from the flank's normal toward its root, arcs
        (n,), line loads (n,) [N/m], step [m]) of each pair, teeth to the right

    Plane stress; the hub, or the rim of an internal gear, is held. It shares the mesh
    of the sector with the program, with other vertices on the flank.
    """
    arcs = refined_arcs(gear.flank_length, [load[2:] for load in loads])
    with patch("meshes.outline.flank_arcs", return_value=arcs):
        sector = sector_mesh(gear, size)
    angles = gear.pitch_angle * np.arange(gear.teeth)
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
    for tooth, sine, *load in loads:
        angle = tooth * gear.pitch_angle
        nodal = list(nodal_loads(gear, sector, sine, *load))
        total = sum(np.hypot(*vectors.sum(axis=0)) for _, vectors in nodal)
        for nodes, vectors in nodal:
            points = turn(sector.points[nodes], angle)
            vectors = turn(vectors, angle) * load[1].sum() / total
            for point, vector in zip(points, vectors, strict=True):
                force[sorted(tree.query_ball_point(point, 1e-9))] += vector
    radius = gear.sign * np.hypot(*places.T)
    held = np.flatnonzero(radius < gear.hub_radius + 1e-6 * abs(gear.hub_radius))
    return float(force @ solve(*condense(K, force, D=held)))


def nodal_loads(gear, sector, sine, arcs, loads, step):
    """Nodes (3,) and forces (3, 2) of the flank's edges under a piecewise linear load.

    sine : of the angle of the loads from the flank's normal toward its root
    arcs : (n,) of the hats; loads : (n,) of the hats, of which the first and the last
        are halves [N/m]
    """
    # far from the load, arcs may belong to points behind the base circle
    loaded = np.flatnonzero(loads)
    inside = slice(max(loaded[0] - 1, 0), loaded[-1] + 2)
    pressure = loads / step
    pressure[[0, -1]] *= 2.0
    order = np.argsort(arcs[inside])
    arcs, pressure = arcs[inside][order], pressure[inside][order]
    x, weight = np.polynomial.legendre.leggauss(4)
    x, weight = 0.5 * (1.0 + x), 0.5 * weight
    ends = zip(sector.flank_arcs[:-1], sector.flank_arcs[1:], strict=True)
    for edge, (low, high) in zip(sector.edges["flank"], ends, strict=True):
        kinks = arcs[(arcs > low) & (arcs < high)]
        stops = np.concatenate([[low], kinks, [high]])
        arc = (stops[:-1, None] + np.diff(stops)[:, None] * x).ravel()
        weights = (np.diff(stops)[:, None] * weight).ravel()
        p = np.interp(arc, arcs, pressure, left=0.0, right=0.0)
        t = (arc - low) / (high - low)
        shapes = np.stack([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
        tangent = flank_tangents(gear, roll_length_at_arc(gear, arc))
        inward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        points = flank_points(gear, roll_length_at_arc(gear, np.sort(arc)))
        rootward = tangent * np.sign((tangent * (points[-1] - points[0])).sum())
        direction = np.sqrt(1.0 - sine**2) * inward + sine * rootward
        yield edge, np.einsum("sq,q,q,qc->sc", shapes, weights, p, direction)
