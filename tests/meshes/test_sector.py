"""The sector mesh: true curves, symmetry, grading, files, gmsh's fence."""

from __future__ import annotations

import math

import meshio
import numpy as np
import pytest
from conftest import make_gear
from mesh_quality import smallest_jacobian

from meshes import MeshSize, sector_mesh
from meshes.files import write_mesh
from meshes.gmsh_session import gmsh_model, import_gmsh
from meshes.profile import fillet_points, flank_points

NANOMETRE = 1e-9


@pytest.fixture(scope="module")
def mesh(pinion):
    return sector_mesh(pinion)


def distance_to_involute(gear, points):
    """Normal distance (n,): parallel involutes are rb times an angle apart."""
    rb, radius = gear.base_radius, np.hypot(*points.T)
    s = np.sqrt(radius**2 - rb**2)
    angle = np.arctan2(points[:, 0], points[:, 1])
    return rb * np.abs(angle - gear.base_half_angle + s / rb - np.arctan(s / rb))


def test_flank_nodes_lie_on_the_involute(pinion, mesh):
    nodes = np.unique(mesh.edges["flank"])
    assert distance_to_involute(pinion, mesh.points[nodes]).max() < 1e-3 * NANOMETRE
    left = mesh.points[np.unique(mesh.edges["left_flank"])] * [-1.0, 1.0]
    assert distance_to_involute(pinion, left).max() < 1e-3 * NANOMETRE


def test_edges_between_nodes_stay_near_the_involute(pinion, mesh):
    ends, mids = mesh.edges["flank"][:, :2], mesh.edges["flank"][:, 2]
    one, two = (mesh.points[ends[:, i]] for i in (0, 1))
    for xi in (-0.5, 0.5):
        on_edge = 0.5 * xi * ((xi - 1.0) * one + (xi + 1.0) * two)
        on_edge += (1.0 - xi**2) * mesh.points[mids]
        assert distance_to_involute(pinion, on_edge).max() < 300 * NANOMETRE


def test_fillet_nodes_lie_on_the_trochoid(pinion, mesh):
    dense = fillet_points(pinion, np.linspace(0.0, math.radians(70.0), 200_001))
    nodes = mesh.points[np.unique(mesh.edges["fillet"])]
    nearest = [np.hypot(*(dense - point).T).min() for point in nodes]
    assert max(nearest) < 20 * NANOMETRE  # spacing of the dense curve


def test_root_and_hub_nodes_lie_on_their_circles(pinion, mesh):
    for name, radius in (("root", pinion.root_radius), ("hub", pinion.hub_radius)):
        nodes = mesh.points[np.unique(mesh.edges[name])]
        np.testing.assert_allclose(np.hypot(*nodes.T), radius, rtol=1e-12)


def test_mesh_is_symmetric_and_cuts_match(pinion, mesh):
    right, left = (mesh.points[mesh.edges[n]] for n in ("cut", "left_cut"))
    np.testing.assert_array_equal(right * [-1.0, 1.0], left)
    angle = np.arctan2(right[..., 0], right[..., 1])
    np.testing.assert_allclose(angle, math.pi / pinion.teeth, rtol=1e-9)


def test_area_is_that_of_the_sector(pinion, mesh):
    corners = mesh.points[mesh.triangles[:, :3]]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    assert (area > 0.0).all()
    outline = [
        *[flank_points(pinion, s) for s in np.linspace(pinion.tip_roll_length,
                                                       pinion.form_roll_length, 400)],
        *fillet_points(pinion, np.linspace(math.radians(70.0), 0.0, 400)),
    ]  # fmt: skip
    x, y = np.array(outline).T
    half = np.trapezoid(-0.5 * (x * np.gradient(y) - y * np.gradient(x)))
    start = math.atan2(x[-1], y[-1])
    half += 0.5 * pinion.root_radius**2 * (math.pi / pinion.teeth - start)
    tip = pinion.half_angle(pinion.tip_radius)
    half += 0.5 * pinion.tip_radius**2 * tip
    half -= 0.5 * pinion.hub_radius**2 * math.pi / pinion.teeth
    assert area.sum() == pytest.approx(2.0 * half, rel=2e-3)  # straight sides


@pytest.mark.parametrize("teeth", [19, 38, 94, 200])
@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_elements_are_well_shaped(teeth, factor):
    hub = 0.5 * 2.54e-3 * teeth - 10e-3
    mesh = sector_mesh(make_gear(teeth, hub), MeshSize().refined(factor))
    assert smallest_jacobian(mesh) > 0.3


def test_mesh_is_graded(pinion, mesh):
    assert len(mesh.triangles) < 2000
    lengths = np.hypot(*np.diff(mesh.points[mesh.flank_nodes], axis=0).T)
    assert lengths[-1] / lengths[0] > 20.0


def test_meshing_is_deterministic(pinion, mesh):
    np.testing.assert_array_equal(sector_mesh(pinion).points, mesh.points)


def test_gmsh_is_closed_after_an_exception():
    gmsh = import_gmsh()
    with pytest.raises(ZeroDivisionError), gmsh_model("broken"):
        raise ZeroDivisionError
    assert not gmsh.isInitialized()
    with gmsh_model("again"):
        assert gmsh.isInitialized()


@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_mesh_files_read_back(tmp_path, pinion, mesh, suffix):
    path = tmp_path / f"gear{suffix}"
    write_mesh(mesh, path, copies=3, teeth=38)
    back = meshio.read(path)
    assert back.cells_dict["triangle6"].shape == (3 * len(mesh.triangles), 6)
    radius = np.hypot(*back.points[:, :2].T)
    assert radius.max() == pytest.approx(pinion.tip_radius)


def test_gmsh_opens_its_files(tmp_path, mesh):
    write_mesh(mesh, tmp_path / "gear.msh", copies=3, teeth=38)
    gmsh = import_gmsh()
    with gmsh_model("opened"):
        gmsh.merge(str(tmp_path / "gear.msh"))
        _, tags, nodes = gmsh.model.mesh.getElements(2)
        names = [gmsh.model.getPhysicalName(2, k + 1) for k in range(3)]
    assert len(tags[0]) == 3 * len(mesh.triangles)
    assert len(nodes[0]) == 6 * len(tags[0])
    assert names == ["tooth 1", "tooth 2", "tooth 3"]


def test_other_endings_are_refused(tmp_path, mesh):
    with pytest.raises(ValueError, match=r"\.msh or \.vtu"):
        write_mesh(mesh, tmp_path / "gear.stl")
