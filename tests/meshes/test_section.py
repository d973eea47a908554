"""Area and polar moment between bore and outline, against polygons and the mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import make_gear
from whole_gear import small_ring

from meshes import MeshSize, sector_mesh
from meshes.outline import half_sector_outline
from meshes.profile import turn
from meshes.section import section_area, section_polar_moment

GEARS = {
    "pinion": make_gear(38, 15e-3),
    "wheel": make_gear(55, 20e-3),
    "shifted": make_gear(25, 8e-3, profile_shift=0.4, tip_radius=35.3e-3),
    "few-teeth": make_gear(19, 8e-3, profile_shift=0.1),
    "undercut": make_gear(12, 4e-3, tip_radius=2.54e-3 * 7.0),
    "steep": make_gear(
        30, 9e-3, pressure_angle=math.radians(28.0), rack_tip_radius=4e-4
    ),
    "large": make_gear(300, 40e-3),
    "internal": small_ring(24),
}


def polygon_integrals(points):
    """Area and polar moment within a closed polygon, from its triangles about 0."""
    one, two = points, np.roll(points, -1, axis=0)
    cross = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    squares = (one**2 + one * two + two**2).sum(axis=1)
    return abs(0.5 * cross.sum()), abs((cross * squares).sum()) / 12.0


@pytest.mark.parametrize("gear", GEARS.values(), ids=GEARS)
def test_moments_are_those_of_a_polygon_of_many_sides(gear):
    size = MeshSize(flank_edges=2000, fillet_edges=2000, tooth_size=1e-3)
    half = np.concatenate([e.vertices[:-1] for e in half_sector_outline(gear, size)])
    half = np.vstack([[[0.0, gear.tip_radius]], half])
    sector = np.vstack([half[1:][::-1] * [-1.0, 1.0], half])
    area, moment = polygon_integrals(
        np.vstack([turn(sector, i * gear.pitch_angle) for i in range(gear.teeth)])
    )
    bore = gear.hub_radius
    area = gear.sign * (area - math.pi * bore**2)
    moment = gear.sign * (moment - 0.5 * math.pi * bore**4)
    assert section_area(gear) == pytest.approx(area, rel=2e-6)
    assert section_polar_moment(gear) == pytest.approx(moment, rel=2e-6)


@pytest.mark.parametrize("gear", GEARS.values(), ids=GEARS)
def test_moments_are_those_of_the_mesh(gear):
    """Quadrature over the curved triangles; they cut corners of the outline."""
    mesh = sector_mesh(gear)
    area, moment = mesh_integrals(mesh)
    assert section_area(gear) == pytest.approx(gear.teeth * area, rel=1e-5)
    assert section_polar_moment(gear) == pytest.approx(gear.teeth * moment, rel=1e-5)


def mesh_integrals(mesh):
    """Area and polar moment of six-node triangles by a product rule on the square."""
    x, weight = np.polynomial.legendre.leggauss(6)
    one, two = np.meshgrid(0.5 * (1.0 + x), 0.5 * (1.0 + x))
    s, t = (one * (1.0 - two)).ravel(), two.ravel()
    w = (0.25 * np.outer(weight, weight) * (1.0 - two)).ravel()
    u = 1.0 - s - t
    shape = [u * (2 * u - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * u * s, 4 * s * t]
    shape = np.array([*shape, 4 * t * u])
    by_s = np.array([1 - 4 * u, 4 * s - 1, 0 * s, 4 * (u - s), 4 * t, -4 * t])
    by_t = np.array([1 - 4 * u, 0 * s, 4 * t - 1, -4 * s, 4 * s, 4 * (u - t)])
    nodes = mesh.points[mesh.triangles]
    place, along_s, along_t = (
        np.einsum("eac,aq->ceq", nodes, values) for values in (shape, by_s, by_t)
    )
    scale = along_s[0] * along_t[1] - along_s[1] * along_t[0]
    return (scale @ w).sum(), (((place**2).sum(axis=0) * scale) @ w).sum()
