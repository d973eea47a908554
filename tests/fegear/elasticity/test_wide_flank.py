"""Teeth under loads that vary over the width, against another program's elements.

CalculiX 2.20 with quadratic wedges (C3D15) on the section of `SIZE`, extruded along the
helix in 24 layers, hub and cuts held: `wide_tooth.csv` has the mean displacement over
layers along the normal, under a line load of 1 N/m, of 1 + 2 z / b N/m, and of 1 N/m
over the middle quarter of the width b. Quadratic wedges of code that shares only the
section mesh, which has the same values in 24 layers, gave those of 66 layers, as thin
as 0.05 mm at the ends. `wide_ring_tooth.csv` has the same of an internal gear, in 24
and in 56 layers, both by CalculiX; under the load that ends within the width a loaded
point has 2 % less in the latter, of the largest, where the load ends.
"""

from __future__ import annotations

import csv
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from conftest import make_gear
from slow_tests import first_are_quick

from fegear.elasticity.flank import (
    MAX_TOOTH_OFFSET,
    FlankCompliance,
    SectorRows,
    flamant_displacement,
    flamant_loads,
    half_plane_kernels,
    hold_cuts,
    nodal_loads,
    resolve_on_flank,
    sector_field,
)
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import RIGHT, cyclic_sector
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.wide_flank import (
    SHORT_END_LAYERS,
    WidthModes,
    tip_corner_angle,
    wide_flank,
    width_modes,
)
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width_functions import layered_polynomials, polynomial_values
from meshes import MeshSize, SpurGear
from meshes.helical import HelicalGear, HelicalInternalGear
from meshes.profile import flank_points, roll_length_at_arc

MODULE, TEETH, WIDTH = 4e-3, 26, 24e-3
STEEL = PlaneMaterial(2.1e11, 0.3, "strain")
SIZE = MeshSize().refined(0.35)
LOADS = {
    "uniform": np.ones_like,
    "linear": lambda z: 1.0 + 2.0 * z / WIDTH,
    "patch": lambda z: np.where(np.abs(z) <= 0.125 * WIDTH, 1.0, 0.0),
}
# inside and in the layers at both ends; largest found, over the largest of a line
ALLOWED = {("uniform", False): 0.004, ("linear", False): 0.004}
ALLOWED |= {("uniform", True): 0.005, ("linear", True): 0.0045}
ALLOWED |= {("patch", False): 0.0075, ("patch", True): 0.0075}
OTHER_PROGRAM = 0.0025, 0.013  # of 24 layers, inside and at the ends
RING = "ring"  # with the second helix angle
ALLOWED_OF_RING = {"uniform": (0.0045, 0.0105), "linear": (0.0055, 0.005)}
ALLOWED_OF_RING |= {"patch": (0.013, 0.0055)}
WHERE_A_LOAD_ENDS = 0.023  # layers of the other program are as far apart there


def gear(helix_angle_deg):
    """The gear of an angle, or `RING`."""
    if helix_angle_deg == RING:
        return HelicalInternalGear(
            teeth=40,
            module=MODULE,
            pressure_angle=math.radians(20.0),
            profile_shift=0.1,
            tip_radius=-19.2 * MODULE,
            dedendum=1.15 * MODULE,
            rack_tip_radius=0.3 * MODULE,
            hub_radius=-24.0 * MODULE,
            cutter_teeth=23,
            helix_angle=math.radians(15.8),
        )
    sizes = {
        "teeth": TEETH,
        "module": MODULE,
        "pressure_angle": math.radians(20.0),
        "profile_shift": 0.1,
        "tip_radius": (0.5 * TEETH + 1.1) * MODULE,
        "dedendum": 1.15 * MODULE,
        "rack_tip_radius": 0.3 * MODULE,
        "hub_radius": 0.55 * (0.5 * TEETH - 1.15) * MODULE,
    }
    if helix_angle_deg:
        return HelicalGear(**sizes, helix_angle=math.radians(helix_angle_deg))
    return SpurGear(**sizes)


def held(sector, loads):
    """Displacement of flank points (freedoms, n) of a sector with cuts and hub held."""
    solution = hold_cuts(sector, loads)
    ends = np.zeros((len(sector.cut), loads.force.shape[1]))
    field = sector_field(sector, SectorRows.of(sector, None), ends, solution)
    return field[sector.flanks[RIGHT].dofs.ravel()]


@cache
def held_tooth(helix_angle_deg, degree=8):
    """The compliance of a held sector, and what tells its mesh from a half-plane.

    Distances at which the half-plane yields as much as the mesh in a loaded point.
    """
    sector = cyclic_sector(gear(helix_angle_deg), STEEL, SIZE)
    flank, twisted = sector.flanks[RIGHT], TwistedSector(sector)
    layers = [layer * sector.gear.module for layer in SHORT_END_LAYERS]
    functions = layered_polynomials(WIDTH, degree, layers)
    wide = WideSector(twisted, functions, tuple(range(degree + 1)))
    in_section = sector.cyclic_constraint(1.0)[:, : len(sector.interior)]
    axial = twisted.axial_constraint(1.0)
    on_cut = np.unique(twisted.node_of[sector.cut])
    free = np.ones(axial.shape[1], bool)
    free[np.unique(axial[on_cut].indices)] = False
    solved = wide.solve((in_section, axial[:, np.flatnonzero(free)])).real
    by_mesh, _ = resolve_on_flank(flank, held(sector, nodal_loads(sector)))
    exact = held(sector, flamant_loads(sector))
    exact += flamant_displacement(sector, flank.dofs.ravel())
    remainder = resolve_on_flank(flank, exact)[0] - half_plane_kernels(sector)[0]
    logarithm = np.diag(by_mesh) - np.diag(remainder)
    distance = np.exp(-0.5 * math.pi * STEEL.modulus * logarithm)

    radius = np.hypot(sector.gear.base_radius, rolls(sector))
    cosine = 1.0 / np.hypot(1.0, sector.gear.twist * radius)
    plane = np.sqrt(np.outer(cosine, cosine)) * by_mesh / WIDTH
    table = solved[0] / WIDTH**2 - plane[:, None, :, None] * np.eye(degree + 1)[:, None]
    tables = np.zeros((2 * MAX_TOOTH_OFFSET + 1, *table.shape))
    tables[MAX_TOOTH_OFFSET] = table
    of_plane = np.zeros((2 * MAX_TOOTH_OFFSET + 1, *remainder.shape))
    of_plane[MAX_TOOTH_OFFSET] = remainder
    compliance = FlankCompliance(
        normal=of_plane,
        tangential=np.zeros_like(of_plane),
        flank_length=sector.gear.flank_length,
        grading=SIZE.flank_grading,
        modulus=STEEL.modulus,
        poisson=STEEL.poisson,
    )
    modes = WidthModes(flank.arcs, tables, np.zeros_like(tables))
    return sector, wide_flank(sector.gear, compliance, modes, WIDTH), distance


def rolls(sector):
    return roll_length_at_arc(sector.gear, sector.flanks[RIGHT].arcs)


def displacement(helix_angle_deg, load, loaded, point, places):
    """Along the normal at places (n,) of a point of the flank under a line load."""
    sector, flank, distance = held_tooth(helix_angle_deg)
    kernel, width = flank.kernel, flank.width
    node, weight = np.polynomial.legendre.leggauss(400)
    z, weights = 0.5 * width * node, 0.5 * width * weight
    at_place, _ = polynomial_values(width, flank.degree, places)
    at_load, _ = polynomial_values(width, flank.degree, z)
    table = flank.normal[MAX_TOOTH_OFFSET, point, :, loaded]
    smooth = at_place @ table @ (at_load.T @ (weights * load(z)))

    arcs, roll = sector.flanks[RIGHT].arcs, rolls(sector)
    apart, twist = arcs[point] - arcs[loaded], kernel.twist
    roll = 0.5 * (roll[point] + roll[loaded])
    metric = 1.0 + twist**2 * (sector.gear.base_radius**2 + roll**2)
    across = apart**2
    if point == loaded:
        across = distance[point] ** 2 * (1.0 - (twist * roll) ** 2 / metric)
    farther = kernel.farther(arcs[point], arcs[loaded], roll, metric)

    def share(squared):
        """Return the kernel of the force and of its image at the tip corner."""
        of_tip = kernel.of_distance(np.sqrt(squared + farther))
        return kernel.of_distance(np.sqrt(squared)) + kernel.tip_image * of_tip

    near = []
    for place in places:
        total = 0.0
        for end in (-0.5 * width, 0.5 * width):  # graded toward the place
            last = np.arcsinh(abs(end - place) / math.sqrt(across))
            step = math.sqrt(across) * np.sinh(0.5 * last * (1.0 + node))
            steps = 0.5 * last * weight * np.hypot(step, math.sqrt(across))
            away = math.copysign(1.0, end - place) * step
            squared = across + away * (2.0 * twist * roll * apart + metric * away)
            total += steps @ (share(squared) * load(place + away))
        for sign, strength in zip((-1.0, 1.0), kernel.images, strict=True):
            along = width - sign * (place + z)
            far = share(across + metric * along**2)
            total += strength * (weights @ (far * load(z)))
        near.append(total)
    return smooth + np.array(near)


def recorded(name="wide_tooth.csv"):
    """Ends of layers [mm], mean displacement by another program and in more layers.

    By helix angle, load, loaded point and point.
    """
    lines = {}
    path = Path(__file__).with_name(name)
    with path.open() as file:
        for row in csv.DictReader(file):
            key = float(row["helix_angle_deg"]), row["load"]
            key += int(row["loaded_point"]), int(row["point"])
            names = "from_mm", "to_mm", "displacement_m2_per_N", "refined_m2_per_N"
            lines.setdefault(key, []).append([float(row[name]) for name in names])
    return {key: np.array(values).T for key, values in lines.items()}


@pytest.mark.parametrize("helix_angle_deg", first_are_quick([15.8, 0.0, 30.0], 1))
@pytest.mark.parametrize("load", sorted(LOADS))
def test_teeth_yield_as_those_of_another_program(helix_angle_deg, load):
    compared = 0
    node, weight = np.polynomial.legendre.leggauss(5)
    for (helix, name, loaded, point), values in recorded().items():
        if (helix, name) != (helix_angle_deg, load):
            continue
        low, high, by_other_program, expected = values
        places = 0.5 * ((low + high)[:, None] + (high - low)[:, None] * node)
        lines = displacement(
            helix, LOADS[name], loaded, point, 1e-3 * places.ravel()
        ).reshape(places.shape)
        ours = lines @ (0.5 * weight)
        apart = np.abs(ours - expected) / np.abs(expected).max()
        assert apart[1:-1].max() < ALLOWED[name, False]
        assert apart[[0, -1]].max() < ALLOWED[name, True]
        layers = np.abs(by_other_program - expected) / np.abs(expected).max()
        assert layers[1:-1].max() < OTHER_PROGRAM[0]
        assert layers[[0, -1]].max() < OTHER_PROGRAM[1]
        compared += 1
    assert compared == 9


@pytest.mark.parametrize("load", first_are_quick(sorted(LOADS), 1))
def test_teeth_of_a_ring_yield_as_those_of_another_program(load):
    node, weight = np.polynomial.legendre.leggauss(5)
    inside, at_ends = ALLOWED_OF_RING[load]
    lines = recorded("wide_ring_tooth.csv")
    assert len(lines) == 27
    for (_, name, loaded, point), (low, high, _, expected) in lines.items():
        if name != load:
            continue
        places = 0.5 * ((low + high)[:, None] + (high - low)[:, None] * node)
        ours = displacement(RING, LOADS[load], loaded, point, 1e-3 * places.ravel())
        ours = ours.reshape(places.shape) @ (0.5 * weight)
        apart = np.abs(ours - expected) / np.abs(expected).max()
        is_cut = load == "patch" and point == loaded
        assert apart[1:-1].max() < (WHERE_A_LOAD_ENDS if is_cut else inside)
        assert apart[[0, -1]].max() < at_ends


def test_acute_ends_yield_more():
    """By a quarter at 15.8 degrees, and obtuse ones less, than the middle."""
    places = np.array([-0.5, 0.0, 0.5]) * WIDTH
    low, middle, high = displacement(15.8, LOADS["uniform"], 5, 5, places)
    assert low / middle == pytest.approx(1.24, abs=0.06)
    assert high / middle == pytest.approx(0.83, abs=0.06)


def test_reciprocity_over_the_width():
    material = PlaneMaterial(2.1e11, 0.3, "width", WIDTH)
    modes = width_modes(gear(20.0), material, 3, MeshSize().refined(0.25))
    mirrored = modes.normal[::-1].transpose(0, 3, 4, 1, 2)
    assert np.abs(modes.normal - mirrored).max() < 1e-12 * np.abs(modes.normal).max()


@pytest.mark.parametrize("teeth", [17, 26, 60])
def test_the_corner_at_the_tip_is_that_of_the_outline(teeth):
    """Between the flank and the circle of the tips, on the side of the material."""
    gear = make_gear(teeth, 10e-3)
    roll = gear.tip_roll_length * np.array([1.0, 1.0 - 1e-6])
    tip, inside = np.asarray(flank_points(gear, roll)).reshape(-1, 2)
    along_flank = inside - tip
    toward_middle = np.array([-np.sign(tip[0]), 0.0])
    along_land = toward_middle - tip * (toward_middle @ tip) / (tip @ tip)
    cosine = along_flank @ along_land
    cosine /= np.linalg.norm(along_flank) * np.linalg.norm(along_land)
    assert tip_corner_angle(gear) == pytest.approx(math.acos(cosine), abs=1e-5)
