"""Bodies of many-teeth gears: layers that grow with the depth below the teeth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import MODULE, make_gear
from mesh_quality import smallest_jacobian

from meshes import MeshSize, sector_mesh
from meshes.layers import layer_radii
from meshes.outline import floor_radius


def gear_of(teeth, hub):
    """With a hub of so much of the reference radius."""
    return make_gear(teeth, hub * 0.5 * MODULE * teeth)


def sides(triangles):
    """Sides (3 n, 3) of triangles: ends by rising number, then mid-side."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    ends = np.sort(np.vstack([ends, triangles[:, [2, 0]]]), axis=1)
    return np.column_stack([ends, triangles[:, 3:].T.ravel()])


@pytest.mark.parametrize(("teeth", "hub"), [(20, 0.4), (38, 0.3), (300, 0.1)])
@pytest.mark.parametrize("refinement", [0.5, 1.0])
def test_sides_are_shared_or_on_a_named_boundary(teeth, hub, refinement):
    mesh = sector_mesh(gear_of(teeth, hub), MeshSize().refined(refinement))
    every, count = np.unique(sides(mesh.triangles), axis=0, return_counts=True)
    assert set(count) == {1, 2}
    named = np.concatenate(list(mesh.edges.values()))
    named = np.column_stack([np.sort(named[:, :2], axis=1), named[:, 2]])
    np.testing.assert_array_equal(every[count == 1], np.unique(named, axis=0))
    assert set(mesh.triangles.ravel()) == set(range(len(mesh.points)))


@pytest.mark.parametrize(("teeth", "hub"), [(38, 0.3), (300, 0.1), (1000, 0.02)])
def test_elements_are_not_distorted(teeth, hub):
    assert smallest_jacobian(sector_mesh(gear_of(teeth, hub))) > 0.6


def test_nodes_grow_with_the_logarithm_of_the_teeth():
    counts = [len(sector_mesh(gear_of(z, 0.1)).points) for z in (100, 1000, 10000)]
    assert counts[2] < 1.4 * counts[0]
    assert counts[2] - counts[1] == pytest.approx(counts[1] - counts[0], rel=0.3)


@pytest.mark.parametrize("hub", [0.02, 0.1, 0.5, 0.9])
def test_layers_grow_with_depth_and_with_the_radius(hub):
    gear, size = gear_of(300, hub), MeshSize()
    top = floor_radius(gear, size)
    radii = layer_radii(gear, size, top)
    assert radii[0] == top
    assert radii[-1] == pytest.approx(gear.hub_radius, rel=1e-12)
    thickness, middle = -np.diff(radii), 0.5 * (radii[1:] + radii[:-1])
    depth = np.minimum(gear.root_radius - middle, middle)
    allowed = np.maximum(size.body_growth * depth, size.hub_size * gear.module)
    assert (thickness < 1.25 * allowed).all()
    finer = layer_radii(gear, size.refined(2.0), top)
    assert len(finer) > 1.7 * len(radii)


def test_shallow_bodies_have_no_layers():
    gear = gear_of(20, 0.4)
    assert floor_radius(gear, MeshSize()) == gear.hub_radius
    deep = replace(gear, hub_radius=3e-3)
    assert floor_radius(deep, MeshSize()) > deep.hub_radius


@pytest.mark.parametrize("hub", np.linspace(0.5, 0.8, 16))
def test_round_off_makes_no_layer(hub):
    """Where triangles reach the hub the mesh ends there, whatever its last digit."""
    gear = make_gear(28, hub * 0.5 * MODULE * 28)
    assert floor_radius(gear, MeshSize()) == gear.hub_radius
    mesh = sector_mesh(gear, MeshSize())
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    assert (0.5 * (ux * vy - uy * vx)).min() > 1e-8 * gear.module**2
