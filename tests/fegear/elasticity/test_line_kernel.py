"""The half-space's share over the width, against its integrals by plain quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fegear.elasticity.line_kernel import LineKernel, wedge_factor
from fegear.elasticity.width_functions import polynomial_values

WIDTH = 0.02
ARCS, ROLLS = np.array([0.001, 0.0021, 0.005]), np.array([0.02, 0.018, 0.012])
RADII = np.array([0.05, 0.049, 0.047])


def kernel(twist=0.0, tip_angle=2.0):
    angle = math.atan(twist * 0.045)
    return LineKernel(2e11, WIDTH, 2.5e-3, twist, angle, tip_angle)


def by_quadrature(line, i, j, degree):
    """Double integral (k, k), of points far enough apart for a smooth one."""
    node, weight = np.polynomial.legendre.leggauss(600)
    z = 0.5 * WIDTH * node
    functions, _ = polynomial_values(WIDTH, degree, z)
    functions = functions * (0.5 * WIDTH * weight)[:, None]
    roll, radius = 0.5 * (ROLLS[i] + ROLLS[j]), 0.5 * (RADII[i] + RADII[j])
    metric, apart = 1.0 + (line.twist * radius) ** 2, ARCS[i] - ARCS[j]
    dz, both = np.subtract.outer(z, z), np.add.outer(z, z)
    squared = apart**2 - 2.0 * line.twist * roll * apart * dz + metric * dz**2
    # an oblique reflection at the corner, along the helix
    corner = np.array([-line.twist * roll, math.sqrt(metric)])
    sine = 1.0 - (corner[0] / corner[1]) ** 2
    at_tip = 4.0 * ARCS[i] * ARCS[j] * sine
    values = 0.0
    for farther, of_tip in ((0.0, 1.0), (at_tip, line.tip_image)):
        values = values + of_tip * line.of_distance(np.sqrt(squared + farther))
        for side, strength in zip((-1.0, 1.0), line.images, strict=True):
            away = metric * (WIDTH - side * both) ** 2 + farther
            far = line.of_distance(np.sqrt(apart**2 + away))
            values += of_tip * strength * far
    return functions.T @ values @ functions / WIDTH**2


@pytest.mark.parametrize("twist", [0.0, 8.0, -8.0])
@pytest.mark.parametrize("places", [(0, 1), (0, 2), (2, 0)])
def test_projections_are_integrals(twist, places):
    line, (i, j) = kernel(twist), places
    projected = line.projected(ARCS, ROLLS, RADII, 5)[i, :, j]
    expected = by_quadrature(line, i, j, 5)
    assert np.abs(projected - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("twist", [0.0, 8.0])
def test_a_point_itself_lacks_its_logarithm(twist):
    """As Flamant's kernel, of which the finite part in the point is zero."""
    line, step = kernel(twist), 1e-6
    arcs, rolls, radii = np.array([1e-3, 1e-3 + step]), ROLLS[[0, 0]], RADII[[0, 0]]
    projected = line.projected(arcs, rolls, radii, 4)
    logarithm = -2.0 * math.log(step) / (math.pi * line.modulus * WIDTH)
    logarithm /= math.hypot(1.0, twist * RADII[0])
    beside = projected[0, :, 1] - logarithm * np.eye(5)
    assert np.abs(projected[0, :, 0] - beside).max() < 1e-3 * np.abs(beside).max()


def test_a_mirrored_helix_swaps_the_ends():
    line, sign = kernel(8.0), (-1.0) ** np.arange(5)
    one = line.projected(ARCS, ROLLS, RADII, 4)
    two = line.mirrored.projected(ARCS, ROLLS, RADII, 4)
    expected = one * sign[:, None, None] * sign
    assert np.abs(two - expected).max() < 1e-12 * np.abs(one).max()


def test_a_square_end_doubles_what_its_edge_yields():
    assert kernel().images == (1.0, 1.0)
    low, high = kernel(8.0).images
    assert low > 1.0 > high > 0.0  # the acute end is softer


@pytest.mark.parametrize(
    ("degrees", "expected"), [(180.0, 1.0), (90.0, 3.3634), (120.0, 1.4346)]
)
def test_edges_of_wedges_yield_as_michell_has_it(degrees, expected):
    assert wedge_factor(math.radians(degrees)) == pytest.approx(expected, rel=1e-3)


def test_without_a_corner_there_is_no_image_at_it():
    assert kernel(tip_angle=math.pi).tip_image == pytest.approx(0.0, abs=1e-15)


def test_an_image_at_the_corner_is_a_reflection():
    """The image is where the corner reflects the force, on the oblique flank."""
    line, roll, metric = kernel(8.0), 0.02, 1.0 + (8.0 * 0.05) ** 2
    corner = np.array([-line.twist * roll, 0.0])
    corner[1] = math.sqrt(metric - corner[0] ** 2)  # along the helix, per width
    one, two = np.array([0.7e-3, 0.0]), 1.1e-3 * np.array([1.0, 0.0]) + 2e-3 * corner
    unit = corner / np.hypot(*corner)
    image = 2.0 * (two @ unit) * unit - two
    direct, reflected = np.sum((one - two) ** 2), np.sum((one - image) ** 2)
    farther = line.farther(np.array(0.7e-3), np.array(1.1e-3), roll, metric)
    assert reflected - direct == pytest.approx(float(farther), rel=1e-12)
